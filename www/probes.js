/**
 * What is under the pointer, points that are kept, and a plot of the field between two of them.
 *
 * A click keeps a point as a probe; with two there is a plot. The first of three gives way. A drag with Alt makes a box of
 * the points at its ends.
 */

import { $, all, describe, element, shape, svg } from "./dom.js";
import { shownField } from "./fields.js";
import { diagonalOf, precise, rounded } from "./format.js";
import { demo, page, viewer, volume } from "./page.js";
import { linePlot } from "./plot.js";
import { store } from "./state.js";

/** The viewer is asked at once while it answers within this time, and otherwise when the pointer rests (in ms). */
const QUICK = 40;
const REST = 150;
const MOST_PINS = 2;
/** Positions in links have so many digits. */
const DIGITS = 6;
/** Fields that a list shows, at most. */
const MOST_FIELDS = 8;

const NAMES = ["A", "B"];

/** @typedef {import("tetralod/viewer").Reading} Probe */
/** @typedef {import("./volume.js").Point} Point */
/** @typedef {import("./controls.js").Point} Spot */
/** @typedef {import("./controls.js").Place} Place */

/** The point of a probe as it is in links. @param {Probe} probe @returns {Point} */
function placeOf({ position: [x, y, z] }) {
  const kept = (/** @type {number} */ one) => precise(one, diagonalOf(volume().bounds), DIGITS);
  return [kept(x), kept(y), kept(z)];
}

export class Probes {
  #marks = shape("g", { class: "pins" });
  /** What is at the points that are kept, as far as it is read. @type {Probe[]} */
  #pins = [];
  /** The points of which that is. @type {readonly Point[]} */
  #read = [];
  /** The number of the last question about the pointer: late answers are ignored. */
  #asked = 0;
  #took = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #resting;
  /** Counts changes of the plot: late answers are ignored. */
  #plotted = 0;
  /** Draws the plot again when it has another size. @type {ResizeObserver | undefined} */
  #watch;
  /** Where the pointer was last. @type {[point: Spot, place: Place] | undefined} */
  #hovered;

