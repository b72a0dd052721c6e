//! From an explicit MT to the vertex-based one with the paper's node code.

use super::rebuild::{Polyhedron, rebuild};
use super::store::{BoundaryFace, Exception, MostNeighbors, VertexTreeMt};
use super::tree_code::{Traversal, Tree};
use crate::geom::orient3d;
use crate::mesh::FACES;
use crate::mt::vertex::bit_string::Bits;
use crate::mt::vertex::cavity_fill::{CavityFill, Face, turned};
use crate::mt::vertex::from_explicit::{Canonical, Writer, children_of_all, damaged};
use crate::mt::{ConvertError, ExplicitMt, MultiTessellation, UpdateId, VertexId, VertexMt};

impl VertexTreeMt {
    /// The compact form, with the paper's node code, of an explicit MT whose updates are vertex insertions. `limit` says how much room
    /// nodes have for boundary faces.
    ///
    /// # Errors
    /// If an update is no vertex insertion, a larger one than [`VertexMt`] can hold, or one whose tetrahedra T_u do not hang together
    /// through faces, so that no tree spans them; if tetrahedra have errors of their own.
    pub fn from_explicit(mt: &ExplicitMt, limit: MostNeighbors) -> Result<Self, ConvertError> {
        // Without updates there is nothing that such errors would be parts of.
        if mt.has_tet_errors() && mt.updates() > 0 {
            return Err(ConvertError::Update { update: 0, why: "its tetrahedra have errors of their own" });
        }
        let children = children_of_all(mt);
        let mut loops = VertexMt::without_updates(mt, &children)?;
        loops.base_quarterings = None;
        let codes = write_codes(mt, limit, &children, &loops)?;
        let parents: Vec<Vec<u32>> = (0..).zip(&codes).map(|(u, code)| code.parents(mt, u)).collect();
        let parents = |u: u32| &parents[u as usize][..];
        let writer = Writer::new(mt, &children, &parents);
        for (u, code) in (0..mt.updates()).map(UpdateId).zip(&codes) {
            let mut bits = Bits::default();
            writer.write_vertex(&mut bits, &loops, u);
            writer.write_links(&mut bits, &loops, u);
            bits.extend(&code.tree);
            bits.extend(&code.removers);
            loops.store(&bits, mt.errors(u)).map_err(damaged)?;
        }
        let sum = |bits: &dyn Fn(&Code) -> &Bits| codes.iter().map(|code| bits(code).len()).sum();
        let (code_bits, remover_bits) = (sum(&|code| &code.tree), sum(&|code| &code.removers));
        let exceptions = codes.into_iter().map(|code| code.exception).filter(Exception::is_needed);
        Ok(Self { loops, limit, exceptions: exceptions.collect(), code_bits, remover_bits })
    }
}

/// What comes behind the links of a node.
struct Code {
    /// The update that created t_u; none if that is of the base mesh.
    creator: Option<UpdateId>,
    /// Boundary face and stream.
    tree: Bits,
    removers: Bits,
    exception: Exception,
}

impl Code {
    /// The parents of the update in the order of its loop.
    fn parents(&self, mt: &ExplicitMt, u: u32) -> Vec<u32> {
        let first = self.creator.map(|creator| creator.0);
        let all = mt.parents(UpdateId(u)).iter().copied();
        first.into_iter().chain(all.filter(|&parent| Some(parent) != first)).collect()
    }
}

/// The codes of all updates: before the first loop can be written, each must have its first parent.
fn write_codes(
    mt: &ExplicitMt,
    limit: MostNeighbors,
    children: &[Vec<u32>],
    loops: &VertexMt,
) -> Result<Vec<Code>, ConvertError> {
    let parents = |u: u32| mt.parents(UpdateId(u));
    let mut writer = Writer::new(mt, children, &parents);
    // Of tetrahedra of the base mesh their numbers, of all others their places in stars.
    let mut places: Vec<u32> = mt.base_tets().collect();
    places.resize(mt.tets().len(), 0);
    let mut fill = Box::<CavityFill>::default();
    let mut codes = Vec::with_capacity(mt.updates() as usize);
    for u in (0..mt.updates()).map(UpdateId) {
        let canonical = writer.canonical(u, loops.vertex(u))?;
        for (place, &(_, t)) in (0..).zip(&canonical.walls) {
            places[t as usize] = place;
        }
        let mut removers = Bits::default();
        writer.write_removers(&mut removers, loops, u, &canonical);
        let hole = HoleOf::new(mt, u, &canonical, loops.vertex(u));
        let torn = ConvertError::Update { update: u.0, why: "it does not fill the hole that it leaves" };
        codes.push(hole.code(limit, &places, removers, &mut fill).ok_or(torn)?);
    }
    Ok(codes)
}

