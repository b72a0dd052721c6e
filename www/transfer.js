/**
 * The editor of the transfer function: which opacity each value of the field has, over the histogram of the field.
 *
 * Points are dragged with the mouse or a finger. A press beside them adds one; a double click removes one, and so does
 * dragging it far out. With the keyboard, Tab goes from point to point, arrows move, Delete removes, Insert or + adds.
 */

import { histogramPath, place as point, SIZE } from "./bins.js";
import { rounded } from "./format.js";
import { element } from "./overlay.js";

/** How near a press must be to a point, in these units, and how far outside a point is dropped. */
const REACH = 14;
const DROP = 40;
/** How far an arrow key moves a point, and with Shift. */
const STEP = [0.01, 0.1];

/**
 * A point: its value as a fraction of the field's range, and its opacity.
 *
 * @typedef {[at: number, opacity: number]} Point
 */

/** The function that there is first. */
const FIRST = "ramp";

/** Functions to begin with; `at` is the fraction of the isovalue. @type {Record<string, (at: number) => Point[]>} */
const PRESETS = {
  ramp: () => [[0, 0], [0.3, 0], [1, 0.8]],
  peak: () => [[0, 0], [0.38, 0], [0.5, 0.8], [0.62, 0], [1, 0]],
  step: (at) => [[0, 0], [at, 0], [at, 0.5], [1, 0.5]],
  shells: () => [[0, 0], [0.3, 0], [0.34, 0.25], [0.38, 0], [0.62, 0], [0.66, 0.7], [0.7, 0], [1, 0]],
};

export class TransferEditor {
  #parts;
  #onChange;
  #isovalue;
  #onIsovalue;
  /** The isovalue over the curve: a line with a handle at its top. */
  #marker = element("g", { class: "isovalue", tabindex: 0, role: "slider", "aria-label": "Isovalue", "aria-valuemin": 0, "aria-valuemax": 1000 });
  #draggingIsovalue = false;
  /** @type {Point[]} */
  #points = PRESETS[FIRST](0.5);
  #selected = 2;
  /** The volume of each bin of the histogram. */
  #volumes = new Float64Array(0);
  /** @type {import("tetralod").FieldInfo | undefined} */
  #field;
  #dragging = false;

