// Straight lines and round handles of a width in pixels: one instance each, six vertices that make a
// quadrilateral. Colours are premultiplied sRGB.

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) colour: vec4f,
    // Pixels across the line, or from the handle's middle.
    @location(1) offset: vec2f,
    @location(2) @interpolate(flat) radius: f32,
    // In model units.
    @location(3) position: vec3f,
}

fn shifted(clip: vec4f, pixels: vec2f) -> vec4f {
    // Lines have soft edges, and are at the same place in all pictures of a mean: else their edges would get
    // softer.
    let aside = pixels * 2.0 / frame.viewport.xy - vec2f(frame.key_light.w, frame.fill_light.w);
    // A little nearer than the faces that the line runs along.
    return vec4f(clip.xy + aside * clip.w, clip.z - 2e-5 * clip.w, clip.w);
}

@vertex
fn vs_line(
    @builtin(vertex_index) i: u32,
    @location(0) from_point: vec3f,
    @location(1) to_point: vec3f,
    @location(2) colour: vec4f,
    @location(3) width: f32,
) -> Vertex {
    let first = frame.view_projection * vec4f(from_point, 1.0);
    let second = frame.view_projection * vec4f(to_point, 1.0);
    let at = vec2f(moved(first, second), 1.0 - moved(second, first));
    let a = mix(first, second, at.x);
    let b = mix(first, second, at.y);
    let radius = 0.5 * width * frame.viewport.z;
    // One pixel more on each side for a soft edge.
    let reach = radius + 1.0;
    let c = square_corner(i);
    let across = beside_line(a, b) * c.y * reach;
    let position = mix(from_point, to_point, select(at.x, at.y, c.x > 0.0));
    return Vertex(shifted(select(a, b, c.x > 0.0), across), colour, vec2f(0.0, c.y * reach), radius, position);
}

@vertex
fn vs_handle(
    @builtin(vertex_index) i: u32,
    @location(0) middle: vec3f,
    @location(2) colour: vec4f,
    @location(3) width: f32,
) -> Vertex {
    let radius = 0.5 * width * frame.viewport.z;
    let offset = square_corner(i) * (radius + 1.0);
    return Vertex(shifted(frame.view_projection * vec4f(middle, 1.0), offset), colour, offset, radius, middle);
}

@fragment
fn fs_line(in: Vertex) -> @location(0) vec4f {
    return in.colour * clamp(in.radius + 0.5 - abs(in.offset.y), 0.0, 1.0);
}

@fragment
fn fs_list(in: Vertex) -> @location(0) vec4f {
    let colour = in.colour * clamp(in.radius + 0.5 - abs(in.offset.y), 0.0, 1.0);
    if colour.a > 0.0 {
        // In front of faces that the line runs along.
        append_colour(in.clip, in.position, colour, 1e-4);
    }
    return vec4f(0.0);
}

// Hidden parts of lines shine through a little.
@fragment
fn fs_hidden(in: Vertex) -> @location(0) vec4f {
    return in.colour * (0.22 * clamp(in.radius + 0.5 - abs(in.offset.y), 0.0, 1.0));
}

// A disc with a dark rim.
@fragment
fn fs_handle(in: Vertex) -> @location(0) vec4f {
    let away = length(in.offset);
    let inside = clamp(in.radius + 0.5 - away, 0.0, 1.0);
    let core = clamp(in.radius - 2.0 * frame.viewport.z + 0.5 - away, 0.0, 1.0);
    return mix(vec4f(0.05, 0.06, 0.08, 1.0), in.colour, core) * inside;
}
