// The worker is another entry point of the bundler, and the wasm file lies beside the scripts: see rollup.config.js.
import { MultiTessellation } from "tetralod";
import { draw } from "./draw.js";

const mt = await MultiTessellation.open("bucky.mt");
await mt.refine({ error: "2%" });
draw(document.querySelector("canvas"), await mt.slice([0, 0, 1], 0.5));
