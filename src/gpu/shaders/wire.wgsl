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

// Corners of the quadrilateral's two triangles: x along (0 or 1), y across (-1 or 1).
fn corner(i: u32) -> vec2f {
    let x = f32(i == 1u || i == 2u || i == 4u);
    let y = select(-1.0, 1.0, i == 2u || i == 4u || i == 5u);
    return vec2f(x, y);
}

fn shifted(clip: vec4f, pixels: vec2f) -> vec4f {
    // Lines have soft edges, and are at the same place in all pictures of a mean: else their edges would get
    // softer.
    let aside = pixels * 2.0 / frame.viewport.xy - vec2f(frame.key_light.w, frame.fill_light.w);
    // A little nearer than the faces that the line runs along.
    return vec4f(clip.xy + aside * clip.w, clip.z - 2e-5 * clip.w, clip.w);
}

// How far an end of a line is moved along it, to the near side of the camera's plane; 0 to 1.
fn moved(end: vec4f, other: vec4f) -> f32 {
    let nearest = 1e-4 * max(abs(end.w), abs(other.w));
    return select((nearest - end.w) / (other.w - end.w), 0.0, end.w >= nearest || other.w <= nearest);
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
    let along = (b.xy / b.w - a.xy / a.w) * frame.viewport.xy;
    let direction = select(vec2f(1.0, 0.0), normalize(along), dot(along, along) > 1e-12);
    let radius = 0.5 * width * frame.viewport.z;
    // One pixel more on each side for a soft edge.
    let reach = radius + 1.0;
    let c = corner(i);
    let across = vec2f(-direction.y, direction.x) * c.y * reach;
    let position = mix(from_point, to_point, mix(at.x, at.y, c.x));
    return Vertex(shifted(select(a, b, c.x > 0.5), across), colour, vec2f(0.0, c.y * reach), radius, position);
}

@vertex
fn vs_handle(
    @builtin(vertex_index) i: u32,
    @location(0) middle: vec3f,
    @location(2) colour: vec4f,
    @location(3) width: f32,
) -> Vertex {
    let radius = 0.5 * width * frame.viewport.z;
    let c = corner(i);
    let offset = vec2f(c.x * 2.0 - 1.0, c.y) * (radius + 1.0);
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
