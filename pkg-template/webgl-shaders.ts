/**
 * Shaders of WebGL 2: twins of the WGSL in `crates/render/src/gpu/shaders`, function by function. They read the same uniforms; instead of
 * storage buffers they read textures, item after item in rows of `WIDTH`.
 */

/** Items in a row of a texture: the least that all devices have. */
export const WIDTH = 2048;

const COMMON = `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;

layout(std140) uniform Frame {
  mat4 view_projection;
  vec4 origin, origin_x, origin_y, direction, direction_x, direction_y;
  vec4 eye, key_light, fill_light, up, viewport, depth, sky, ground, displaced_by;
  vec4 clips[16];
} frame;

ivec2 place(int i) { return ivec2(i & ${WIDTH - 1}, i / ${WIDTH}); }

vec4 over_screen(int i) { return vec4(i == 1 ? 3.0 : -1.0, i == 2 ? 3.0 : -1.0, 1.0, 1.0); }

vec2 square_corner(int i) {
  return vec2(i == 1 || i == 2 || i == 4 ? 1.0 : -1.0, i == 2 || i == 4 || i == 5 ? 1.0 : -1.0);
}

// Depths are from 0 to 1 in WGSL.
vec4 on_screen(vec4 clip) { return vec4(clip.xy, 2.0 * clip.z - clip.w, clip.w); }

vec4 projected(vec3 point) { return frame.view_projection * vec4(point, 1.0); }

float moved(vec4 end, vec4 other) {
  float nearest = 1e-4 * max(abs(end.w), abs(other.w));
  return end.w >= nearest || other.w <= nearest ? 0.0 : (nearest - end.w) / (other.w - end.w);
}

vec2 beside_line(vec4 a, vec4 b) {
  vec2 along = (b.xy / b.w - a.xy / a.w) * frame.viewport.xy;
  vec2 direction = dot(along, along) > 1e-12 ? normalize(along) : vec2(1.0, 0.0);
  return vec2(-direction.y, direction.x);
}
`;

/** What fragments of opaque things, and of others, do with their colour: these are drawn layer by layer, from front to back. */
const OUTPUT = `
out vec4 result;
#ifdef LISTED
// What is in front: depths of what is opaque, and of the layer before.
uniform sampler2D opaque_depth;
uniform sampler2D layer_depth;
bool is_in_layer() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  return gl_FragCoord.z <= texelFetch(opaque_depth, pixel, 0).r && gl_FragCoord.z > texelFetch(layer_depth, pixel, 0).r;
}
#endif
`;

const STYLE = `
layout(std140) uniform Style {
  vec4 front, back, scale, edge, shape;
  uvec4 clips;
  vec4 cut;
  uvec4 palette[64];
} style;
`;

