// The lit isosurface, both sides.

// Interpolated inside of the triangle also where it covers the pixel only in part: outside of a sliver the normal may
// be anything.
struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(perspective, centroid) position: vec3f,
    @location(1) @interpolate(perspective, centroid) normal: vec3f,
}

@vertex
fn vs(@location(0) position: vec3f, @location(1) normal: vec3f) -> Vertex {
    return Vertex(frame.view_projection * vec4f(position, 1.0), position, normal);
}

@fragment
fn fs(in: Vertex, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let view = normalize(frame.eye.xyz - in.position);
    let smooth_normal = normalize(in.normal);
    // The normal tells which side is seen, the triangle only where the normal is undecided: slivers, of which marching
    // tetrahedra make many, may face anywhere.
    let outside = dot(smooth_normal, view) + select(-0.2, 0.2, front) > 0.0;
    let n = select(-smooth_normal, smooth_normal, outside);
    let albedo = decode(select(frame.back.rgb, frame.front.rgb, outside));
    // Interpolated normals may look away a little at silhouettes: no more light there than at the very edge.
    let facing = min(abs(dot(n, view)), 1.0);
    let rim = pow(1.0 - facing, 3.0) * (0.5 + 0.5 * dot(n, frame.up.xyz));
    let half_way = normalize(view + frame.key_light.xyz);
    let gloss = pow(max(dot(n, half_way), 0.0), 50.0);
    let lit = albedo * diffuse(n) + vec3f(0.75, 0.85, 1.0) * (0.16 * rim) + vec3f(0.16 * gloss);
    return vec4f(encode(lit), 1.0);
}
