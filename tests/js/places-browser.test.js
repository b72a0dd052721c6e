// Where the package is served from, in a real browser: under a strict Content-Security-Policy, from another origin, from addresses
// that the page names; and what is said where that cannot work.
import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { launch, servePackage } from "./browser.js";

const folder = process.env.TETRALOD_FIXTURE;
assert.ok(folder, "TETRALOD_FIXTURE is not set: run `cargo xtask test e2e`");
const file = await readFile(`${folder}/small.mt`);
const [{ options, hash }] = JSON.parse(await readFile(`${folder}/hashes.json`, "utf8"));

/** The policies of the package's README, and one that forbids everything that the package needs. */
const README = await readFile(new URL("../../pkg-template/README.md", import.meta.url), "utf8");
const [strict, cdn] = [...README.matchAll(/^Content-Security-Policy: (.*)$/gm)].map(([, policy]) => policy);
assert.ok(strict && cdn, "the README has two policies");

const PAGE = `<!doctype html><canvas width="200" height="150"></canvas>`;

/** What a page does, in modules of its own: inline scripts are forbidden. */
const core = (path) => `
    import { MultiTessellation } from "${path}";
    export async function run(options) {
      const mt = await MultiTessellation.open("/model.mt", { whole: true, ...options });
      await mt.complete;
      await mt.refine(${JSON.stringify(options)});
      const view = await mt.view();
      await view.complete;
      await view.refine(${JSON.stringify(options)});
      const hashes = [await mt.hash(), await view.hash()];
      mt.free();
      return hashes[0] === hashes[1] ? hashes[0] : hashes.join(", ");
    }`;
const MODULES = {
  "core.js": (from) => core(`${from}index.js`),
  "inline.js": (from) => core(`${from}inline.js`),
  "viewer.js": (from) => `
    import { Viewer } from "${from}viewer.js";
    export async function run(options) {
      const viewer = await Viewer.create(document.querySelector("canvas"), options);
      await viewer.open("/model.mt", { whole: true });
      await viewer.refine(${JSON.stringify(options)});
      return viewer.hash();
    }`,
};

let browser;
/** Servers, by name. */
const servers = {};

/** A page that is one file, with the package, its worker, its wasm module and the volume in it. */
async function singleFile() {
  const { outputFiles } = await build({
    stdin: {
      contents: `
        import { MultiTessellation } from "./inline.js";
        const bytes = Uint8Array.from(atob("${file.toString("base64")}"), (c) => c.charCodeAt(0));
        window.run = async (how) => {
          const mt = await MultiTessellation.open(bytes, how);
          await mt.complete;
          await mt.refine(${JSON.stringify(options)});
          return mt.hash();
        };`,
      resolveDir: fileURLToPath(new URL("../../pkg", import.meta.url)),
    },
    bundle: true,
    format: "iife",
    write: false,
  });
  return outputFiles[0].text;
}

/** A server with the page, and modules that import the package from `from`. */
async function serve(headers, from = () => "/pkg/") {
  return servePackage(async ({ url }, response) => {
    const name = url.split("/").pop();
    if (url === "/model.mt") return response.end(file);
    if (MODULES[name]) return response.setHeader("content-type", "text/javascript").end(MODULES[name](from()));
    if (url === "/") return response.setHeader("content-type", "text/html").end(PAGE);
    if (url === "/broken.js") return response.setHeader("content-type", "text/javascript").end("throw new Error('broken')");
    if (url === "/silent.js") return response.setHeader("content-type", "text/javascript").end("onmessage = () => {};");
    if (url.startsWith("/page")) return response.setHeader("content-type", "text/html").end(PAGE);
    return response.writeHead(404).end();
  }, headers);
}

before(async () => {
  servers.open = await serve({});
  servers.cdn = await serve({ "access-control-allow-origin": "*" });
  servers.closed = await serve({});
  servers.strict = await serve({ "content-security-policy": strict });
  const { origin } = new URL(servers.cdn.address);
  const places = { "https://cdn.example": origin };
  const policy = cdn.replaceAll(/https:\/\/[\w.]+/g, (place) => places[place] ?? assert.fail(place));
  servers.foreign = await serve({ "content-security-policy": policy }, () => `${origin}/pkg/`);
  const without = (name) =>
    strict
      .split("; ")
      .filter((directive) => !directive.startsWith(name))
      .join("; ");
  servers.noWorker = await serve({ "content-security-policy": `${without("worker-src")}; worker-src 'none'` });
  servers.noWasm = await serve({ "content-security-policy": strict.replace(" 'wasm-unsafe-eval'", "") });
  servers.inline = await serve({ "content-security-policy": strict.replace("worker-src 'self'", "worker-src 'self' blob:") });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  for (const server of Object.values(servers)) server.close();
});

