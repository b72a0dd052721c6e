import { Viewer } from "tetralod/viewer";

const viewer = await Viewer.create(document.querySelector("canvas"));
await viewer.open("bucky.mt");
await viewer.set({ isosurfaces: [], slices: [{ normal: [0, 0, 1], offset: 0.5 }] });
await viewer.refine({ error: "2%" });
