// A viewer without a GPU, for tests of the page's own code: it has one small volume, and does at once what it is asked for.
const component = (name, number) => ({
  name,
  unit: "m/s",
  min: -1,
  max: 1,
  isovalue: 0,
  time: number,
  vector: { name: "velocity", component: "xyz".indexOf(name.at(-1)) },
});
const FIELDS = [0, 1, 2].flatMap((time) => [
  { name: "pressure", unit: "Pa", min: 1 + time, max: 10 + time, isovalue: 6.5, time },
  ...["velocity_x", "velocity_y", "velocity_z"].map((name) => component(name, time)),
]);

/** @type {Record<string, any>} */
const VOLUMES = {
  flow: { kind: "half-edge", vertices: 1000, tetrahedra: 5000, updates: 900, surfaceFirst: true, firstField: 0, bounds: [0, 0, 0, 2, 4, 8], fields: FIELDS },
  plain: {
    kind: "explicit",
    vertices: 300,
    tetrahedra: 1000,
    updates: 200,
    surfaceFirst: true,
    firstField: 0,
    bounds: [-1, -1, -1, 1, 1, 1],
    fields: [{ name: "density", unit: "", min: -2, max: 6, isovalue: 2, time: undefined }],
  },
};

const NAMES = [
  ...Array.from({ length: 12 }, (_, i) => `rotor/blade ${i + 1}`),
  "rotor/hub",
  ...Array.from({ length: 12 }, (_, i) => `stator/vane ${i + 1}`),
  "casing",
];
const REGIONS = NAMES.map((name, i) => ({
  name,
  labels: [i + 1],
  tetrahedra: 100,
  volume: i + 1,
  color: `#${(100 + 5 * i).toString(16)}8080`,
  bounds: [0, 0, 0, 1, 1, 1],
}));
VOLUMES.parts = { ...VOLUMES.plain, kind: "half-edge", surfaceFirst: false, regions: { arrays: ["part"], deviation: 0, all: REGIONS } };

const HOME = { target: [1, 2, 4], distance: 20, yaw: -0.75, pitch: 0.12, projection: "perspective" };

/** Where points are seen, whatever the camera. */
const OVERLAY = {
  axes: [],
  scaleBar: { label: "1 m", length: 1, width: 0.1, everywhere: true },
  rotation: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  matrix: [1, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0, 0, -1, -1, 0, 1],
};

export class TetralodError extends Error {}
export const absolute = (result) => result;
export const displaced = (result) => result;

export class Viewer extends EventTarget {
  static async create() {
    return new Viewer();
  }

  adapter = "none";
  isSoftware = true;
  renderer = "webgpu";
  frameTime = 60;
  info = undefined;
  legend = undefined;
  overlay = undefined;
  state = {};
  /** What the page has asked for. */
  requests = [];

  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  #move(camera) {
    this.state = { ...this.state, camera: { ...this.state.camera, ...camera } };
    this.#tell("camera", this.state.camera);
  }

  async open(source) {
    const [name] = /plain|parts/.exec(source.name ?? source) ?? ["flow"];
    this.info = VOLUMES[name];
    this.state = { camera: HOME };
    this.overlay = OVERLAY;
    this.#tell("overlay", OVERLAY);
    return { info: this.info, total: 1e6, finished: Promise.resolve() };
  }

  async refine(request) {
    this.requests.push(request);
    this.#tell("stats", {
      tetrahedra: 500,
      vertices: 100,
      applied: 50,
      refined: 5,
      coarsened: 0,
      milliseconds: 1,
      done: true,
      satisfied: true,
      relativeErrorBound: 0.01,
      fieldBound: 0.09,
      boundaryBound: 0,
      bounds: [0.01],
      bytes: 1000,
    });
  }

  async set(changes) {
    this.state = Object.fromEntries(Object.entries({ ...this.state, ...changes }).filter(([, value]) => value !== null));
    if (changes.camera) this.#tell("camera", changes.camera);
    this.#tell("frame", { ready: true, triangles: 10, uploaded: 10, gpuBytes: 10, milliseconds: 1, bytes: 1000 });
  }

  home = async () => this.#move(HOME);
  lookFrom = async (side) => this.#move({ yaw: side.length });
  orbit = async (right) => this.#move({ yaw: this.state.camera.yaw + right });
  zoom = async (factor) => this.#move({ distance: this.state.camera.distance * factor });
  reading = async (point) => ({
    position: point,
    values: Object.fromEntries(this.info.fields.map(({ name }) => [name, 1])),
    all: this.info.fields.map(() => 1),
    tet: 0,
    region: undefined,
    size: 1,
    error: 0.01,
  });
  pick = async (x, y) => this.reading([1 + x / 2, 2 + y / 2, 3]);
  line = async () => ({ at: [0, 1], values: [1, 2] });
  stats = async ({ fractions = [] }) => ({
    ...{ histogram: [1, 2, 3], percentiles: fractions.map((part) => 1 + part), volume: 351, mean: 1 },
    regions: this.info.regions?.all.map(({ name, tetrahedra, volume }) => ({
      name,
      tetrahedra,
      volume,
      min: 0,
      max: 2,
      mean: 1,
      deviation: 0.5,
      errorBound: 0.01,
    })),
  });
  surface = async () => ({ positions: [], values: [], indices: [] });
  pickRegion = async () => -1;
  pan = async () => {};
  mesh = async () => ({ positions: [], tets: [], fields: [] });
  keep = async () => {};
  free = () => {};
  freeze = async () => {};
  settled = async () => {};
  blockMap = async () => undefined;
}
