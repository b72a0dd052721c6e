// Promise: every block of code in README.md and the pages of `docs/` is run or checked by a test, or the page says why not.
//
// In each page, in a folder of its own: blocks with a name (```html view.html) are written to files, the commands are run, the
// scripts for Node (.mjs) are run as they stand, and the pages (.html) are opened in Chromium, from `tetralod serve`, and must
// show something. What the commands print is compared in cli/tests/command/readme.rs.
import assert from "node:assert/strict";
import { execFile, spawn } from "node:child_process";
import { chmod, mkdir, mkdtemp, readdir, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { launch } from "./browser.js";

const run = promisify(execFile);
const root = fileURLToPath(new URL("../../", import.meta.url));
const pictures = join(root, "target/docs-pictures");
const tetralod = process.env.TETRALOD;
assert.ok(tetralod, "TETRALOD is not set: run `cargo xtask test pages`");

/** How long a page may take until it shows something (in ms). */
const PATIENCE = 90_000;

/** The part of a picture that the model covers at least; the lines of the box around it are a hundredth. */
const SHOWN = 0.025;

/** Languages whose blocks are run or checked here, or are files that the page's commands read, if they have a name. */
const NAMED = ["html", "js", "json", "nginx", "text", "xml", "yaml"];

/**
 * Blocks without a name: who runs them, or why nobody does.
 *
 * @type {Record<string, string[]>}
 */
const ELSEWHERE = {
  "README.md": [
    "html: e2e.test.js",
    "js: parts.test.js",
    "rust: a documentation test of the crate",
    "python: python/tests/test_pages.py",
    "sh: the commands that run all tests and make wheels; `release` of xtask compiles the command with the page, cli/tests/command/view.rs views; containers need an engine, `release` lints what builds them",
  ],
  "docs/README.md": ["sh: cli/tests/command/view.rs views"],
  "docs/benchmarks.md": ["text: a plot that `cargo xtask bench --parts` makes"],
  "docs/command.md": ["sh: `release` of xtask compiles the command with the page; cli/tests/command/html.rs makes pages"],
  "docs/csp-and-cors.md": ["text: headers"],
  "docs/format.md": ["text: not a program"],
  "docs/hosting.md": ["sh: needs an account of S3; cli/tests/command/shards.rs writes shards"],
  "docs/howto/cluster.md": [
    "sh: needs a cluster; `cargo xtask test workflows` runs Snakemake and the script for Slurm here, cli/tests/command/work.rs workers",
    "dockerfile: needs a registry",
  ],
  "docs/howto/deformed.md": ["sh: the commands of movies.md are run"],
  "docs/howto/in-situ.md": [
    "c: cli/tests/command/in_situ.rs compiles the example",
    "python: python/tests/test_part.py runs the example",
    "sh: cli/tests/command/in_situ.rs",
  ],
  "docs/howto/movies.md": ["sh: needs ffmpeg"],
  "docs/howto/notebooks.md": ["python: needs NumPy and PyVista"],
  "docs/howto/one-file.md": ["sh: cli/tests/command/html.rs and html-browser.test.js make such pages; the command here is without the viewer"],
  "docs/howto/python.md": ["python: python/tests/test_pages.py"],
  "docs/input.md": ["sh: cli/tests/command/parts.rs builds decompositions"],
};

/** Pages that open without a volume: their test is below. */
const WITHOUT_PICTURE = ["open-file.html"];

async function pages() {
  const found = ["README.md"];
  for (const folder of ["docs", "docs/howto"]) {
    const names = await readdir(join(root, folder));
    found.push(...names.filter((name) => name.endsWith(".md")).map((name) => `${folder}/${name}`));
  }
  return found.sort();
}

/** The blocks of a page: `language`, `name` if it has one, and `code`. */
async function blocks(page) {
  const text = await readFile(join(root, page), "utf8");
  const fences = text.matchAll(/^```([\w-]*)(?: (\S+))?\n([\s\S]*?)^```$/gm);
  return [...fences].map(([, language, name, code]) => ({ language, name, code }));
}

/** @type {import("playwright-core").Browser} */
let browser;
/** A page to look at pictures in: the policies of others forbid that. @type {import("playwright-core").Page} */
let study;

before(async () => {
  await mkdir(pictures, { recursive: true });
  browser = await launch();
  study = await browser.newPage();
});

after(() => browser?.close());

/** Arguments of a command line, which may be in single quotes. */
const words = (line) => line.split("'").flatMap((part, i) => (i % 2 ? [part] : part.split(/\s+/).filter(Boolean)));

/** Writes the files of a page to a new folder, and runs its commands there. */
async function prepare(page) {
  const folder = await mkdtemp(join(tmpdir(), "tetralod-docs-"));
  for (const { language, name, code } of await blocks(page)) {
    if (name) {
      await mkdir(dirname(join(folder, name)), { recursive: true });
      await writeFile(join(folder, name), code);
    }
    if (language !== "console") continue;
    for (const [, line] of code.matchAll(/^\$ tetralod (.*)$/gm)) {
      // Smaller data will do.
      await run(tetralod, words(line.replace("--size 33", "--size 17")), { cwd: folder });
    }
  }
  await mkdir(join(folder, "node_modules"));
  await symlink(join(root, "pkg"), join(folder, "node_modules/tetralod"));
  return folder;
}

/** Starts `tetralod serve` in a folder, with the package and three.js where the pages look for them. */
async function serve(folder) {
  const mounts = [`/pkg=${join(root, "pkg")}`, `/node_modules=${join(root, "docs/site/node_modules")}`];
  const args = ["serve", folder, "--port", "0", ...mounts.flatMap((mount) => ["--mount", mount])];
  const server = spawn(tetralod, args, { stdio: ["ignore", "pipe", "ignore"] });
  const address = await new Promise((resolve, reject) => {
    server.on("exit", (code) => reject(new Error(`tetralod serve ended with ${code}`)));
    server.stdout.on("data", (text) => {
      const [found] = /http:\/\/[\w.:]+\//.exec(String(text)) ?? [];
      if (found) resolve(found);
    });
  });
  return { address, stop: () => server.kill() };
}

/** The part of a canvas that differs from its left edge: backgrounds go from top to bottom. */
async function covered(page) {
  const png = (await page.locator("canvas").first().screenshot()).toString("base64");
  return study.evaluate(async (base64) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    let differing = 0;
    for (let i = 0; i < data.length; i += 4) {
      const left = i - (i % (4 * bitmap.width));
      differing += [0, 1, 2].some((k) => Math.abs(data[i + k] - data[left + k]) > 24) ? 1 : 0;
    }
    return (4 * differing) / data.length;
  }, png);
}

