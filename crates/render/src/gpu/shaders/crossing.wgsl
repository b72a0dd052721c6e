// Where rays go through triangles. All points are seen in a plane across the ray, which passes through its
// origin: signs of areas say on which side of a line through two points the ray passes.

// A point: across the ray, along it, and its value.
struct SeenPoint {
    across: vec2f,
    along: f32,
    value: f32,
}

// A ray, and two directions across it.
struct Across {
    ray: Ray,
    u: vec3f,
    v: vec3f,
}

fn across_of(ray: Ray) -> Across {
    let helper = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(ray.direction.x) > 0.6);
    let u = normalize(cross(ray.direction, helper));
    return Across(ray, u, cross(ray.direction, u));
}

fn seen(point: u32, by: Across) -> SeenPoint {
    var p = points[point];
    if HAS_MOVES {
        p += vec4f(frame.moved.x * moves[point].xyz, 0.0);
    }
    let away = p.xyz - by.ray.origin;
    return SeenPoint(vec2f(dot(away, by.u), dot(away, by.v)), dot(away, by.ray.direction), p.w);
}

// Twice the area of the triangle from the ray to two points: positive if they turn to the left.
fn area(a: SeenPoint, b: SeenPoint) -> f32 {
    return a.across.x * b.across.y - a.across.y * b.across.x;
}

// Where the ray goes through a triangle around it: along it, and the value. Rounding may put the ray a little
// outside, which is far away in a triangle that is seen from its edge: so the place is held to the triangle.
fn crossing(a: SeenPoint, b: SeenPoint, c: SeenPoint) -> vec2f {
    let areas = vec3f(area(b, c), area(c, a), area(a, b));
    let weights = max(areas * select(1.0, -1.0, areas.x + areas.y + areas.z < 0.0), vec3f(0.0));
    let sum = weights.x + weights.y + weights.z;
    if sum == 0.0 {
        return vec2f(a.along, a.value);
    }
    let along = vec3f(a.along, b.along, c.along);
    return vec2f(dot(weights, along), dot(weights, vec3f(a.value, b.value, c.value))) / sum;
}
