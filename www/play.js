/** Time steps that follow each other by themselves. */

import { $ } from "./dom.js";
import { demo } from "./page.js";
import { refined } from "./request.js";
import { store } from "./state.js";
import { stepsOf } from "./volume.js";

/** How long a time step is shown at least (in ms). */
const STEP_TIME = 150;

/** Shows the time steps one after the other, each when the mesh of the one before is complete. */
async function play() {
  if (!store.state.playing || !demo.info) return;
  const shownFor = new Promise((resolve) => setTimeout(resolve, STEP_TIME));
  store.change({ time: (store.state.time + 1) % stepsOf(store.state.field).length });
  await Promise.all([refined(), shownFor]);
  play();
}

export function attachPlay() {
  $("play").addEventListener("click", () => {
    store.change({ playing: !store.state.playing && demo.info !== undefined });
    play();
  });
  store.subscribe(["playing"], () => {
    $("play").textContent = store.state.playing ? "Pause" : "Play";
    $("play").setAttribute("aria-pressed", String(store.state.playing));
  });
}
