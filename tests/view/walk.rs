//! A current mesh that changes at random, as slices with the ranges that have changed.

use crate::support::random::Random;
use std::ops::Range;
use tetralod::mesh::TetMesh;
use tetralod::mt::{
    Applied, ApplyUpdates, CurrentMesh, MeshChanges, Mt, MtKind, MultiTessellation, UpdateId, UpdatePages,
};
use tetralod::view::MeshView;
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};

/// The blocks of 64 entries in which two states of an array differ, as ranges of the new one.
pub fn changed<T: PartialEq>(old: &[T], new: &[T]) -> Vec<Range<u32>> {
    let blocks = (0..new.len()).step_by(64).map(|start| start..(start + 64).min(new.len()));
    let differing = blocks.filter(|block| old.get(block.clone()) != Some(&new[block.clone()]));
    differing.map(|block| block.start as u32..block.end as u32).collect()
}

/// Every kind of MT with a way to build it.
pub const KINDS: [(MtKind, Method); 3] =
    [(MtKind::Edge, Method::Collapse), (MtKind::Vertex, Method::Decimate), (MtKind::Vertex, Method::Insert)];

pub struct Walk {
    mt: Mt,
    mesh: CurrentMesh,
    applied: Vec<bool>,
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
    pub random: Random,
}

impl Walk {
    pub fn new(mesh: &TetMesh, (kind, method): (MtKind, Method)) -> Self {
        let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
        let criterion =
            if method == Method::Insert { BuildCriterion::Delaunay } else { BuildCriterion::HalfEdge };
        let construction = Construction::new(kind, method, criterion).expect("they go together");
        let config = BuildConfig { construction, fields, ..BuildConfig::of(MtKind::Edge) };
        let mt = build(mesh, &config).expect("a mesh to build on").mt;
        let mut mesh = mt.start().expect("a valid base mesh");
        mt.updates_arrived(&mut mesh, 0);
        let applied = vec![false; mt.updates() as usize];
        let mut walk =
            Self { mt, mesh, applied, positions: Vec::new(), values: Vec::new(), random: Random::new(5) };
        walk.take_changes();
        walk
    }

    pub fn updates(&self) -> usize {
        self.mt.updates() as usize
    }

    /// Tries `count` updates chosen at random, all in the same direction; tells where the slices have changed.
    pub fn change(&mut self, count: usize, refine: bool) -> MeshChanges {
        for _ in 0..count {
            let u = self.random.below(self.updates()) as u32;
            self.try_update(u, refine);
        }
        self.mesh.compact();
        self.take_changes()
    }

    /// Applies all updates.
    pub fn refine_all(&mut self) -> MeshChanges {
        for u in 0..self.mt.updates() {
            self.try_update(u, true);
        }
        self.mesh.compact();
        self.take_changes()
    }

    /// Applies or undoes an update, unless that is done already or others are in the way.
    fn try_update(&mut self, u: u32, refine: bool) {
        if self.applied[u as usize] != refine {
            let (mesh, u) = (&mut self.mesh, UpdateId(u));
            let done = if refine { self.mt.refine(mesh, u) } else { self.mt.coarsen(mesh, u) };
            if done.expect("a valid MT") == Applied::Done {
                self.applied[u.0 as usize] = refine;
            }
        }
    }

    /// Keeps the slices up by the changed ranges alone.
    fn take_changes(&mut self) -> MeshChanges {
        let changes = self.mesh.take_changes();
        let (lattice, field) = (&self.mt.info().lattice, &self.mt.info().fields[0]);
        let slots = self.mesh.positions().len();
        self.positions.resize(slots, [0.0; 3]);
        self.values.resize(slots, 0.0);
        for slot in changes.vertices.iter().cloned().flatten() {
            let position = lattice.point(self.mesh.positions()[slot as usize]);
            self.positions[slot as usize] = position;
            self.values[slot as usize] = field.value(self.mesh.levels(slot)[0]);
        }
        changes
    }

    pub fn view(&self) -> MeshView<'_> {
        MeshView {
            positions: &self.positions,
            field: &self.values,
            is_label: false,
            tets: self.mesh.tets(),
            neighbors: self.mesh.neighbors(),
        }
    }
}
