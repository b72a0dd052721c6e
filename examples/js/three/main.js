import * as THREE from "three";
import { MultiTessellation } from "tetralod";
import { createSurface } from "tetralod/three";

const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(480, 360);
document.body.append(renderer.domElement);
const camera = new THREE.PerspectiveCamera(40, 480 / 360, 0.1, 10);
camera.position.set(1.6, 1.2, 2);
camera.lookAt(0.5, 0.5, 0.5);
const scene = new THREE.Scene();
scene.background = new THREE.Color("#334");
scene.add(new THREE.HemisphereLight("#fff", "#432", 3));

const mt = await MultiTessellation.open("bucky.mt");
await mt.refine({ error: "10%" });
const surface = await createSurface(mt, { isosurface: 0.5 });
scene.add(new THREE.Mesh(surface.geometry, new THREE.MeshStandardMaterial({ color: "#da5", side: THREE.DoubleSide })));
renderer.render(scene, camera);

// Finer, in the same geometry.
await mt.refine({ error: "1%", isovalues: [0.5] });
await surface.update();
renderer.render(scene, camera);
