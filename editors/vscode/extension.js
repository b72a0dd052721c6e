/**
 * A read-only editor that shows volumes. The bytes of an MT file go to the page by ranges, as it asks for them; of anything else an MT file is
 * made first, by the package's builder in this extension or by the user's command. All is read on the side of the files, which may be remote.
 */

const { spawn } = require("node:child_process");
const { randomBytes } = require("node:crypto");
const { mkdtemp, open, readFile, rm } = require("node:fs/promises");
const { tmpdir } = require("node:os");
const { join, posix } = require("node:path");
const { createInterface } = require("node:readline");
const { pathToFileURL } = require("node:url");
const vscode = require("vscode");

/** So many bytes may have a file that is on no disk of this machine: VS Code gives it as a whole. */
const MOST = 512 * 2 ** 20;

/** Programs write files in several steps: a file that has changed is read when it has stayed so for this long, in ms. */
const PAUSE = 500;

const nameOf = (/** @type {vscode.Uri} */ uri) => posix.basename(uri.path);

/**
 * An MT file that is open.
 *
 * @typedef {{ size: number, read(start: number, end: number): Promise<Uint8Array>, close(): unknown, notes?: string[] }} Opened
 * @typedef {(text: string) => void} Tell
 */

/** How an MT file begins: the magic of its header. */
const START = [0x89, 0x54, 0x4c, 0x4f, 0x44, 0x0d, 0x0a, 0x1a];

/** A file of this machine, of which no more is in memory than what is asked for. @returns {Promise<Opened>} */
async function onDisk(path) {
  const first = await open(path);
  const { size } = await first.stat();
  const header = new Uint8Array(24);
  await first.read(header, 0, header.length, 0);
  // An MT file may have more bytes than are in the file of its name: then the others are in its shards.
  const isMt = START.every((byte, i) => header[i] === byte);
  const total = isMt ? Math.max(size, Number(new DataView(header.buffer).getBigUint64(16, true))) : size;
  const shards = [Promise.resolve(first)];
  const shard = (number) => (shards[number] ??= open(`${path}.${String(number).padStart(4, "0")}`));
  const read = async (start, end) => {
    const bytes = new Uint8Array(end - start);
    for (let at = start; at < end; ) {
      const number = total > size ? Math.floor(at / size) : 0;
      const length = total > size ? Math.min(end, (number + 1) * size) - at : end - at;
      const { bytesRead } = await (await shard(number)).read(bytes, at - start, length, at - number * size);
      if (bytesRead < length) return bytes.subarray(0, at - start + bytesRead);
      at += length;
    }
    return bytes;
  };
  const close = () => shards.forEach((opened) => opened?.then((handle) => handle.close()).catch(() => {}));
  return { size: total, read, close };
}

/** Copies go to the page: with a part of an array, VS Code would send all of it. @returns {Opened} */
const inMemory = (bytes) => ({ size: bytes.length, read: async (start, end) => Uint8Array.from(bytes.subarray(start, end)), close() {} });

/** All of a file that is elsewhere. */
async function whole(uri) {
  const { size } = await vscode.workspace.fs.stat(uri);
  if (size <= MOST) return vscode.workspace.fs.readFile(uri);
  const problem = `it has ${Math.ceil(size / 2 ** 20)} MiB, and files of "${uri.scheme}:" are read as a whole, up to ${MOST / 2 ** 20} MiB`;
  throw new Error(`${nameOf(uri)}: ${problem}; copy it to a disk`);
}

/** Has the package make an MT file. @returns {Promise<Opened>} */
async function built(uri, signal, /** @type {Tell} */ tell) {
  // @ts-expect-error: it is there when the extension is packed.
  const { build } = await import("./builder/build.js");
  const data = uri.scheme === "file" ? pathToFileURL(uri.fsPath) : await whole(uri);
  const onProgress = ({ phase, fraction }) => tell(`Building: ${phase}, ${Math.floor(100 * fraction)} %`);
  const options = { allFields: true, cellToPoint: true, signal, onProgress };
  const { bytes, report } = await build({ name: nameOf(uri), data }, options);
  return { ...inMemory(bytes), notes: [report.repaired, ...report.notes].filter((note) => note) };
}

/** Has the user's command make one. @returns {Promise<Opened>} */
async function builtBy(command, uri, signal, /** @type {Tell} */ tell) {
  const folder = await mkdtemp(join(tmpdir(), "tetralod-"));
  try {
    const output = join(folder, "built.mt");
    const options = ["--all-fields", "--cell-to-point", "--progress", "json"];
    const child = spawn(command, ["build", uri.fsPath, "--output", output, ...options], { signal, stdio: ["ignore", "ignore", "pipe"] });
    const ended = new Promise((resolve, reject) => child.once("error", reject).once("close", resolve));
    // It is waited for below.
    ended.catch(() => {});
    const notes = [];
    for await (const line of createInterface({ input: child.stderr })) {
      if (!line.startsWith("{")) {
        notes.push(line.replace(/^(error|note): /, "").replace(uri.fsPath, () => nameOf(uri)));
        continue;
      }
      const { stage, done, total } = JSON.parse(line);
      if (stage) tell(`Building: ${stage}, ${Math.floor((100 * done) / Math.max(1, total))} %`);
    }
    const code = await ended.catch((error) => {
      throw new Error(`tetralod.command: ${command} does not start: ${error.message}`);
    });
    if (code !== 0) throw new Error(notes.join("\n") || `${command} ended with ${code}`);
    return { ...(await onDisk(output)), notes };
  } finally {
    // A file that is open can be read when it is in no folder any more.
    await rm(folder, { recursive: true, force: true }).catch(() => {});
  }
}

