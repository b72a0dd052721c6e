/** Opening a volume, and following its download. */

import { cameraIsNew } from "./camera.js";
import { $, select } from "./dom.js";
import { listVectors } from "./deform.js";
import { listFields } from "./fields.js";
import { showFitting } from "./fitting.js";
import { nameOf } from "./format.js";
import { fail, hideMessage, note } from "./messages.js";
import { showGrowth } from "./numbers.js";
import { demo, viewer } from "./page.js";
import { listRegions } from "./regionlist.js";
import { afterFirst, firstRequest, stopHolding } from "./request.js";
import { fileNameIn, isNew, setOrigin, source, sourceOf } from "./source.js";
import { carriedOver, store } from "./state.js";

/** @typedef {import("./source.js").Source} Source */
/** @typedef {import("./state.js").Words} Words */

/** The kinds of MT, with their updates. @type {Record<string, string>} */
const KINDS = {
  "half-edge": "half-edge (vertex insertions)",
  edge: "edge (vertex splits)",
  vertex: "vertex (vertex insertions)",
};

let opening = 0;
/** The file that a link is of, which contains none: until it is dropped, and how it is shown then. @type {{ name: string, words?: Words } | undefined} */
let awaited;
/** What is told when a volume is complete. @type {(from: Source) => unknown} */
let opened = () => {};

/** @param {typeof opened} then is called when a volume is complete */
export const onOpened = (then) => void (opened = then);

/** Opens an MT file that the page has built of files of the user. @param {File} built @param {import("./source.js").Dropped[]} files */
export function openBuilt(built, files) {
  setOrigin(built, files);
  return open(built);
}

/**
 * Opens a volume: a URL, a file of the user, or what the words of an address mean. Shows it with the state `words`; without
 * them the settings stay, as far as they have a meaning there.
 *
 * @param {Source} wanted
 * @param {Words} [words]
 */
export async function open(wanted, words) {
  const from = sourceOf(wanted);
  if (!from) return wait({ name: fileNameIn(String(wanted)) ?? "", words });
  const before = { ...demo, from: source.open };
  const ofLink = from instanceof File && from.name === awaited?.name ? awaited.words : undefined;
  awaited = undefined;
  const shown = words ?? ofLink ?? (demo.info ? carriedOver() : {});
  source.open = source.tried = from;
  showInList(from);
  const mine = ++opening;
  stopHolding();
  Object.assign(demo, { state: "opening", error: undefined, info: undefined, stats: undefined, request: undefined, blocks: undefined });
  Object.assign(demo, { firstFrameBytes: undefined, firstFrameMs: undefined, receivedBytes: 0, totalBytes: undefined });
  store.change({ playing: false, swinging: false, freeze: false, kept: false, subtracted: false });
  hideMessage();
  $("legend").hidden = true;
  $("loading").classList.remove("done");
  $("progress").removeAttribute("value");
  $("growth").textContent = `Opening ${nameOf(from)}…`;
  try {
    const request = firstRequest(shown);
    const { info, total, finished } = await viewer().open(from, { request });
    if (mine !== opening) return;
    demo.totalBytes = total;
    if (demo.state === "opening") demo.state = "streaming";
    // A file in blocks is fetched as it is asked for; of others everything comes.
    const whole = request && demo.blocks ? afterFirst(finished, () => mine === opening) : undefined;
    whole?.catch(() => {});
    arrive(info, shown);
    await finished;
    await whole;
    if (mine !== opening) return;
    demo.state = "complete";
    demo.totalBytes ??= demo.receivedBytes;
    showGrowth();
    $("loading").classList.add("done");
    opened(from);
  } catch (error) {
    if (mine !== opening || (error instanceof Error && error.name === "AbortError")) return;
    stay(before);
    fail(error);
  }
}

/** A link is of a file that is not here: says so, and shows it as in the link when it is dropped. @param {NonNullable<typeof awaited>} file */
function wait(file) {
  awaited = file;
  if (!demo.info) showInList(file);
  const message = `The link is of ${file.name}, a file on a disk, which links do not contain. Drop it on the page, or choose it, to see it as in the link`;
  fail({ code: "no-file", message });
}

/** What could not be opened has not taken the place of the volume before: that stays, with its settings. @param {typeof demo & { from?: Source }} before */
function stay({ from, ...before }) {
  if (!from || !before.info || viewer().info !== before.info) return;
  source.open = from;
  Object.assign(demo, { ...before, frames: demo.frames });
  // What was set meanwhile is of it.
  store.replace({});
  showInList(from);
  showGrowth();
  $("legend").hidden = !viewer().legend;
}

/** Continues the download if the file comes in blocks and has not been replaced; otherwise opens it again. */
export async function retry() {
  if (isNew() || !demo.blocks || demo.error?.code === "changed") return open(source.tried ?? "");
  hideMessage();
  demo.error = undefined;
  demo.state = "streaming";
  const mine = opening;
  const isStreaming = () => mine === opening && demo.state === "streaming";
  try {
    await viewer().retry();
    await viewer().settled();
    if (isStreaming()) demo.state = "complete";
  } catch (error) {
    if (isStreaming()) fail(error);
  }
}

/** The base mesh has arrived: sets up the settings for it. @param {import("tetralod").MtInfo} info @param {Words} words */
function arrive(info, words) {
  demo.info = info;
  $("n-kind").textContent = KINDS[info.kind] ?? info.kind;
  listFields();
  listRegions();
  listVectors();
  cameraIsNew();
  const { lost, ignored } = showFitting(words);
  tell(lost, ignored);
}

/** Says what the volume does not have, and what means nothing. @param {string[]} lost @param {string[]} ignored */
export function tell(lost, ignored) {
  const said = lost.length > 0 ? [`Left out, since this volume does not have it: ${lost.join(", ")}`] : [];
  if (ignored.length > 0) said.push(`Ignored in the address, for it means nothing: ${ignored.join(", ")}`);
  if (said.length > 0) note(said.join(". "));
}

/** Selects in the list what is open; a file or URL that is not in the list replaces the last one that was added. @param {string | { name: string }} from */
export function showInList(from) {
  const list = select("volume");
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
