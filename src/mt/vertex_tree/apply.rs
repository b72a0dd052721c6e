//! Vertex insertion and removal by the paper's node code [§5].
//!
//! In the current mesh, the tag of a tetrahedron is the update that removes it. That of t_u is found again by its tag; those of
//! all others have [`FIRST_ANONYMOUS_TAG`] in theirs, so that they are not: the rest of T_u is recognised by the stream, from t_u on.

use super::rebuild::{Polyhedron, rebuild};
use super::store::VertexTreeMt;
use super::tree_code::{Label, Tree, facets};
use crate::geom::{NARROW_BITS, orient3d};
use crate::mesh::{FACES, NONE};
use crate::mt::error::Result;
use crate::mt::mesh::FIRST_ANONYMOUS_TAG;
use crate::mt::mesh::stars::BARE;
use crate::mt::vertex::apply::show_built;
use crate::mt::vertex::bit_string::width_of;
use crate::mt::vertex::cavity::Cavity;
use crate::mt::vertex::cavity_fill::Face;
use crate::mt::vertex::limits::{MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
use crate::mt::{
    Applied, ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, LookAtTet, MultiTessellation, UpdateError,
    UpdateId, UpdatePages,
};
use std::ops::Range;

/// The tag of a tetrahedron that an update removes, [`NONE`] if none does.
#[inline]
fn tag_of(remover: u32, is_first: bool) -> u32 {
    if is_first { remover } else { remover | FIRST_ANONYMOUS_TAG }
}

/// The labels of a tetrahedron's vertices.
#[inline]
fn labels_of(mesh: &CurrentMesh, t: u32) -> [u32; 4] {
    mesh.tets[t as usize].map(|v| mesh.labels[v as usize].vertex)
}

impl VertexTreeMt {
    fn missing_parent(&self, mesh: &CurrentMesh, u: UpdateId) -> Option<UpdateId> {
        self.parents(u).find(|&p| mesh.slot(self.vertex(p)).is_none())
    }

    /// The paper's first task: collects T_u, all parents of `u` being applied, and the faces of Π_u. Tells where the stream ends.
    fn recognise(&self, mesh: &mut CurrentMesh, u: UpdateId, cavity: &mut Cavity) -> Option<u64> {
        let (tree, end) = Tree::read(&self.loops.nodes, self.stream_start(u))?;
        mesh.next_epoch();
        (cavity.tets_len, cavity.bare_len) = (0, 0);
        let mut sides = [[0; 3]; MAX_REMOVED];
        for (k, node) in (0..).zip(tree.nodes()) {
            let (t, entry) = if k == 0 {
                let first = mesh.tagged(u.0)?;
                (first, self.first_entry(mesh, u, first)?)
            } else {
                let from = cavity.tets[usize::from(node.parent)];
                let side: usize = sides[usize::from(node.parent)][usize::from(node.facet)];
                let t = Some(mesh.neighbors[from as usize][side]).filter(|&t| t != NONE)?;
                (t, usize::from(mesh.side_towards(t, from)?))
            };
            // Each tetrahedron is entered once, and is one that `u` removes.
            if mesh.number_tet(t, k).is_some() || mesh.tag(t) & !FIRST_ANONYMOUS_TAG != u.0 {
                return None;
            }
            cavity.tets[k as usize] = t;
            cavity.tets_len += 1;
            sides[k as usize] = facets(labels_of(mesh, t), entry);
            let outer = sides[k as usize].into_iter().zip(node.labels);
            let outer = outer.filter(|(_, label)| *label == Label::Boundary).map(|(side, _)| side);
            for side in (k == 0).then_some(entry).into_iter().chain(outer) {
                cavity.bare[cavity.bare_len % BARE] = [t, side as u32, mesh.neighbors[t as usize][side]];
                cavity.bare_len += 1;
            }
        }
        Some(end)
    }

    /// The corner of t_u that f_u lies opposite.
    fn first_entry(&self, mesh: &CurrentMesh, u: UpdateId, first: u32) -> Option<usize> {
        let labels = labels_of(mesh, first);
        let side = self.face(u).side as usize;
        (0..4).find(|&corner| labels.iter().filter(|&&label| label < labels[corner]).count() == side)
    }

    /// Finds the faces of Π_u that the star of the new vertex is to stand on.
    fn find_walls(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        cavity: &mut Cavity,
    ) -> Option<()> {
        let outer = cavity.bare[..cavity.bare_len].iter().filter(|[.., beyond]| *beyond == NONE);
        let is_behind = |[t, side, _]: &&[u32; 3]| {
            let tet = mesh.tets[*t as usize];
            let [a, b, c] = FACES[*side as usize & 3].map(|k| mesh.positions[tet[k] as usize]);
            orient3d(position, a, b, c) <= 0
        };
        let count = outer.clone().count();
        let behind: Vec<[u32; 2]> = outer.filter(is_behind).map(|&[t, side, _]| [t, side]).collect();
        let flags = self.exception(u).and_then(|exception| exception.given_up.as_deref());
        let mut is_given_up = |place: usize, face: [u32; 2]| match flags {
            Some(flags) => flags.get(place) == Some(&true),
            None => behind.contains(&face),
        };
        let given_up = (flags.is_some() || !behind.is_empty()).then_some(count);
        cavity.find_walls(mesh, given_up, &mut is_given_up)
    }

    /// Finds the tags of the new star, whose removers start at `removers`.
    fn find_tags(&self, mesh: &CurrentMesh, u: UpdateId, removers: u64, cavity: &mut Cavity) -> Option<()> {
        cavity.order_link(mesh);
        cavity.order_walls();
        let count = self.loops.children(u);
        let mut children = [NONE; MAX_INSERTED + 1];
        // By place in the star: the child whose t_u is there.
        let mut firsts = [NONE; MAX_INSERTED];
        for (i, child) in (1..=count).zip(&mut children[1..]) {
            let id = self.loops.child(u, i)?;
            *child = id.0;
            if self.parents(id).next() == Some(u) {
                let face = self.face(id);
                if !face.of_base {
                    *firsts.get_mut(face.tet as usize)? = id.0;
                }
            }
        }
        let width = width_of(count);
        let walls = cavity.walls_len;
        for (tag, &place) in cavity.tags[..walls].iter_mut().zip(&cavity.places) {
            let child = self.loops.nodes.get(removers + place as u64 * u64::from(width), width);
            let remover = *children.get(child as usize)?;
            *tag = tag_of(remover, firsts[place as usize % MAX_INSERTED] == remover);
        }
        cavity.quarterings[..walls].fill(0);
        Some(())
    }

    fn insert(&self, mesh: &mut CurrentMesh, u: UpdateId, cavity: &mut Cavity) -> Result<Applied> {
        let torn = UpdateError::Cavity { update: u.0 };
        if let Some(parent) = self.missing_parent(mesh, u) {
            return Ok(Applied::Blocked(parent));
        }
        if mesh.slot(self.vertex(u)).is_some() {
            return Err(torn);
        }
        let end = self.recognise(mesh, u, cavity).ok_or(torn.clone())?;
        let position = self.loops.position(u);
        self.find_walls(mesh, u, position, cavity).ok_or(torn.clone())?;
        if !cavity.is_star_positive(mesh, position, self.info().lattice.bits <= NARROW_BITS) {
            return Err(UpdateError::Inverted { update: u.0 });
        }
        self.find_tags(mesh, u, end, cavity).ok_or(torn)?;
        self.loops.perform_insertion(mesh, u, position, cavity);
        Ok(Applied::Done)
    }

    /// The paper's second task: builds T_u in Π_u, which is in canonical order.
    fn build_removed(&self, mesh: &CurrentMesh, u: UpdateId, cavity: &mut Cavity) -> Option<()> {
        let (tree, _) = Tree::read(&self.loops.nodes, self.stream_start(u))?;
        let mut positions = [[0; 3]; MAX_AROUND];
        for (position, &v) in positions.iter_mut().zip(&cavity.link[..cavity.link_len]) {
            *position = mesh.positions[v as usize];
        }
        let mut faces: [Face; MAX_INSERTED] = [[0; 3]; MAX_INSERTED];
        for (face, wall) in faces.iter_mut().zip(&cavity.walls[..cavity.walls_len]) {
            *face = wall.corners;
        }
        let exception = self.exception(u);
        let hole = Polyhedron {
            positions: &positions[..cavity.link_len],
            faces: &faces[..cavity.walls_len],
            first: self.face(u).star as usize,
            centre: self.loops.position(u),
            by_sides: exception.is_none_or(|exception| exception.given_up.is_none()),
        };
        let apexes = exception.and_then(|exception| exception.apexes.as_deref());
        rebuild(&tree, hole, apexes, &mut cavity.fill)
    }

    fn rebuild(&self, mesh: &mut CurrentMesh, u: UpdateId, cavity: &mut Cavity) -> Result<Applied> {
        self.loops.rebuild(mesh, u, cavity, |mesh, cavity| self.build_removed(mesh, u, cavity))
    }

    /// The update that removes base tetrahedron `t`, and whether that is its t_u.
    fn base_tag(&self, t: u32, remover: u32) -> u32 {
        let is_first = remover < self.updates() && {
            let face = self.face(UpdateId(remover));
            face.of_base && face.tet == t
        };
        tag_of(remover, is_first)
    }
}

impl UpdatePages for VertexTreeMt {
    fn page_bits(&self) -> u32 {
        self.loops.page_bits()
    }

    /// All updates are here.
    fn set_to_come(&mut self, _: &[ErrorCode]) {}

    fn page_inserted(&self, mesh: &mut CurrentMesh, updates: Range<u32>) {
        let removed = (0..mesh.tet_slots() as u32)
            .filter(|&t| self.remover(mesh, t).is_some_and(|u| updates.contains(&u.0)));
        let removed: Vec<u32> = removed.collect();
        mesh.touch(&removed);
    }
}

impl ApplyUpdates for VertexTreeMt {
    fn start(&self) -> Result<CurrentMesh, BaseMeshError> {
        let mut mesh = CurrentMesh::new(self.info(), self.base())?;
        let removers = (0..).zip(self.loops.base_removers());
        mesh.tag_all(removers.map(|(t, &u)| self.base_tag(t, u)));
        Ok(mesh)
    }

    #[inline]
    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        Some(mesh.tag(t) & !FIRST_ANONYMOUS_TAG).filter(|&u| u < self.updates()).map(UpdateId)
    }

    #[inline]
    fn creator(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        self.loops.creator(mesh, t)
    }

    #[inline]
    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool {
        self.loops.may_coarsen(mesh, u)
    }

    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, cavity| self.insert(mesh, u, cavity))
    }

    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, cavity| {
            let rebuilt = self.rebuild(mesh, u, cavity);
            if rebuilt == Ok(Applied::Done) {
                // The first tetrahedron of the stream is t_u.
                self.loops.perform_removal(mesh, u, cavity, |k| tag_of(u.0, k == 0));
            }
            rebuilt
        })
    }

    fn look_at_removed(&self, mesh: &mut CurrentMesh, u: UpdateId, look: LookAtTet<'_>) -> Result<Applied> {
        mesh.with_kind_state(|mesh, cavity| {
            let rebuilt = self.rebuild(mesh, u, cavity);
            if rebuilt == Ok(Applied::Done) {
                show_built(mesh, cavity, None, look);
            }
            rebuilt
        })
    }

    fn find_removed(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        if self.missing_parent(mesh, u).is_some() {
            return Err(UpdateError::Error { update: u.0 });
        }
        mesh.with_kind_state(|mesh, cavity| {
            self.recognise(mesh, u, cavity).ok_or(UpdateError::Cavity { update: u.0 })?;
            Ok(cavity.tets[..cavity.tets_len].to_vec())
        })
    }

    fn find_inserted(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        mesh.find_star(u, self.vertex(u))
    }
}
