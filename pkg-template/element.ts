/// <reference lib="esnext.disposable" preserve="true" />
/**
 * The element `<tetralod-viewer>`: importing this module registers it, unless another copy of the module has done so.
 *
 * ```html
 * <tetralod-viewer src="bucky.mt" isovalue="0.5" error="1%">
 *   <img slot="poster" src="bucky.png" alt="A surface with sixty knobs">
 * </tetralod-viewer>
 * ```
 *
 * It draws while it is on a page; when it is removed, its worker ends and its memory is freed. A drag turns the volume, with
 * Shift or the right button it moves it, two fingers zoom; the wheel zooms when the element has the focus, or with Ctrl. Arrow
 * keys, plus, minus and Home do the same. With the attribute `static`, which is read when the element comes onto a page, none of
 * this is there.
 *
 * Slots: `poster` is shown until the first picture, and stays where there is none, for instance without WebGPU. Everything
 * else is shown over the picture. Parts for `::part()`: `canvas`, `poster`, `message`.
 */

import type { Class, TypedEvents } from "./events.js";
import { DISPOSE } from "./dispose.js";
import { TetralodError, known } from "./errors.js";
import type { MtInfo } from "./results.js";
import type { CameraState, ViewerChanges, Legend, Misfit, Overlay, SceneState, ViewerState } from "./scene.js";
import type { Source } from "./stream.js";
import { Viewer, type ViewerFrame, type ViewerProgress, type ViewerRefineOptions, type ViewerStats } from "./viewer.js";

export { TetralodError };

/** What is drawn: `isosurface` without it. `slice` is the section through the middle, across z. */
export type ViewerMode = "isosurface" | "volume" | "slice" | "boundary" | "cells";

export interface TetralodViewerEventMap {
  /** A volume is shown: its first picture is on the canvas. `dropped` is what of the state did not fit it. */
  load: CustomEvent<{ info: MtInfo; dropped: Misfit[] }>;
  /** Something went wrong: see `failure`. The picture stays, if there is one. */
  error: CustomEvent<Error>;
  progress: CustomEvent<ViewerProgress>;
  stats: CustomEvent<ViewerStats>;
  frame: CustomEvent<ViewerFrame>;
  camera: CustomEvent<CameraState>;
  legend: CustomEvent<Legend | undefined>;
  overlay: CustomEvent<Overlay | undefined>;
  restored: CustomEvent<{ adapter: string }>;
}

export interface TetralodViewerElement {
  /** The address of the volume. */
  get src(): string | null;
  set src(url: string | URL | null);
  /** What is drawn. Default: the isosurface where there is an `isovalue`, or by `info.surfaceFirst`; else the boundary. */
  get mode(): ViewerMode | null;
  set mode(mode: ViewerMode | null);
  /** One value, or several with spaces between them, in units of the field. Default: that of its `FieldInfo`. */
  get isovalue(): string | null;
  set isovalue(values: string | number | readonly number[] | null);
  /** The name of the field that is shown. Default: `firstField` of the volume. */
  get field(): string | null;
  set field(name: string | null);
  /**
   * The largest error of the field, as for `refine`: a number in its units, or a part of its range such as `1%`; with `isovalue`,
   * where the surfaces are. Default: a pixel, as the camera sees it.
   */
  get error(): string | null;
  set error(error: string | number | null);
  /** The name of a vector that displaces what is drawn, and how many times if that is not left to the viewer, as in `u 20`. */
  get deform(): string | null;
  set deform(vector: string | null);
  /** The largest number of tetrahedra. Default: no limit. */
  get maxTets(): string | null;
  set maxTets(most: number | string | null);
  /** The name of a colour map. Default: `viridis`. */
  get map(): string | null;
  set map(name: string | null);
  /** Default: `dark`. */
  get background(): string | null;
  set background(background: "dark" | "light" | "transparent" | null);
  /** What screen readers say of the picture. Default: `Volume`. */
  get label(): string | null;
  set label(text: string | null);
  /** As for `Viewer.create`; read when the element comes onto a page. */
  get workerUrl(): string | null;
  set workerUrl(url: string | URL | null);
  get wasmUrl(): string | null;
  set wasmUrl(url: string | URL | null);
}

const NAME = "tetralod-viewer";

