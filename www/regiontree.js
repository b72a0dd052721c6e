/** Names with steps, such as "rotor/blade 3", as a tree. */

/** A branch, or a leaf without children. `numbers` are the places in the list of names of all leaves of it. @typedef {{ label: string, path: string, numbers: number[], children: Node[] }} Node */

/** What stands between the steps of a name. */
const STEP = "/";

/**
 * The tree of some names. Branches of one leaf, or of one branch alone, are no branches: these have longer labels. Paths of branches end in
 * "/", those of leaves are the names.
 *
 * @param {readonly string[]} names
 */
export function treeOf(names) {
  /** @type {Node} */
  const root = { label: "", path: "", numbers: [], children: [] };
  const branches = new Map([["", root]]);
  for (const [number, name] of names.entries()) {
    const steps = name.split(STEP).filter((step) => step.trim() !== "");
    const last = steps.pop() ?? name;
    let at = root;
    for (const step of steps) {
      const path = `${at.path}${step}${STEP}`;
      const next = branches.get(path) ?? { label: step, path, numbers: [], children: [] };
      if (!branches.has(path)) at.children.push(next);
      branches.set(path, next);
      next.numbers.push(number);
      at = next;
    }
    at.children.push({ label: last, path: name, numbers: [number], children: [] });
  }
  return root.children.map(joined);
}

/** A branch without those in it that have one child alone. @param {Node} node @returns {Node} */
function joined({ label, path, numbers, children }) {
  const [first, ...others] = children.map(joined);
  if (!first) return { label, path, numbers, children };
  return others.length === 0 ? { ...first, label: `${label}${STEP}${first.label}` } : { label, path, numbers, children: [first, ...others] };
}

/** All nodes of a tree, each in front of its children. @param {readonly Node[]} nodes @returns {Node[]} */
export const nodesOf = (nodes) => nodes.flatMap((node) => [node, ...nodesOf(node.children)]);