/// An update whose code is written.
struct HoleOf<'a> {
    mt: &'a ExplicitMt,
    u: UpdateId,
    canonical: &'a Canonical,
    faces: Vec<Face>,
    positions: Vec<[i32; 3]>,
    centre: [i32; 3],
}

/// A boundary face that can be f_u: what names it, and where it is in T_u.
struct Candidate {
    face: BoundaryFace,
    creator: Option<UpdateId>,
    tet: usize,
    corner: usize,
}

impl<'a> HoleOf<'a> {
    fn new(mt: &'a ExplicitMt, u: UpdateId, canonical: &'a Canonical, vertex: VertexId) -> Self {
        Self {
            mt,
            u,
            canonical,
            faces: canonical.walls.iter().map(|(face, _)| *face).collect(),
            positions: canonical.link.iter().map(|&v| mt.position(VertexId(v))).collect(),
            centre: mt.position(vertex),
        }
    }

    /// None if a face of Π_u is none of T_u.
    fn code(
        &self,
        limit: MostNeighbors,
        places: &[u32],
        removers: Bits,
        fill: &mut CavityFill,
    ) -> Option<Code> {
        let mut exception =
            Exception { update: self.u.0, given_up: self.given_up_exception(), ..Exception::default() };
        let by_sides = exception.given_up.is_none();
        let has_parents = !self.mt.parents(self.u).is_empty();
        let all: Vec<Candidate> =
            (0..self.faces.len()).map(|star| self.candidate(star, places)).collect::<Option<_>>()?;
        let (fitting, others): (Vec<Candidate>, Vec<Candidate>) =
            all.into_iter().partition(|candidate| candidate.face.fits(limit, has_parents));
        let candidates = if fitting.is_empty() { others } else { fitting };
        let mut traversal = Traversal::of(&self.canonical.removed);
        let leads_back = |candidate: &&Candidate| {
            let tree = traversal.from(candidate.tet, candidate.corner);
            tree.is_some_and(|(tree, _)| self.leads_back(tree, candidate, by_sides, fill))
        };
        let found = candidates.iter().find(leads_back);
        let candidate = found.or(candidates.first())?;
        let (tree, apexes) = traversal.from(candidate.tet, candidate.corner)?;
        exception.apexes = found.is_none().then(|| apexes.to_vec());
        exception.face = Some(candidate.face).filter(|face| !face.fits(limit, has_parents));
        let mut bits = Bits::default();
        candidate.face.write(limit, &mut bits);
        tree.write(&mut bits);
        Some(Code { creator: candidate.creator, tree: bits, removers, exception })
    }

    /// The face of Π_u at a place of the star.
    fn candidate(&self, star: usize, places: &[u32]) -> Option<Candidate> {
        let has_face = |tet: &[u8; 4]| (0..4).find(|&c| turned(FACES[c].map(|k| tet[k])) == self.faces[star]);
        let mut all = self.canonical.removed.iter().enumerate();
        let (tet, corner) = all.find_map(|(i, tet)| Some((i, has_face(tet)?)))?;
        let number = *self.mt.removed(self.u).get(tet)?;
        let creator = self.mt.inserted_by(number);
        let labels = self.canonical.removed[tet];
        let face = BoundaryFace {
            of_base: creator.is_none(),
            tet: *places.get(number as usize)?,
            side: labels.iter().filter(|&&label| label < labels[corner]).count() as u32,
            star: star as u32,
        };
        Some(Candidate { face, creator, tet, corner })
    }

