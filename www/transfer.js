/**
 * The editor of the transfer function: which opacity each value of the field has, over the histogram of the field.
 *
 * Points are dragged with the mouse or a finger. A press beside them adds one; a double click removes one, and so does
 * dragging it far out. With the keyboard, Tab goes from point to point, arrows move, Delete removes, Insert or + adds.
 */

import { histogramPath, place as point, SIZE } from "./bins.js";
import { pointsOf } from "./curve.js";
import { $, button, select, shape, svg } from "./dom.js";
import { isovaluePart, isovalueWords, setIsovalue, shownField } from "./fields.js";
import { rounded } from "./format.js";
import { demo } from "./page.js";
import { store } from "./state.js";

/** How near a press must be to a point, in these units, and how far outside a point is dropped. */
const REACH = 14;
const DROP = 40;
/** How far an arrow key moves a point, and with Shift. */
const STEP = [0.01, 0.1];

/** @typedef {import("./curve.js").Point} Point */

/** A point in the range of opacities, with as many digits as links keep. @param {Point} point @returns {Point} */
const held = ([at, opacity]) => [Number(at.toFixed(4)), Number(Math.min(Math.max(opacity, 0), 1).toFixed(4))];

export class TransferEditor {
  #svg = svg("transfer");
  /** The isovalue over the curve: a line with a handle at its top. */
  #marker = shape("g", { class: "isovalue", tabindex: 0, role: "slider", "aria-label": "Isovalue", "aria-valuemin": 0, "aria-valuemax": 1000 });
  #draggingIsovalue = false;
  #selected = 2;
  /** The volume of each bin of the histogram. @type {ArrayLike<number>} */
  #volumes = [];
  #dragging = false;

