// Shows the same volumes with tetralod and with VTK's programs for browsers, and prints what that costs as a page for docs/:
// started by `cargo xtask bench --beside-vtk`. Memory is read from /proc, so this needs Linux.
import { execFileSync } from "node:child_process";
import { mkdir, readdir, readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { cpus, loadavg } from "node:os";
import { extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";
import { launch } from "../../tests/js/browser.js";

const root = fileURLToPath(new URL("../../", import.meta.url));
const here = "benches/beside_vtk";
const RUNS = 3;
const TURNS = 20;
const WARM = 5;
/** The network that is imitated: bytes a second, and ms until an answer begins. */
const LINK = { rate: 2_500_000, delay: 40 };

const SCENES = [
  {
    title: "An isosurface of a grid of 65³ points, 1,572,864 tetrahedra",
    tools: [
      { name: "vtk.js", page: `${here}/vtkjs.html`, file: "bucky.vti" },
      { name: "VTK.wasm", page: `${here}/vtkwasm.html`, file: "bucky.vti" },
      { name: "tetralod, within 1 %", page: `${here}/tetralod.html?isosurface`, file: "bucky.mt" },
      { name: "tetralod with WebGL 2", page: `${here}/tetralod.html?isosurface&renderer=webgl`, file: "bucky.mt" },
    ],
  },
  {
    title: "The boundary of 1,072,476 tetrahedra, coloured by a field",
    tools: [
      { name: "F3D (VTK in WebAssembly)", page: `${here}/f3d.html`, file: "flow.vtu" },
      { name: "tetralod, within 1 %", page: `${here}/tetralod.html?boundary`, file: "flow.mt" },
      { name: "tetralod with WebGL 2", page: `${here}/tetralod.html?boundary&renderer=webgl`, file: "flow.mt" },
    ],
  },
];

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript", ".wasm": "application/wasm" };
/** The rows of a table, with the line below its head. */
const ROWS = [
  "", "---", "program, MB", "file, MB", "fetched, MB", "first picture, s", "within 5 %, s", "full picture, s",
  "first picture at 20 Mbit/s, s", "within 5 % at 20 Mbit/s, s", "full picture at 20 Mbit/s, s", "memory, MB", "frame, ms",
  "its pixels, %", "frame with everything, ms",
];
const compressed = new Map();

async function content(path) {
  const name = path.replace(`/${here}/data/`, "/target/beside-vtk/").replace(`/${here}/pkg/`, "/pkg/");
  const bytes = await readFile(join(root, name)).catch(() => undefined);
  if (!bytes || !TYPES[extname(name)]) return { bytes };
  if (!compressed.has(name)) compressed.set(name, gzipSync(bytes, { level: 9 }));
  return { bytes: compressed.get(name), encoding: "gzip" };
}

/** A static server with byte ranges that compresses programs; `sent` counts their bytes and those of data. */
async function serve(link) {
  const sent = { programs: 0, data: 0 };
  let free = 0;
  const server = createServer(async (request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://x").pathname);
    const { bytes, encoding } = await content(path);
    if (!bytes) return response.writeHead(404).end();
    const headers = { "content-type": TYPES[extname(path)] ?? "application/octet-stream", etag: '"1"', "cache-control": "no-store" };
    const [, first, last] = (!encoding && /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "")) || [];
    const [begin, end] = first === undefined ? [0, bytes.length] : [Number(first), Math.min(last ? Number(last) + 1 : Infinity, bytes.length)];
    if (encoding) headers["content-encoding"] = encoding;
    if (first !== undefined) headers["content-range"] = `bytes ${begin}-${end - 1}/${bytes.length}`;
    if (link) await new Promise((resolve) => setTimeout(resolve, link.delay));
    response.writeHead(first === undefined ? 200 : 206, { ...headers, "content-length": end - begin });
    let closed = false;
    response.on("close", () => (closed = true));
    for (let at = begin; at < end && !closed; at += 16384) {
      const piece = bytes.subarray(at, Math.min(at + 16384, end));
      if (link) {
        free = Math.max(free, performance.now()) + (1000 * piece.length) / link.rate;
        const wait = free - performance.now();
        if (wait > 1) await new Promise((resolve) => setTimeout(resolve, wait));
      }
      sent[encoding ? "programs" : "data"] += piece.length;
      response.write(piece);
    }
    response.end();
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const close = () => {
    server.closeAllConnections();
    server.close();
  };
  return { address: `http://127.0.0.1:${server.address().port}/`, sent, close };
}

/** Bytes of memory of all processes that this one has started. */
async function memory() {
  const parents = new Map();
  for (const pid of (await readdir("/proc")).filter((name) => /^\d+$/.test(name))) {
    const stat = await readFile(`/proc/${pid}/stat`, "utf8").catch(() => "");
    parents.set(pid, stat.slice(stat.lastIndexOf(")")).split(" ")[2]);
  }
  const isOurs = (pid) => pid !== undefined && (pid === String(process.pid) || isOurs(parents.get(pid)));
  let sum = 0;
  for (const pid of parents.keys()) {
    if (pid === String(process.pid) || !isOurs(pid)) continue;
    const rollup = await readFile(`/proc/${pid}/smaps_rollup`, "utf8").catch(() => "");
    sum += 1024 * Number(/^Pss:\s+(\d+)/m.exec(rollup)?.[1] ?? 0);
  }
  return sum;
}

/** One visit of a page in a new browser. */
async function visit(tool, link) {
  const server = await serve(link);
  const browser = await launch();
  try {
    const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
    page.on("pageerror", (error) => console.error(tool.name, error));
    await page.goto("about:blank");
    const [empty, blank] = [await memory(), await page.screenshot()];
    await page.goto(server.address + tool.page);
    await page.waitForFunction(() => window.shown, undefined, { timeout: 300_000 });
    const { first, near, shown } = await page.evaluate(() => {
      const { shown, near = shown, first = shown } = window;
      return { first, near, shown };
    });
    const taken = (await memory()) - empty;
    const turned = (warm) =>
      page.evaluate(
        async ([turns, warm]) => {
          for (let i = 0; i < warm; i++) await window.turn();
          const start = performance.now();
          for (let i = 0; i < turns; i++) await window.turn();
          return (performance.now() - start) / turns;
        },
        [TURNS, warm],
      );
    // A viewer finds out how many pixels there is time for.
    const frame = await turned(WARM);
    const scale = await page.evaluate(() => window.scale ?? 1);
    const whole = (await page.evaluate(() => window.drawAll?.())) ? await turned(1) : frame;
    const name = tool.name.replaceAll(/\W+/g, "-");
    const picture = await page.screenshot({ path: join(root, "target/beside-vtk", `${name}-${tool.file}.png`) });
    if (picture.equals(blank)) throw new Error(`${tool.page} shows nothing`);
    return { ...server.sent, first, near, shown, memory: taken, frame, pixels: 100 * scale ** 2, whole };
  } finally {
    await browser.close();
    server.close();
  }
}

const median = (numbers) => numbers.sort((a, b) => a - b)[numbers.length >> 1];

/** Medians of some visits. */
async function measure(tool, link) {
  const visits = [];
  // The server compresses programs when they are first asked for.
  if (!link) await visit(tool);
  for (let i = 0; i < RUNS; i++) visits.push(await visit(tool, link));
  return Object.fromEntries(Object.keys(visits[0]).map((key) => [key, median(visits.map((visit) => visit[key]))]));
}

const MB = (bytes) => (bytes / 1e6).toFixed(2);
const seconds = (ms) => (ms / 1000).toFixed(1);

const unpacked = join(root, "target/beside-vtk/vtk-wasm");
await mkdir(unpacked, { recursive: true });
// The module of VTK.wasm as its developers publish it, mirrored on npm. A site would serve its two files, not the archive of four.
const archive = join(root, here, "node_modules/@pyvista-wasm/vtk-wasm-binary/vtk-wasm32-emscripten.tar.gz");
execFileSync("tar", ["-xzf", archive, "-C", unpacked, "./vtkWebAssembly.mjs", "./vtkWebAssembly.wasm"]);
// The parts of vtk.js that its page uses, as one file.
await build({
  entryPoints: [join(root, here, "vtkjs.js")],
  outfile: join(root, "target/beside-vtk/vtkjs.bundle.js"),
  bundle: true,
  minify: true,
  format: "esm",
});
const tables = [];
const load = () => loadavg()[0].toFixed(0);
const before = load();
for (const { title, tools } of SCENES) {
  const columns = [];
  for (const tool of tools) {
    console.error(title, tool.name);
    const [near, far] = [await measure(tool), await measure(tool, LINK)];
    const size = (await readFile(join(root, "target/beside-vtk", tool.file))).length;
    columns.push([
      tool.name, "--:", MB(near.programs), MB(size), MB(near.data), ...[near, far].flatMap((times) => [seconds(times.first), seconds(times.near), seconds(times.shown)]),
      ...[near.memory / 1e6, near.frame, near.pixels, near.whole].map((number) => number.toFixed(0)),
    ]);
  }
  const rows = ROWS.map((name, i) => `| ${[name, ...columns.map((column) => column[i])].join(" | ")} |`);
  tables.push(`## ${title}\n\n${rows.join("\n")}\n`);
}
const browser = await launch();
const version = browser.version();
await browser.close();
console.log(`${tables.join("\n")}\nChromium ${version} without a GPU (SwiftShader), Node ${process.version}, ${cpus().length} × ${cpus()[0].model}.
Load average ${before} before and ${load()} after; above 2 or so, times say little but how the programs compare.`);
