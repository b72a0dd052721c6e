//! A slow, plain builder of random MTs: collapses random edges of a small mesh to their floor midpoints.

use super::domains::{Domain, POSITION_BITS, volume6};
use super::oracle::{Node, Oracle};
use super::random::Random;
use std::collections::{BTreeMap, BTreeSet};
use tetralod::geom::Lattice;
use tetralod::mt::{
    BaseMesh, EdgeMt, EdgeMtBuilder, EdgeUpdate, ErrorCode, FieldInfo, MtInfo, MtKind, MultiTessellation,
    UpdateId, VertexId, VertexSplit,
};

/// A vertex split that owns its parts.
#[derive(Clone, Debug)]
pub struct Split {
    pub vertex: u32,
    pub offset: [i32; 3],
    pub field_offsets: Vec<i32>,
    pub mask: u64,
    pub error: u16,
}

impl Split {
    pub fn as_split(&self) -> VertexSplit<'_> {
        VertexSplit {
            vertex: VertexId(self.vertex),
            offset: self.offset,
            field_offsets: &self.field_offsets,
            mask: self.mask,
            // A test may forget them.
            errors: vec![ErrorCode(self.error); self.field_offsets.len()].leak(),
        }
    }
}

/// The MT of valid splits, coarse to fine.
pub fn mt_of_splits<'a>(
    info: &MtInfo,
    base: &BaseMesh,
    splits: impl IntoIterator<Item = VertexSplit<'a>>,
) -> EdgeMt {
    let mut builder = EdgeMtBuilder::new(info.clone(), base.clone()).expect("a valid base mesh");
    for split in splits {
        builder.push(&split).expect("a valid split");
    }
    builder.finish()
}

/// A stored update that owns its parts, to be tampered with.
#[derive(Clone, Debug)]
pub struct Stored {
    pub vertex: u32,
    pub offset_residual: [i32; 3],
    pub edge: u8,
    pub level_residuals: Vec<i32>,
    pub wrong_sides: u64,
    pub errors: Vec<ErrorCode>,
}

impl Stored {
    pub fn of(update: &EdgeUpdate<'_>) -> Self {
        Self {
            vertex: update.vertex.0,
            offset_residual: update.offset_residual,
            edge: update.edge,
            level_residuals: update.level_residuals.to_vec(),
            wrong_sides: update.wrong_sides,
            errors: update.errors.to_vec(),
        }
    }

    /// All updates of an MT.
    pub fn all(mt: &EdgeMt) -> Vec<Self> {
        (0..mt.updates()).map(|u| Self::of(&mt.update(UpdateId(u)))).collect()
    }

    pub fn as_update(&self) -> EdgeUpdate<'_> {
        EdgeUpdate {
            vertex: VertexId(self.vertex),
            offset_residual: self.offset_residual,
            edge: self.edge,
            level_residuals: (&self.level_residuals[..]).into(),
            wrong_sides: self.wrong_sides,
            errors: &self.errors,
        }
    }
}

/// A random MT in parts, with the oracle that its builder's records make.
#[derive(Clone, Debug)]
pub struct Built {
    pub info: MtInfo,
    pub base: BaseMesh,
    pub splits: Vec<Split>,
    pub oracle: Oracle,
}

impl Built {
    /// Everything pushed into a compact MT.
    pub fn edge_mt(&self) -> EdgeMt {
        mt_of_splits(&self.info, &self.base, self.splits.iter().map(Split::as_split))
    }
}

/// What the random builder makes.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    pub domain: Domain,
    pub seed: u64,
    pub fields: usize,
    /// Stop after so many collapses.
    pub updates: usize,
}

const FIELD_BITS: u32 = 8;
/// Stands in for "outside": the vertex that cones the boundary.
const OUTSIDE: u32 = u32::MAX;

type Tet = BTreeSet<u32>;

/// A mesh as a map from tetrahedra (as vertex sets) to nothing but their being there.
struct Work {
    positions: BTreeMap<u32, [i32; 3]>,
    levels: BTreeMap<u32, Vec<i32>>,
    tets: BTreeSet<[u32; 4]>,
    star: BTreeMap<u32, BTreeSet<[u32; 4]>>,
}

/// One collapse as performed: `a` and `b` became `v`.
struct Collapse {
    a: u32,
    b: u32,
    v: u32,
    /// Tetrahedra with `v`, and whether they had `b` before.
    star: Vec<([u32; 4], bool)>,
    gone: Vec<[u32; 4]>,
}

impl Work {
    fn new(domain: Domain, fields: usize, random: &mut Random) -> Self {
        let mesh = domain.mesh(random);
        let mut work = Self {
            positions: (0..).zip(mesh.positions.iter().copied()).collect(),
            levels: BTreeMap::new(),
            tets: BTreeSet::new(),
            star: BTreeMap::new(),
        };
        for v in 0..mesh.positions.len() as u32 {
            work.levels.insert(v, (0..fields).map(|_| random.between(0, (1 << FIELD_BITS) - 1)).collect());
        }
        mesh.tets.iter().for_each(|tet| work.add(*tet));
        work
    }

