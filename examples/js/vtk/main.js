import "@kitware/vtk.js/Rendering/Profiles/Geometry.js";
import vtkActor from "@kitware/vtk.js/Rendering/Core/Actor.js";
import vtkMapper from "@kitware/vtk.js/Rendering/Core/Mapper.js";
import vtkGenericRenderWindow from "@kitware/vtk.js/Rendering/Misc/GenericRenderWindow.js";
import { MultiTessellation } from "tetralod";
import { createSurface } from "tetralod/vtk";

const view = vtkGenericRenderWindow.newInstance({ background: [0.2, 0.2, 0.27] });
view.setContainer(document.querySelector("#view"));
view.resize();

const mt = await MultiTessellation.open(new URL("bucky.mt", document.baseURI));
await mt.refine({ error: "10%" });
const surface = await createSurface(mt, { slice: { normal: [0, 0, 1], offset: 0.5 } });
const mapper = vtkMapper.newInstance();
mapper.setInputData(surface.polyData);
const actor = vtkActor.newInstance();
actor.setMapper(mapper);
view.getRenderer().addActor(actor);
view.getRenderer().resetCamera();
view.getRenderWindow().render();

// Finer, in the same polydata.
await mt.refine({ error: "1%" });
await surface.update();
view.getRenderWindow().render();
