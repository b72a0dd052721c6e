/** Streamlines and arrows of a vector field: which fields are its components, and where streamlines start. */

/** @typedef {import("tetralod").FieldInfo} FieldInfo */
/** @typedef {[number, number, number]} Point */

/**
 * The vectors of three components among some fields: the names of their components, by the name of the vector.
 *
 * @param {FieldInfo[]} fields
 * @returns {Map<string, [string, string, string]>}
 */
export function vectorsOf(fields) {
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
export function rake(bounds, { axis, at, count }) {
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
