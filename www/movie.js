/**
 * Movies: what is shown from all sides, at all times or through a period, as a video. It is encoded picture by picture, so that how long
 * each takes to draw is not seen.
 */

import { compose } from "./compose.js";
import { deformation } from "./deform.js";
import { $, all, button, input, select } from "./dom.js";
import { fileName, pictureSize, saveAs } from "./export.js";
import { count } from "./format.js";
import { note, say } from "./messages.js";
import { demo, viewer } from "./page.js";
import { refined } from "./request.js";
import { store } from "./state.js";
import { onTab } from "./tabs.js";
import { stepsOf } from "./volume.js";
import { webm } from "./webm.js";

/** What pictures are encoded with, the first that the browser has, and what files call it. */
const CODECS = [
  ["vp09.00.51.08", "V_VP9"],
  ["vp8", "V_VP8"],
];
/** For each pixel of a second. */
const BITS = 0.25;
/** After so many seconds a picture needs none before it: from there a player can begin. */
const WHOLE = 2;
/** How long the overlay of a picture is waited for (in ms). */
const PATIENCE = 1000;
/** Pictures, at most. */
const MOST = 999;

/**
 * What changes from picture to picture: whether there is anything to change, how many pictures and how many a second there are first,
 * and, once it begins, what shows a picture and what brings back what was there before.
 *
 * @typedef {object} Kind
 * @property {() => boolean} isThere
 * @property {() => number} pictures
 * @property {number} rate
 * @property {boolean} isFixed whether there are only so many pictures
 * @property {() => { show: (part: number, number: number) => Promise<unknown>, end: () => Promise<unknown> }} begin
 */

/** @type {Record<string, Kind>} */
const KINDS = {
  turntable: {
    isThere: () => true,
    pictures: () => 96,
    rate: 24,
    isFixed: false,
    begin() {
      const { camera } = viewer().state;
      if (!camera) throw new Error("Nothing is shown yet");
      const turned = (/** @type {number} */ part) => viewer().set({ camera: { ...camera, yaw: camera.yaw + 2 * Math.PI * part } });
      return { show: turned, end: () => turned(0) };
    },
  },
  steps: {
    isThere: () => demo.info !== undefined && stepsOf(store.state.field).length > 1,
    pictures: () => stepsOf(store.state.field).length,
    rate: 5,
    isFixed: true,
    begin() {
      const before = store.state.time;
      const show = async (/** @type {number} */ time) => {
        store.change({ time, playing: false });
        await refined();
      };
      return { show: (_, number) => show(number), end: () => show(before) };
    },
  },
  swing: {
    isThere: () => demo.info !== undefined && deformation() !== null,
    pictures: () => 48,
    rate: 24,
    isFixed: false,
    begin() {
      store.change({ swinging: false });
      const deform = deformation();
      // It begins with all of the displacement.
      return { show: (part) => viewer().set({ deform: deform && { ...deform, phase: 0.25 + part } }), end: () => viewer().set({ deform }) };
    },
  },
};

const kind = () => KINDS[select("movie-kind").value];

/** While a movie is made: whether it goes on. */
let goesOn = false;

/** What this browser encodes pictures of a size with; nothing where it cannot. @param {{ width: number, height: number }} size @param {number} rate */
async function codecFor({ width, height }, rate) {
  if (!("VideoEncoder" in window)) return undefined;
  for (const [codec, name] of CODECS) {
    const config = { codec, width, height, framerate: rate, bitrate: Math.round(BITS * width * height * rate) };
    const { supported } = await VideoEncoder.isConfigSupported(config).catch(() => ({ supported: false }));
    if (supported) return { name, config };
  }
  return undefined;
}

/** Has `show` change what is drawn, and waits until the overlay is at its new places. @param {() => Promise<unknown>} show */
async function overlaid(show) {
  const placed = new Promise((resolve) => {
    viewer().addEventListener("overlay", resolve, { once: true });
    setTimeout(resolve, PATIENCE);
  });
  await show();
  await placed;
}

