// What all shaders share: the values of a frame, and how light falls. Colours are linear until `encode`.

struct Frame {
    view_projection: mat4x4f,
    // Where the camera is (w unused).
    eye: vec4f,
    // Directions towards the two lights, and up on the screen (w unused).
    key_light: vec4f,
    fill_light: vec4f,
    up: vec4f,
    // Width and height in pixels, and pixels per unit of the page's layout (w unused).
    viewport: vec4f,
    // Smallest value of the field, one over its range (z, w unused).
    range: vec4f,
    // Front and back of the isosurface, the screen's top and bottom: sRGB (w unused).
    front: vec4f,
    back: vec4f,
    sky: vec4f,
    ground: vec4f,
    // Sixteen evenly spaced colours of the colour map: sRGB (w unused).
    palette: array<vec4f, 16>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Corner `i` of one triangle over the whole screen.
fn over_screen(i: u32, depth: f32) -> vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), depth, 1.0);
}

fn decode(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn encode(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3f(0.0031308));
}

// A soft key light and a cool fill light; `wrap` lets light reach around the terminator.
fn diffuse(n: vec3f) -> vec3f {
    let key = max((dot(n, frame.key_light.xyz) + 0.3) / 1.3, 0.0);
    let fill = max((dot(n, frame.fill_light.xyz) + 0.5) / 1.5, 0.0);
    let sky = 0.5 + 0.5 * dot(n, frame.up.xyz);
    return vec3f(1.0, 0.97, 0.92) * (0.82 * key * key)
        + vec3f(0.62, 0.74, 0.95) * (0.28 * fill)
        + mix(vec3f(0.07, 0.065, 0.06), vec3f(0.13, 0.15, 0.18), sky);
}

// The colour of the map at a value of the field: linear.
fn mapped(value: f32) -> vec3f {
    let place = clamp((value - frame.range.x) * frame.range.y, 0.0, 1.0) * 15.0;
    let below = min(u32(place), 14u);
    return decode(mix(frame.palette[below].rgb, frame.palette[below + 1u].rgb, place - f32(below)));
}
