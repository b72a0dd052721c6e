//! What the mesh of a request must be, by the definition alone: from a list of all tetrahedra of the MT, without refinement.

use super::fronts::satisfy;
use super::queries::Query;
use foldhash::HashMap;
use tetralod::mesh::BitSet;
use tetralod::mt::{
    ApplyUpdates, CurrentMesh, ErrorCode, ExplicitMt, MultiTessellation, ReplayError, UpdateId, VertexId,
    canonical, mix,
};
use tetralod::refine::{Criterion, Front, TetData};

/// A mesh that is not a function of the request alone.
pub const NOT_EXPECTED: &str = "the mesh is not that of the updates which the request needs";

/// All tetrahedra and updates of an MT, and hashes of its meshes: sums of those of their tetrahedra.
pub struct Expected {
    mt: ExplicitMt,
    base: u64,
    /// By how much each update changes the hash.
    changes: Vec<u64>,
    /// The region of each tetrahedron; empty if the MT has none.
    regions: Vec<u16>,
    /// The levels of vertices in single regions where fields jump.
    sides: Sides,
}

/// Levels by vertex and region.
type Sides = HashMap<(u32, u16), Vec<i32>>;

impl Expected {
    pub fn of(mt: &impl ApplyUpdates) -> Result<Self, String> {
        let damaged = |error: ReplayError| format!("the updates: {error}");
        let (regions, sides) = regions_of(mt).map_err(damaged)?;
        let mt = ExplicitMt::of(mt).map_err(damaged)?;
        let of_vertex = |v| hash_of_vertex(v, mt.position(v), mt.levels(v));
        let vertices: Vec<u64> = (0..mt.vertices()).map(VertexId).map(of_vertex).collect();
        let of_tet = |t: u32| {
            let side = |v: u32| {
                let levels = sides.get(&(v, regions.get(t as usize).copied().unwrap_or(0)));
                levels.map_or(vertices[v as usize], |levels| {
                    hash_of_vertex(VertexId(v), mt.position(VertexId(v)), levels)
                })
            };
            hash_of_tet(mt.tets()[t as usize].map(side))
        };
        let base = sum(mt.base_tets().map(of_tet));
        let inserted = |u| sum(mt.inserted(u).map(of_tet));
        let removed = |u| sum(mt.removed(u).iter().map(|&t| of_tet(t)));
        let change = |u| inserted(u).wrapping_sub(removed(u));
        let changes = (0..mt.updates()).map(UpdateId).map(change).collect();
        Ok(Self { mt, base, changes, regions, sides })
    }

    /// The hash of the mesh of a request. Which mesh is the best within a budget takes refinement to find out: from `base`, the base mesh.
    pub fn hash(&self, mt: &impl ApplyUpdates, base: &Front, query: &Query) -> Result<u64, String> {
        if query.request.budget.is_unlimited() {
            return Ok(self.hash_without_violations(&query.criterion(mt.info())));
        }
        let mut front = base.clone();
        satisfy(mt, &mut front, query)?;
        Ok(hash(front.mesh()))
    }

    /// Removes each tetrahedron that violates `criterion`, by the update that does so and those on which it depends.
    fn hash_without_violations(&self, criterion: &impl Criterion) -> u64 {
        let mut hash = self.base;
        let mut needed = BitSet::default();
        let mut tets: Vec<u32> = self.mt.base_tets().collect();
        let mut waiting = Vec::new();
        while let Some(t) = tets.pop() {
            let remover = self.mt.removed_by(t).filter(|u| !needed.has(u.0));
            waiting.extend(remover.filter(|&u| self.violates(t, u, criterion)).map(|u| u.0));
            while let Some(u) = waiting.pop() {
                if needed.insert(u) {
                    hash = hash.wrapping_add(self.changes[u as usize]);
                    waiting.extend(self.mt.parents(UpdateId(u)));
                    tets.extend(self.mt.inserted(UpdateId(u)));
                }
            }
        }
        hash
    }

