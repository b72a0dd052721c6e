/**
 * What is under the pointer, points that are kept, and a plot of the field between them.
 *
 * A click keeps a point as a probe; with two there is a plot, with three the angle at the second. The first of four gives way. A drag with Alt
 * makes a box of the points at its ends.
 */

import { $, all, describe, element, select, shape, svg } from "./dom.js";
import { pickBoth, readBoth } from "./beside.js";
import { drawnAt } from "./deform.js";
import { shownField } from "./fields.js";
import { degrees, diagonalOf, precise, rounded } from "./format.js";
import { nameWithUnit, withUnit } from "./lengths.js";
import { refreshMeasures } from "./measures.js";
import { curvesOverTime, hasTimes, plotOf, rowsOverTime } from "./overtime.js";
import { demo, page, viewer, volume } from "./page.js";
import { alongAlways, alongNow, angleOf, legsOf, lengthOf, NAMES } from "./path.js";
import { heatPlot, linePlot } from "./plot.js";
import { numberOf, setHidden, showOnly } from "./regions.js";
import { store } from "./state.js";
import { AXES } from "./volume.js";

/** The viewer is asked at once while it answers within this time, and otherwise when the pointer rests (in ms). */
const QUICK = 40;
const REST = 150;
const MOST_PINS = 3;
/** Positions in links have so many digits. */
const DIGITS = 6;
/** The radius of a probe in the picture (in px). */
const MARK = 8;
/** Fields that a list shows, at most. */
const MOST_FIELDS = 8;

/** What another click is good for, by how many probes there are. */
const HINTS = ["", "Click at a second point for a plot", "Click at a third point for an angle"];

/** What is at a point, and what the file beside has there: nothing where it is not. @typedef {import("tetralod/viewer").Reading & { there?: import("tetralod/viewer").Reading }} Probe */
/** @typedef {import("./volume.js").Point} Point */
/** @typedef {import("./controls.js").Point} Spot */
/** @typedef {import("./controls.js").Place} Place */
/** @typedef {import("./overlay.js").Box} Box */

/** @template T @typedef {import("./path.js").Along<T>} Along */
/** Its title, and what draws it. @typedef {[title: string, draw: () => void]} Plot */

/** @param {number} left @param {number} top @param {number} width @param {number} height @returns {Box} */
const boxAt = (left, top, width, height) => ({ left, top, right: left + width, bottom: top + height });
/** The area that two boxes have in common. @param {Box} a @param {Box} b */
const common = (a, b) =>
  Math.max(Math.min(a.right, b.right) - Math.max(a.left, b.left), 0) * Math.max(Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top), 0);

/** The shades of a plot, where the picture has no colours of the field. */
const SHADES = Array.from({ length: 32 }, (_, i) => `hsl(210 25% ${12 + 2.5 * i}%)`);

/** What colours mean in a plot: what they mean in the picture, if they are of the field there. */
function scale() {
  const { name, min, max } = shownField();
  const { legend } = viewer();
  return legend?.label === name && legend.labels.length === 0 ? legend : { range: /** @type {[number, number]} */ ([min, max]), log: false, colours: SHADES };
}

/** The field that is plotted. */
const fieldTitle = () => nameWithUnit(shownField().name, shownField().unit);

/** The point of a probe as it is in links. @param {Probe} probe @returns {Point} */
function placeOf({ position: [x, y, z] }) {
  const kept = (/** @type {number} */ one) => precise(one, diagonalOf(volume().bounds), DIGITS);
  return [kept(x), kept(y), kept(z)];
}

/** What can be done with the part that a probe is in, where there are several. @param {Probe} probe */
function partButtons({ region }) {
  if (region === undefined || (volume().regions?.all.length ?? 0) < 2) return [];
  const button = (/** @type {string} */ words, /** @type {(name: string) => void} */ act) => {
    const made = element("button", { type: "button", className: "of-part", ariaLabel: `${words}: ${region}` }, words);
    made.addEventListener("click", () => act(region));
    return made;
  };
  return [button("Hide this part", (name) => setHidden([numberOf(name)], true)), button("Show it alone", (name) => showOnly([numberOf(name)]))];
}

/** Lines from one place of the picture to the next. @param {(import("./overlay.js").Pixels | undefined)[]} places */
const linesBetween = (places) =>
  places.slice(1).flatMap((to, i) => {
    const from = places[i];
    return from && to ? [shape("line", { x1: from[0], y1: from[1], x2: to[0], y2: to[1], class: "between" })] : [];
  });

/** The mark of a probe. @param {import("./overlay.js").Pixels} place @param {number} i */
const markAt = ([x, y], i) => [shape("circle", { cx: x, cy: y, r: MARK }), shape("text", { x, y: y + 4 }, NAMES[i])];

