// One browser for the tests and the benchmark: Chromium with the flags that `webdriver.json` gives the wasm tests too, or Firefox.
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { chromium } from "playwright-core";
import puppeteer from "puppeteer-core";

/** How long a browser on a busy machine may take for anything (in ms). */
export const PATIENCE = 90_000;

const config = JSON.parse(await readFile(new URL("../../webdriver.json", import.meta.url), "utf8"));

/**
 * The browser that the variables CHROMIUM or FIREFOX name. Playwright drives Chromium only as it is; pages of Puppeteer, which
 * drives any Firefox, have the same `goto`, `evaluate` and `close`.
 *
 * @returns {Promise<any>}
 */
export async function launch() {
  const { FIREFOX } = process.env;
  // Where there is a display, it has WebGL.
  if (FIREFOX) return puppeteer.launch({ browser: "firefox", executablePath: FIREFOX, headless: process.env.DISPLAY === undefined });
  const executablePath = process.env.CHROMIUM;
  if (!executablePath) throw new Error("CHROMIUM is not set: run this through `cargo xtask`");
  // Playwright's own choice of headless mode and of features would contradict the flags.
  const ignoreDefaultArgs = ["--headless", "--headless=old", "--disable-gpu", "--hide-scrollbars"];
  const browser = await chromium.launch({ executablePath, args: config["goog:chromeOptions"].args, ignoreDefaultArgs });
  const newPage = browser.newPage.bind(browser);
  browser.newPage = async (options) => {
    const page = await newPage(options);
    // Software that draws a volume on a busy machine keeps everything else waiting.
    page.setDefaultTimeout(PATIENCE);
    return page;
  };
  return browser;
}

/** Run in a page: takes WebGPU from it. */
export const withoutWebGpu = () => Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined });

/** Run in a page: takes WebGPU and WebGL 2 from it. */
export function withoutGpu() {
  Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined });
  const { getContext } = OffscreenCanvas.prototype;
  OffscreenCanvas.prototype.getContext = /** @type {any} */ (
    function (kind, ...options) {
      return kind === "webgl2" ? null : getContext.call(this, kind, ...options);
    }
  );
}

/** The address that `cargo xtask` serves at. */
export function address() {
  const page = process.env.TETRALOD_PAGE;
  if (!page) throw new Error("TETRALOD_PAGE is not set: run this through `cargo xtask`");
  return page;
}

const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", wasm: "application/wasm" };

/**
 * Serves the package under `/pkg/`, the demo page's files, and by `answer` all that is neither.
 *
 * @param {(request: import("node:http").IncomingMessage, response: import("node:http").ServerResponse) => void} answer
 * @param {Record<string, string>} [headers] go along with every answer
 */
export async function servePackage(answer, headers = {}) {
  /** Names of the files of the package that were asked for. @type {string[]} */
  const asked = [];
  const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url ?? "/", "http://x");
    const [, inPackage] = /^\/pkg\/([\w.-]+)$/.exec(pathname) ?? [];
    const own = inPackage ? `../../pkg/${inPackage}` : `../../www${pathname}`;
    const content = /\.\w+$/.test(pathname) && (await readFile(new URL(own, import.meta.url)).catch(() => undefined));
    if (inPackage) asked.push(inPackage);
    for (const [name, value] of Object.entries(headers)) response.setHeader(name, value);
    if (!content) return answer(request, response);
    response.writeHead(200, { "content-type": TYPES[pathname.split(".").pop() ?? ""] ?? "text/plain" }).end(content);
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  const { port } = /** @type {import("node:net").AddressInfo} */ (server.address());
  const close = () => {
    server.closeAllConnections();
    server.close();
  };
  return { address: `http://127.0.0.1:${port}/`, asked, close };
}
