/** Meshes and triangles as files that other programs read. Each gives the parts of a file, one after the other. */

/** @typedef {Float32Array | Float64Array} Numbers */
/** @typedef {Pick<import("tetralod").FieldValues, "index" | "name" | "unit" | "time" | "vector"> & { values: Numbers }} Field */
/** @typedef {{ positions: Numbers, fields: Field[], tets: Uint32Array }} TetMesh in absolute numbers */
/** @typedef {{ positions: Numbers, fields: Field[], indices: Uint32Array, normals?: Float32Array }} Surface in absolute numbers */
/**
 * @typedef {{ positions: Float32Array, indices: Uint32Array, values?: Float32Array, normals?: Float32Array, colours?: Float32Array,
 *   origin: number[], offset: number, scale: number }} Triangles colours are three numbers a vertex: linear light, 0 to 1
 */

/** Fields as one array of a file, so many numbers for each vertex. @typedef {{ name: string, size: number, values: Numbers, field: Field }} FieldArray */

const TETRAHEDRON = 10;

/** Names without what has a meaning in the formats, each once. @param {string[]} names @param {string[]} [taken] those that are in use */
function plain(names, taken = []) {
  /** @type {string[]} */
  const found = [];
  for (const name of names) {
    const base = name.replaceAll(/\W/g, "_");
    let own = base;
    for (let i = 1; own === "" || found.includes(own) || taken.includes(own); i++) own = `${base}_${i}`;
    found.push(own);
  }
  return found;
}

