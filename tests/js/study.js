// What a picture shows, in numbers: whether something is drawn, and whether two pictures differ.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";

/** Cells of the grid that a picture is compared by, across and down. */
const GRID = [16, 12];

/**
 * The share of a picture that is not background, the number of colours there, a sample of all pixels, and the mean colours of the
 * cells of a grid, as `rrggbb`. In each row the background is the colour of the fifth pixel, but for noise; the outline of the focus is left of that.
 *
 * @param {import("playwright-core").Page} page any page, which decodes the picture
 * @param {Buffer} png
 */
export function study(page, png) {
  return page.evaluate(
    async ([base64, columns, rows]) => {
      const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
      context.drawImage(image, 0, 0);
      const pixels = new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer);
      const channels = (pixel) => [pixel & 255, (pixel >> 8) & 255, (pixel >> 16) & 255];
      const isCovered = (pixel, i) => {
        const background = channels(pixels[i - (i % image.width) + 4]);
        return channels(pixel).some((value, c) => Math.abs(value - background[c]) > 8);
      };
      const covered = pixels.filter(isCovered);
      const sample = Array.from(pixels.filter((_, i) => i % 97 === 0));
      const sums = Array.from({ length: columns * rows }, () => [0, 0, 0, 0]);
      pixels.forEach((pixel, i) => {
        const [column, row] = [Math.floor(((i % image.width) * columns) / image.width), Math.floor((Math.floor(i / image.width) * rows) / image.height)];
        const sum = sums[column + columns * row];
        [...channels(pixel), 1].forEach((value, c) => (sum[c] += value));
      });
      const grid = sums
        .map(([r, g, b, count]) =>
          [r, g, b]
            .map((sum) =>
              Math.round(sum / count)
                .toString(16)
                .padStart(2, "0"),
            )
            .join(""),
        )
        .join(" ");
      return { colours: new Set(covered).size, covered: covered.length / pixels.length, pixels: sample, width: image.width, grid };
    },
    /** @type {const} */ ([png.toString("base64"), ...GRID]),
  );
}

/** Something larger than a few lines is drawn, and it is lit or coloured. */
export function assertDrawn({ colours, covered }, what = "the picture") {
  assert.ok(covered > 0.03, `${what}: only ${(100 * covered).toFixed(1)} % is covered`);
  assert.ok(colours > 50, `${what}: only ${colours} colours`);
}

const REFERENCES = new URL("pictures.json", import.meta.url);

/** How far a cell may be from its reference on average, and how many cells may be farther than that three times over: of 255, and of 1. */
const [NEAR, ODD] = [6, 0.03];

/**
 * The picture looks like its reference, whose grid `pictures.json` has under this name; other versions of the browser's software draw edges a
 * little differently. `TETRALOD_UPDATE_PICTURES=1` makes this picture the reference: look at it before.
 */
export function assertLike({ grid }, name) {
  const references = JSON.parse(readFileSync(REFERENCES, "utf8"));
  if (process.env.TETRALOD_UPDATE_PICTURES) {
    const all = Object.entries({ ...references, [name]: grid }).sort(([a], [b]) => (a < b ? -1 : 1));
    return writeFileSync(REFERENCES, `${JSON.stringify(Object.fromEntries(all), undefined, 1)}\n`);
  }
  assert.ok(references[name], `${name} has no reference: look at the picture, then set TETRALOD_UPDATE_PICTURES=1`);
  const apart = cellsApart(grid, references[name]);
  const mean = apart.reduce((sum, one) => sum + one, 0) / apart.length;
  const odd = apart.filter((one) => one > 3 * NEAR).length / apart.length;
  assert.ok(mean < NEAR && odd <= ODD, `${name} is not like its reference: ${mean.toFixed(1)} of 255 apart, ${(100 * odd).toFixed(1)} % of the cells far`);
}

/** How far the cells of two grids are apart, by their farthest channel; of those only in which one of them is not background, which the first cell of a row is. */
function cellsApart(a, b) {
  const cells = (grid) => grid.split(" ").map((cell) => [0, 2, 4].map((i) => Number.parseInt(cell.slice(i, i + 2), 16)));
  const [mine, theirs] = [cells(a), cells(b)];
  const far = (one, other) => Math.max(...one.map((value, c) => Math.abs(value - other[c])));
  const isShown = (all, i) => far(all[i], all[i - (i % GRID[0])]) > 2;
  const shown = mine.map((_, i) => i).filter((i) => i % GRID[0] === 0 || isShown(mine, i) || isShown(theirs, i));
  return shown.map((i) => far(mine[i], theirs[i]));
}

/** The share of the pixels in which two pictures differ. */
export const differing = (a, b) => a.pixels.filter((pixel, i) => pixel !== b.pixels[i]).length / a.pixels.length;

/** How far two pictures are apart: the mean over the channels of the sampled pixels, of 255. */
export function distance(a, b) {
  const channels = (pixel) => [pixel & 255, (pixel >> 8) & 255, (pixel >> 16) & 255];
  const apart = a.pixels.flatMap((pixel, i) => channels(pixel).map((value, c) => Math.abs(value - channels(b.pixels[i])[c])));
  return apart.reduce((sum, one) => sum + one, 0) / apart.length;
}
