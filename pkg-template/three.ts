/// <reference lib="esnext.disposable" preserve="true" />
/**
 * Surfaces of a volume in three.js (an optional peer dependency).
 *
 * ```js
 * import { createSurface } from "tetralod/three";
 *
 * const surface = await createSurface(mt, { isosurface: 0.5 });
 * const object = new THREE.Mesh(surface.geometry, new THREE.MeshStandardMaterial());
 * object.position.set(...surface.origin); // not 0 in volumes far from their origin
 * scene.add(object);
 * await mt.refine({ error: "0.1%", isovalues: [0.5] });
 * await surface.update(); // writes into the same geometry
 * ```
 */

import type { BufferAttribute, BufferGeometry } from "three";
import { DISPOSE } from "./dispose.js";
import { checkNames } from "./options.js";
import type { FieldValues } from "./results.js";
import { Surface, type SurfaceOptions, type Triangles } from "./surfaces.js";
import type { MeshTools } from "./tools.js";

export type { SurfaceOptions };

/** Arrays that are too short are replaced by ones with room for so many times as much. */
const ROOM = 1.5;

/** A geometry that shows a surface of the current mesh. */
export interface ThreeSurface {
  /**
   * Always the same object. Its attributes are `position` (relative to `origin`), `normal` (of isosurfaces; others want `flatShading`),
   * `value` (relative to `offset`), with the option `color`, `color`, and `field0`, `field1`, … of `fields`. They are longer than what is drawn: the draw range and the bounding box
   * and sphere are set.
   */
  readonly geometry: BufferGeometry;
  /**
   * What positions are relative to, in model units: `object.position.set(...surface.origin)` puts an object with the geometry where it is.
   * 0 unless the volume is far from its origin for its size; the same as `info.origin`.
   */
  readonly origin: [number, number, number];
  /** What the attribute `value` is relative to: a value is `offset + scale * v`, in field units. 0 and 1 unless the field needs it. */
  readonly offset: number;
  readonly scale: number;
  /**
   * The fields that `what` asked for (`fields`), in its order: each is the attribute of this name, of one number a vertex, and a value is
   * `offset + scale * v` in its own units. Empty if none were asked for.
   */
  readonly fields: readonly (Omit<FieldValues, "values"> & { attribute: string })[];
  /**
   * Extracts the surface from the mesh as it is now, and writes it into `geometry`. Where arrays are too short, it replaces
   * them. `what` asks for another surface, now and later. Of calls that are faster than the worker, the last one counts.
   *
   * @throws {TetralodError} `bad-option` if `what` is wrong, `freed` if the volume has been freed
   */
  update(what?: SurfaceOptions): Promise<BufferGeometry>;
  /** Frees the memory on the GPU. The volume stays open. */
  dispose(): void;
  [Symbol.dispose](): void;
}

export interface ThreeOptions {
  /** The module `three`, for a page that has loaded it in its own way. Default: it is imported by this name. */
  three?: typeof import("three");
  /**
   * The colour of a value in field units: red, green and blue, 0 to 1, in the working colour space of three.js; for materials with `vertexColors`.
   * Default: no colours.
   */
  color?: (value: number) => ArrayLike<number>;
}

/**
 * A geometry with a surface of the current mesh of `volume`: a `MultiTessellation` or a `Viewer`.
 *
 * @throws {TetralodError} `bad-option` if `what` is wrong, `not-ready` if the base mesh has not arrived
 */
export async function createSurface(volume: MeshTools, what: SurfaceOptions, options: ThreeOptions = {}): Promise<ThreeSurface> {
  checkNames(options, ["three", "color"]);
  const { three = await import("three"), color } = options;
  const surface = new Geometry(volume, what, three, color);
  await surface.update();
  return surface;
}

type Three = NonNullable<ThreeOptions["three"]>;

/** An array of one value or several a vertex; none where there is no such attribute. */
type Values = Float32Array | Uint32Array | undefined;

/** A field that was asked for, without its values. */
type KnownField = ThreeSurface["fields"][number];

class Geometry implements ThreeSurface {
  #three: Three;
  #color: ThreeOptions["color"];
  #surface: Surface;
  readonly geometry: BufferGeometry;
  origin: [number, number, number] = [0, 0, 0];
  offset = 0;
  scale = 1;
  fields: KnownField[] = [];

  constructor(volume: MeshTools, what: SurfaceOptions, three: Three, color: ThreeOptions["color"]) {
    this.#three = three;
    this.#color = color;
    this.geometry = new three.BufferGeometry();
    this.#surface = new Surface(volume, what, (triangles) => this.#take(triangles));
  }

  async update(what?: SurfaceOptions): Promise<BufferGeometry> {
    await this.#surface.update(what);
    return this.geometry;
  }

  dispose() {
    this.#surface.dispose();
    this.geometry.dispose();
  }

  [DISPOSE](): void {
    this.dispose();
  }

  #take({ positions, indices, normals, values, origin, offset, scale, fields = [] }: Triangles) {
    const before = this.fields.map(({ attribute }) => [attribute, [undefined, 1]]);
    Object.assign(this, { origin, offset, scale });
    this.fields = fields.map(({ values, ...field }, i) => ({ ...field, attribute: `field${i}` }));
    const arrays: Record<string, [Values, number]> = {
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
    box.setFromArray(positions);
    box.getBoundingSphere((this.geometry.boundingSphere ??= new this.#three.Sphere()));
  }

  #attribute(name: string): BufferAttribute | null | undefined {
    return name === "index" ? this.geometry.index : this.geometry.getAttribute(name);
  }

  #fits(name: string, array: Values): boolean {
    const attribute = this.#attribute(name);
    return array ? attribute !== undefined && attribute !== null && attribute.array.length >= array.length : !attribute;
  }

  /** Gives the geometry other arrays; the GPU forgets the ones before. */
  #replace(arrays: Record<string, [Values, number]>) {
    this.geometry.dispose();
    for (const [name, [array, size]] of Object.entries(arrays)) {
      if (!array) {
        this.geometry.deleteAttribute(name);
        continue;
      }
      const before = this.#attribute(name)?.array.length ?? 0;
      const room = before === 0 ? array.length : Math.max(before, size * Math.ceil((ROOM * array.length) / size));
      const attribute = new this.#three.BufferAttribute(new (array.constructor as Float32ArrayConstructor | Uint32ArrayConstructor)(room), size);
      attribute.setUsage(this.#three.DynamicDrawUsage);
      if (name === "index") this.geometry.setIndex(attribute);
      else this.geometry.setAttribute(name, attribute);
    }
  }

  #colors(values: Float32Array | undefined): Float32Array | undefined {
    if (!this.#color || !values) return undefined;
    const [color, colors] = [this.#color, new Float32Array(3 * values.length)];
    values.forEach((value, i) => colors.set(color(this.offset + this.scale * value), 3 * i));
    return colors;
  }
}