/** Text for an attribute of XML. */
const escaped = (/** @type {string} */ text) => text.replaceAll(/[<>&"']/g, (c) => `&#${c.codePointAt(0)};`).replaceAll(/\p{Cc}/gu, " ");

/** Which of two words is that of the numbers of an array. @param {ArrayLike<number>} array @param {string} single @param {string} double */
const ofType = (array, single, double) => (array instanceof Float64Array ? double : single);

/** What a component of so many is called. @param {number} count @param {number} c */
function componentName(count, c) {
  if (count <= 3) return "xyz"[c];
  if (count === 6) return ["xx", "yy", "zz", "xy", "yz", "xz"][c];
  return count === 9 ? "xyz"[Math.floor(c / 3)] + "xyz"[c % 3] : String(c);
}

/** How many of the first fields are the components of one vector, named as those of files are; else 1. @param {Field[]} fields */
function componentsOf(fields) {
  const [{ vector, time }] = fields;
  const isNext = (/** @type {Field} */ field, /** @type {number} */ c) =>
    vector && field.vector?.name === vector.name && field.vector.component === c && field.time === time;
  const end = fields.findIndex((field, c) => !isNext(field, c));
  const count = end < 0 ? fields.length : end;
  const isNamed = (/** @type {Field} */ { name }, /** @type {number} */ c) => name === `${vector?.name}_${componentName(count, c)}`;
  return count > 1 && fields.slice(0, count).every(isNamed) ? count : 1;
}

/** The name of a field, or `own` for its vector, with the time where there are several. @param {Field[]} fields @param {Field} field */
function nameAtTime(fields, { name, time }, own = name) {
  const several = fields.some((other) => other.name === name && other.time !== time);
  return several && time !== undefined ? `${own}@${Number.isInteger(time) ? `${time}.0` : time}` : own;
}

/** The numbers of some fields, those of a vertex one behind the other. @param {Field[]} fields */
function interleaved(fields) {
  const count = fields.length;
  if (count === 1) return fields[0].values;
  const Floats = fields.some(({ values }) => values instanceof Float64Array) ? Float64Array : Float32Array;
  const found = new Floats(count * fields[0].values.length);
  fields.forEach(({ values }, k) => {
    for (let i = 0; i < values.length; i++) found[count * i + k] = values[i];
  });
  return found;
}

/**
 * The fields as arrays of a file, as `tetralod extract` writes them: components that follow one another are a vector again, and its length,
 * which follows from them, is left out.
 *
 * @param {Field[]} fields
 */
function arraysOf(fields) {
  /** @type {FieldArray[]} */
  const arrays = [];
  for (let i = 0, size = 1; i < fields.length; i += size) {
    const field = fields[i];
    size = componentsOf(fields.slice(i));
    const { vector, time } = field;
    const isOf = (/** @type {FieldArray} */ array) => array.size > 1 && array.field.vector?.name === vector?.name && array.field.time === time;
    if (vector && vector.component === undefined && arrays.some(isOf)) continue;
    const name = nameAtTime(fields, field, size > 1 ? vector?.name : undefined);
    arrays.push({ name, size, values: interleaved(fields.slice(i, i + size)), field });
  }
  return arrays;
}

/** The one of the arrays that is the field of this number, unless that is part of a vector. @param {FieldArray[]} arrays @param {number} number */
const arrayOf = (arrays, number) => arrays.find(({ size, field }) => size === 1 && field.index === number);

/**
 * VTK XML, unstructured grid, arrays appended as they are.
 *
 * @param {TetMesh} mesh @param {number} shown the number of the field that is shown first @returns {BlobPart[]}
 */
export function vtu({ positions, tets, fields }, shown) {
  const [points, cells] = [positions.length / 3, tets.length / 4];
  /** @type {ArrayBufferView[]} */
  const appended = [];
  let offset = 0;
  /** @param {Numbers | Uint32Array | Uint8Array} data @param {string} name */
  const array = (data, name, size = 1, unit = "") => {
    const type = data.constructor.name.replace("Array", "").replace("Uint", "UInt");
    const element = `<DataArray type="${type}" Name="${escaped(name)}" NumberOfComponents="${size}" format="appended" offset="${offset}"`;
    const key = unit && `<InformationKey name="UNITS_LABEL" location="vtkDataArray">${escaped(unit)}</InformationKey>`;
    appended.push(BigUint64Array.of(BigInt(data.byteLength)), data);
    offset += 8 + data.byteLength;
    return key ? `${element}>${key}</DataArray>` : `${element}/>`;
  };
  const arrays = arraysOf(fields);
  // The one of all fields; several are in their names.
  const time = fields.every((field) => field.time === fields[0].time) ? fields[0]?.time : undefined;
  const when =
    time === undefined ? "" : `<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">${time}</DataArray></FieldData>\n`;
  const scalars = arrayOf(arrays, shown);
  const ends = Uint32Array.from({ length: cells }, (_, i) => 4 * (i + 1));
  const head = `<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid>${when}<Piece NumberOfPoints="${points}" NumberOfCells="${cells}">
<PointData${scalars ? ` Scalars="${escaped(scalars.name)}"` : ""}>${arrays.map(({ values, name, size, field }) => array(values, name, size, field.unit)).join("")}</PointData>
<Points>${array(positions, "Points", 3)}</Points>
<Cells>${array(tets, "connectivity")}${array(ends, "offsets")}${array(new Uint8Array(cells).fill(TETRAHEDRON), "types")}</Cells>
</Piece></UnstructuredGrid>
<AppendedData encoding="raw">_`;
  return /** @type {BlobPart[]} */ ([head, ...appended, "</AppendedData></VTKFile>\n"]);
}

/** The same numbers, the highest byte first. @param {Numbers | Uint32Array} array */
function swapped(array) {
  const bytes = Uint8Array.from(new Uint8Array(array.buffer, array.byteOffset, array.byteLength));
  const size = array.BYTES_PER_ELEMENT;
  for (let i = 0; i < bytes.length; i += size) bytes.subarray(i, i + size).reverse();
  return bytes;
}

/**
 * Legacy VTK, binary: numbers have the highest byte first.
 *
 * @param {TetMesh} mesh @param {number} shown the number of the field that is shown first @returns {BlobPart[]}
 */
export function vtk({ positions, tets, fields }, shown) {
  const [points, cells] = [positions.length / 3, tets.length / 4];
  const corners = new Uint32Array(5 * cells);
  for (let i = 0; i < cells; i++) {
    corners[5 * i] = 4;
    corners.set(tets.subarray(4 * i, 4 * i + 4), 5 * i + 1);
  }
  const types = new Uint32Array(cells).fill(TETRAHEDRON);
  const all = arraysOf(fields);
  const names = plain(all.map(({ name }) => name));
  const arrays = all.map((array, i) => ({ ...array, name: names[i] }));
  const scalars = arrayOf(arrays, shown);
  const others = arrays.filter((array) => array !== scalars);
  const word = (/** @type {Numbers} */ values) => ofType(values, "float", "double");
  /** @type {BlobPart[]} */
  const data = [];
  if (scalars) data.push(`\nSCALARS ${scalars.name} ${word(scalars.values)} 1\nLOOKUP_TABLE default\n`, swapped(scalars.values));
  if (others.length > 0) data.push(`\nFIELD FieldData ${others.length}`);
  for (const { name, size, values } of others) data.push(`\n${name} ${size} ${points} ${word(values)}\n`, swapped(values));
  return [
    `# vtk DataFile Version 3.0\ntetralod\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS ${points} ${word(positions)}\n`,
    swapped(positions),
    `\nCELLS ${cells} ${corners.length}\n`,
    swapped(corners),
    `\nCELL_TYPES ${cells}\n`,
    swapped(types),
    `\nPOINT_DATA ${points}`,
    ...data,
    "\n",
  ];
}

/**
 * STL, binary, which holds single precision: positions stay relative to the origin, which the head of the file names if it is not 0.
 *
 * @param {Triangles} surface @returns {BlobPart[]}
 */
export function stl({ positions, indices, origin }) {
  const count = indices.length / 3;
  const data = new DataView(new ArrayBuffer(84 + 50 * count));
  const head = origin.every((x) => x === 0) ? "tetralod" : `tetralod, relative to ${origin.join(" ")}`;
  new Uint8Array(data.buffer, 0, 80).set(new TextEncoder().encode(head.slice(0, 80)));
  data.setUint32(80, count, true);
  for (let i = 0; i < count; i++) {
    const corners = [0, 1, 2].map((k) => positions.subarray(3 * indices[3 * i + k], 3 * indices[3 * i + k] + 3));
    const [a, b, c] = corners;
    const [u, v] = [b, c].map((p) => [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const length = Math.hypot(...normal) || 1;
    const numbers = [...normal.map((x) => x / length), ...corners.flatMap((p) => [...p])];
    numbers.forEach((x, k) => data.setFloat32(84 + 50 * i + 4 * k, x, true));
  }
  return [data];
}

const PLACES = ["x", "y", "z", "nx", "ny", "nz"];

/** PLY, binary, with normals and the fields at each vertex. @param {Surface} surface @returns {BlobPart[]} */
export function ply({ positions, normals, fields, indices }) {
  const [points, count] = [positions.length / 3, indices.length / 3];
  const names = plain(
    fields.map((field) => nameAtTime(fields, field)),
    PLACES,
  );
  /** @type {[array: Numbers | undefined, names: string[]][]} */
  const all = [
    [positions, PLACES.slice(0, 3)],
    [normals, PLACES.slice(3)],
  ];
  all.push(...fields.map(({ values }, i) => /** @type {[Numbers, string[]]} */ ([values, [names[i]]])));
  const columns = all.flatMap(([array, names]) => (array ? names.map((label, k) => ({ array, label, k, step: names.length })) : []));
  const width = columns.reduce((sum, { array }) => sum + array.BYTES_PER_ELEMENT, 0);
  const vertices = new DataView(new ArrayBuffer(width * points));
  let at = 0;
  for (let i = 0; i < points; i++) {
    for (const { array, k, step } of columns) {
      if (array instanceof Float64Array) vertices.setFloat64(at, array[step * i + k], true);
      else vertices.setFloat32(at, array[step * i + k], true);
      at += array.BYTES_PER_ELEMENT;
    }
  }
  const faces = new DataView(new ArrayBuffer(13 * count));
  for (let i = 0; i < count; i++) {
    faces.setUint8(13 * i, 3);
    for (let k = 0; k < 3; k++) faces.setUint32(13 * i + 1 + 4 * k, indices[3 * i + k], true);
  }
  const head = ["ply", "format binary_little_endian 1.0", "comment tetralod", `element vertex ${points}`]
    .concat(columns.map(({ array, label }) => `property ${ofType(array, "float", "double")} ${label}`))
    .concat([`element face ${count}`, "property list uchar uint vertex_indices", "end_header", ""]);
  return [head.join("\n"), vertices, faces];
}

/** The smallest and the largest of each coordinate. @param {Float32Array} positions */
function bounds(positions) {
  const [min, max] = [
    [Infinity, Infinity, Infinity],
    [-Infinity, -Infinity, -Infinity],
  ];
  positions.forEach((x, i) => {
    min[i % 3] = Math.min(min[i % 3], x);
    max[i % 3] = Math.max(max[i % 3], x);
  });
  return { min, max };
}

/**
 * glTF 2.0, binary (`.glb`), which holds single precision: positions stay relative to the origin, by which the node is moved. The value of the
 * field is the attribute `_VALUE`, relative to what `extras` of the mesh say: it is `offset + scale * v`.
 *
 * @param {Triangles} surface @returns {BlobPart[]}
 */
export function glb({ positions, indices, values, normals, colours, origin, offset, scale }) {
  const [FLOAT, UINT, VERTICES, ELEMENTS] = [5126, 5125, 34962, 34963];
  /** @type {[array: Float32Array | Uint32Array, accessor: object, target: number, attribute?: string][]} */
  const all = [
    [indices, { componentType: UINT, count: indices.length, type: "SCALAR" }, ELEMENTS],
    [positions, { componentType: FLOAT, count: positions.length / 3, type: "VEC3", ...bounds(positions) }, VERTICES, "POSITION"],
  ];
  if (normals) all.push([normals, { componentType: FLOAT, count: normals.length / 3, type: "VEC3" }, VERTICES, "NORMAL"]);
  if (colours) all.push([colours, { componentType: FLOAT, count: colours.length / 3, type: "VEC3" }, VERTICES, "COLOR_0"]);
  if (values) all.push([values, { componentType: FLOAT, count: values.length, type: "SCALAR" }, VERTICES, "_VALUE"]);
  let length = 0;
  const bufferViews = all.map(([array, , target]) => {
    const byteOffset = length;
    length += array.byteLength;
    return { buffer: 0, byteOffset, byteLength: array.byteLength, target };
  });
  const attributes = Object.fromEntries(all.flatMap(([, , , name], i) => (name ? [[name, i]] : [])));
  const json = {
    asset: { version: "2.0", generator: "tetralod" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [origin.every((x) => x === 0) ? { mesh: 0 } : { mesh: 0, translation: origin }],
    meshes: [{ ...(offset === 0 && scale === 1 ? {} : { extras: { offset, scale } }), primitives: [{ attributes, indices: 0, material: 0 }] }],
    materials: [{ doubleSided: true, pbrMetallicRoughness: { metallicFactor: 0, roughnessFactor: 0.7 } }],
    accessors: all.map(([, accessor], bufferView) => ({ bufferView, ...accessor })),
    bufferViews,
    buffers: [{ byteLength: length }],
  };
  const text = new TextEncoder().encode(JSON.stringify(json));
  const padded = new Uint8Array(Math.ceil(text.length / 4) * 4).fill(0x20);
  padded.set(text);
  const [JSON_CHUNK, BIN_CHUNK] = [0x4e4f534a, 0x004e4942];
  const header = Uint32Array.of(0x46546c67, 2, 12 + 8 + padded.length + 8 + length, padded.length, JSON_CHUNK);
  return /** @type {BlobPart[]} */ ([header, padded, Uint32Array.of(length, BIN_CHUNK), ...all.map(([array]) => array)]);
}

/** The light that a channel of sRGB means, both 0 to 1. */
const linear = (/** @type {number} */ channel) => (channel <= 0.04045 ? channel / 12.92 : ((channel + 0.055) / 1.055) ** 2.4);

/**
 * The colours that values have on the scale of a legend, as linear light: what glTF has in `COLOR_0`.
 *
 * @param {Numbers} values in units of the field
 * @param {Pick<import("tetralod/viewer").Legend, "range" | "log" | "colours"> & Partial<Pick<import("tetralod/viewer").Legend, "labels">>} legend
 */
export function coloursOf(values, { range, log, colours, labels = [] }) {
  if (labels.length > 0) return coloursOfLabels(values, labels);
  const even = (/** @type {number} */ value) => (log ? Math.log(value) : value);
  const [low, high] = range.map(even);
  const table = colours.map((colour) => [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16) / 255));
  const found = new Float32Array(3 * values.length);
  values.forEach((value, i) => {
    const part = high > low ? (even(value) - low) / (high - low) : 0.5;
    // Logarithms of what is not positive are at the lower end.
    const place = Math.min(Math.max(part || 0, 0), 1) * (table.length - 1);
    const below = Math.min(Math.floor(place), table.length - 2);
    const mixed = table[below].map((c, k) => linear(c + (table[below + 1][k] - c) * (place - below)));
    found.set(mixed, 3 * i);
  });
  return found;
}

/** The colours of labels, as linear light. @param {Numbers} values @param {import("tetralod/viewer").Legend["labels"]} labels */
function coloursOfLabels(values, labels) {
  const light = (/** @type {string} */ colour) => [1, 3, 5].map((at) => linear(Number.parseInt(colour.slice(at, at + 2), 16) / 255));
  const known = new Map(labels.map(({ value, colour }) => [value, light(colour)]));
  return Float32Array.from([...values].flatMap((value) => known.get(Math.round(value)) ?? [0.5, 0.5, 0.5]));
}

/** Comma-separated values. Numbers that are missing are empty. @param {(string | number | undefined)[][]} rows @returns {[string]} */
export function csv(rows) {
  const cell = (/** @type {string | number | undefined} */ value) =>
    typeof value === "string" ? (/[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value) : (value ?? "");
  return [`${rows.map((row) => row.map(cell).join(",")).join("\n")}\n`];
}
