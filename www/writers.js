/** Meshes and triangles as files that other programs read. Each gives the parts of a file, one after the other. */

/** @typedef {{ positions: Float32Array, field: Float32Array, tets: Uint32Array }} TetMesh */
/** @typedef {{ positions: Float32Array, indices: Uint32Array, values?: Float32Array, normals?: Float32Array, name: string }} Triangles */

const TETRAHEDRON = 10;

/** A name without what has a meaning in the formats. */
const plain = (name) => name.replaceAll(/[^\w.-]/g, "_");

/**
 * VTK XML, unstructured grid, arrays appended as they are.
 *
 * @param {TetMesh} mesh @param {string} name of the field @returns {BlobPart[]}
 */
export function vtu({ positions, field, tets }, name) {
  const [points, cells] = [positions.length / 3, tets.length / 4];
  const ends = Uint32Array.from({ length: cells }, (_, i) => 4 * (i + 1));
  const types = new Uint8Array(cells).fill(TETRAHEDRON);
  const arrays = [field, positions, tets, ends, types];
  let offset = 0;
  const [values, places, corners, offsets, kinds] = arrays.map((array) => {
    const at = offset;
    offset += 8 + array.byteLength;
    return at;
  });
  const array = (type, label, more, at) => `<DataArray type="${type}" Name="${label}"${more} format="appended" offset="${at}"/>`;
  const head = `<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="${points}" NumberOfCells="${cells}">
<PointData Scalars="${plain(name)}">${array("Float32", plain(name), "", values)}</PointData>
<Points>${array("Float32", "Points", ' NumberOfComponents="3"', places)}</Points>
<Cells>${array("UInt32", "connectivity", "", corners)}${array("UInt32", "offsets", "", offsets)}${array("UInt8", "types", "", kinds)}</Cells>
</Piece></UnstructuredGrid>
<AppendedData encoding="raw">_`;
  const appended = arrays.flatMap((one) => [BigUint64Array.of(BigInt(one.byteLength)), one]);
  return /** @type {BlobPart[]} */ ([head, ...appended, "</AppendedData></VTKFile>\n"]);
}

/** The same numbers, the highest byte first. */
function swapped(array) {
  const bytes = new Uint8Array(array.buffer.slice(array.byteOffset, array.byteOffset + array.byteLength));
  for (let i = 0; i < bytes.length; i += 4) bytes.subarray(i, i + 4).reverse();
  return bytes;
}

/**
 * Legacy VTK, binary: numbers have the highest byte first.
 *
 * @param {TetMesh} mesh @param {string} name of the field @returns {BlobPart[]}
 */
export function vtk({ positions, field, tets }, name) {
  const [points, cells] = [positions.length / 3, tets.length / 4];
  const corners = new Uint32Array(5 * cells);
  for (let i = 0; i < cells; i++) {
    corners[5 * i] = 4;
    corners.set(tets.subarray(4 * i, 4 * i + 4), 5 * i + 1);
  }
  const types = new Uint32Array(cells).fill(TETRAHEDRON);
  return [
    `# vtk DataFile Version 3.0\ntetralod\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS ${points} float\n`,
    swapped(positions),
    `\nCELLS ${cells} ${corners.length}\n`,
    swapped(corners),
    `\nCELL_TYPES ${cells}\n`,
    swapped(types),
    `\nPOINT_DATA ${points}\nSCALARS ${plain(name)} float 1\nLOOKUP_TABLE default\n`,
    swapped(field),
    "\n",
  ];
}

/** STL, binary. @param {Triangles} surface @returns {BlobPart[]} */
export function stl({ positions, indices }) {
  const count = indices.length / 3;
  const data = new DataView(new ArrayBuffer(84 + 50 * count));
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

/** PLY, binary, with normals or the value of the field at each vertex. @param {Triangles} surface @returns {BlobPart[]} */
export function ply({ positions, indices, values, normals, name }) {
  const [points, count] = [positions.length / 3, indices.length / 3];
  const label = plain(name);
  const properties = ["x", "y", "z", ...(normals ? ["nx", "ny", "nz"] : []), ...(values ? [label] : [])];
  const width = properties.length;
  const vertices = new Float32Array(width * points);
  for (let i = 0; i < points; i++) {
    vertices.set(positions.subarray(3 * i, 3 * i + 3), width * i);
    if (normals) vertices.set(normals.subarray(3 * i, 3 * i + 3), width * i + 3);
    if (values) vertices[width * (i + 1) - 1] = values[i];
  }
  const faces = new DataView(new ArrayBuffer(13 * count));
  for (let i = 0; i < count; i++) {
    faces.setUint8(13 * i, 3);
    for (let k = 0; k < 3; k++) faces.setUint32(13 * i + 1 + 4 * k, indices[3 * i + k], true);
  }
  const head = ["ply", "format binary_little_endian 1.0", "comment tetralod", `element vertex ${points}`]
    .concat(properties.map((property) => `property float ${property}`))
    .concat([`element face ${count}`, "property list uchar uint vertex_indices", "end_header", ""]);
  return [head.join("\n"), vertices, faces];
}

/** The smallest and the largest of each coordinate. */
function bounds(positions) {
  const [min, max] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  positions.forEach((x, i) => {
    min[i % 3] = Math.min(min[i % 3], x);
    max[i % 3] = Math.max(max[i % 3], x);
  });
  return { min, max };
}

/** glTF 2.0, binary (`.glb`). The value of the field is the attribute `_VALUE`. @param {Triangles} surface @returns {BlobPart[]} */
export function glb({ positions, indices, values, normals }) {
  const [FLOAT, UINT, VERTICES, ELEMENTS] = [5126, 5125, 34962, 34963];
  /** @type {[array: Float32Array | Uint32Array, accessor: object, target: number, attribute?: string][]} */
  const all = [
    [indices, { componentType: UINT, count: indices.length, type: "SCALAR" }, ELEMENTS],
    [positions, { componentType: FLOAT, count: positions.length / 3, type: "VEC3", ...bounds(positions) }, VERTICES, "POSITION"],
  ];
  if (normals) all.push([normals, { componentType: FLOAT, count: normals.length / 3, type: "VEC3" }, VERTICES, "NORMAL"]);
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
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes, indices: 0, material: 0 }] }],
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

/** Comma-separated values. Numbers that are missing are empty. @param {(string | number | undefined)[][]} rows @returns {BlobPart[]} */
export function csv(rows) {
  const cell = (value) => (typeof value === "string" ? (/[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value) : (value ?? ""));
  return [`${rows.map((row) => row.map(cell).join(",")).join("\n")}\n`];
}
