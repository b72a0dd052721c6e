/**
 * The volumes of the page: a list of data sets and a gallery, from a file that whoever makes the volumes writes beside them. The
 * page looks for a new one when it gets the focus, and while a volume is being made.
 */

import { $, dialog, element, input, select } from "./dom.js";
import { count, size, vtuBytes } from "./format.js";
import { note } from "./messages.js";
import { open } from "./opening.js";
import { source } from "./source.js";
import { read } from "./state.js";
import { pictureOf, taken, takePicture } from "./thumbnails.js";

const LIST = "data/volumes.json";
/** How often it is looked whether a volume in the making is ready (in ms). */
const LOOK = 15_000;

/**
 * @typedef {object} Listed
 * @property {string} url
 * @property {string} title
 * @property {string} sentence
 * @property {string} scene how it is shown first: words, as in the address of the page
 * @property {string} [picture]
 * @property {boolean} isShown whether it is in the gallery
 * @property {number} vertices
 * @property {number} tetrahedra
 * @property {number} fields
 * @property {number} bytes
 */

/** @type {Listed[]} */
let volumes = [];
/** @type {{ title: string, isShown: boolean }[]} */
let pending = [];
/** @type {ReturnType<typeof setTimeout> | undefined} */
let timer;

/** Reads the list; resolves to the volume that is shown where no address says another one. @returns {Promise<Listed | undefined>} */
export async function readVolumes() {
  // The first time the page has asked for it ahead.
  const isFirst = volumes.length === 0;
  const list = await fetch(LIST, isFirst ? {} : { cache: "no-cache" })
    .then((response) => (response.ok ? response.json() : undefined))
    .catch(() => undefined);
  if (!list) return volumes[0];
  const before = new Set(volumes.map(({ url }) => url));
  [volumes, pending] = [list.volumes, list.pending ?? []];
  if (before.size > 0) announceNew(before);
  showList();
  showGallery();
  clearTimeout(timer);
  if (pending.length > 0) timer = setTimeout(readVolumes, LOOK);
  return volumes[0];
}

/** The picture of a volume before it has arrived. @param {string} url */
export function showPoster(url) {
  const volume = listed(url);
  const picture = volume && (volume.picture ?? taken(volume));
  const poster = $("poster", HTMLImageElement);
  poster.hidden = !picture;
  if (picture) poster.src = picture;
}

const listed = (/** @type {unknown} */ url) => volumes.find((volume) => volume.url === url);

/** The words of the scene with which a volume is shown first. @param {string} [url] */
export const sceneOf = (url) => read(listed(url)?.scene ?? "");

/** A volume has been shown: whoever made it may have had no GPU to draw a picture of it. @param {unknown} url */
export async function shown(url) {
  const isNew = await takePicture(listed(url)).catch(() => false);
  // The list that is open is made again when it is opened the next time.
  if (isNew && !dialog("gallery").open) showGallery();
}

/** Says that the volume which is shown first is there now. @param {Set<string>} before */
function announceNew(before) {
  const [first] = volumes;
  if (before.has(first.url)) return;
  note(`${first.title} is ready`, { label: "Open", act: () => openListed(first) });
}

/** The list of data sets. What is open and not in it stays. */
function showList() {
  const list = select("volume");
  const other = /** @type {HTMLOptionElement | null} */ (list.querySelector("[data-other]"));
  const chosen = other ? other.dataset.other : list.value;
  const isListed = volumes.some(({ url }) => url === chosen);
  list.replaceChildren(...volumes.map(({ url, title }) => new Option(title, url)), ...(other && !isListed ? [other] : []));
  if (isListed) list.value = chosen ?? "";
}

function showGallery() {
  const shown = volumes.filter(({ isShown }) => isShown);
  $("gallery-list").replaceChildren(...shown.map(card));
  const titles = pending.filter(({ isShown }) => isShown).map(({ title }) => title);
  $("gallery-pending").hidden = titles.length === 0;
  $("gallery-pending").textContent = `Being made, and here when ready: ${titles.join(", ")}.`;
}

/** @param {Listed} volume */
function card(volume) {
  const { title, sentence, tetrahedra, bytes } = volume;
  // Numbers stay with their units.
  const amount = (/** @type {number} */ bytes) => size(bytes).replace(" ", "\u00a0");
  const sizes = `${count(tetrahedra)} tetrahedra, ${amount(vtuBytes(volume))} as VTU, ${amount(bytes)} as MT`;
  const image = element("img", { src: pictureOf(volume), alt: "", width: 480, height: 300, loading: "lazy" });
  const words = [element("b", {}, title), element("span", {}, sentence), element("small", {}, sizes)];
  const button = element("button", { type: "button" }, image, ...words);
  button.addEventListener("click", () => openListed(volume));
  return element("li", {}, button);
}

/** @param {Listed} volume */
function openListed({ url, scene }) {
  dialog("gallery").close();
  open(url, { url, ...read(scene) });
}

export function openGallery() {
  readVolumes();
  dialog("gallery").showModal();
}

export function attachGallery() {
  $("volume").addEventListener("change", () => open(select("volume").value));
  $("open-gallery").addEventListener("click", openGallery);
  $("open-url").addEventListener("submit", (event) => {
    event.preventDefault();
    const url = input("url").value.trim();
    if (!url) return;
    dialog("gallery").close();
    open(url);
  });
  // A new volume may be there when the user comes back.
  window.addEventListener("focus", () => source.open !== undefined && readVolumes());
}