    /// Whether a tetrahedron, which this update removes, violates `criterion`.
    fn violates(&self, t: u32, update: UpdateId, criterion: &impl Criterion) -> bool {
        let mt = &self.mt;
        let tet = mt.tets()[t as usize].map(VertexId);
        let corners = tet.map(|v| mt.position(v));
        let region = self.regions.get(t as usize).copied().unwrap_or(0);
        let in_region = |v: VertexId| self.sides.get(&(v.0, region)).map_or(mt.levels(v), |levels| levels);
        let levels = |field: usize| tet.map(|v| in_region(v)[field]);
        let own: Vec<ErrorCode>;
        let errors = if mt.has_tet_errors() {
            own = (0..mt.fields()).map(|f| mt.own_error(update, f, mt.quarterings_of(t))).collect();
            &own
        } else {
            mt.errors(update)
        };
        let error = errors.iter().max().copied().unwrap_or_default();
        let look = TetData { corners: &corners, levels: &levels, error, errors, update, region };
        criterion.judge(&look).violates()
    }
}

/// The region of each tetrahedron of the explicit form of an MT, empty if it has none, and the levels of vertices in their regions if
/// fields jump.
fn regions_of(mt: &impl ApplyUpdates) -> Result<(Vec<u16>, Sides), ReplayError> {
    let Some(regions) = mt.regions() else { return Ok((Vec::new(), Sides::default())) };
    let mut all = regions.of_base.clone();
    let mut sides = Sides::default();
    let mut mesh = mt.start()?;
    let jumps = regions.has_sides();
    let mut note = |mesh: &CurrentMesh, t: u32| {
        for slot in mesh.tet(t).into_iter().flatten().filter(|_| jumps) {
            let key = (mesh.vertex(slot).0, mesh.regions()[t as usize]);
            sides.entry(key).or_insert_with(|| mesh.levels(slot).to_vec());
        }
    };
    (0..mesh.tet_slots() as u32).for_each(|t| note(&mesh, t));
    mt.updates_arrived(&mut mesh, 0);
    for u in (0..mt.updates()).map(UpdateId) {
        mt.refine(&mut mesh, u)?;
        let inserted = mt.find_inserted(&mut mesh, u)?;
        // As that form orders those of an update.
        let named = |&t: &u32| {
            let tet = mesh.joined_tets()[t as usize];
            (canonical(tet.map(|v| mesh.vertex(v).0)), mesh.regions()[t as usize])
        };
        inserted.iter().for_each(|&t| note(&mesh, t));
        let mut own: Vec<([u32; 4], u16)> = inserted.iter().map(named).collect();
        own.sort_unstable();
        all.extend(own.into_iter().map(|(_, region)| region));
    }
    Ok((all, sides))
}

/// The hash of each vertex of a packed mesh.
pub fn hashes_of_vertices(mesh: &CurrentMesh) -> Vec<u64> {
    let of_vertex = |(slot, &p): (u32, &[i32; 3])| hash_of_vertex(mesh.vertex(slot), p, mesh.levels(slot));
    (0..).zip(mesh.positions()).map(of_vertex).collect()
}

/// The hash of a packed mesh.
pub fn hash(mesh: &CurrentMesh) -> u64 {
    let vertices = hashes_of_vertices(mesh);
    sum(mesh.tets().iter().map(|tet| hash_of_tet(tet.map(|v| vertices[v as usize]))))
}

fn hash_of_vertex(v: VertexId, position: [i32; 3], levels: &[i32]) -> u64 {
    let words = position.iter().chain(levels).map(|&x| x as u32);
    words.fold(u64::from(v.0), |h, word| mix(h ^ u64::from(word)))
}

/// The hash of a tetrahedron by those of its corners, the same in any order of them.
pub fn hash_of_tet([a, b, c, d]: [u64; 4]) -> u64 {
    mix(a.wrapping_add(b).wrapping_add(c).wrapping_add(d) ^ mix(a ^ b ^ c ^ d))
}

fn sum(hashes: impl Iterator<Item = u64>) -> u64 {
    hashes.fold(0, u64::wrapping_add)
}
