/** The camera: that of the state, and that of the viewer, which people move; where it is looked from. */

import { $, input, select } from "./dom.js";
import { fail } from "./messages.js";
import { page, viewer } from "./page.js";
import { cameraWords, store } from "./state.js";

/** @typedef {import("./state.js").Camera} Camera */

/** The words of the camera that the viewer has, or will have. @type {string | undefined} */
let given;
/** Whether it has it: what it says of another one before that is out of date. */
let isThere = true;

/** @param {Camera} camera */
function moved(camera) {
  const words = cameraWords(camera);
  page.home ??= camera;
  isThere ||= words === given;
  if (!isThere) return;
  given = words;
  store.change({ camera });
}

/** Gives the viewer the camera of the state, unless it comes from there. */
function apply() {
  const camera = store.state.camera ?? page.home;
  input("orthographic").checked = camera?.projection === "orthographic";
  if (!camera || cameraWords(camera) === given) return;
  const mine = (given = cameraWords(camera));
  isThere = false;
  const arrived = () => {
    isThere ||= mine === given;
  };
  viewer().set({ camera }).catch(fail).then(arrived);
}

/** Another volume has arrived, and the viewer shows it from where it likes. */
export function cameraIsNew() {
  page.home = viewer().state.camera;
  given = undefined;
}

/** The model as it fills the picture leaves no room for the labels of axes: from so many times as far it does. */
const ROOM = 1.18;

/** Looks at the whole model from a side, with room around it. @param {Parameters<import("tetralod/viewer").Viewer["lookFrom"]>[0]} side */
export function lookFrom(side) {
  const looked = viewer().lookFrom(side);
  Promise.all([looked, side === "home" ? undefined : viewer().zoom(ROOM)]).catch(fail);
}

export function attachCamera() {
  viewer().addEventListener("camera", ({ detail }) => moved(detail));
  store.subscribe(["camera"], apply);
  $("home").addEventListener("click", () => viewer().home().catch(fail));
  select("side").addEventListener("input", () => {
    lookFrom(/** @type {any} */ (select("side").value));
    select("side").value = "";
  });
  input("orthographic").addEventListener("input", () => {
    const { camera } = viewer().state;
    if (camera) store.change({ camera: { ...camera, projection: input("orthographic").checked ? "orthographic" : "perspective" } });
  });
}
