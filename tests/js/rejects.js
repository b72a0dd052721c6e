// What the package refuses.
import assert from "node:assert/strict";
import { TetralodError } from "../../pkg/index.js";

/** The promise is rejected with an error of the package, with this code and a message like this. */
export const rejects = (promise, code, message = /./) =>
  assert.rejects(promise, (error) => {
    assert.ok(error instanceof TetralodError, String(error));
    assert.equal(error.code, code, error.message);
    assert.match(error.message, message);
    return true;
  });
