// Ranges over HTTP/2 in a real browser: as soon as it says that this is the protocol, many requests run side by side, on one connection.
import assert from "node:assert/strict";
import { generateKeyPairSync, sign } from "node:crypto";
import { readFile } from "node:fs/promises";
import { createSecureServer } from "node:http2";
import { after, before, test } from "node:test";
import { launch } from "./browser.js";

/** A file of many small parts that are wanted, and gaps between them. */
const [PARTS, PART] = [60, 2000];
const file = new Uint8Array(2 * PARTS * PART).map((_, at) => (at * 7 + (at >> 8) * 31) & 255);
const TYPES = { js: "text/javascript", wasm: "application/wasm" };

let browser;
let server;
let connections = 0;
/** Answers that have been begun, at the moment and at most. */
let open = 0;
let most = 0;

/** A value in DER, as certificates are written. */
function der(tag, ...parts) {
  const content = Buffer.concat(parts.map((part) => Buffer.from(part)));
  const { length } = content;
  const digits = length < 128 ? [length] : length < 256 ? [0x81, length] : [0x82, length >> 8, length & 255];
  return Buffer.from([tag, ...digits, ...content]);
}

/** A key and a certificate that it signs itself, for this test alone. */
function identity() {
  const { privateKey, publicKey } = generateKeyPairSync("ec", { namedCurve: "P-256" });
  const algorithm = der(0x30, der(0x06, [0x2a, 0x86, 0x48, 0xce, 0x3d, 0x04, 0x03, 0x02]));
  const name = der(0x30, der(0x31, der(0x30, der(0x06, [0x55, 0x04, 0x03]), der(0x0c, Buffer.from("test")))));
  const validity = der(0x30, der(0x17, Buffer.from("200101000000Z")), der(0x17, Buffer.from("490101000000Z")));
  const version = der(0xa0, der(0x02, [2]));
  const spki = publicKey.export({ type: "spki", format: "der" });
  const body = der(0x30, version, der(0x02, [1]), algorithm, name, validity, name, spki);
  const certificate = der(0x30, body, algorithm, der(0x03, [0], sign("sha256", body, privateKey)));
  const cert = `-----BEGIN CERTIFICATE-----\n${certificate.toString("base64")}\n-----END CERTIFICATE-----\n`;
  return { key: privateKey.export({ type: "pkcs8", format: "pem" }), cert };
}

async function answer(request, response) {
  const [, name, type] = /^\/pkg\/([\w.-]+\.(js|wasm))$/.exec(request.url) ?? [];
  const send = (type, content) => response.writeHead(200, { "content-type": type }).end(content);
  if (name) return send(TYPES[type], await readFile(new URL(`../../pkg/${name}`, import.meta.url)));
  const [, start, last] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "") ?? [];
  if (last === undefined) return send("text/html", "<!doctype html>");
  const [from, end] = [Number(start), Math.min(Number(last) + 1, file.length)];
  most = Math.max(most, ++open);
  // Long enough for all to be asked for that may be.
  setTimeout(() => {
    open--;
    response.writeHead(206, { "content-range": `bytes ${from}-${end - 1}/${file.length}`, "content-length": end - from });
    response.end(file.slice(from, end));
  }, 300);
}

before(async () => {
  server = createSecureServer({ ...identity(), allowHTTP1: true }, answer);
  server.on("secureConnection", () => connections++);
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

test("many requests run side by side on one connection", async () => {
  const page = await browser.newPage({ ignoreHTTPSErrors: true });
  await page.goto(`https://127.0.0.1:${server.address().port}/`);
  const found = await page.evaluate(
    async ([parts, part]) => {
      const [{ Ranges }, core] = await Promise.all([import("/pkg/ranges.js"), import("/pkg/tetralod_core.js")]);
      await core.default();
      const sums = [];
      await new Promise((resolve, reject) => {
        const onComplete = () => {
          for (let range; (range = source.loader.take()); ) {
            sums[range.start / part / 2] = range.bytes.reduce((sum, byte) => sum + byte, 0);
          }
          const here = sums.filter((sum) => sum !== undefined).length;
          // The first one shows what the server is like.
          if (here === 1) setTimeout(() => want(1, parts), 200);
          if (here === parts) resolve(undefined);
        };
        const want = (first, end) => {
          const triples = [];
          for (let i = first; i < end; i++) triples.push(2 * i * part, (2 * i + 1) * part, 0);
          source.loader.want(Float64Array.from(triples));
          source.go();
        };
        const source = new Ranges(core.RangeLoader, `${location.origin}/file.mt`, { onComplete, onError: reject }, { gap: 0 });
        want(0, 1);
      });
      const timing = /** @type {PerformanceResourceTiming} */ (performance.getEntriesByName(`${location.origin}/file.mt`).at(-1));
      return { sums, protocol: timing.nextHopProtocol };
    },
    [PARTS, PART],
  );
  const sum = (i) => file.slice(2 * i * PART, (2 * i + 1) * PART).reduce((total, byte) => total + byte, 0);
  assert.deepEqual(
    found.sums,
    Array.from({ length: PARTS }, (_, i) => sum(i)),
  );
  assert.equal(found.protocol, "h2");
  assert.ok(most > 6 && most <= 24, `${most} at a time`);
  assert.ok(connections <= 2, `${connections} connections`);
});
