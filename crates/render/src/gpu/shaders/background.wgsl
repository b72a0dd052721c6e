// The background: one triangle over the screen, dark at the top, lighter at the bottom.

@vertex
fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return over_screen(i, 1.0);
}

@fragment
fn fs(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let down = pixel.y / frame.viewport.y;
    let colour = mix(frame.sky, frame.ground, smoothstep(0.0, 1.0, down));
    // Half a level of noise, so that the gradient shows no bands.
    let noise = fract(52.9829189 * fract(dot(pixel.xy, vec2f(0.06711056, 0.00583715))));
    return vec4f((colour.rgb + (noise - 0.5) / 255.0) * colour.a, colour.a);
}
