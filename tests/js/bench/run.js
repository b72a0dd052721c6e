// Runs the benchmark in Chromium and prints its report: started by `cargo xtask bench --browser`.
import { address, launch } from "../browser.js";

const browser = await launch();
try {
  const page = await browser.newPage();
  page.on("pageerror", (error) => console.error(error));
  await page.goto(address());
  const report = await page.evaluate(async () => {
    const { default: init, bench } = await import("/bench/tetralod_bench.js");
    await init();
    const response = await fetch("/bench/volume.mt");
    return bench(new Uint8Array(await response.arrayBuffer()), 2);
  });
  console.log(JSON.stringify(report));
} finally {
  await browser.close();
}
