/** Surfaces of a volume as a `BufferGeometry` of three.js, which is updated in place. */

import { Surface } from "./surfaces.js";
import { checkNames } from "./tools.js";

/** Arrays that are too short are replaced by ones with room for so many times as much. */
const ROOM = 1.5;

export async function createSurface(volume, what, options = {}) {
  checkNames(options, ["three", "color"]);
  const { three = await import("three"), color } = options;
  const surface = new ThreeSurface(volume, what, three, color);
  await surface.update();
  return surface;
}

class ThreeSurface {
  #three;
  #color;
  #surface;

  constructor(volume, what, three, color) {
    this.#three = three;
    this.#color = color;
    this.geometry = new three.BufferGeometry();
    this.#surface = new Surface(volume, what, (triangles) => this.#take(triangles));
  }

  /** What the positions of the geometry are relative to. @type {[number, number, number]} */
  origin = [0, 0, 0];
  /** What the attribute `value` is relative to. */
  offset = 0;
  scale = 1;
  /** What is known of each field that was asked for, and the name of its attribute. */
  fields = [];

  async update(what) {
    await this.#surface.update(what);
    return this.geometry;
  }

  dispose() {
    this.#surface.dispose();
    this.geometry.dispose();
  }

  [Symbol.dispose ?? Symbol.for("Symbol.dispose")]() {
    this.dispose();
  }

  #take({ positions, indices, normals, values, origin, offset, scale, fields = [] }) {
    const before = this.fields.map(({ attribute }) => [attribute, [undefined, 1]]);
    Object.assign(this, { origin, offset, scale });
    this.fields = fields.map(({ values, ...field }, i) => ({ ...field, attribute: `field${i}` }));
    const arrays = {
      position: [positions, 3],
      normal: [normals, 3],
      value: [values, 1],
      color: [this.#colors(values), 3],
      ...Object.fromEntries(before),
      ...Object.fromEntries(fields.map(({ values }, i) => [`field${i}`, [values, 1]])),
      index: [indices, 1],
    };
    if (!Object.entries(arrays).every(([name, [array]]) => this.#fits(name, array))) this.#replace(arrays);
    for (const [name, [array]] of Object.entries(arrays)) {
      const attribute = this.#attribute(name);
      if (!array || !attribute) continue;
      attribute.array.set(array);
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, array.length);
      attribute.needsUpdate = true;
    }
    this.geometry.setDrawRange(0, indices.length);
    // Of what is drawn: there is more in the arrays.
    const box = (this.geometry.boundingBox ??= new this.#three.Box3());
    this.geometry.boundingSphere ??= new this.#three.Sphere();
    box.setFromArray(positions);
    box.getBoundingSphere(this.geometry.boundingSphere);
  }

  #attribute(name) {
    return name === "index" ? this.geometry.index : this.geometry.getAttribute(name);
  }

  #fits(name, array) {
    const attribute = this.#attribute(name);
    return array ? attribute?.array.length >= array.length : !attribute;
  }

  /** Gives the geometry other arrays; the GPU forgets the ones before. */
  #replace(arrays) {
    this.geometry.dispose();
    for (const [name, [array, size]] of Object.entries(arrays)) {
      if (!array) {
        this.geometry.deleteAttribute(name);
        continue;
      }
      const before = this.#attribute(name)?.array.length ?? 0;
      const room = before === 0 ? array.length : Math.max(before, size * Math.ceil((ROOM * array.length) / size));
      const attribute = new this.#three.BufferAttribute(new array.constructor(room), size);
      attribute.setUsage(this.#three.DynamicDrawUsage);
      if (name === "index") this.geometry.setIndex(attribute);
      else this.geometry.setAttribute(name, attribute);
    }
  }

  #colors(values) {
    if (!this.#color || !values) return undefined;
    const colors = new Float32Array(3 * values.length);
    values.forEach((value, i) => colors.set(this.#color(this.offset + this.scale * value), 3 * i));
    return colors;
  }
}
