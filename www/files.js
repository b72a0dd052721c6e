/** Volumes of the user: chosen, or dropped on the page. */

import { takeMesh } from "./build.js";
import { $, dialog, input } from "./dom.js";
import { say } from "./messages.js";
import { open, openBuilt } from "./opening.js";
import { source, wordsOf } from "./source.js";
import { store } from "./state.js";

/** How an MT file begins. */
const START = [0x89, 0x54, 0x4c, 0x4f, 0x44, 0x0d, 0x0a, 0x1a];

/** @typedef {import("./source.js").Dropped} Dropped */

/**
 * Takes files that the user has chosen or dropped: an MT file to open, or a mesh to build one of.
 *
 * @param {Dropped[]} given
 * @param {boolean} isForBeside whether they are shown beside what is open
 */
export async function takeFiles(given, isForBeside = source.isForBeside) {
  if (given.length === 0) return;
  dialog("gallery").close();
  const files = await joined(given);
  const [{ data }] = files;
  const isMt = files.every(({ name }) => /\.mt$/i.test(name)) || (files.length === 1 && (await beginsAsMt(data)));
  const show = (/** @type {File} */ file) => store.change({ beside: wordsOf(file) });
  if (isMt) isForBeside ? show(data) : open(data);
  else takeMesh(files, (built) => (isForBeside ? show(built) : openBuilt(built, files)));
}

/** The first bytes of a file; none of one that cannot be read, which is for whoever opens it. @param {File} file */
const startOf = (file, count = START.length) =>
  file
    .slice(0, count)
    .arrayBuffer()
    .catch(() => new ArrayBuffer(0));

/** Whether the content says that it is an MT file. @param {File} file */
async function beginsAsMt(file) {
  const bytes = new Uint8Array(await startOf(file));
  return START.every((byte, i) => byte === bytes[i]);
}

/** Shards of MT files, but for the first ones: `name.mt.0001`. */
const SHARD = /\.mt\.\d{4,}$/i;

/** The same files with each MT file in one, if it comes in shards. @param {Dropped[]} files @returns {Promise<Dropped[]>} */
async function joined(files) {
  const shards = new Map(files.filter(({ name }) => SHARD.test(name)).map((file) => [file.name, file]));
  const whole = async (/** @type {Dropped} */ first) => {
    const all = [first];
    for (let next; (next = shards.get(shardName(first, all.length))); all.push(next)) shards.delete(next.name);
    if (all.length === 1) return first;
    const data = new File(
      all.map((shard) => shard.data),
      first.data.name,
      { lastModified: Math.max(...all.map((shard) => shard.data.lastModified)) },
    );
    // Of how many bytes there are, the header tells at its place 16.
    const start = await startOf(data, 24);
    const missing = start.byteLength === 24 && data.size < Number(new DataView(start).getBigUint64(16, true));
    if (missing) throw new Error(`${first.name}: ${shardName(first, all.length)} is missing, or one before it is cut off`);
    return { name: first.name, data };
  };
  const found = await Promise.all(files.filter(({ name }) => !SHARD.test(name)).map(whole));
  // What belongs to none of them is for whoever opens it.
  return [...found, ...shards.values()];
}

/** @param {Dropped} first @param {number} number */
const shardName = ({ name }, number) => `${name}.${String(number).padStart(4, "0")}`;

/** @param {Iterable<File> | null | undefined} files @returns {Dropped[]} */
const named = (files) => Array.from(files ?? [], (data) => ({ name: data.webkitRelativePath || data.name, data }));

/** What was dropped, with all files of folders by their names; hidden ones nobody means. @param {DataTransfer} transfer @returns {Promise<Dropped[]>} */
async function droppedFiles(transfer) {
  // Both are empty when the event is over.
  const files = named(transfer.files);
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.());
  if (!entries.some((entry) => entry?.isDirectory)) return files;
  const all = (await Promise.all(entries.map(filesIn))).flat();
  const { compare } = new Intl.Collator("en", { numeric: true });
  return all.filter(({ name }) => !/(^|\/)\./.test(name)).sort((a, b) => compare(a.name, b.name));
}

/** @param {FileSystemEntry | null | undefined} entry @returns {Promise<Dropped[]>} */
async function filesIn(entry) {
  const path = entry?.fullPath.replace(/^\//, "") ?? "";
  if (entry?.isFile) return [{ name: path, data: await new Promise((resolve, reject) => /** @type {FileSystemFileEntry} */ (entry).file(resolve, reject)) }];
  if (!entry?.isDirectory) return [];
  const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
  const found = [];
  for (;;) {
    /** @type {FileSystemEntry[]} */
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) break;
    found.push(...(await Promise.all(some.map(filesIn))).flat());
  }
  return found;
}

export function attachFiles() {
  $("choose").addEventListener("click", () => input("file").click());
  input("file").addEventListener("change", () => {
    const files = named(input("file").files);
    input("file").value = "";
    takeFiles(files).catch((error) => say("What was chosen cannot be read", error));
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
    const files = event.dataTransfer ? droppedFiles(event.dataTransfer) : Promise.resolve([]);
    const isForBeside = source.isForBeside || (event.target instanceof Element && event.target.closest("#stage-beside") !== null);
    files.then((dropped) => takeFiles(dropped, isForBeside)).catch((error) => say("What was dropped cannot be read", error));
  });
}