/** What `run` of a module gives on a page, or the code and message of its error; and what the browser complains of. */
async function run(server, module, how = {}) {
  const page = await browser.newPage();
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  await page.goto(servers[server].address);
  const found = await page.evaluate(
    async ({ module, how }) => {
      const { run } = await import(`/${module}`);
      return run(how).catch(({ code, message }) => ({ code, message }));
    },
    { module, how },
  );
  await page.close();
  return { found, complaints };
}

for (const module of ["core.js", "viewer.js"]) {
  const own = (server) => servers[server].address.slice(0, -1);

  test(`${module}: the strict policy of the README is enough`, async () => {
    assert.deepEqual(await run("strict", module), { found: hash, complaints: [] });
  });

  test(`${module}: from another origin, the policy of the README for that is enough`, async () => {
    assert.deepEqual(await run("foreign", module), { found: hash, complaints: [] });
  });

  test(`${module}: worker and wasm come from where the page says`, async () => {
    const [name, script] = module === "core.js" ? ["core", "worker.js"] : ["viewer", "viewer-worker.js"];
    const before = servers.cdn.asked.length;
    const { found } = await run("open", module, {
      workerUrl: `${own("cdn")}/pkg/${script}`,
      wasmUrl: `/pkg/tetralod_${name}_bg.wasm`,
    });
    assert.equal(found, hash);
    const asked = servers.cdn.asked.slice(before);
    assert.ok(asked.includes(script) && !asked.some((name) => name.endsWith(".wasm")), asked.join(", "));
  });

  test(`${module}: what cannot work is an error of configuration with a reason and a remedy`, async () => {
    const open = async (server, how, code, message) => {
      const { found } = await run(server, module, how);
      assert.equal(found.code, code, JSON.stringify(found));
      assert.match(found.message, message);
    };
    await open("open", { workerUrl: "/none.js" }, "worker", /\/none\.js answers HTTP 404.*Set `workerUrl`/);
    await open("open", { workerUrl: "/page.html" }, "worker", /\/page\.html is served as text\/html/);
    await open("open", { workerUrl: "/broken.js" }, "worker", /broken/);
    const silent = { workerUrl: "/silent.js", workerTimeoutMs: 500 };
    await open("open", silent, "worker", /\/silent\.js; it has not answered within 0\.5 s.*Set `workerUrl`/);
    await open("open", { workerUrl: `${own("closed")}/pkg/worker.js` }, "worker", /cannot be fetched/);
    await open("open", { wasmUrl: "/none.wasm" }, "wasm", /\/none\.wasm: HTTP 404.*`wasmUrl`/);
    await open("open", { wasmUrl: "/page.wasm" }, "wasm", /page\.wasm: the server sends a page/);
    await open("noWorker", {}, "worker", /Content-Security-Policy.*worker-src/);
    await open("noWasm", {}, "wasm", /'wasm-unsafe-eval' in script-src/);
    const other = module === "core.js" ? "viewer-worker.js" : "worker.js";
    await open("open", { workerUrl: `/pkg/${other}` }, "worker", /must lead to the same version/);
  });
}

test("inline.js: its worker is a blob, which the policy must allow", async () => {
  assert.deepEqual(await run("inline", "inline.js"), { found: hash, complaints: [] });
  const { found } = await run("strict", "inline.js");
  assert.equal(found.code, "worker", JSON.stringify(found));
  assert.match(found.message, /allow blob: in worker-src/);
  assert.equal((await run("strict", "inline.js", { workerUrl: "/pkg/worker.js" })).found, hash);
});

test("the inline entry works in a page that is one file, from file:", async () => {
  const folder = new URL("../../target/e2e/", import.meta.url);
  await mkdir(folder, { recursive: true });
  const path = new URL("single.html", folder);
  const script = (await singleFile()).replaceAll("</script", "<\\/script");
  await writeFile(path, `<!doctype html><meta charset="utf-8"><script>${script}</script>`);
  const page = await browser.newPage();
  await page.goto(path.href);
  for (const how of [{}, { worker: false }]) {
    assert.equal(await page.evaluate((how) => /** @type {any} */ (window).run(how), how), hash);
  }
  await page.close();
});