/** @returns {Promise<Opened>} */
async function opened(uri, signal, /** @type {Tell} */ tell) {
  const isHere = uri.scheme === "file";
  if (/\.mt$/i.test(uri.path)) return isHere ? onDisk(uri.fsPath) : inMemory(await whole(uri));
  const command = vscode.workspace.getConfiguration("tetralod").get("command");
  return command && isHere ? builtBy(command, uri, signal, tell) : built(uri, signal, tell);
}

/** A file, and the pages that show it. @implements {vscode.CustomDocument} */
class Volume {
  /** What the pages were told last. */
  #state = { type: "status", text: "Reading …" };
  /** Counts the times that the file was opened: pages say which of them they read. */
  #version = 0;
  /** @type {Opened | undefined} */
  #file;
  /** @type {AbortController | undefined} */
  #work;
  #timer;
  #watcher;
  /** @type {Set<vscode.Webview>} */
  #pages = new Set();

  constructor(uri) {
    this.uri = uri;
    // The folder, for names may have characters that are special in patterns.
    const folder = new vscode.RelativePattern(vscode.Uri.joinPath(uri, ".."), "*");
    this.#watcher = vscode.workspace.createFileSystemWatcher(folder, false, false, true);
    const onChange = (changed) => {
      if (changed.toString() !== uri.toString()) return;
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#open(), PAUSE);
    };
    this.#watcher.onDidChange(onChange);
    this.#watcher.onDidCreate(onChange);
    this.#open();
  }

  async #open() {
    this.#work?.abort();
    const { signal } = (this.#work = new AbortController());
    try {
      const file = await opened(this.uri, signal, (text) => signal.aborted || this.#tell({ type: "status", text }));
      if (signal.aborted) return file.close();
      this.#file?.close();
      this.#file = file;
      this.#tell({ type: "opened", version: ++this.#version, name: nameOf(this.uri), size: file.size, notes: file.notes ?? [] });
    } catch (error) {
      if (!signal.aborted) this.#tell({ type: "failed", text: error.message });
    }
  }

  #tell(state) {
    this.#state = state;
    for (const page of this.#pages) page.postMessage(state);
  }

  add(page) {
    this.#pages.add(page);
    page.postMessage(this.#state);
  }

  remove(page) {
    this.#pages.delete(page);
  }

  /** What a page gets that asks for a range. */
  async answer({ id, version, start, end }) {
    try {
      if (version !== this.#version) throw Object.assign(new Error("the file has changed"), { code: "replaced" });
      return { type: "bytes", id, bytes: await this.#file.read(start, end) };
    } catch ({ code, message }) {
      return { type: "bytes", id, error: { code: code === "replaced" ? code : "network", message: `${nameOf(this.uri)}: ${message}` } };
    }
  }

  dispose() {
    clearTimeout(this.#timer);
    this.#watcher.dispose();
    this.#work?.abort();
    this.#file?.close();
  }
}

/** The page of an editor: that of `tetralod html`, with its script beside it. Its policy names what is in it and nothing else. */
async function pageOf(folder, title, script) {
  const [body, ...styles] = await Promise.all(["body.html", "page.css", "editor.css"].map((name) => readFile(join(folder, name), "utf8")));
  const nonce = randomBytes(16).toString("base64");
  const name = title.replace(/[&<"]/g, (character) => `&#${character.charCodeAt(0)};`);
  const policy = `default-src 'none'; script-src 'nonce-${nonce}' 'wasm-unsafe-eval'; worker-src blob:; style-src 'nonce-${nonce}'; img-src blob: data:`;
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="${policy}">
<title>${name}</title>
<style nonce="${nonce}">${styles.join("")}</style>
</head>
${body.replaceAll("{title}", () => name).replace("{poster}", "")}<script type="module" nonce="${nonce}" src="${script}"></script>
</html>
`;
}

/** @implements {vscode.CustomReadonlyEditorProvider<Volume>} */
class Provider {
  constructor(/** @type {vscode.Uri} */ extension) {
    this.folder = vscode.Uri.joinPath(extension, "page");
  }

  openCustomDocument(uri) {
    return new Volume(uri);
  }

  async resolveCustomEditor(/** @type {Volume} */ volume, panel) {
    const { webview } = panel;
    const hears = {
      ready: () => volume.add(webview),
      read: async (range) => webview.postMessage(await volume.answer(range)),
      save: async ({ name, bytes }) => {
        const place = await vscode.window.showSaveDialog({ defaultUri: vscode.Uri.joinPath(volume.uri, "..", name) });
        if (place) await vscode.workspace.fs.writeFile(place, bytes);
      },
    };
    webview.options = { enableScripts: true, localResourceRoots: [this.folder] };
    webview.onDidReceiveMessage((message) => hears[message.type](message));
    panel.onDidDispose(() => volume.remove(webview));
    const script = webview.asWebviewUri(vscode.Uri.joinPath(this.folder, "page.js"));
    webview.html = await pageOf(this.folder.fsPath, nameOf(volume.uri), script);
  }
}

exports.activate = ({ extensionUri, subscriptions }) => {
  // What a page shows, and from where, is not stored: it stays while it is hidden.
  const options = { supportsMultipleEditorsPerDocument: true, webviewOptions: { retainContextWhenHidden: true } };
  for (const type of ["tetralod.mt", "tetralod.mesh"]) {
    subscriptions.push(vscode.window.registerCustomEditorProvider(type, new Provider(extensionUri), options));
  }
};
