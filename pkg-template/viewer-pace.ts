/** How finely a viewer draws while something moves: as well as it can, or quickly, then with as many pixels and tetrahedra as there is time for. */

import type { Viewer } from "./tetralod_viewer.js";
import type { MeshWork } from "./viewer-mesh.js";

/** Quick pictures have these parts of the pixels, in each direction. */
const SCALES = [1, 0.7, 0.5, 0.35, 0.25];
const LEAST = 0.25;
/** More pixels are drawn again where there is time for so many times as many: else the picture would become sharp and blurred in turns. */
const MARGIN = 1.25;
/** So many times faster than others a quick picture is taken to be before there was one. */
const GAIN = 4;
/** After so long without movement, the last picture of which is finished, the picture is made sharp again (in ms). */
const REST = 250;
/** Where fewer pixels do not help, a mesh of fewer tetrahedra is drawn while something moves, but of no fewer than these. */
const FEWEST_TETS = 10_000;
/** Pictures that take longer than this are drawn once, not several times for smooth edges. */
const SLOW = 100;

export class Pace {
  #viewer: Viewer;
  #mesh: MeshWork;
  /** Called when the picture is to be made sharp again. */
  #changed: () => void;
  /** How long a picture should take while something moves (in ms). */
  frameTime: number;
  /** When the last picture was begun, and how it is drawn, while the GPU has not finished it; and how long it took to finish the one before. */
  #begun: { start: number; isQuick: boolean; scale: number } | undefined;
  #took = 0;
  /** Of which kind, quick or not, the GPU has finished a picture: the first ones wait for pipelines to be compiled, so their times say nothing. */
  #warm = new Set<boolean>();
  /** How long the last picture took that was not quick, and how many times as long as a quick one with as many pixels. */
  #full = 0;
  #gain = GAIN;
  /** What is set: whether pictures are quick, and their part of the pixels, in each direction. */
  #isQuick = false;
  #scale = 1;
  /** Sharpens the picture when nothing changes any more. */
  #resting: ReturnType<typeof setTimeout> | undefined;
  /** How many tetrahedra a picture can have while something moves. */
  #affordable = Infinity;

  constructor(viewer: Viewer, mesh: MeshWork, frameTime: number, changed: () => void) {
    [this.#viewer, this.#mesh, this.frameTime, this.#changed] = [viewer, mesh, frameTime, changed];
  }

  /** The part of the pixels that pictures have, in each direction. */
  get scale(): number {
    return this.#scale;
  }

  /** Whether something has moved just now. */
  get isMoving(): boolean {
    return this.#resting !== undefined;
  }

  /** Whether the GPU has not finished a picture. */
  get isWaiting(): boolean {
    return this.#begun !== undefined;
  }

  /** Whether a picture at rest gets better by more pictures. */
  get canImprove(): boolean {
    return this.#viewer.canImprove && !this.#viewer.moving && this.#took < SLOW && !this.isMoving;
  }

  /** Another GPU begins anew. */
  restart() {
    [this.#begun, this.#isQuick, this.#scale] = [undefined, false, 1];
    this.#warm.clear();
  }

  /** The canvas has another size, at which it is drawn with all pixels. */
  resized() {
    this.#scale = 1;
  }

  /** A picture was begun then. */
  began(start: number) {
    this.#begun = { start, isQuick: this.#isQuick, scale: this.#scale };
  }

  /** The same of one more picture at rest, whose time counts where that of another one is not known. */
  improved(start: number) {
    if (this.#took === 0) this.began(start);
  }

  /** Looks whether the GPU has finished the last picture, and how long that took. */
  observe() {
    if (this.#begun === undefined || this.#viewer.inFlight > 0) return;
    const { start, isQuick, scale } = this.#begun;
    const took = (this.#took = this.#warm.has(isQuick) ? performance.now() - start : 0);
    this.#begun = undefined;
    this.#warm.add(isQuick);
    if (took === 0) return;
    if (isQuick) this.#gain = (this.#full * scale ** 2) / took;
    else this.#full = took;
    if (!this.isMoving) return;
    // Where the fewest pixels still take too long, fewer tetrahedra help.
    const { tets, held } = this.#mesh;
    if (took > 1.5 * this.frameTime && scale === LEAST) this.#affordable = Math.max(FEWEST_TETS, (tets * this.frameTime) / took);
    else if (took < this.frameTime / 2 && held !== undefined) this.#affordable = Math.min(1.5 * this.#affordable, 2 ** 31);
  }

  /** Something moves: draws as finely as there is time for, and finely a little later. */
  move() {
    this.#draw(this.#full > this.frameTime);
    const { tets, held } = this.#mesh;
    this.#mesh.hold(held !== undefined || tets > this.#affordable ? Math.round(this.#affordable) : undefined);
    this.#rest();
  }

  /** Draws finely a little later. */
  #rest() {
    clearTimeout(this.#resting);
    this.#resting = setTimeout(() => {
      if (this.#viewer.inFlight > 0) return this.#rest();
      this.#resting = undefined;
      this.#draw(false);
      this.#mesh.hold(undefined);
      this.#changed();
    }, REST);
  }

  /** Draws the next pictures like this: quick ones with a part of the pixels that takes about as long as it should. */
  #draw(isQuick: boolean) {
    const most = (this.frameTime * this.#gain) / this.#full;
    const fits = (scale: number) => scale ** 2 * (this.#isQuick && scale > this.#scale ? MARGIN : 1) <= most;
    const scale = isQuick ? (SCALES.find(fits) ?? LEAST) : 1;
    if (isQuick !== this.#isQuick) this.#viewer.setQuick(isQuick);
    if (scale !== this.#scale) this.#viewer.setScale(scale);
    [this.#isQuick, this.#scale] = [isQuick, scale];
  }
}
