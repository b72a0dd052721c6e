// Emission and absorption along the ray of each pixel. The ray enters tetrahedra at the faces that `volume_entries` lists, nearest first,
// and goes on from neighbour to neighbour. Twin: `view/volume.rs`.
//
// A tetrahedron takes five numbers: its four neighbours, in ascending order of the points opposite the faces to them, and the exclusive
// or of its points. The ray knows the three points of the face through which it enters, so that gives the fourth. All points are
// seen in a plane across the ray, which passes through its origin: signs of areas say through which face the ray leaves.

@group(1) @binding(0) var<storage, read> points: array<vec4f>;
@group(1) @binding(1) var<storage, read> faces: array<vec4u>;
@group(1) @binding(2) var<storage, read> heads: array<u32>;
@group(1) @binding(3) var<storage, read> nodes: array<vec2u>;
@group(1) @binding(4) var<storage, read> tets: array<u32>;
// At evenly spaced values: colour and extinction; then the integrals up to the value of colour times extinction, and of extinction.
@group(1) @binding(5) var<storage, read> medium: array<vec4f>;
@group(1) @binding(6) var<uniform> volume: Volume;

struct Volume {
    // To the right edge, the upper edge and the middle of the picture at distance 1 (w unused).
    right: vec4f,
    up: vec4f,
    forward: vec4f,
    // First value of the table, values between two entries, number of entries (w unused).
    table: vec4f,
    // If the eye is in a tetrahedron: its points; its number, or NONE, and the bits of the value at the eye (z, w unused).
    corners: vec4u,
    start: vec4u,
}

const NONE = 0xffffffffu;
// Largest optical depth of a piece in which colours are mixed by their share alone.
const PIECE_DEPTH = 0.25;
const MOST_PIECES = 64.0;
// What is behind so much does not change a picture of eight bits.
const DARK = 0.002;

// A point: across the ray, along it, and its value.
struct Seen {
    across: vec2f,
    along: f32,
    value: f32,
}

struct Ray {
    direction: vec3f,
    u: vec3f,
    v: vec3f,
}

struct Light {
    colour: vec3f,
    transmittance: f32,
}

fn seen(point: u32, ray: Ray) -> Seen {
    let p = points[point];
    let away = p.xyz - frame.eye.xyz;
    return Seen(vec2f(dot(away, ray.u), dot(away, ray.v)), dot(away, ray.direction), p.w);
}

// Twice the area of the triangle from the ray to two points: positive if they turn to the left.
fn area(a: Seen, b: Seen) -> f32 {
    return a.across.x * b.across.y - a.across.y * b.across.x;
}

// Where the ray goes through a triangle around it: along it, and the value.
fn crossing(a: Seen, b: Seen, c: Seen) -> vec2f {
    let weights = vec3f(area(b, c), area(c, a), area(a, b));
    let sum = weights.x + weights.y + weights.z;
    if sum == 0.0 {
        return vec2f(max(a.along, max(b.along, c.along)), a.value);
    }
    let along = vec3f(a.along, b.along, c.along);
    return vec2f(dot(weights, along), dot(weights, vec3f(a.value, b.value, c.value))) / sum;
}

fn at(value: f32) -> vec4f {
    let last = volume.table.z - 1.0;
    let place = clamp((value - volume.table.x) / volume.table.y, 0.0, last);
    let below = min(u32(place), u32(last) - 1u);
    return mix(medium[below], medium[below + 1u], place - f32(below));
}

// The integrals up to a value.
fn integral(value: f32) -> vec4f {
    let count = u32(volume.table.z);
    let last = volume.table.z - 1.0;
    let place = (value - volume.table.x) / volume.table.y;
    let held = clamp(place, 0.0, last);
    let below = min(u32(held), count - 2u);
    let t = held - f32(below);
    let low = emitted(medium[below]);
    let step = emitted(medium[below + 1u]) - low;
    let inside = medium[count + below] + volume.table.y * t * (low + 0.5 * t * step);
    // Beyond the ends the medium is constant.
    return inside + volume.table.y * (place - held) * emitted(at(value));
}

fn emitted(entry: vec4f) -> vec4f {
    return vec4f(entry.rgb * entry.a, entry.a);
}

// The mean of emission and extinction between two values.
fn mean(low: f32, high: f32) -> vec4f {
    // Integrals of nearly the same values differ by less than they are rounded.
    if abs(high - low) < volume.table.y {
        return 0.5 * (emitted(at(low)) + emitted(at(high)));
    }
    return (integral(high) - integral(low)) / (high - low);
}

fn over(light: Light, colour: vec3f, transmittance: f32) -> Light {
    return Light(light.colour + light.transmittance * colour, light.transmittance * transmittance);
}

