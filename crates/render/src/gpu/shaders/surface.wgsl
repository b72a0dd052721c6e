// Triangles of a surface: isosurfaces, slices, boundaries, tubes, arrows. Corners are read from buffers, so that each
// triangle knows its sides.

// Three numbers a vertex.
@group(1) @binding(1) var<storage, read> positions: array<f32>;
@group(1) @binding(2) var<storage, read> normals: array<f32>;
@group(1) @binding(3) var<storage, read> values: array<f32>;
// Three corners a triangle; the top bit of corner k says that the side from it to the next one is no edge.
@group(1) @binding(4) var<storage, read> indices: array<u32>;
// If there are some: where each vertex goes, and, if style.clips.z is 12 and not 3, how that changes along x, y and z.
@group(1) @binding(5) var<storage, read> moves: array<f32>;

const IS_INNER = 0x80000000u;

// Interpolated inside of the triangle also where it covers the pixel only in part: outside of a sliver the normal may
// be anything.
struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(perspective, centroid) position: vec3f,
    @location(1) @interpolate(perspective, centroid) normal: vec3f,
    @location(2) @interpolate(perspective, centroid) value: f32,
    @location(3) @interpolate(flat) face: vec3f,
    @location(4) sides: vec3f,
    // Where the place was before it was displaced.
    @location(5) @interpolate(perspective, centroid) rest: vec3f,
}

fn three(v: u32) -> vec3f {
    return vec3f(positions[3u * v], positions[3u * v + 1u], positions[3u * v + 2u]);
}

// How far three numbers of `moves` go.
fn moved_by(first: u32) -> vec3f {
    return frame.moved.x * vec3f(moves[first], moves[first + 1u], moves[first + 2u]);
}

fn displaced(v: u32) -> vec3f {
    if HAS_MOVES {
        return three(v) + moved_by(style.clips.z * v);
    }
    return three(v);
}

// The normal of the displaced surface. Twin: `turned` in `view/moves.rs`.
fn turned(normal: vec3f, v: u32) -> vec3f {
    if style.clips.z != 12u {
        return normal;
    }
    let x = vec3f(1.0, 0.0, 0.0) + moved_by(12u * v + 3u);
    let y = vec3f(0.0, 1.0, 0.0) + moved_by(12u * v + 6u);
    let z = vec3f(0.0, 0.0, 1.0) + moved_by(12u * v + 9u);
    return mat3x3f(cross(y, z), cross(z, x), cross(x, y)) * normal;
}

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Vertex {
    let first = i - i % 3u;
    let packed = vec3u(indices[first], indices[first + 1u], indices[first + 2u]);
    let corners = packed & vec3u(~IS_INNER);
    let p = array<vec3f, 3>(displaced(corners.x), displaced(corners.y), displaced(corners.z));
    let v = corners[i % 3u];
    // A side that is no edge is never near: the corner opposite to it has 1 everywhere.
    let is_corner = vec3f(f32(i % 3u == 0u), f32(i % 3u == 1u), f32(i % 3u == 2u));
    let inner = (packed.yzx & vec3u(IS_INNER)) != vec3u(0u);
    var normal = vec3f(0.0);
    if LIGHT == 0u {
        normal = vec3f(normals[3u * v], normals[3u * v + 1u], normals[3u * v + 2u]);
        if HAS_MOVES {
            normal = turned(normal, v);
        }
    }
    var value = 0.0;
    if HAS_VALUES {
        value = values[v];
    }
    let position = p[i % 3u];
    return Vertex(
        frame.view_projection * vec4f(position, 1.0),
        position,
        normal,
        value,
        cross(p[1] - p[0], p[2] - p[0]),
        select(is_corner, vec3f(1.0), inner),
        three(v),
    );
}

// Where planes cut.
fn cut_place(in: Vertex) -> vec3f {
    if HAS_MOVES {
        return in.rest;
    }
    return in.position;
}

fn seen(in: Vertex, is_front: bool) -> Seen {
    return Seen(in.position, in.normal, in.face, is_front, in.value, in.sides, dpdx(in.sides), dpdy(in.sides));
}

@fragment
fn fs(in: Vertex, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let what = seen(in, is_front);
    if HAS_CLIPS && is_clipped(cut_place(in), style.clips.x) {
        discard;
    }
    return vec4f(shaded(what).rgb, 1.0);
}

@fragment
fn fs_list(in: Vertex, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let colour = shaded(seen(in, is_front));
    if !HAS_CLIPS || !is_clipped(cut_place(in), style.clips.x) {
        append_colour(in.clip, in.position, vec4f(colour.rgb * colour.a, colour.a), 0.0);
    }
    return vec4f(0.0);
}
