/**
 * What is drawn over the picture: axes with ticks, a scale bar, a cube that shows how the camera is turned, and whatever
 * else has a place in the model.
 *
 * All of it is placed again with every picture. Labels that would lie over another one, over the legend or outside of the
 * picture are left out.
 */

import { shape } from "./dom.js";
import { across, plus } from "./geometry.js";

/** Widths of characters and heights of lines of labels, in pixels. */
const LABEL = { width: 7, height: 15, name: 8.5 };
/** Of the ends of ticks and of labels from the axis, in pixels. */
const TICK = 6;
const GAP = 10;
/** Half an edge of the cube, and its distance from the corner of the picture. */
const CUBE = { size: 21, right: 48, top: 50 };

/** Parts of a circle. */
const CIRCLE = 48;

const NAMES = ["x", "y", "z"];

/** The faces of the cube: their normals, their names, and the sides that show them from the front. */
const FACES = NAMES.flatMap((name, axis) =>
  [1, -1].map((sign) => ({
    axis,
    sign,
    label: `${sign < 0 ? "−" : "+"}${name}`,
    side: `${sign < 0 ? "along" : "against"}${name.toUpperCase()}`,
  })),
);

/** @typedef {{ left: number, top: number, right: number, bottom: number }} Box */
/** @typedef {ArrayLike<number> & Iterable<number>} Coordinates */
/** A plane in the box, and points on it; as an aid it is no part of pictures that are saved. @typedef {{ corners: readonly Coordinates[], seeds: readonly Coordinates[], isAid: boolean }} Section */
/** @typedef {{ center: number[], radius: number }} Sphere */
/** @typedef {[x: number, y: number]} Pixels */

/** @template T @param {T | undefined} one @returns {one is T} */
const isThere = (one) => one !== undefined;

export class OverlayView {
  #svg;
  #moving = shape("g");
  #faces;
  /** @type {import("tetralod/viewer").Overlay | undefined} */
  #data;
  #showsAxes = true;
  #unit = "";
  /** @type {Section | undefined} */
  #section;
  /** @type {Sphere | undefined} */
  #sphere;
  /** What lies over the picture, and must stay free of labels: elements of the page. @type {HTMLElement[]} */
  #over;
  /** What is told when places on the screen have changed. @type {(() => void)[]} */
  #followers = [];

