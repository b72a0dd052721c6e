/** WebM files of pictures that are encoded: as much of Matroska as one track without sound needs. */

/**
 * @typedef {object} Encoded
 * @property {Uint8Array} data
 * @property {number} at from when it is shown, in whole ms
 * @property {boolean} isKey whether it needs none of those before
 */

/** @typedef {Uint8Array | Bytes[]} Bytes */

const TEXT = new TextEncoder();

/** @param {Bytes} bytes @returns {number} */
const lengthOf = (bytes) => (bytes instanceof Uint8Array ? bytes.length : bytes.reduce((sum, part) => sum + lengthOf(part), 0));

/** @param {Bytes} bytes @returns {Uint8Array[]} */
const flat = (bytes) => (bytes instanceof Uint8Array ? [bytes] : bytes.flatMap(flat));

/** A number of so many bytes, the highest first. @param {number} value @param {number} length */
const fixed = (value, length) => Uint8Array.from({ length }, (_, i) => Math.floor(value / 256 ** (length - 1 - i)) % 256);

/** A number in as few bytes as it needs. @param {number} value */
const number = (value) => fixed(value, Math.max(1, Math.ceil(Math.log2(value + 1) / 8)));

/** A number in 8 bytes, however small. @param {number} value */
const place = (value) => fixed(value, 8);

/** @param {number} value */
function float(value) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setFloat64(0, value);
  return bytes;
}

/** The bytes of an element's name. @param {number} id */
const name = (id) => number(id);

/** An element: its name, its length in 8 bytes of which the first says so, what is in it. @param {number} id @param {Bytes} content @returns {Bytes} */
function element(id, content) {
  const length = place(lengthOf(content));
  length[0] = 1;
  return [name(id), length, content];
}

const ID = {
  ebml: 0x1a45dfa3,
  version: 0x4286,
  readVersion: 0x42f7,
  maxId: 0x42f2,
  maxSize: 0x42f3,
  kind: 0x4282,
  kindVersion: 0x4287,
  kindReadVersion: 0x4285,
  segment: 0x18538067,
  info: 0x1549a966,
  scale: 0x2ad7b1,
  duration: 0x4489,
  muxer: 0x4d80,
  writer: 0x5741,
  tracks: 0x1654ae6b,
  track: 0xae,
  trackNumber: 0xd7,
  trackUid: 0x73c5,
  trackType: 0x83,
  lacing: 0x9c,
  codec: 0x86,
  frameTime: 0x23e383,
  video: 0xe0,
  width: 0xb0,
  height: 0xba,
  cues: 0x1c53bb6b,
  cue: 0xbb,
  cueTime: 0xb3,
  cuePlaces: 0xb7,
  cueTrack: 0xf7,
  cuePlace: 0xf1,
  cluster: 0x1f43b675,
  time: 0xe7,
  block: 0xa3,
};

const HEAD = element(ID.ebml, [
  element(ID.version, number(1)),
  element(ID.readVersion, number(1)),
  element(ID.maxId, number(4)),
  element(ID.maxSize, number(8)),
  element(ID.kind, TEXT.encode("webm")),
  element(ID.kindVersion, number(4)),
  element(ID.kindReadVersion, number(2)),
]);

/** Times in a file are in ms: so many ns. */
const MS = 1_000_000;
/** The track, as a block names it, and the flag of a block that needs none before. */
const [TRACK, KEY] = [0x81, 0x80];

/** The pictures from one that needs none before up to the next. @param {Encoded[]} pictures */
function clusters(pictures) {
  /** @type {Encoded[][]} */
  const found = [];
  for (const picture of pictures) {
    if (picture.isKey) found.push([]);
    found.at(-1)?.push(picture);
  }
  return found.map((own) => {
    const [{ at: start }] = own;
    const block = (/** @type {Encoded} */ { data, at, isKey }) => {
      const head = Uint8Array.of(TRACK, ...fixed(at - start, 2), isKey ? KEY : 0);
      return element(ID.block, [head, data]);
    };
    return { start, bytes: element(ID.cluster, [element(ID.time, number(start)), ...own.map(block)]) };
  });
}

/**
 * A file of pictures; the first needs none before it, and no more than half a minute is between those that do not.
 *
 * @param {Encoded[]} pictures @param {{ codec: string, width: number, height: number, rate: number }} how
 */
export function webm(pictures, { codec, width, height, rate }) {
  const info = element(ID.info, [
    element(ID.scale, number(MS)),
    element(ID.duration, float((1000 * pictures.length) / rate)),
    element(ID.muxer, TEXT.encode("tetralod")),
    element(ID.writer, TEXT.encode("tetralod")),
  ]);
  const video = [element(ID.width, number(width)), element(ID.height, number(height))];
  const track = element(ID.track, [
    element(ID.trackNumber, number(1)),
    element(ID.trackUid, number(1)),
    element(ID.trackType, number(1)),
    element(ID.lacing, number(0)),
    element(ID.codec, TEXT.encode(codec)),
    element(ID.frameTime, number(Math.round((1000 * MS) / rate))),
    element(ID.video, video),
  ]);
  const [before, all] = [[info, element(ID.tracks, track)], clusters(pictures)];
  // Where each cluster begins is told in front of all: that takes as many bytes whatever it is.
  const cues = (/** @type {number[]} */ places) =>
    element(
      ID.cues,
      all.map(({ start }, i) =>
        element(ID.cue, [element(ID.cueTime, number(start)), element(ID.cuePlaces, [element(ID.cueTrack, number(1)), element(ID.cuePlace, place(places[i]))])]),
      ),
    );
  let next = lengthOf(before) + lengthOf(cues(all.map(() => 0)));
  const places = all.map(({ bytes }) => {
    const own = next;
    next += lengthOf(bytes);
    return own;
  });
  const segment = element(ID.segment, [...before, cues(places), ...all.map(({ bytes }) => bytes)]);
  return new Blob(/** @type {BlobPart[]} */ (flat([HEAD, segment])), { type: "video/webm" });
}
