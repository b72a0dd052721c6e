// How surfaces look: their colours, and how light falls on them. Colours are linear until `encode`. Twin:
// `Style` in `gpu/style.rs`.

// What the style takes: 0 for smooth, 1 for flat, 2 for no light; whether values give colours, whether there are edges, and
// clip planes. Twin: `Variant` in `gpu/pipeline.rs`.
override LIGHT: u32 = 2u;
override HAS_VALUES: bool = false;
override HAS_EDGES: bool = false;
override HAS_CLIPS: bool = false;

struct Style {
    // The sides that are seen from lower and from higher values: linear; in w of the first opacity.
    front: vec4f,
    back: vec4f,
    // Of values: the smallest (or its logarithm), one over the range of them, whether it is logarithmic; if
    // logarithms are of values over an offset to which values are relative, one over that, else 0.
    scale: vec4f,
    // Of edges: sRGB and strength.
    edge: vec4f,
    // In units of the page's layout, the width of edges; the number of colours, or 0 if they run into one another; how much tetrahedra are shrunk; diameter of points in
    // units of the page's layout.
    shape: vec4f,
    // The clip planes that apply, a bit each; whether each tetrahedron has a value; of a surface, numbers a vertex in its moves (w unused).
    clips: vec4u,
    // Tetrahedra with their centroid at xyz . p > w are taken away.
    cut: vec4f,
    // 256 evenly spaced colours of the scale, a byte a channel.
    palette: array<vec4u, 64>,
}

@group(1) @binding(0) var<uniform> style: Style;

fn decode(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn encode(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3f(0.0031308));
}

// A soft key light and a cool fill light; light reaches around the terminator a little.
fn diffuse(n: vec3f) -> vec3f {
    let key = max((dot(n, frame.key_light.xyz) + 0.3) / 1.3, 0.0);
    let fill = max((dot(n, frame.fill_light.xyz) + 0.5) / 1.5, 0.0);
    let sky = 0.5 + 0.5 * dot(n, frame.up.xyz);
    return vec3f(1.0, 0.97, 0.92) * (0.82 * key * key)
        + vec3f(0.62, 0.74, 0.95) * (0.28 * fill)
        + mix(vec3f(0.07, 0.065, 0.06), vec3f(0.13, 0.15, 0.18), sky);
}

fn palette_entry(i: u32) -> vec3f {
    return unpack4x8unorm(style.palette[i / 4u][i % 4u]).rgb;
}

fn logarithm(value: f32) -> f32 {
    if style.scale.w == 0.0 {
        return log(max(value, 1e-38));
    }
    // Of 1 + part, a sum in which a small part loses its digits.
    let part = value * style.scale.w;
    let series = part * (1.0 - part * (0.5 - part * (1.0 / 3.0 - 0.25 * part)));
    return select(log(max(1.0 + part, 1e-38)), series, abs(part) < 0.01);
}

// The colour of a value on the scale: linear.
fn mapped(value: f32) -> vec3f {
    let even = select(value, logarithm(value), style.scale.z > 0.0);
    let fraction = clamp((even - style.scale.x) * style.scale.y, 0.0, 1.0);
    let bands = style.shape.y;
    let banded = min(floor(fraction * bands), bands - 1.0) / max(bands - 1.0, 1.0);
    let place = select(fraction, banded, bands > 0.0) * 255.0;
    let below = min(u32(place), 254u);
    return decode(mix(palette_entry(below), palette_entry(below + 1u), place - f32(below)));
}

// What is seen of a surface at a place.
struct Seen {
    position: vec3f,
    // Towards lower values; any length but zero.
    normal: vec3f,
    // Of the triangle: the side from which its corners are counter-clockwise. Any length.
    face: vec3f,
    // Whether that side is seen. The rasteriser says so, for the triangle as it is drawn, with its corners
    // moved to a fine grid: in front of each place of a closed surface it draws as many fronts as backs, the
    // nearest of which is a front. Normals do not tell: interpolated over triangles that are coarse for the
    // surface's bends, they point away from the eye in large parts of triangles that face it, and towards it
    // where backs are seen. Nor does the sign of the triangle before its corners were moved: it is another
    // one for triangles that are seen from their edge.
    is_front: bool,
    value: f32,
    // Of the place in the triangle: 0 along each side that is an edge, 1 at the corner opposite to it.
    sides: vec3f,
    // By how much these change from a pixel to the next one, to the right and downwards.
    sides_right: vec3f,
    sides_down: vec3f,
}

fn lit(albedo: vec3f, n: vec3f, view: vec3f) -> vec3f {
    // Interpolated normals may look away: no more light there than at the very edge.
    let away = 1.0 - clamp(dot(n, view), 0.0, 1.0);
    let rim = away * away * away * (0.5 + 0.5 * dot(n, frame.up.xyz));
    let half_way = normalize(view + frame.key_light.xyz);
    // To the power of 50, in products.
    let second = max(dot(n, half_way), 0.0) * max(dot(n, half_way), 0.0);
    let eighth = second * second * second * second;
    let gloss = eighth * eighth * eighth * eighth * eighth * eighth * second;
    return albedo * diffuse(n) + vec3f(0.75, 0.85, 1.0) * (0.16 * rim) + vec3f(0.16 * gloss);
}

// How much of the edge colour there is at a place in a triangle. Edges fade out where they are a few pixels long:
// both triangles at an edge agree about that. One that is thinner than its lines draws none.
fn edge_strength(seen: Seen) -> f32 {
    let right = seen.sides_right;
    let down = seen.sides_down;
    let slope = max(sqrt(right * right + down * down), vec3f(1e-9));
    // Of the distance to each side in pixels.
    let width = 0.5 * style.shape.x * frame.viewport.z;
    let lines = 1.0 - smoothstep(vec3f(width - 0.5), vec3f(width + 0.5), seen.sides / slope);
    let steepest = max(slope.x, max(slope.y, slope.z)) * frame.viewport.z;
    // Without the heights over all sides, by the least that is known.
    var fade = vec3f(1.0 - smoothstep(0.08, 0.35, steepest));
    // Each slope is one over a height, and this one over twice the area.
    let per_area = abs(right.x * down.y - right.y * down.x);
    if min(slope.x, min(slope.y, slope.z)) > 1e-6 && per_area > 0.0 {
        let lengths = slope / (per_area * frame.viewport.z);
        fade = smoothstep(vec3f(3.0), vec3f(12.0), lengths) * (1.0 - smoothstep(0.5, 2.0, steepest));
    }
    let strength = lines * fade;
    return style.edge.a * max(strength.x, max(strength.y, strength.z));
}

// sRGB and opacity.
fn shaded(seen: Seen) -> vec4f {
    var albedo = select(style.back.rgb, style.front.rgb, seen.is_front);
    if HAS_VALUES {
        albedo = mapped(seen.value);
    }
    var colour = albedo;
    if LIGHT == 0u {
        let smooth_normal = normalize(seen.normal);
        let n = select(-smooth_normal, smooth_normal, seen.is_front);
        colour = lit(albedo, n, towards_eye(seen.position));
    } else if LIGHT == 1u {
        // Mostly flat, so that the colours stay those of the legend.
        let n = normalize(select(-seen.face, seen.face, seen.is_front));
        colour = albedo * (vec3f(0.62) + 0.55 * diffuse(n));
    }
    let own = encode(colour);
    if !HAS_EDGES {
        return vec4f(own, style.front.w);
    }
    let edge = edge_strength(seen);
    return vec4f(mix(own, style.edge.rgb, edge), mix(style.front.w, 1.0, edge * step(0.001, style.front.w)));
}
