/**
 * Sizes that pages state, as `<!--kB ./viewer.wasm-->406<!---->`: of an entry of the package, compressed; with `raw kB` not compressed.
 * `sizes.mjs` compares them with the build, and writes them.
 */

const MARK = /<!--(raw )?kB (\S+?)-->(\d*)<!---->/g;
const UNMARKED = /(?<!-->)\b\d+ kB/g;

/** A stated size may be off by this part of the size, or by what rounding to a kB and a bit of change make. */
const PART = 0.03;
const ROUNDING = 700;

/** @typedef {Record<string, { brotli: number, raw: number }>} Sizes by entry, in bytes */

const sizeOf = (sizes, raw, entry) => sizes[entry]?.[raw ? "raw" : "brotli"];

/** What is wrong with the sizes that a page states. @param {string} text @param {Sizes} sizes */
export function wrongSizes(text, sizes) {
  const wrong = [...text.matchAll(MARK)].flatMap(([, raw, entry, stated]) => {
    const size = sizeOf(sizes, raw, entry);
    if (size === undefined) return [`there is no entry ${entry}`];
    const off = Math.abs(1000 * Number(stated) - size);
    return stated !== "" && off <= Math.max(PART * size, ROUNDING) ? [] : [`${entry} has ${size} bytes, not ${stated} kB`];
  });
  const loose = [...text.replaceAll(MARK, "").matchAll(UNMARKED)].map(([words]) => `"${words}" has no mark that says of what it is`);
  return [...wrong, ...loose];
}

/** The page with the sizes as they are. @param {string} text @param {Sizes} sizes */
export function withSizes(text, sizes) {
  return text.replaceAll(MARK, (mark, raw, entry) => {
    const size = sizeOf(sizes, raw, entry);
    return size === undefined ? mark : `<!--${raw ?? ""}kB ${entry}-->${Math.round(size / 1000)}<!---->`;
  });
}
