/** What the package uses of its optional peers, so that it is compiled without these. */
declare module "three" {
  export class BufferAttribute {
    constructor(array: Float32Array | Uint32Array, itemSize: number);
    readonly array: Float32Array | Uint32Array;
    needsUpdate: boolean;
    setUsage(usage: number): this;
    clearUpdateRanges(): void;
    addUpdateRange(start: number, count: number): void;
  }
  export class Box3 {
    setFromArray(array: ArrayLike<number>): this;
    getBoundingSphere(target: Sphere): Sphere;
  }
  export class Sphere {}
  export class BufferGeometry {
    index: BufferAttribute | null;
    boundingBox: Box3 | null;
    boundingSphere: Sphere | null;
    getAttribute(name: string): BufferAttribute | undefined;
    setAttribute(name: string, attribute: BufferAttribute): this;
    deleteAttribute(name: string): this;
    setIndex(index: BufferAttribute): this;
    setDrawRange(start: number, count: number): void;
    dispose(): void;
  }
  export const DynamicDrawUsage: number;
}
declare module "@kitware/vtk.js/Common/DataModel/PolyData.js" {
  export interface vtkPolyData {}
  const polyData: { newInstance(): any };
  export default polyData;
}
declare module "@kitware/vtk.js/Common/Core/DataArray.js" {
  const dataArray: { newInstance(initial?: object): any };
  export default dataArray;
}
