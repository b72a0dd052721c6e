/**
 * `<tetralod-viewer src="volume.mt" isovalue="0.5">`: a `Viewer` as an element, with pointer and keyboard. What attributes do
 * not say, its `viewer` does.
 */

import { TetralodError } from "./errors.js";
import { Viewer } from "./viewer.js";

export { TetralodError };

const NAME = "tetralod-viewer";

/** Attributes, and the properties that reflect them. */
const ATTRIBUTES = {
  "src": "src",
  "mode": "mode",
  "isovalue": "isovalue",
  "field": "field",
  "error": "error",
  "max-tets": "maxTets",
  "map": "map",
  "background": "background",
  "label": "label",
  "worker-url": "workerUrl",
  "wasm-url": "wasmUrl",
};

/** What each mode draws; `middle` is that of the volume, once it is known. */
const MODES = {
  isosurface: ({ values }) => ({ isosurfaces: values.length > 0 ? values.map((value) => ({ value })) : [{}] }),
  volume: () => ({ volume: {} }),
  slice: ({ middle }) => (middle === undefined ? {} : { slices: [{ normal: [0, 0, 1], offset: middle }] }),
  boundary: () => ({ boundary: {} }),
  cells: () => ({ cells: {} }),
};
const NOTHING = { isosurfaces: [], volume: null, slices: null, boundary: null, cells: null };

/** What a viewer tells goes on from the element. */
const EVENTS = ["progress", "stats", "frame", "camera", "legend", "overlay", "restored"];

const STYLE = `
  :host { display: block; position: relative; overflow: hidden; aspect-ratio: 4 / 3; contain: content }
  :host([hidden]) { display: none }
  .stage, canvas, .poster { position: absolute; inset: 0; width: 100%; height: 100% }
  canvas { touch-action: none; outline-offset: -3px }
  .poster { display: grid; place-items: center; overflow: hidden; pointer-events: none }
  .poster[hidden], .message[hidden] { display: none }
  .poster ::slotted(*) { max-width: 100%; max-height: 100% }
  .message { position: absolute; inset: auto 0 0 0; margin: 0; padding: 0.5em 0.75em; font: 14px/1.4 system-ui, sans-serif;
    background: #1c1c1cee; color: #fff }
`;

/** Radians for the height of the canvas, and for a press of a key; the factor of a press. */
const TURN = Math.PI;
const KEY_TURN = Math.PI / 24;
const KEY_ZOOM = 1.15;
const KEY_MOVE = 0.05;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Servers that render pages have no elements. */
const Base = /** @type {typeof HTMLElement} */ (globalThis.HTMLElement ?? class {});

export class TetralodViewerElement extends Base {
  static observedAttributes = Object.keys(ATTRIBUTES);

  #stage;
  #poster;
  #message;
  /** @type {Viewer | undefined} */
  #viewer;
  /** While the element is on a page. @type {AbortController | undefined} */
  #life;
  /** Set by property: anything that a viewer opens. */
  #source;
  /** @type {Record<string, any>} */
  #state = {};
  #status = "empty";
  #error;
  /** Counts what has been opened. */
  #opened = 0;
  /** Whether a change of attributes waits for the end of the task, and whether one of them names another volume. */
  #due = false;
  #isOther = false;

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    // Not a style element, which a Content-Security-Policy may forbid.
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(STYLE);
    root.adoptedStyleSheets = [sheet];
    this.#stage = made("div", { class: "stage" });
    this.#poster = made("div", { class: "poster", part: "poster" });
    this.#poster.append(made("slot", { name: "poster" }));
    this.#message = made("p", { class: "message", part: "message", role: "status", hidden: "" });
    root.append(this.#stage, this.#poster, made("slot", {}), this.#message);
  }

