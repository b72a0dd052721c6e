/** What is drawn, as plain data, and what is told of the picture. */

/** A plane, `normal · p = offset`. As a clip plane it cuts away the side that `normal` points to. */
export interface PlaneState {
  /** Any length but zero. */
  normal: [number, number, number];
  /** `normal · p` of its points. */
  offset: number;
}

/** An isosurface. */
export interface IsosurfaceState {
  /** In field units; without it the `isovalue` of the field: see `FieldInfo`. */
  value?: number;
  /** 0 to 1; 1 without it. */
  opacity?: number;
  /** `"#rrggbb"`, for both sides; without it, and without `field`, each side has a colour of its own. */
  colour?: string;
  /** The name of the field whose values colour it. */
  field?: string;
  /** Draws the sides of its facets. */
  edges?: boolean;
}

/** The volume, as emission and absorption. */
export interface VolumeState {
  /** Values in field units, ascending, each with an opacity (0 to 1); a ramp over the range of the colours without it. */
  opacities?: [value: number, opacity: number][];
  /** Values, each with red, green, blue and opacity (0 to 1): in place of `opacities` and the colours of the scene. */
  points?: [value: number, red: number, green: number, blue: number, opacity: number][];
  /** The way, in model units, that has these opacities; a tenth of the domain's diagonal without it. */
  unitLength?: number;
  /** Whether clip planes cut it; they do without it. */
  clipped?: boolean;
}

/** A section with a plane, coloured by a field. */
export interface SliceState extends PlaneState {
  /** 0 to 1; 1 without it. */
  opacity?: number;
  /** Draws the edges of the tetrahedra that it cuts. */
  edges?: boolean;
  /** The field that colours it; the one that is shown without it. */
  field?: string;
  /** Whether clip planes cut it; they do without it. */
  clipped?: boolean;
}

/** The surface of the domain. What clip planes cut open is closed. */
export interface BoundaryState {
  /** 0 to 1; 1 without it. */
  opacity?: number;
  /**
   * Regions with another opacity (`info.regions`), by their names or labels. Where a region is more opaque than one beside it, its interface
   * with that is drawn, too: it is seen through the other.
   */
  regionOpacities?: Record<string, number>;
  /** Draws the edges of tetrahedra. */
  edges?: boolean;
  /** `"#rrggbb"`, in place of the colours of the values. */
  colour?: string;
  /** What gives it its colours: the values of the field without it, or the regions (`info.regions`). */
  colourBy?: "field" | "region";
  /** Whether clip planes cut it; they do without it. */
  clipped?: boolean;
}

/** The tetrahedra as they are. */
export interface CellState {
  /** `"solid"` without it. */
  shape?: "solid" | "wire" | "points";
  /** By which part of their size they are shrunk, 0 to 1. */
  shrink?: number;
  /** Leaves out tetrahedra, as a whole, with their centroid on the side that `normal` points to. */
  cut?: PlaneState;
  /** What colours them; the field without it. */
  colourBy?: "field" | "size" | "error" | "depth" | "block" | "missing" | "region";
  /** Whether edges are drawn; they are without it. */
  edges?: boolean;
  /** Width of wires and edges, in CSS pixels; points are four times as large. */
  width?: number;
}

/** Tubes along a vector field. */
export interface StreamlineState {
  /** The names of the fields along x, y and z. */
  fields: [string, string, string];
  /** Where they start, in model units. */
  seeds: [number, number, number][];
  /** In model units; 1/400 of the domain's diagonal without it. */
  radius?: number;
  /** The field that colours them; the speed without it, from 0 to the largest that the ranges of the components allow. */
  field?: string;
}

/** Arrows of a vector field. */
export interface ArrowState {
  /** The names of the fields along x, y and z. */
  fields: [string, string, string];
  /** From one to the next, in model units; 1/20 of the domain's diagonal without it. */
  spacing?: number;
  /** The field that colours them; the magnitude without it, with the colours of the speed of `streamlines`. */
  field?: string;
  /** Makes all of one length. */
  constant?: boolean;
}

