// A volume of samples that are made here, as an MT file that is built here: nothing else is needed.
import { build } from "tetralod/build";
import { Viewer } from "tetralod/viewer";

const size = 33;
const samples = Float32Array.from({ length: size ** 3 }, (_, i) => {
  const [x, y, z] = [i % size, Math.floor(i / size) % size, Math.floor(i / size ** 2)].map((k) => (k * 4 * Math.PI) / (size - 1));
  return Math.sin(x) * Math.cos(y) + Math.sin(y) * Math.cos(z) + Math.sin(z) * Math.cos(x);
});
const about = { dims: [size, size, size], type: "float32", field: "gyroid" };
const json = new TextEncoder().encode(JSON.stringify(about));
const { bytes } = await build({ raw: samples, json });

const viewer = await Viewer.create(document.querySelector("canvas"));
await viewer.open(bytes);
await viewer.refine({ error: "2%" });