export class Probes {
  /** Resolves when what is at the points of the state is read. */
  read = Promise.resolve();
  #marks = shape("g", { class: "pins" });
  #beside = shape("g", { class: "pins" });
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
  /** Where the pointer was last, on the picture of which viewer. @type {[point: Spot, place: Place, from: import("tetralod/viewer").Viewer] | undefined} */
  #hovered;

  constructor() {
    svg("overlay").append(this.#marks);
    svg("overlay-beside").append(this.#beside);
    page.overlay.follow(() => this.#place());
    page.overlayBeside.follow(() => this.#placeBeside());
    store.subscribe(["met"], () => this.refresh());
    store.subscribe(["probes"], () => {
      this.read = this.#follow();
    });
    viewer().addEventListener("legend", () => this.#plot());
    store.subscribe(["over-time", "field", "time", "unit"], () => this.#show(this.#pins, this.#read));
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
    const found = await Promise.all(probes.map((point) => readBoth([...point]))).catch(() => undefined);
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

  /** The pointer is at a point of the canvas of a viewer (−1 to 1, y upwards), and at a place of the page. @param {Spot} point @param {Place} place */
  hover(point, place, from = viewer()) {
    clearTimeout(this.#resting);
    this.#hovered = [point, place, from];
    const mine = ++this.#asked;
    const ask = async () => {
      const start = performance.now();
      const found = await pickBoth(from, point).catch(() => undefined);
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

  /** Keeps the point that is shown at a point of the canvas. Resolves to what is said of it; nothing where nothing is. @param {Spot} point @param {import("tetralod/viewer").Viewer} from */
  async pin(point, from = viewer()) {
    const found = await pickBoth(from, point);
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
    const read = await Promise.all(before.map(({ position }) => readBoth(position).catch(() => undefined)));
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

  /** The box around points. @param {Point[]} points */
  boxOf(...points) {
    const { bounds } = volume();
    const [lower, upper] = [Math.min, Math.max].map((end) => AXES.map((i) => end(...points.map((point) => point[i]))));
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
    const stage = $("stages").getBoundingClientRect();
    const [x, y] = [place.x - stage.left, place.y - stage.top];
    const { offsetWidth, offsetHeight } = readout;
    // Beside the pointer, on the side where there is room.
    const left = x + 18 + offsetWidth < stage.width ? x + 18 : x - 14 - offsetWidth;
    const top = Math.min(Math.max(y - offsetHeight / 2, 6), stage.height - offsetHeight - 6);
    Object.assign(readout.style, { left: `${Math.max(left, 4)}px`, top: `${top}px` });
  }

  /** The position, the values and the tetrahedron of a point, as a list. @param {Probe} found */
  #list({ position, values, size, error, region, there }) {
    const list = element("dl");
    const byName = new Map([shownField(), ...volume().fields].map((field) => [field.name, field]));
    const fields = [...byName.values()];
    const diagonal = diagonalOf(volume().bounds);
    describe(list, [
      ...fields.slice(0, MOST_FIELDS).flatMap(({ name, min, max, unit }) => {
        const words = (/** @type {number | undefined} */ value) => (value === undefined ? "–" : `${rounded(value, max - min)} ${unit}`.trim());
        return [[name, words(values[name])], ...(demo.beside?.info ? [["… beside", words(there?.values[name])]] : [])];
      }),
      ...(fields.length > MOST_FIELDS ? [["", `and ${fields.length - MOST_FIELDS} more fields`]] : []),
      ...(region === undefined ? [] : [["part", region]]),
      ["position", withUnit(position.map((x) => rounded(x, diagonal)).join(", "))],
      ["cell size", withUnit(rounded(size, size))],
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
      const hint = i === pins.length - 1 && HINTS[pins.length] ? [element("small", {}, HINTS[pins.length])] : [];
      return element("div", { className: "card" }, element("b", {}, `Probe ${NAMES[i]}`), remove, this.#list(pin), ...partButtons(pin), ...hint);
    });
    if (hasTimes()) cards.at(-1)?.append(this.#timeButton());
    const hadFocus = document.activeElement?.matches(".card .over-time");
    $("cards").replaceChildren(...cards);
    if (hadFocus) all(".card .over-time")[0]?.focus();
    this.#place();
    this.#plot();
    refreshMeasures();
  }

  /** What shows values over time in the place of those along the line, or no longer. */
  #timeButton() {
    const isOn = store.state["over-time"] !== "";
    const made = element("button", { type: "button", className: "over-time", ariaPressed: String(isOn) }, "Plot over time");
    made.addEventListener("click", () => store.change({ "over-time": isOn ? "" : "1" }));
    return made;
  }

  /** Draws the probes where they are seen now. */
  #place() {
    this.#placeBeside();
    if (this.#pins.length === 0) return this.#marks.replaceChildren();
    const places = this.#pins.map((pin) => page.overlay.project(drawnAt(pin)));
    const marks = linesBetween(places);
    const stage = $("cards");
    /** What a card should not cover: the legend, probes, and cards before it. @type {Box[]} */
    const taken = [...page.overlay.covered, ...places.flatMap((place) => (place ? [boxAt(place[0] - MARK, place[1] - MARK, 2 * MARK, 2 * MARK)] : []))];
    for (const [i, card] of /** @type {HTMLElement[]} */ ([...stage.children]).entries()) {
      const place = places[i];
      card.hidden = !place;
      if (!place) continue;
      const [x, y] = place;
      marks.push(...markAt([x, y], i));
      const { offsetWidth: width, offsetHeight: height } = card;
      const held = (/** @type {number} */ at, /** @type {number} */ most) => Math.max(Math.min(at, most - 4), 4);
      const other = places[i === 0 ? 1 : i - 1];
      const sides = [x + 2 * MARK, x - 2 * MARK - width];
      // On the side that is away from another probe if it covers nothing there, as it does where there is no room.
      const candidates = (other && x < other[0] ? sides.reverse() : sides).flatMap((left) =>
        [y - height / 2, y, y - height].map((top) => boxAt(held(left, stage.clientWidth - width), held(top, stage.clientHeight - height), width, height)),
      );
      const covered = (/** @type {Box} */ box) => taken.reduce((sum, one) => sum + common(box, one), 0);
      const [best] = candidates.sort((one, other) => covered(one) - covered(other));
      card.style.transform = `translate(${Math.round(best.left)}px, ${Math.round(best.top)}px)`;
      taken.push(best);
    }
    this.#marks.replaceChildren(...marks);
  }

  /** The same in the picture of the file beside, without cards. */
  #placeBeside() {
    const places = this.#pins.map((pin) => page.overlayBeside.project(drawnAt(pin.there ?? pin)));
    this.#beside.replaceChildren(...linesBetween(places), ...places.flatMap((place, i) => (place ? markAt(place, i) : [])));
  }

  /** Shows what is plotted of the probes, if there is anything to plot. */
  async #plot() {
    const mine = ++this.#plotted;
    const pins = this.#pins;
    const kind = plotOf(pins.length);
    const isShown = demo.info !== undefined && (pins.length > 1 || (pins.length === 1 && kind !== ""));
    $("plot").hidden = !isShown;
    $("box-of-pins").hidden = pins.length < 2;
    $("over-time").hidden = !hasTimes();
    for (const option of select("over-time").options) option.disabled = option.value === "line" && pins.length < 2;
    this.#watch?.disconnect();
    if (!isShown) return;
    // What is plotted of one probe is not what was chosen for two.
    select("over-time").value = kind;
    const legs = legsOf(pins.map(({ position }) => position));
    /** @type {[now: Awaited<ReturnType<typeof alongNow>>, always: Awaited<ReturnType<typeof alongAlways>>]} */
    const places = [kind === "" ? await alongNow(legs) : [], kind === "line" ? await alongAlways(legs) : []];
    if (mine !== this.#plotted || !demo.info) return;
    const [words, draw] = kind === "1" ? this.#overTime() : along(legs, ...places);
    $("plot-title").textContent = words;
    draw();
    this.#watch = new ResizeObserver(draw);
    this.#watch.observe(svg("plot-area"));
  }

  /** The values at the probes over time. @returns {Plot} */
  #overTime() {
    const { profiles, now, ...ends } = curvesOverTime(this.#pins);
    const names = NAMES.slice(0, profiles.length);
    const title = `${fieldTitle()} over time at ${names.join(", ").replace(/, (?=.$)/, " and ")}`;
    const how = { ...ends, label: "time", marks: /** @type {[number, string][]} */ ([[now, ""]]), names: names.length > 1 ? names : [] };
    return [title, () => linePlot(svg("plot-area"), profiles, how)];
  }
}

/**
 * The values on the way from probe to probe, now or at all times: whichever there are.
 *
 * @param {import("./path.js").Leg[]} legs @param {Along<number>[]} now @param {Along<number[] | undefined>[]} always @returns {Plot}
 */
function along(legs, now, always) {
  const [length, angle] = [lengthOf(legs), angleOf(legs)];
  const far = withUnit(rounded(length, length));
  const way = legs.length === 1 ? `from A to B, ${far} apart` : `from A over B to C, ${far} long${angle === undefined ? "" : `, ${degrees(angle)} at B`}`;
  const title = `${fieldTitle()} ${way}`;
  const marks = legs.slice(1).map(({ start }) => /** @type {[number, string]} */ ([start / length, "B"]));
  const how = { to: length, label: nameWithUnit("distance from A"), marks };
  const at = [...now, ...always].map(({ distance }) => distance / (length || 1));
  if (always.length === 0) {
    const profile = { at, values: now.map(({ value }) => value) };
    return [title, () => linePlot(svg("plot-area"), [profile], how)];
  }
  const grid = { at, ...rowsOverTime(always.map(({ value }) => value)) };
  const look = { ...how, step: store.state.time, scale: scale() };
  return [`${title}, at all times`, () => heatPlot(svg("plot-area"), grid, look)];
}
