//! The MT as its builder recorded it: every update's tetrahedra spelled out, the DAG read off them.

use super::domains::volume6;
use super::random::Random;
use std::collections::{BTreeMap, BTreeSet};

/// What an update does, in numbers of MT vertices; tetrahedra are positive.
#[derive(Clone, Debug)]
pub struct Node {
    pub removed: Vec<[u32; 4]>,
    pub inserted: Vec<[u32; 4]>,
}

/// The recorded MT.
#[derive(Clone, Debug)]
pub struct Oracle {
    /// By MT vertex number.
    pub positions: Vec<[i32; 3]>,
    pub levels: Vec<Vec<i32>>,
    pub base: Vec<[u32; 4]>,
    pub nodes: Vec<Node>,
    pub parents: Vec<BTreeSet<u32>>,
    pub children: Vec<BTreeSet<u32>>,
    /// All updates that each one depends on, directly or not.
    pub ancestors: Vec<BTreeSet<u32>>,
    /// Which update creates a tetrahedron (by its sorted vertices); base ones have none.
    pub creator: BTreeMap<[u32; 4], u32>,
    /// Which update removes it; those of the reference mesh have none.
    pub remover: BTreeMap<[u32; 4], u32>,
    pub errors: Vec<u16>,
}

/// The sorted vertices: all that there is to know of a positive tetrahedron.
pub fn sorted(mut tet: [u32; 4]) -> [u32; 4] {
    tet.sort_unstable();
    tet
}

impl Oracle {
    pub fn new(
        positions: Vec<[i32; 3]>,
        levels: Vec<Vec<i32>>,
        base: Vec<[u32; 4]>,
        nodes: Vec<Node>,
    ) -> Self {
        let n = nodes.len();
        let (mut creator, mut remover) = (BTreeMap::new(), BTreeMap::new());
        let (mut parents, mut children) = (vec![BTreeSet::new(); n], vec![BTreeSet::new(); n]);
        let mut ancestors: Vec<BTreeSet<u32>> = Vec::new();
        for (u, node) in nodes.iter().enumerate() {
            let mut above = BTreeSet::new();
            for tet in node.removed.iter().map(|t| sorted(*t)) {
                assert!(remover.insert(tet, u as u32).is_none(), "removed twice");
                if let Some(&p) = creator.get(&tet) {
                    parents[u].insert(p);
                    children[p as usize].insert(u as u32);
                    above.insert(p);
                    above.extend(&ancestors[p as usize]);
                }
            }
            ancestors.push(above);
            for tet in node.inserted.iter().map(|t| sorted(*t)) {
                assert!(creator.insert(tet, u as u32).is_none(), "created twice");
            }
        }
        let errors = vec![0; n];
        Self { positions, levels, base, nodes, parents, children, ancestors, creator, remover, errors }
    }

    /// Random errors that do not grow from one update to the next, and so not from parents to children.
    pub fn choose_errors(&mut self, random: &mut Random) {
        let mut bound = 60_000;
        for error in &mut self.errors {
            // Equal errors in a row are as good as falling ones.
            bound -= random.below(4).saturating_sub(1) as u16 * (bound / 64);
            *error = bound;
        }
    }

    pub fn updates(&self) -> u32 {
        self.nodes.len() as u32
    }

    /// Σ_S for the set without updates.
    pub fn base_set(&self) -> BTreeSet<[u32; 4]> {
        self.base.iter().map(|t| sorted(*t)).collect()
    }

    /// Σ_S, by applying the updates of `set` one after the other.
    pub fn extract(&self, set: &[bool]) -> BTreeSet<[u32; 4]> {
        let mut live = self.base_set();
        for u in (0..set.len()).filter(|&u| set[u]) {
            self.refine(&mut live, u as u32);
        }
        live
    }

    pub fn refine(&self, live: &mut BTreeSet<[u32; 4]>, u: u32) {
        let node = &self.nodes[u as usize];
        node.removed.iter().for_each(|t| assert!(live.remove(&sorted(*t))));
        node.inserted.iter().for_each(|t| assert!(live.insert(sorted(*t))));
    }

    pub fn coarsen(&self, live: &mut BTreeSet<[u32; 4]>, u: u32) {
        let node = &self.nodes[u as usize];
        node.inserted.iter().for_each(|t| assert!(live.remove(&sorted(*t))));
        node.removed.iter().for_each(|t| assert!(live.insert(sorted(*t))));
    }

    /// Whether `u` may be added to `set` (if it is not in it) or taken from it (if it is).
    pub fn is_feasible(&self, set: &[bool], u: u32) -> bool {
        let u = u as usize;
        if set[u] {
            self.children[u].iter().all(|&c| !set[c as usize])
        } else {
            self.parents[u].iter().all(|&p| set[p as usize])
        }
    }

    pub fn is_consistent(&self, set: &[bool]) -> bool {
        (0..set.len()).all(|u| !set[u] || self.parents[u].iter().all(|&p| set[p as usize]))
    }

    /// Six times the volume of a set of tetrahedra.
    pub fn volume(&self, live: &BTreeSet<[u32; 4]>) -> i128 {
        live.iter().map(|t| volume6(t.map(|v| self.positions[v as usize])).abs()).sum()
    }
}
