// Chromium for the tests of the Python package: it does what each line of the input says, as JSON, and answers with a line.
//
//   {"open": URL}  {"until": "what is to become true in the page"}  {"drag": [x, y, right, down]}  {"click": [x, y]}  {"picture": FILE}
//
// Places are in CSS pixels of the page. What the browser complains of is the answer to {"complaints": true}.
import { createInterface } from "node:readline";
import { launch, PATIENCE } from "./browser.js";

const browser = await launch();
const page = await browser.newPage({ viewport: { width: 1200, height: 620 } });
/** @type {string[]} */
const complaints = [];
page.on("pageerror", (error) => complaints.push(String(error)));
page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));

const acts = {
  open: (url) => page.goto(url).then(() => null),
  until: (expression) => page.waitForFunction(expression, undefined, { timeout: PATIENCE }).then((found) => found.jsonValue()),
  async drag([x, y, right, down]) {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + right, y + down, { steps: 4 });
    await page.mouse.up();
  },
  click: ([x, y]) => page.mouse.click(x, y),
  picture: (path) => page.screenshot({ path }).then(() => null),
  complaints: async () => complaints,
};

for await (const line of createInterface({ input: process.stdin })) {
  const [[name, argument]] = Object.entries(JSON.parse(line));
  const answer = await acts[name](argument).then(
    (result = null) => ({ result }),
    (error) => ({ error: String(error) }),
  );
  console.log(JSON.stringify(answer));
}
await browser.close();
