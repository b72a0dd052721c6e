import { Viewer } from "tetralod/viewer";

const viewer = await Viewer.create(document.querySelector("canvas"));
await viewer.open(new URL("bucky.mt", document.baseURI));
const half = { normal: [0, -1, 0], offset: -0.5 };
await viewer.set({ isosurfaces: [], cells: { cut: half } });
await viewer.refine({ error: "2%" });