/** Attributes, and the properties that reflect them. */
const ATTRIBUTES = {
  "src": "src",
  "mode": "mode",
  "isovalue": "isovalue",
  "field": "field",
  "error": "error",
  "deform": "deform",
  "max-tets": "maxTets",
  "map": "map",
  "background": "background",
  "label": "label",
  "worker-url": "workerUrl",
  "wasm-url": "wasmUrl",
};

/** What each mode draws; `middle` is that of the volume, once it is known. */
const MODES: Record<ViewerMode, (about: { values: number[]; middle: number | undefined }) => SceneState> = {
  isosurface: ({ values }) => ({ isosurfaces: values.length > 0 ? values.map((value) => ({ value })) : [{}] }),
  volume: () => ({ volume: {} }),
  slice: ({ middle }) => (middle === undefined ? {} : { slices: [{ normal: [0, 0, 1], offset: middle }] }),
  boundary: () => ({ boundary: {} }),
  cells: () => ({ cells: {} }),
};
const NOTHING: ViewerChanges = { isosurfaces: [], volume: null, slices: null, boundary: null, cells: null };
/** No part is named: of what is opened, the viewer draws what is first. */
const UNNAMED: ViewerChanges = { ...NOTHING, isosurfaces: null };

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
const ARROWS: Record<string, [right: number, up: number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Servers that render pages have no elements. */
const Base = (globalThis.HTMLElement ?? class {}) as Class<TypedEvents<TetralodViewerEventMap> & HTMLElement>;

/** Properties reflect attributes of the same name (`maxTets` is `max-tets`); `null` removes an attribute. */
// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the properties are defined below, each by the name of its attribute.
export class TetralodViewerElement extends Base {
  /** @internal */
  static observedAttributes = Object.keys(ATTRIBUTES);

  #stage: HTMLElement;
  #poster: HTMLElement;
  #message: HTMLElement;
  #viewer: Viewer | undefined;
  /** While the element is on a page. */
  #life: AbortController | undefined;
  /** Set by property: anything that a viewer opens. */
  #source: Source | undefined;
  #state: ViewerChanges = {};
  #given: ViewerRefineOptions | undefined;
  #status: "empty" | "loading" | "ready" | "failed" = "empty";
  #error: Error | undefined;
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

  /** @internal */
  connectedCallback() {
    // Set before the element was defined.
    const own = this as unknown as Record<string, unknown>;
    for (const name of [...Object.values(ATTRIBUTES), "source", "state", "request"]) {
      if (!Object.hasOwn(own, name)) continue;
      const value = own[name];
      delete own[name];
      own[name] = value;
    }
    if (!this.#life) this.#start();
  }

  /** @internal Elements that move to another place are disconnected for a moment only. */
  disconnectedCallback() {
    queueMicrotask(() => this.isConnected || this.#stop());
  }

  /** @internal */
  connectedMoveCallback() {}

  /** @internal */
  attributeChangedCallback(name: string, before: string | null, now: string | null) {
    if (before === now) return;
    if (name === "label") this.#describe();
    if (name === "src") [this.#source, this.#isOther] = [undefined, true];
    this.#soon();
  }

  /** The viewer with all its calls, while the element is on a page and WebGPU has started. */
  get viewer(): Viewer | undefined {
    return this.#viewer;
  }

  /** The description of the volume, from `load` on. */
  get info(): MtInfo | undefined {
    return this.#viewer?.info;
  }

  /** `empty`: nothing to show, or not on a page. `loading`: the poster is shown. `failed`: see `failure`. */
  get status(): "empty" | "loading" | "ready" | "failed" {
    return this.#status;
  }

  /** The last error, until something works again; its `code` is one of `ErrorCode`. */
  get failure(): Error | undefined {
    return this.#error;
  }

  /** Anything else that a viewer opens, such as a `File`; it takes the place of `src`. Not an attribute. */
  get source(): Source | null {
    return this.#source ?? this.getAttribute("src");
  }

  set source(source: Source | null) {
    [this.#source, this.#isOther] = [source ?? undefined, true];
    this.#soon();
  }

  /** All that is drawn, and the camera; what is set here goes before the attributes. */
  get state(): ViewerState {
    return this.#viewer?.state ?? ({ ...this.#state } as ViewerState);
  }

  set state(state: ViewerChanges) {
    this.#state = { ...state };
    this.#soon();
  }

  /** Which mesh is drawn, as for `viewer.refine`, in place of what the attributes `error`, `field` and `max-tets` say; `null` without it. */
  get request(): ViewerRefineOptions | null {
    return this.#given ?? null;
  }

  set request(request: ViewerRefineOptions | null) {
    this.#given = request ?? undefined;
    this.#soon();
  }

  /** Ends the worker and frees its memory, as when the element is removed. */
  [DISPOSE](): void {
    this.#stop();
  }

  async #start() {
    const life = (this.#life = new AbortController());
    const canvas = made("canvas", { part: "canvas" });
    this.#stage.replaceChildren(canvas);
    this.#describe();
    this.#become("loading");
    const places = { workerUrl: this.getAttribute("worker-url"), wasmUrl: this.getAttribute("wasm-url") };
    const given = Object.fromEntries(Object.entries(places).filter(([, url]) => url !== null));
    try {
      const viewer = await Viewer.create(canvas, { signal: life.signal, ...given });
      this.#viewer = viewer;
      for (const name of EVENTS) viewer.addEventListener(name, (event) => this.#tell(name, (event as CustomEvent).detail));
      viewer.addEventListener("error", ({ detail }) => this.#fail(detail, life));
      this.#control(canvas, viewer);
      await this.#open(life);
    } catch (error) {
      this.#fail(error, life);
    }
  }

  /** Ends the worker. */
  #stop() {
    this.#life?.abort();
    this.#viewer?.free();
    [this.#life, this.#viewer] = [undefined, undefined];
    this.#opened++;
    this.#stage.replaceChildren();
    this.#become("empty");
  }

  async #open(life: AbortController) {
    const mine = ++this.#opened;
    this.#isOther = false;
    const [viewer, { source }] = [this.#viewer, this];
    if (!viewer) return this.#become("empty");
    // Before the volume is there, its background alone is. What is wrong with it, `open` says.
    const hasBackground = viewer.set({ background: this.#scene().background ?? null }).catch(() => {});
    if (!source) {
      await hasBackground;
      return mine === this.#opened ? this.#become("empty") : undefined;
    }
    this.#become("loading");
    // The first picture has the right things in it.
    const { info, dropped } = await viewer.open(source, { signal: life.signal, state: this.#scene(), request: this.#given });
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

  get #values(): number[] {
    const words = (this.getAttribute("isovalue") ?? "").split(/[\s,]+/).filter((word) => word !== "");
    const values = words.map(Number);
    if (values.some((value) => !Number.isFinite(value))) throw refused("isovalue", "must be numbers");
    return values;
  }

  /** Without one, and without an isovalue, the first picture of the volume. */
  get #mode(): ViewerMode | "" {
    const mode = this.getAttribute("mode") || (this.getAttribute("isovalue") ? "isosurface" : "");
    if (!mode || Object.hasOwn(MODES, mode)) return mode as ViewerMode | "";
    throw refused("mode", `must be one of ${Object.keys(MODES).join(", ")}, is ${mode}`);
  }

  /** What is drawn. */
  #scene(info?: MtInfo): ViewerChanges {
    const [map, background] = ["map", "background"].map((name) => this.getAttribute(name));
    const mode = this.#mode || (info && (info.surfaceFirst ? "isosurface" : "boundary"));
    const middle = info && (info.bounds[2] + info.bounds[5]) / 2;
    return {
      ...(mode ? { ...NOTHING, ...MODES[mode]({ values: this.#values, middle }) } : UNNAMED),
      colours: map === null ? null : { map },
      deform: this.#deform,
      background: background as SceneState["background"] | null,
      ...this.#state,
    };
  }

  get #deform(): SceneState["deform"] | null {
    // Names may have spaces, too.
    const [, field, factor] = /^(.*?)(?:\s+([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?))?$/i.exec(this.getAttribute("deform")?.trim() ?? "") ?? [];
    return field ? { field, ...(factor ? { factor: Number(factor) } : {}) } : null;
  }

  /** Which mesh is drawn: without `error`, one that is right within a pixel. */
  #request(): ViewerRefineOptions {
    if (this.#given) return this.#given;
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

  #become(status: TetralodViewerElement["status"], error?: Error) {
    [this.#status, this.#error] = [status, error];
    this.#poster.hidden = this.#viewer?.info !== undefined && status !== "loading" && status !== "empty";
    this.#message.hidden = error === undefined;
    this.#message.textContent = error?.message ?? "";
  }

  #fail(error: unknown, life: AbortController) {
    const { name, code } = known(error);
    // What another volume, another request or the end has replaced is no failure.
    if (life.signal.aborted || name === "AbortError" || code === "freed" || code === "replaced") return;
    this.#become("failed", error as Error);
    this.#tell("error", error);
  }

  #tell(name: string, detail: unknown) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** Turns, moves and zooms by pointer, wheel and keys. */
  #control(canvas: HTMLCanvasElement, viewer: Viewer) {
    if (this.hasAttribute("static")) return;
    const ignore = () => {};
    /** Fingers, or the mouse. */
    const pointers = new Map<number, { x: number; y: number }>();
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
        const distance = (point: { x: number; y: number }) => Math.max(8, Math.hypot(point.x - other.x, point.y - other.y));
        viewer.zoom(distance(last) / distance(now)).catch(ignore);
        // The middle between the fingers moves half as far as the one that moved.
        viewer.pan(right / 2, up / 2).catch(ignore);
      } else if (event.shiftKey || (event.buttons & 6) !== 0) viewer.pan(right, up).catch(ignore);
      else viewer.orbit(right * TURN, up * TURN).catch(ignore);
    });
    for (const name of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(name, ({ pointerId }) => pointers.delete(pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    const onWheel = (event: WheelEvent) => {
      // Whoever scrolls past it scrolls the page.
      if (!event.ctrlKey && this.shadowRoot?.activeElement !== canvas) return;
      event.preventDefault();
      const { left, top, width, height } = canvas.getBoundingClientRect();
      const point: [number, number] = [((event.clientX - left) / width) * 2 - 1, 1 - ((event.clientY - top) / height) * 2];
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
    set(value: unknown) {
      if (value === null || value === undefined) this.removeAttribute(attribute);
      else this.setAttribute(attribute, Array.isArray(value) ? value.join(" ") : String(value));
    },
  });
}

/** What is left of the members of a state. */
const kept = (state: ViewerChanges, now: ViewerState): ViewerChanges =>
  Object.fromEntries(Object.keys(state).map((name) => [name, now[name as keyof ViewerState] ?? null]));

const refused = (name: string, problem: string) => new TetralodError("bad-option", `attribute \`${name}\`: ${problem}`);

function made<Tag extends keyof HTMLElementTagNameMap>(tag: Tag, attributes: Record<string, string>): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

// Another copy of this module, in another bundle of the page, may have done so.
if (globalThis.customElements && !customElements.get(NAME)) customElements.define(NAME, TetralodViewerElement);

/** What `<tetralod-viewer>` takes in JSX: its attributes and properties, and what any element takes. */
export interface TetralodViewerJsx {
  src?: string | URL | null | undefined;
  source?: Source | null | undefined;
  mode?: ViewerMode | null | undefined;
  isovalue?: string | number | readonly number[] | null | undefined;
  field?: string | null | undefined;
  error?: string | number | null | undefined;
  "max-tets"?: number | string | null | undefined;
  maxTets?: number | string | null | undefined;
  map?: string | null | undefined;
  background?: "dark" | "light" | "transparent" | null | undefined;
  label?: string | null | undefined;
  static?: boolean | string | undefined;
  "worker-url"?: string | undefined;
  "wasm-url"?: string | undefined;
  state?: { [K in keyof ViewerState]?: ViewerState[K] | null } | undefined;
  request?: ViewerRefineOptions | null | undefined;
  onload?: ((event: TetralodViewerEventMap["load"]) => void) | undefined;
  onerror?: ((event: TetralodViewerEventMap["error"]) => void) | undefined;
  /** Everything else, whose types differ from library to library: `ref`, `key`, `className`, `style`, `children`, `aria-label`, … */
  [other: string]: any;
}

declare global {
  interface HTMLElementTagNameMap {
    "tetralod-viewer": TetralodViewerElement;
  }
  /** React up to 18. */
  namespace JSX {
    interface IntrinsicElements {
      "tetralod-viewer": TetralodViewerJsx;
    }
  }
}

// Libraries whose JSX has a namespace of its own. Each is known to the compiler only where it is installed. Declarations keep comments of this form.
// biome-ignore lint/suspicious/noTsIgnore: where it is installed, there is no error to expect.
/** @ts-ignore */
declare module "react" {
  namespace JSX {
    interface IntrinsicElements {
      "tetralod-viewer": TetralodViewerJsx;
    }
  }
}
// biome-ignore lint/suspicious/noTsIgnore: where it is installed, there is no error to expect.
/** @ts-ignore */
declare module "preact" {
  namespace JSX {
    interface IntrinsicElements {
      "tetralod-viewer": TetralodViewerJsx;
    }
  }
}