  constructor() {
    svg("overlay").append(this.#marks);
    page.overlay.follow(() => this.#place());
    store.subscribe(["probes"], () => this.#follow());
  }

  /** What is at the points that are kept. */
  get pins() {
    return this.#pins;
  }

  /** Other points are kept: reads what is there. */
  async #follow() {
    const { probes } = store.state;
    if (probes === this.#read) return;
    this.#show([], probes);
    if (probes.length === 0) return;
    const found = await Promise.all(probes.map((point) => viewer().reading(point))).catch(() => undefined);
    if (!found || probes !== store.state.probes || !demo.info) return;
    // A point in a hole of the mesh has nothing.
    this.#keep(found.filter((one) => one !== undefined));
  }

  /** Keeps points that are read. @param {Probe[]} pins */
  #keep(pins) {
    const before = store.state.probes;
    const points = pins.map(placeOf);
    const isSame = String(points) === String(before);
    this.#show(pins, isSame ? before : points);
    store.change({ probes: this.#read });
  }

  /** The pointer is at a point of the canvas, (−1 to 1, y upwards), and at a place of the page. @param {Spot} point @param {Place} place */
  hover(point, place) {
    clearTimeout(this.#resting);
    this.#hovered = [point, place];
    const mine = ++this.#asked;
    const ask = async () => {
      const start = performance.now();
      const found = await viewer()
        .pick(...point)
        .catch(() => undefined);
      this.#took = performance.now() - start;
      if (mine === this.#asked && demo.info) this.#readOut(found, place);
    };
    if (this.#took < QUICK) ask();
    else this.#resting = setTimeout(ask, REST);
  }

  leave() {
    clearTimeout(this.#resting);
    this.#hovered = undefined;
    this.#asked++;
    this.#readOut(undefined);
  }

  /** Keeps the point that is shown at a point of the canvas. Resolves to what is said of it; nothing where nothing is. @param {Spot} point */
  async pin(point) {
    const found = await viewer().pick(...point);
    if (!found || !demo.info) return undefined;
    this.#keep([...this.#pins, found].slice(-MOST_PINS));
    const words = all(".card:last-child dt").map((term) => `${term.textContent} ${term.nextElementSibling?.textContent}`);
    return `Probe ${NAMES[this.#pins.length - 1]}: ${words.join("; ")}`;
  }

  clear() {
    store.change({ probes: [] });
  }

  /** The mesh or the field has changed: reads the values again. */
  async refresh() {
    if (this.#hovered) this.hover(...this.#hovered);
    const before = this.#pins;
    // While another volume is being opened, nothing is known of what is read.
    if (before.length === 0 || !demo.info) return;
    const read = await Promise.all(
      before.map(({ position }) =>
        viewer()
          .reading(position)
          .catch(() => undefined),
      ),
    );
    if (before === this.#pins && demo.info)
      this.#show(
        read.map((found, i) => found ?? before[i]),
        this.#read,
      );
  }

  /** The box between the points that are shown at two points of the canvas. @param {Spot} one @param {Spot} other */
  async boxBetween(one, other) {
    const [from, to] = [await viewer().pick(...one), await viewer().pick(...other)];
    return from && to && this.boxOf(from.position, to.position);
  }

  /** The box between two points. @param {Point} a @param {Point} b */
  boxOf(a, b) {
    const { bounds } = volume();
    const lower = a.map((x, i) => Math.min(x, b[i]));
    const upper = a.map((x, i) => Math.max(x, b[i]));
    // Points of a section have a coordinate in common: a box needs some height there.
    const least = [0, 1, 2].map((i) => (bounds[i + 3] - bounds[i]) / 20);
    const room = least.map((length, i) => Math.max(0, length - (upper[i] - lower[i])) / 2);
    return [...lower.map((x, i) => x - room[i]), ...upper.map((x, i) => x + room[i])];
  }

  /** Shows the rectangle that is being dragged, between two places of the page; none hides it. @param {Place | undefined} from @param {Place | undefined} to */
  marquee(from, to) {
    const marquee = $("marquee");
    marquee.hidden = !from || !to;
    if (!from || !to) return;
    const { left, top } = $("stage").getBoundingClientRect();
    const [x, y] = [Math.min(from.x, to.x) - left, Math.min(from.y, to.y) - top];
    const [width, height] = [Math.abs(to.x - from.x), Math.abs(to.y - from.y)];
    Object.assign(marquee.style, { left: `${x}px`, top: `${y}px`, width: `${width}px`, height: `${height}px` });
  }

  /** Shows words at a place of the page until the pointer moves. @param {string} words @param {Place} place */
  note(words, place) {
    this.#asked++;
    this.#readOut(words, place);
  }

  /** Shows what a probe has found, or words, at a place of the page. @param {Probe | string | undefined} found @param {Place} [place] */
  #readOut(found, place) {
    const readout = $("readout");
    readout.hidden = !found;
    if (!found || !place) return;
    readout.replaceChildren(typeof found === "string" ? found : this.#list(found));
    const stage = $("stage").getBoundingClientRect();
    const [x, y] = [place.x - stage.left, place.y - stage.top];
    const { offsetWidth, offsetHeight } = readout;
    // Beside the pointer, on the side where there is room.
    const left = x + 18 + offsetWidth < stage.width ? x + 18 : x - 14 - offsetWidth;
    const top = Math.min(Math.max(y - offsetHeight / 2, 6), stage.height - offsetHeight - 6);
    Object.assign(readout.style, { left: `${Math.max(left, 4)}px`, top: `${top}px` });
  }

  /** The position, the values and the tetrahedron of a point, as a list. @param {Probe} found */
  #list({ position, values, size, error }) {
    const list = element("dl");
    const byName = new Map([shownField(), ...volume().fields].map((field) => [field.name, field]));
    const fields = [...byName.values()];
    const diagonal = diagonalOf(volume().bounds);
    describe(list, [
      ...fields.slice(0, MOST_FIELDS).map(({ name, min, max, unit }) => [name, `${rounded(values[name], max - min)} ${unit}`.trim()]),
      ...(fields.length > MOST_FIELDS ? [["", `and ${fields.length - MOST_FIELDS} more fields`]] : []),
      ["position", position.map((x) => rounded(x, diagonal)).join(", ")],
      ["cell size", rounded(size, size)],
      ["cell error", `${Number((100 * error).toPrecision(2))} %`],
    ]);
    return list;
  }

  /** Shows what is at points that are kept. @param {Probe[]} pins @param {readonly Point[]} points */
  #show(pins, points) {
    [this.#pins, this.#read] = [pins, points];
    const cards = pins.map((pin, i) => {
      const remove = element("button", { type: "button", ariaLabel: `Remove probe ${NAMES[i]}` }, "×");
      remove.addEventListener("click", () => this.#keep(this.#pins.filter((other) => other !== pin)));
      const hint = pins.length === 1 ? [element("small", {}, "Click at a second point for a plot")] : [];
      return element("div", { className: "card" }, element("b", {}, `Probe ${NAMES[i]}`), remove, this.#list(pin), ...hint);
    });
    $("cards").replaceChildren(...cards);
    this.#place();
    this.#plot();
  }

  /** Draws the probes where they are seen now. */
  #place() {
    const places = this.#pins.map(({ position }) => page.overlay.project(position));
    const marks = [];
    const [from, to] = places;
    if (from && to) {
      const [[x1, y1], [x2, y2]] = [from, to];
      marks.push(shape("line", { x1, y1, x2, y2, class: "between" }));
    }
    const stage = $("cards");
    /** @type {{ left: number, top: number, width: number, height: number } | undefined} */
    let last;
    for (const [i, card] of /** @type {HTMLElement[]} */ ([...stage.children]).entries()) {
      const place = places[i];
      card.hidden = !place;
      if (!place) continue;
      const [x, y] = place;
      marks.push(shape("circle", { cx: x, cy: y, r: 8 }), shape("text", { x, y: y + 4 }, NAMES[i]));
      const other = places[1 - i];
      // On the side that is away from the other probe, if there is room.
      const wantsRight = other ? x >= other[0] : true;
      const fitsRight = x + 16 + card.offsetWidth < stage.clientWidth;
      const fitsLeft = x - 16 - card.offsetWidth > 0;
      const [width, height] = [card.offsetWidth, card.offsetHeight];
      const wanted = (wantsRight && fitsRight) || !fitsLeft ? x + 16 : x - 16 - width;
      // Where neither side has room, as on a phone, it lies over the probe.
      const left = Math.max(Math.min(wanted, stage.clientWidth - width - 4), 4);
      const held = (/** @type {number} */ top) => Math.max(Math.min(top, stage.clientHeight - height - 4), 4);
      let top = held(y - height / 2);
      if (last && left < last.left + last.width && last.left < left + width && Math.abs(top - last.top) < height) {
        // Below the card before, or above it where there is more room.
        const isRoomBelow = last.top + last.height + height < stage.clientHeight - 8;
        top = held(isRoomBelow ? last.top + last.height + 4 : last.top - height - 4);
      }
      card.style.transform = `translate(${Math.round(left)}px, ${Math.round(top)}px)`;
      last = { left, top, width, height };
    }
    this.#marks.replaceChildren(...marks);
  }

  async #plot() {
    const mine = ++this.#plotted;
    const [from, to] = this.#pins.map(({ position }) => position);
    $("plot").hidden = !to;
    if (!to) return;
    const { name, unit } = shownField();
    const profile = await viewer().line(from, to);
    if (mine !== this.#plotted) return;
    const length = Math.hypot(...from.map((x, i) => to[i] - x));
    $("plot-title").textContent = `${unit ? `${name} in ${unit}` : name} from A to B`;
    const draw = () => linePlot(svg("plot-area"), profile, { length, label: "distance from A" });
    draw();
    this.#watch?.disconnect();
    this.#watch = new ResizeObserver(draw);
    this.#watch.observe(svg("plot-area"));
  }
}
