// What is not opaque, in exact order along the ray of each pixel, over what is: the volume, and surfaces with
// opacity. Twin of the volume: `view/volume.rs`.
//
// The ray enters tetrahedra at the faces of the boundary that are listed for the pixel, nearest first, and
// goes on from neighbour to neighbour. A tetrahedron takes five numbers: its four neighbours, in ascending
// order of the points opposite the faces to them, and the exclusive or of its points. The ray knows the three
// points of the face through which it enters, so that gives the fourth.

@group(1) @binding(0) var<storage, read> points: array<vec4f>;
// Of the boundary: three points, and the tetrahedron behind.
@group(1) @binding(1) var<storage, read> faces: array<vec4u>;
@group(1) @binding(2) var<storage, read> tets: array<u32>;
// At evenly spaced values: colour and extinction; then the integrals up to the value of colour times
// extinction, and of extinction.
@group(1) @binding(3) var<storage, read> medium: array<vec4f>;
// See `fragments.wgsl`.
@group(1) @binding(4) var<storage, read> heads: array<u32>;
@group(1) @binding(5) var<storage, read> nodes: array<u32>;
@group(1) @binding(6) var<uniform> settings: Settings;
@group(1) @binding(7) var depths: texture_depth_multisampled_2d;
// Where each point goes, if they have moves (w unused).
@group(1) @binding(8) var<storage, read> moves: array<vec4f>;

// Twin: `Settings` in `gpu/composite.rs`.
struct Settings {
    // First value of the table, values between two entries, number of entries (0 without a volume; w unused).
    table: vec4f,
    // If the eye is in a tetrahedron: its points; its number, or NONE, and the bits of the value at the eye;
    // the clip planes that apply to the volume, a bit each (w unused).
    corners: vec4u,
    start: vec4u,
    // Where the eye is in a tetrahedron that is not displaced (w unused).
    eye: vec4f,
}

const NONE = 0xffffffffu;
const IS_COLOUR = 0x80000000u;
const FAR = 1e30;
// Largest optical depth of a piece in which colours are mixed by their share alone.
const PIECE_DEPTH = 0.25;
const MOST_PIECES = 64.0;
// What is behind so much does not change a picture of eight bits.
const DARK = 0.002;

// What the pixel's list has at a distance: see `fragments.wgsl`.
struct Fragment {
    distance: f32,
    content: u32,
    node: u32,
}

// What has been seen of the ray so far.
var<private> colour: vec3f;
var<private> transmittance: f32;
// The pixel's list, the next layer in it, and the distance of what is opaque.
var<private> head: u32;
var<private> layer: Fragment;
var<private> opaque: f32;
// The part of the ray that is not cut away: of all of it, or of what is displaced in the tetrahedron that it goes through.
var<private> limits: vec2f;
// Where it ends.
var<private> farthest: f32;

// Of a value: emission and extinction, and their integrals up to it.
struct Entry {
    here: vec4f,
    integral: vec4f,
}

fn entry_of(value: f32) -> Entry {
    let count = u32(settings.table.z);
    let last = settings.table.z - 1.0;
    let place = (value - settings.table.x) / settings.table.y;
    let held = clamp(place, 0.0, last);
    let below = min(u32(held), count - 2u);
    let t = held - f32(below);
    let low = emitted(medium[below]);
    let step = emitted(medium[below + 1u]) - low;
    let here = low + t * step;
    let inside = medium[count + below] + settings.table.y * t * (low + 0.5 * t * step);
    // Beyond the ends the medium is constant.
    return Entry(here, inside + settings.table.y * (place - held) * here);
}

fn emitted(entry: vec4f) -> vec4f {
    return vec4f(entry.rgb * entry.a, entry.a);
}

