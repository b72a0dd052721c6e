/**
 * Pictures of volumes that have none, since whoever made them had no GPU: the page takes one when it has shown such a volume, and
 * keeps it in the browser. Until then there is a drawing.
 */

import { element } from "./dom.js";
import { demo, viewer } from "./page.js";

const KEY = "tetralod-picture ";
/** Twice the size that the gallery shows. */
const SIZE = { width: 480, height: 300, samples: 4 };
/** A picture is taken when the volume has been looked at for so long (in ms). */
const REST = 1500;

/** A drawing for what has no picture: the hue tells volumes apart. @param {string} words that it is for */
function drawing(words) {
  const hue = [...words].reduce((sum, letter) => (sum * 31 + letter.charCodeAt(0)) % 360, 7);
  const face = (/** @type {string} */ corners, /** @type {number} */ light) => `<path d="M${corners}Z" fill="hsl(${hue} 42% ${light}%)"/>`;
  const shapes = face("240 52 134 224 222 248", 60) + face("240 52 222 248 346 216", 42);
  const lines = `<path d="M187 138 231 150 178 236ZM231 150 293 134 284 232Z" fill="none" stroke="hsl(${hue} 30% 20%)" stroke-width="1.5"/>`;
  const ground = `<rect width="480" height="300" fill="hsl(${hue} 22% 13%)"/>`;
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 480 300">${ground}${shapes}${lines}</svg>`;
  return `data:image/svg+xml,${encodeURIComponent(svg)}`;
}

/** The picture that was taken of a volume. @param {import("./gallery.js").Listed} volume @returns {string | undefined} */
export function taken({ url, bytes }) {
  try {
    return localStorage.getItem(`${KEY}${url} ${bytes}`) ?? undefined;
  } catch {
    // The browser keeps nothing.
    return undefined;
  }
}

/** What the gallery shows of a volume. @param {import("./gallery.js").Listed} volume */
export const pictureOf = (volume) => volume.picture ?? taken(volume) ?? drawing(volume.title);

/**
 * Takes a picture of the volume that is open, if it has none. Resolves to whether it did.
 * @param {import("./gallery.js").Listed | undefined} volume
 */
export async function takePicture(volume) {
  if (!volume || volume.picture || taken(volume)) return false;
  const { info } = demo;
  await new Promise((resolve) => setTimeout(resolve, REST));
  if (info !== demo.info || demo.state !== "complete") return false;
  const image = await createImageBitmap(await viewer().screenshot({ ...SIZE, background: "dark" }));
  const canvas = element("canvas", { width: SIZE.width, height: SIZE.height });
  canvas.getContext("2d")?.drawImage(image, 0, 0);
  const text = canvas.toDataURL("image/webp", 0.8);
  try {
    localStorage.setItem(`${KEY}${volume.url} ${volume.bytes}`, text);
    return true;
  } catch {
    // There is no room: it is taken again the next time.
    return false;
  }
}
