// Visits the page with an empty cache, and prints how soon what is there, as a table for docs/: started by
// `cargo xtask bench --first-visit`.
import { launch } from "../../tests/js/browser.js";

const address = process.env.TETRALOD_PAGE;
const VISITS = 7;
/** A mesh within this part of the field's range shows what the volume is. */
const NEAR = 0.05;
/** What the page is held to, in ms. */
const GOALS = { text: 100, near: 1000, longest: 50 };
const PATIENCE = 120_000;

/** One visit with a new browser: times since the navigation began in ms, and bytes of the volume. */
async function visit() {
  const browser = await launch();
  try {
    const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
    await page.addInitScript((near) => {
      const seen = { tasks: [], nearAt: undefined };
      window.firstVisit = seen;
      new PerformanceObserver((list) => seen.tasks.push(...list.getEntries().map(({ startTime, duration }) => [startTime, duration])))
        .observe({ type: "longtask", buffered: true });
      // The page listens to the viewer: what it has noted is at most this old.
      const timer = setInterval(() => {
        const { step, firstFrameMs, frames, viewer } = window.tetralodDemo ?? {};
        if (!viewer || firstFrameMs === undefined || !(step?.done && step.relativeErrorBound <= near)) return;
        clearInterval(timer);
        // The mesh is shown by the next picture.
        const wait = setInterval(() => {
          if (window.tetralodDemo.frames === frames) return;
          clearInterval(wait);
          seen.nearAt = performance.now();
        }, 4);
      }, 4);
    }, NEAR);
    await page.goto(address);
    await page.waitForFunction(() => window.tetralodDemo?.state === "complete" && window.firstVisit.nearAt, undefined, { timeout: PATIENCE });
    return await page.evaluate(() => {
      const { firstVisit, tetralodDemo } = window;
      const [text] = performance.getEntriesByName("first-contentful-paint");
      return {
        text: text.startTime,
        first: tetralodDemo.firstFrameMs,
        near: firstVisit.nearAt,
        longest: Math.max(0, ...firstVisit.tasks.map(([, duration]) => duration)),
        tasks: firstVisit.tasks.length,
        firstBytes: tetralodDemo.firstFrameBytes,
        bytes: tetralodDemo.receivedBytes,
        volume: `${tetralodDemo.info.tetrahedra.toLocaleString("en")} tetrahedra`,
      };
    });
  } finally {
    await browser.close();
  }
}

const visits = [];
for (let i = 0; i < VISITS; i++) {
  visits.push(await visit());
  console.error(visits.at(-1));
}

const sorted = (key) => visits.map((one) => one[key]).sort((a, b) => a - b);
const row = (name, key, digits = 0, scale = 1) => {
  const numbers = sorted(key).map((number) => (number / scale).toFixed(digits));
  const goal = GOALS[key] === undefined ? "–" : `at most ${GOALS[key]}`;
  return `| ${name} | ${numbers[VISITS >> 1]} | ${numbers[0]} to ${numbers.at(-1)} | ${goal} |`;
};
console.log(`| ${visits[0].volume} | median | of ${VISITS} visits | goal |`);
console.log("|---|--:|--:|--:|");
console.log(row("text and controls, ms", "text"));
console.log(row("first picture, ms", "first"));
console.log(row(`picture within ${100 * NEAR} % of the field's range, ms`, "near"));
console.log(row("longest task of the page's thread, ms", "longest"));
console.log(row("tasks above 50 ms", "tasks"));
console.log(row("fetched of the volume until the first picture, kB", "firstBytes", 0, 1000));
console.log(row("fetched until the picture is complete, kB", "bytes", 0, 1000));
