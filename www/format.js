/** Numbers as words. */

/** @param {number} percent */
export function percentage(percent) {
  if (percent === 0) return "0";
  return percent < 100 ? `${Number(percent.toPrecision(2))} %` : `${count(Math.round(percent))} %`;
}

/** @param {number} n */
export function pixels(n) {
  // There is no bound if the camera is inside a tetrahedron with an error.
  if (n > 9999) return "no bound";
  return `${Number(n.toPrecision(2))} ${n === 1 ? "pixel" : "pixels"}`;
}

/** A whole number. By hand: the first number that `toLocaleString` formats takes some 90 ms. @param {number} n */
export function count(n) {
  return String(n).replace(/\B(?=(\d{3})+$)/g, ",");
}

/** @param {number} bytes */
export function size(bytes) {
  if (bytes < 1e3) return `${bytes} B`;
  if (bytes < 999_500) return `${(bytes / 1e3).toFixed(0)} kB`;
  const megabytes = bytes / 1e6;
  return megabytes < 999.5 ? `${megabytes < 99.5 ? megabytes.toPrecision(3) : megabytes.toFixed(0)} MB` : `${(megabytes / 1e3).toPrecision(3)} GB`;
}

/** The bytes of a mesh as a VTU file, not compressed: coordinates, corners and ends of cells in 8 bytes, types in 1, values in 4. @param {{ vertices: number, tetrahedra: number, fields: number }} mesh */
export function vtuBytes({ vertices, tetrahedra, fields }) {
  return vertices * (3 * 8 + 4 * fields) + tetrahedra * (5 * 8 + 1);
}

/** @param {number} ms */
export function milliseconds(ms) {
  return `${ms < 10 ? ms.toFixed(1) : ms.toFixed(0)} ms`;
}

/** The name of a file, or the last part of an address. @param {string | { name: string }} from */
export const nameOf = (from) => (typeof from === "string" ? (from.split(/[?#]/)[0].split("/").pop() ?? "") : from.name);

/** Digits that numbers have at most. */
const MOST_DIGITS = 17;

/** How many digits of a number tell it from others of a range as so many do of a number of that size. @param {number} value @param {number} range @param {number} digits */
function digitsIn(value, range, digits) {
  const farther = Math.abs(value) / Math.abs(range);
  return Math.min(digits + (farther > 1 && farther < Infinity ? Math.ceil(Math.log10(farther)) : 0), MOST_DIGITS);
}

/** A number in at most six digits, those in front of the point in groups. @param {number} value */
export function grouped(value) {
  const short = Number(value.toPrecision(6));
  const magnitude = Math.abs(short);
  if (short !== 0 && (magnitude < 1e-4 || magnitude >= 1e9)) return short.toExponential().replaceAll("-", "−");
  const [whole, part] = String(magnitude).split(".");
  return `${short < 0 ? "−" : ""}${count(Number(whole))}${part ? `.${part}` : ""}`;
}

/** An angle, given in degrees. @param {number} angle */
export const degrees = (angle) => `${Number(angle.toFixed(2))}°`;

/** The length of the diagonal of a box `[x0, y0, z0, x1, y1, z1]`. @param {ArrayLike<number>} bounds */
export const diagonalOf = (bounds) => Math.hypot(...[0, 1, 2].map((i) => bounds[i + 3] - bounds[i]));

/** A number rounded to so many digits, and more if it is far from 0 for the range that it is from. @param {number} value @param {number} range @param {number} digits */
export const precise = (value, range, digits) => Number(value.toPrecision(digitsIn(value, range, digits)));

/** A number with digits according to the range that it is from. @param {number} value @param {number} range */
export function rounded(value, range) {
  const magnitude = Math.abs(value);
  if (magnitude < Math.abs(range) * 1e-6 || value === 0) return "0";
  const digits = digitsIn(value, range, 4);
  const isLong = (magnitude >= 1e5 && digits < 6) || magnitude < 1e-3;
  const words = isLong ? value.toExponential(Math.max(digits - 2, 2)) : String(Number(value.toPrecision(digits)));
  return words.replaceAll("-", "−");
}
