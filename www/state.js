/**
 * The whole state of the page as one plain object of words: what is open, all settings, the camera. It is in the address of the
 * page, so that a reload or a link shows the same, and undo and redo go back and forth in it. Words that are the default are
 * left out.
 */

import { $, all, checked } from "./dom.js";
import { chooseField, isPlaying, rangeOf } from "./fields.js";
import { precise, rounded } from "./format.js";
import { fail } from "./messages.js";
import { open, sourceWords } from "./opening.js";
import { demo, page } from "./page.js";
import { words as ofParts } from "./parts.js";
import { words as ofPlanes } from "./planes.js";
import { applyRegion, inner } from "./region.js";
import { applyFrameTime, applyRefineBy, errorPositions } from "./request.js";
import { applyMode } from "./scene.js";
import { note } from "./share.js";
import { applyTheme } from "./theme.js";

/** The state is written when nothing has changed for so long (in ms). */
const QUIET = 300;
/** So many states can be undone. */
const MOST = 200;
/** Digits of numbers of the camera; those of the mesh's request have fewer, and are rounded before they are used. */
const CAMERA_DIGITS = 9;

/** @typedef {Record<string, string>} Words */
/** `set` gives false for words that mean nothing, whatever the volume. @typedef {{ get: () => string, set: (words: string) => unknown }} Entry */

const numbers = (words) => words.split(",").map(Number);
const isNumbers = (words, count) => numbers(words).length === count && numbers(words).every(Number.isFinite);

/** Whether words are a box: its corner of the least numbers, and that of the largest ones. */
const isBox = (words) => isNumbers(words, 6) && [0, 1, 2].every((i) => numbers(words)[i] <= numbers(words)[i + 3]);

/** A control whose default is what it has in the page as it was loaded. @returns {Entry} */
function control(id) {
  const element = $(id);
  const isBox = element.type === "checkbox";
  const read = () => (isBox ? String(Number(element.checked)) : element.value);
  const initial = read();
  const put = (words) => (isBox ? (element.checked = words === "1") : (element.value = words));
  const set = (words) => {
    put(words);
    if (read() === words) return true;
    // What it does not take would leave it empty, or at another value.
    put(initial);
    return false;
  };
  return { get: () => (read() === initial ? "" : read()), set: (words) => set(words || initial) };
}

/** A list whose options come from the file; the default is the first. @returns {Entry} */
function list(id) {
  const set = (words) => {
    const at = [...$(id).options].findIndex(({ value }) => value === words);
    $(id).selectedIndex = Math.max(at, 0);
  };
  return { get: () => ($(id).selectedIndex > 0 ? $(id).value : ""), set };
}

/** Radio buttons of a name. @returns {Entry} */
function radios(name) {
  const initial = checked(name);
  const set = (words) => {
    const named = (choice) => all(`[name=${name}]`).find(({ value }) => value === choice);
    const wanted = named(words || initial);
    (wanted && !wanted.disabled ? wanted : named(initial)).checked = true;
    return Boolean(wanted);
  };
  return { get: () => (checked(name) === initial ? "" : checked(name)), set };
}

/** A position of the slider of errors. @returns {Entry} */
function errorPosition(kind) {
  const initial = String(errorPositions[kind]);
  return {
    get: () => (String(errorPositions[kind]) === initial ? "" : String(errorPositions[kind])),
    set: (words) => (errorPositions[kind] = Number(words || initial)),
  };
}

