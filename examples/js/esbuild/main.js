// The worker and the wasm module are in the bundle.
import { MultiTessellation } from "tetralod/inline";
import { draw } from "./draw.js";

const mt = await MultiTessellation.open("bucky.mt");
await mt.refine({ error: "2%" });
draw(document.querySelector("canvas"), await mt.slice([0, 0, 1], 0.5));
