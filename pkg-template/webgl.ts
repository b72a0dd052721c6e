/**
 * Draws with WebGL 2 what a viewer shows, where there is no WebGPU. The viewer's wasm module says what: arrays of numbers for each thing,
 * and how it is drawn (`GlContext` in `crates/render/src/gpu/webgl.rs`).
 *
 * What is opaque is drawn with depth and samples. All else is peeled: drawn layer by layer, each the nearest that is behind the one before,
 * so that the order is exact in every pixel, as it is with WebGPU, also where surfaces cross.
 */

import { LISTED, WIDTH, sourceOf } from "./webgl-shaders.js";

/** Samples a pixel. */
const SAMPLES = 4;
/** Layers of what is not opaque: at first, and at most. */
const LAYERS = 4;
const MOST_LAYERS = 64;
/** Lines that something opaque hides shine through so much. */
const HIDDEN = 0.22;
/** What browsers call drivers that draw on the processor. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** An array of numbers on the GPU. */
interface Data {
  texture: WebGLTexture;
  width: number;
  rows: number;
  bytes: number;
}

interface Thing {
  arrays: Map<string, Data>;
  /** As it is, and cut open by clip planes. */
  programs: [string, string];
  vertices: [number, number];
  variant: number;
  /** Which clip planes cut it. */
  hasClips: boolean;
  style: WebGLBuffer | undefined;
}

interface Program {
  program: WebGLProgram;
  uniforms: Map<string, WebGLUniformLocation>;
}

/** An image that is drawn to. */
interface Image {
  frame: WebGLFramebuffer;
  colour: WebGLTexture | WebGLRenderbuffer;
  depth?: WebGLTexture | WebGLRenderbuffer | undefined;
  bytes: number;
}

/** Where pictures go, and what they are made in, for its size. */
interface Target {
  size: [number, number];
  drawn: [number, number];
  images: Map<string, Image>;
  /** Of what is not opaque: layers that are drawn, and for each of the last picture whether anything was in it. */
  layers: number;
  queries: WebGLQuery[];
  /** A canvas that is read back to, in place of that of the context. */
  canvas?: OffscreenCanvas;
}

const newTarget = (canvas?: OffscreenCanvas): Target => ({ size: [1, 1], drawn: [1, 1], images: new Map(), layers: LAYERS, queries: [], ...(canvas && { canvas }) });

export class GlCanvas {
  #gl: WebGL2RenderingContext;
  #canvas: OffscreenCanvas;
  #programs = new Map<string, Program>();
  #things: Map<number, Thing>[] = [new Map(), new Map()];
  #frame: WebGLBuffer;
  #own = newTarget();
  #target = this.#own;
  #lost: string | undefined;
  /** One for each picture that the GPU has not finished. */
  #pictures: WebGLSync[] = [];
  readonly description: string;
  readonly isSoftware: boolean;
  /** Whether the mean of several pictures can be made. */
  readonly hasMean: boolean;
  /** The largest width and height of a picture. */
  readonly largest: number;
  #most: number;

