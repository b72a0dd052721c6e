/** What a viewer draws, and of which volume. */

import { flattenError, known, type FlatError } from "./errors.js";
import { changedScene, checkNames, fitScene, namesParts, withoutParts } from "./fit.js";
import type { SceneChange } from "./latest.js";
import type { Unchecked } from "./options.js";
import type { MtInfo } from "./results.js";
import type { CameraState, Misfit, SceneState, ViewerChanges } from "./scene.js";
import type { Viewer } from "./tetralod_viewer.js";

/** What is to be drawn of a volume that is being opened. */
export interface Wanted {
  scene: SceneState;
  camera?: CameraState | null;
  /** The first request, if it is known before the volume. */
  request?: Unchecked | undefined;
}

/** What is told of a volume that has been opened. */
export interface Met {
  info: MtInfo;
  scene: SceneState;
  dropped: Misfit[];
}

export class Shown {
  #viewer: Viewer;
  /** What is drawn. */
  scene: SceneState = {};
  /** Whether that is what is drawn where nothing is asked for: then it gives way to what is. */
  #isFirst = false;
  /** The volume that it is drawn of, once its base mesh is there. */
  #volume: MtInfo | undefined;
  #wanted: Wanted | undefined;
  /** What did not fit the volume. */
  #dropped: Misfit[] = [];

  constructor(viewer: Viewer) {
    this.#viewer = viewer;
  }

  /** What is to be drawn of a volume that is opened with this state; throws where that is wrong for any volume. */
  first({ camera, ...changes }: ViewerChanges): Wanted {
    const scene = changedScene(this.#isFirst ? withoutParts(this.scene) : this.scene, changes);
    this.#viewer.setScene(scene);
    this.#viewer.setScene(this.scene);
    return { scene, camera };
  }

  /** Another volume takes the place of the one before. */
  forget(wanted: Wanted) {
    [this.#wanted, this.#volume, this.#dropped] = [wanted, undefined, []];
  }

  /** If the base mesh has arrived, draws of it what fits. */
  meet() {
    const info = this.#volume ? undefined : this.#viewer.info();
    if (!info) return;
    this.#volume = { ...info, bounds: Array.from(this.#viewer.bounds()) };
    const { scene = this.scene, camera, request } = this.#wanted ?? {};
    this.#wanted = undefined;
    const { field = info.fields[info.firstField]?.name } = (request ?? {}) as { field?: string };
    ({ scene: this.scene, dropped: this.#dropped, isFirst: this.#isFirst } = fitScene(scene, this.#volume, field));
    this.#viewer.setScene(this.scene);
    try {
      if (camera) this.#viewer.setCamera(camera);
      // What is deformed may leave the box of the model.
      else if (this.scene.deform) this.#viewer.home();
    } catch (error) {
      this.#dropped.push({ part: "camera", problem: known(error).message ?? String(error) });
    }
  }

  /** The volume that has been met. */
  met(): Met | undefined {
    return this.#volume && { info: this.#volume, scene: this.scene, dropped: this.#dropped };
  }

  /** Makes a change of the scene or the camera, or nothing: then it gives what is wrong. */
  change({ changes, camera }: SceneChange): FlatError | undefined {
    try {
      const isFirst = this.#isFirst && !namesParts(changes ?? {});
      const scene = changedScene(this.#isFirst && !isFirst ? withoutParts(this.scene) : this.scene, changes);
      if (this.#volume) checkNames(scene, this.#volume);
      this.#viewer.setScene(scene);
      try {
        if (camera) this.#viewer.setCamera(camera);
      } catch (error) {
        this.#viewer.setScene(this.scene);
        throw error;
      }
      [this.scene, this.#isFirst] = [scene, isFirst];
      return undefined;
    } catch (error) {
      return flattenError(error);
    }
  }
}
