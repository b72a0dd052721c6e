// Lists, for each pixel, the faces of the boundary through which its ray enters the volume.

@group(1) @binding(0) var<storage, read> points: array<vec4f>;
// Three points, and the tetrahedron behind.
@group(1) @binding(1) var<storage, read> faces: array<vec4u>;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) face: u32,
}

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Vertex {
    let face = faces[i / 3u];
    let corner = i % 3u;
    let point = select(select(face.x, face.y, corner == 1u), face.z, corner == 2u);
    return Vertex(frame.view_projection * vec4f(points[point].xyz, 1.0), i / 3u);
}

@fragment
fn fs(in: Vertex) -> @location(0) vec4f {
    let face = faces[in.face];
    let across = across_of(ray_of(in.clip.xy));
    let place = crossing(seen(face.x, across), seen(face.y, across), seen(face.z, across));
    append(in.clip, place.x, in.face, 0u);
    return vec4f(0.0);
}