    fn add(&mut self, tet: [u32; 4]) {
        assert!(self.tets.insert(tet));
        for v in tet {
            self.star.entry(v).or_default().insert(tet);
        }
    }

    fn remove(&mut self, tet: [u32; 4]) {
        assert!(self.tets.remove(&tet));
        for v in tet {
            self.star.get_mut(&v).expect("a star").remove(&tet);
        }
    }

    fn neighbors(&self, v: u32) -> BTreeSet<u32> {
        self.star[&v].iter().flatten().copied().filter(|&w| w != v).collect()
    }

    /// Whether only one tetrahedron has this face.
    fn is_boundary(&self, face: &[u32]) -> bool {
        self.star[&face[0]].iter().filter(|t| face.iter().all(|v| t.contains(v))).count() == 1
    }

    /// The star of `v` as vertex sets, with the tetrahedra that cone the boundary.
    fn coned_star(&self, v: u32) -> BTreeSet<Tet> {
        let mut coned: BTreeSet<Tet> = BTreeSet::new();
        for tet in &self.star[&v] {
            coned.insert(tet.iter().copied().collect());
            for i in (0..4).filter(|&i| tet[i] != v) {
                let face: Vec<u32> = (0..4).filter(|&j| j != i).map(|j| tet[j]).collect();
                if self.is_boundary(&face) {
                    coned.insert(face.into_iter().chain([OUTSIDE]).collect());
                }
            }
        }
        coned
    }

    fn on_boundary(&self, v: u32) -> bool {
        self.coned_star(v).iter().any(|t| t.contains(&OUTSIDE))
    }

    /// Whether `lk(a) ∩ lk(b) = lk(ab)` in the coned mesh.
    fn link_condition(&self, a: u32, b: u32) -> bool {
        let (star_a, star_b) = (self.coned_star(a), self.coned_star(b));
        let link = |star: &BTreeSet<Tet>, centre: &[u32]| {
            let mut link: BTreeSet<Vec<u32>> = BTreeSet::new();
            for tet in star.iter().filter(|t| centre.iter().all(|v| t.contains(v))) {
                let rest: Vec<u32> = tet.iter().copied().filter(|v| !centre.contains(v)).collect();
                for bits in 1..1_u32 << rest.len() {
                    link.insert((0..rest.len()).filter(|i| bits >> i & 1 == 1).map(|i| rest[i]).collect());
                }
            }
            link
        };
        let (link_a, link_b) = (link(&star_a, &[a]), link(&star_b, &[b]));
        let both: BTreeSet<Vec<u32>> = link_a.intersection(&link_b).cloned().collect();
        both == link(&star_a, &[a, b])
    }

    /// Whether a tetrahedron with both `a` and `b` has a boundary face opposite one of them.
    fn folds_at_boundary(&self, a: u32, b: u32) -> bool {
        self.star[&a].iter().filter(|t| t.contains(&b)).any(|t| {
            [a, b].iter().any(|end| {
                let face: Vec<u32> = t.iter().copied().filter(|v| v != end).collect();
                self.is_boundary(&face)
            })
        })
    }

    /// Collapses `a` and `b` to `v` if all conditions hold.
    fn collapse(&mut self, a: u32, b: u32, v: u32) -> Option<Collapse> {
        let adjacent: BTreeSet<u32> = &self.neighbors(a) | &self.neighbors(b);
        let gone: Vec<[u32; 4]> = self.star[&a].union(&self.star[&b]).copied().collect();
        let kept = gone.iter().filter(|t| !(t.contains(&a) && t.contains(&b)));
        let star: Vec<([u32; 4], bool)> =
            kept.map(|t| (t.map(|x| if x == a || x == b { v } else { x }), t.contains(&b))).collect();
        let small = adjacent.len() - 2 <= 32 && star.len() <= 64;
        if !small
            || self.on_boundary(a) != self.on_boundary(b)
            || self.folds_at_boundary(a, b)
            || !self.link_condition(a, b)
        {
            return None;
        }
        let middle = |a: i32, b: i32| b + ((a - b) >> 1);
        let (pa, pb) = (self.positions[&a], self.positions[&b]);
        let position = [0, 1, 2].map(|i| middle(pa[i], pb[i]));
        let corner = |x: u32| if x == v { position } else { self.positions[&x] };
        if star.iter().any(|(t, _)| volume6(t.map(corner)) <= 0) {
            return None;
        }
        let levels = self.levels[&a].iter().zip(&self.levels[&b]).map(|(&a, &b)| middle(a, b)).collect();
        self.positions.insert(v, position);
        self.levels.insert(v, levels);
        gone.iter().for_each(|t| self.remove(*t));
        star.iter().for_each(|(t, _)| self.add(*t));
        Some(Collapse { a, b, v, star, gone })
    }

    fn edges(&self) -> Vec<(u32, u32)> {
        let ends = self.tets.iter().flat_map(|t| t.iter().flat_map(|&a| t.iter().map(move |&b| (a, b))));
        ends.filter(|(a, b)| a < b).collect::<BTreeSet<_>>().into_iter().collect()
    }
}

