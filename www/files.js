/** Volumes of the user: chosen, or dropped on the page. */

import { $ } from "./dom.js";
import { open } from "./opening.js";

/** Takes files that the user has chosen or dropped. What else than MT files is to be read goes here. @param {File[]} files */
export function takeFiles(files) {
  if (files.length === 0) return;
  $("gallery").close();
  open(files[0]);
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
