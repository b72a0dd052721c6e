/**
 * What is under the pointer, points that are kept, and a plot of the field between two of them.
 *
 * A click keeps a point as a probe; with two there is a plot. The first of three gives way. A drag with Alt makes a box of
 * the points at its ends.
 */

import { diagonalOf, precise, rounded } from "./format.js";
import { showIdle } from "./idle.js";
import { element } from "./overlay.js";
import { linePlot } from "./plot.js";

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

export class Probes {
  #viewer;
  #overlay;
  #stage;
  #fields;
  #shown;
  #marks = element("g", { class: "pins" });
  /** The points that are kept. @type {Probe[]} */
  #pins = [];
  /** The words of points that are being read. @type {string | undefined} */
  #coming;
  /** The number of the last question about the pointer: late answers are ignored. */
  #asked = 0;
  #took = 0;
  #resting;
  /** Counts changes of the plot: late answers are ignored. */
  #plotted = 0;
  /** Draws the plot again when it has another size. @type {ResizeObserver | undefined} */
  #watch;
  /** Where the pointer was last. @type {[point: [number, number], place: { x: number, y: number }] | undefined} */
  #hovered;

  /**
   * @param {{ viewer: import("tetralod/viewer").Viewer, overlay: import("./overlay.js").OverlayView, svg: SVGSVGElement,
   *   stage: Record<"readout" | "cards" | "plot" | "plotTitle" | "plotArea" | "marquee", any>,
   *   fields: () => import("tetralod").FieldInfo[] | undefined, shown: () => import("tetralod").FieldInfo }} parts
   */
  constructor({ viewer, overlay, svg, stage, fields, shown }) {
    this.#viewer = viewer;
    this.#overlay = overlay;
    this.#stage = stage;
    this.#fields = fields;
    this.#shown = shown;
    svg.append(this.#marks);
    overlay.follow(() => this.#place());
  }

  get pins() {
    return this.#pins;
  }

  /** The positions of the points that are kept, as numbers. */
  get words() {
    const range = this.#pins.length > 0 ? diagonalOf(this.#viewer.info.bounds) : 1;
    return this.#coming ?? String(this.#pins.flatMap(({ position }) => position.map((x) => precise(x, range, DIGITS))));
  }

  set words(words) {
    if (words === this.words) return;
    const all = words ? words.split(",").map(Number) : [];
    const points = [all.slice(0, 3), all.slice(3, 6)].filter((point) => point.length === 3 && point.every(Number.isFinite));
    const mine = (this.#pins = []);
    this.#setPins(mine);
    if (points.length === 0) return;
    this.#coming = words;
    Promise.all(points.map((point) => this.#viewer.reading(point))).then(
      (found) => this.#pins === mine && this.#fields() && this.#setPins(found.filter(Boolean)),
      () => {},
    );
  }

  /** The pointer is at a point of the canvas, (−1 to 1, y upwards), and at a place of the page. */
  hover(point, place) {
    clearTimeout(this.#resting);
    this.#hovered = [point, place];
    const mine = ++this.#asked;
    const ask = async () => {
      const start = performance.now();
      const found = await this.#viewer.pick(...point).catch(() => undefined);
      this.#took = performance.now() - start;
      if (mine === this.#asked && this.#fields()) this.#readOut(found, place);
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

  /** Keeps the point that is shown at a point of the canvas. */
  async pin(point) {
    const found = await this.#viewer.pick(...point);
    if (!this.#fields()) return undefined;
    if (found) this.#setPins([...this.#pins, found].slice(-MOST_PINS));
    return found;
  }

  /** What the last probe has found, in a sentence. */
  get spoken() {
    const list = this.#stage.cards.lastElementChild?.querySelector("dl");
    if (!list) return "";
    const terms = [...list.querySelectorAll("dt")].map((term) => `${term.textContent} ${term.nextElementSibling.textContent}`);
    return `Probe ${NAMES[this.#pins.length - 1]}: ${terms.join("; ")}`;
  }

  clear() {
    this.#setPins([]);
  }

  /** The mesh or the field has changed: reads the values again. */
  async refresh() {
    if (this.#hovered) this.hover(...this.#hovered);
    const before = this.#pins;
    // While another volume is being opened, nothing is known of what is read.
    if (before.length === 0 || !this.#fields()) return;
    const read = await Promise.all(before.map(({ position }) => this.#viewer.reading(position).catch(() => undefined)));
    if (before === this.#pins && this.#fields()) this.#setPins(read.map((found, i) => found ?? before[i]));
  }

  /** The box between the points that are shown at two points of the canvas. @returns {Promise<number[] | undefined>} */
  async boxBetween(one, other) {
    const found = [await this.#viewer.pick(...one), await this.#viewer.pick(...other)];
    return found[0] && found[1] && this.boxOf(found[0].position, found[1].position);
  }

  /** The box between two points. */
  boxOf(a, b) {
    const bounds = this.#viewer.info.bounds;
    const lower = a.map((x, i) => Math.min(x, b[i]));
    const upper = a.map((x, i) => Math.max(x, b[i]));
    // Points of a section have a coordinate in common: a box needs some height there.
    const least = [0, 1, 2].map((i) => (bounds[i + 3] - bounds[i]) / 20);
    const room = least.map((length, i) => Math.max(0, length - (upper[i] - lower[i])) / 2);
    return [...lower.map((x, i) => x - room[i]), ...upper.map((x, i) => x + room[i])];
  }

  /** Shows the rectangle that is being dragged, between two places of the page; none hides it. */
  marquee(from, to) {
    const { marquee } = this.#stage;
    marquee.hidden = !from;
    if (!from) return;
    const { left, top } = marquee.parentElement.getBoundingClientRect();
    const [x, y] = [Math.min(from.x, to.x) - left, Math.min(from.y, to.y) - top];
    const [width, height] = [Math.abs(to.x - from.x), Math.abs(to.y - from.y)];
    Object.assign(marquee.style, { left: `${x}px`, top: `${y}px`, width: `${width}px`, height: `${height}px` });
  }

  /** Shows words at a place of the page until the pointer moves. */
  note(words, place) {
    this.#asked++;
    this.#readOut(words, place);
  }

  /** Shows what a probe has found, or words. @param {Probe | string | undefined} found */
  #readOut(found, place = undefined) {
    const { readout } = this.#stage;
    readout.hidden = !found;
    if (!found) return;
    readout.replaceChildren(typeof found === "string" ? found : this.#list(found));
    const stage = readout.parentElement.getBoundingClientRect();
    const [x, y] = [place.x - stage.left, place.y - stage.top];
    const { offsetWidth, offsetHeight } = readout;
    // Beside the pointer, on the side where there is room.
    const left = x + 18 + offsetWidth < stage.width ? x + 18 : x - 14 - offsetWidth;
    const top = Math.min(Math.max(y - offsetHeight / 2, 6), stage.height - offsetHeight - 6);
    Object.assign(readout.style, { left: `${Math.max(left, 4)}px`, top: `${top}px` });
  }

  /** The position, the values and the tetrahedron of a point, as a list. @param {Probe} found */
  #list({ position, values, size, error }) {
    const list = document.createElement("dl");
    const add = (name, value) => {
      const [term, description] = [document.createElement("dt"), document.createElement("dd")];
      [term.textContent, description.textContent] = [name, value];
      list.append(term, description);
    };
    const byName = new Map([this.#shown(), ...(this.#fields() ?? [])].map((field) => [field.name, field]));
    const fields = [...byName.values()];
    for (const field of fields.slice(0, MOST_FIELDS)) {
      add(field.name, `${rounded(values[field.name], field.max - field.min)} ${field.unit}`.trim());
    }
    if (fields.length > MOST_FIELDS) add("", `and ${fields.length - MOST_FIELDS} more fields`);
    const diagonal = diagonalOf(this.#viewer.info.bounds);
    add("position", position.map((x) => rounded(x, diagonal)).join(", "));
    add("cell size", rounded(size, size));
    add("cell error", `${Number((100 * error).toPrecision(2))} %`);
    return list;
  }

  #setPins(pins) {
    this.#coming = undefined;
    this.#pins = pins;
    showIdle();
    const cards = pins.map((pin, i) => {
      const card = document.createElement("div");
      card.className = "card";
      const title = document.createElement("b");
      title.textContent = `Probe ${NAMES[i]}`;
      const remove = document.createElement("button");
      remove.type = "button";
      remove.textContent = "×";
      remove.setAttribute("aria-label", `Remove probe ${NAMES[i]}`);
      remove.addEventListener("click", () => this.#setPins(this.#pins.filter((other) => other !== pin)));
      card.append(title, remove, this.#list(pin));
      if (pins.length === 1) card.append(hint());
      return card;
    });
    this.#stage.cards.replaceChildren(...cards);
    this.#place();
    this.#plot();
  }

  /** Draws the probes where they are seen now. */
  #place() {
    const places = this.#pins.map(({ position }) => this.#overlay.project(position));
    const marks = [];
    if (places.length === 2 && places.every(Boolean)) {
      const [[x1, y1], [x2, y2]] = places;
      marks.push(element("line", { x1, y1, x2, y2, class: "between" }));
    }
    const stage = this.#stage.cards;
    let last;
    for (const [i, card] of [...stage.children].entries()) {
      const place = places[i];
      card.hidden = !place;
      if (!place) continue;
      const [x, y] = place;
      marks.push(element("circle", { cx: x, cy: y, r: 8 }), element("text", { x, y: y + 4 }, NAMES[i]));
      const other = places[1 - i];
      // On the side that is away from the other probe, if there is room.
      const wantsRight = other ? x >= other[0] : true;
      const fitsRight = x + 16 + card.offsetWidth < stage.clientWidth;
      const fitsLeft = x - 16 - card.offsetWidth > 0;
      const [width, height] = [card.offsetWidth, card.offsetHeight];
      const wanted = (wantsRight && fitsRight) || !fitsLeft ? x + 16 : x - 16 - width;
      // Where neither side has room, as on a phone, it lies over the probe.
      const left = Math.max(Math.min(wanted, stage.clientWidth - width - 4), 4);
      const held = (top) => Math.max(Math.min(top, stage.clientHeight - height - 4), 4);
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
    const { plot, plotTitle, plotArea } = this.#stage;
    const mine = ++this.#plotted;
    const [from, to] = this.#pins.map(({ position }) => position);
    const shown = this.#shown();
    plot.hidden = !to || !shown;
    if (plot.hidden) return;
    const profile = await this.#viewer.line(from, to);
    if (mine !== this.#plotted) return;
    const length = Math.hypot(...from.map((x, i) => to[i] - x));
    plotTitle.textContent = `${shown.unit ? `${shown.name} in ${shown.unit}` : shown.name} from A to B`;
    const draw = () => linePlot(plotArea, profile, { length, label: "distance from A" });
    draw();
    this.#watch?.disconnect();
    this.#watch = new ResizeObserver(draw);
    this.#watch.observe(plotArea);
  }
}

function hint() {
  const words = document.createElement("small");
  words.textContent = "Click at a second point for a plot";
  return words;
}