/** Makes the movie that is chosen. @param {HTMLCanvasElement} canvas */
async function record(canvas) {
  const [rate, pictures] = [Number(select("movie-rate").value), Math.min(Math.max(Math.round(input("movie-pictures").valueAsNumber) || 2, 2), MOST)];
  const shot = pictureSize(canvas);
  // Encoders want even sizes.
  const size = { width: shot.width & ~1, height: shot.height & ~1 };
  const codec = await codecFor(size, rate);
  if (!codec) throw new Error("This browser cannot encode videos of this size: the command `tetralod render --turntable` makes movies, too");
  /** @type {import("./webm.js").Encoded[]} */
  const encoded = [];
  /** @type {unknown} */
  let broken;
  const encoder = new VideoEncoder({
    output(chunk) {
      const data = new Uint8Array(chunk.byteLength);
      chunk.copyTo(data);
      encoded.push({ data, at: Math.round(chunk.timestamp / 1000), isKey: chunk.type === "key" });
    },
    error: (error) => (broken = error),
  });
  encoder.configure(codec.config);
  const surface = new OffscreenCanvas(size.width, size.height);
  // What is transparent is black in a video.
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (surface.getContext("2d", { alpha: false }));
  const { show, end } = kind().begin();
  const isOverlaid = input("shot-overlay").checked;
  try {
    for (let i = 0; i < pictures && goesOn && demo.info; i++) {
      $("movie-words").textContent = `Picture ${count(i + 1)} of ${count(pictures)}`;
      const change = () => show(i / pictures, i);
      await (isOverlaid ? overlaid(change) : change());
      const picture = await viewer().screenshot(shot);
      const whole = await createImageBitmap(isOverlaid ? await compose(picture, { ...shot, canvas }) : picture);
      context.clearRect(0, 0, size.width, size.height);
      context.drawImage(whole, 0, 0);
      whole.close();
      const frame = new VideoFrame(surface, { timestamp: Math.round((1e6 * i) / rate), duration: Math.round(1e6 / rate), alpha: "discard" });
      encoder.encode(frame, { keyFrame: i % Math.ceil(WHOLE * rate) === 0 });
      frame.close();
      if (broken) throw broken;
    }
    await encoder.flush();
  } finally {
    if (encoder.state !== "closed") encoder.close();
    if (demo.info) await end();
  }
  if (encoded.length === 0) return;
  saveAs(fileName(select("movie-kind").value, "webm"), [webm(encoded, { codec: codec.name, ...size, rate })], "video/webm");
  note(`The movie has ${count(encoded.length)} pictures`);
}

/** Shows what can be chosen. */
function showKinds() {
  for (const option of /** @type {HTMLOptionElement[]} */ (all("#movie-kind option"))) option.disabled = !KINDS[option.value].isThere();
  const { isFixed, isThere, pictures } = kind();
  if (!isThere()) return choose("turntable");
  input("movie-pictures").disabled = isFixed;
  if (isFixed) input("movie-pictures").value = String(pictures());
}

/** @param {string} name */
function choose(name) {
  const { pictures, rate } = KINDS[name];
  select("movie-kind").value = name;
  select("movie-rate").value = String(rate);
  input("movie-pictures").value = String(pictures());
  showKinds();
}

/** @param {HTMLCanvasElement} canvas */
export function attachMovie(canvas) {
  const start = button("movie");
  start.addEventListener("click", async () => {
    if (!demo.info || goesOn) return void (goesOn = false);
    goesOn = true;
    start.textContent = "Stop, and save what there is";
    await record(canvas).catch((error) => say("The movie could not be made", error));
    goesOn = false;
    start.textContent = "Record as WebM";
    $("movie-words").textContent = "";
  });
  select("movie-kind").addEventListener("input", () => choose(select("movie-kind").value));
  input("movie-pictures").max = String(MOST);
  store.subscribe(["field", "deform"], showKinds);
  onTab((name) => name === "export" && showKinds());
}
