// What a picture shows, in numbers: whether something is drawn, and whether two pictures differ.
import assert from "node:assert/strict";

/**
 * The share of a picture that is not background, the number of colours there, and a sample of all pixels. In each row the
 * background is the colour of the fifth pixel, but for noise; the outline of the focus is left of that.
 *
 * @param {import("playwright-core").Page} page any page, which decodes the picture
 * @param {Buffer} png
 */
export function study(page, png) {
  return page.evaluate(async (base64) => {
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
    return { colours: new Set(covered).size, covered: covered.length / pixels.length, pixels: sample, width: image.width };
  }, png.toString("base64"));
}

/** Something larger than a few lines is drawn, and it is lit or coloured. */
export function assertDrawn({ colours, covered }, what = "the picture") {
  assert.ok(covered > 0.03, `${what}: only ${(100 * covered).toFixed(1)} % is covered`);
  assert.ok(colours > 50, `${what}: only ${colours} colours`);
}

/** The share of the pixels in which two pictures differ. */
export const differing = (a, b) => a.pixels.filter((pixel, i) => pixel !== b.pixels[i]).length / a.pixels.length;

/** How far two pictures are apart: the mean over the channels of the sampled pixels, of 255. */
export function distance(a, b) {
  const channels = (pixel) => [pixel & 255, (pixel >> 8) & 255, (pixel >> 16) & 255];
  const apart = a.pixels.flatMap((pixel, i) => channels(pixel).map((value, c) => Math.abs(value - channels(b.pixels[i])[c])));
  return apart.reduce((sum, one) => sum + one, 0) / apart.length;
}
