// Promise: the site of `cargo xtask docs` is complete, its links lead somewhere, and it needs no server and no network.
import assert from "node:assert/strict";
import { mkdir, readdir, readFile, stat } from "node:fs/promises";
import { dirname, join, relative } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { launch } from "./browser.js";

const root = fileURLToPath(new URL("../../", import.meta.url));
const site = join(root, "target/docs");
const pictures = join(root, "target/docs-pictures");

/** @type {Map<string, string>} The text of each page of the site. */
const pages = new Map();
/** @type {import("playwright-core").Browser} */
let browser;

before(async () => {
  for (const entry of await readdir(site, { recursive: true })) {
    if (entry.endsWith(".html")) pages.set(entry, await readFile(join(site, entry), "utf8"));
  }
  await mkdir(pictures, { recursive: true });
  browser = await launch();
});

after(() => browser?.close());

const values = (html, attribute) => [...html.matchAll(new RegExp(`\\s${attribute}="([^"]*)"`, "g"))].map(([, value]) => value.replaceAll("&amp;", "&"));

test("every link leads to a file of the site and to an anchor in it", async () => {
  assert.ok(pages.size > 50, `there are ${pages.size} pages`);
  const anchors = new Map([...pages].map(([name, html]) => [name, new Set(values(html, "id"))]));
  const broken = [];
  for (const [name, html] of pages) {
    for (const link of [...values(html, "href"), ...values(html, "src")]) {
      if (/^(https?|mailto|data):/.test(link)) continue;
      const [path, anchor] = link.split("#");
      const target = path === "" ? name : relative(site, join(site, dirname(name), decodeURI(path)));
      const found = path === "" || (await stat(join(site, target)).catch(() => undefined))?.isFile();
      const known = anchors.get(target);
      // The script of TypeDoc adds the icons.
      const there = !anchor || !known || known.has(decodeURIComponent(anchor)) || anchor.startsWith("icon-");
      if (!found || !there) broken.push(`${name}: ${link}`);
    }
  }
  assert.deepEqual(broken, []);
});

test("every page of docs/ and every entry of the package is in the site", async () => {
  const listed = Object.values(JSON.parse(await readFile(join(root, "docs/site/pages.json"), "utf8"))).flat();
  for (const folder of ["docs", "docs/howto"]) {
    for (const name of await readdir(join(root, folder))) {
      const page = `${folder}/${name}`;
      if (name.endsWith(".md") && page !== "docs/README.md") assert.ok(listed.includes(page), `docs/site/pages.json does not list ${page}`);
    }
  }
  const { exports } = JSON.parse(await readFile(join(root, "pkg/package.json"), "utf8"));
  for (const [entry, { types }] of Object.entries(exports)) {
    const page = `modules/${entry.replace(".", "tetralod").replaceAll("/", "_")}.html`;
    if (types && types !== "./worker.d.ts") assert.ok(pages.has(page), `${page} is missing`);
  }
});

test("nothing is fetched from elsewhere, no page is wider than a phone, and none complains, without a server", async () => {
  for (const [colorScheme, width] of /** @type {const} */ ([
    ["light", 1280],
    ["dark", 390],
  ])) {
    const context = await browser.newContext({ colorScheme, viewport: { width, height: 900 } });
    const page = await context.newPage();
    const complaints = [];
    page.on("pageerror", (error) => complaints.push(`${page.url()}: ${error}`));
    page.on("request", (request) => /^https?:/.test(request.url()) && complaints.push(`${page.url()} asks for ${request.url()}`));
    // The pages of the docs, and the longest of the reference.
    const looked = [...pages.keys()].filter((name) => !/^(interfaces|types|functions|variables|classes)\/(?!.*\.Viewer\.)/.test(name));
    for (const name of looked) {
      await page.goto(pathToFileURL(join(site, name)).href);
      await page.waitForFunction(() => document.querySelector("#tsd-nav-container li"));
      const excess = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      if (excess > 0) complaints.push(`${name} is ${excess} pixels too wide at ${width}`);
      if (["index.html", "howto/my-data.html", "gallery.html", "benchmarks.html", "classes/tetralod_viewer.Viewer.html"].includes(name)) {
        await page.screenshot({ path: join(pictures, `site-${name.replace(/\W/g, "-")}-${colorScheme}-${width}.png`) });
      }
    }
    assert.deepEqual(complaints, []);
    await context.close();
  }
});

test("the search finds calls of the API and words of the pages", async () => {
  const page = await browser.newPage();
  await page.goto(pathToFileURL(join(site, "index.html")).href);
  await page.locator("#tsd-search-trigger").click();
  for (const [words, wanted] of [
    ["isosurface", "isosurface"],
    ["nginx", "Hosting"],
  ]) {
    await page.locator("#tsd-search-input").fill(words);
    await page.locator("#tsd-search-results li").first().waitFor();
    await page.waitForFunction((text) => document.querySelector("#tsd-search-results").textContent.includes(text), wanted, { timeout: 10_000 });
  }
  await page.close();
});
