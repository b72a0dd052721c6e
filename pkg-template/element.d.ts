/// <reference lib="esnext.disposable" />
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

import type { MtInfo, Source } from "./index.js";
import type {
  CameraState,
  Legend,
  Misfit,
  Overlay,
  Viewer,
  ViewerFrame,
  ViewerProgress,
  ViewerState,
  ViewerStats,
} from "./viewer.js";

export { TetralodError } from "./index.js";

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

/** Properties reflect attributes of the same name (`maxTets` is `max-tets`); `null` removes an attribute. */
export class TetralodViewerElement extends HTMLElement {
  /** The address of the volume. */
  get src(): string | null;
  set src(url: string | URL | null);
  /** Anything else that a viewer opens, such as a `File`; it takes the place of `src`. Not an attribute. */
  get source(): Source | null;
  set source(source: Source | null);
  get mode(): ViewerMode | null;
  set mode(mode: ViewerMode | null);
  /** One value, or several with spaces between them, in units of the field. Default: the middle of its range. */
  get isovalue(): string | null;
  set isovalue(values: string | number | readonly number[] | null);
  /** The name of the field that is shown. Default: the first. */
  get field(): string | null;
  set field(name: string | null);
  /**
   * The largest error of the field, as for `refine`: a number in its units, or a part of its range such as `1%`; with `isovalue`,
   * where the surfaces are. Default: a pixel, as the camera sees it.
   */
  get error(): string | null;
  set error(error: string | number | null);
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

  /** All that is drawn, and the camera; what is set here goes before the attributes. */
  get state(): ViewerState;
  set state(state: { [K in keyof ViewerState]?: ViewerState[K] | null });

  /** The viewer with all its calls, while the element is on a page and WebGPU has started. */
  readonly viewer: Viewer | undefined;
  /** The description of the volume, from `load` on. */
  readonly info: MtInfo | undefined;
  /** `empty`: nothing to show, or not on a page. `loading`: the poster is shown. `failed`: see `failure`. */
  readonly status: "empty" | "loading" | "ready" | "failed";
  /** The last error, until something works again; its `code` is one of `ErrorCode`. */
  readonly failure: Error | undefined;

  /** Ends the worker and frees its memory, as when the element is removed. */
  [Symbol.dispose](): void;

  addEventListener<K extends keyof TetralodViewerEventMap>(
    type: K,
    listener: (event: TetralodViewerEventMap[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject | null,
    options?: boolean | AddEventListenerOptions,
  ): void;
}

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

// Libraries whose JSX has a namespace of its own. Each is known to the compiler only where it is installed.
// @ts-ignore
declare module "react" {
  namespace JSX {
    interface IntrinsicElements {
      "tetralod-viewer": TetralodViewerJsx;
    }
  }
}
// @ts-ignore
declare module "preact" {
  namespace JSX {
    interface IntrinsicElements {
      "tetralod-viewer": TetralodViewerJsx;
    }
  }
}
