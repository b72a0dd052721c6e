// VTK.wasm: an isosurface of the grid. The module has no readers of files, so that this page decodes them. The window's `shown` and `turn`
// are what run.js looks at.
import { loadAsync } from "./node_modules/@kitware/vtk-wasm/dist/esm/index.mjs";

/** The head of a file of VTK's XML formats, as text, and the first array that is appended to it, compressed by zlib in blocks. */
async function read(url) {
  const bytes = new Uint8Array(await (await fetch(url)).arrayBuffer());
  const mark = '<AppendedData encoding="raw">';
  const [head] = new TextDecoder("latin1").decode(bytes.subarray(0, 4096)).split(mark);
  const at = bytes.indexOf("_".charCodeAt(0), head.length + mark.length) + 1;
  const view = new DataView(bytes.buffer);
  const number = (i) => Number(view.getBigUint64(at + 8 * i, true));
  const [count, size, last] = [number(0), number(1), number(2)];
  const whole = new Uint8Array(last ? (count - 1) * size + last : count * size);
  let from = at + 8 * (3 + count);
  for (let i = 0; i < count; i++) {
    const packed = bytes.subarray(from, (from += number(3 + i)));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    whole.set(new Uint8Array(await new Response(stream).arrayBuffer()), i * size);
  }
  return { head, values: new Float64Array(whole.buffer) };
}

const data = read("data/bucky.vti");
const runtime = await loadAsync({ url: new URL("data/vtk-wasm", location.href).href, urlIsGzip: false });
const { vtk } = runtime.createStandaloneSession();
const { head, values } = await data;
const numbers = (key) => new RegExp(`${key}="([^"]*)"`).exec(head)[1].split(" ").map(Number);
const grid = vtk.vtkImageData({ extent: numbers("WholeExtent"), origin: numbers("Origin"), spacing: numbers("Spacing") });
const array = vtk.vtkDoubleArray({ numberOfComponents: 1, name: "density" });
await array.setArray(values);
const pointData = await grid.getPointData();
pointData.addArray(array);
pointData.setActiveScalars("density");
const contour = vtk.vtkFlyingEdges3D({ computeNormals: true, computeScalars: false });
contour.setInputData(grid);
contour.setValue(0, 0.5);
const mapper = vtk.vtkPolyDataMapper({ scalarVisibility: false });
mapper.setInputConnection(await contour.getOutputPort());
const renderer = vtk.vtkRenderer({ background: [0.1, 0.1, 0.15] });
renderer.addActor(vtk.vtkActor({ mapper }));
const renderWindow = vtk.vtkRenderWindow({ canvasSelector: "#canvas" });
renderWindow.addRenderer(renderer);
renderWindow.setSize(640, 480);
renderer.resetCamera();
const camera = await renderer.getActiveCamera();
const canvas = document.querySelector("#canvas");
const pixel = new Uint8Array(4);
async function draw() {
  await renderWindow.render();
  const gl = canvas.getContext("webgl2");
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
}
await draw();
const [x, y, z] = camera.focalPoint;
const distance = Math.hypot(...camera.position.map((at, i) => at - camera.focalPoint[i]));
let angle = 0;
Object.assign(window, {
  shown: performance.now(),
  async turn() {
    angle += Math.PI / 60;
    // As `azimuth`, which the module does not offer.
    camera.setPosition(x + distance * Math.sin(angle), y, z + distance * Math.cos(angle));
    renderer.resetCameraClippingRange();
    await draw();
  },
});
