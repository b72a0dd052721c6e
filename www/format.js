/** Numbers as words. */

export function percentage(percent) {
  if (percent === 0) return "0";
  return percent < 100 ? `${Number(percent.toPrecision(2))} %` : `${count(Math.round(percent))} %`;
}

export function pixels(n) {
  // There is no bound if the camera is inside a tetrahedron with an error.
  if (n > 9999) return "no bound";
  return `${Number(n.toPrecision(2))} ${n === 1 ? "pixel" : "pixels"}`;
}

/** A whole number. By hand: the first number that `toLocaleString` formats takes some 90 ms. */
export function count(n) {
  return String(n).replace(/\B(?=(\d{3})+$)/g, ",");
}

export function size(bytes) {
  if (bytes < 1e3) return `${bytes} B`;
  if (bytes < 999_500) return `${(bytes / 1e3).toFixed(0)} kB`;
  const megabytes = bytes / 1e6;
  return megabytes < 999.5 ? `${megabytes < 99.5 ? megabytes.toPrecision(3) : megabytes.toFixed(0)} MB` : `${(megabytes / 1e3).toPrecision(3)} GB`;
}

/** The bytes of a mesh as a VTU file, not compressed: coordinates, corners and ends of cells in 8 bytes, types in 1, values in 4. */
export function vtuBytes({ vertices, tetrahedra, fields }) {
  return vertices * (3 * 8 + 4 * fields) + tetrahedra * (5 * 8 + 1);
}

export function milliseconds(ms) {
  return `${ms < 10 ? ms.toFixed(1) : ms.toFixed(0)} ms`;
}

export function nameOf(from) {
  return from.name ?? String(from).split(/[?#]/)[0].split("/").pop();
}

/** A number with digits according to the range that it is from. */
export function rounded(value, range) {
  const magnitude = Math.abs(value);
  if (magnitude < Math.abs(range) * 1e-6 || value === 0) return "0";
  const words = magnitude >= 1e5 || magnitude < 1e-3 ? value.toExponential(2) : String(Number(value.toPrecision(4)));
  return words.replaceAll("-", "−");
}