// The mean of emission and extinction between two values.
fn mean(low: f32, high: f32) -> vec4f {
    let first = entry_of(low);
    let second = entry_of(high);
    // Integrals of nearly the same values differ by less than they are rounded.
    if abs(high - low) < settings.table.y {
        return 0.5 * (first.here + second.here);
    }
    return (second.integral - first.integral) / (high - low);
}

// Lays a premultiplied colour behind what has been seen.
fn behind(premultiplied: vec3f, through: f32) {
    colour += transmittance * premultiplied;
    transmittance *= through;
}

// What so much of the ray shows, with this mean of emission and extinction.
fn take_part(part: vec4f, length: f32) {
    let through = exp(-part.a * length);
    if part.a > 0.0 {
        behind(part.rgb / part.a * (1.0 - through), through);
    }
}

// A piece of the ray in the volume, between two values. Most are short: one part, whose mean is that of the whole.
fn piece(low: f32, high: f32, length: f32) {
    let whole = mean(low, high);
    let pieces = min(ceil(whole.a * length / PIECE_DEPTH), MOST_PIECES);
    if pieces <= 1.0 {
        take_part(whole, length);
        return;
    }
    var from_value = low;
    for (var i = 1.0; i <= pieces; i += 1.0) {
        let to_value = mix(low, high, i / pieces);
        take_part(mean(from_value, to_value), length / pieces);
        from_value = to_value;
    }
}

// The same between two places (distance and value), held to what is not cut away.
fn held_piece(enter: vec2f, leave: vec2f) {
    let from_place = max(enter.x, limits.x);
    let to_place = min(leave.x, limits.y);
    if to_place > from_place {
        let slope = (leave.y - enter.y) / (leave.x - enter.x);
        let low = enter.y + slope * (from_place - enter.x);
        piece(low, enter.y + slope * (to_place - enter.x), to_place - from_place);
    }
}

// By distance; at one distance by content, so that the order of the list does not matter: there nodes differ
// in nothing else.
fn is_before(a: Fragment, b: Fragment) -> bool {
    if a.distance != b.distance {
        return a.distance < b.distance;
    }
    if a.content != b.content {
        return a.content < b.content;
    }
    return a.node < b.node;
}

const BEFORE_ALL = Fragment(-FAR, 0u, 0u);

// The nearest fragment of a kind in the pixel's list behind `last` and in front of what is opaque.
fn fragment_after(last: Fragment, kind: u32) -> Fragment {
    var next = Fragment(FAR, NONE, NONE);
    for (var node = head; node != 0u;) {
        let link = nodes[3u * node - 1u];
        let distance = bitcast<f32>(nodes[3u * node - 3u]);
        if (link & IS_COLOUR) == kind && distance < opaque {
            let found = Fragment(distance, nodes[3u * node - 2u], node);
            if is_before(last, found) && is_before(found, next) {
                next = found;
            }
        }
        node = link & ~IS_COLOUR;
    }
    return next;
}

// Lays the next layer behind what has been seen.
fn take_layer() {
    let own = unpack4x8unorm(layer.content);
    behind(own.rgb, 1.0 - own.a);
    layer = fragment_after(layer, IS_COLOUR);
}

// Takes the layers in front of a distance.
fn take_layers(distance: f32) {
    while layer.distance < distance && transmittance > DARK {
        take_layer();
    }
}

// Goes through a part of a tetrahedron, with the layers in it.
fn go_through(enter: vec2f, leave: vec2f) {
    var here = enter;
    while layer.distance < leave.x && transmittance > DARK {
        let place = max(layer.distance, here.x);
        let t = select((place - enter.x) / (leave.x - enter.x), 0.0, leave.x <= enter.x);
        let there = vec2f(place, mix(enter.y, leave.y, t));
        held_piece(here, there);
        take_layer();
        here = there;
    }
    held_piece(here, leave);
}

