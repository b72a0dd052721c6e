/** Volumes of the user: chosen, or dropped on the page. */

import { takeMesh } from "./build.js";
import { $, dialog, input } from "./dom.js";
import { say } from "./messages.js";
import { open, openBuilt } from "./opening.js";

/** How an MT file begins. */
const START = [0x89, 0x54, 0x4c, 0x4f, 0x44, 0x0d, 0x0a, 0x1a];

/** Names of files that the command reads, and the page does not. */
const FOR_COMMAND = /\.(pv(?:d|t[uirs])|vtkhdf|hdf|hdf5|h5|exo|ex2|e|msh|meshb?|solb?|node|ele|vol|nrrd|nhdr|mha|mhd)$/i;

const READ_HERE = "This page opens .mt files, and builds them of .vtu, .vti, .vts, .vtr, .vtk, and .raw with its .json";
const READ_BY_COMMAND = "VTKHDF, Exodus II, lists of files (.pvtu, .pvd), Gmsh, Medit, TetGen, Netgen, NRRD and MetaImage";

/** Takes files that the user has chosen or dropped: an MT file to open, or a mesh to build one of. @param {File[]} files */
export async function takeFiles(files) {
  if (files.length === 0) return;
  dialog("gallery").close();
  if (takeMesh(files, (built) => openBuilt(built, files))) return;
  const [file] = files;
  // An empty file, and one that cannot be read, are for whoever opens them.
  const start = new Uint8Array(
    await file
      .slice(0, START.length)
      .arrayBuffer()
      .catch(() => new ArrayBuffer(0)),
  );
  const isOther = start.some((byte, i) => byte !== START[i]);
  if (isOther && !/\.mt$/i.test(file.name)) return say("This page does not read the file", { message: wordsFor(file.name) });
  open(file);
}

/** What to do with a file that the page does not read. @param {string} name */
function wordsFor(name) {
  const [stem] = name.split(/\.[^.]*$/);
  const known = `${READ_HERE}. The command reads this one: tetralod build ${quoted(name)} -o ${quoted(`${stem}.mt`)}`;
  return `${name}: ${FOR_COMMAND.test(name) ? known : `${READ_HERE}. The command "tetralod build" also reads ${READ_BY_COMMAND}`}`;
}

/** As a shell takes it. */
const quoted = (/** @type {string} */ name) => (/^[\w.+-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`);

export function attachFiles() {
  $("choose").addEventListener("click", () => input("file").click());
  input("file").addEventListener("change", () => {
    const files = [...(input("file").files ?? [])];
    input("file").value = "";
    takeFiles(files);
  });
  const carriesFile = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files");
  window.addEventListener("dragover", (event) => {
    if (!carriesFile(event)) return;
    event.preventDefault();
    $("drop").hidden = false;
  });
  window.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) $("drop").hidden = true;
  });
  window.addEventListener("drop", (event) => {
    $("drop").hidden = true;
    if (!carriesFile(event)) return;
    event.preventDefault();
    takeFiles([...(event.dataTransfer?.files ?? [])]);
  });
}
