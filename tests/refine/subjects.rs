//! MTs with their oracles, for tests of refinement.

use crate::support::meshes::{bent, blocks, built, cube, hilly, linear};
use std::collections::BTreeSet;
use std::sync::LazyLock;
use tetralod::mesh::TetMesh;
use tetralod::mt::{CurrentMesh, EdgeMt, ExplicitMt, MultiTessellation, UpdateId, VertexId};
use tetralod::refine::{Criterion, Front, LodCriterion, Outcome, Request, TetData};

/// An MT, its input and its oracle.
pub struct Subject {
    pub input: TetMesh,
    pub mt: EdgeMt,
    pub explicit: ExplicitMt,
    /// The update that removes each tetrahedron of the explicit MT.
    removers: Vec<Option<UpdateId>>,
}

impl Subject {
    pub fn new(input: TetMesh) -> Self {
        let mt = built(&input).mt;
        Self::of(input, mt)
    }

    pub fn of(input: TetMesh, mt: EdgeMt) -> Self {
        let explicit = ExplicitMt::of(&mt).expect("a valid MT");
        let mut removers = vec![None; explicit.tets().len()];
        for u in (0..explicit.updates()).map(UpdateId) {
            explicit.removed(u).iter().for_each(|&t| removers[t as usize] = Some(u));
        }
        Self { input, mt, explicit, removers }
    }

    /// The smallest set that holds, for each tetrahedron that it makes and that violates the criterion, the update
    /// which removes that tetrahedron, and with each update its parents. By going round until nothing changes.
    pub fn closure(&self, criterion: &impl Criterion) -> Vec<bool> {
        let mut set = vec![false; self.explicit.updates() as usize];
        loop {
            let live = self.explicit.extract(&set).expect("a consistent set");
            let violations = live.iter().filter_map(|&t| self.violation(criterion, t));
            let mut todo: Vec<u32> = violations.map(|u| u.0).collect();
            if todo.is_empty() {
                return set;
            }
            while let Some(u) = todo.pop() {
                if !std::mem::replace(&mut set[u as usize], true) {
                    todo.extend(self.explicit.parents(UpdateId(u)));
                }
            }
        }
    }

    fn violation(&self, criterion: &impl Criterion, t: u32) -> Option<UpdateId> {
        let u = self.removers[t as usize]?;
        let (error, errors) = (self.explicit.error(u), self.explicit.errors(u));
        let tet = self.explicit.tets()[t as usize].map(VertexId);
        let corners = tet.map(|v| self.explicit.position(v));
        let levels = |field: usize| tet.map(|v| self.explicit.levels(v)[field]);
        let look = TetData { corners: &corners, levels: &levels, error, errors, update: u, region: 0 };
        criterion.judge(&look).violates().then_some(u)
    }

    pub fn fresh(&self) -> Front {
        Front::new(&self.mt).expect("a valid base mesh")
    }

    pub fn satisfy(&self, front: &mut Front, request: &Request) -> Outcome {
        let criterion = LodCriterion::new(self.mt.info(), request);
        front.satisfy(&self.mt, &criterion, request.budget).expect("a valid MT")
    }
}

pub fn applied(front: &Front, mt: &EdgeMt) -> Vec<bool> {
    (0..mt.updates()).map(|u| front.contains(UpdateId(u))).collect()
}

pub fn sorted(mut tet: [u32; 4]) -> [u32; 4] {
    tet.sort_unstable();
    tet
}

pub fn tets(mesh: &CurrentMesh) -> BTreeSet<[u32; 4]> {
    mesh.tets().iter().map(|tet| sorted(tet.map(|slot| mesh.vertex(slot).0))).collect()
}

pub static SUBJECTS: LazyLock<Vec<Subject>> = LazyLock::new(|| {
    let ell = |c: [u32; 3]| c[0] < 2 || c[1] < 2;
    let apart = |c: [u32; 3]| c[0] != 2;
    vec![
        Subject::new(cube(6, &[hilly, linear])),
        Subject::new(blocks([4, 4, 3], &[hilly], ell)),
        Subject::new(blocks([5, 3, 3], &[hilly, |p| (7.0 * p[1]).sin()], apart)),
        Subject::new(bent(5)),
    ]
});
