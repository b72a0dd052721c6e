// One Chromium for the tests and the benchmark, with the flags that `webdriver.json` gives the wasm tests too.
import { readFile } from "node:fs/promises";
import { chromium } from "playwright-core";

const config = JSON.parse(await readFile(new URL("../../webdriver.json", import.meta.url), "utf8"));

export function launch() {
  const executablePath = process.env.CHROMIUM;
  if (!executablePath) throw new Error("CHROMIUM is not set: run this through `cargo xtask`");
  // Playwright's own choice of headless mode and of features would contradict the flags.
  const ignoreDefaultArgs = ["--headless", "--headless=old", "--disable-gpu", "--hide-scrollbars"];
  return chromium.launch({ executablePath, args: config["goog:chromeOptions"].args, ignoreDefaultArgs });
}

/** The address that `cargo xtask` serves at. */
export function address() {
  const page = process.env.TETRALOD_PAGE;
  if (!page) throw new Error("TETRALOD_PAGE is not set: run this through `cargo xtask`");
  return page;
}
