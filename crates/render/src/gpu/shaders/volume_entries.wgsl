// Lists, for each pixel, the faces of the boundary through which its ray enters the volume.
//
// The rasteriser moves corners to a fine grid. Where it misses a face that the ray enters just beside its
// edge, the rest of the volume would be lost to that pixel. So faces are drawn a little larger, and the ray
// itself says whether it goes through them.

@group(1) @binding(0) var<storage, read> points: array<vec4f>;
// Three points, and the tetrahedron behind.
@group(1) @binding(1) var<storage, read> faces: array<vec4u>;
// Where each point goes, if they have moves (w unused).
@group(1) @binding(2) var<storage, read> moves: array<vec4f>;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) face: u32,
}

// How far corners are moved away from both others, in pixels.
const LARGER = 0.0625;

fn clip_of(point: u32) -> vec4f {
    var place = points[point].xyz;
    if HAS_MOVES {
        place += frame.moved.x * moves[point].xyz;
    }
    return frame.view_projection * vec4f(place, 1.0);
}

// The direction on the screen from one point to another, in pixels.
fn towards(here: vec4f, there: vec4f) -> vec2f {
    let way = (there.xy / there.w - here.xy / here.w) * frame.viewport.xy;
    return select(vec2f(0.0), normalize(way), dot(way, way) > 0.0);
}

@vertex
fn vs(@builtin(vertex_index) i: u32) -> Vertex {
    let face = faces[i / 3u];
    let k = i % 3u;
    var clip = clip_of(face[k]);
    let second = clip_of(face[(k + 1u) % 3u]);
    let third = clip_of(face[(k + 2u) % 3u]);
    // What reaches behind the eye is not moved.
    if min(clip.w, min(second.w, third.w)) > 0.0 {
        let away = -(towards(clip, second) + towards(clip, third));
        clip = vec4f(clip.xy + LARGER * away * 2.0 / frame.viewport.xy * clip.w, clip.zw);
    }
    return Vertex(clip, i / 3u);
}

// Whether the ray passes to the right of a side, as it does at those of a face that it enters. Where it meets
// the side, one of both faces there has it.
fn is_right(a: SeenPoint, b: SeenPoint, first: u32, second: u32) -> bool {
    let size = area(a, b);
    return size < 0.0 || (size == 0.0 && first < second);
}

@fragment
fn fs(in: Vertex) -> @location(0) vec4f {
    let face = faces[in.face];
    let across = across_of(ray_of(in.clip.xy));
    let a = seen(face.x, across);
    let b = seen(face.y, across);
    let c = seen(face.z, across);
    if is_right(a, b, face.x, face.y) && is_right(b, c, face.y, face.z) && is_right(c, a, face.z, face.x) {
        append(in.clip, crossing(a, b, c).x, in.face, 0u);
    }
    return vec4f(0.0);
}