// Where the crossing of a face was before it was displaced; its points as the ray sees them.
fn rest_of(ids: vec3u, a: SeenPoint, b: SeenPoint, c: SeenPoint) -> vec3f {
    let areas = vec3f(area(b, c), area(c, a), area(a, b));
    let weights = max(areas * select(1.0, -1.0, areas.x + areas.y + areas.z < 0.0), vec3f(0.0));
    let sum = weights.x + weights.y + weights.z;
    let corners = mat3x3f(points[ids.x].xyz, points[ids.y].xyz, points[ids.z].xyz);
    return select(corners * weights / sum, corners[0], sum == 0.0);
}

// Sets the limits to what the clip planes leave between two places of a displaced tetrahedron: they cut where these places were before.
fn limit(from_rest: vec3f, to_rest: vec3f, enter: f32, leave: f32) {
    var part = vec2f(0.0, 1.0);
    for (var i = 0u; i < u32(frame.viewport.w); i += 1u) {
        if ((settings.start.z >> i) & 1u) == 1u {
            let plane = frame.clips[i];
            let first = dot(plane.xyz, from_rest) - plane.w;
            let last = dot(plane.xyz, to_rest) - plane.w;
            let crossed = first / (first - last);
            if first > 0.0 {
                part.x = max(part.x, select(2.0, crossed, last < 0.0));
            } else if last > 0.0 {
                part.y = min(part.y, crossed);
            }
        }
    }
    limits = vec2f(enter + part.x * (leave - enter), min(opaque, enter + part.y * (leave - enter)));
}

// Which of the neighbours of a tetrahedron is opposite `point`, the others being `a`, `b` and `c`.
fn rank(point: u32, a: u32, b: u32, c: u32) -> u32 {
    return u32(point > a) + u32(point > b) + u32(point > c);
}

// From the eye to the face through which the ray leaves the tetrahedron that the eye is in, and on from
// there.
fn march_from_inside(by: Across) {
    let c = settings.corners;
    for (var k = 0u; k < 4u; k += 1u) {
        // The points but for number k.
        let ids = vec3u(c[(k + 1u) & 3u], c[(k + 2u) & 3u], c[(k + 3u) & 3u]);
        let corners = array<SeenPoint, 3>(seen(ids.x, by), seen(ids.y, by), seen(ids.z, by));
        let x = vec3f(area(corners[0], corners[1]), area(corners[1], corners[2]), area(corners[2], corners[0]));
        let is_crossed = all(x >= vec3f(0.0)) || all(x <= vec3f(0.0));
        let leave = crossing(corners[0], corners[1], corners[2]);
        if is_crossed && leave.x > 0.0 {
            if HAS_MOVES {
                limit(settings.eye.xyz, rest_of(ids, corners[0], corners[1], corners[2]), 0.0, leave.x);
            }
            go_through(vec2f(0.0, bitcast<f32>(settings.start.y)), leave);
            march(ids, tets[5u * settings.start.x + rank(c[k], ids.x, ids.y, ids.z)], by);
            return;
        }
    }
}

// Enters tetrahedron `first` through the face of three points, and goes on until the ray leaves the volume or
// no more light comes through.
fn march(face: vec3u, first: u32, by: Across) {
    var ids = face;
    var a = seen(ids.x, by);
    var b = seen(ids.y, by);
    var c = seen(ids.z, by);
    if area(a, b) + area(b, c) + area(c, a) < 0.0 {
        let other = b;
        b = c;
        c = other;
        ids = ids.xzy;
    }
    var tet = first;
    var enter = crossing(a, b, c);
    var enter_rest = vec3f(0.0);
    if HAS_MOVES {
        enter_rest = rest_of(ids, a, b, c);
    }
    // A ray meets each tetrahedron once at most.
    let most = arrayLength(&tets) / 5u;
    for (var step = 0u; step < most && tet != NONE && transmittance > DARK && enter.x < farthest; step += 1u) {
        let new_point = tets[5u * tet + 4u] ^ ids.x ^ ids.y ^ ids.z;
        let d = seen(new_point, by);
        let x = vec3f(area(a, d), area(b, d), area(c, d));
        var left: u32;
        if x.x <= 0.0 && x.y >= 0.0 {
            left = rank(ids.z, ids.x, ids.y, new_point);
            ids.z = new_point;
            c = d;
        } else if x.y <= 0.0 && x.z >= 0.0 {
            left = rank(ids.x, ids.y, ids.z, new_point);
            ids.x = new_point;
            a = d;
        } else {
            left = rank(ids.y, ids.x, ids.z, new_point);
            ids.y = new_point;
            b = d;
        }
        tet = tets[5u * tet + left];
        let there = crossing(a, b, c);
        let leave = vec2f(max(there.x, enter.x), there.y);
        if HAS_MOVES {
            let leave_rest = rest_of(ids, a, b, c);
            limit(enter_rest, leave_rest, enter.x, leave.x);
            enter_rest = leave_rest;
        }
        go_through(enter, leave);
        enter = leave;
    }
}

