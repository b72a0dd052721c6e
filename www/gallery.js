/**
 * The volumes of the page: a list of data sets and a gallery, from a file that whoever makes the volumes writes beside them. The
 * page looks for a new one when it gets the focus, and while a volume is being made.
 */

import { phaseWords } from "./build.js";
import { $, dialog, element, input, select } from "./dom.js";
import { count, size, vtuBytes } from "./format.js";
import { stateNow } from "./history.js";
import { note, say } from "./messages.js";
import { open } from "./opening.js";
import { demo } from "./page.js";
import { source, wordsOf } from "./source.js";
import { read, store } from "./state.js";
import { pictureOf, taken, takePicture } from "./thumbnails.js";

const LIST = "data/volumes.json";
/** How often it is looked whether a volume in the making is ready, if the list does not say (in ms). */
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
 * @property {string} [version] another one when the file is another one
 */

/**
 * A volume that is being made, and how far it is: `done` of `total` of a stage.
 *
 * @typedef {{ title: string, isShown: boolean, stage?: string, done?: number, total?: number }} Pending
 */

/** @type {Listed[]} */
let volumes = [];
/** @type {Pending[]} */
let pending = [];
/** What could not be made. @type {{ title: string, message: string }[]} */
let failed = [];
/** Hears of the first volume, where there was none before. @type {(first: Listed) => unknown} */
let arrived = () => {};
/** @type {ReturnType<typeof setTimeout> | undefined} */
let timer;

/** Reads the list; resolves to the volume that is shown where no address says another one. @returns {Promise<Listed | undefined>} */
export async function readVolumes() {
  // The first time the page has asked for it ahead.
  const list = await fetch(LIST, isBeginning ? {} : { cache: "no-cache" })
    .then((response) => (response.ok ? response.json() : undefined))
    .catch(() => undefined);
  clearTimeout(timer);
  if (!list) {
    // Who serves it may come back.
    if (timer !== undefined) timer = setTimeout(readVolumes, LOOK);
    return volumes[0];
  }
  const [before, failedBefore] = [volumes, failed];
  [volumes, pending, failed] = [list.volumes, list.pending ?? [], list.failed ?? []];
  if (pending.length > 0 || list.look) timer = setTimeout(readVolumes, list.look ?? LOOK);
  showMaking();
  const isSame = JSON.stringify([before, failedBefore]) === JSON.stringify([volumes, failed]);
  if (isSame && list.look) return volumes[0];
  if (before.length > 0) announceNew(new Set(before.map(({ url }) => url)));
  showList();
  showGallery();
  sayFailed(failedBefore);
  reload(before);
  if (before.length === 0 && !isBeginning && volumes.length > 0) arrived(volumes[0]);
  return volumes[0];
}

/** The page has not begun to open anything. */
let isBeginning = true;

/** The page opens what it was asked for; `then` hears of the first volume, if that is made later. @param {typeof arrived} then */
export function begun(then) {
  isBeginning = false;
  arrived = then;
  showMaking();
}

/** How far what is being made is, while nothing is shown. */
function showMaking() {
  if (isBeginning || source.open !== undefined) return;
  const [first] = pending;
  const bar = $("progress", HTMLProgressElement);
  if (!first) {
    $("growth").textContent = "";
    return;
  }
  const { title, stage = "", done = 0, total = 0 } = first;
  const isKnown = total > 0;
  if (isKnown) bar.value = done / total;
  else bar.removeAttribute("value");
  $("loading").classList.remove("done");
  $("growth").textContent = `Building an MT file of ${title}: ${phaseWords(stage).toLowerCase()}${isKnown ? `, ${Math.floor((100 * done) / total)} %` : ""}`;
}

/** Whether something is made that will be shown. */
export const isMaking = () => pending.length > 0;

/** Says what could not be made. @param {typeof failed} before */
function sayFailed(before) {
  const isNew = (/** @type {{ title: string, message: string }} */ { title, message }) => !before.some((one) => one.title === title && one.message === message);
  for (const { title, message } of failed.filter(isNew)) say(`No MT file could be built of ${title}`, { message });
}

/** Opens the volume that is shown again, as it is shown, if its file is another one now. @param {Listed[]} before */
function reload(before) {
  const now = listed(source.open);
  const then = before.find(({ url }) => url === now?.url);
  if (!now || !then || now.version === then.version) return;
  note(`${now.title} has changed, and is shown anew`);
  open(now.url, stateNow());
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
const openListed = ({ url, scene }) => take(url, { url, ...read(scene) });

/** Opens what was chosen: in place of the volume that is open, or beside it. @param {string} url @param {import("./state.js").Words} [words] */
function take(url, words) {
  const isBeside = source.isForBeside;
  dialog("gallery").close();
  if (isBeside) store.change({ beside: wordsOf(url) });
  else open(url, words);
}

/** @param {boolean} isForBeside whether what is chosen is shown beside the volume that is open */
function showDialog(isForBeside) {
  if (dialog("gallery").open || (isForBeside && !demo.info)) return;
  source.isForBeside = isForBeside;
  $("gallery-title").textContent = isForBeside ? "Compare with…" : "Gallery";
  readVolumes();
  dialog("gallery").showModal();
}

export const openGallery = () => showDialog(false);
export const chooseBeside = () => showDialog(true);

export function attachGallery() {
  $("volume").addEventListener("change", () => open(select("volume").value));
  $("open-gallery").addEventListener("click", openGallery);
  $("open-url").addEventListener("submit", (event) => {
    event.preventDefault();
    const url = input("url").value.trim();
    if (url) take(url);
  });
  dialog("gallery").addEventListener("close", () => (source.isForBeside = false));
  // A new volume may be there when the user comes back.
  window.addEventListener("focus", () => source.open !== undefined && readVolumes());
}
