// Lists, for each pixel, the faces of the boundary through which its ray enters the volume. Each pixel has a linked list: `heads`
// has one more than the number of its first node, `nodes` the face and the next one. The first number in `heads` counts the nodes.

@group(1) @binding(0) var<storage, read> points: array<vec4f>;
// Three points, and the tetrahedron behind.
@group(1) @binding(1) var<storage, read> faces: array<vec4u>;
@group(1) @binding(2) var<storage, read_write> heads: array<atomic<u32>>;
@group(1) @binding(3) var<storage, read_write> nodes: array<vec2u>;

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
    let node = atomicAdd(&heads[0], 1u);
    // Without room the ray does not enter here; the renderer makes more room for the next picture.
    if node < arrayLength(&nodes) {
        let pixel = u32(in.clip.y) * u32(frame.viewport.x) + u32(in.clip.x);
        nodes[node] = vec2u(in.face, atomicExchange(&heads[1u + pixel], node + 1u));
    }
    return vec4f(0.0);
}