  /**
   * @param {{ svg: SVGSVGElement, bar: HTMLElement, low: HTMLElement, high: HTMLElement, chosen: HTMLElement,
   *   preset: HTMLSelectElement, add: HTMLButtonElement, remove: HTMLButtonElement }} parts
   * @param {{ isovalue: () => number, onIsovalue: (fraction: number) => void, onChange: () => void }} how
   *   `isovalue` as a fraction of the range
   */
  constructor(parts, { isovalue, onIsovalue, onChange }) {
    this.#parts = parts;
    this.#onChange = onChange;
    this.#isovalue = isovalue;
    this.#onIsovalue = onIsovalue;
    const handle = `M-6 0h12v7l-6 6-6-6z`;
    this.#marker.append(element("line", { y1: 0, y2: SIZE.height }), element("path", { d: handle, class: "handle" }), element("title", {}, "Isovalue"));
    parts.svg.append(this.#marker);
    parts.preset.addEventListener("input", () => {
      const preset = PRESETS[parts.preset.value];
      if (preset) this.#set(preset(isovalue()), 0);
    });
    parts.add.addEventListener("click", () => this.#add());
    parts.remove.addEventListener("click", () => this.#remove());
    const { svg } = parts;
    svg.setAttribute("viewBox", `0 0 ${SIZE.width} ${SIZE.height}`);
    svg.addEventListener("pointerdown", (event) => this.#press(event));
    svg.addEventListener("pointermove", (event) => this.#drag(event));
    for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, (event) => this.#drop(event));
    svg.addEventListener("dblclick", (event) => this.#near(event) >= 0 && this.#remove());
    svg.addEventListener("keydown", (event) => this.#key(event));
    this.#draw();
  }

  /** The opacities for the viewer, for values of a field, each times `factor`. @returns {[number, number][]} */
  opacities({ min, max }, factor) {
    return this.#points.map(([at, opacity]) => [min + at * (max - min), opacity * factor]);
  }

  /** Whether no value has an opacity. */
  get isTransparent() {
    return this.#points.every(([, opacity]) => opacity === 0);
  }

  /** Takes the function that there is first. */
  begin() {
    this.#parts.preset.value = FIRST;
    this.#set(PRESETS[FIRST](0.5), 0);
  }

  /** The name of a preset, or the points as numbers; nothing for what there is first. */
  get words() {
    const { value } = this.#parts.preset;
    return value === FIRST ? "" : value || String(this.#points.flat());
  }

  set words(words) {
    const values = words.split(",").map(Number);
    const isPoints = values.length >= 4 && values.length % 2 === 0 && values.every((x) => x >= 0 && x <= 1);
    const name = Object.hasOwn(PRESETS, words) ? words : FIRST;
    this.#parts.preset.value = isPoints ? "" : name;
    const pairs = values.flatMap((at, i) => (i % 2 === 0 ? [/** @type {Point} */ ([at, values[i + 1]])] : []));
    this.#points = isPoints ? pairs : PRESETS[name](this.#isovalue());
    this.#selected = Math.min(this.#selected, this.#points.length - 1);
    this.#draw();
  }

  /** What the values are of. The points stay where they are in its range. @param {import("tetralod").FieldInfo} field */
  set field(field) {
    this.#field = field;
    this.#parts.low.textContent = rounded(field.min, field.max - field.min);
    this.#parts.high.textContent = rounded(field.max, field.max - field.min);
    this.#draw();
  }

  /** The volume of the mesh in each of equal bins of the field's range. */
  set volumes(volumes) {
    this.#volumes = volumes;
    this.#draw();
  }

  /** The colours of the field's range, for the bar below the curve. @param {string} gradient in CSS */
  set colours(gradient) {
    this.#parts.bar.style.background = gradient;
  }

  /** @param {Point[]} points @param {number} selected */
  #set(points, selected) {
    this.#points = points;
    this.#selected = Math.min(Math.max(selected, 0), points.length - 1);
    this.#draw();
    this.#onChange();
  }

  /** Moves the chosen point; it stays between its neighbours. */
  #move(at, opacity) {
    const i = this.#selected;
    const lower = this.#points[i - 1]?.[0] ?? 0;
    const upper = this.#points[i + 1]?.[0] ?? 1;
    const points = [...this.#points];
    // As many digits as links keep.
    const short = (x) => Number(x.toFixed(4));
    points[i] = [short(Math.min(Math.max(at, lower), upper)), short(Math.min(Math.max(opacity, 0), 1))];
    this.#parts.preset.value = "";
    this.#set(points, i);
  }

  /** Adds a point: where it is given, or else in the middle between the chosen one and the next. */
  #add(at = undefined, opacity = undefined) {
    if (at === undefined) {
      const i = Math.min(this.#selected, this.#points.length - 2);
      const [one, next] = [this.#points[i], this.#points[i + 1]];
      return this.#add((one[0] + next[0]) / 2, (one[1] + next[1]) / 2);
    }
    const place = this.#points.findIndex((point) => point[0] > at);
    const i = place < 0 ? this.#points.length : place;
    this.#parts.preset.value = "";
    this.#set([...this.#points.slice(0, i), [at, opacity], ...this.#points.slice(i)], i);
  }

  /** Removes the chosen point; two remain. */
  #remove() {
    if (this.#points.length <= 2) return;
    this.#parts.preset.value = "";
    const i = this.#selected;
    this.#dragging = false;
    this.#set([...this.#points.slice(0, i), ...this.#points.slice(i + 1)], i);
  }

  /** The isovalue, or what it is called, has changed. */
  showIsovalue(words) {
    const [x] = point([this.#isovalue(), 0]);
    this.#marker.setAttribute("transform", `translate(${x} 0)`);
    this.#marker.setAttribute("aria-valuenow", String(Math.round(1000 * this.#isovalue())));
    this.#marker.setAttribute("aria-valuetext", words);
  }

  #press(event) {
    event.preventDefault();
    this.#parts.svg.setPointerCapture(event.pointerId);
    if (event.target instanceof Element && event.target.closest(".handle")) {
      this.#draggingIsovalue = true;
      this.#marker.focus();
      return;
    }
    const near = this.#near(event);
    this.#dragging = true;
    if (near >= 0) {
      this.#selected = near;
      this.#draw();
    } else this.#add(...this.#place(event));
    this.#focus();
  }

  #drag(event) {
    if (this.#draggingIsovalue) return this.#onIsovalue(this.#place(event)[0]);
    if (!this.#dragging) return;
    const [at, opacity] = this.#place(event);
    const height = SIZE.height - 2 * SIZE.margin;
    const outside = Math.max(-opacity, opacity - 1) * height;
    this.#parts.svg.classList.toggle("dropping", outside > DROP && this.#points.length > 2);
    this.#move(at, opacity);
  }

  #drop(event) {
    this.#draggingIsovalue = false;
    const { svg } = this.#parts;
    if (this.#dragging && event.type === "pointerup" && svg.classList.contains("dropping")) this.#remove();
    svg.classList.remove("dropping");
    this.#dragging = false;
  }

  #key(event) {
    if (event.target === this.#marker) return this.#isovalueKey(event);
    const i = Array.from(this.#parts.svg.querySelectorAll("circle")).indexOf(event.target);
    if (i < 0) return;
    this.#selected = i;
    const step = STEP[event.shiftKey ? 1 : 0];
    const [at, opacity] = this.#points[i];
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    const move = moves[event.key];
    if (move) this.#move(at + move[0], opacity + move[1]);
    else if (event.key === "Delete" || event.key === "Backspace") this.#remove();
    else if (event.key === "Insert" || event.key === "+") this.#add();
    else return;
    event.preventDefault();
    this.#focus();
  }

  #isovalueKey(event) {
    const move = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (!move) return;
    event.preventDefault();
    const at = this.#isovalue() + move * STEP[event.shiftKey ? 1 : 0];
    this.#onIsovalue(Math.min(Math.max(at, 0), 1));
  }

  #focus() {
    /** @type {SVGElement} */ (this.#parts.svg.querySelectorAll("circle")[this.#selected])?.focus();
  }

  /** Where an event is: a fraction of the range, held to it, and an opacity, which may be outside. @returns {Point} */
  #place(event) {
    const box = this.#parts.svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * SIZE.width - SIZE.margin;
    const y = ((event.clientY - box.top) / box.height) * SIZE.height - SIZE.margin;
    const at = x / (SIZE.width - 2 * SIZE.margin);
    return [Math.min(Math.max(at, 0), 1), 1 - y / (SIZE.height - 2 * SIZE.margin)];
  }

  /** The point near an event, or −1. */
  #near(event) {
    const [x, y] = point(this.#place(event));
    const distances = this.#points.map((other) => Math.hypot(point(other)[0] - x, point(other)[1] - y));
    const nearest = Math.min(...distances);
    return nearest <= REACH ? distances.indexOf(nearest) : -1;
  }

  #draw() {
    const { svg, chosen, remove } = this.#parts;
    const [first, last] = [this.#points[0], this.#points[this.#points.length - 1]];
    const curve = [[0, first[1]], ...this.#points, [1, last[1]]].map((p) => point(/** @type {Point} */ (p)).join(" "));
    const base = [point([1, 0]).join(" "), point([0, 0]).join(" ")];
    const circles = this.#points.map((one, i) => {
      const [cx, cy] = point(one);
      const label = `Point ${i + 1} of ${this.#points.length}: ${this.#words(one)}`;
      const isChosen = i === this.#selected;
      const attributes = { cx, cy, r: isChosen ? 7 : 5.5, tabindex: 0, role: "button", "aria-label": label };
      return element("circle", { ...attributes, class: isChosen ? "chosen" : "" });
    });
    // The circles stay in the page, so that the one with the focus keeps it.
    const before = svg.querySelectorAll("circle");
    if (before.length === circles.length) {
      before.forEach((circle, i) => {
        for (const { name, value } of circles[i].attributes) circle.setAttribute(name, value);
      });
    }
    const shapes = [
      element("path", { d: histogramPath(this.#volumes), class: "volumes" }),
      element("path", { d: `M${curve.join("L")}L${base.join("L")}Z`, class: "area" }),
      element("path", { d: `M${curve.join("L")}`, class: "curve" }),
    ];
    const kept = before.length === circles.length ? Array.from(before) : circles;
    svg.querySelectorAll(":scope > path").forEach((path) => path.remove());
    svg.prepend(...shapes);
    if (kept === circles) {
      before.forEach((circle) => circle.remove());
      svg.append(...circles);
    }
    chosen.textContent = this.#words(this.#points[this.#selected]);
    remove.disabled = this.#points.length <= 2;
  }

  #words([at, opacity]) {
    const { min = 0, max = 1, unit = "" } = this.#field ?? {};
    const value = `${rounded(min + at * (max - min), max - min)} ${unit}`.trim();
    return `value ${value}, opacity ${Math.round(100 * opacity)} %`;
  }
}
