/** The settings of the flow: streamlines and arrows of a vector field, and where streamlines start. */

/** @type {(id: string) => any} Each caller knows the type of its element. */
const $ = (id) => document.getElementById(id);

/** Seeds have so many digits: as many as links keep. */
const DIGITS = 12;

/** @typedef {import("tetralod").FieldInfo} FieldInfo */
/** @typedef {[number, number, number]} Point */

export class FlowSettings {
  #overlay;
  #onChange;
  /** The fields of the file, and its vectors. @type {FieldInfo[]} */
  #fields = [];
  /** @type {Map<string, [string, string, string]>} */
  #vectors = new Map();
  /** Seeds that were placed by clicks. @type {Point[]} */
  #seeds = [];

  /** @param {{ overlay: import("./overlay.js").OverlayView, onChange: () => void }} page */
  constructor({ overlay, onChange }) {
    this.#overlay = overlay;
    this.#onChange = onChange;
    for (const id of ["vector", "flow-colour", "rake", "arrows", "flow-boundary"]) $(id).addEventListener("input", onChange);
    $("no-seeds").addEventListener("click", () => {
      this.#seeds = [];
      onChange();
    });
  }

  /** Another file is shown. @param {FieldInfo[]} fields */
  set fields(fields) {
    this.#fields = fields;
    this.#vectors = vectorsOf(fields);
    this.#seeds = [];
    $("vector").replaceChildren(...[...this.#vectors.keys()].map((name) => new Option(name, name)));
    const hasNone = this.#vectors.size === 0;
    $("flow").disabled = hasNone;
    $("flow-label").title = hasNone ? "This dataset has no vectors" : "";
    if (hasNone && $("flow").checked) $("surface").checked = true;
    $("also-flow").disabled = hasNone;
    if (hasNone) $("also-flow").checked = false;
  }

  /** The seeds that were placed by clicks, as numbers. */
  get words() {
    return String(this.#seeds.flat());
  }

  set words(words) {
    const values = words ? words.split(",").map(Number) : [];
    const all = values.every(Number.isFinite) ? values : [];
    this.#seeds = all.flatMap((x, i) => (i % 3 === 0 && i + 2 < all.length ? [/** @type {Point} */ ([x, all[i + 1], all[i + 2]])] : []));
  }

  /** Whether the colours are those of the field that is shown. */
  get isByField() {
    return $("flow-colour").value === "field";
  }

  /** The unit of the vector. */
  get unit() {
    const [component] = this.#vectors.get($("vector").value) ?? [];
    return this.#fields.find(({ name }) => name === component)?.unit ?? "";
  }

  /** A click at a point of the canvas: one more seed on the plane; whether there is one. */
  click(point, { axis, at }) {
    const found = this.#overlay.onPlane(point, axis, at);
    if (!found) return false;
    this.#seeds = [...this.#seeds, /** @type {Point} */ (found.map((x) => Number(x.toPrecision(DIGITS))))];
    this.#onChange();
    return true;
  }

  /** The plane of the seeds, with those that were clicked, for the overlay. */
  quad({ bounds, plane: { axis, at } }) {
    return { axis, at, bounds, seeds: this.#seeds };
  }

  /**
   * What is drawn.
   *
   * @param {{ bounds: number[], plane: { axis: number, at: number }, field: FieldInfo }} shown
   */
  state({ bounds, plane: { axis, at }, field }) {
    const fields = this.#vectors.get($("vector").value);
    const count = Number($("rake").value);
    const words = count === 0 ? "none" : `${count} × ${count}`;
    $("rake-text").textContent = words;
    $("rake").setAttribute("aria-valuetext", words);
    $("no-seeds").hidden = this.#seeds.length === 0;
    const by = this.isByField ? { field: field.name } : {};
    const part = (at - bounds[axis]) / (bounds[axis + 3] - bounds[axis]);
    return {
      streamlines: { fields, seeds: [...rake(bounds, { axis, at: part, count }), ...this.#seeds], ...by },
      ...($("arrows").checked ? { arrows: { fields, ...by } } : {}),
    };
  }
}

/**
 * The vectors of three components among some fields: the names of their components, by the name of the vector.
 *
 * @param {FieldInfo[]} fields
 * @returns {Map<string, [string, string, string]>}
 */
function vectorsOf(fields) {
  /** @type {Map<string, string[]>} */
  const found = new Map();
  for (const { name, vector } of fields) {
    if (typeof vector?.component !== "number" || vector.component > 2) continue;
    const components = found.get(vector.name) ?? [];
    components[vector.component] = name;
    found.set(vector.name, components);
  }
  const whole = [...found].filter(([, components]) => [0, 1, 2].every((i) => components[i]));
  return new Map(/** @type {[string, [string, string, string]][]} */ (whole));
}

/**
 * A rake: seeds in a square grid across the box, perpendicular to an axis, at a fraction of its length.
 *
 * @param {ArrayLike<number>} bounds
 * @param {{ axis: number, at: number, count: number }} how `count` seeds along each side
 * @returns {Point[]}
 */
function rake(bounds, { axis, at, count }) {
  const [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
  const between = (i, part) => bounds[i] + part * (bounds[i + 3] - bounds[i]);
  // The middles of equal parts: none lies on the boundary.
  const parts = Array.from({ length: count }, (_, i) => (i + 0.5) / count);
  return parts.flatMap((one) =>
    parts.map((other) => {
      /** @type {Point} */
      const seed = [0, 0, 0];
      [seed[axis], seed[first], seed[second]] = [between(axis, at), between(first, one), between(second, other)];
      return seed;
    }),
  );
}