/**
 * Everything is drawn where a vector displaces it. Places of the scene itself, of `pick` and of `reading` are those of the model as it is:
 * what planes and boxes cut moves along.
 */
export interface DeformState {
  /** The name of a vector of three components: that of `FieldInfo.vector`, that of fields that end in `_x`, `_y` and `_z`, or three fields with commas between. */
  field: string;
  /** How many times the vector. Without it nothing goes farther than a tenth of the domain's diagonal, in all meshes and at all times. */
  factor?: number;
  /** For what swings: how much of a period has passed. The displacement is that times the sine: none at 0, all at 0.25. Without it, all. */
  phase?: number;
  /** Draws the boundary as it is without displacement, too, so that one sees through it. */
  undeformed?: boolean;
}

/** Two meshes beside each other. */
export interface CompareState {
  /** Where the kept one ends and the current one begins, as a fraction of the width; 0.5 without it. */
  at?: number;
  /**
   * Colours the current one by its field minus that of the kept one, with a range that is symmetric around 0; `"coolwarm"` or
   * another diverging map shows it best.
   */
  difference?: boolean;
}

/** The colours of values. */
export interface ColourState {
  /** The name of a colour map, such as `"viridis"`, `"turbo"`, `"coolwarm"` or `"grey"`. */
  map?: string;
  /**
   * The values of the field that is shown with the first and the last colour. Without it, and for other fields: their range over all of
   * their time steps, so that a colour means the same at all times.
   */
  range?: [number, number];
  /** Lets the colours run backwards. */
  reversed?: boolean;
  /** A logarithmic scale; a `range` must be positive. Without one it has the positive part of the values, and is linear where there is none. */
  log?: boolean;
  /** So many colours, 2 to 64, each for an equal part of the range; without it they run into one another. */
  bands?: number;
}

/** Where the camera is. */
export interface CameraState {
  /** What it looks at, in model units. */
  target: [number, number, number];
  /** From there to the eye, in model units. */
  distance: number;
  /** The turn around z, in radians. */
  yaw: number;
  /** How far it looks from above, in radians. */
  pitch: number;
  projection: "perspective" | "orthographic";
}

/** What is drawn: any of these at once, in exact order, also where they are transparent. */
export interface SceneState {
  isosurfaces?: IsosurfaceState[];
  volume?: VolumeState;
  slices?: SliceState[];
  boundary?: BoundaryState;
  cells?: CellState;
  streamlines?: StreamlineState;
  arrows?: ArrowState;
  deform?: DeformState;
  /** Planes that cut away; with a `clipBox`, which counts as six, at most 16. */
  clips?: PlaneState[];
  /** Everything outside of this box is cut away: `[x0, y0, z0, x1, y1, z1]`. */
  clipBox?: [number, number, number, number, number, number];
  colours?: ColourState;
  /** `"dark"` without it. */
  background?: "dark" | "light" | "transparent";
  /** How dark places get that hardly any light reaches, 0 to 1; 0.5 without it. */
  shade?: number;
  /** Whether the box around the domain is drawn; it is without it. */
  outline?: boolean;
  /** The mesh that was kept by `keep` on the left, the current one on the right. */
  compare?: CompareState;
  /**
   * The regions of the volume that are shown (`info.regions`), by their names or labels; all without it. Others are neither drawn nor
   * fetched nor refined, unless a need of the request names them in its own `regions`.
   */
  regions?: (string | number)[];
  /**
   * What is shown by the values of a field; all without it. It is a picture only: pass `ranges` to `refine` to fetch nothing else.
   */
  threshold?: ThresholdState;
  /** A box with handles. It is a picture only: pass `box` to `refine` to use it. */
  region?: ArrayLike<number>;
}

/**
 * What is shown: where a field has a value within a range, ends included. What is drawn of all else is nothing, so the boundary is that of what
 * is shown; the viewer's `mesh()`, `surface()`, `stats()` and its other tools are of it, too.
 */
