// Fragments that are not opaque, in a linked list for each pixel. `heads` has one more than the number of the
// first node of each pixel; its first number counts the nodes. A node is three numbers: the bits of the
// distance along the pixel's ray; what is there, which is a face of the boundary through which the ray enters
// the volume, or a colour, premultiplied, a byte a channel; and one more than the number of the next node,
// whose top bit says which of both.

@group(2) @binding(0) var<storage, read_write> heads: array<atomic<u32>>;
@group(2) @binding(1) var<storage, read_write> nodes: array<u32>;

const IS_COLOUR = 0x80000000u;

fn append(pixel: vec4f, distance: f32, content: u32, kind: u32) {
    let node = atomicAdd(&heads[0], 1u);
    // Without room it is lost; the renderer makes more room for the next picture.
    if node < arrayLength(&nodes) / 3u {
        let place = u32(pixel.y) * u32(frame.viewport.x) + u32(pixel.x);
        let next = atomicExchange(&heads[1u + place], node + 1u);
        nodes[3u * node] = bitcast<u32>(distance);
        nodes[3u * node + 1u] = content;
        nodes[3u * node + 2u] = next | kind;
    }
}

// `nearer` is how much nearer than it is it counts, as a part of its distance.
fn append_colour(pixel: vec4f, position: vec3f, premultiplied: vec4f, nearer: f32) {
    let ray = ray_of(pixel.xy);
    let distance = (1.0 - nearer) * dot(position - ray.origin, ray.direction);
    append(pixel, distance, pack4x8unorm(premultiplied), IS_COLOUR);
}
