// Shade in hollows: how much of the light of the sky does not come to what is opaque, by what is near it on the screen
// (after McGuire and others, *The Alchemy screen-space ambient obscurance algorithm*, 2011).
//
// First a number for each pixel, by a few places around it; then the mean of these in a small square, for each of the
// surfaces that a pixel shows. What is flat or bulges out gets none, whatever its triangles are: the plane at a place
// is known to within an angle, and only what rises above it by a larger angle takes light away.

@group(1) @binding(0) var<uniform> settings: Settings;
@group(1) @binding(1) var depths: texture_depth_multisampled_2d;
// Of each pixel the shade, and the depth that it is for; NOTHING without one.
@group(1) @binding(2) var found: texture_2d<f32>;

// Twin: `Settings` in `gpu/shade.rs`.
struct Settings {
    // How dark it gets, 0 to 1; how far away what takes the light may be, in model units (z, w unused).
    shade: vec4f,
}

const NOTHING = 2.0;
// Places that are looked at.
const TAPS = 10;
// Sine of the angle above the plane from which on something takes light away. The creases of a round surface of coarse
// triangles are flatter than that.
const RISE = 0.3;
// How wrong the plane may be: a part of its slope, and of the width of a pixel.
const SLACK = 0.15;
// The square: so many pixels along each side. The turns of its pixels are all different.
const SQUARE = 4;
const MOST = 0.85;

@vertex
fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return over_screen(i, 0.0);
}

// Of the first sample; beside the picture there is nothing.
fn depth_at(pixel: vec2i) -> f32 {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(frame.viewport.xy)) {
        return 1.0;
    }
    return textureLoad(depths, pixel, 0);
}

// How far ahead a depth is, and how fast that changes with the depth.
fn ahead_of(depth: f32) -> vec2f {
    let below = frame.depth.z * depth - frame.depth.w;
    let ahead = (frame.depth.x - frame.depth.y * depth) / below;
    return vec2f(ahead, abs((frame.depth.y * frame.depth.w - frame.depth.x * frame.depth.z) / (below * below)));
}

// Half of what the screen shows so far ahead, to the right and upwards.
fn half_size(ahead: f32) -> vec2f {
    let along = ahead / frame.direction.w;
    return vec2f(frame.origin_x.w, frame.origin_y.w) + along * vec2f(frame.direction_x.w, frame.direction_y.w);
}

// The place of a pixel with this depth, as seen: to the right, upwards, ahead. Relative to the eye, so that models far
// from the origin lose nothing.
fn place(pixel: vec2f, depth: f32) -> vec3f {
    let ahead = ahead_of(depth).x;
    let at = (pixel + 0.5) / frame.viewport.xy * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    return vec3f(at * half_size(ahead), ahead);
}

// How the depth changes from a pixel to the next one, how far that is from certain, and on which side it was found, -1
// or 1: on a plane, depths are linear on the screen, so the better side is the one whose two pixels foretell the middle.
fn slope_of(before: vec2f, middle: f32, after: vec2f) -> vec3f {
    let back = vec3f(middle - before.x, abs(2.0 * before.x - before.y - middle), -1.0);
    let ahead = vec3f(after.x - middle, abs(2.0 * after.x - after.y - middle), 1.0);
    return select(ahead, back, back.y <= ahead.y);
}

fn slope_along(pixel: vec2i, step: vec2i, middle: f32) -> vec3f {
    let before = vec2f(depth_at(pixel - step), depth_at(pixel - 2 * step));
    let after = vec2f(depth_at(pixel + step), depth_at(pixel + 2 * step));
    return slope_of(before, middle, after);
}

// A number of 0 to 15 that is another one for each pixel of a square, evenly spread (Bayer's matrix).
fn order_in_square(pixel: vec2i) -> f32 {
    let p = vec2u(pixel) & vec2u(3u);
    let q = p.x ^ p.y;
    let low = ((q & 1u) << 3u) | ((p.y & 1u) << 2u);
    let high = (q & 2u) | ((p.y & 2u) >> 1u);
    return f32(low | high);
}