export interface ThresholdState {
  /** In field units, ascending. */
  range: [low: number, high: number];
  /** The field; the one that is shown without it. */
  field?: string;
  /**
   * Whether tetrahedra are cut where the field crosses an end of the range, so that the boundary is smooth there. Without it they are shown as a
   * whole: those whose four vertices have a value within it.
   */
  cut?: boolean;
}

/** All that can be set: what is drawn, and where from. Plain data, for JSON and URLs. */
export interface ViewerState extends SceneState {
  camera?: CameraState;
}

/** ViewerChanges of what is set: what is named replaces what was there, `null` gives it its default. */
export type ViewerChanges = { [K in keyof ViewerState]?: ViewerState[K] | null };

/** A part of a scene that does not fit a volume, and is left out. */
export interface Misfit {
  /** Its name, such as `slices[0].field`. */
  part: string;
  /** What is wrong, in words. */
  problem: string;
}

/** What the colours of the picture mean. */
export interface Legend {
  /** The name of the field, or what tetrahedra are coloured by. */
  label: string;
  range: [number, number];
  log: boolean;
  /** Evenly spaced CSS colours from the lower to the upper end of the range; of a label (`isLabel`) equal parts for all that the mesh has. */
  colours: string[];
  /**
   * The ends of the range, and round numbers between them, ascending; `fraction` is where the tick is in the range, 0 to 1. Of a label some that
   * the mesh has, in the middle of their colours.
   */
  ticks: { value: number; label: string; fraction: number }[];
  /** Of a label (`isLabel`) all that the mesh has, ascending, with their CSS colours; empty for other fields. */
  labels: { value: number; colour: string }[];
  /** Of the difference to a mesh of another file: so many points of the mesh are outside of that one. They have no value, and their tetrahedra are not shown. */
  apart: number;
}

/** What is at a point. */
export interface Reading {
  /** In model units. */
  position: [number, number, number];
  /** The value of each field, by its name; of fields with several time steps at the time that is shown. */
  values: Record<string, number>;
  /** The value of each field, by its number in `info.fields`: at all time steps, as good as the mesh is at each. */
  all: number[];
  /** The number of the tetrahedron in the current mesh. */
  tet: number;
  /** The name of its region, as in `info.regions`; `undefined` without regions. */
  region: string | undefined;
  /** Its longest edge, in model units. */
  size: number;
  /** Its error, as a fraction of the field's range. */
  error: number;
}

/** An edge of the box around the domain that shows the ticks of an axis. */
export interface AxisOverlay {
  /** 0 to 2 for x, y, z. */
  axis: number;
  /** The ends of the edge's part on the canvas, at the smaller coordinate first. */
  ends: [[x: number, y: number], [x: number, y: number]];
  /** Where labels go: away from the box, a direction of length 1 in pixels, y upwards. */
  outward: [x: number, y: number];
  /** Ascending. */
  ticks: { label: string; at: [x: number, y: number] }[];
}

/** What an overlay over the picture draws. Points are points of the canvas: −1 to 1, y upwards. */
export interface Overlay {
  /** At most one for each axis; none for an axis that is seen end-on. */
  axes: AxisOverlay[];
  /**
   * A bar of a round length. `width` is its length as a fraction of the canvas's width. In perspective it holds at the distance
   * of the camera's target; `everywhere` is true where it holds at any distance.
   */
  scaleBar: { label: string; length: number; width: number; everywhere: boolean };
  /** Right, up and towards the eye, as directions in the model. */
  rotation: [right: number[], up: number[], towards: number[]];
  /** From the model to clip space, column by column: with it points of the model can be drawn over the picture. */
  matrix: number[];
  /** How the picture is displaced: a point goes by `factor` times `part` times the vector there; `part` is what the phase leaves, −1 to 1. */
  deformation: { factor: number; part: number } | undefined;
}