  constructor() {
    const handle = `M-6 0h12v7l-6 6-6-6z`;
    this.#marker.append(shape("line", { y1: 0, y2: SIZE.height }), shape("path", { d: handle, class: "handle" }), shape("title", {}, "Isovalue"));
    const shown = this.#svg;
    shown.append(this.#marker);
    const preset = select("transfer-preset");
    preset.addEventListener("input", () => preset.value && this.#take(preset.value, 0));
    $("transfer-add").addEventListener("click", () => this.#add());
    $("transfer-remove").addEventListener("click", () => this.#remove());
    shown.setAttribute("viewBox", `0 0 ${SIZE.width} ${SIZE.height}`);
    shown.addEventListener("pointerdown", (event) => this.#press(event));
    shown.addEventListener("pointermove", (event) => this.#drag(event));
    for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) shown.addEventListener(name, (event) => this.#drop(event));
    shown.addEventListener("dblclick", (event) => this.#near(event) >= 0 && this.#remove());
    shown.addEventListener("keydown", (event) => this.#key(event));
    store.subscribe(["transfer", "isovalue", "field", "time"], () => this.#draw());
    this.#draw();
  }

  get #points() {
    return pointsOf(store.state.transfer, isovaluePart());
  }

  /** The volume of the mesh in each of equal bins of the field's range. */
  set volumes(/** @type {ArrayLike<number>} */ volumes) {
    this.#volumes = volumes;
    this.#draw();
  }

  /** Takes another function, with one of its points chosen. @param {import("./curve.js").Curve} transfer @param {number} selected */
  #take(transfer, selected) {
    this.#selected = selected;
    store.change({ transfer });
  }

  /** Moves the chosen point; it stays between its neighbours. @param {number} at @param {number} opacity */
  #move(at, opacity) {
    const i = this.#selected;
    const lower = this.#points[i - 1]?.[0] ?? 0;
    const upper = this.#points[i + 1]?.[0] ?? 1;
    const points = [...this.#points];
    points[i] = held([Math.min(Math.max(at, lower), upper), opacity]);
    this.#take(points, i);
  }

  /** The middle between the chosen point and the next. @returns {Point} */
  get #middle() {
    const i = Math.min(this.#selected, this.#points.length - 2);
    const [one, next] = [this.#points[i], this.#points[i + 1]];
    return [(one[0] + next[0]) / 2, (one[1] + next[1]) / 2];
  }

  /** Adds a point. @param {Point} added */
  #add(added = this.#middle) {
    const place = this.#points.findIndex(([at]) => at > added[0]);
    const i = place < 0 ? this.#points.length : place;
    this.#take([...this.#points.slice(0, i), held(added), ...this.#points.slice(i)], i);
  }

  /** Removes the chosen point; two remain. */
  #remove() {
    if (this.#points.length <= 2) return;
    const i = this.#selected;
    this.#dragging = false;
    this.#take([...this.#points.slice(0, i), ...this.#points.slice(i + 1)], i);
  }

  #press(/** @type {PointerEvent} */ event) {
    event.preventDefault();
    this.#svg.setPointerCapture(event.pointerId);
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
    } else this.#add(this.#place(event));
    this.#focus();
  }

  #drag(/** @type {PointerEvent} */ event) {
    if (this.#draggingIsovalue) return setIsovalue(this.#place(event)[0]);
    if (!this.#dragging) return;
    const [at, opacity] = this.#place(event);
    const height = SIZE.height - 2 * SIZE.margin;
    const outside = Math.max(-opacity, opacity - 1) * height;
    this.#svg.classList.toggle("dropping", outside > DROP && this.#points.length > 2);
    this.#move(at, opacity);
  }

  #drop(/** @type {PointerEvent} */ event) {
    this.#draggingIsovalue = false;
    if (this.#dragging && event.type === "pointerup" && this.#svg.classList.contains("dropping")) this.#remove();
    this.#svg.classList.remove("dropping");
    this.#dragging = false;
  }

  #key(/** @type {KeyboardEvent} */ event) {
    if (event.target === this.#marker) return this.#isovalueKey(event);
    const i = /** @type {(EventTarget | null)[]} */ ([...this.#svg.querySelectorAll("circle")]).indexOf(event.target);
    if (i < 0) return;
    this.#selected = i;
    const step = STEP[event.shiftKey ? 1 : 0];
    const [at, opacity] = this.#points[i];
    /** @type {Record<string, [number, number]>} */
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    const move = moves[event.key];
    if (move) this.#move(at + move[0], opacity + move[1]);
    else if (event.key === "Delete" || event.key === "Backspace") this.#remove();
    else if (event.key === "Insert" || event.key === "+") this.#add();
    else return;
    event.preventDefault();
    this.#focus();
  }

  #isovalueKey(/** @type {KeyboardEvent} */ event) {
    /** @type {Record<string, number>} */
    const moves = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    setIsovalue(isovaluePart() + move * STEP[event.shiftKey ? 1 : 0]);
  }

  #focus() {
    this.#svg.querySelectorAll("circle")[this.#selected]?.focus();
  }

  /** Where an event is: a fraction of the range, held to it, and an opacity, which may be outside. @param {MouseEvent} event @returns {Point} */
  #place(event) {
    const box = this.#svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * SIZE.width - SIZE.margin;
    const y = ((event.clientY - box.top) / box.height) * SIZE.height - SIZE.margin;
    const at = x / (SIZE.width - 2 * SIZE.margin);
    return [Math.min(Math.max(at, 0), 1), 1 - y / (SIZE.height - 2 * SIZE.margin)];
  }

  /** The point near an event, or −1. @param {MouseEvent} event */
  #near(event) {
    const [x, y] = point(this.#place(event));
    const distances = this.#points.map((other) => Math.hypot(point(other)[0] - x, point(other)[1] - y));
    const nearest = Math.min(...distances);
    return nearest <= REACH ? distances.indexOf(nearest) : -1;
  }

  #draw() {
    const [shown, points] = [this.#svg, this.#points];
    this.#selected = Math.min(Math.max(this.#selected, 0), points.length - 1);
    this.#mark();
    const [first, last] = [points[0], points[points.length - 1]];
    /** @type {Point[]} */
    const whole = [[0, first[1]], ...points, [1, last[1]]];
    const curve = whole.map((one) => point(one).join(" "));
    const base = [point([1, 0]).join(" "), point([0, 0]).join(" ")];
    const circles = points.map((one, i) => {
      const [cx, cy] = point(one);
      const label = `Point ${i + 1} of ${points.length}: ${this.#words(one)}`;
      const isChosen = i === this.#selected;
      const attributes = { cx, cy, r: isChosen ? 7 : 5.5, tabindex: 0, role: "button", "aria-label": label };
      return shape("circle", { ...attributes, class: isChosen ? "chosen" : "" });
    });
    // The circles stay in the page, so that the one with the focus keeps it.
    const before = shown.querySelectorAll("circle");
    if (before.length === circles.length) {
      before.forEach((circle, i) => {
        for (const { name, value } of circles[i].attributes) circle.setAttribute(name, value);
      });
    }
    const shapes = [
      shape("path", { d: histogramPath(this.#volumes), class: "volumes" }),
      shape("path", { d: `M${curve.join("L")}L${base.join("L")}Z`, class: "area" }),
      shape("path", { d: `M${curve.join("L")}`, class: "curve" }),
    ];
    const kept = before.length === circles.length ? Array.from(before) : circles;
    shown.querySelectorAll(":scope > path").forEach((path) => path.remove());
    shown.prepend(...shapes);
    if (kept === circles) {
      before.forEach((circle) => circle.remove());
      shown.append(...circles);
    }
    select("transfer-preset").value = typeof store.state.transfer === "string" ? store.state.transfer : "";
    $("transfer-chosen").textContent = this.#words(points[this.#selected]);
    button("transfer-remove").disabled = points.length <= 2;
  }

  /** The isovalue, and the ends of the field's range. */
  #mark() {
    const [x] = point([isovaluePart(), 0]);
    this.#marker.setAttribute("transform", `translate(${x} 0)`);
    this.#marker.setAttribute("aria-valuenow", String(Math.round(1000 * isovaluePart())));
    if (!demo.info) return;
    const { min, max } = shownField();
    this.#marker.setAttribute("aria-valuetext", isovalueWords());
    $("transfer-low").textContent = rounded(min, max - min);
    $("transfer-high").textContent = rounded(max, max - min);
  }

  #words(/** @type {Point} */ [at, opacity]) {
    const { min, max, unit } = demo.info ? shownField() : { min: 0, max: 1, unit: "" };
    const value = `${rounded(min + at * (max - min), max - min)} ${unit}`.trim();
    return `value ${value}, opacity ${Math.round(100 * opacity)} %`;
  }
}
