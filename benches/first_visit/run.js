// Visits the page with an empty cache, and prints how soon what is there, as a table for docs/: started by
// `cargo xtask bench --first-visit`.
import { cpus, loadavg } from "node:os";
import { launch } from "../../tests/js/browser.js";

const address = process.env.TETRALOD_PAGE;
const VISITS = 7;
/** A mesh within this part of the field's range shows what the volume is. */
const NEAR = 0.05;
/** What the page is held to, in ms. */
const GOALS = { text: 100, near: 1000, longest: 50 };
const PATIENCE = 120_000;

/** The most processor time that a task of the page's thread took, in ms. */
function busiestOf(events) {
  const isNamed = ({ name, args }) => name === "thread_name" && args.name === "CrRendererMain";
  const threads = new Set(events.filter(isNamed).map(({ pid, tid }) => `${pid} ${tid}`));
  const isTask = ({ name, pid, tid, tdur }) => name === "ThreadControllerImpl::RunTask" && tdur !== undefined && threads.has(`${pid} ${tid}`);
  const tasks = events.filter(isTask);
  if (tasks.length === 0) throw new Error("the trace has no tasks");
  return Math.max(...tasks.map(({ tdur }) => tdur / 1000));
}

/** One visit with an empty cache: times since the navigation began in ms, and bytes of the volume. */
async function visit() {
  const browser = await launch();
  try {
    const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
    // The browser has started, with the process that draws, before it is sent to the page.
    await page.goto("about:blank");
    await page.screenshot();
    // What no page is faster than here: one that is a word.
    await page.goto("data:text/html,<p>Text</p>");
    const painted = () => performance.getEntriesByName("first-contentful-paint")[0]?.startTime;
    const word = await (await page.waitForFunction(painted)).jsonValue();
    const control = await browser.newBrowserCDPSession();
    const events = [];
    control.on("Tracing.dataCollected", ({ value }) => events.push(...value));
    await page.addInitScript((near) => {
      const seen = { tasks: [], nearAt: undefined };
      window.firstVisit = seen;
      new PerformanceObserver((list) => seen.tasks.push(...list.getEntries().map(({ duration }) => duration)))
        .observe({ type: "longtask", buffered: true });
      const timer = setInterval(() => {
        const viewer = window.tetralodDemo?.viewer;
        if (!viewer) return;
        clearInterval(timer);
        let isNear = false;
        viewer.addEventListener("stats", ({ detail }) => (isNear ||= detail.done && detail.relativeErrorBound <= near));
        // The mesh is shown by the next picture.
        viewer.addEventListener("frame", () => isNear && (seen.nearAt ??= performance.now()));
      }, 1);
    }, NEAR);
    await control.send("Tracing.start", { transferMode: "ReportEvents", traceConfig: { includedCategories: ["toplevel"] } });
    await page.goto(address);
    await page.waitForFunction(() => window.tetralodDemo?.state === "complete" && window.firstVisit.nearAt, undefined, { timeout: PATIENCE });
    const seen = await page.evaluate(() => {
      const { firstVisit, tetralodDemo } = window;
      const [text] = performance.getEntriesByName("first-contentful-paint");
      return {
        text: text.startTime,
        first: tetralodDemo.firstFrameMs,
        near: firstVisit.nearAt,
        longest: Math.max(0, ...firstVisit.tasks),
        tasks: firstVisit.tasks.length,
        firstBytes: tetralodDemo.firstFrameBytes,
        bytes: tetralodDemo.receivedBytes,
        volume: `${tetralodDemo.info.tetrahedra.toLocaleString("en")} tetrahedra`,
      };
    });
    const ended = new Promise((resolve) => control.once("Tracing.tracingComplete", resolve));
    await control.send("Tracing.end");
    await ended;
    return { ...seen, word, busiest: busiestOf(events) };
  } finally {
    await browser.close();
  }
}

const load = () => loadavg()[0].toFixed(1);
const before = load();
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
console.log(row("text of a page that is one word, in the same browser, ms", "word"));
console.log(row("first picture, ms", "first"));
console.log(row(`picture within ${100 * NEAR} % of the field's range, ms`, "near"));
console.log(row("longest task of the page's thread, ms (0: none above 50)", "longest"));
console.log(row("most processor time of such a task, ms", "busiest", 1));
console.log(row("tasks above 50 ms", "tasks"));
console.log(row("fetched of the volume until the first picture, kB", "firstBytes", 0, 1000));
console.log(row("fetched until the picture is complete, kB", "bytes", 0, 1000));
const { length, 0: cpu } = cpus();
console.log(`\n${length} × ${cpu.model.trim()}; load average ${before} before and ${load()} after, of which these visits are a part; above 2 or so, times by the clock say little.`);
