// Faces of tetrahedra, flat, coloured by the field, with outlines.

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) value: f32,
    // Barycentric coordinates: one of them is 0 along each side.
    @location(2) sides: vec3f,
}

@vertex
fn vs(@location(0) position: vec3f, @location(1) value: f32, @builtin(vertex_index) i: u32) -> Vertex {
    let corner = i % 3u;
    let sides = vec3f(f32(corner == 0u), f32(corner == 1u), f32(corner == 2u));
    return Vertex(frame.view_projection * vec4f(position, 1.0), position, value, sides);
}

@fragment
fn fs(in: Vertex) -> @location(0) vec4f {
    // The face's normal, turned towards the eye.
    let across = cross(dpdx(in.position), dpdy(in.position));
    let view = frame.eye.xyz - in.position;
    let n = normalize(across) * select(-1.0, 1.0, dot(across, view) > 0.0);
    // Mostly flat, so that the colours stay those of the legend.
    let lit = mapped(in.value) * (vec3f(0.62) + 0.55 * diffuse(n));

    // Distance to each side in pixels; the outline fades out where faces are only a few pixels large.
    let slope = fwidth(in.sides);
    let away = in.sides / max(slope, vec3f(1e-9));
    let nearest = min(away.x, min(away.y, away.z));
    let width = 0.55 * frame.viewport.z;
    let line = 1.0 - smoothstep(width - 0.5, width + 0.5, nearest);
    let room = 1.0 - smoothstep(0.08, 0.35, max(slope.x, max(slope.y, slope.z)) * frame.viewport.z);
    return vec4f(encode(mix(lit, lit * 0.22, line * room * 0.85)), 1.0);
}
