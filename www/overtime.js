/** Values at probes, and between them, at all times of a field. */

import { shownField } from "./fields.js";
import { demo, volume } from "./page.js";
import { around, legsOf } from "./path.js";
import { store } from "./state.js";
import { stepsOf } from "./volume.js";

/** Whether the field has several times. */
export const hasTimes = () => demo.info !== undefined && stepsOf(store.state.field).length > 1;

/** What is plotted of so many probes: "" is the field between them, "1" the values at them over time, "line" those between them at all times. @param {number} count */
export function plotOf(count) {
  const wanted = hasTimes() ? store.state["over-time"] : "";
  return wanted === "line" && count < 2 ? "1" : wanted;
}

/** A field at all of its times: when, and its values among those of all fields. @param {string} name @param {readonly number[]} all */
export const valuesOverTime = (name, all) => stepsOf(name).map((number, i) => ({ time: volume().fields[number].time ?? i, value: all[number] }));

/** What the plot needs of the mesh: at the probes or between them, and nowhere else, the error that is asked for at the times that are not shown. @param {`${number}%`} error */
export function needsOverTime(error) {
  const { probes, field } = store.state;
  const plot = plotOf(probes.length);
  if (plot === "") return [];
  const others = stepsOf(field).filter((number) => number !== shownField().number);
  const places = plot === "line" ? legsOf(probes).map(around) : probes.map((point) => ({ box: [...point, ...point] }));
  return places.flatMap((place) => others.map((field) => ({ error, field, ...place })));
}

/** The values of the field that is shown at one probe after the other, as a plot has them: a part for each two times that follow. @param {readonly { all: readonly number[] }[]} pins */
export function curvesOverTime(pins) {
  const curves = pins.map(({ all }) => valuesOverTime(shownField().name, all));
  const times = curves[0].map(({ time }) => time);
  const [from, to] = [times[0], times[times.length - 1]];
  const part = (/** @type {number} */ time) => (time - from) / (to - from);
  const pairs = curves.map((curve) => curve.slice(1).flatMap((point, i) => [curve[i], point]));
  const profiles = pairs.map((ends) => ({ at: ends.map(({ time }) => part(time)), values: ends.map(({ value }) => value) }));
  return { profiles, from, to, now: part(shownField().time ?? store.state.time) };
}

/** The values of the field that is shown at points: when, and a row for each time. Nothing is known of points outside. @param {(readonly number[] | undefined)[]} points */
export function rowsOverTime(points) {
  const numbers = stepsOf(store.state.field);
  return { times: numbers.map((number, i) => volume().fields[number].time ?? i), rows: numbers.map((number) => points.map((all) => all?.[number])) };
}
