//! MTs of every kind by every builder, and what must be true of a mesh of theirs: the oracle is the explicit MT, used as plain lists of tetrahedra only.

pub mod deviation;

use crate::support::domains::{Domain, volume6};
use crate::support::meshes::{bent, blocks, cube, hilly, linear};
use crate::support::oracle::sorted;
use crate::support::random::Random;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::{
    ApplyUpdates, CurrentMesh, EdgeMt, ExplicitMt, HalfEdgeMt, Mt, MtKind, MultiTessellation, UpdateId,
    UpdatePages, VertexId, VertexMt, stats,
};
use tetralod_build::{BuildConfig, BuildCriterion, BuildResult, Construction, Method, build};

/// A kind of MT and how it is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct How {
    pub kind: MtKind,
    pub method: Method,
    pub criterion: BuildCriterion,
}

pub const EDGE: How =
    How { kind: MtKind::Edge, method: Method::Collapse, criterion: BuildCriterion::HalfEdge };
pub const HALF_EDGE: How = How { kind: MtKind::Vertex, method: Method::Decimate, ..EDGE };
pub const DELAUNAY: How = How { criterion: BuildCriterion::Delaunay, ..HALF_EDGE };
pub const INSERTED: How = How { method: Method::Insert, ..DELAUNAY };
pub const PAGED: How = How { kind: MtKind::HalfEdge, ..HALF_EDGE };

impl How {
    /// Insertion fills the convex hull of the points, so it has nothing else to offer for other domains.
    fn takes(self, input: &Input) -> bool {
        input.convex || self.method.keeps_the_mesh()
    }

    pub fn build(self, mesh: &TetMesh, position_bits: Option<u32>) -> Mt {
        self.build_result(mesh, position_bits).mt
    }

    fn build_result(self, mesh: &TetMesh, position_bits: Option<u32>) -> BuildResult<Mt> {
        let How { kind, method, criterion } = self;
        let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
        let construction = Construction::new(kind, method, criterion).expect("they go together");
        let config = BuildConfig { construction, fields, position_bits, ..BuildConfig::of(MtKind::Edge) };
        build(mesh, &config).expect("a mesh to build on")
    }
}

/// A mesh to build on.
pub struct Input {
    pub name: &'static str,
    pub mesh: TetMesh,
    pub position_bits: Option<u32>,
    /// Its boundary is flat, up to sharp edges: the volume of all meshes is the same.
    pub flat: bool,
    pub convex: bool,
}

/// Small meshes of every shape.
pub fn inputs() -> Vec<Input> {
    let ring = |c: [u32; 3]| c[0] != 1 || c[1] != 1;
    let hollow = |c: [u32; 3]| c != [1; 3];
    let apart = |c: [u32; 3]| c[0] != 2;
    let waves: fn([f64; 3]) -> f64 = |p| (7.0 * p[1]).sin() + p[2];
    let flat = |name, mesh| Input { name, mesh, position_bits: None, flat: true, convex: false };
    let cubic = |name, mesh| Input { convex: true, ..flat(name, mesh) };
    vec![
        cubic("a cube with two fields", cube(4, &[hilly, linear])),
        Input { position_bits: Some(22), ..cubic("a slab on a wide lattice", slab()) },
        flat("a ring", blocks([3, 3, 2], &[hilly, waves], ring)),
        flat("a hollow cube", blocks([3; 3], &[hilly], hollow)),
        flat("two components", blocks([5, 3, 2], &[waves], apart)),
        Input { flat: false, ..flat("a bent cube", bent(4)) },
    ]
}

fn slab() -> TetMesh {
    let mut mesh = blocks([5, 3, 2], &[hilly], |_| true);
    // No longer a grid, and not on round numbers.
    mesh.grid = None;
    mesh.positions.iter_mut().for_each(|p| *p = [p[0] * 3.7, p[1] * 0.9, p[2] * 1.3]);
    mesh
}

/// The mesh of a domain with random fields.
pub fn random_input(domain: Domain, fields: usize, random: &mut Random) -> Input {
    let plain = domain.mesh(random);
    let positions: Vec<[f64; 3]> = plain.positions.iter().map(|p| p.map(f64::from)).collect();
    let mut mesh = TetMesh { positions, fields: Vec::new(), tets: plain.tets, ..TetMesh::default() };
    for f in 0..fields {
        let values = mesh.positions.iter().map(|_| f64::from(random.between(-500, 500))).collect();
        mesh.fields.push(Field::new(format!("f{f}"), values));
    }
    let convex = matches!(domain, Domain::Cube(_) | Domain::SingleTet);
    // The lattice of the domain itself: no rounding, so that its flat sides are flat.
    Input { name: "a random one", mesh, position_bits: None, flat: false, convex }
}

