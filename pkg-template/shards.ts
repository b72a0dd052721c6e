/** MT files in shards: their bytes are in several files, cut at multiples of the length of the first one (`docs/format.md`). */

/** How an MT file begins. */
const MAGIC = [0x89, 0x54, 0x4c, 0x4f, 0x44, 0x0d, 0x0a, 0x1a];

/** So many bytes of the header say how long the whole file is. */
export const STATED = 24;

/** What stands behind the name of the file in that of a shard; the first one, number 0, has the name of the file. */
export const shardSuffix = (number: number) => (number === 0 ? "" : `.${String(number).padStart(4, "0")}`);

/** The address of a shard of the file at `url`: the suffix belongs to the path. */
export const shardAddress = (url: string, number: number) => url.replace(/(?=[?#]|$)/, shardSuffix(number));

/** How many bytes a file has, if it begins with a header that says so. */
export function statedBytes(start: Uint8Array): number | undefined {
  if (start.length < STATED || MAGIC.some((byte, i) => start[i] !== byte)) return undefined;
  return Number(new DataView(start.buffer, start.byteOffset).getBigUint64(16, true)) || undefined;
}
