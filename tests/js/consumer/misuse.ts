// What must not compile: an error that the compiler does not report is itself an error here.
import { MultiTessellation } from "tetralod";

export async function misuse(mt: MultiTessellation): Promise<void> {
  // @ts-expect-error the constructor is private
  new MultiTessellation();
  // @ts-expect-error there is no such option
  await mt.refine({ eror: 1 });
  // @ts-expect-error a need has no budget
  await mt.refine({ needs: [{ maxTets: 1 }] });
  // @ts-expect-error a view has a viewport
  await mt.refine({ view: { matrix: new Float32Array(16), pixels: 1 } });
  // @ts-expect-error a whole mesh has no count: that is what a delta has
  (await mt.refine({})).tetCount;
  // @ts-expect-error an array that was not asked for is not there
  (await mt.refine({}, { arrays: ["tets"] })).positions;
  // @ts-expect-error a mesh has no such array
  await mt.refine({}, { arrays: ["normals"] });
  // @ts-expect-error a delta has no fields
  await mt.refine({}, { deltas: true, fields: true });
  // @ts-expect-error there is no such event
  mt.addEventListener("stats", ({ detail }) => detail.bytes);
  // @ts-expect-error an isovalue is a number
  await mt.isosurface("high");
  // @ts-expect-error a number is no source
  await MultiTessellation.open(7);
  // @ts-expect-error a reader has a size
  await MultiTessellation.open({ name: "own.mt", read: () => new Uint8Array() });
  // @ts-expect-error what is known of a volume cannot be changed
  mt.info = await mt.info;
}