/// An MT with everything spelled out that must be true of it.
pub struct Subject {
    pub input: Input,
    pub mt: Mt,
    pub explicit: ExplicitMt,
    /// All updates that each one depends on, directly or not.
    pub ancestors: Vec<BTreeSet<u32>>,
    /// The number of each tetrahedron in the explicit MT, by its sorted vertices.
    numbers: HashMap<[u32; 4], u32>,
    /// Six times the volume of the reference mesh.
    volume: i128,
}

impl Subject {
    /// None if the builder does not take such an input.
    pub fn new(how: How, input: Input) -> Option<Self> {
        how.takes(&input).then(|| {
            let BuildResult { mt, summary, .. } = how.build_result(&input.mesh, input.position_bits);
            let found = stats(&mt).expect("a valid MT");
            assert_eq!(found.depth, summary.depth, "{}", input.name);
            if how.method.keeps_the_mesh() {
                let size = [found.vertices as usize, found.tetrahedra as usize];
                assert_eq!(size, [input.mesh.positions.len(), input.mesh.tets.len()], "{}", input.name);
            }
            Self::of(input, mt)
        })
    }

    pub fn of(input: Input, mt: Mt) -> Self {
        let explicit = ExplicitMt::of(&mt).expect("a valid MT");
        let mut ancestors: Vec<BTreeSet<u32>> = Vec::new();
        for u in (0..explicit.updates()).map(UpdateId) {
            let mut above: BTreeSet<u32> = explicit.parents(u).iter().copied().collect();
            explicit.parents(u).iter().for_each(|&p| above.extend(&ancestors[p as usize]));
            ancestors.push(above);
        }
        let numbers: HashMap<_, _> = explicit.tets().iter().map(|&tet| sorted(tet)).zip(0..).collect();
        assert_eq!(numbers.len(), explicit.tets().len(), "every tetrahedron comes once");
        let mut subject = Self { input, mt, explicit, ancestors, numbers, volume: 0 };
        let all = vec![true; subject.explicit.updates() as usize];
        subject.volume = subject.volume_of(subject.explicit.extract(&all).expect("a consistent set"));
        subject.assert_volumes();
        subject
    }

    /// Positions and levels at the corners of the tetrahedra that `u+` removes, in ascending order.
    pub fn removed_by(&self, u: UpdateId) -> Vec<Corners> {
        let corner = |v| (self.explicit.position(v), self.explicit.levels(v).to_vec());
        let removed = self.explicit.removed(u).iter();
        in_order(removed.map(|&t| self.explicit.tets()[t as usize].map(|v| corner(VertexId(v)))).collect())
    }

    /// Asserts that the mesh is Σ_S, of an MT of which only the updates before `known` have arrived.
    pub fn assert_is(&self, mt: &impl ApplyUpdates, mesh: &CurrentMesh, set: &[bool]) {
        assert_eq!(mesh.check(), Ok(()));
        let explicit = &self.explicit;
        let wanted = explicit.extract(set).expect("a consistent set");
        let known = |u: &UpdateId| u.0 < mt.updates();
        let (mut found, mut volume) = (Vec::new(), 0);
        for (t, tet) in (0..mesh.tet_slots() as u32).filter_map(|t| Some((t, mesh.tet(t)?))) {
            let name = sorted(tet.map(|slot| mesh.vertex(slot).0));
            let number = self.numbers[&name];
            assert_eq!(mt.creator(mesh, t), explicit.inserted_by(number), "creator of {name:?}");
            assert_eq!(mt.remover(mesh, t), explicit.removed_by(number).filter(known), "remover of {name:?}");
            volume += volume6(tet.map(|slot| mesh.positions()[slot as usize]));
            found.push(number);
        }
        found.sort_unstable();
        assert_eq!(found, wanted);
        assert_eq!(mesh.tet_count(), wanted.len());
        let vertices: BTreeSet<u32> = wanted.iter().flat_map(|&t| explicit.tets()[t as usize]).collect();
        assert_eq!(mesh.vertex_count(), vertices.len());
        for v in vertices.into_iter().map(VertexId) {
            let slot = mesh.slot(v).expect("the vertex is in the mesh");
            assert_eq!(mesh.positions()[slot as usize], explicit.position(v));
            assert_eq!(mesh.levels(slot), explicit.levels(v));
        }
        if self.input.flat && (0..set.len() as u32).all(|u| set[u as usize] || self.keeps_the_boundary(u)) {
            assert_eq!(volume, self.volume);
        }
    }

    /// Whether an update is so small that it cannot cut off a corner of a cell.
    fn keeps_the_boundary(&self, u: u32) -> bool {
        self.explicit.error(UpdateId(u)).error() <= SMALL
    }