/** @returns {Record<string, Entry>} */
function makeEntries() {
  const ids = ["shape", "shrink", "outline", "shade", "inside", "colour-by", "flow-colour", "rake", "arrows", "flow-boundary", "map", "reversed", "log"];
  const more = ["axis", "flip", "pixels", "budget", "region", "focus", "background", "axes", "fly", "frame-time"];
  const simple = Object.fromEntries([...ids, ...more].map((id) => [id, control(id)]));
  const time = control("time");
  return {
    view: radios("mode"),
    also: ofParts.also,
    opacity: ofParts.opacity,
    edges: ofParts.edges,
    field: list("field"),
    "surface-colour": list("surface-colour"),
    vector: list("vector"),
    isovalue: {
      get: () => String(page.isovalue ?? ""),
      set: (words) => {
        const isOne = isNumbers(words, 1);
        page.isovalue = words && isOne ? Number(words) : undefined;
        return isOne;
      },
    },
    ...ofPlanes,
    ...simple,
    // Which times there are is up to the volume.
    time: { get: time.get, set: (words) => void time.set(words) },
    refine: radios("refine-by"),
    error: errorPosition("field"),
    outside: errorPosition("view"),
    box: {
      get: () => (String(page.box) === String(inner(demo.info.bounds)) ? "" : String(page.box)),
      set: (words) => {
        page.box = isBox(words) ? numbers(words) : inner(demo.info.bounds);
        return words === "" || isBox(words);
      },
    },
    range: {
      get: () => page.colours.words,
      set: (words) => {
        page.colours.words = words;
        return words === "" || page.colours.words !== "";
      },
    },
    transfer: { get: () => page.transfer.words, set: (words) => (page.transfer.words = words) },
    seeds: { get: () => page.flow.words, set: (words) => (page.flow.words = words) },
    probes: { get: () => page.probes.words, set: (words) => (page.probes.words = words) },
    camera: { get: cameraWords, set: setCamera },
  };
}

/** @type {Record<string, Entry>} */
let entries;

/** The camera as a volume is shown first. @type {import("tetralod/viewer").CameraState | undefined} */
let home;

/** The words of a camera that was set, until the viewer has it. @type {string | undefined} */
let awaited;
let isSet = true;

const wordsOf = (camera) => {
  const { target, distance, yaw, pitch, projection } = camera;
  const place = target.map((x) => precise(x, distance, CAMERA_DIGITS));
  const all = [...place, ...[distance, yaw, pitch].map((x) => Number(x.toPrecision(CAMERA_DIGITS)))];
  return `${all}${projection === "orthographic" ? ",orthographic" : ""}`;
};

function cameraWords() {
  const { camera } = page.viewer.state;
  home ??= camera;
  const words = awaited ?? (camera ? wordsOf(camera) : "");
  return home && words === wordsOf(home) ? "" : words;
}

function setCamera(words) {
  const [x, y, z, distance, yaw, pitch] = numbers(words);
  const isOrthographic = words.endsWith(",orthographic");
  const isWhole = [x, y, z, distance, yaw, pitch].every(Number.isFinite) && distance > 0;
  $("orthographic").checked = isWhole && isOrthographic;
  /** @type {"orthographic" | "perspective"} */
  const projection = isOrthographic ? "orthographic" : "perspective";
  const camera = isWhole ? { target: /** @type {[number, number, number]} */ ([x, y, z]), distance, yaw, pitch, projection } : home;
  if (camera) {
    awaited = wordsOf(camera);
    isSet = false;
    const mine = awaited;
    page.viewer.set({ camera }).then(() => (isSet ||= mine === awaited), fail);
  }
  return words === "" || isWhole;
}

function cameraMoved({ detail }) {
  if (isSet || wordsOf(detail) === awaited) awaited = undefined;
  changed();
}

/** The state of the page now, as a plain object. @returns {Words} */
export function stateNow() {
  const words = { url: sourceWords(), ...Object.fromEntries(Object.entries(entries).map(([name, { get }]) => [name, get()])) };
  return Object.fromEntries(Object.entries(words).filter(([, word]) => word !== ""));
}

/** As it is written in the address. Commas and slashes need no escapes there. @param {Words} words */
function written(words) {
  return new URLSearchParams(words).toString().replaceAll("%2C", ",").replaceAll("%2F", "/");
}

