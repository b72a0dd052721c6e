/** What the types of the package take from optional peers, so that the reference is made without these. */
declare module "three" {
  export class BufferGeometry {}
}
declare module "@kitware/vtk.js/Common/DataModel/PolyData.js" {
  export interface vtkPolyData {}
}