  connectedCallback() {
    // Set before the element was defined.
    for (const name of [...Object.values(ATTRIBUTES), "source", "state"]) {
      if (!Object.hasOwn(this, name)) continue;
      const value = this[name];
      delete this[name];
      this[name] = value;
    }
    if (!this.#life) this.#start();
  }

  /** Elements that move to another place are disconnected for a moment only. */
  disconnectedCallback() {
    queueMicrotask(() => this.isConnected || this.#stop());
  }

  connectedMoveCallback() {}

  attributeChangedCallback(name, before, now) {
    if (before === now) return;
    if (name === "label") this.#describe();
    if (name === "src") [this.#source, this.#isOther] = [undefined, true];
    this.#soon();
  }

  /** The viewer, while the element is on a page and once WebGPU has started. */
  get viewer() {
    return this.#viewer;
  }

  get info() {
    return this.#viewer?.info;
  }

  get status() {
    return this.#status;
  }

  /** Why the status is `failed`. */
  get failure() {
    return this.#error;
  }

  get source() {
    return this.#source ?? this.getAttribute("src");
  }

  set source(source) {
    [this.#source, this.#isOther] = [source ?? undefined, true];
    this.#soon();
  }

  get state() {
    return this.#viewer?.state ?? { ...this.#state };
  }

  set state(state) {
    this.#state = { ...state };
    this.#soon();
  }

  [Symbol.dispose ?? Symbol.for("Symbol.dispose")]() {
    this.#stop();
  }

  async #start() {
    const life = (this.#life = new AbortController());
    const canvas = /** @type {HTMLCanvasElement} */ (made("canvas", { part: "canvas" }));
    this.#stage.replaceChildren(canvas);
    this.#describe();
    this.#become("loading");
    const places = { workerUrl: this.getAttribute("worker-url"), wasmUrl: this.getAttribute("wasm-url") };
    const given = Object.fromEntries(Object.entries(places).filter(([, url]) => url !== null));
    try {
      const viewer = await Viewer.create(canvas, { signal: life.signal, ...given });
      this.#viewer = viewer;
      for (const name of EVENTS) viewer.addEventListener(name, (/** @type {any} */ event) => this.#tell(name, event.detail));
      viewer.addEventListener("error", ({ detail }) => this.#fail(detail, life));
      this.#control(canvas, viewer);
      await this.#open(life);
    } catch (error) {
      this.#fail(error, life);
    }
  }

  #stop() {
    this.#life?.abort();
    this.#viewer?.free();
    [this.#life, this.#viewer] = [undefined, undefined];
    this.#opened++;
    this.#stage.replaceChildren();
    this.#become("empty");
  }

  async #open(life) {
    const mine = ++this.#opened;
    this.#isOther = false;
    const [viewer, { source }] = [this.#viewer, this];
    if (!viewer || !source) return this.#become("empty");
    this.#become("loading");
    // The first picture has the right things in it.
    const { info, dropped } = await viewer.open(source, { signal: life.signal, state: this.#scene() });
    if (mine !== this.#opened) return;
    if (dropped.length > 0) this.#state = kept(this.#state, viewer.state);
    await viewer.set(this.#scene(info));
    if (mine !== this.#opened) return;
    this.#become("ready");
    this.#tell("load", { info, dropped });
    await viewer.refine(this.#request());
  }

  /** Does at once what several attributes ask for. */
  #soon() {
    if (this.#due || !this.#viewer) return;
    this.#due = true;
    queueMicrotask(async () => {
      this.#due = false;
      const [viewer, life] = [this.#viewer, this.#life];
      if (!viewer || !life) return;
      try {
        const isLoading = this.#status === "loading";
        if (this.#isOther || (!viewer.info && !isLoading)) return await this.#open(life);
        // Attributes are read again when the volume has been opened.
        if (isLoading) return;
        await viewer.set(this.#scene(viewer.info));
        await viewer.refine(this.#request());
        if (this.#status === "failed") this.#become("ready");
      } catch (error) {
        this.#fail(error, life);
      }
    });
  }

  get #values() {
    const words = (this.getAttribute("isovalue") ?? "").split(/[\s,]+/).filter((word) => word !== "");
    const values = words.map(Number);
    if (values.some((value) => !Number.isFinite(value))) throw refused("isovalue", "must be numbers");
    return values;
  }

  get #mode() {
    const mode = this.getAttribute("mode") || "isosurface";
    if (Object.hasOwn(MODES, mode)) return mode;
    throw refused("mode", `must be one of ${Object.keys(MODES).join(", ")}, is ${mode}`);
  }

  /** What is drawn. */
  #scene(info) {
    const [map, background] = ["map", "background"].map((name) => this.getAttribute(name));
    const middle = info && (info.bounds[2] + info.bounds[5]) / 2;
    return {
      ...NOTHING,
      ...MODES[this.#mode]({ values: this.#values, middle }),
      colours: map === null ? null : { map },
      background,
      ...this.#state,
    };
  }

  /** Which mesh is drawn: without `error`, one that is right within a pixel. */
  #request() {
    const [error, field, most] = ["error", "field", "max-tets"].map((name) => this.getAttribute(name) ?? undefined);
    const isNumber = error !== undefined && error.trim() !== "" && Number.isFinite(Number(error));
    const need = error === undefined ? { view: { pixels: 1, outside: "10%" } } : { error: isNumber ? Number(error) : error };
    const values = this.#mode === "isosurface" && error !== undefined ? this.#values : [];
    return {
      ...need,
      ...(field === undefined ? {} : { field }),
      ...(values.length > 0 ? { isovalues: values } : {}),
      ...(most === undefined ? {} : { maxTets: Number(most) }),
    };
  }

  #describe() {
    const canvas = this.#stage.querySelector("canvas");
    const name = this.getAttribute("label") ?? "Volume";
    if (!canvas) return;
    canvas.ariaLabel = name;
    if (this.hasAttribute("static")) {
      canvas.setAttribute("role", "img");
      return;
    }
    canvas.setAttribute("role", "application");
    canvas.ariaRoleDescription = "3D view";
    canvas.ariaLabel = `${name}. Arrow keys turn it, with Shift they move it; plus and minus zoom, Home shows all of it`;
    canvas.tabIndex = 0;
  }

  /** @param {string} status */
  #become(status, error = undefined) {
    [this.#status, this.#error] = [status, error];
    this.#poster.hidden = this.#viewer?.info !== undefined && status !== "loading" && status !== "empty";
    this.#message.hidden = error === undefined;
    this.#message.textContent = error?.message ?? "";
  }

  #fail(error, life) {
    // What another volume, another request or the end has replaced is no failure.
    if (life.signal.aborted || error?.name === "AbortError" || ["freed", "replaced"].includes(error?.code)) return;
    this.#become("failed", error);
    this.#tell("error", error);
  }

  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** Turns, moves and zooms by pointer, wheel and keys. */
  #control(canvas, viewer) {
    if (this.hasAttribute("static")) return;
    const ignore = () => {};
    /** Fingers, or the mouse. @type {Map<number, { x: number, y: number }>} */
    const pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return;
      const now = { x: event.clientX, y: event.clientY };
      const [right, up] = [(now.x - last.x) / canvas.clientHeight, (last.y - now.y) / canvas.clientHeight];
      const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
      pointers.set(event.pointerId, now);
      if (other) {
        const distance = (point) => Math.max(8, Math.hypot(point.x - other.x, point.y - other.y));
        viewer.zoom(distance(last) / distance(now)).catch(ignore);
        // The middle between the fingers moves half as far as the one that moved.
        viewer.pan(right / 2, up / 2).catch(ignore);
      } else if (event.shiftKey || (event.buttons & 6) !== 0) viewer.pan(right, up).catch(ignore);
      else viewer.orbit(right * TURN, up * TURN).catch(ignore);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => pointers.delete(/** @type {PointerEvent} */ (event).pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    const onWheel = (event) => {
      // Whoever scrolls past it scrolls the page.
      if (!event.ctrlKey && this.shadowRoot?.activeElement !== canvas) return;
      event.preventDefault();
      const { left, top, width, height } = canvas.getBoundingClientRect();
      const point = [((event.clientX - left) / width) * 2 - 1, 1 - ((event.clientY - top) / height) * 2];
      const pixels = event.deltaY * [1, 16, 400][event.deltaMode] * (event.ctrlKey ? 6 : 1);
      viewer.zoom(Math.exp(Math.max(-400, Math.min(400, pixels)) * 0.0015), ...point).catch(ignore);
    };
    canvas.addEventListener("wheel", onWheel, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const arrow = ARROWS[event.key];
      if (arrow && event.shiftKey) viewer.pan(arrow[0] * KEY_MOVE, arrow[1] * KEY_MOVE).catch(ignore);
      else if (arrow) viewer.orbit(arrow[0] * KEY_TURN, arrow[1] * KEY_TURN).catch(ignore);
      else if ("+=".includes(event.key)) viewer.zoom(1 / KEY_ZOOM).catch(ignore);
      else if ("-_".includes(event.key)) viewer.zoom(KEY_ZOOM).catch(ignore);
      else if (event.key === "Home") viewer.home().catch(ignore);
      else return;
      event.preventDefault();
    });
  }
}

for (const [attribute, property] of Object.entries(ATTRIBUTES)) {
  Object.defineProperty(TetralodViewerElement.prototype, property, {
    configurable: true,
    enumerable: true,
    get() {
      return this.getAttribute(attribute);
    },
    set(value) {
      if (value === null || value === undefined) this.removeAttribute(attribute);
      else this.setAttribute(attribute, Array.isArray(value) ? value.join(" ") : String(value));
    },
  });
}

/** What is left of the members of a state. */
const kept = (state, now) => Object.fromEntries(Object.keys(state).map((name) => [name, now[name] ?? null]));

const refused = (name, problem) => new TetralodError("bad-option", `attribute \`${name}\`: ${problem}`);

function made(tag, attributes) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

// Another copy of this module, in another bundle of the page, may have done so.
if (globalThis.customElements && !customElements.get(NAME)) customElements.define(NAME, TetralodViewerElement);
