// What all shaders share: the values of a frame. Twin: `Frame` in `gpu/types.rs`.

struct Frame {
    view_projection: mat4x4f,
    // The ray of the pixel at (x, y), from -1 to 1, upwards: it starts at origin + x origin_x + y origin_y
    // and goes along the same sum of directions (in w their lengths).
    origin: vec4f,
    origin_x: vec4f,
    origin_y: vec4f,
    direction: vec4f,
    direction_x: vec4f,
    direction_y: vec4f,
    // Where the camera is and 1; for parallel rays the direction towards it and 0.
    eye: vec4f,
    // Directions towards the two lights; in w how much the picture is moved on the screen to the right, and
    // upwards; up on the screen (w unused).
    key_light: vec4f,
    fill_light: vec4f,
    up: vec4f,
    // Width and height in pixels, pixels per unit of the page's layout, the number of clip planes.
    viewport: vec4f,
    // Distance from the rays' origins along the middle direction, for depth d: (x - y d) / (z d - w).
    depth: vec4f,
    // The screen's top and bottom: sRGB and opacity.
    sky: vec4f,
    ground: vec4f,
    // How many times its move each thing is displaced (y, z, w unused).
    moved: vec4f,
    // Points with xyz . p > w are cut away.
    clips: array<vec4f, 16>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Whether what is drawn has moves. Twin: `Variant` in `gpu/pipeline.rs`.
override HAS_MOVES: bool = false;

struct Ray {
    origin: vec3f,
    // Of length 1.
    direction: vec3f,
}

// Corner `i` of one triangle over the whole screen.
fn over_screen(i: u32, depth: f32) -> vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), depth, 1.0);
}

// Corner `i` of the two triangles of a square from -1 to 1.
fn square_corner(i: u32) -> vec2f {
    let x = i == 1u || i == 2u || i == 4u;
    let y = i == 2u || i == 4u || i == 5u;
    return vec2f(select(-1.0, 1.0, x), select(-1.0, 1.0, y));
}

// How far an end of a line is moved along it, to the near side of the camera's plane; 0 to 1.
fn moved(end: vec4f, other: vec4f) -> f32 {
    let nearest = 1e-4 * max(abs(end.w), abs(other.w));
    return select((nearest - end.w) / (other.w - end.w), 0.0, end.w >= nearest || other.w <= nearest);
}

// The direction on the screen across a line between two points in front of the camera, of length 1.
fn beside_line(a: vec4f, b: vec4f) -> vec2f {
    let along = (b.xy / b.w - a.xy / a.w) * frame.viewport.xy;
    let direction = select(vec2f(1.0, 0.0), normalize(along), dot(along, along) > 1e-12);
    return vec2f(-direction.y, direction.x);
}

// The ray through the middle of a pixel.
fn ray_of(pixel: vec2f) -> Ray {
    let at = (floor(pixel) + 0.5) / frame.viewport.xy * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let origin = frame.origin.xyz + at.x * frame.origin_x.xyz + at.y * frame.origin_y.xyz;
    let direction = frame.direction.xyz + at.x * frame.direction_x.xyz + at.y * frame.direction_y.xyz;
    return Ray(origin, normalize(direction));
}

// The direction from a point towards the eye.
fn towards_eye(position: vec3f) -> vec3f {
    return normalize(frame.eye.xyz - position * frame.eye.w);
}

// Whether one of the clip planes whose bit is set in `mask` cuts a point away.
fn is_clipped(position: vec3f, mask: u32) -> bool {
    for (var i = 0u; i < u32(frame.viewport.w); i += 1u) {
        let plane = frame.clips[i];
        if ((mask >> i) & 1u) == 1u && dot(plane.xyz, position) > plane.w {
            return true;
        }
    }
    return false;
}
