//! From an explicit MT to the compact vertex-based one, where every update is a vertex insertion.

use super::bit_string::{Bits, width_of};
use super::cavity_fill::{CavityFill, Face, turned};
use super::limits::{MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
use super::shape_code::{Hole, write_given_up, write_removed};
use super::sphere_order::Spheres;
use crate::mesh::{FACES, NONE};
use crate::mt::{
    ConvertError, ExplicitMt, MtInfo, MtKind, MultiTessellation, NodeBits, ReplayError, UpdateError,
    UpdateId, VertexId, VertexMt,
};
use std::collections::{HashMap, HashSet};

impl VertexMt {
    /// The compact form of an explicit MT whose updates are vertex insertions.
    ///
    /// # Errors
    /// If an update is no vertex insertion, or a larger one than a node can hold.
    pub fn from_explicit(mt: &ExplicitMt) -> Result<Self, ConvertError> {
        let children = children_of_all(mt);
        let mut compact = Self::without_updates(mt, &children)?;
        let parents = |u: u32| mt.parents(UpdateId(u));
        let mut writer = Writer::new(mt, &children, &parents);
        for u in (0..mt.updates()).map(UpdateId) {
            let canonical = writer.canonical(u, compact.vertex(u))?;
            let mut bits = Bits::default();
            writer.write_vertex(&mut bits, &compact, u);
            writer.write_links(&mut bits, &compact, u);
            writer.write_shape(&mut bits, &compact, u, &canonical)?;
            compact.push(&NodeBits(bits), mt.errors(u)).map_err(damaged)?;
            compact.set_own_fall(u, mt.own_fall(u));
        }
        Ok(compact)
    }

    /// With the base mesh of an explicit MT, what removes that, and room for so many children.
    pub(in crate::mt) fn without_updates(
        mt: &ExplicitMt,
        children: &[Vec<u32>],
    ) -> Result<Self, ConvertError> {
        let most_children = children.iter().map(Vec::len).max().unwrap_or(0) as u32;
        let info = MtInfo { kind: MtKind::Vertex, updates: mt.updates(), ..mt.info().clone() };
        let base_removers: Vec<u32> =
            mt.base_tets().map(|t| mt.removed_by(t).map_or(NONE, |u| u.0)).collect();
        let base = mt.base().clone();
        let compact =
            Self::new(info, base, base_removers, most_children.min(MAX_INSERTED as u32), mt.always_grows)
                .map_err(damaged)?;
        let Some(quarterings) = mt.quarterings() else { return Ok(compact) };
        compact.with_tet_errors(quarterings[..mt.base_tets().len()].to_vec()).map_err(damaged)
    }
}

/// The children of each update.
pub(in crate::mt) fn children_of_all(mt: &ExplicitMt) -> Vec<Vec<u32>> {
    (0..mt.updates()).map(|u| mt.children(UpdateId(u))).collect()
}

pub(in crate::mt) fn damaged(error: UpdateError) -> ConvertError {
    ConvertError::Damaged(ReplayError::Update(error))
}

/// The faces of the base mesh that only one tetrahedron has.
fn boundary_faces(mt: &ExplicitMt) -> HashSet<[u32; 3]> {
    let mut faces = HashSet::new();
    for t in mt.base_tets() {
        for face in FACES.map(|face| sorted(face.map(|k| mt.tets()[t as usize][k]))) {
            if !faces.remove(&face) {
                faces.insert(face);
            }
        }
    }
    faces
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Writes the updates of an explicit MT as nodes, in their order.
pub(in crate::mt) struct Writer<'a> {
    mt: &'a ExplicitMt,
    children: &'a [Vec<u32>],
    /// The parents of an update, in the order of its loop.
    parents: &'a dyn Fn(u32) -> &'a [u32],
    /// The faces that only one tetrahedron has, in the mesh of the updates so far.
    boundary: HashSet<[u32; 3]>,
    fill: Box<CavityFill>,
}

/// An insertion in canonical numbers.
pub(in crate::mt) struct Canonical {
    /// The labels of the vertices of Π_u, ascending.
    pub link: Vec<u32>,
    /// The faces of Π_u in canonical order, and the number of the tetrahedron that each becomes.
    pub walls: Vec<(Face, u32)>,
    /// T_u.
    pub removed: Vec<[u8; 4]>,
    /// The boundary faces of T_u, by sorted labels, and whether each is given up.
    pub bare: Vec<([u32; 3], bool)>,
}

impl<'a> Writer<'a> {
    pub fn new(mt: &'a ExplicitMt, children: &'a [Vec<u32>], parents: &'a dyn Fn(u32) -> &'a [u32]) -> Self {
        Self { mt, children, parents, boundary: boundary_faces(mt), fill: Box::default() }
    }

    pub fn write_vertex(&self, bits: &mut Bits, compact: &VertexMt, u: UpdateId) {
        let vertex = compact.vertex(u);
        for x in self.mt.position(vertex) {
            bits.push(x as u64, compact.widths.position);
        }
        for (&level, field) in self.mt.levels(vertex).iter().zip(&compact.info().fields) {
            bits.push(level as u64, field.bits);
        }
    }

    /// The link that comes behind member `at` of the loop of `owner`, where 0 is the owner and `i` its `i`-th parent.
    fn next_in_loop(&self, owner: u32, at: usize) -> [u32; 2] {
        match (self.parents)(owner).get(at) {
            Some(&parent) => [parent, 1 + self.place_of_child(parent, owner)],
            None => [owner, 0],
        }
    }

    fn place_of_child(&self, parent: u32, child: u32) -> u32 {
        self.children[parent as usize].partition_point(|&c| c < child) as u32
    }

    pub fn write_links(&self, bits: &mut Bits, compact: &VertexMt, u: UpdateId) {
        let widths = compact.widths;
        let children = &self.children[u.0 as usize];
        bits.push(children.len() as u64, widths.link);
        let own = self.next_in_loop(u.0, 0);
        let of_children = children.iter().map(|&child| {
            let at = (self.parents)(child).iter().take_while(|&&p| p != u.0).count();
            self.next_in_loop(child, at + 1)
        });
        for [node, link] in std::iter::once(own).chain(of_children) {
            bits.push(u64::from(node), widths.node);
            bits.push(u64::from(link), widths.link);
        }
    }

    /// Finds canonical numbers of the next update and checks that it is an insertion that fits a node.
    pub fn canonical(&mut self, u: UpdateId, vertex: VertexId) -> Result<Canonical, ConvertError> {
        let refuse = |why| ConvertError::Update { update: u.0, why };
        let (mt, v) = (self.mt, vertex.0);
        let newest = mt.inserted(u).flat_map(|t| mt.tets()[t as usize]).max();
        let all_at_vertex = mt.inserted(u).all(|t| mt.tets()[t as usize].contains(&v));
        let removed = || mt.removed(u).iter().map(|&t| mt.tets()[t as usize]);
        if newest != Some(v) || !all_at_vertex || removed().flatten().any(|w| w == v) {
            return Err(refuse("it is not the insertion of one vertex"));
        }
        let mut walls: Vec<([u32; 3], u32)> = Vec::new();
        for t in mt.inserted(u) {
            let tet = mt.tets()[t as usize];
            let corner = tet.iter().position(|&w| w == v).unwrap_or(0);
            walls.push((FACES[corner].map(|k| tet[k]), t));
        }
        walls.sort_unstable_by_key(|(face, _)| sorted(*face));
        let mut link: Vec<u32> = walls.iter().flat_map(|(face, _)| *face).collect();
        link.sort_unstable();
        link.dedup();
        if walls.len() > MAX_INSERTED || link.len() > MAX_AROUND || mt.removed(u).len() > MAX_REMOVED {
            return Err(refuse("it removes more than 127 or inserts more than 124 tetrahedra"));
        }
        if removed().flatten().any(|w| link.binary_search(&w).is_err()) {
            return Err(refuse("it takes a vertex away, which the insertion of one does not"));
        }
        let number = |w: u32| link.partition_point(|&x| x < w) as u8;
        let mut bare = Vec::new();
        let mut uses: HashMap<[u32; 3], u32> = HashMap::new();
        for tet in removed() {
            FACES.iter().for_each(|face| *uses.entry(sorted(face.map(|k| tet[k]))).or_default() += 1);
        }
        let kept: HashSet<[u32; 3]> = walls.iter().map(|(face, _)| sorted(*face)).collect();
        for (face, _) in uses.into_iter().filter(|&(face, count)| count == 1 && self.boundary.contains(&face))
        {
            bare.push((face, !kept.contains(&face)));
        }
        bare.sort_unstable();
        if bare.iter().any(|(_, given_up)| *given_up) {
            move_boundary(&mut self.boundary, &bare, &walls, v);
        } else {
            bare.clear();
        }
        let removed: Vec<[u8; 4]> = removed().map(|tet| tet.map(number)).collect();
        if !hangs_together(&removed) {
            return Err(refuse("what it removes does not hang together through faces"));
        }
        let walls = walls.iter().map(|&(face, t)| (turned(face.map(number)), t)).collect();
        Ok(Canonical { link, walls, removed, bare })
    }

    /// Appends which child removes each tetrahedron of the star, counted from 1, with its quarterings where there are such.
    pub fn write_removers(&self, bits: &mut Bits, compact: &VertexMt, u: UpdateId, canonical: &Canonical) {
        let children = &self.children[u.0 as usize];
        let own = compact.quartering_bits(children.len() as u32);
        for (_, t) in &canonical.walls {
            let remover = self.mt.removed_by(*t);
            let child = remover.map_or(0, |c| 1 + self.place_of_child(u.0, c.0));
            bits.push(u64::from(child), width_of(children.len() as u32));
            bits.push(u64::from(self.mt.quarterings_of(*t)), own);
        }
    }

    fn write_shape(
        &mut self,
        bits: &mut Bits,
        compact: &VertexMt,
        u: UpdateId,
        canonical: &Canonical,
    ) -> Result<(), ConvertError> {
        let given_up: Vec<bool> = canonical.bare.iter().map(|(_, given_up)| *given_up).collect();
        let on_boundary = !given_up.is_empty();
        write_given_up(bits, canonical.removed.len(), &given_up)
            .ok_or(ConvertError::Update { update: u.0, why: "it has too many faces on the boundary" })?;
        self.write_removers(bits, compact, u, canonical);
        let torn = ConvertError::Update { update: u.0, why: "it does not fill the hole that it leaves" };
        let Canonical { link, walls, removed, .. } = canonical;
        let spheres = || Spheres::of(link.iter().map(|&v| self.mt.position(VertexId(v))));
        let faces: Vec<Face> = walls.iter().map(|(face, _)| *face).collect();
        if !are_faces_of(&faces, removed) {
            return Err(torn);
        }
        let hole = Hole { vertices: link.len() as u32, faces: &faces, removed, on_boundary };
        write_removed(&mut self.fill, bits, hole, spheres).ok_or(torn)
    }
}

/// Whether all faces are such of the tetrahedra, from the same side.
fn are_faces_of(faces: &[Face], tets: &[[u8; 4]]) -> bool {
    let sides = |tet: &[u8; 4]| FACES.map(|face| turned(face.map(|k| tet[k])));
    let sides: HashSet<Face> = tets.iter().flat_map(sides).collect();
    faces.iter().all(|face| sides.contains(face))
}

/// Whether one can go from each tetrahedron to each other one through faces.
fn hangs_together(tets: &[[u8; 4]]) -> bool {
    let mut reached = vec![false; tets.len()];
    let mut stack = vec![0];
    while let Some(i) = stack.pop() {
        if std::mem::replace(&mut reached[i], true) {
            continue;
        }
        let shared = |other: &[u8; 4]| other.iter().filter(|v| tets[i].contains(v)).count();
        stack.extend((0..tets.len()).filter(|&j| !reached[j] && shared(&tets[j]) == 3));
    }
    reached.into_iter().all(|reached| reached)
}

/// Takes the faces that are given up out of the boundary and puts those in their place in.
fn move_boundary(
    boundary: &mut HashSet<[u32; 3]>,
    bare: &[([u32; 3], bool)],
    walls: &[([u32; 3], u32)],
    v: u32,
) {
    for (face, _) in bare.iter().filter(|(_, given_up)| *given_up) {
        boundary.remove(face);
    }
    let mut rim: HashSet<[u32; 2]> = HashSet::new();
    for ([a, b, c], _) in walls {
        for [x, y] in [[a, b], [b, c], [c, a]] {
            let edge = [*x.min(y), *x.max(y)];
            if !rim.remove(&edge) {
                rim.insert(edge);
            }
        }
    }
    boundary.extend(rim.into_iter().map(|[x, y]| sorted([x, y, v])));
}