/** Calls `then` with a folder that has the files of a page, and the address of a server of it, for as long as that takes. */
async function served(page, then) {
  const folder = await prepare(page);
  const { address, stop } = await serve(folder);
  try {
    await then({ folder, address });
  } finally {
    stop();
    await rm(folder, { recursive: true });
  }
}

/** Opens a page, collects its complaints, and calls `then` when it has been loaded. */
async function visit(address, then, options = {}) {
  const context = await browser.newContext({ viewport: { width: 700, height: 600 }, ...options });
  const page = await context.newPage();
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  // Browsers ask for an icon by themselves.
  page.on("console", (message) => {
    if (message.type() === "error" && !message.location().url.endsWith("/favicon.ico")) complaints.push(message.text());
  });
  try {
    await page.goto(address);
    await then(page, complaints);
    assert.deepEqual(complaints, []);
  } finally {
    await context.close();
  }
}

/** Waits until the canvas of a page shows something. */
async function drawn(page, complaints, name) {
  const end = Date.now() + PATIENCE;
  let share = 0;
  while (share < SHOWN && Date.now() < end && complaints.length === 0) {
    await page.waitForTimeout(300);
    share = await covered(page);
  }
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(pictures, `${name}.png`) });
  assert.deepEqual(complaints, [], name);
  assert.ok(share >= SHOWN, `${name} shows nothing: ${await page.locator("body").innerText()}`);
}

for (const page of await pages()) {
  const found = await blocks(page);
  const runnable = found.filter(({ language, name }) => language === "html" || /\.mjs$/.test(name ?? ""));
  if (page === "README.md" || runnable.length === 0) continue;
  test(`the examples of ${page} work`, async (t) => {
    await served(page, async ({ folder, address }) => {
      for (const { name, code } of runnable) {
        await t.test(name, async () => {
          if (name.endsWith(".mjs")) {
            // As a module of a site whose files are on a server.
            await writeFile(join(folder, name), code.replaceAll("import.meta.url", JSON.stringify(address)));
            const { stdout, stderr } = await run("node", [name], { cwd: folder, timeout: PATIENCE });
            assert.equal(stderr, "");
            assert.ok(stdout.trim().length > 0 && !/undefined|NaN/.test(stdout), stdout);
          } else if (!WITHOUT_PICTURE.includes(name)) {
            await visit(address + name, (opened, complaints) => drawn(opened, complaints, name));
          }
        });
      }
    });
  });
}

test("a file that the reader chooses is opened", () =>
  served("docs/howto/my-data.md", async ({ folder, address }) => {
    await visit(`${address}open-file.html`, async (page) => {
      await page.locator("input").setInputFiles(join(folder, "flow.mt"));
      await page.waitForFunction(() => /^\d+ of \d+ tetrahedra/.test(document.querySelector("pre").textContent), undefined, { timeout: PATIENCE });
    });
  }));

