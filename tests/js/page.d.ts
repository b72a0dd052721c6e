/// <reference path="../../pkg/element.d.ts" />
// What the demo page tells the tests (`www/page.js`), and the names under which it imports the package.
interface Window {
  tetralodDemo: any;
  /** The times that the page has shown while it played. */
  stepsSeen: Set<string | null>;
}
// What `xtask/js/inline.mjs` puts into the bundle.
declare module "embedded:*" {
  const text: string;
  export default text;
}
// Optional peers: the examples install them.
declare module "three";
declare module "@kitware/vtk.js/*";