// All parts of the volume on the ray, nearest first, and the layers in and between them.
fn march_all(by: Across) {
    if settings.start.x != NONE {
        march_from_inside(by);
    }
    for (var entry = fragment_after(BEFORE_ALL, 0u);; entry = fragment_after(entry, 0u)) {
        if entry.distance >= farthest || transmittance <= DARK {
            break;
        }
        take_layers(entry.distance);
        let face = faces[entry.content];
        march(face.xyz, face.w, by);
    }
}

// The part of a ray that the clip planes leave of the volume, up to what is opaque.
fn kept(ray: Ray) -> vec2f {
    var range = vec2f(-FAR, opaque);
    if HAS_MOVES {
        return range;
    }
    for (var i = 0u; i < u32(frame.viewport.w); i += 1u) {
        if ((settings.start.z >> i) & 1u) == 1u {
            let plane = frame.clips[i];
            let height = plane.w - dot(plane.xyz, ray.origin);
            let slope = dot(plane.xyz, ray.direction);
            if slope > 0.0 {
                range.y = min(range.y, height / slope);
            } else if slope < 0.0 {
                range.x = max(range.x, height / slope);
            } else if height < 0.0 {
                range.y = -FAR;
            }
        }
    }
    return range;
}

// How far along a ray a depth is.
fn distance_of(depth: f32, ray: Ray) -> f32 {
    if depth >= 1.0 {
        return FAR;
    }
    let forward = (frame.depth.x - frame.depth.y * depth) / (frame.depth.z * depth - frame.depth.w);
    return forward / dot(ray.direction, normalize(frame.direction.xyz));
}

// What is opaque in the middle of a pixel: on one surface the mean of the samples is that of the middle,
// since they lie evenly around it, and depths are linear on the screen.
fn middle_depth(pixel: vec2i) -> f32 {
    var sum = 0.0;
    var count = 0.0;
    let samples = textureNumSamples(depths);
    for (var i = 0u; i < samples; i += 1u) {
        let depth = textureLoad(depths, pixel, i);
        sum += select(0.0, depth, depth < 1.0);
        count += f32(depth < 1.0);
    }
    return select(1.0, sum / max(count, 1.0), 2.0 * count >= f32(samples));
}

@vertex
fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return over_screen(i, 0.0);
}

@fragment
fn fs(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let ray = ray_of(pixel.xy);
    colour = vec3f(0.0);
    transmittance = 1.0;
    opaque = distance_of(middle_depth(vec2i(pixel.xy)), ray);
    limits = kept(ray);
    farthest = limits.y;
    head = heads[1u + u32(pixel.y) * u32(frame.viewport.x) + u32(pixel.x)];
    layer = fragment_after(BEFORE_ALL, IS_COLOUR);
    if settings.table.z > 0.0 {
        march_all(across_of(ray));
    }
    take_layers(FAR);
    return vec4f(colour, 1.0 - transmittance);
}
