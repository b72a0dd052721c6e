/** Opening a volume, and following its download. */

import { $ } from "./dom.js";
import { setFields } from "./fields.js";
import { nameOf } from "./format.js";
import { fail, hideMessage } from "./messages.js";
import { showGrowth } from "./numbers.js";
import { demo, page } from "./page.js";
import { arriveWith, carriedOver } from "./state.js";

/** The kinds of MT, with their updates. */
const KINDS = {
  "half-edge": "half-edge (vertex insertions)",
  edge: "edge (vertex splits)",
  vertex: "vertex (vertex insertions)",
  explicit: "explicit (any updates)",
};

/** What is open. @type {string | File} */
let source;
/** What was opened last, perhaps in vain: the button "Try again" opens it again. @type {string | File} */
let tried;
let opening = 0;
/** What the page opens by itself. */
let first = "";
/** Files of the user, by their names: undo may come back to them. @type {Map<string, File>} */
const files = new Map();
/** The file that a link is of, which contains none: until it is dropped, and how it is shown then. @type {{ name: string, words?: Record<string, string> } | undefined} */
let awaited;
const FILE = "file:";

/** What MT files were built of by the page: in words, and its bytes. @type {WeakMap<File, { format: string, bytes: number }>} */
const origins = new WeakMap();

/** Opens an MT file that the page has built of files of the user. @param {File} built @param {File[]} files */
export function openBuilt(built, files) {
  const [data] = files.filter(({ name }) => !/\.json$/i.test(name));
  const format = (data ?? files[0]).name.split(".").pop().toUpperCase();
  origins.set(built, { format, bytes: files.reduce((sum, { size }) => sum + size, 0) });
  return open(built);
}

/** What the volume was built of, if the page has built it. */
export const originOf = () => (source instanceof File ? origins.get(source) : undefined);

/** The name of the volume, for files that are made of it. */
export const volumeName = () => (source ? nameOf(source).replace(/\.mt$/i, "") : "tetralod");

/** Says what is open where no address says anything else. @param {string} url */
export function setFirst(url) {
  first = url;
}

/** Whether what was opened last comes from a server. */
export const isRemote = () => !(tried instanceof File);

/** Whether nothing has come of what was opened last. */
export const isNew = () => tried !== source || !demo.info;

/** What is open, as in the address of the page. */
export function sourceWords() {
  if (source instanceof File) return `${FILE}${source.name}`;
  return source === first ? "" : source;
}

/** The volume that words of an address mean; undefined for a file that is not here. */
function sourceOf(words) {
  if (words === "") return first;
  return words.startsWith(FILE) ? files.get(words.slice(FILE.length)) : words;
}

/**
 * Opens a volume: a URL, a file of the user, or what the words of an address mean. Shows it with the state `words`; without
 * them the settings stay, as far as they have a meaning there.
 *
 * @param {string | File} wanted
 * @param {Record<string, string>} [words]
 */
export async function open(wanted, words) {
  if (wanted instanceof File) files.set(wanted.name, wanted);
  const from = typeof wanted === "string" ? sourceOf(wanted) : wanted;
  if (!from) return wait({ name: wanted.slice(FILE.length), words });
  const before = { ...demo, source };
  const ofLink = from instanceof File && from.name === awaited?.name ? awaited.words : undefined;
  awaited = undefined;
  const shown = words ?? ofLink ?? (demo.info ? carriedOver() : {});
  source = tried = from;
  showInList(from);
  const mine = ++opening;
  Object.assign(demo, { state: "opening", error: undefined, info: undefined, stats: undefined });
  Object.assign(demo, { firstFrameBytes: undefined, firstFrameMs: undefined, receivedBytes: 0, totalBytes: undefined });
  demo.blocks = undefined;
  page.comparison.forget();
  hideMessage();
  $("legend").hidden = true;
  $("loading").classList.remove("done");
  $("progress").removeAttribute("value");
  $("growth").textContent = `Opening ${nameOf(from)}…`;
  try {
    const { info, total, finished } = await page.viewer.open(from);
    if (mine !== opening) return;
    demo.totalBytes = total;
    if (demo.state === "opening") demo.state = "streaming";
    arrive(info, shown);
    await finished;
    if (mine !== opening) return;
    demo.state = "complete";
    demo.totalBytes ??= demo.receivedBytes;
    showGrowth();
    $("loading").classList.add("done");
    opened(from);
  } catch (error) {
    if (mine !== opening || error?.name === "AbortError") return;
    stay(before);
    fail(error);
  }
}

/** A link is of a file that is not here: says so, and shows it as in the link when it is dropped. */
function wait(file) {
  awaited = file;
  if (!demo.info) showInList(/** @type {any} */ ({ name: file.name }));
  const words = `The link is of ${file.name}, a file on a disk, which links do not contain. Drop it on the page, or choose it, to see it as in the link`;
  fail({ code: "no-file", message: words });
}

/** What could not be opened has not taken the place of the volume before: that stays, with its settings. */
function stay({ source: from, ...before }) {
  if (!before.info || page.viewer.info !== before.info) return;
  source = from;
  Object.assign(demo, { ...before, frames: demo.frames });
  showInList(from);
  showGrowth();
  $("legend").hidden = !page.viewer.legend;
}

/** What is told when a volume has been opened. @type {(from: string | File) => unknown} */
let opened = () => {};

/** Calls `then` when a volume is complete. @param {typeof opened} then */
export function onOpened(then) {
  opened = then;
}

/** Continues the download if the file comes in blocks and has not been replaced; otherwise opens it again. */
export async function retry() {
  if (isNew() || !demo.blocks || demo.error?.code === "changed") return open(tried);
  hideMessage();
  demo.error = undefined;
  demo.state = "streaming";
  const mine = opening;
  try {
    await page.viewer.retry();
    await page.viewer.settled();
    if (mine === opening && demo.state === "streaming") demo.state = "complete";
  } catch (error) {
    if (mine === opening && demo.state === "streaming") fail(error);
  }
}

/** The base mesh has arrived: sets up the settings for it. */
function arrive(info, words) {
  demo.info = info;
  page.probes.clear();
  page.flow.fields = info.fields;
  $("n-kind").textContent = KINDS[info.kind] ?? info.kind;
  setFields(info.fields);
  arriveWith(words);
}

/** Selects in the list what is open; a file or URL that is not in the list replaces the last one that was added. */
export function showInList(from) {
  const list = $("volume");
  const listed = [...list.options].find(({ value }) => value && value === from);
  if (listed) {
    listed.selected = true;
    return;
  }
  list.querySelector("[data-other]")?.remove();
  const option = new Option(nameOf(from), "", true, true);
  option.dataset.other = typeof from === "string" ? from : "";
  option.disabled = true;
  list.append(option);
}
