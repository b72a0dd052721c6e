// Promise: the demo page runs its own files alone. Its policy knows the import map by its content.
import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { test } from "node:test";

const page = await readFile(new URL("../../www/index.html", import.meta.url), "utf8");

test("the policy of the page allows the import map that it has, and nothing else that stands in the page", () => {
  const [, policy] = /http-equiv="Content-Security-Policy"\s+content="([^"]*)"/.exec(page) ?? assert.fail("no policy");
  const scripts = [...page.matchAll(/<script(?![^>]* src=)[^>]*>(.*?)<\/script>/gs)].map(([, text]) => createHash("sha256").update(text).digest("base64"));
  assert.equal(scripts.length, 1);
  assert.ok(policy.startsWith(`default-src 'none'; script-src 'self' 'wasm-unsafe-eval' 'sha256-${scripts[0]}'; worker-src 'self'; `), `${scripts}`);
  assert.doesNotMatch(policy, /'unsafe-/);
  assert.doesNotMatch(page, / (style|on\w+)="/);
});
