/**
 * Mouse, touch and keyboard on the canvas: rotate, zoom, pan, and drag the handles of the box.
 *
 * One finger or the left button rotates, or drags a handle; two fingers zoom and pan; the right or middle button, or
 * the left one with Shift, pans.
 */

/** Radians for a drag across the whole height of the canvas. */
const TURN = 3.2;
const KEY_TURN = 0.12;
const KEY_MOVE = 0.06;
const KEY_ZOOM = 1.15;

/**
 * @param {HTMLCanvasElement} canvas
 * @param {import("tetralod/viewer").Viewer} viewer
 * @param {{ onHome: () => void, onBox: (box: number[]) => void }} actions
 */
export function attachControls(canvas, viewer, { onHome, onBox }) {
  /** The last position of each pressed pointer. @type {Map<number, { x: number, y: number }>} */
  const pointers = new Map();
  /** The handle that is being dragged, −1 for none, null until `pickRegion` has answered. */
  let handle = -1;
  /** Counts presses: a late answer of `pickRegion` is for an earlier press and must be ignored. */
  let press = 0;
  let hovering = false;

  /** @type {(event: MouseEvent) => [number, number]} From -1 to 1 in both directions. */
  const point = (event) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    return [((event.clientX - left) / width) * 2 - 1, 1 - ((event.clientY - top) / height) * 2];
  };

  const ignore = (error) => {
    if (error?.code !== "freed") console.warn(error);
  };

  canvas.addEventListener("pointerdown", async (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const mine = ++press;
    if (pointers.size > 1 || event.button !== 0 || event.shiftKey) {
      handle = -1;
      return;
    }
    handle = null;
    const found = await viewer.pickRegion(...point(event)).catch(() => -1);
    if (mine === press && handle === null) {
      handle = found;
      canvas.classList.toggle("on-handle", found >= 0);
      canvas.classList.toggle("turning", found < 0 && pointers.size > 0);
    }
  });

  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) {
      hover(event);
      return;
    }
    if (handle === null) return;
    const height = canvas.clientHeight;
    const [dx, dy] = [(event.clientX - last.x) / height, (event.clientY - last.y) / height];
    if (handle >= 0) drag(event);
    else if (pointers.size === 2) pinch(event, dx, dy);
    else if (pointers.size === 1) {
      const moves = event.shiftKey || (event.buttons & 6) !== 0;
      (moves ? viewer.pan(dx, -dy) : viewer.orbit(dx * TURN, -dy * TURN)).catch(ignore);
    }
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });

  function drag(event) {
    viewer.dragRegion(handle, ...point(event)).then(onBox, ignore);
  }

  function pinch(event, dx, dy) {
    const [[, other]] = [...pointers].filter(([id]) => id !== event.pointerId);
    const last = pointers.get(event.pointerId);
    const distance = (p) => Math.max(8, Math.hypot(p.x - other.x, p.y - other.y));
    viewer.zoom(distance(last) / distance({ x: event.clientX, y: event.clientY })).catch(ignore);
    // The middle between the fingers moves half as far as the one that moved.
    viewer.pan(dx / 2, -dy / 2).catch(ignore);
  }

  async function hover(event) {
    if (hovering || event.pointerType === "touch") return;
    hovering = true;
    const found = await viewer.pickRegion(...point(event)).catch(() => -1);
    hovering = false;
    if (pointers.size === 0) canvas.classList.toggle("on-handle", found >= 0);
  }

  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => {
      pointers.delete(/** @type {PointerEvent} */ (event).pointerId);
      press++;
      handle = -1;
      canvas.classList.remove("turning");
    });
  }

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());

  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      // Lines and pages to pixels; a pinch on a touchpad arrives as small wheel steps with Ctrl.
      const pixels = event.deltaY * [1, 16, 400][event.deltaMode] * (event.ctrlKey ? 6 : 1);
      viewer.zoom(Math.exp(Math.max(-400, Math.min(400, pixels)) * 0.0015), ...point(event)).catch(ignore);
    },
    { passive: false },
  );

  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) viewer.pan(arrow[0] * KEY_MOVE, arrow[1] * KEY_MOVE).catch(ignore);
    else if (arrow) viewer.orbit(arrow[0] * KEY_TURN, arrow[1] * KEY_TURN).catch(ignore);
    else if (event.key === "+" || event.key === "=") viewer.zoom(1 / KEY_ZOOM).catch(ignore);
    else if (event.key === "-" || event.key === "_") viewer.zoom(KEY_ZOOM).catch(ignore);
    else if (event.key === "Home" || event.key === "r" || event.key === "R") onHome();
    else return;
    event.preventDefault();
  });
}
