// vtk.js: an isosurface of the grid. The window's `shown` and `turn` are what run.js looks at.
import "@kitware/vtk.js/Rendering/OpenGL/Profiles/Geometry.js";
import vtkImageMarchingCubes from "@kitware/vtk.js/Filters/General/ImageMarchingCubes.js";
import vtkXMLImageDataReader from "@kitware/vtk.js/IO/XML/XMLImageDataReader.js";
import vtkOpenGLRenderWindow from "@kitware/vtk.js/Rendering/OpenGL/RenderWindow.js";
import vtkActor from "@kitware/vtk.js/Rendering/Core/Actor.js";
import vtkMapper from "@kitware/vtk.js/Rendering/Core/Mapper.js";
import vtkRenderer from "@kitware/vtk.js/Rendering/Core/Renderer.js";
import vtkRenderWindow from "@kitware/vtk.js/Rendering/Core/RenderWindow.js";

const response = await fetch("data/bucky.vti");
const reader = vtkXMLImageDataReader.newInstance();
reader.parseAsArrayBuffer(await response.arrayBuffer());
const grid = reader.getOutputData(0);
grid.getPointData().setActiveScalars("density");

const cubes = vtkImageMarchingCubes.newInstance({ contourValue: 0.5, computeNormals: true, mergePoints: true });
cubes.setInputData(grid);
const mapper = vtkMapper.newInstance();
mapper.setInputConnection(cubes.getOutputPort());
mapper.setScalarVisibility(false);
const actor = vtkActor.newInstance();
actor.setMapper(mapper);
const renderer = vtkRenderer.newInstance({ background: [0.1, 0.1, 0.15] });
renderer.addActor(actor);
const renderWindow = vtkRenderWindow.newInstance();
renderWindow.addRenderer(renderer);
const view = vtkOpenGLRenderWindow.newInstance();
view.setContainer(document.querySelector("div"));
view.setSize(640, 480);
renderWindow.addView(view);
renderer.resetCamera();
const camera = renderer.getActiveCamera();

const gl = view.get3DContext();
const pixel = new Uint8Array(4);
const draw = () => {
  renderWindow.render();
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
};
draw();
Object.assign(window, {
  shown: performance.now(),
  triangles: cubes.getOutputData().getNumberOfPolys(),
  turn() {
    camera.azimuth(3);
    renderer.resetCameraClippingRange();
    draw();
  },
});
