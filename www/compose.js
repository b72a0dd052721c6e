/** A screenshot with what lies over the picture: axes, scale bar, colour bar. */

import { $, all, svg } from "./dom.js";

/** What of the style of an SVG shape is copied, since the style sheet of the page is not in the picture. */
const STYLES = [
  "fill",
  "stroke",
  "stroke-width",
  "stroke-linejoin",
  "stroke-dasharray",
  "paint-order",
  "text-anchor",
  "font-size",
  "font-weight",
  "font-family",
];
/** Of the colour bar, in pixels of the page. */
const BAR = 12;

/**
 * The picture with its overlay, as a PNG.
 *
 * @param {Blob} picture
 * @param {{ width: number, height: number, canvas: HTMLCanvasElement }} size
 */
export async function compose(picture, { width, height, canvas }) {
  const made = new OffscreenCanvas(width, height);
  const context = made.getContext("2d");
  if (!context) return picture;
  context.drawImage(await createImageBitmap(picture), 0, 0);
  const isBeside = canvas.id !== "canvas";
  context.drawImage(await overlay(svg(isBeside ? "overlay-beside" : "overlay"), width, height), 0, 0, width, height);
  const scale = width / canvas.clientWidth;
  context.scale(scale, scale);
  // Both have the colours in common.
  if (!isBeside) legend(context, canvas.getBoundingClientRect());
  return made.convertToBlob({ type: "image/png" });
}

/** An overlay of the page as an image of this size. @param {SVGSVGElement} shown @param {number} width @param {number} height */
async function overlay(shown, width, height) {
  const copy = /** @type {SVGSVGElement} */ (shown.cloneNode(true));
  const [from, to] = [shown, copy].map((svg) => [...svg.querySelectorAll("*")]);
  for (const [i, element] of from.entries()) {
    const style = getComputedStyle(element);
    if (style.display === "none" || element.matches(".face, .face *, .aid, .aid *")) to[i].setAttribute("display", "none");
    for (const name of STYLES) /** @type {SVGElement} */ (to[i]).style.setProperty(name, style.getPropertyValue(name));
  }
  copy.setAttribute("viewBox", `0 0 ${shown.clientWidth} ${shown.clientHeight}`);
  copy.setAttribute("width", String(width));
  copy.setAttribute("height", String(height));
  copy.removeAttribute("hidden");
  const image = new Image();
  image.src = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  await image.decode();
  return image;
}

/** Two pictures beside each other, as a PNG. @param {Blob} left @param {Blob} right */
export async function joined(left, right) {
  const [one, other] = await Promise.all([left, right].map((picture) => createImageBitmap(picture)));
  const made = new OffscreenCanvas(one.width + other.width, Math.max(one.height, other.height));
  const context = made.getContext("2d");
  context?.drawImage(one, 0, 0);
  context?.drawImage(other, one.width, 0);
  return made.convertToBlob({ type: "image/png" });
}

/** Draws the colour bar where the page has it. @param {OffscreenCanvasRenderingContext2D} context @param {DOMRect} stage */
function legend(context, stage) {
  const box = $("legend");
  if (box.hidden) return;
  const place = (/** @type {HTMLElement} */ element) => {
    const { left, top, width, height } = element.getBoundingClientRect();
    return { x: left - stage.left, y: top - stage.top, width, height };
  };
  const style = getComputedStyle(box);
  const whole = place(box);
  context.fillStyle = style.backgroundColor;
  context.beginPath();
  context.roundRect(whole.x, whole.y, whole.width, whole.height, 9);
  context.fill();
  const bar = place($("legend-bar"));
  const colours = ($("legend-bar").dataset.colours ?? "").split(" ");
  const gradient = context.createLinearGradient(bar.x, 0, bar.x + bar.width, 0);
  colours.forEach((colour, i) => gradient.addColorStop(i / (colours.length - 1), colour));
  context.fillStyle = gradient;
  context.fillRect(bar.x, bar.y, bar.width, BAR);
  context.fillStyle = style.color;
  context.textBaseline = "middle";
  /** @param {HTMLElement} element @param {number} weight */
  const words = (element, weight) => {
    const { x, y, height } = place(element);
    context.font = `${weight} ${style.fontSize} ${style.fontFamily}`;
    context.fillText(element.textContent ?? "", x, y + height / 2);
  };
  words($("legend-name"), 600);
  for (const part of all("#legend-marks span, #legend-ticks :not([hidden]), #legend-note:not([hidden]) span")) words(part, 400);
}
