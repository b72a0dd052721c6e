// Tetrahedra as they are: whole behind a plane, shrunk, as wires; and the points of the mesh.

// Position and value.
@group(1) @binding(1) var<storage, read> points: array<vec4f>;
// The points of each tetrahedron.
@group(1) @binding(2) var<storage, read> tets: array<vec4u>;
// A value for each tetrahedron, if the style says so.
@group(1) @binding(3) var<storage, read> tet_values: array<f32>;
// Faces, four times the tetrahedron plus the corner opposite to the face; or edges, three numbers each: two points and
// a tetrahedron; or points, two numbers each: a point and a tetrahedron.
@group(1) @binding(4) var<storage, read> parts: array<u32>;
// Where each point goes, if they have moves (w unused).
@group(1) @binding(5) var<storage, read> moves: array<vec4f>;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) value: f32,
    @location(2) @interpolate(flat) face: vec3f,
    @location(3) sides: vec3f,
    // Where the place was before it was displaced.
    @location(4) rest: vec3f,
}

// A free place.
const NONE = 0xffffffffu;

// Corners of face k, which is opposite to corner k, counter-clockwise from outside.
const FACES = array<vec3u, 4>(vec3u(1u, 2u, 3u), vec3u(0u, 3u, 2u), vec3u(0u, 1u, 3u), vec3u(0u, 2u, 1u));

// A point where it goes, and its value.
fn displaced(point: u32) -> vec4f {
    if HAS_MOVES {
        return points[point] + vec4f(frame.moved.x * moves[point].xyz, 0.0);
    }
    return points[point];
}

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Vertex {
    let tet = tets[i / 12u];
    // Outside of the picture.
    let nothing = Vertex(vec4f(2.0, 2.0, 2.0, 1.0), vec3f(0.0), 0.0, vec3f(0.0), vec3f(0.0), vec3f(0.0));
    if tet.x == NONE {
        return nothing;
    }
    let corners = array<vec4f, 4>(points[tet.x], points[tet.y], points[tet.z], points[tet.w]);
    let centroid = 0.25 * (corners[0].xyz + corners[1].xyz + corners[2].xyz + corners[3].xyz);
    if dot(style.cut.xyz, centroid) > style.cut.w {
        return nothing;
    }
    return corner(i / 12u, i % 12u / 3u, i % 3u, 1.0 - style.shape.z);
}

// An outer face of whole tetrahedra.
@vertex
fn vs_face(@builtin(vertex_index) i: u32) -> Vertex {
    let part = parts[i / 3u];
    return corner(part / 4u, part % 4u, i % 3u, 1.0);
}

// Corner k of a face of a tetrahedron, of which so much is kept.
fn corner(t: u32, number: u32, k: u32, kept: f32) -> Vertex {
    var faces = FACES;
    let face = faces[number];
    let tet = tets[t];
    let corners = array<vec4f, 4>(displaced(tet.x), displaced(tet.y), displaced(tet.z), displaced(tet.w));
    let centroid = 0.25 * (corners[0].xyz + corners[1].xyz + corners[2].xyz + corners[3].xyz);
    let p = array<vec3f, 3>(
        mix(centroid, corners[face.x].xyz, kept),
        mix(centroid, corners[face.y].xyz, kept),
        mix(centroid, corners[face.z].xyz, kept),
    );
    var value = corners[face[k]].w;
    if style.clips.y > 0u {
        value = tet_values[t];
    }
    var rest = p[k];
    if HAS_MOVES {
        let middle = 0.25 * (points[tet.x].xyz + points[tet.y].xyz + points[tet.z].xyz + points[tet.w].xyz);
        rest = mix(middle, points[tet[face[k]]].xyz, kept);
    }
    return Vertex(
        frame.view_projection * vec4f(p[k], 1.0),
        p[k],
        value,
        cross(p[1] - p[0], p[2] - p[0]),
        vec3f(f32(k == 0u), f32(k == 1u), f32(k == 2u)),
        rest,
    );
}

// Of whole tetrahedra fronts alone are drawn.
fn seen(in: Vertex) -> Seen {
    return Seen(in.position, in.face, in.face, true, in.value, in.sides, dpdx(in.sides), dpdy(in.sides));
}

@fragment
fn fs(in: Vertex) -> @location(0) vec4f {
    let what = seen(in);
    if HAS_CLIPS && is_clipped(in.rest, style.clips.x) {
        discard;
    }
    return vec4f(shaded(what).rgb, 1.0);
}

struct EdgePoint {
    @builtin(position) clip: vec4f,
    // Before it was displaced.
    @location(0) rest: vec3f,
    @location(1) value: f32,
}

// An edge as a line of a width in pixels.
@vertex
fn vs_edge(@builtin(vertex_index) i: u32) -> EdgePoint {
    let first = 3u * (i / 6u);
    let from_point = displaced(parts[first]);
    let to_point = displaced(parts[first + 1u]);
    let from_clip = frame.view_projection * vec4f(from_point.xyz, 1.0);
    let to_clip = frame.view_projection * vec4f(to_point.xyz, 1.0);
    let at = vec2f(moved(from_clip, to_clip), 1.0 - moved(to_clip, from_clip));
    let a = mix(from_clip, to_clip, at.x);
    let b = mix(from_clip, to_clip, at.y);
    let c = square_corner(i % 6u);
    let radius = 0.5 * max(style.shape.x * frame.viewport.z, 1.0);
    let aside = beside_line(a, b) * c.y * radius * 2.0 / frame.viewport.xy;
    let end = select(a, b, c.x > 0.0);
    let place = mix(points[parts[first]], points[parts[first + 1u]], select(at.x, at.y, c.x > 0.0));
    var value = place.w;
    if style.clips.y > 0u {
        value = tet_values[parts[first + 2u]];
    }
    return EdgePoint(vec4f(end.xy + aside * end.w, end.zw), place.xyz, value);
}

@fragment
fn fs_edge(in: EdgePoint) -> @location(0) vec4f {
    if HAS_CLIPS && is_clipped(in.rest, style.clips.x) {
        discard;
    }
    var colour = style.edge.rgb;
    if HAS_VALUES {
        colour = encode(mapped(in.value));
    }
    return vec4f(colour, 1.0);
}

struct Point {
    @builtin(position) clip: vec4f,
    // Before it was displaced.
    @location(0) rest: vec3f,
    @location(1) value: f32,
    // From -1 to 1 over the square around the disc.
    @location(2) offset: vec2f,
}

@vertex
fn vs_point(@builtin(vertex_index) i: u32, @builtin(instance_index) part: u32) -> Point {
    let number = parts[2u * part];
    let point = points[number];
    var value = point.w;
    if style.clips.y > 0u {
        value = tet_values[parts[2u * part + 1u]];
    }
    let offset = square_corner(i);
    let middle = frame.view_projection * vec4f(displaced(number).xyz, 1.0);
    let pixels = 0.5 * style.shape.w * frame.viewport.z * offset;
    let clip = vec4f(middle.xy + pixels * 2.0 * middle.w / frame.viewport.xy, middle.zw);
    return Point(clip, point.xyz, value, offset);
}

// A ball of the point's colour.
@fragment
fn fs_point(in: Point) -> @location(0) vec4f {
    let across = dot(in.offset, in.offset);
    if across > 1.0 || (HAS_CLIPS && is_clipped(in.rest, style.clips.x)) {
        discard;
    }
    var albedo = style.front.rgb;
    if HAS_VALUES {
        albedo = mapped(in.value);
    }
    return vec4f(encode(albedo * (0.45 + 0.75 * sqrt(1.0 - across))), 1.0);
}