/** @returns {Words} */
export const read = (text) => Object.fromEntries(new URLSearchParams(text.replace(/^#/, "")));

/** What stays when another volume takes the place of one: all that has no place in its model. @returns {Words} */
export function carriedOver() {
  const { camera, box, seeds, probes, time, url, ...rest } = stateNow();
  return rest;
}

/** Points of the model that are inside of the volume. @param {string} words */
function inside(words) {
  const { bounds } = demo.info;
  const all = numbers(words);
  const points = all.flatMap((_, i) => (i % 3 === 0 && i + 2 < all.length ? [all.slice(i, i + 3)] : []));
  return points.filter((point) => point.every((x, i) => x >= bounds[i] && x <= bounds[i + 3]));
}

/**
 * What words mean of the volume that has arrived, where that is not all that they say, and what is not there; nothing where all is.
 *
 * @type {Record<string, (words: string, field: string) => [kept: string, lost: string] | undefined>}
 */
const LIMITS = {
  isovalue: (words, field) => {
    const [low, high] = rangeOf(field);
    const isThere = !isNumbers(words, 1) || (Number(words) >= low && Number(words) <= high);
    return isThere ? undefined : ["", `isovalue ${words} (${field} is ${rangeWords(low, high)})`];
  },
  range: (words, field) => {
    const [low, high] = rangeOf(field);
    const [from, to] = numbers(words);
    return !isNumbers(words, 2) || (to >= low && from <= high) ? undefined : ["", `colours of ${rangeWords(from, to)} (${field} is ${rangeWords(low, high)})`];
  },
  box: (words) => {
    const { bounds } = demo.info;
    const box = numbers(words);
    const meets = [0, 1, 2].every((i) => box[i] <= bounds[i + 3] && box[i + 3] >= bounds[i]);
    return !isNumbers(words, 6) || meets ? undefined : ["", "the box of the region"];
  },
  seeds: (words) => pointsLeft(words, "seeds"),
  probes: (words) => pointsLeft(words, "probes"),
};

const rangeWords = (low, high) => `${rounded(low, high - low)} to ${rounded(high, high - low)}`;

/** @returns {[kept: string, lost: string] | undefined} */
function pointsLeft(words, what) {
  const left = inside(words);
  const count = Math.floor(numbers(words).length / 3) - left.length;
  return count > 0 ? [String(left.flat()), `${count} ${what} outside`] : undefined;
}

/** The words of which the volume has something, and what it has not. @param {Words} words @returns {[kept: Words, lost: string[]]} */
function fitting(words) {
  const field = [...$("field").options].some(({ value }) => value === words.field) ? words.field : demo.info.fields[0].name;
  const [kept, lost] = [{ ...words }, /** @type {string[]} */ ([])];
  for (const [name, judge] of Object.entries(LIMITS)) {
    const [left, what] = (words[name] && judge(words[name], field)) || [];
    if (what === undefined) continue;
    kept[name] = left;
    lost.push(what);
  }
  return [kept, lost];
}

/** What of some words no control has taken. @param {Words} words */
function untaken(words) {
  const isNot = (id) => words[id] && $(id).value !== words[id];
  const label = (name, value) => document.querySelector(`[name=${name}][value="${value}"]`)?.parentElement.textContent.trim() ?? value;
  const lists = { field: "field", "surface-colour": "colours of", vector: "vector", time: "time step" };
  const lost = Object.entries(lists).flatMap(([id, what]) => (isNot(id) ? [`${what} ${words[id]}`] : []));
  if (words.view !== checked("mode") && all("[name=mode]").some(({ value }) => value === words.view)) lost.push(`view ${label("mode", words.view)}`);
  const off = (words.also ?? "").split(",").filter((name) => document.querySelector(`[name=also][value="${CSS.escape(name)}"]:disabled`));
  return [...lost, ...off.map((name) => `${label("also", name)} beside the view`)];
}

/** Says what the volume does not have, and what means nothing. @param {string[]} lost @param {string[]} ignored */
function tell(lost, ignored) {
  const said = lost.length > 0 ? [`Left out, since this volume does not have it: ${lost.join(", ")}`] : [];
  if (ignored.length > 0) said.push(`Ignored in the address, for it means nothing: ${ignored.join(", ")}`);
  if (said.length > 0) note(said.join(". "));
}

/** A volume has arrived: shows it with these words, or as it is by default; says what of them it does not have. @param {Words} words */
export function arriveWith(words) {
  home = page.viewer.state.camera;
  const [kept, lost] = fitting(words);
  const ignored = show(kept);
  lost.push(...untaken(words));
  tell(lost, ignored);
  // What is changed first can be undone, too, however soon.
  if (now === undefined) save();
  // The address names the volume even if all events of its camera came before it was open.
  else changed();
}

/** Shows a state of the volume that is open; gives what of it means nothing. @param {Words} words */
function show(words) {
  const { transfer, ...others } = entries;
  const ignored = Object.keys(words).filter((name) => name !== "url" && !entries[name]);
  for (const [name, { set }] of Object.entries(others)) if (set(words[name] ?? "") === false) ignored.push(name);
  page.overlay.showsAxes = $("axes").checked;
  chooseField();
  // The step of a transfer function is at the isovalue of the field.
  transfer.set(words.transfer ?? "");
  applyMode();
  applyRegion();
  // Draws, too.
  applyTheme();
  applyFrameTime();
  applyRefineBy();
  return ignored.map((name) => `${name}=${words[name]}`);
}

/** Shows a state: opens its volume if that is another one. @param {Words} words */
export function restore(words) {
  const { url = "" } = words;
  if (url !== sourceWords() || !demo.info) return open(url, words);
  tell([], show(words));
}

/** States before this one, and those that were undone. */
const [past, future] = [/** @type {string[]} */ ([]), /** @type {string[]} */ ([])];
/** @type {string | undefined} */
let now;
let timer;

/** What belongs to the next state and has not ended. @type {Set<Promise<void>>} */
const pending = new Set();
/** Whether a pointer is pressed: what it drags is one step, however long it rests on the way. */
let isPressed = false;

/** Takes what `work` does into the next state, however late the viewer answers. */
export function hold(work) {
  const ended = work
    .catch((error) => {
      if (error?.code !== "freed") console.warn(error);
    })
    .then(() => {
      pending.delete(ended);
      changed();
    });
  pending.add(ended);
}

/** Something may have changed: writes the state when it rests. */
export function changed() {
  clearTimeout(timer);
  timer = setTimeout(save, QUIET);
}

/** Writes the state into the address, and remembers the one before. */
export function save() {
  clearTimeout(timer);
  if (!demo.info || isPlaying() || isPressed || pending.size > 0) return;
  const words = written(stateNow());
  if (words === now) return;
  if (now !== undefined) past.push(now);
  if (past.length > MOST) past.shift();
  future.length = 0;
  set(words);
}

function set(words) {
  now = words;
  $("undo").disabled = past.length === 0;
  $("redo").disabled = future.length === 0;
  // Without a hash, the address of the page as it is.
  history.replaceState(null, "", words ? `#${words}` : `${location.pathname}${location.search}`);
}

async function step(from, to) {
  await Promise.all(pending);
  if (isPressed) return;
  save();
  if (from.length === 0) return;
  to.push(now);
  const words = from.pop();
  set(words);
  restore(read(words));
}

export const undo = () => step(past, future);
export const redo = () => step(future, past);

/** Shows the volume as it is by default. */
export function reset() {
  const { url } = stateNow();
  restore(url === undefined ? {} : { url });
  changed();
}

export function attachState(viewer) {
  entries = makeEntries();
  viewer.addEventListener("camera", cameraMoved);
  for (const name of ["pointerdown", "pointermove", "pointerup", "pointercancel"]) {
    document.addEventListener(name, (event) => (isPressed = /** @type {PointerEvent} */ (event).buttons !== 0), { capture: true });
  }
  for (const name of ["input", "change", "click", "keyup", "pointerup", "pointercancel"]) document.addEventListener(name, changed);
  window.addEventListener("hashchange", () => restore(read(location.hash)));
  $("undo").addEventListener("click", undo);
  $("redo").addEventListener("click", redo);
  $("reset").addEventListener("click", reset);
}