const SHADING = `
bool is_clipped(vec3 position) {
  for (int i = 0; i < int(frame.viewport.w); i++) {
    vec4 plane = frame.clips[i];
    if (((style.clips.x >> uint(i)) & 1u) == 1u && dot(plane.xyz, position) > plane.w) return true;
  }
  return false;
}

vec3 decode(vec3 c) { return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThanEqual(c, vec3(0.04045))); }

vec3 encode(vec3 light) {
  vec3 c = clamp(light, vec3(0.0), vec3(1.0));
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, c * 12.92, lessThanEqual(c, vec3(0.0031308)));
}

vec3 diffuse(vec3 n) {
  float key = max((dot(n, frame.key_light.xyz) + 0.3) / 1.3, 0.0);
  float fill = max((dot(n, frame.fill_light.xyz) + 0.5) / 1.5, 0.0);
  float sky = 0.5 + 0.5 * dot(n, frame.up.xyz);
  return vec3(1.0, 0.97, 0.92) * (0.82 * key * key) + vec3(0.62, 0.74, 0.95) * (0.28 * fill)
    + mix(vec3(0.07, 0.065, 0.06), vec3(0.13, 0.15, 0.18), sky);
}

vec3 palette_entry(int i) {
  uint entry = style.palette[i / 4][i % 4];
  return vec3(entry & 255u, (entry >> 8u) & 255u, (entry >> 16u) & 255u) / 255.0;
}

float logarithm(float value) {
  if (style.scale.w == 0.0) return log(max(value, 1e-38));
  float part = value * style.scale.w;
  float series = part * (1.0 - part * (0.5 - part * (1.0 / 3.0 - 0.25 * part)));
  return abs(part) < 0.01 ? series : log(max(1.0 + part, 1e-38));
}

vec3 mapped(float value) {
  float even = style.scale.z > 0.0 ? logarithm(value) : value;
  float fraction = clamp((even - style.scale.x) * style.scale.y, 0.0, 1.0);
  float bands = style.shape.y;
  float banded = min(floor(fraction * bands), bands - 1.0) / max(bands - 1.0, 1.0);
  float at = (bands > 0.0 ? banded : fraction) * 255.0;
  int below = min(int(at), 254);
  return decode(mix(palette_entry(below), palette_entry(below + 1), at - float(below)));
}

vec3 lit(vec3 albedo, vec3 n, vec3 view) {
  float away = 1.0 - clamp(dot(n, view), 0.0, 1.0);
  float rim = away * away * away * (0.5 + 0.5 * dot(n, frame.up.xyz));
  float gloss = pow(max(dot(n, normalize(view + frame.key_light.xyz)), 0.0), 50.0);
  return albedo * diffuse(n) + vec3(0.75, 0.85, 1.0) * (0.16 * rim) + vec3(0.16 * gloss);
}

float edge_strength(vec3 sides) {
  vec3 right = dFdx(sides);
  vec3 down = dFdy(sides);
  vec3 slope = max(sqrt(right * right + down * down), vec3(1e-9));
  float width = 0.5 * style.shape.x * frame.viewport.z;
  vec3 lines = 1.0 - smoothstep(vec3(width - 0.5), vec3(width + 0.5), sides / slope);
  float steepest = max(slope.x, max(slope.y, slope.z)) * frame.viewport.z;
  vec3 fade = vec3(1.0 - smoothstep(0.08, 0.35, steepest));
  float per_area = abs(right.x * down.y - right.y * down.x);
  if (min(slope.x, min(slope.y, slope.z)) > 1e-6 && per_area > 0.0) {
    vec3 lengths = slope / (per_area * frame.viewport.z);
    fade = smoothstep(vec3(3.0), vec3(12.0), lengths) * (1.0 - smoothstep(0.5, 2.0, steepest));
  }
  vec3 strength = lines * fade;
  return style.edge.a * max(strength.x, max(strength.y, strength.z));
}

vec4 shaded(vec3 position, vec3 normal, vec3 face, bool is_front, float value, vec3 sides) {
#ifdef HAS_VALUES
  vec3 albedo = mapped(value);
#else
  vec3 albedo = is_front ? style.front.rgb : style.back.rgb;
#endif
#if LIGHT == 0
  vec3 n = normalize(normal) * (is_front ? 1.0 : -1.0);
  vec3 colour = lit(albedo, n, normalize(frame.eye.xyz - position * frame.eye.w));
#elif LIGHT == 1
  vec3 colour = albedo * (vec3(0.62) + 0.55 * diffuse(normalize(is_front ? face : -face)));
#else
  vec3 colour = albedo;
#endif
  vec3 own = encode(colour);
#ifdef HAS_EDGES
  float edge = edge_strength(sides);
  return vec4(mix(own, style.edge.rgb, edge), mix(style.front.w, 1.0, edge * step(0.001, style.front.w)));
#else
  return vec4(own, style.front.w);
#endif
}
`;

const SHARED = `
VARYING_CENTROID vec3 position;
VARYING_CENTROID vec3 normal;
VARYING_CENTROID float value;
VARYING_CENTROID vec3 rest;
VARYING_FLAT vec3 face;
VARYING vec3 sides;
`;

const varyings = (text: string, direction: string) =>
  text.replaceAll("VARYING_CENTROID", `centroid ${direction}`).replaceAll("VARYING_FLAT", `flat ${direction}`).replaceAll("VARYING", direction);

const FACE_FRAGMENT = (isFront: string) => `
void main() {
  vec4 colour = shaded(position, normal, face, ${isFront}, value, sides);
  if (is_clipped(rest)) discard;
#ifdef LISTED
  if (!is_in_layer()) discard;
  result = vec4(colour.rgb * colour.a, colour.a);
#else
  result = vec4(colour.rgb, 1.0);
#endif
}
`;

