/**
 * Mouse, touch and keyboard on the canvas: rotate, zoom, pan, and drag the handles of the box.
 *
 * One finger or the left button rotates, or drags a handle; two fingers zoom and pan; the right or middle button, or
 * the left one with Shift, pans; the left one with Alt spans a rectangle. What moves less than a few pixels is a click.
 * A rotation that is let go of runs out slowly, unless the system asks for less motion.
 *
 * Where the page flies, the pointer turns the eye, and the keys W, A, S, D, Q, E move it; with Shift faster.
 */

/** Radians for a drag across the whole height of the canvas. */
const TURN = 3.2;
const KEY_TURN = 0.12;
const KEY_MOVE = 0.06;
const KEY_ZOOM = 1.15;
/** A press that has moved no farther than this is a click (in pixels). */
const CLICK = 4;
/** A rotation runs out: it gets slower by the factor e in this time, and ends at this speed (ms, radians a ms). */
const RUN_OUT = 220;
const SLOWEST = 5e-5;
/** A pointer that has rested for this long before it is let go of does not throw (in ms). */
const THROW = 60;
/** Distances to the model that the eye flies in a ms; with Shift so many times as far. */
const FLIGHT = 6e-4;
const FASTER = 4;
/** Directions of flight: right, up, ahead. @type {Record<string, [number, number, number]>} */
const FLIGHTS = { w: [0, 0, 1], s: [0, 0, -1], a: [-1, 0, 0], d: [1, 0, 0], e: [0, 1, 0], q: [0, -1, 0] };

/** @typedef {[x: number, y: number]} Point of the canvas, −1 to 1, y upwards. */
/** @typedef {{ x: number, y: number }} Place of the page, in pixels. */

/**
 * What the page does. Of a rectangle that is being spanned, `onSpan` gets the places; of one that is done, the points, too.
 *
 * @typedef {{ onHome: () => void, onBox: (box: Promise<number[]>) => void, onClick: (point: Point) => void,
 *   onHover: (point: Point, place: Place) => void, onLeave: () => void,
 *   onSpan: (from?: Place, to?: Place, points?: [Point, Point]) => void, isFlying: () => boolean }} Actions
 */

/**
 * @param {HTMLCanvasElement} canvas
 * @param {import("tetralod/viewer").Viewer} viewer
 * @param {Actions} actions
 */
