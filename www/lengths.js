/** What a unit of the model is, as the user says: it stands behind lengths, areas and volumes. */

import { store } from "./state.js";

const POWERS = ["", "", "²", "³"];

/** The unit of lengths, of areas (2) and of volumes (3); empty where nobody says it. */
export const lengthUnit = (power = 1) => store.state.unit && store.state.unit + POWERS[power];

/** A number in words with that unit. @param {string} words */
export const withUnit = (words, power = 1) => `${words} ${lengthUnit(power)}`.trim();

/** What numbers are of, with their unit, if they have one. @param {string} name */
export const nameWithUnit = (name, unit = lengthUnit()) => (unit ? `${name} in ${unit}` : name);
