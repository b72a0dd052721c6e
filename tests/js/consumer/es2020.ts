// The declarations that need no other library, with the libraries of ES2020: what they name is known there.
import { MultiTessellation, TetralodError } from "tetralod";
import { build, inspect } from "tetralod/build";
import { TetralodViewerElement } from "tetralod/element";
import { Viewer } from "tetralod/viewer";

export const all = [MultiTessellation, build, inspect, TetralodViewerElement, Viewer];
export const error = new TetralodError("network", "no answer", { cause: all });