export function attachControls(canvas, viewer, { onHome, onBox, onClick, onHover, onLeave, onSpan, isFlying }) {
  /** The last position of each pressed pointer. @type {Map<number, { x: number, y: number }>} */
  const pointers = new Map();
  /** The handle that is being dragged, −1 for none, null until `pickRegion` has answered. @type {number | null} */
  let handle = -1;
  /** Counts presses: a late answer of `pickRegion` is for an earlier press and must be ignored. */
  let press = 0;
  let hovering = false;
  /** The press that may become a click or a rectangle. @type {{ place: Place, point: Point, spans: boolean } | undefined} */
  let began;

  /** The speed of the rotation, in radians a ms, and when it was measured. */
  let swing = { right: 0, up: 0, time: 0 };
  /** Counts rotations that run out: a new press ends the one before. */
  let running = 0;
  /** The keys of flight that are held. @type {Set<string>} */
  const held = new Set();
  let isFast = false;

  /** @type {(event: MouseEvent) => Point} */
  const point = (event) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    return [((event.clientX - left) / width) * 2 - 1, 1 - ((event.clientY - top) / height) * 2];
  };

  /** @type {(event: MouseEvent) => Place} */
  const place = (event) => ({ x: event.clientX, y: event.clientY });

  /** Whether the pointer is still where it was pressed. @param {MouseEvent} event @param {Place} from */
  const isNear = (event, from) => Math.hypot(event.clientX - from.x, event.clientY - from.y) <= CLICK;

  const ignore = (/** @type {any} */ error) => {
    if (error?.code !== "freed") console.warn(error);
  };

  canvas.addEventListener("pointerdown", async (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const mine = ++press;
    running++;
    onLeave();
    const isPlain = pointers.size === 1 && event.button === 0 && !event.shiftKey;
    began = isPlain ? { place: place(event), point: point(event), spans: event.altKey } : undefined;
    if (began?.spans) return;
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
    if (began?.spans) return onSpan(began.place, place(event));
    // The picture stays while it may be a click.
    if (handle === null || (began && isNear(event, began.place))) return;
    began = undefined;
    const height = canvas.clientHeight;
    const [dx, dy] = [(event.clientX - last.x) / height, (event.clientY - last.y) / height];
    if (handle >= 0) onBox(viewer.dragRegion(handle, ...point(event)));
    else if (pointers.size === 2) pinch(event, last, dx, dy);
    else if (pointers.size === 1) {
      const moves = event.shiftKey || (event.buttons & 6) !== 0;
      if (moves) viewer.pan(dx, -dy).catch(ignore);
      else turn(event, dx * TURN, -dy * TURN);
    }
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });

  /** @param {PointerEvent} event @param {number} right @param {number} up */
  function turn(event, right, up) {
    if (isFlying()) return void viewer.look(right, up).catch(ignore);
    const time = Math.max(event.timeStamp - swing.time, 1);
    // The mean over some events: single ones are uneven.
    const part = Math.min(time / THROW, 1);
    const mean = (/** @type {number} */ before, /** @type {number} */ now) => (1 - part) * before + part * (now / time);
    swing = { right: mean(swing.right, right), up: mean(swing.up, up), time: event.timeStamp };
    viewer.orbit(right, up).catch(ignore);
  }

  /** Lets the rotation run out. */
  function runOut() {
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return;
    const mine = ++running;
    let { right, up } = swing;
    let last = performance.now();
    const step = (/** @type {number} */ now) => {
      const time = Math.min(Math.max(now - last, 0), 50);
      last = now;
      if (mine !== running || Math.hypot(right, up) < SLOWEST) return;
      viewer.orbit(right * time, up * time).catch(ignore);
      const left = Math.exp(-time / RUN_OUT);
      [right, up] = [right * left, up * left];
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  /** Flies while keys are held. */
  function fly(last = performance.now()) {
    requestAnimationFrame((now) => {
      if (held.size === 0 || !isFlying()) return held.clear();
      const far = Math.min(Math.max(now - last, 0), 50) * FLIGHT * (isFast ? FASTER : 1);
      const sum = [0, 1, 2].map((i) => [...held].reduce((all, key) => all + FLIGHTS[key][i], 0) * far);
      viewer.fly(sum[0], sum[1], sum[2]).catch(ignore);
      fly(now);
    });
  }

  /** @param {PointerEvent} event @param {Place} last where that finger was @param {number} dx @param {number} dy */
  function pinch(event, last, dx, dy) {
    const [[, other]] = [...pointers].filter(([id]) => id !== event.pointerId);
    const distance = (/** @type {Place} */ p) => Math.max(8, Math.hypot(p.x - other.x, p.y - other.y));
    viewer.zoom(distance(last) / distance({ x: event.clientX, y: event.clientY })).catch(ignore);
    // The middle between the fingers moves half as far as the one that moved.
    viewer.pan(dx / 2, -dy / 2).catch(ignore);
  }

  async function hover(/** @type {PointerEvent} */ event) {
    if (event.pointerType === "touch") return;
    onHover(point(event), place(event));
    if (hovering) return;
    hovering = true;
    const found = await viewer.pickRegion(...point(event)).catch(() => -1);
    hovering = false;
    if (pointers.size === 0) canvas.classList.toggle("on-handle", found >= 0);
  }

  canvas.addEventListener("pointerleave", onLeave);

  /** A press has ended: it was a rectangle, a click, or nothing of these. @param {PointerEvent} event */
  function end(event) {
    if (!began) return;
    const { spans, point: from } = began;
    const stayed = isNear(event, began.place);
    if (spans) onSpan(undefined, undefined, stayed ? undefined : [from, point(event)]);
    // Also on a handle: that there is one may not be known yet, and a click must not depend on it.
    else if (stayed) onClick(point(event));
    began = undefined;
  }

  for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) {
    canvas.addEventListener(name, (event) => {
      if (name === "pointerup") end(event);
      else if (began?.spans) onSpan(undefined, undefined);
      began = undefined;
      pointers.delete(event.pointerId);
      press++;
      if (handle === -1 && pointers.size === 0 && event.timeStamp - swing.time < THROW) runOut();
      swing = { right: 0, up: 0, time: 0 };
      handle = -1;
      canvas.classList.remove("turning");
    });
  }

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());

  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      running++;
      // Lines and pages to pixels; a pinch on a touchpad arrives as small wheel steps with Ctrl.
      const pixels = event.deltaY * [1, 16, 400][event.deltaMode] * (event.ctrlKey ? 6 : 1);
      viewer.zoom(Math.exp(Math.max(-400, Math.min(400, pixels)) * 0.0015), ...point(event)).catch(ignore);
    },
    { passive: false },
  );

  /** @type {Record<string, [number, number]>} */
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    running++;
    isFast = event.shiftKey;
    const key = event.key.toLowerCase();
    if (isFlying() && FLIGHTS[key]) {
      if (held.size === 0) fly();
      held.add(key);
      return event.preventDefault();
    }
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) viewer.pan(arrow[0] * KEY_MOVE, arrow[1] * KEY_MOVE).catch(ignore);
    else if (arrow) viewer.orbit(arrow[0] * KEY_TURN, arrow[1] * KEY_TURN).catch(ignore);
    else if (event.key === "+" || event.key === "=") viewer.zoom(1 / KEY_ZOOM).catch(ignore);
    else if (event.key === "-" || event.key === "_") viewer.zoom(KEY_ZOOM).catch(ignore);
    else if (event.key === "p" || event.key === "P") onClick([0, 0]);
    else if (event.key === "Home" || event.key === "r" || event.key === "R") onHome();
    else return;
    event.preventDefault();
  });

  canvas.addEventListener("keyup", (event) => {
    isFast = event.shiftKey;
    held.delete(event.key.toLowerCase());
  });
  canvas.addEventListener("blur", () => held.clear());
}