test("the page for a strict Content-Security-Policy also works where every file has that policy, and says so where it is stricter", () =>
  served("docs/csp-and-cors.md", async ({ folder, address }) => {
    const page = await readFile(join(folder, "csp.html"), "utf8");
    const [, policy] = /Content-Security-Policy" content="([^"]*)"/.exec(page);
    const withPolicy = (policy) => async (opened) => {
      await opened.route("**/*", async (route) => {
        const response = await route.fetch();
        await route.fulfill({ response, headers: { ...response.headers(), "content-security-policy": policy } });
      });
    };
    await visit("about:blank", async (opened, complaints) => {
      await withPolicy(policy)(opened);
      await opened.goto(`${address}csp.html`);
      await drawn(opened, complaints, "csp-header");
    });
    const context = await browser.newContext();
    const refused = await context.newPage();
    const errors = [];
    refused.on("pageerror", (error) => errors.push(String(error)));
    await withPolicy(policy.replace(" 'wasm-unsafe-eval'", ""))(refused);
    await refused.goto(`${address}csp.html`);
    for (let i = 0; i < 100 && errors.length === 0; i++) await refused.waitForTimeout(100);
    assert.match(errors.join(), /wasm/i);
    await context.close();
  }));

test("every block is run or checked, or the reason is known", async () => {
  for (const page of await pages()) {
    const known = ELSEWHERE[page] ?? [];
    for (const { language, name, code } of await blocks(page)) {
      const told = language === "console" || (name ? NAMED.includes(language) : known.some((reason) => reason.startsWith(`${language}: `)));
      assert.ok(told, `${page} has a block of ${language || "no language"} that nothing runs:\n${code}`);
      if (language === "js" && name) assert.ok(name.endsWith(".mjs") || (await readFile(join(root, page), "utf8")).includes(`src="${name}"`), name);
    }
  }
});

test("JSON and YAML can be read", async () => {
  const yaml = createRequire(join(root, "docs/site/package.json"))("yaml");
  for (const page of await pages()) {
    for (const { language, code } of await blocks(page)) {
      if (language === "json") JSON.parse(code);
      if (language === "yaml") assert.ok(yaml.parse(code, { strict: true }).jobs);
    }
  }
});

test("the configuration of nginx does what the page says", async () => {
  const nginx = process.env.NGINX;
  assert.ok(nginx, "NGINX is not set: run `cargo xtask test pages`");
  const [{ code }] = (await blocks("docs/hosting.md")).filter(({ language }) => language === "nginx");
  const folder = await mkdtemp(join(tmpdir(), "tetralod-nginx-"));
  await chmod(folder, 0o755);
  const port = 20_000 + (process.pid % 20_000);
  const server = code.replace("listen 8080", `listen 127.0.0.1:${port}`).replace("root /var/www/tetralod", `root ${folder}`);
  const paths = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"].map((name) => `${name}_temp_path ${folder}/temp;`).join("\n");
  const types = "types { text/html html; text/javascript js; application/wasm wasm; }\ndefault_type application/octet-stream;";
  await writeFile(
    join(folder, "nginx.conf"),
    `
    daemon off; pid ${folder}/pid; error_log stderr; events {}
    http { access_log off; ${paths}\n${types}\n${server} }`,
  );
  const bytes = new Uint8Array(5000);
  await writeFile(join(folder, "a.mt"), bytes);
  await writeFile(join(folder, "a.wasm"), bytes);
  const started = spawn(nginx, ["-c", join(folder, "nginx.conf"), "-p", folder], { stdio: "inherit" });
  try {
    const get = (name, headers = {}) => fetch(`http://127.0.0.1:${port}/${name}`, { headers: { "accept-encoding": "gzip", ...headers } });
    for (let i = 0; i < 50 && !(await get("a.mt").catch(() => undefined)); i++) await new Promise((resolve) => setTimeout(resolve, 100));
    const part = await get("a.mt", { range: "bytes=10-19" });
    assert.equal(part.status, 206);
    assert.equal((await part.arrayBuffer()).byteLength, 10);
    assert.equal(part.headers.get("access-control-allow-origin"), "*");
    assert.match(part.headers.get("access-control-expose-headers"), /Content-Range, ETag/);
    assert.match(part.headers.get("etag"), /^"/);
    assert.equal((await get("a.mt")).headers.get("content-encoding"), null);
    const wasm = await get("a.wasm");
    assert.equal(wasm.headers.get("content-encoding"), "gzip");
    assert.equal(wasm.headers.get("content-type"), "application/wasm");
    assert.equal((await get("none.mt")).status, 404);
  } finally {
    started.kill();
    await rm(folder, { recursive: true });
  }
});