const SURFACE = `
uniform sampler2D positions;
uniform sampler2D normals;
uniform sampler2D values;
uniform usampler2D indices;
uniform sampler2D moves;

vec3 three(int v) { return texelFetch(positions, place(v), 0).xyz; }

vec3 moved_by(int i) { return frame.displaced_by.x * texelFetch(moves, place(i), 0).xyz; }

vec3 displaced(int v) {
#ifdef HAS_MOVES
  return three(v) + moved_by(int(style.clips.z) / 3 * v);
#else
  return three(v);
#endif
}

vec3 turned(vec3 direction, int v) {
  if (style.clips.z != 12u) return direction;
  vec3 x = vec3(1.0, 0.0, 0.0) + moved_by(4 * v + 1);
  vec3 y = vec3(0.0, 1.0, 0.0) + moved_by(4 * v + 2);
  vec3 z = vec3(0.0, 0.0, 1.0) + moved_by(4 * v + 3);
  return mat3(cross(y, z), cross(z, x), cross(x, y)) * direction;
}

void main() {
  int k = gl_VertexID % 3;
  uvec3 entries = texelFetch(indices, place(gl_VertexID / 3), 0).xyz;
  ivec3 corners = ivec3(entries & uvec3(0x7fffffffu));
  vec3 p[3] = vec3[3](displaced(corners.x), displaced(corners.y), displaced(corners.z));
  int v = corners[k];
  vec3 is_corner = vec3(k == 0, k == 1, k == 2);
  sides = mix(is_corner, vec3(1.0), notEqual(entries.yzx & uvec3(0x80000000u), uvec3(0u)));
  normal = vec3(0.0);
#if LIGHT == 0
  normal = texelFetch(normals, place(v), 0).xyz;
#ifdef HAS_MOVES
  normal = turned(normal, v);
#endif
#endif
  value = 0.0;
#ifdef HAS_VALUES
  value = texelFetch(values, place(v), 0).x;
#endif
  position = p[k];
  rest = three(v);
  face = cross(p[1] - p[0], p[2] - p[0]);
  gl_Position = on_screen(projected(position));
}
`;

const CELLS = `
uniform sampler2D points;
uniform usampler2D tets;
uniform sampler2D tet_values;
uniform usampler2D parts;
uniform sampler2D moves;

const uvec3 FACES[4] = uvec3[4](uvec3(1, 2, 3), uvec3(0, 3, 2), uvec3(0, 1, 3), uvec3(0, 2, 1));

vec4 at(uint point) { return texelFetch(points, place(int(point)), 0); }

int part(int i) { return int(texelFetch(parts, place(i), 0).x); }

float own_value(float value, int tet) { return style.clips.y > 0u ? texelFetch(tet_values, place(tet), 0).x : value; }

vec4 displaced(uint point) {
#ifdef HAS_MOVES
  return at(point) + vec4(frame.displaced_by.x * texelFetch(moves, place(int(point)), 0).xyz, 0.0);
#else
  return at(point);
#endif
}
`;

const CORNER = `
// Corner k of a face of a tetrahedron, of which so much is kept.
void corner(int t, int number, int k, float kept) {
  uvec3 corners_of_face = FACES[number];
  uvec4 tet = texelFetch(tets, place(t), 0);
  vec4 corners[4] = vec4[4](displaced(tet.x), displaced(tet.y), displaced(tet.z), displaced(tet.w));
  vec3 centroid_of_tet = 0.25 * (corners[0].xyz + corners[1].xyz + corners[2].xyz + corners[3].xyz);
  vec3 p[3];
  for (int i = 0; i < 3; i++) p[i] = mix(centroid_of_tet, corners[corners_of_face[i]].xyz, kept);
  value = own_value(corners[corners_of_face[k]].w, t);
  rest = p[k];
#ifdef HAS_MOVES
  vec3 middle = 0.25 * (at(tet.x).xyz + at(tet.y).xyz + at(tet.z).xyz + at(tet.w).xyz);
  rest = mix(middle, at(tet[corners_of_face[k]]).xyz, kept);
#endif
  position = p[k];
  face = cross(p[1] - p[0], p[2] - p[0]);
  normal = face;
  sides = vec3(k == 0, k == 1, k == 2);
  gl_Position = on_screen(projected(position));
}
`;