  /** Draws on a canvas without a context; throws if it gets none of WebGL 2. */
  constructor(canvas: OffscreenCanvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, depth: false, powerPreference: "high-performance" }) as WebGL2RenderingContext | null;
    if (!gl) throw new Error("the canvas gets no context of WebGL 2");
    [this.#gl, this.#canvas] = [gl, canvas];
    canvas.addEventListener("webglcontextlost", (event) => {
      this.#lost = (event as WebGLContextEvent).statusMessage || "the context of WebGL was lost";
    });
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    this.description = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER) ?? "");
    this.isSoftware = SOFTWARE.test(this.description);
    this.hasMean = Boolean(gl.getExtension("EXT_color_buffer_float") ?? gl.getExtension("EXT_color_buffer_half_float"));
    this.#most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    this.largest = Math.min(this.#most, gl.getParameter(gl.MAX_RENDERBUFFER_SIZE));
    this.#frame = gl.createBuffer();
  }

  /** Why it draws no more. */
  get lost(): string | undefined {
    return this.#lost ?? (this.#gl.isContextLost() ? "the context of WebGL was lost" : undefined);
  }

  #thing(side: number, key: number): Thing {
    const things = this.#things[side];
    let thing = things.get(key);
    if (!thing) {
      thing = { arrays: new Map(), programs: ["", ""], vertices: [0, 0], variant: 0, hasClips: false, style: undefined };
      things.set(key, thing);
    }
    return thing;
  }

  /** Makes an array of a thing these numbers, so many an item; gives how many items there may be if that is not enough, else NaN. */
  setArray(side: number, key: number, name: string, each: number, numbers: Float32Array | Uint32Array): number {
    const { arrays } = this.#thing(side, key);
    const gl = this.#gl;
    const count = Math.ceil(numbers.length / each);
    const rows = Math.max(1, Math.ceil(count / WIDTH));
    if (rows > this.#most) return WIDTH * this.#most;
    const kept = arrays.get(name);
    const width = Math.min(WIDTH, Math.max(1, count));
    const isFloat = numbers instanceof Float32Array;
    const format = (isFloat ? [gl.RED, gl.RG, gl.RGB, gl.RGBA] : [gl.RED_INTEGER, gl.RG_INTEGER, gl.RGB_INTEGER, gl.RGBA_INTEGER])[each - 1];
    const type = isFloat ? gl.FLOAT : gl.UNSIGNED_INT;
    let data = kept;
    if (!data || data.rows < rows || data.width < width) {
      if (data) gl.deleteTexture(data.texture);
      // It grows by doubling, so that a mesh which is refined is not stored anew each time.
      const room: [number, number] = rows > 1 || kept ? [WIDTH, Math.min(this.#most, kept ? 2 ** Math.ceil(Math.log2(rows)) : rows)] : [width, 1];
      data = { texture: gl.createTexture(), width: room[0], rows: room[1], bytes: 4 * each * room[0] * room[1] };
      arrays.set(name, data);
      gl.bindTexture(gl.TEXTURE_2D, data.texture);
      const stored = (isFloat ? [gl.R32F, gl.RG32F, gl.RGB32F, gl.RGBA32F] : [gl.R32UI, gl.RG32UI, gl.RGB32UI, gl.RGBA32UI])[each - 1];
      gl.texStorage2D(gl.TEXTURE_2D, 1, stored, ...room);
      unfiltered(gl);
    }
    gl.bindTexture(gl.TEXTURE_2D, data.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    const whole = Math.floor(count / WIDTH);
    if (whole > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDTH, whole, format, type, numbers, 0);
    if (count > whole * WIDTH) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, whole, count - whole * WIDTH, 1, format, type, numbers, whole * WIDTH * each);
    return Number.NaN;
  }

  /** Draws a thing like this from now on. */
  setDrawn(side: number, key: number, programs: string, vertices: number, cut: number, variant: number, style: Uint8Array) {
    const gl = this.#gl;
    const thing = this.#thing(side, key);
    const [whole, open] = programs.split(" ");
    Object.assign(thing, { programs: [whole, open], vertices: [vertices, cut], variant });
    if (style.length === 0) return;
    thing.style ??= gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, thing.style);
    gl.bufferData(gl.UNIFORM_BUFFER, style, gl.DYNAMIC_DRAW);
    // The word `clips` of the uniform.
    thing.hasClips = new DataView(style.buffer, style.byteOffset).getUint32(80, true) !== 0;
  }

  /** Frees a thing. */
  remove(side: number, key: number) {
    const thing = this.#things[side].get(key);
    if (!thing) return;
    for (const { texture } of thing.arrays.values()) this.#gl.deleteTexture(texture);
    if (thing.style) this.#gl.deleteBuffer(thing.style);
    this.#things[side].delete(key);
  }

  /** Gives the target a size, and the pictures that are stretched to it. */
  setSize(width: number, height: number, drawnWidth: number, drawnHeight: number) {
    const target = this.#target;
    if (!target.canvas && (this.#canvas.width !== width || this.#canvas.height !== height)) Object.assign(this.#canvas, { width, height });
    if (String([target.size, target.drawn]) === String([width, height, drawnWidth, drawnHeight])) return;
    Object.assign(target, { size: [width, height], drawn: [drawnWidth, drawnHeight] });
    this.#freeImages(target);
  }

  #freeImages(target: Target) {
    const gl = this.#gl;
    for (const { frame, colour, depth } of target.images.values()) {
      gl.deleteFramebuffer(frame);
      for (const part of [colour, depth]) {
        if (part instanceof WebGLTexture) gl.deleteTexture(part);
        else if (part) gl.deleteRenderbuffer(part);
      }
    }
    target.images.clear();
  }

  /** Draws on another canvas until `leave`: what is there when a picture is finished is its content. */
  enter(canvas: OffscreenCanvas) {
    this.#target = newTarget(canvas);
    this.#target.layers = this.#own.layers;
  }

  leave() {
    this.#freeImages(this.#target);
    this.#own.layers = Math.max(this.#own.layers, this.#target.layers);
    this.#own.queries = this.#target.queries;
    this.#target = this.#own;
  }

  /** Pictures that the GPU has not finished. */
  get inFlight(): number {
    const gl = this.#gl;
    this.#pictures = this.#pictures.filter((sync) => {
      const isDone = gl.isContextLost() || gl.getSyncParameter(sync, gl.SYNC_STATUS) === gl.SIGNALED;
      if (isDone) gl.deleteSync(sync);
      return !isDone;
    });
    return this.#pictures.length;
  }

  /** Whether the last picture lacked layers: then it must be drawn again. It is known some time after the picture. */
  isShort(): boolean {
    const gl = this.#gl;
    const target = this.#target;
    if (target.queries.length === 0 || !gl.getQueryParameter(target.queries[target.queries.length - 1], gl.QUERY_RESULT_AVAILABLE)) return false;
    const filled = target.queries.filter((query) => gl.getQueryParameter(query, gl.QUERY_RESULT)).length;
    const isShort = filled === target.queries.length && filled < MOST_LAYERS;
    for (const query of target.queries) gl.deleteQuery(query);
    target.queries = [];
    target.layers = isShort ? Math.min(2 * filled, MOST_LAYERS) : Math.min(filled + 1, MOST_LAYERS);
    return isShort;
  }

  /** Bytes of memory on the GPU. */
  get memory(): number {
    let sum = 0;
    for (const thing of this.#things.flatMap((things) => [...things.values()])) for (const { bytes } of thing.arrays.values()) sum += bytes;
    for (const { bytes } of this.#target.images.values()) sum += bytes;
    return sum;
  }

  /** Draws a picture into so many columns, as number `count` of those whose mean is shown, or quickly if it is negative. */
  draw(side: number, frame: Uint8Array, columns: number, count: number): boolean {
    const gl = this.#gl;
    if (this.lost !== undefined) return false;
    const target = this.#target;
    const [width, height] = target.drawn;
    const things = [...this.#things[side].values()];
    const isLine = (thing: Thing) => thing.programs[0] === "line";
    const listed = things.filter((thing) => thing.variant & LISTED && thing.vertices[0] > 0);
    const [lines, handles] = ["line", "handle"].map((name) => things.filter((thing) => thing.programs[0] === name));
    const solid = things.filter((thing) => !(thing.variant & LISTED) && !isLine(thing) && thing.programs[0] !== "handle");
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.#frame);
    gl.bufferData(gl.UNIFORM_BUFFER, frame, gl.DYNAMIC_DRAW);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.#frame);
    const clips = new DataView(frame.buffer, frame.byteOffset).getFloat32(236, true) > 0;

    // What is opaque; if nothing comes after it, also the lines over it.
    const samples = count < 0 && listed.length === 0 ? 1 : SAMPLES;
    const resolved = this.#image("resolved", gl.RGBA8, { hasDepth: true });
    const first = samples > 1 ? this.#image("samples", gl.RGBA8, { samples, hasDepth: true }) : resolved;
    gl.bindFramebuffer(gl.FRAMEBUFFER, first.frame);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
    gl.disable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    this.#fill("background");
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    for (const thing of solid) this.#drawThing(thing, 0, clips);
    const over = (isListed: boolean) => {
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.depthMask(false);
      gl.depthFunc(gl.GREATER);
      for (const thing of lines) this.#drawThing(thing, 0, clips, HIDDEN);
      gl.depthFunc(gl.LEQUAL);
      if (!isListed) for (const thing of lines) this.#drawThing(thing, 0, clips, 1);
      gl.disable(gl.DEPTH_TEST);
      for (const thing of handles) this.#drawThing(thing, 0, clips);
    };
    if (listed.length === 0) over(false);
    if (first !== resolved) {
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, first.frame);
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, resolved.frame);
      gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT | (listed.length > 0 ? gl.DEPTH_BUFFER_BIT : 0), gl.NEAREST);
    }
    if (listed.length > 0) {
      this.#peel([...listed, ...lines], resolved, clips);
      over(true);
    }
    this.#present(side, resolved, columns, count);
    return true;
  }

  /** Draws what is not opaque over a picture, layer by layer. */
  #peel(things: Thing[], resolved: Image, clips: boolean) {
    const gl = this.#gl;
    const target = this.#target;
    const layers = [this.#image("layer 0", gl.RGBA8, { hasDepth: true }), this.#image("layer 1", gl.RGBA8, { hasDepth: true })];
    const sum = this.#image("layers", gl.RGBA8);
    const clear = ({ frame, depth }: Image, far: number) => {
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.depthMask(true);
      gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
      if (depth) gl.clearBufferfv(gl.DEPTH, 0, [far]);
    };
    for (const query of target.queries) gl.deleteQuery(query);
    target.queries = [];
    clear(sum, 0);
    clear(layers[1], 0);
    for (let i = 0; i < target.layers; i++) {
      const [layer, before] = [layers[i % 2], layers[(i + 1) % 2]];
      clear(layer, 1);
      gl.disable(gl.BLEND);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LESS);
      const query = gl.createQuery();
      gl.beginQuery(gl.ANY_SAMPLES_PASSED, query);
      for (const thing of things) this.#drawThing(thing, LISTED, clips, 1, { opaque_depth: resolved.depth, layer_depth: before.depth });
      gl.endQuery(gl.ANY_SAMPLES_PASSED);
      target.queries.push(query);
      // Under those in front of it.
      this.#lay(layer, sum, [gl.ONE_MINUS_DST_ALPHA, gl.ONE]);
    }
    this.#lay(sum, resolved, [gl.ONE, gl.ONE_MINUS_SRC_ALPHA]);
    gl.enable(gl.DEPTH_TEST);
  }

  /** Lays an image over another one of the same size. */
  #lay(from: Image, { frame }: Image, [source, destination]: [number, number], size = this.#target.drawn) {
    const gl = this.#gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(source, destination);
    this.#fill("present", from.colour, size);
  }

  /** Adds the picture to the mean of those before it, and shows the mean; a quick picture is shown as it is. */
  #present(side: number, resolved: Image, columns: number, count: number) {
    const gl = this.#gl;
    const { drawn, size, canvas } = this.#target;
    let finished = resolved;
    if (count >= 0 && this.hasMean) {
      finished = this.#image(`mean ${side}`, gl.RGBA16F);
      const weight = 1 / (count + 1);
      gl.blendColor(weight, weight, weight, weight);
      this.#lay(resolved, finished, count === 0 ? [gl.ONE, gl.ZERO] : [gl.CONSTANT_COLOR, gl.ONE_MINUS_CONSTANT_COLOR]);
    }
    const shown = canvas && this.#image("shown", gl.RGBA8, { size });
    gl.bindFramebuffer(gl.FRAMEBUFFER, shown?.frame ?? null);
    gl.viewport(0, 0, ...size);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, 0, columns, size[1]);
    this.#fill("present", finished.colour, size);
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, ...drawn);
    if (canvas) this.#readBack(canvas);
    const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (sync) this.#pictures.push(sync);
    gl.flush();
  }

  /** Brings the picture to a canvas that is not the one of the context: colours there are not premultiplied, and the first row is on top. */
  #readBack(canvas: OffscreenCanvas) {
    const gl = this.#gl;
    const [width, height] = this.#target.size;
    const bytes = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const pixels = new Uint8ClampedArray(bytes.length);
    for (let y = 0; y < height; y++) pixels.set(bytes.subarray(4 * width * (height - 1 - y), 4 * width * (height - y)), 4 * width * y);
    for (let i = 3; i < pixels.length; i += 4) {
      if (pixels[i] === 255 || pixels[i] === 0) continue;
      for (let c = i - 3; c < i; c++) pixels[c] = (255 * pixels[c]) / pixels[i];
    }
    canvas.getContext("2d")?.putImageData(new ImageData(pixels, width, height), 0, 0);
  }

  #drawThing(thing: Thing, extra: number, clips: boolean, strength = 1, depths: Record<string, unknown> = {}) {
    const gl = this.#gl;
    const which = clips && thing.hasClips ? 1 : 0;
    if (thing.vertices[which] === 0) return;
    const name = thing.programs[which];
    const { program, uniforms } = this.#program(name, thing.variant | extra);
    gl.useProgram(program);
    if (thing.style) gl.bindBufferBase(gl.UNIFORM_BUFFER, 1, thing.style);
    // Fronts alone are seen of tetrahedra.
    if (name === "solid" || name === "face") gl.enable(gl.CULL_FACE);
    else gl.disable(gl.CULL_FACE);
    let unit = 0;
    for (const [uniform, place] of uniforms) {
      if (uniform === "strength") {
        gl.uniform1f(place, strength);
        continue;
      }
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, (depths[uniform] as WebGLTexture | undefined) ?? thing.arrays.get(uniform)?.texture ?? null);
      gl.uniform1i(place, unit++);
    }
    gl.activeTexture(gl.TEXTURE0);
    gl.drawArrays(gl.TRIANGLES, 0, thing.vertices[which]);
  }

  /** Draws over the whole image. */
  #fill(name: string, picture?: WebGLTexture, size?: [number, number]) {
    const gl = this.#gl;
    const { program, uniforms } = this.#program(name, 0);
    gl.useProgram(program);
    gl.disable(gl.CULL_FACE);
    if (picture && size) {
      gl.bindTexture(gl.TEXTURE_2D, picture);
      gl.uniform1i(uniforms.get("picture") ?? null, 0);
      gl.uniform2f(uniforms.get("size") ?? null, ...size);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** The program of this name and variant; made when something is drawn with it first. */
  #program(name: string, variant: number): Program {
    const key = `${name} ${variant}`;
    const made = this.#programs.get(key);
    if (made) return made;
    const gl = this.#gl;
    const program = gl.createProgram();
    sourceOf(name, variant).forEach((source, i) => {
      const shader = gl.createShader(i === 0 ? gl.VERTEX_SHADER : gl.FRAGMENT_SHADER) as WebGLShader;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
        throw new Error(`shader ${key} does not compile: ${gl.getShaderInfoLog(shader)}`);
      }
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(`shaders ${key} do not link: ${gl.getProgramInfoLog(program)}`);
    ["Frame", "Style"].forEach((block, i) => {
      const index = gl.getUniformBlockIndex(program, block);
      if (index !== gl.INVALID_INDEX) gl.uniformBlockBinding(program, index, i);
    });
    const uniforms = new Map<string, WebGLUniformLocation>();
    for (let i = 0; i < (gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0); i++) {
      const uniform = gl.getActiveUniform(program, i)?.name ?? "";
      const place = gl.getUniformLocation(program, uniform);
      if (place) uniforms.set(uniform, place);
    }
    this.#programs.set(key, { program, uniforms });
    return { program, uniforms };
  }

  /** An image of the target, made when it is needed first. */
  #image(name: string, format: number, { samples = 1, hasDepth = false, size = this.#target.drawn } = {}): Image {
    const gl = this.#gl;
    const { images } = this.#target;
    const made = images.get(name);
    if (made) return made;
    const [width, height] = size;
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    const part = (attachment: number, format: number, isSmooth: boolean) => {
      if (samples > 1) {
        const buffer = gl.createRenderbuffer();
        gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
        gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, buffer);
        return buffer;
      }
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
      unfiltered(gl, isSmooth);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
      return texture;
    };
    const colour = part(gl.COLOR_ATTACHMENT0, format, true);
    const depth = hasDepth ? part(gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT32F, false) : undefined;
    const each = (format === gl.RGBA16F ? 8 : 4) + (hasDepth ? 4 : 0);
    const image = { frame, colour, depth, bytes: each * samples * width * height };
    images.set(name, image);
    return image;
  }
}

/** How the bound texture is looked up: smoothly, or number by number. */
function unfiltered(gl: WebGL2RenderingContext, isSmooth = false) {
  const filter = isSmooth ? gl.LINEAR : gl.NEAREST;
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
}