    /// Whether the second task, done by this stream alone, gives T_u.
    fn leads_back(&self, tree: &Tree, candidate: &Candidate, by_sides: bool, fill: &mut CavityFill) -> bool {
        let hole = Polyhedron {
            positions: &self.positions,
            faces: &self.faces,
            first: candidate.face.star as usize,
            centre: self.centre,
            by_sides,
        };
        let in_order = |tets: &[[u8; 4]]| {
            let mut tets = tets.to_vec();
            tets.iter_mut().for_each(|tet| tet.sort_unstable());
            tets.sort_unstable();
            tets
        };
        rebuild(tree, hole, None, fill).is_some()
            && in_order(&fill.tets[..fill.len]) == in_order(&self.canonical.removed)
    }

    /// Which faces on the boundary of the domain are given up, if their sides do not tell.
    fn given_up_exception(&self) -> Option<Vec<bool>> {
        let Canonical { link, removed, bare, .. } = self.canonical;
        let faces = removed.iter().flat_map(|tet| FACES.map(|face| face.map(|k| tet[k])));
        let mut in_front = faces.filter(|face| {
            let [a, b, c] = face.map(|x| self.positions[usize::from(x)]);
            orient3d(self.centre, a, b, c) > 0
        });
        let is_given_up = |face: &[u8; 3]| {
            let mut labels = face.map(|x| link[usize::from(x)]);
            labels.sort_unstable();
            bare.binary_search(&(labels, true)).is_ok()
        };
        let told_by_sides = !in_front.any(|face| is_given_up(&face));
        (!told_by_sides).then(|| bare.iter().map(|(_, given_up)| *given_up).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::{
        Applied, ApplyUpdates, BaseMesh, ErrorCode, ExplicitUpdate, FieldInfo, MtInfo, MtKind, UpdateError,
    };

    /// A vertex that is inserted into three tetrahedra around an edge.
    fn around_an_edge() -> ExplicitMt {
        let positions = vec![[100, 100, 10], [100, 100, 190], [190, 100, 100], [50, 160, 100], [50, 40, 100]];
        let tets = vec![[0, 2, 3, 1], [0, 3, 4, 1], [0, 4, 2, 1]];
        let field = FieldInfo { name: "f".into(), bits: 8, ..FieldInfo::default() };
        let info = MtInfo {
            kind: MtKind::Vertex,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 8 },
            fields: vec![field],
            vertices: 6,
            tetrahedra: 6,
            updates: 1,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        };
        let mut mt = ExplicitMt::new(info, BaseMesh { values: vec![0; 5], positions, tets });
        let around = [[2, 3], [3, 4], [4, 2]];
        let inserted: Vec<[u32; 4]> =
            around.iter().flat_map(|&[a, b]| [[0, a, b, 5], [1, b, a, 5]]).collect();
        let update = ExplicitUpdate {
            positions: &[[102, 101, 96]],
            levels: &[7],
            removed: &[0, 1, 2],
            inserted: &inserted,
            errors: &[ErrorCode(9)],
        };
        mt.push(&update).expect("an insertion");
        mt
    }

    #[test]
    fn apexes_that_are_noted_lead_to_the_tetrahedra_and_to_nothing_else() {
        let explicit = around_an_edge();
        let plain = VertexTreeMt::from_explicit(&explicit, MostNeighbors::ThirtyTwo).expect("insertions");
        let u = UpdateId(0);
        let undone = |apexes: Option<Vec<u8>>| {
            let exceptions = vec![Exception { update: 0, apexes, ..Exception::default() }];
            let mt = VertexTreeMt { exceptions, ..plain.clone() };
            let mut mesh = mt.start().expect("a valid base mesh");
            let before = mesh.hash();
            assert_eq!(mt.refine(&mut mesh, u), Ok(Applied::Done));
            let after = mesh.hash();
            let result = mt.coarsen(&mut mesh, u);
            assert_eq!(mesh.check(), Ok(()));
            assert_eq!(mesh.hash(), if result.is_ok() { before } else { after });
            result
        };
        assert_eq!(undone(None), Ok(Applied::Done));
        let torn = Err(UpdateError::Cavity { update: 0 });
        // Of 125 ways to name three of the five vertices one is right.
        let all = (0..125_u8).map(|i| vec![i % 5, i / 5 % 5, i / 25]);
        let results: Vec<_> = all.map(|apexes| undone(Some(apexes))).collect();
        assert_eq!(results.iter().filter(|result| **result == Ok(Applied::Done)).count(), 1);
        assert_eq!(results.iter().filter(|result| **result == torn).count(), 124);
        assert_eq!(undone(Some(vec![])), torn);
    }
}
