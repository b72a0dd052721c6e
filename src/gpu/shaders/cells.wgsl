// Tetrahedra as they are: whole behind a plane, shrunk, as wires; and the points of the mesh.

// Position and value.
@group(1) @binding(1) var<storage, read> points: array<vec4f>;
// The points of each tetrahedron.
@group(1) @binding(2) var<storage, read> tets: array<vec4u>;
// A value for each tetrahedron, if the style says so.
@group(1) @binding(3) var<storage, read> tet_values: array<f32>;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) value: f32,
    @location(2) @interpolate(flat) face: vec3f,
    @location(3) sides: vec3f,
}

// A free place.
const NONE = 0xffffffffu;

// Corners of face k, which is opposite to corner k, counter-clockwise from outside.
const FACES = array<vec3u, 4>(vec3u(1u, 2u, 3u), vec3u(0u, 3u, 2u), vec3u(0u, 1u, 3u), vec3u(0u, 2u, 1u));

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Vertex {
    let tet = tets[i / 12u];
    // Outside of the picture.
    let nothing = Vertex(vec4f(2.0, 2.0, 2.0, 1.0), vec3f(0.0), 0.0, vec3f(0.0), vec3f(0.0));
    if tet.x == NONE {
        return nothing;
    }
    let corners = array<vec4f, 4>(points[tet.x], points[tet.y], points[tet.z], points[tet.w]);
    let centroid = 0.25 * (corners[0].xyz + corners[1].xyz + corners[2].xyz + corners[3].xyz);
    if dot(style.cut.xyz, centroid) > style.cut.w {
        return nothing;
    }
    var faces = FACES;
    let face = faces[i % 12u / 3u];
    let k = i % 3u;
    let kept = 1.0 - style.shape.z;
    let p = array<vec3f, 3>(
        mix(centroid, corners[face.x].xyz, kept),
        mix(centroid, corners[face.y].xyz, kept),
        mix(centroid, corners[face.z].xyz, kept),
    );
    var value = corners[face[k]].w;
    if style.clips.y > 0u {
        value = tet_values[i / 12u];
    }
    return Vertex(
        frame.view_projection * vec4f(p[k], 1.0),
        p[k],
        value,
        cross(p[1] - p[0], p[2] - p[0]),
        vec3f(f32(k == 0u), f32(k == 1u), f32(k == 2u)),
    );
}

// Of whole tetrahedra fronts alone are drawn.
fn seen(in: Vertex) -> Seen {
    return Seen(in.position, in.face, in.face, true, in.value, in.sides, fwidth(in.sides));
}

@fragment
fn fs(in: Vertex) -> @location(0) vec4f {
    let what = seen(in);
    if is_clipped(in.position, style.clips.x) {
        discard;
    }
    return vec4f(shaded(what).rgb, 1.0);
}

// Edges alone.
@fragment
fn fs_wire(in: Vertex) -> @location(0) vec4f {
    let what = seen(in);
    let width = 0.5 * max(style.shape.x * frame.viewport.z, 1.0);
    if nearest_side(what) > width || is_clipped(in.position, style.clips.x) {
        discard;
    }
    var colour = style.edge.rgb;
    if style.back.w > 0.0 {
        colour = encode(mapped(in.value));
    }
    return vec4f(colour, 1.0);
}

struct Point {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) value: f32,
    // From -1 to 1 over the square around the disc.
    @location(2) offset: vec2f,
}

@vertex
fn vs_point(@builtin(vertex_index) i: u32, @builtin(instance_index) number: u32) -> Point {
    let point = points[number];
    let offset = square_corner(i);
    let middle = frame.view_projection * vec4f(point.xyz, 1.0);
    let pixels = 0.5 * style.shape.w * frame.viewport.z * offset;
    let clip = vec4f(middle.xy + pixels * 2.0 * middle.w / frame.viewport.xy, middle.zw);
    return Point(clip, point.xyz, point.w, offset);
}

// A ball of the point's colour.
@fragment
fn fs_point(in: Point) -> @location(0) vec4f {
    let across = dot(in.offset, in.offset);
    if across > 1.0 || is_clipped(in.position, style.clips.x) {
        discard;
    }
    var albedo = decode(style.front.rgb);
    if style.back.w > 0.0 {
        albedo = mapped(in.value);
    }
    return vec4f(encode(albedo * (0.45 + 0.75 * sqrt(1.0 - across))), 1.0);
}
