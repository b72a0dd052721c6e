/**
 * The page's side of `tetralod.show`, for anywidget: the element, whose bytes come from Python by messages, and whose state is that of
 * the model. `xtask/js/widget.mjs` makes one file of it, with the worker and the wasm module inside.
 */

import "/pkg/inline-viewer.js";
import { namesParts } from "/pkg/fit.js";

/** Cameras go to Python no more often than this, in ms. */
const PAUSE = 100;

/** A pointer that moves farther than this, in CSS pixels, drags. */
const SLOP = 4;

/** Of scenes that name something to draw, only that is drawn. */
const NOTHING = { isosurfaces: [], volume: null, slices: null, boundary: null, cells: null };

const STYLE = "position: absolute; left: 0; bottom: 0; padding: 0.3em 0.6em; font: 13px/1.4 system-ui, sans-serif; background: #1c1c1cdd; color: #fff";

const text = JSON.stringify;

/** The file, whose ranges Python reads. Other pages may show the same model: they must not take these answers for theirs. */
function readerOf(model, signal) {
  const [mine, waiting] = [Math.random().toString(36).slice(2), new Map()];
  let count = 0;
  heard(model, signal, "msg:custom", ({ id, error }, buffers) => {
    const call = waiting.get(id);
    waiting.delete(id);
    if (error) call?.reject(Object.assign(new Error(error.message), error));
    else if (call) call.resolve(bytesOf(buffers[0]));
  });
  const read = (start, end) =>
    new Promise((resolve, reject) => {
      const id = `${mine}-${count++}`;
      waiting.set(id, { resolve, reject });
      model.send({ id, read: [start, end] });
    });
  return { name: model.get("name"), size: model.get("_size"), read };
}

const bytesOf = (given) => (ArrayBuffer.isView(given) ? new Uint8Array(given.buffer, given.byteOffset, given.byteLength) : new Uint8Array(given));

function heard(model, signal, name, listener) {
  model.on(name, listener);
  signal.addEventListener("abort", () => model.off(name, listener));
}

/** What is drawn at first of a scene of Python's. */
const drawn = (scene) => ({ ...(namesParts(scene) ? NOTHING : {}), ...scene });

const snake = (name) => name.replace(/[A-Z]/g, (letter) => `_${letter.toLowerCase()}`);

/** What Python knows of a mesh, in its words. */
const told = ({ blocks, ...stats }) => Object.fromEntries(Object.entries(stats).map(([name, value]) => [snake(name), value]));

/** What is told of a place in the picture: the values of all fields with their units, where it is, and the region. */
function line({ values, position, region }, fields) {
  const units = new Map(fields.map(({ name, unit }) => [name, unit]));
  const known = [...units].filter(([name]) => typeof values[name] === "number");
  const parts = known.map(([name, unit]) => `${name} ${+values[name].toPrecision(4)} ${unit}`.trim());
  return [...parts, `at ${position.map((x) => +x.toPrecision(4)).join(", ")}`, ...(region === undefined ? [] : [region])].join(" · ");
}

/** Shows the model in `el` until `signal` ends. */
function show(model, el, signal) {
  const element = document.createElement("tetralod-viewer");
  const known = {};
  /** Tells Python, and knows its own words when they come back. */
  const tell = (values) => {
    const news = Object.entries(values).filter(([name, value]) => text(value) !== text(model.get(name)));
    for (const [name, value] of Object.entries(values)) known[name] = text(value);
    for (const [name, value] of news) model.set(name, value);
    if (news.length > 0) model.save_changes();
  };
  const fail = ({ code = "internal", message }) => tell({ status: "failed", failure: { code, message } });
  const onChange = (name, act) => heard(model, signal, `change:${name}`, () => text(model.get(name)) !== known[name] && act(model.get(name)));
  const on = (name, act) => element.addEventListener(name, ({ detail }) => act(detail));
  /** @param {import("/pkg/viewer.js").ViewerState} state */
  const sceneOf = ({ camera, ...scene }) => scene;

  element.setAttribute("label", model.get("name"));
  element.style.aspectRatio = "auto";
  const size = () => (element.style.height = `${model.get("height")}px`);
  heard(model, signal, "change:height", size);
  size();
  const poster = Object.assign(document.createElement("img"), { slot: "poster", alt: "" });
  const forget = () => URL.revokeObjectURL(poster.src);
  signal.addEventListener("abort", forget);
  // Python may draw it after the page is there.
  const pose = () => {
    const png = model.get("picture");
    if (!png?.byteLength) return;
    forget();
    poster.src = URL.createObjectURL(new Blob([png], { type: "image/png" }));
    element.append(poster);
  };
  heard(model, signal, "change:picture", pose);
  pose();
  const card = Object.assign(document.createElement("output"), { hidden: true });
  card.style.cssText = STYLE;
  element.append(card);

  // What is drawn and which mesh go through the element, which shows what is wrong with them.
  onChange("scene", (scene) => {
    const before = Object.fromEntries(Object.keys(sceneOf(element.state)).map((name) => [name, null]));
    element.state = { ...before, ...drawn(scene) };
  });
  onChange("request", (request) => (element.request = request));
  onChange("camera", (camera) => element.viewer?.set({ camera }).catch(fail));
  const point = (picked) => {
    card.hidden = !picked;
    card.textContent = picked ? line(picked, element.info?.fields ?? []) : "";
  };
  heard(model, signal, "change:picked", () => point(model.get("picked")));
  on("load", () => {
    tell({ status: "ready", failure: null, scene: sceneOf(element.state) });
    const camera = model.get("camera");
    // The element may have been away for a while.
    if (camera) element.viewer.set({ camera }).catch(fail);
    else tell({ camera: element.state.camera });
  });
  let timer;
  on("camera", () => {
    timer ??= setTimeout(() => {
      timer = undefined;
      if (element.status !== "loading" && element.state.camera) tell({ camera: element.state.camera });
    }, PAUSE);
  });
  on("stats", (stats) => {
    if (!stats.done) return;
    tell({ stats: told(stats) });
    // Whoever waits for the mesh is told at the same time.
    setTimeout(() => element.status === "ready" && tell({ status: "ready", failure: null, scene: sceneOf(element.state) }));
  });
  on("error", fail);
  let down;
  el.addEventListener("pointerdown", ({ clientX, clientY }) => (down = [clientX, clientY]), { signal });
  const onClick = async ({ clientX, clientY }) => {
    if (!element.info || !down || Math.hypot(clientX - down[0], clientY - down[1]) > SLOP) return;
    const { left, top, width, height } = element.getBoundingClientRect();
    const found = await element.viewer.pick(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
    tell({ picked: found ?? null });
  };
  el.addEventListener("click", onClick, { signal });

  tell({ status: "loading" });
  element.source = readerOf(model, signal);
  element.request = model.get("request");
  const [scene, camera] = [model.get("scene"), model.get("camera")];
  element.state = { ...drawn(scene), ...(camera ? { camera } : {}) };
  for (const name of ["scene", "request", "camera"]) known[name] = text(model.get(name));
  point(model.get("picked"));
  el.append(element);
  signal.addEventListener("abort", () => {
    clearTimeout(timer);
    element.remove();
  });
}

/** When the cell runs again, or the widget is closed, the worker ends and the memory of the GPU is freed. */
function render({ model, el }) {
  const life = new AbortController();
  show(model, el, life.signal);
  return () => life.abort();
}

export default { render };