fn piece(before: Light, low: f32, high: f32, length: f32) -> Light {
    var light = before;
    let whole = mean(low, high).a * length;
    if whole <= 0.0 {
        return light;
    }
    let pieces = clamp(ceil(whole / PIECE_DEPTH), 1.0, MOST_PIECES);
    var from_value = low;
    for (var i = 1.0; i <= pieces; i += 1.0) {
        let to_value = mix(low, high, i / pieces);
        let part = mean(from_value, to_value);
        let depth = part.a * length / pieces;
        let transmittance = exp(-depth);
        if part.a > 0.0 {
            light = over(light, part.rgb / part.a * (1.0 - transmittance), transmittance);
        }
        from_value = to_value;
    }
    return light;
}

// Which of the neighbours of a tetrahedron is opposite `point`, the others being `a`, `b` and `c`.
fn rank(point: u32, a: u32, b: u32, c: u32) -> u32 {
    return u32(point > a) + u32(point > b) + u32(point > c);
}

fn entry_of(face: u32, ray: Ray) -> vec2f {
    let f = faces[face];
    return crossing(seen(f.x, ray), seen(f.y, ray), seen(f.z, ray));
}

// From the eye to the face through which the ray leaves the tetrahedron that the eye is in, and on from there.
fn from_inside(ray: Ray) -> Light {
    let light = Light(vec3f(0.0), 1.0);
    let c = volume.corners;
    for (var k = 0u; k < 4u; k += 1u) {
        // The points but for number k.
        let ids = vec3u(c[(k + 1u) & 3u], c[(k + 2u) & 3u], c[(k + 3u) & 3u]);
        let corners = array<Seen, 3>(seen(ids.x, ray), seen(ids.y, ray), seen(ids.z, ray));
        let x = vec3f(area(corners[0], corners[1]), area(corners[1], corners[2]), area(corners[2], corners[0]));
        let is_crossed = all(x >= vec3f(0.0)) || all(x <= vec3f(0.0));
        let leave = crossing(corners[0], corners[1], corners[2]);
        if is_crossed && leave.x > 0.0 {
            let first = piece(light, bitcast<f32>(volume.start.y), leave.y, leave.x);
            return march(first, ids, tets[5u * volume.start.x + rank(c[k], ids.x, ids.y, ids.z)], ray);
        }
    }
    return light;
}

// Enters tetrahedron `first` through the face of three points, and goes on until the ray leaves the volume or no more light comes
// through.
fn march(before: Light, face: vec3u, first: u32, ray: Ray) -> Light {
    var light = before;
    var ids = face;
    var a = seen(ids.x, ray);
    var b = seen(ids.y, ray);
    var c = seen(ids.z, ray);
    if area(a, b) + area(b, c) + area(c, a) < 0.0 {
        let other = b;
        b = c;
        c = other;
        ids = ids.xzy;
    }
    var tet = first;
    var enter = crossing(a, b, c);
    // A ray meets each tetrahedron once at most.
    let most = arrayLength(&tets) / 5u;
    for (var step = 0u; step < most && tet != NONE && light.transmittance > DARK; step += 1u) {
        let new_point = tets[5u * tet + 4u] ^ ids.x ^ ids.y ^ ids.z;
        let d = seen(new_point, ray);
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
        let leave = crossing(a, b, c);
        light = piece(light, enter.y, leave.y, max(leave.x - enter.x, 0.0));
        enter = leave;
    }
    return light;
}

@vertex
fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return over_screen(i, 0.0);
}

@fragment
fn fs(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    // The middle of the pixel, from -1 to 1, upwards.
    let size = frame.viewport.xy;
    let middle = (floor(pixel.xy) + 0.5) / size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let direction = normalize(volume.forward.xyz + middle.x * volume.right.xyz + middle.y * volume.up.xyz);
    let helper = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(direction.x) > 0.6);
    let u = normalize(cross(direction, helper));
    let ray = Ray(direction, u, cross(direction, u));

    var light = Light(vec3f(0.0), 1.0);
    if volume.start.x != NONE {
        light = from_inside(ray);
    }
    let head = heads[1u + u32(pixel.y) * u32(size.x) + u32(pixel.x)];
    var last = vec2f(-1e30, -1.0);
    loop {
        // The nearest entry that has not been taken; of several at one place, by number.
        var next = vec2f(1e30, 0.0);
        for (var node = head; node != 0u; node = nodes[node - 1u].y) {
            let face = nodes[node - 1u].x;
            let entry = vec2f(entry_of(face, ray).x, f32(face));
            let is_after = entry.x > last.x || (entry.x == last.x && entry.y > last.y);
            if is_after && (entry.x < next.x || (entry.x == next.x && entry.y < next.y)) {
                next = entry;
            }
        }
        if next.x == 1e30 || light.transmittance <= DARK {
            break;
        }
        let face = faces[u32(next.y)];
        light = march(light, face.xyz, face.w, ray);
        last = next;
    }
    return vec4f(light.colour, 1.0 - light.transmittance);
}
