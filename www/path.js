/** The way from probe to probe: its legs, the angle where two meet, and the field along it. */

import { across, plus, unit } from "./geometry.js";
import { viewer } from "./page.js";
import { AXES } from "./volume.js";

/** @typedef {import("./volume.js").Point} Point */
/** The straight way from one point to the next, which begins so far along the whole. @typedef {{ from: Point, to: Point, start: number, length: number }} Leg */
/** A place on the way: how far along it is, and what is there. @template T @typedef {{ position: Point, distance: number, value: T }} Along */

/** What probes are called. */
export const NAMES = ["A", "B", "C"];

/** Values at all times are read at the ends of so many equal parts of a leg. */
const PARTS = 64;
/** How thick the box around a leg is, as a part of its length: no more than rounding. */
const THICKNESS = 1e-9;

/** @param {Point} from @param {Point} to */
const between = (from, to) => plus(to, from, -1);

/** @param {readonly Point[]} points @returns {Leg[]} */
export function legsOf(points) {
  let start = 0;
  return points.slice(1).map((to, i) => {
    const leg = { from: points[i], to, start, length: Math.hypot(...between(points[i], to)) };
    start += leg.length;
    return leg;
  });
}

/** @param {Leg[]} legs */
export const lengthOf = (legs) => legs.reduce((sum, { length }) => sum + length, 0);

/** The angle between two legs that follow each other, in degrees; undefined where one of them has no length. @param {Leg[]} legs */
export function angleOf([one, other]) {
  if (!other || one.length === 0 || other.length === 0) return undefined;
  const [u, v] = [between(one.to, one.from).map((x) => x / one.length), between(other.from, other.to).map((x) => x / other.length)];
  // As exact for angles near 0 and 180° as for others.
  const [difference, sum] = [-1, 1].map((sign) => Math.hypot(...AXES.map((i) => u[i] + sign * v[i])));
  return (360 / Math.PI) * Math.atan2(difference, sum);
}

/** Where a mesh is needed for what is along a leg. @param {Leg} leg @returns {Pick<import("tetralod").Need, "box" | "orientedBox">} */
export function around({ from, to, length }) {
  if (length === 0) return { box: [...from, ...to] };
  const along = between(from, to);
  const [half, center] = [plus([0, 0, 0], along, 0.5), plus(from, along, 0.5)];
  const [side, other] = across(unit(along)).map((axis) => plus([0, 0, 0], axis, THICKNESS * length));
  return { orientedBox: { center, halfAxes: [half, side, other] } };
}

/** @param {Leg} leg @param {number} part */
const placeOn = ({ from, to, start, length }, part) => ({
  position: plus(from, between(from, to), part),
  distance: start + part * length,
});

/** The field that is shown, at both ends of each part in which it is linear. @param {Leg[]} legs @returns {Promise<Along<number>[]>} */
export async function alongNow(legs) {
  const profiles = await Promise.all(legs.map(({ from, to }) => viewer().line(from, to)));
  return legs.flatMap((leg, i) => Array.from(profiles[i].at, (part, k) => ({ ...placeOn(leg, part), value: profiles[i].values[k] })));
}

/** All fields at all times; nothing outside of the mesh. @param {Leg[]} legs @returns {Promise<Along<number[] | undefined>[]>} */
export async function alongAlways(legs) {
  // One ends where the next begins.
  const places = legs.flatMap((leg, i) => Array.from({ length: PARTS + (i === 0 ? 1 : 0) }, (_, k) => placeOn(leg, (k + (i === 0 ? 0 : 1)) / PARTS)));
  return Promise.all(places.map(async (place) => ({ ...place, value: (await viewer().reading(place.position))?.all })));
}
