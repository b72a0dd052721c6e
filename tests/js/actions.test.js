// Promise: a hosted workflow runs the code that was reviewed and may no more than it needs; where a token is, nothing is compiled.
import assert from "node:assert/strict";
import { readdir, readFile } from "node:fs/promises";
import { test } from "node:test";

const folder = new URL("../../.github/workflows/", import.meta.url);

/** What is wrong with a workflow, in words. */
function faults(text) {
  const found = [];
  if (!/^permissions:\n {2}contents: read\n(?! )/m.test(text)) found.push("the permissions of all jobs are not `contents: read` alone");
  for (const line of text.match(/^ *(- )?uses:.*$/gm) ?? []) {
    // A workflow of this repository is that of the same commit.
    if (!/uses: (\.\/\.github\/workflows\/\w+\.yml|[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+)$/.test(line))
      found.push(`${line.trim()}: name the commit, and behind it the version`);
  }
  for (const line of text.match(/^.*\bcargo publish\b.*$/gm) ?? []) {
    if (!line.includes(" --locked --no-verify ")) found.push(`${line.trim()}: compiles beside a token`);
  }
  return found;
}

for (const name of await readdir(folder)) {
  test(`${name} names commits and has few permissions`, async () => assert.deepEqual(faults(await readFile(new URL(name, folder), "utf8")), []));
}

test("what a workflow must not do is found", () => {
  const commit = "34e114876b0b11c390a56381ad16ebd13914f8d5";
  const good = `permissions:\n  contents: read\n\njobs:\n  a:\n    permissions:\n      id-token: write\n    steps:\n      - uses: a/b@${commit} # v4.3.1\n`;
  assert.deepEqual(faults(good), []);
  for (const [from, to] of [
    ["permissions:\n  contents: read\n", ""],
    ["  contents: read\n", "  contents: write\n"],
    ["  contents: read\n", "  contents: read\n  packages: write\n"],
    [`${commit} #`, "v4 #"],
    [commit, commit.slice(1)],
    [" # v4.3.1", ""],
    ["- uses: ", "- run: cargo publish --locked\n      - uses: "],
  ]) {
    assert.equal(faults(good.replace(from, to)).length, 1, `${from} -> ${to}`);
  }
});