    /// Asserts that each update fills what it empties, as far as the boundary stays where it is.
    fn assert_volumes(&self) {
        for u in (0..self.explicit.updates()).map(UpdateId) {
            let inside = self.given_up(u).is_empty() && !self.splits_at_boundary(u);
            if inside || self.input.flat && self.keeps_the_boundary(u.0) {
                let removed = self.volume_of(self.explicit.removed(u).iter().copied());
                assert_eq!(self.volume_of(self.explicit.inserted(u)), removed, "{u:?}");
            }
        }
    }

    /// Whether an update has boundary faces at a vertex that comes with it.
    fn splits_at_boundary(&self, u: UpdateId) -> bool {
        let created = self.explicit.created(u);
        let inserted: Vec<[u32; 4]> =
            self.explicit.inserted(u).map(|t| self.explicit.tets()[t as usize]).collect();
        border(&inserted).iter().flatten().any(|v| created.contains(v))
    }

    /// Six times the volume of these tetrahedra.
    pub fn volume_of(&self, tets: impl IntoIterator<Item = u32>) -> i128 {
        let corner = |v: u32| self.explicit.position(VertexId(v));
        tets.into_iter().map(|t| volume6(self.explicit.tets()[t as usize].map(corner))).sum()
    }

    /// The smallest consistent set with these updates.
    pub fn closure(&self, updates: impl IntoIterator<Item = u32>) -> Vec<bool> {
        let mut set = vec![false; self.explicit.updates() as usize];
        for u in updates {
            set[u as usize] = true;
            self.ancestors[u as usize].iter().for_each(|&p| set[p as usize] = true);
        }
        set
    }

    /// The faces of the boundary that `u+` gives up: its tetrahedra had them to themselves, and what comes in their
    /// place does not have them.
    pub fn given_up(&self, u: UpdateId) -> Vec<[u32; 3]> {
        let tet = |t: u32| self.explicit.tets()[t as usize];
        let removed: Vec<[u32; 4]> = self.explicit.removed(u).iter().map(|&t| tet(t)).collect();
        let after: BTreeSet<_> = self.explicit.inserted(u).flat_map(|t| faces_of(tet(t))).collect();
        border(&removed).into_iter().filter(|face| !after.contains(face)).collect()
    }
}

/// Positions and levels at the corners of a tetrahedron.
pub type Corners = [([i32; 3], Vec<i32>); 4];

/// The same tetrahedra, whatever order they and their corners come in.
pub fn in_order(mut tets: Vec<Corners>) -> Vec<Corners> {
    tets.iter_mut().for_each(|tet| tet.sort_unstable());
    tets.sort_unstable();
    tets
}

/// The faces of a tetrahedron, by their sorted vertices.
pub fn faces_of(tet: [u32; 4]) -> [[u32; 3]; 4] {
    let [a, b, c, d] = sorted(tet);
    [[b, c, d], [a, c, d], [a, b, d], [a, b, c]]
}

/// The faces that only one of these tetrahedra has.
pub fn border(tets: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut uses: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    tets.iter().flat_map(|&tet| faces_of(tet)).for_each(|face| *uses.entry(face).or_default() += 1);
    uses.into_iter().filter(|&(_, count)| count == 1).map(|(face, _)| face).collect()
}

/// An error that no update has which cuts off a corner of a cell.
const SMALL: f64 = 0.02;

/// The same MT before any update has arrived.
pub fn empty(mt: &Mt) -> Mt {
    let (info, base) = (mt.info().clone(), mt.base().clone());
    match mt {
        Mt::Edge(_) => EdgeMt::new(info, base).into(),
        Mt::Vertex(mt) => {
            VertexMt::new(info, base, mt.base_removers().to_vec(), mt.most_children(), mt.always_grows())
                .expect("the same base mesh")
                .into()
        }
        Mt::HalfEdge(mt) => {
            let vertices = (0..base.positions.len() as u32).map(VertexId);
            let children: Vec<_> = vertices.map(|v| mt.children_of(v).to_vec()).collect();
            let marks = mt.base_marks().to_vec();
            HalfEdgeMt::new(info, base, marks, &children, mt.page_bits()).expect("the same base mesh").into()
        }
        _ => unreachable!("there are no others"),
    }
}

/// Adds the next update of the whole MT to a part of it.
pub fn grow(part: &mut Mt, whole: &Mt) {
    let u = UpdateId(part.updates());
    let pushed = match (part, whole) {
        (Mt::Edge(part), Mt::Edge(whole)) => part.push(&whole.update(u)),
        (Mt::Vertex(part), Mt::Vertex(whole)) => part.push(&whole.node(u), whole.errors(u)),
        (Mt::HalfEdge(part), Mt::HalfEdge(whole)) => part.push(&whole.update(u).expect("an update")),
        _ => panic!("two kinds"),
    };
    assert_eq!(pushed, Ok(u));
}
