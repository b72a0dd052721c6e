/** How finely a viewer draws while something moves: with as many pixels, and then tetrahedra, as there is time for. */

import type { Viewer } from "./tetralod_viewer.js";
import type { MeshWork } from "./viewer-mesh.js";

/** Pictures have these parts of the pixels, in each direction, while something moves. */
const SCALES = [1, 0.7, 0.5, 0.35, 0.25];
const LEAST = 0.25;
/** After so long without movement, the picture is made sharp again (in ms). */
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
  /** When the last picture was begun, while the GPU has not finished it; and how long it took to finish the one before. */
  #begun: number | undefined;
  #took = 0;
  /** Whether the GPU has finished a picture: the first one waits for pipelines to be compiled, so its time says nothing. */
  #isWarm = false;
  /** The part of the pixels, in each direction, with which a picture takes about as long as it should; and the one that is set. */
  #scale = 1;
  #current = 1;
  /** Sharpens the picture when nothing changes any more. */
  #resting: ReturnType<typeof setTimeout> | undefined;
  /** How many tetrahedra a picture can have while something moves. */
  #affordable = Infinity;

  constructor(viewer: Viewer, mesh: MeshWork, frameTime: number, changed: () => void) {
    [this.#viewer, this.#mesh, this.frameTime, this.#changed] = [viewer, mesh, frameTime, changed];
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
    [this.#begun, this.#current, this.#isWarm] = [undefined, 1, false];
  }

  /** The canvas has another size, at which it is drawn with all pixels. */
  resized() {
    this.#current = 1;
  }

  /** A picture was begun then. */
  began(start: number) {
    this.#begun = start;
  }

  /** The same of one more picture at rest, whose time counts where that of another one is not known. */
  improved(start: number) {
    if (this.#took === 0) this.#begun = start;
  }

  /** Looks whether the GPU has finished the last picture, and chooses the scale of the next ones by its time. */
  observe() {
    if (this.#begun === undefined || this.#viewer.inFlight > 0) return;
    const took = (this.#took = this.#isWarm ? performance.now() - this.#begun : 0);
    [this.#begun, this.#isWarm] = [undefined, true];
    const wanted = this.#current * Math.sqrt(this.frameTime / took);
    this.#scale = SCALES.find((one) => one <= wanted) ?? LEAST;
    if (!this.isMoving) return;
    // Where the fewest pixels still take too long, fewer tetrahedra help.
    const { tets, held } = this.#mesh;
    if (took > 1.5 * this.frameTime && this.#current === LEAST) this.#affordable = Math.max(FEWEST_TETS, (tets * this.frameTime) / took);
    else if (took < this.frameTime / 2 && held !== undefined) this.#affordable = Math.min(1.5 * this.#affordable, 2 ** 31);
  }

  /** Something moves: draws as finely as there is time for, and finely a little later. */
  move() {
    this.#setScale(this.#scale);
    const { tets, held } = this.#mesh;
    this.#mesh.hold(held !== undefined || tets > this.#affordable ? Math.round(this.#affordable) : undefined);
    clearTimeout(this.#resting);
    this.#resting = setTimeout(() => {
      this.#resting = undefined;
      this.#setScale(1);
      this.#mesh.hold(undefined);
      this.#changed();
    }, REST);
  }

  #setScale(wanted: number) {
    if (wanted === this.#current) return;
    this.#current = wanted;
    this.#viewer.setScale(wanted);
  }
}
