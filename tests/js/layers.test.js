// Promise: modules of the page and of the package can be read from the bottom up. No file imports itself through others.
import assert from "node:assert/strict";
import { readdir, readFile } from "node:fs/promises";
import { join, posix } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

/** Imports that bring code; those of types alone vanish. */
const IMPORT = /^(?:import|export)\b(?! type\b)(?:[^;"'()=]*\bfrom)?\s*["'](\.[^"']+)["']/gm;

/** The name of a module, whichever language it is written in. */
const moduleOf = (file) => file.replace(/\.[jt]s$/, "");

/** What each module imports of its own folder. @param {Record<string, string>} sources by file */
function graphOf(sources) {
  const targets = ([file, text]) => [...text.matchAll(IMPORT)].map(([, to]) => moduleOf(posix.join(posix.dirname(file), to)));
  return new Map(Object.entries(sources).map((source) => [moduleOf(source[0]), targets(source)]));
}

/** A circle of imports in a graph, as a list of modules; undefined where there is none. @param {Map<string, string[]>} graph */
function circleIn(graph) {
  const done = new Set();
  /** @type {(module: string, path: string[]) => string[] | undefined} */
  const visit = (module, path) => {
    if (path.includes(module)) return [...path.slice(path.indexOf(module)), module];
    if (done.has(module)) return undefined;
    done.add(module);
    for (const next of graph.get(module) ?? []) {
      const found = visit(next, [...path, module]);
      if (found) return found;
    }
    return undefined;
  };
  for (const module of graph.keys()) {
    const found = visit(module, []);
    if (found) return found;
  }
  return undefined;
}

/** The files of a folder that are modules, by their names in it. */
async function sourcesIn(folder) {
  const names = (await readdir(folder, { recursive: true })).filter((name) => /(?<!\.d)\.[jt]s$/.test(name));
  const texts = await Promise.all(names.map((name) => readFile(join(folder, name), "utf8")));
  return Object.fromEntries(names.map((name, i) => [name.replaceAll("\\", "/"), texts[i]]));
}

for (const folder of ["www", "pkg-template"]) {
  test(`no module of ${folder} imports itself through others`, async () => {
    const graph = graphOf(await sourcesIn(fileURLToPath(new URL(`../../${folder}`, import.meta.url))));
    const imports = [...graph.values()].flat();
    assert.ok(imports.length > 20, `imports are found: ${imports.length}`);
    for (const name of imports) assert.ok(graph.has(name) || folder === "pkg-template", `${name} is no module`);
    assert.equal(circleIn(graph)?.join(" → "), undefined);
  });
}

test("a circle is found, and what is none is not", () => {
  const circle = (...texts) => circleIn(graphOf(Object.fromEntries(texts.map((text, i) => [`${"abc"[i]}.js`, text]))))?.join(" ");
  assert.equal(circle('import { x } from "./b.js";', 'export { y } from "./c.js";', 'import {\n  z,\n} from "./a.js";'), "a b c a");
  assert.equal(circle('import "./a.js";'), "a a");
  assert.equal(circle('import { x } from "./b.js";\nimport { y } from "./c.js";', 'import { y } from "./c.js";', 'import fs from "node:fs";'), undefined);
  assert.equal(
    circle('import { x } from "./b.js";', 'export const a = () => new URL("./a.js", import.meta.url);\nconst b = await import("./a.js");'),
    undefined,
  );
  assert.equal(circle('import { x } from "./b.js";', 'import type { X } from "./a.js";\n/** @typedef {import("./a.js").X} X */'), undefined);
  assert.equal(circleIn(graphOf({ "in/a.ts": 'import { b } from "../b.js";', "b.ts": 'import { a } from "./in/a.js";' }))?.join(" "), "in/a b in/a");
});