  /**
   * @param {SVGSVGElement} svg lies over the canvas
   * @param {{ covered: HTMLElement[], onSide: (side: any) => void }} how
   */
  constructor(svg, { covered, onSide }) {
    this.#svg = svg;
    this.#over = covered;
    this.#faces = FACES.map((face) => {
      const group = shape("g", { class: `face face-${NAMES[face.axis]}` });
      group.append(shape("polygon"), shape("text", {}, face.label), shape("title", {}, `Look at ${face.label}`));
      group.addEventListener("click", () => onSide(face.side));
      return { ...face, group };
    });
    svg.replaceChildren(this.#moving, ...this.#faces.map(({ group }) => group));
    new ResizeObserver(() => this.#draw()).observe(svg);
  }

  /** What the viewer says with its event `overlay`. @param {import("tetralod/viewer").Overlay | undefined} data */
  set data(data) {
    this.#data = data;
    this.#draw();
  }

  /** How the last picture is displaced; undefined where it is not. */
  get deformation() {
    return this.#data?.deformation;
  }

  /** Right, up and towards the eye, as directions in the model; undefined while nothing is drawn. */
  get rotation() {
    return this.#data?.rotation;
  }

  /** @param {boolean} shows */
  set showsAxes(shows) {
    this.#showsAxes = shows;
    this.#draw();
  }

  /** What stands behind lengths; empty for nothing. @param {string} unit */
  set unit(unit) {
    this.#unit = unit;
    this.#draw();
  }

  /** A plane across the box, and points on it; undefined for none. @param {Section | undefined} section */
  set section(section) {
    this.#section = section;
    this.#draw();
  }

  /** A sphere, drawn as three circles; undefined for none. @param {Sphere | undefined} sphere */
  set sphere(sphere) {
    this.#sphere = sphere;
    this.#draw();
  }

  /**
   * The point of a plane that is seen at a point of the canvas; undefined behind the eye.
   *
   * @param {[number, number]} point
   * @param {import("./geometry.js").Point} normal of length 1
   * @param {number} at where it is along that
   */
  onPlane([x, y], normal, at) {
    const m = this.#data?.matrix;
    if (!m) return undefined;
    const [first, second] = across(normal);
    // Two linear equations for how far it is along these two directions.
    const equation = (/** @type {number} */ i, /** @type {number} */ screen) => {
      const part = (/** @type {number} */ column) => m[4 * column + i] - screen * m[4 * column + 3];
      const along = (/** @type {Coordinates} */ way) => part(0) * way[0] + part(1) * way[1] + part(2) * way[2];
      return [along(first), along(second), -(along(normal) * at + part(3))];
    };
    const [[a, b, e], [c, d, f]] = [equation(0, x), equation(1, y)];
    const determinant = a * d - b * c;
    const onIt = plus(plus([0, 0, 0], first, (e * d - b * f) / determinant), second, (a * f - e * c) / determinant);
    const found = plus(onIt, normal, at);
    return this.project(found) && found;
  }

  /** The outline of the plane, and the points on it. */
  #plane() {
    const { corners = [], seeds = [], isAid = false } = this.#section ?? {};
    const group = shape("g", { class: `plane${isAid ? " aid" : ""}` });
    const points = corners.map((corner) => this.project(corner));
    if (points.length > 0 && points.every(isThere)) group.append(...["rim", "line"].map((name) => shape("polygon", { points: points.join(" "), class: name })));
    for (const [cx, cy] of seeds.map((seed) => this.project(seed)).filter(isThere)) group.append(shape("circle", { cx, cy, r: 3.5 }));
    return group;
  }

  /** Circles around the sphere, across each axis. */
  #circles() {
    const group = shape("g", { class: "sphere" });
    if (!this.#sphere) return group;
    const { center, radius } = this.#sphere;
    for (const axis of [0, 1, 2]) {
      const points = Array.from({ length: CIRCLE + 1 }, (_, i) => {
        const point = center.slice();
        point[(axis + 1) % 3] += radius * Math.cos((2 * Math.PI * i) / CIRCLE);
        point[(axis + 2) % 3] += radius * Math.sin((2 * Math.PI * i) / CIRCLE);
        return this.project(point);
      });
      if (points.every(isThere)) group.append(shape("polyline", { points: points.join(" ") }));
    }
    return group;
  }

  /** Draws again, because what covers the picture has changed. */
  refresh() {
    this.#draw();
  }

  /** Calls `then` whenever places on the screen have changed. @param {() => void} then */
  follow(then) {
    this.#followers.push(then);
  }

  /** Where a point of the model is on the screen, in pixels; undefined behind the eye. @param {Coordinates} point @returns {Pixels | undefined} */
  project(point) {
    const [x, y, z] = point;
    const m = this.#data?.matrix;
    if (!m) return undefined;
    const row = (/** @type {number} */ i) => m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i];
    const w = row(3);
    return w > 0 ? this.#pixels([row(0) / w, row(1) / w]) : undefined;
  }

  /** A point of the canvas (−1 to 1, y upwards) in pixels. @param {Coordinates} point @returns {Pixels} */
  #pixels(point) {
    const [x, y] = point;
    const { clientWidth, clientHeight } = this.#svg;
    return [((x + 1) / 2) * clientWidth, ((1 - y) / 2) * clientHeight];
  }

  #draw() {
    const data = this.#data;
    this.#svg.toggleAttribute("hidden", !data);
    if (data) this.#drawAll(data);
    for (const then of this.#followers) then();
  }

  /** @param {import("tetralod/viewer").Overlay} data */
  #drawAll(data) {
    const [right, bottom] = [this.#svg.clientWidth, this.#svg.clientHeight];
    const hasCube = this.#showsAxes && right > 260;
    /** @type {Box[]} */
    const taken = this.covered;
    if (hasCube) taken.push({ left: right - 2 * CUBE.right, top: 0, right, bottom: 2 * CUBE.top });
    const fits = (/** @type {Box} */ box) => box.left > 2 && box.top > 2 && box.right < right - 2 && box.bottom < bottom - 2;
    const isFree = (/** @type {Box} */ box) => fits(box) && !taken.some((other) => overlap(box, other));
    const place = (/** @type {Box} */ box) => isFree(box) && taken.push(box) > 0;
    /** @type {SVGElement[]} */
    const parts = [this.#plane(), this.#circles()];
    if (this.#showsAxes) {
      // It takes its place first, and is drawn over the axes.
      const bar = this.#scaleBar(data.scaleBar, taken, bottom);
      parts.push(...data.axes.map((axis) => this.#axis(axis, place)), bar);
    }
    this.#moving.replaceChildren(...parts);
    this.#turnCube(data.rotation, right, hasCube);
  }

  /** What covers the picture, in pixels of it. @returns {Box[]} */
  get covered() {
    const { left, top } = this.#svg.getBoundingClientRect();
    const shown = this.#over.filter((over) => over.offsetParent !== null && over.clientHeight > 0);
    // On large screens the overlay is enlarged by CSS: its own pixels are not those of the page.
    const zoom = this.#svg.currentCSSZoom ?? 1;
    return shown.map((over) => {
      const box = over.getBoundingClientRect();
      const margin = 4;
      return {
        left: (box.left - left) / zoom - margin,
        top: (box.top - top) / zoom - margin,
        right: (box.right - left) / zoom + margin,
        bottom: (box.bottom - top) / zoom + margin,
      };
    });
  }

  /** @param {import("tetralod/viewer").AxisOverlay} axis @param {(box: Box) => boolean} place */
  #axis({ axis, ends, outward, ticks }, place) {
    const group = shape("g", { class: `axis axis-${NAMES[axis]}` });
    const [from, to] = ends.map((end) => this.#pixels(end));
    /** @type {Pixels} */
    const out = [outward[0], -outward[1]];
    /** @param {Pixels} from @param {number} distance @returns {Pixels} */
    const away = (from, distance) => [from[0] + out[0] * distance, from[1] + out[1] * distance];
    group.append(line(from, to));
    let farthest = 0;
    for (const { label, at } of ticks) {
      const point = this.#pixels(at);
      group.append(line(point, away(point, TICK)));
      const words = label.replace("-", "−");
      const box = labelBox(away(point, GAP), out, words);
      if (!place(box)) continue;
      group.append(text(box, words));
      farthest = Math.max(farthest, Math.abs(out[0]) * (box.right - box.left) + Math.abs(out[1]) * LABEL.height);
    }
    const name = this.#unit ? `${NAMES[axis]} in ${this.#unit}` : NAMES[axis];
    // The name is at the middle, or where there is room for it.
    const places = [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9, 0, 1].map((part) => {
      return labelBox(away([from[0] + (to[0] - from[0]) * part, from[1] + (to[1] - from[1]) * part], GAP + farthest + 5), out, name, LABEL.name);
    });
    const free = places.find(place);
    if (free) group.append(text(free, name, "name"));
    return group;
  }

  /** The scale bar at the bottom left, above the legend. @param {import("tetralod/viewer").Overlay["scaleBar"]} bar @param {Box[]} taken @param {number} bottom */
  #scaleBar({ label, width, everywhere }, taken, bottom) {
    const length = width * this.#svg.clientWidth;
    const far = `${label} ${this.#unit}`.trim();
    const words = everywhere ? far : `${far} at the target`;
    const wide = Math.max(length, words.length * LABEL.width * 0.92);
    const legend = taken.find((box) => box.left < 60 && box.bottom > bottom - 60);
    const left = 26;
    const base = legend ? legend.top - 14 : bottom - 24;
    const bar = shape("path", { d: `M${left} ${base - 6}v6h${length}v-6`, class: "bar" });
    const group = shape("g", { class: "scale-bar" });
    const box = { left: left - 8, top: base - 27, right: left + wide + 8, bottom: base + 8 };
    const size = { width: box.right - box.left, height: box.bottom - box.top };
    group.append(shape("rect", { x: box.left, y: box.top, rx: 6, ...size }));
    group.append(bar, shape("text", { x: left, y: base - 11 }, words));
    taken.push(box);
    return group;
  }

  /** @param {number[][]} rotation @param {number} width @param {boolean} isShown */
  #turnCube([rightward, upward, towards], width, isShown) {
    const dot = (/** @type {number[]} */ a, /** @type {number[]} */ b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const centre = [width - CUBE.right, CUBE.top];
    const place = (/** @type {number[]} */ p) => [centre[0] + CUBE.size * dot(rightward, p), centre[1] - CUBE.size * dot(upward, p)];
    for (const { axis, sign, group } of this.#faces) {
      const facing = sign * towards[axis];
      group.toggleAttribute("hidden", !isShown || facing < 0.02);
      const at = (/** @type {number} */ first, /** @type {number} */ second) => {
        const p = [0, 0, 0];
        [p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]] = [sign, first, second];
        return place(p);
      };
      const corners = [at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)];
      const [polygon, label] = group.children;
      polygon.setAttribute("points", corners.map((corner) => corner.join()).join(" "));
      const [x, y] = at(0, 0);
      label.setAttribute("x", String(x));
      label.setAttribute("y", String(y + 4));
      label.toggleAttribute("hidden", facing < 0.35);
    }
  }
}

/** @param {Pixels} from @param {Pixels} to */
function line(from, to) {
  return shape("line", { x1: from[0], y1: from[1], x2: to[0], y2: to[1] });
}

/** The box of a label whose nearest point to the axis is `at`, in the direction `out` from it. @param {Pixels} at @param {Pixels} out @param {string} words @returns {Box} */
function labelBox(at, out, words, wide = LABEL.width) {
  const [[x, y], [outX, outY]] = [at, out];
  const [width, height] = [words.length * wide, LABEL.height];
  const left = x + ((outX - 1) * width) / 2;
  const top = y + ((outY - 1) * height) / 2;
  return { left, top, right: left + width, bottom: top + height };
}

/** @param {Box} box @param {string} words */
function text({ left, right, bottom }, words, kind = "label") {
  return shape("text", { x: (left + right) / 2, y: bottom - 3.5, class: kind }, words);
}

/** @param {Box} a @param {Box} b */
function overlap(a, b) {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}