fn shade(pixel: vec2i, depth: f32, slope: vec2f) -> f32 {
    let at = vec2f(pixel);
    let middle = place(at, depth);
    let right = place(at + vec2f(1.0, 0.0), depth + slope.x) - middle;
    let down = place(at + vec2f(0.0, 1.0), depth + slope.y) - middle;
    let across = cross(right, down);
    let normal = across * inverseSqrt(max(dot(across, across), 1e-38));
    let towards_eye = select(vec3f(0.0, 0.0, -1.0), -middle, frame.eye.w > 0.0);
    let outwards = normal * sign(dot(normal, towards_eye));
    let radius = settings.shade.y;
    let reach = clamp(radius / half_size(middle.z).y * 0.5 * frame.viewport.y, 3.0, 90.0);
    // Each picture of a mean looks in other directions, too.
    let turn = 0.5 * frame.key_light.w * frame.viewport.x;
    let first = 6.2831853 * fract(order_in_square(pixel) / 16.0 + turn);
    let shift = fract(order_in_square(pixel.yx + vec2i(1, 2)) / 16.0 + turn);
    var sum = 0.0;
    for (var i = 0; i < TAPS; i += 1) {
        let part = (f32(i) + shift) / f32(TAPS);
        let angle = first + 2.3999632 * f32(i);
        let other = pixel + vec2i(round(max(reach * part, 1.0) * vec2f(cos(angle), sin(angle))));
        let there = depth_at(other);
        let way = place(vec2f(other), there) - middle;
        let size = dot(way, way);
        if there < 1.0 && size < radius * radius && size > 0.0 {
            let rise = dot(way, outwards) * inverseSqrt(size);
            sum += (1.0 - size / (radius * radius)) * max(rise - RISE, 0.0) / (1.0 - RISE);
        }
    }
    return clamp(settings.shade.x * 3.0 * sum / f32(TAPS), 0.0, MOST);
}

// The shade of each pixel whose plane is known.
@fragment
fn fs(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let depth = depth_at(pixel);
    let x = slope_along(pixel, vec2i(1, 0), depth);
    let y = slope_along(pixel, vec2i(0, 1), depth);
    let ahead = ahead_of(depth);
    let width = 2.0 * half_size(ahead.x).y / frame.viewport.y / ahead.y;
    // Both are of one plane only if what lies across from the pixel is in it, too.
    let across = depth_at(pixel + vec2i(i32(x.z), i32(y.z))) - (depth + x.x * x.z + y.x * y.z);
    let is_known = max(max(x.y, y.y), abs(across)) <= SLACK * (width + abs(x.x) + abs(y.x));
    if depth >= 1.0 || !is_known {
        return vec4f(0.0, NOTHING, 0.0, 0.0);
    }
    return vec4f(shade(pixel, depth, vec2f(x.x, y.x)), depth, 0.0, 0.0);
}

struct Shaded {
    @location(0) colour: vec4f,
    @builtin(sample_mask) samples: u32,
}

// The shade of the nearest surface in a pixel, or of what is behind it there.
fn shaded(pixel: vec2i, is_behind: bool) -> Shaded {
    var own: array<f32, 4>;
    var nearest = 1.0;
    for (var i = 0u; i < 4u; i += 1u) {
        own[i] = textureLoad(depths, pixel, i);
        nearest = min(nearest, own[i]);
    }
    // What is so near belongs to one surface.
    let near = 0.25 * settings.shade.y / ahead_of(nearest).y;
    var depth = 1.0;
    var samples = 0u;
    for (var i = 0u; i < 4u; i += 1u) {
        if own[i] < 1.0 && (own[i] > nearest + near) == is_behind {
            samples |= 1u << i;
            depth = min(depth, own[i]);
        }
    }
    if samples == 0u {
        return Shaded(vec4f(0.0), 0u);
    }
    let there = 0.25 * settings.shade.y / ahead_of(depth).y;
    var sum = vec2f(0.0);
    let most = vec2i(frame.viewport.xy) - 1;
    for (var i = 0; i < SQUARE * SQUARE; i += 1) {
        let beside = vec2i(i % SQUARE, i / SQUARE) - SQUARE / 2;
        let other = textureLoad(found, clamp(pixel + beside, vec2i(0), most), 0).xy;
        sum += select(vec2f(0.0), vec2f(other.x, 1.0), abs(other.y - depth) <= there);
    }
    return Shaded(vec4f(0.0, 0.0, 0.0, sum.x / max(sum.y, 1.0)), samples);
}

@fragment
fn fs_nearest(@builtin(position) at: vec4f) -> Shaded {
    return shaded(vec2i(at.xy), false);
}

@fragment
fn fs_behind(@builtin(position) at: vec4f) -> Shaded {
    return shaded(vec2i(at.xy), true);
}
