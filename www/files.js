/** Volumes of the user: chosen, or dropped on the page. */

import { takeMesh } from "./build.js";
import { $ } from "./dom.js";
import { open } from "./opening.js";

/** Takes files that the user has chosen or dropped: an MT file to open, or a mesh to build one of. @param {File[]} files */
export function takeFiles(files) {
  if (files.length === 0) return;
  $("gallery").close();
  if (!takeMesh(files, open)) open(files[0]);
}

export function attachFiles() {
  $("choose").addEventListener("click", () => $("file").click());
  $("file").addEventListener("change", () => {
    const files = [...$("file").files];
    $("file").value = "";
    takeFiles(files);
  });
  const carriesFile = (event) => event.dataTransfer?.types.includes("Files");
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
    takeFiles([...event.dataTransfer.files]);
  });
}
