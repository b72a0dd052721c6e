// A finished picture, added to the mean of several, or shown.

@group(1) @binding(0) var picture: texture_2d<f32>;
@group(1) @binding(1) var smooth_sampler: sampler;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) place: vec2f,
}

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Vertex {
    let clip = over_screen(i, 0.0);
    return Vertex(clip, clip.xy * vec2f(0.5, -0.5) + 0.5);
}

@fragment
fn fs(in: Vertex) -> @location(0) vec4f {
    return textureSampleLevel(picture, smooth_sampler, in.place, 0.0);
}
