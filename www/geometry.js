/** Vectors of the model, and where a plane meets a box. */

/** @typedef {import("./volume.js").Point} Point */
/** @typedef {ArrayLike<number>} Numbers */

/** @param {(i: 0 | 1 | 2) => number} of @returns {Point} */
export const each = (of) => [of(0), of(1), of(2)];
/** @param {Numbers} a @param {Numbers} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** `a + times * b`. @param {Numbers} a @param {Numbers} b @param {number} times */
export const plus = (a, b, times) => each((i) => a[i] + times * b[i]);
/** @param {Numbers} a @param {Numbers} b */
export const cross = (a, b) => each((i) => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
/** @param {Numbers} a */
const lengthOf = (a) => Math.hypot(a[0], a[1], a[2]);
/** Of length 1. @param {Numbers} a */
export const unit = (a) => each((i) => a[i] / lengthOf(a));

/** A vector turned around an axis of length 1, by an angle in radians. @param {Numbers} a @param {Numbers} axis @param {number} angle */
export function turned(a, axis, angle) {
  const along = dot(a, axis) * (1 - Math.cos(angle));
  const across = cross(axis, a);
  return each((i) => a[i] * Math.cos(angle) + across[i] * Math.sin(angle) + axis[i] * along);
}

/** Two directions across a normal of length 1, and each other: for an axis, the next two axes. @param {Point} normal @returns {[Point, Point]} */
export function across(normal) {
  const sizes = normal.map(Math.abs);
  const next = (sizes.indexOf(Math.max(...sizes)) + 1) % 3;
  const first = unit(
    plus(
      each((i) => Number(i === next)),
      normal,
      -normal[next],
    ),
  );
  return [first, cross(normal, first)];
}

/** The corners, in order, of the part of a plane that is in a box. @param {Point} normal of length 1 @param {number} at @param {Numbers} bounds */
export function outline(normal, at, bounds) {
  const found = [0, 1, 2].flatMap((axis) =>
    [0, 1, 2, 3].flatMap((which) => {
      const end = (/** @type {number} */ side) => {
        const ends = [which & 1, which >> 1, side];
        return each((i) => bounds[i + 3 * ends[(i + 2 - axis) % 3]]);
      };
      const [from, to] = [end(0), end(1)];
      const [before, behind] = [dot(normal, from) - at, dot(normal, to) - at];
      return before * behind <= 0 && before !== behind ? [plus(from, plus(to, from, -1), before / (before - behind))] : [];
    }),
  );
  const [first, second] = across(normal);
  const middle = mean(found);
  const angle = (/** @type {Point} */ p) => Math.atan2(dot(plus(p, middle, -1), second), dot(plus(p, middle, -1), first));
  return found.sort((a, b) => angle(a) - angle(b));
}

/**
 * Whether no point of a box lies behind all of some planes, where `normal · p <= offset`: else one would be where three of these planes or of
 * the box's sides meet.
 *
 * @param {{ normal: Point, offset: number }[]} planes @param {Numbers} bounds
 */
export function leavesNothing(planes, bounds) {
  const sides = [0, 1, 2].flatMap((axis) =>
    [-1, 1].map((sign) => ({ normal: each((i) => (i === axis ? sign : 0)), offset: sign * bounds[axis + (sign > 0 ? 3 : 0)] })),
  );
  const all = [...sides, ...planes];
  const tolerance = 1e-9 * lengthOf(each((i) => bounds[i + 3] - bounds[i]));
  const isLeft = (/** @type {Point} */ p) => all.every(({ normal, offset }) => dot(normal, p) <= offset + tolerance);
  return !all.some((a, i) =>
    all.slice(i + 1).some((b, j) =>
      all.slice(i + j + 2).some((c) => {
        const [bc, ca, ab] = [cross(b.normal, c.normal), cross(c.normal, a.normal), cross(a.normal, b.normal)];
        const volume = dot(a.normal, bc);
        return Math.abs(volume) > 1e-9 && isLeft(each((k) => (a.offset * bc[k] + b.offset * ca[k] + c.offset * ab[k]) / volume));
      }),
    ),
  );
}

/** @param {Point[]} points */
const mean = (points) => each((i) => points.reduce((sum, p) => sum + p[i], 0) / points.length);

/** The centre of a flat polygon: that of its area, which moves as smoothly as its corners do. @param {Point[]} corners */
export function centreOf(corners) {
  const [first] = corners;
  let [area, sum] = [0, each(() => 0)];
  for (let i = 2; i < corners.length; i++) {
    const [one, other] = [corners[i - 1], corners[i]];
    const part = lengthOf(cross(plus(one, first, -1), plus(other, first, -1)));
    area += part;
    sum = plus(sum, mean([first, one, other]), part);
  }
  return area > 0 ? each((i) => sum[i] / area) : mean(corners);
}