/// Builds a random MT.
pub fn build(plan: Plan) -> Built {
    let mut random = Random(plan.seed);
    let mut work = Work::new(plan.domain, plan.fields, &mut random);
    let reference = (work.positions.len(), work.tets.len());
    let mut collapses: Vec<Collapse> = Vec::new();
    let mut progress = true;
    while progress {
        progress = false;
        let mut edges = work.edges();
        random.shuffle(&mut edges);
        for (a, b) in edges {
            let full = collapses.len() >= plan.updates;
            let there = |v: &u32| work.star.get(v).is_some_and(|s| !s.is_empty());
            if full || !there(&a) || !there(&b) || !work.star[&a].iter().any(|t| t.contains(&b)) {
                continue;
            }
            let (a, b) = if random.once_in(2) { (a, b) } else { (b, a) };
            if let Some(done) = work.collapse(a, b, (reference.0 + collapses.len()) as u32) {
                collapses.push(done);
                progress = true;
            }
        }
    }
    assemble(&work, &collapses, reference, plan.fields, &mut random)
}

/// Numbers everything coarse to fine and writes the updates down.
fn assemble(
    work: &Work,
    collapses: &[Collapse],
    reference: (usize, usize),
    fields: usize,
    random: &mut Random,
) -> Built {
    let mut base_vertices: Vec<u32> =
        work.star.iter().filter(|(_, star)| !star.is_empty()).map(|(&v, _)| v).collect();
    random.shuffle(&mut base_vertices);
    let mut number: BTreeMap<u32, u32> = base_vertices.iter().copied().zip(0..).collect();
    for (k, collapse) in collapses.iter().rev().enumerate() {
        let first = (base_vertices.len() + 2 * k) as u32;
        number.insert(collapse.a, first);
        number.insert(collapse.b, first + 1);
    }
    let name = |tet: &[u32; 4]| tet.map(|v| number[&v]);
    let mut base_tets: Vec<[u32; 4]> = work.tets.iter().map(name).collect();
    random.shuffle(&mut base_tets);
    let nodes = collapses.iter().rev().map(|collapse| Node {
        removed: collapse.star.iter().map(|(t, _)| name(t)).collect(),
        inserted: collapse.gone.iter().map(name).collect(),
    });
    let by_number: BTreeMap<u32, u32> = number.iter().map(|(&v, &n)| (n, v)).collect();
    let positions = by_number.values().map(|v| work.positions[v]).collect();
    let levels = by_number.values().map(|v| work.levels[v].clone()).collect();
    let mut oracle = Oracle::new(positions, levels, base_tets.clone(), nodes.collect());
    oracle.choose_errors(random);
    let splits = collapses.iter().rev().enumerate().map(|(k, collapse)| {
        let difference = |a: &[i32], b: &[i32]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<i32>>();
        let (a, b) = (&collapse.a, &collapse.b);
        let offset = difference(&work.positions[a], &work.positions[b]);
        Split {
            vertex: number[&collapse.v],
            offset: [offset[0], offset[1], offset[2]],
            field_offsets: difference(&work.levels[a], &work.levels[b]),
            mask: mask(collapse, &number),
            error: oracle.errors[k],
        }
    });
    let splits = splits.collect();
    let values = base_vertices.iter().flat_map(|v| work.levels[v].clone()).collect();
    let positions = base_vertices.iter().map(|v| work.positions[v]).collect();
    let info = info(reference, fields, collapses.len());
    Built { info, base: BaseMesh { positions, values, tets: base_tets }, splits, oracle }
}

/// Bit `i` says whether the star's `i`-th tetrahedron, by its face opposite `v`, has the `b` end.
fn mask(collapse: &Collapse, number: &BTreeMap<u32, u32>) -> u64 {
    let mut faces: Vec<(Vec<u32>, bool)> = Vec::new();
    for (tet, with_b) in &collapse.star {
        let mut face: Vec<u32> = tet.iter().filter(|&&x| x != collapse.v).map(|x| number[x]).collect();
        face.sort_unstable();
        faces.push((face, *with_b));
    }
    faces.sort();
    faces.iter().enumerate().fold(0, |mask, (i, (_, with_b))| mask | u64::from(*with_b) << i)
}

fn info(reference: (usize, usize), fields: usize, updates: usize) -> MtInfo {
    let field = |f: usize| FieldInfo {
        name: format!("field {f}"),
        min: 0.0,
        max: 1.0,
        origin: 0.0,
        step: 1.0 / 255.0,
        bits: FIELD_BITS,
        ..FieldInfo::default()
    };
    MtInfo {
        kind: MtKind::Edge,
        lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: POSITION_BITS },
        fields: (0..fields).map(field).collect(),
        vertices: reference.0 as u32,
        tetrahedra: reference.1 as u64,
        updates: updates as u32,
        displacement_per_error: 1.0,
        quantization: 0.0,
        bounds: None,
    }
}
