// What is around the element in a page of `tetralod html` and in the editor of VS Code: a menu changes what is shown, and the status says how
// good the mesh is. It uses the element's public properties alone.

/** Nothing that a mode shows. */
const NOTHING = { isosurfaces: [], volume: null, slices: [], boundary: null, cells: null, streamlines: null, arrows: null };
const percent = (part) => `${(100 * part).toPrecision(part < 0.001 ? 1 : 2).replace(/\.0$/, "")} %`;
const short = (value) => Number(value.toPrecision(4)).toString();

/** Has the browser save a picture. */
function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/**
 * Shows `source`, or later what the element gets as such. `about` has the `name` of the file and the `request`; of what is shown the `scene`,
 * else the element chooses; and the `camera` with its distance in the `narrowest` window, else all of the volume is seen.
 */
export function present(about, source, save = download) {
  const element = document.querySelector("tetralod-viewer");
  const status = document.getElementById("status");
  const legend = document.getElementById("legend");
  const menu = /** @type {HTMLDetailsElement} */ (document.getElementById("menu"));
  /** @type {Record<string, any>} */
  const controls = menu.querySelector("form").elements;

  let first = about.scene && { ...NOTHING, ...about.scene };
  let scene = first;
  let request = about.request;

  /** In a narrow window, the camera is farther away. */
  function camera() {
    const aspect = element.clientWidth / element.clientHeight;
    return { ...about.camera, distance: Math.max(about.camera.distance, about.narrowest / aspect) };
  }

  function show(changes) {
    scene = { ...scene, ...changes };
    element.state = scene;
    arrange();
  }

  function ask(changes) {
    request = changes;
    element.request = request;
  }

  /** The number of the field that is shown. */
  const shown = () => (typeof request.field === "number" ? request.field : element.info.firstField);
  const fieldOf = () => element.info.fields[shown()];

  /** The interval that a plane across an axis can be in. */
  const reach = (/** @type {number} */ axis) => /** @type {[number, number]} */ ([element.info.bounds[axis], element.info.bounds[axis + 3]]);
  const axisOf = ({ normal }) => normal.map(Math.abs).indexOf(Math.max(...normal.map(Math.abs)));
  const middle = (axis) => (reach(axis)[0] + reach(axis)[1]) / 2;
  const across = (axis, offset) => ({ normal: [0, 1, 2].map((k) => (k === axis ? 1 : 0)), offset });

  /** Shows a control, and what it is at between two ends. */
  function slide(control, is, value, [low, high]) {
    control.parentElement.hidden = !is;
    if (!is) return;
    control.value = String(high > low ? (1000 * (value - low)) / (high - low) : 500);
    control.previousElementSibling.value = short(value);
  }

  /** The controls follow what is shown. */
  function arrange() {
    if (!element.info) return;
    const field = fieldOf();
    const [surface] = scene.isosurfaces;
    slide(controls.value, surface !== undefined, surface?.value ?? field.isovalue, [field.min, field.max]);
    const [slice] = scene.slices;
    const axis = slice ? axisOf(slice) : 2;
    controls.axis.parentElement.hidden = !slice;
    controls.axis.value = "xyz"[axis];
    slide(controls.position, slice !== undefined, slice ? slice.offset / slice.normal[axis] : 0, reach(axis));
    const map = scene.colours?.map ?? "viridis";
    if (![...controls.map.options].some(({ value }) => value === map)) controls.map.add(new Option(map));
    controls.map.value = map;
  }

  const MODES = {
    isosurface: () => ({ isosurfaces: [{ value: fieldOf().isovalue }] }),
    volume: () => ({ volume: {} }),
    slice: () => ({ slices: [across(2, middle(2))] }),
    boundary: () => ({ boundary: {} }),
    cells: () => ({ cells: {} }),
  };
  const place = (control, [low, high]) => low + (Number(control.value) / 1000) * (high - low);

  const ON = {
    mode: ({ value }) => show(value ? { ...NOTHING, ...MODES[value]() } : first),
    field({ value }) {
      // Needs that name a field are of that one no longer.
      const { needs, ...own } = request;
      const of = { field: Number(value) };
      ask({ ...own, ...of, ...(needs ? { needs: needs.map(({ field, ...need }) => need) } : {}) });
      const { isovalue } = fieldOf();
      const { range, ...colours } = scene.colours ?? {};
      show({
        colours,
        isosurfaces: scene.isosurfaces.map((surface) => ({ ...surface, value: isovalue })),
      });
    },
    value: (control) => {
      const { min, max } = fieldOf();
      show({ isosurfaces: [{ ...scene.isosurfaces[0], value: place(control, [min, max]) }, ...scene.isosurfaces.slice(1)] });
    },
    axis: ({ value }) => show({ slices: [{ ...scene.slices[0], ...across("xyz".indexOf(value), middle("xyz".indexOf(value))) }] }),
    position(control) {
      const axis = axisOf(scene.slices[0]);
      show({ slices: [{ ...scene.slices[0], offset: place(control, reach(axis)) * scene.slices[0].normal[axis] }, ...scene.slices.slice(1)] });
    },
    map: ({ value }) => show({ colours: { ...scene.colours, map: value } }),
    detail: ({ value }) => ask(value ? { error: value, field: shown() } : { ...about.request, field: shown() }),
  };
  menu.addEventListener("input", (/** @type {any} */ { target }) => ON[target.name]?.(target));

  controls.home.addEventListener("click", () => element.viewer?.home());
  controls.save.addEventListener("click", async () => {
    save(await element.viewer.screenshot(), `${about.name.replace(/\.[^.]*$/, "")}.png`);
  });

  element.addEventListener("load", ({ detail: { info } }) => {
    const { camera, background, ...drawn } = element.state;
    first ??= { ...NOTHING, ...drawn };
    scene ??= first;
    // The camera is where the user has it from now on.
    element.state = scene;
    controls.field.replaceChildren(...info.fields.map(({ name, time }, index) => new Option(time === undefined ? name : `${name} at ${time}`, String(index))));
    controls.field.value = String(shown());
    controls.field.parentElement.hidden = info.fields.length < 2;
    arrange();
    controls.mode.querySelector("[value=volume]").disabled = element.viewer.renderer === "webgl";
    if (!menu.hidden) return;
    menu.hidden = false;
    // In a narrow window it would lie over what is shown.
    menu.open = innerWidth > 1100;
    // With the focus, the wheel zooms and keys turn. In a frame it is that of the page around.
    if (parent === window) element.shadowRoot.querySelector("canvas").focus({ preventScroll: true, focusVisible: false });
  });

  element.addEventListener("stats", ({ detail: { done, tetrahedra, relativeErrorBound, limitedBy } }) => {
    if (!done) return;
    const error = Number.isFinite(relativeErrorBound) ? `, error at most ${percent(relativeErrorBound)} of the range` : "";
    const less = limitedBy === "part" ? ". This page has no more detail." : "";
    status.textContent = `${tetrahedra.toLocaleString("en")} tetrahedra${error}${less}`;
    status.dataset.limitedBy = limitedBy;
  });

  element.addEventListener("legend", ({ detail }) => {
    legend.hidden = !detail;
    controls.map.parentElement.hidden = !detail;
    if (!detail) return;
    const [caption, bar, list] = /** @type {Iterable<HTMLElement>} */ (legend.children);
    caption.textContent = detail.label;
    bar.style.background = `linear-gradient(to right, ${detail.colours.join(", ")})`;
    const isFar = (/** @type {number} */ fraction) => fraction === 0 || fraction === 1 || (fraction > 0.15 && fraction < 0.85);
    const far = detail.ticks.filter(({ fraction }) => detail.labels.length > 0 || isFar(fraction));
    list.replaceChildren(
      ...far.map(({ label, fraction }) => {
        const tick = document.createElement("li");
        tick.textContent = label;
        tick.style.left = `${100 * fraction}%`;
        return tick;
      }),
    );
  });

  function failed() {
    if (element.info) return;
    status.textContent = `${element.querySelector("[slot=poster]") ? "A picture of it: the" : "The"} volume cannot be shown here.`;
  }
  element.addEventListener("error", failed);
  // Where nothing can draw, that has shown before this script began.
  if (element.failure) failed();

  Object.assign(element, { request, state: { ...scene, ...(about.camera && { camera: camera() }) }, source });
}
