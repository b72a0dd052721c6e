// A stand-in for VS Code: what the extension calls of it, on this machine, without windows.
import { execFileSync } from "node:child_process";
import { mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, posix } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { unzipSync } from "fflate";

class Uri {
  constructor(scheme, path) {
    this.scheme = scheme;
    this.path = path;
  }
  static file(path) {
    return new Uri("file", path);
  }
  static joinPath({ scheme, path }, ...parts) {
    return new Uri(scheme, posix.join(path, ...parts));
  }
  get fsPath() {
    return this.path;
  }
  toString() {
    return `${this.scheme}://${encodeURI(this.path)}`;
  }
}

/** Calls what has been added to it. */
function event() {
  const listeners = new Set();
  const add = (listener) => {
    listeners.add(listener);
    return { dispose: () => listeners.delete(listener) };
  };
  return { add, fire: (value) => Promise.all([...listeners].map((listener) => listener(value))), listeners };
}

/**
 * VS Code with the packed extension in it.
 *
 * @param {URL} folder where the extension is unpacked
 */
export async function start(folder) {
  await rm(folder, { recursive: true, force: true });
  const archive = fileURLToPath(new URL("tetralod.vsix", folder));
  const root = new URL("../../", import.meta.url);
  execFileSync("node", [fileURLToPath(new URL("xtask/js/vscode.mjs", root)), fileURLToPath(new URL("pkg", root)), archive], { stdio: "inherit" });
  const packed = unzipSync(await readFile(archive));
  for (const [name, bytes] of Object.entries(packed)) {
    const path = fileURLToPath(new URL(encodeURI(name), folder));
    await mkdir(dirname(path), { recursive: true });
    await writeFile(path, bytes);
  }

  const [providers, settings, memory, changed, saved] = [new Map(), new Map(), new Map(), event(), new Map()];
  const vscode = {
    Uri,
    RelativePattern: class {
      constructor(base, pattern) {
        Object.assign(this, { base, pattern });
      }
    },
    workspace: {
      fs: {
        stat: async ({ path }) => ({ size: memory.get(path).length }),
        readFile: async ({ path }) => memory.get(path),
        writeFile: async (uri, bytes) => void saved.set(uri.toString(), bytes),
      },
      createFileSystemWatcher({ base, pattern }) {
        if (pattern !== "*") throw new Error(`a pattern that this stand-in does not know: ${pattern}`);
        const own = [];
        const watch = (listener) => {
          own.push(changed.add((uri) => posix.dirname(uri.path) === base.path && listener(uri)));
          return own.at(-1);
        };
        return { onDidChange: watch, onDidCreate: watch, dispose: () => own.forEach((one) => one.dispose()) };
      },
      getConfiguration: (section) => ({ get: (name) => settings.get(`${section}.${name}`) }),
    },
    window: {
      registerCustomEditorProvider(type, provider) {
        providers.set(type, provider);
        return { dispose: () => providers.delete(type) };
      },
      showSaveDialog: async ({ defaultUri }) => defaultUri,
    },
  };
  Object.assign(globalThis, { tetralodTestVscode: vscode });
  const module = new URL("node_modules/vscode/index.js", folder);
  await mkdir(new URL(".", module), { recursive: true });
  await writeFile(module, "module.exports = globalThis.tetralodTestVscode;\n");

  const extensionPath = fileURLToPath(new URL("extension", folder));
  const manifest = JSON.parse(await readFile(`${extensionPath}/package.json`, "utf8"));
  const subscriptions = [];
  createRequire(pathToFileURL(`${extensionPath}/`))(extensionPath).activate({ extensionUri: Uri.file(extensionPath), subscriptions });

  /** Opens an editor; `asWebviewUri` says where pages find files. */
  async function open(uri, type = "tetralod.mt", asWebviewUri = (file) => file.toString()) {
    const document = await providers.get(type).openCustomDocument(uri, {}, undefined);
    const shown = await view(document, type, asWebviewUri);
    const close = () => {
      shown.hide();
      document.dispose();
    };
    return { ...shown, close, another: () => view(document, type, asWebviewUri) };
  }

  /** Shows a document in one more editor. */
  async function view(document, type, asWebviewUri) {
    const [heard, told, disposed] = [event(), event(), event()];
    /** What the page was told. */
    const messages = [];
    told.add((message) => messages.push(message));
    const webview = {
      html: "",
      options: {},
      asWebviewUri,
      onDidReceiveMessage: heard.add,
      // As VS Code does: a part of a buffer takes the whole one along.
      postMessage: async (message) => void told.fire(structuredClone(message)),
    };
    await providers.get(type).resolveCustomEditor(document, { webview, onDidDispose: disposed.add });
    /** The first message that passes, of those that have come and will come. */
    const message = (passes) =>
      new Promise((resolve) => {
        const look = (found) => {
          if (passes(found)) [resolve(found), watching.dispose()];
        };
        const watching = told.add(look);
        messages.some(look);
      });
    const send = (/** @type {any} */ sent) => void heard.fire(structuredClone(sent));
    return { webview, messages, message, told: told.add, send, hide: () => void disposed.fire(undefined) };
  }
  return { folder, manifest, providers, settings, memory, saved, changed, subscriptions, Uri, open };
}