const SOLID = `
void main() {
  int t = gl_VertexID / 12;
  uvec4 tet = texelFetch(tets, place(t), 0);
  bool is_there = tet.x != 0xffffffffu;
  if (is_there) is_there = dot(style.cut.xyz, 0.25 * (at(tet.x).xyz + at(tet.y).xyz + at(tet.z).xyz + at(tet.w).xyz)) <= style.cut.w;
  if (is_there) {
    corner(t, gl_VertexID % 12 / 3, gl_VertexID % 3, 1.0 - style.shape.z);
  } else {
    position = normal = face = sides = rest = vec3(0.0);
    value = 0.0;
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
}
`;

const FACE = `
void main() {
  int outer = part(gl_VertexID / 3);
  corner(outer / 4, outer % 4, gl_VertexID % 3, 1.0);
}
`;

const EDGE_SHARED = "VARYING vec3 rest; VARYING float value;";

const EDGE = `
void main() {
  int first = 3 * (gl_VertexID / 6);
  uint from_number = uint(part(first));
  uint to_number = uint(part(first + 1));
  vec4 from_clip = projected(displaced(from_number).xyz);
  vec4 to_clip = projected(displaced(to_number).xyz);
  vec2 cut = vec2(moved(from_clip, to_clip), 1.0 - moved(to_clip, from_clip));
  vec4 a = mix(from_clip, to_clip, cut.x);
  vec4 b = mix(from_clip, to_clip, cut.y);
  vec2 c = square_corner(gl_VertexID % 6);
  float radius = 0.5 * max(style.shape.x * frame.viewport.z, 1.0);
  vec2 aside = beside_line(a, b) * c.y * radius * 2.0 / frame.viewport.xy;
  vec4 end = c.x > 0.0 ? b : a;
  vec4 there = mix(at(from_number), at(to_number), c.x > 0.0 ? cut.y : cut.x);
  rest = there.xyz;
  value = own_value(there.w, part(first + 2));
  gl_Position = on_screen(vec4(end.xy + aside * end.w, end.zw));
}
`;

const EDGE_FRAGMENT = `
void main() {
  if (is_clipped(rest)) discard;
#ifdef HAS_VALUES
  result = vec4(encode(mapped(value)), 1.0);
#else
  result = vec4(style.edge.rgb, 1.0);
#endif
}
`;

const POINT_SHARED = `${EDGE_SHARED} VARYING vec2 offset;`;

const POINT = `
void main() {
  int first = 2 * (gl_VertexID / 6);
  uint number = uint(part(first));
  vec4 point = at(number);
  value = own_value(point.w, part(first + 1));
  offset = square_corner(gl_VertexID % 6);
  rest = point.xyz;
  vec4 middle = projected(displaced(number).xyz);
  vec2 pixels = 0.5 * style.shape.w * frame.viewport.z * offset;
  gl_Position = on_screen(vec4(middle.xy + pixels * 2.0 * middle.w / frame.viewport.xy, middle.zw));
}
`;

const POINT_FRAGMENT = `
void main() {
  float across = dot(offset, offset);
  if (across > 1.0 || is_clipped(rest)) discard;
#ifdef HAS_VALUES
  vec3 albedo = mapped(value);
#else
  vec3 albedo = style.front.rgb;
#endif
  result = vec4(encode(albedo * (0.45 + 0.75 * sqrt(1.0 - across))), 1.0);
}
`;

const WIRE_SHARED = "VARYING vec4 colour; VARYING vec2 offset; VARYING_FLAT float radius;";

