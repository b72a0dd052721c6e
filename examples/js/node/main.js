// node main.js FILE.mt: a coarse mesh and an isosurface, in numbers.
import { pathToFileURL } from "node:url";
import { MultiTessellation } from "tetralod";

const mt = await MultiTessellation.open(pathToFileURL(process.argv[2]));
const [{ name, min, max }] = mt.info.fields;
const { stats } = await mt.refine({ error: "1%" });
const { indices } = await mt.isosurface((min + max) / 2);
console.log(`${name}: ${stats.tetrahedra} of ${mt.info.tetrahedra} tetrahedra within ${stats.errorBound}`);
console.log(`${indices.length / 3} triangles`);
mt.free();
