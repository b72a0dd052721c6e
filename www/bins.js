/** Histograms as areas: their heights are square roots, or logarithms where one bin is much larger than the others. */

/** The drawing, in its own units; it has room around it for whole points. */
export const SIZE = { width: 300, height: 120, margin: 9 };

/** A bin that is so many times as large as that in the middle would leave little of most others, even of their square roots. */
const DOMINANT = 40;
/** Logarithms begin at this part of the largest bin; what is less has this height. */
const LEAST = 1e-4;
const LOWEST = 0.02;

/** Where a fraction of the range and a height are in the drawing. @param {[at: number, height: number]} point */
export function place([at, height]) {
  const x = SIZE.margin + at * (SIZE.width - 2 * SIZE.margin);
  const y = SIZE.margin + (1 - height) * (SIZE.height - 2 * SIZE.margin);
  return [Number(x.toFixed(2)), Number(y.toFixed(2))];
}

/**
 * A histogram over one range as one over a larger range, with as many bins: volumes are even within a bin.
 *
 * @param {ArrayLike<number>} volumes
 * @param {[low: number, high: number]} from
 * @param {[low: number, high: number]} to
 */
export function rebinned(volumes, [low, high], [least, most]) {
  const count = volumes.length;
  const made = new Float64Array(count);
  const bin = (/** @type {number} */ value) => (most > least ? ((value - least) / (most - least)) * count : 0);
  Array.from(volumes).forEach((volume, i) => {
    const [start, end] = [i, i + 1].map((edge) => bin(low + (edge / count) * (high - low)));
    const first = Math.min(Math.floor(start), count - 1);
    const last = Math.min(Math.max(Math.ceil(end) - 1, first), count - 1);
    for (let j = first; j <= last; j++) {
      const part = end > start ? (Math.min(end, j + 1) - Math.max(start, j)) / (end - start) : 1;
      made[j] += volume * (first === last ? 1 : Math.max(part, 0));
    }
  });
  return made;
}

/**
 * The values below which some fractions of the sum of a histogram lie.
 *
 * @param {ArrayLike<number>} volumes
 * @param {[low: number, high: number]} range
 * @param {number[]} fractions
 */
export function percentilesOf(volumes, [low, high], fractions) {
  const all = Array.from(volumes);
  const total = all.reduce((sum, volume) => sum + volume, 0);
  let sum = 0;
  const before = all.map((volume) => (sum += volume) - volume);
  return fractions.map((fraction) => {
    const wanted = fraction * total;
    const i = all.findIndex((volume, at) => before[at] + volume >= wanted);
    const place = i < 0 ? all.length : i + (all[i] > 0 ? (wanted - before[i]) / all[i] : 0);
    return low + (place / all.length) * (high - low);
  });
}

/** Whether heights are logarithms. @param {ArrayLike<number>} volumes */
export function isLogarithmic(volumes) {
  const all = Array.from(volumes).filter((volume) => volume > 0);
  all.sort((a, b) => a - b);
  return all.length > 2 && all[all.length - 1] > DOMINANT * all[all.length >> 1];
}

/** @param {ArrayLike<number>} volumes in each of equal bins of a range */
export function histogramPath(volumes) {
  const all = Array.from(volumes, (volume) => Math.max(volume, 0));
  const most = Math.max(0, ...all);
  if (!(most > 0)) return "";
  const isLog = isLogarithmic(all);
  const height = (/** @type {number} */ part) => (isLog ? Math.max(1 - Math.log(part) / Math.log(LEAST), LOWEST) : Math.sqrt(part));
  const steps = all.map((volume, i) => {
    const high = volume > 0 ? height(volume / most) : 0;
    return [place([i / all.length, high]), place([(i + 1) / all.length, high])].map((p) => p.join(" ")).join("L");
  });
  return `M${place([0, 0]).join(" ")}L${steps.join("L")}L${place([1, 0]).join(" ")}Z`;
}
