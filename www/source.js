/** What is open: an address, or a file of the user. */

import { nameOf } from "./format.js";
import { demo } from "./page.js";

/** An address, or a file. @typedef {string | File} Source */

const FILE = "file:";

/**
 * What is open; what was opened last, perhaps in vain: the button "Try again" opens it again; and what is open where no address says
 * anything else.
 *
 * `isForBeside`: whether what is chosen now is shown beside what is open.
 *
 * @type {{ open?: Source, tried?: Source, first: string, isForBeside: boolean }}
 */
export const source = { first: "", isForBeside: false };
/** Files of the user, by their names: undo may come back to them. @type {Map<string, File>} */
const files = new Map();
/** What MT files were built of by the page: in words, and its bytes. @type {WeakMap<File, { format: string, bytes: number }>} */
const origins = new WeakMap();

/** A file of the user with its folders, as others may name it. @typedef {{ name: string, data: File }} Dropped */

/** Files that name others, and those that go with others. */
const LISTS = /\.(pvd|pvt[uirs]|nhdr|mhd)(\.gz)?$/i;
const PARTS = /\.(json|ele|face|edge|neigh|solb?)$/i;

/** The file that a mesh is called by. @param {Dropped[]} files */
export const mainOf = (files) => files.find(({ name }) => LISTS.test(name)) ?? files.find(({ name }) => !PARTS.test(name)) ?? files[0];

/** Notes what the page has built of files of the user. @param {File} built @param {Dropped[]} files */
export function setOrigin(built, files) {
  const [ending = ""] = mainOf(files).name.replace(/\.gz$/i, "").split(".").reverse();
  origins.set(built, { format: ending.toUpperCase(), bytes: files.reduce((sum, { data }) => sum + data.size, 0) });
}

/** What the volume was built of, if the page has built it. */
export const originOf = () => (source.open instanceof File ? origins.get(source.open) : undefined);

/** The name of the volume, for files that are made of it. */
export const volumeName = () => (source.open ? nameOf(source.open).replace(/\.mt$/i, "") : "tetralod");

/** Whether what was opened last comes from a server. */
export const isRemote = () => !(source.tried instanceof File);

/** Whether nothing has come of what was opened last. */
export const isNew = () => source.tried !== source.open || !demo.info;

/** What is open, as in the address of the page. */
export function sourceWords() {
  const { open = "", first } = source;
  return open instanceof File ? `${FILE}${open.name}` : open === first ? "" : open;
}

/** What is meant by something that is to be shown beside what is open: words, as in the address of the page. @param {Source} wanted */
export function wordsOf(wanted) {
  if (!(wanted instanceof File)) return wanted;
  const isFree = (/** @type {string} */ name) => [undefined, wanted].includes(files.get(name));
  // Results of the same name in two folders are two files.
  let { name } = wanted;
  for (let number = 2; !isFree(name); number++) name = `${wanted.name} (${number})`;
  files.set(name, wanted);
  return `${FILE}${name}`;
}

/** The name of a file that is part of an address, if that is one of a file. @param {string} words */
export const fileNameIn = (words) => (words.startsWith(FILE) ? words.slice(FILE.length) : undefined);

/** What is meant: the words of an address, or a file itself; undefined for a file that is not here. @param {Source} wanted @returns {Source | undefined} */
export function sourceOf(wanted) {
  if (wanted instanceof File) {
    files.set(wanted.name, wanted);
    return wanted;
  }
  const name = fileNameIn(wanted);
  return name === undefined ? wanted || source.first : files.get(name);
}