const WIRE = `
uniform sampler2D lines;

float number(int line, int i) { return texelFetch(lines, place(11 * line + i), 0).x; }

vec3 end_of(int line, int i) { return vec3(number(line, i), number(line, i + 1), number(line, i + 2)); }

vec4 shifted(vec4 clip, vec2 pixels) {
  vec2 aside = pixels * 2.0 / frame.viewport.xy - vec2(frame.key_light.w, frame.fill_light.w);
  return on_screen(vec4(clip.xy + aside * clip.w, clip.z - 2e-5 * clip.w, clip.w));
}

void main() {
  int line = gl_VertexID / 6;
  vec2 c = square_corner(gl_VertexID % 6);
  colour = vec4(end_of(line, 6), number(line, 9));
  radius = 0.5 * number(line, 10) * frame.viewport.z;
  float reach = radius + 1.0;
  vec4 first = projected(end_of(line, 0));
#ifdef HANDLE
  offset = c * reach;
  gl_Position = shifted(first, offset);
#else
  vec4 second = projected(end_of(line, 3));
  vec4 a = mix(first, second, moved(first, second));
  vec4 b = mix(first, second, 1.0 - moved(second, first));
  offset = vec2(0.0, c.y * reach);
  gl_Position = shifted(c.x > 0.0 ? b : a, beside_line(a, b) * c.y * reach);
#endif
}
`;

const WIRE_FRAGMENT = `
// How much is seen of lines.
uniform float strength;
void main() {
#ifdef HANDLE
  float away = length(offset);
  float inside = clamp(radius + 0.5 - away, 0.0, 1.0);
  float core = clamp(radius - 2.0 * frame.viewport.z + 0.5 - away, 0.0, 1.0);
  result = mix(vec4(0.05, 0.06, 0.08, 1.0), colour, core) * inside;
#else
  result = colour * (strength * clamp(radius + 0.5 - abs(offset.y), 0.0, 1.0));
#ifdef LISTED
  if (!is_in_layer() || result.a <= 0.0) discard;
#endif
#endif
}
`;

const SCREEN = "void main() { gl_Position = over_screen(gl_VertexID); }";

const BACKGROUND = `
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, frame.viewport.y - gl_FragCoord.y);
  vec4 colour = mix(frame.sky, frame.ground, smoothstep(0.0, 1.0, pixel.y / frame.viewport.y));
  float noise = fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
  result = vec4((colour.rgb + (noise - 0.5) / 255.0) * colour.a, colour.a);
}
`;

const PRESENT = `
uniform sampler2D picture;
uniform vec2 size;
void main() { result = texture(picture, gl_FragCoord.xy / size); }
`;

const PROGRAMS: Record<string, [shared: string, vertex: string, fragment: string]> = {
  surface: [SHARED, STYLE + SURFACE, STYLE + SHADING + FACE_FRAGMENT("gl_FrontFacing")],
  solid: [SHARED, STYLE + CELLS + CORNER + SOLID, STYLE + SHADING + FACE_FRAGMENT("true")],
  face: [SHARED, STYLE + CELLS + CORNER + FACE, STYLE + SHADING + FACE_FRAGMENT("true")],
  edge: [EDGE_SHARED, STYLE + CELLS + EDGE, STYLE + SHADING + EDGE_FRAGMENT],
  point: [POINT_SHARED, STYLE + CELLS + POINT, STYLE + SHADING + POINT_FRAGMENT],
  line: [WIRE_SHARED, WIRE, WIRE_FRAGMENT],
  handle: [WIRE_SHARED, `\n#define HANDLE\n${WIRE}`, `\n#define HANDLE\n${WIRE_FRAGMENT}`],
  background: ["", SCREEN, BACKGROUND],
  present: ["", SCREEN, PRESENT],
};

/** Of variants: see `Drawn` in `gpu/webgl.rs`. */
export const LISTED = 32;

/** The source of a program: vertex and fragment shader. */
export function sourceOf(name: string, variant: number): [string, string] {
  const [shared, vertex, fragment] = PROGRAMS[name];
  const flags = [
    [4, "HAS_VALUES"],
    [8, "HAS_EDGES"],
    [16, "HAS_MOVES"],
    [LISTED, "LISTED"],
  ] as const;
  const defines = flags.filter(([flag]) => variant & flag).map(([, word]) => `#define ${word}\n`);
  const head = `#version 300 es\n#define LIGHT ${variant & 3}\n${defines.join("")}${COMMON}`;
  return [head + varyings(shared, "out") + vertex, head + varyings(shared, "in") + OUTPUT + fragment];
}
