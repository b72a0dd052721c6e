/** What a second file is shown with: what the first one is, as far as it has it. */

/** @typedef {import("tetralod").MtInfo} MtInfo */
/** @typedef {import("tetralod/viewer").SceneState} SceneState */
/** @typedef {import("tetralod/viewer").ViewerChanges} ViewerChanges */
/** @typedef {import("tetralod/viewer").ViewerRefineOptions} Request */

/** What is asked for of a file that does not have the field: it shows where the model is. */
const COARSE = "5%";

/** The number of a field in another file: that of its name, at the time that is nearest. @param {Pick<MtInfo, "fields">} there @param {{ name: string, time?: number | undefined }} field */
export function numberIn(there, { name, time = 0 }) {
  const far = (/** @type {number} */ number) => Math.abs((there.fields[number].time ?? 0) - time);
  const steps = [...there.fields.keys()].filter((number) => there.fields[number].name === name);
  return steps.sort((a, b) => far(a) - far(b))[0];
}

/**
 * What is drawn of a second file: what is drawn of the first one, without what names fields and regions that it does not have, which are
 * given, too. Without the field itself, its boundary has no colours.
 *
 * @param {ViewerChanges} scene
 * @param {string} shown the field
 * @param {MtInfo} here
 * @param {MtInfo} there
 * @returns {{ scene: ViewerChanges, missing: string[] }}
 */
export function linkedScene(scene, shown, here, there) {
  const has = (/** @type {string} */ name) => there.fields.some((field) => field.name === name);
  if (!has(shown)) {
    const nothing = { isosurfaces: [], volume: null, slices: [], cells: null, streamlines: null, arrows: null, deform: null, regions: null, threshold: null };
    return { scene: { ...scene, ...nothing, compare: null, boundary: { colour: "#9fb0c4" } }, missing: [shown] };
  }
  /** @type {Set<string>} */
  const missing = new Set();
  /** Whether the file has all of some fields; those that it does not have are noted. @param {readonly string[]} names */
  const hasAll = (names) => {
    const lost = names.filter((name) => !has(name));
    for (const name of lost) missing.add(name);
    return lost.length === 0;
  };
  /** Tubes or arrows. @template {{ fields: readonly string[], field?: string | undefined }} F @param {F | null | undefined} flow */
  const flow = (flow) => (flow && hasAll([...flow.fields, ...(flow.field ? [flow.field] : [])]) ? flow : null);
  const isosurfaces = [...(scene.isosurfaces ?? [])].map(({ field, ...surface }) => (field && hasAll([field]) ? { ...surface, field } : surface));
  const deform = scene.deform && hasAll(scene.deform.field.split(",")) ? scene.deform : null;
  const regions = new Set((there.regions?.all ?? []).map(({ name }) => name));
  const opacities = Object.entries(scene.boundary?.regionOpacities ?? {}).filter(([name]) => regions.has(name));
  const boundary = scene.boundary && { ...scene.boundary, regionOpacities: Object.fromEntries(opacities) };
  /** @type {ViewerChanges} */
  const own = { isosurfaces, streamlines: flow(scene.streamlines), arrows: flow(scene.arrows), deform, boundary, compare: null };
  return { scene: { ...scene, ...own, regions: linkedRegions(scene.regions, here, regions) }, missing: [...missing] };
}

/** Those of a second file that are shown: all but those that are hidden in the first one. @param {SceneState["regions"] | null} shown @param {MtInfo} here @param {Set<string>} there */
function linkedRegions(shown, here, there) {
  if (!shown) return null;
  const all = new Set(shown);
  const hidden = new Set((here.regions?.all ?? []).map(({ name }) => name).filter((name) => !all.has(name)));
  return [...there].filter((name) => !hidden.has(name));
}

/**
 * What is asked of the mesh of a second file: the same errors, in units of the field, in the same places.
 *
 * @param {Request} request
 * @param {MtInfo} here
 * @param {MtInfo} there
 * @returns {Request}
 */
export function linkedRequest({ maxTets, needs = [], ...first }, here, there) {
  const regions = new Set((there.regions?.all ?? []).map(({ name }) => name));
  /** @template {Request} N @param {N} need @returns {N[]} */
  const linked = (need) => {
    if (need.field === undefined) return [need];
    const field = here.fields[Number(need.field)];
    const number = numberIn(there, field);
    const own = need.regions && [...need.regions].filter((name) => regions.has(String(name)));
    if (number === undefined || own?.length === 0) return [];
    const range = field.max - field.min;
    const error = typeof need.error === "string" && range > 0 ? (Number.parseFloat(need.error) / 100) * range : need.error;
    return [{ ...need, field: number, error, ...(own ? { regions: own } : {}) }];
  };
  const [main = { error: COARSE }] = linked(first);
  const others = needs.flatMap((need) => linked(/** @type {Request} */ (need)));
  return /** @type {Request} */ ({ ...main, maxTets, ...(others.length > 0 ? { needs: others } : {}) });
}
