/** The first bytes of a file that will be opened, which are fetched while the wasm module loads. */

import type { Fetch } from "./ranges.js";

/** So many bytes: as many as the first request for a file asks for. */
const HEAD = 65536;

let ahead: { url: string; range: string; response: Promise<Response> } | undefined;

/** Begins to fetch them. */
export function fetchAhead(url: string) {
  const range = `bytes=0-${HEAD - 1}`;
  const response = fetch(url, { headers: { range }, cache: "no-store" });
  // Whoever opens the file hears of an error.
  response.catch(() => {});
  ahead = { url, range, response };
}

/** A `fetch` whose first answer is already on its way, if it is for this file. */
export function takeAhead(url: string): { fetch?: Fetch } {
  let mine = ahead;
  ahead = undefined;
  if (mine?.url !== url) return {};
  return {
    fetch(address, init) {
      const isIt = mine && address === mine.url && init.headers.get("range") === mine.range;
      const response = isIt && mine ? mine.response : fetch(address, init);
      mine = undefined;
      return response;
    },
  };
}
