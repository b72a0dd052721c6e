// The page of `tetralod html` shows what is in it.
const about = JSON.parse(document.getElementById("about").textContent);

/** The part of the file that is here: its ranges, one behind the other. */
function part() {
  const { name, total: size, ranges } = about;
  const bytes = Uint8Array.from(atob(document.getElementById("volume").textContent), (c) => c.charCodeAt(0));
  const before = (i) => ranges.slice(0, 2 * i).reduce((sum, place, k) => sum + (k % 2 ? place : -place), 0);
  const read = (start, end) => {
    const i = ranges.findIndex((_, k) => k % 2 === 0 && ranges[k] <= start && end <= ranges[k + 1]) / 2;
    return bytes.subarray(before(i) + start - ranges[2 * i], before(i) + end - ranges[2 * i]);
  };
  return { name, size, read, ranges };
}

present(about, part());
