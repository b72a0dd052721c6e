/**
 * When a viewer draws: when something has changed, at most once for each refresh of the screen. Between frames the mesh is refined in
 * steps, so that the camera waits for at most one step.
 */

import { flattenError, known } from "./errors.js";
import type { OnEvent } from "./rpc.js";
import type { Gpu, Viewer } from "./tetralod_viewer.js";
import type { MeshWork } from "./viewer-mesh.js";
import type { Pace } from "./viewer-pace.js";

/** While something moves a step is as long as the last picture took, but not shorter or longer than this (in ms). */
const STEP = [6, 30];
/** At rest nobody waits for the next picture: a step may take so long (in ms). */
const LONG_STEP = 50;
/** Hidden pages have no frames, slow ones few: after so long without one (in ms) the mesh follows between them. */
const HIDDEN = 100;
/** How often it is looked whether the GPU is lost while nothing is drawn (in ms). */
const CHECK = 1000;
/** So long is waited for a frame to be handed to the screen (in ms): hidden pages have none. */
const PATIENCE = 250;

const nextFrame = (then: () => void) => (typeof requestAnimationFrame === "function" ? requestAnimationFrame(then) : setTimeout(then, 16));

export class Frames {
  #viewer: Viewer;
  #mesh: MeshWork;
  #pace: Pace;
  #emit: OnEvent;
  /** How long it took to begin the last picture. */
  #drawing = 0;
  #isAsked = false;
  #hidden: ReturnType<typeof setTimeout> | undefined;
  /** Whether nothing can be drawn: the GPU, or the worker, is lost. */
  #broken = false;
  /** Whether they wait for a screenshot. */
  #isHeld = false;
  /** The last reports, as JSON. */
  #reported = new Map<string, string>();

  constructor(viewer: Viewer, mesh: MeshWork, pace: Pace, emit: OnEvent) {
    [this.#viewer, this.#mesh, this.#pace, this.#emit] = [viewer, mesh, pace, emit];
    setInterval(() => this.#check(), CHECK);
  }

  get isBroken(): boolean {
    return this.#broken;
  }

  /** Whether the picture does not show what is set yet, with all its pixels, or the GPU has not finished it. */
  get isBehind(): boolean {
    return this.#viewer.pending || this.#pace.isMoving || this.#viewer.inFlight > 0;
  }

  /** Draws with another GPU, after the one before was lost. */
  restart(gpu: Gpu) {
    this.#viewer.setGpu(gpu);
    this.#pace.restart();
    this.#broken = false;
  }

  /** What is reported next is of another volume, even if it is the same. */
  forget() {
    this.#reported.clear();
  }

  /** There is something to draw, or to refine. */
  invalidate() {
    if (this.#broken) return;
    if (this.#mesh.isMoving) this.#hidden ??= setTimeout(() => this.#stepUnseen(), HIDDEN);
    if (this.#isAsked) return;
    this.#isAsked = true;
    nextFrame(() => this.#draw());
  }

  /** No frame was drawn: the page is hidden, or slow. */
  #stepUnseen() {
    this.#hidden = undefined;
    if (this.#broken || !this.#mesh.isMoving) return;
    this.#mesh.step(LONG_STEP);
    this.#hidden = setTimeout(() => this.#stepUnseen(), this.#pace.isMoving ? LONG_STEP : 0);
  }

  #draw() {
    this.#isAsked = false;
    // It is drawn when the screenshot is ready.
    if (this.#isHeld) return;
    clearTimeout(this.#hidden);
    this.#hidden = undefined;
    if (this.#mesh.isMoving) this.#mesh.step(this.#pace.isMoving ? Math.min(Math.max(this.#drawing, STEP[0]), STEP[1]) : LONG_STEP);
    try {
      this.#picture();
    } catch (error) {
      this.#failed(error);
    }
    if (this.#mesh.isMoving) this.invalidate();
  }

  /** Draws a picture, or makes the one that is there better, if there is a reason to. */
  #picture() {
    this.#pace.observe();
    const start = performance.now();
    const drew = this.#viewer.frame();
    const milliseconds = performance.now() - start;
    if (drew) {
      this.#drawing = milliseconds;
      this.#pace.began(start);
      this.#tell(milliseconds);
    }
    // The canvas may be hidden just now: then try again with the next refresh.
    else if (this.#viewer.pending) this.invalidate();
    // At rest the picture gets better with every refresh.
    else if (this.#pace.canImprove && this.#viewer.improve()) this.#pace.improved(start);
    if (this.#pace.isWaiting || this.#pace.canImprove) this.invalidate();
  }

  /** Tells of a picture that was drawn. */
  #tell(milliseconds: number) {
    const { bytes, ready } = this.#mesh;
    const uploaded = this.#viewer.takeUploaded();
    this.#emit("frame", { milliseconds, triangles: this.#viewer.triangles, uploaded, gpuBytes: this.#viewer.gpuBytes, scale: this.#pace.scale, bytes, ready });
    this.reportCamera();
    this.#report("legend", this.#viewer.legend());
    this.#report("overlay", this.#viewer.overlay());
  }

  /** Reports where the camera is, if it has moved. */
  reportCamera() {
    this.#report("camera", this.#viewer.camera());
  }

  /** Reports `data` if they differ from the last ones of this name. */
  #report(name: string, data: unknown) {
    const text = JSON.stringify(data) ?? "";
    if (this.#reported.get(name) === text) return;
    this.#reported.set(name, text);
    this.#emit(name, data);
  }

  /** A frame that fails would fail again: wait for a change, for a GPU in place of a lost one, or stop if the worker is lost. */
  #failed(error: unknown) {
    const { code } = known(error);
    const isLost = code === "device-lost";
    this.#broken = isLost || code === undefined;
    this.#emit(isLost ? "lost" : "error", flattenError(error));
  }

  /** Looks whether the GPU is lost while nothing is drawn: what the canvas shows is lost with it. */
  #check() {
    if (this.#broken) return;
    try {
      this.#viewer.check();
    } catch (error) {
      this.#failed(error);
    }
  }

  /** Resolves after a frame has been handed to the screen; soon in any case, since hidden pages have no frames. */
  async drawn() {
    this.invalidate();
    const patience = new Promise<void>((resolve) => setTimeout(resolve, PATIENCE));
    // The first of two refreshes draws, the second follows when the picture is shown.
    const twice = new Promise<void>((resolve) => nextFrame(() => nextFrame(resolve)));
    await Promise.race([twice, patience]);
  }

  /** Frames wait until `work` is done. */
  async whileHeld<T>(work: () => Promise<T>): Promise<T> {
    this.#isHeld = true;
    try {
      return await work();
    } finally {
      this.#isHeld = false;
      this.invalidate();
    }
  }

  /** Resolves when the GPU has finished all pictures. */
  async idle() {
    do await new Promise((resolve) => setTimeout(resolve, 16));
    while (this.#viewer.inFlight > 0);
  }
}
