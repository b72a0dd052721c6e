//! From an explicit MT to the compact vertex-based one, where every update is a vertex insertion.

use super::apply::choices;
use super::bit_string::{Bits, width_of};
use super::cavity_fill::{Close, Face, Glue, turned};
use super::sphere_order::{ApexCode, Spheres};
use super::store::{COUNT_BITS, MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
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
        let updates = mt.updates();
        let children: Vec<Vec<u32>> = (0..updates).map(|u| mt.children(UpdateId(u))).collect();
        let most_children = children.iter().map(Vec::len).max().unwrap_or(0) as u32;
        let info = MtInfo { kind: MtKind::Vertex, updates, ..mt.info().clone() };
        let base_removers: Vec<u32> =
            mt.base_tets().map(|t| mt.removed_by(t).map_or(NONE, |u| u.0)).collect();
        let base = mt.base().clone();
        let mut compact =
            Self::new(info, base, base_removers, most_children.min(MAX_INSERTED as u32), mt.always_grows)
                .map_err(damaged)?;
        if let Some(quarterings) = mt.quarterings() {
            let base = quarterings[..mt.base_tets().len()].to_vec();
            compact = compact.with_tet_errors(base).map_err(damaged)?;
        }
        let mut boundary: HashSet<[u32; 3]> = boundary_faces(mt);
        let mut writer = Writer { mt, children: &children, glue: Box::default() };
        for u in (0..updates).map(UpdateId) {
            let node = writer.node(&compact, u, &mut boundary)?;
            compact.push(&node, mt.errors(u)).map_err(damaged)?;
            compact.set_own_fall(u, mt.own_fall(u));
        }
        Ok(compact)
    }
}

fn damaged(error: UpdateError) -> ConvertError {
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

struct Writer<'a> {
    mt: &'a ExplicitMt,
    children: &'a [Vec<u32>],
    glue: Box<Glue>,
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

impl Writer<'_> {
    fn node(
        &mut self,
        compact: &VertexMt,
        u: UpdateId,
        boundary: &mut HashSet<[u32; 3]>,
    ) -> Result<NodeBits, ConvertError> {
        let vertex = compact.vertex(u);
        let canonical = self.canonical(u, vertex, boundary)?;
        let mut bits = Bits::default();
        for x in self.mt.position(vertex) {
            bits.push(x as u64, compact.widths.position);
        }
        for (&level, field) in self.mt.levels(vertex).iter().zip(&compact.info().fields) {
            bits.push(level as u64, field.bits);
        }
        self.write_links(&mut bits, compact, u);
        self.write_shape(&mut bits, compact, u, &canonical)?;
        Ok(NodeBits(bits))
    }

    /// The link that comes behind member `at` of the loop of `owner`, where 0 is the owner and `i` its `i`-th parent.
    fn next_in_loop(&self, owner: u32, at: usize) -> [u32; 2] {
        match self.mt.parents(UpdateId(owner)).get(at) {
            Some(&parent) => [parent, 1 + self.place_of_child(parent, owner)],
            None => [owner, 0],
        }
    }

    fn place_of_child(&self, parent: u32, child: u32) -> u32 {
        self.children[parent as usize].partition_point(|&c| c < child) as u32
    }

    fn write_links(&self, bits: &mut Bits, compact: &VertexMt, u: UpdateId) {
        let widths = compact.widths;
        let children = &self.children[u.0 as usize];
        bits.push(children.len() as u64, widths.link);
        let own = self.next_in_loop(u.0, 0);
        let of_children = children.iter().map(|&child| {
            let at = self.mt.parents(UpdateId(child)).partition_point(|&p| p < u.0);
            self.next_in_loop(child, at + 1)
        });
        for [node, link] in std::iter::once(own).chain(of_children) {
            bits.push(u64::from(node), widths.node);
            bits.push(u64::from(link), widths.link);
        }
    }

    /// Finds canonical numbers and checks that the update is an insertion that fits a node. Moves `boundary` on.
    fn canonical(
        &self,
        u: UpdateId,
        vertex: VertexId,
        boundary: &mut HashSet<[u32; 3]>,
    ) -> Result<Canonical, ConvertError> {
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
        for (face, _) in uses.into_iter().filter(|&(face, count)| count == 1 && boundary.contains(&face)) {
            bare.push((face, !kept.contains(&face)));
        }
        bare.sort_unstable();
        if bare.iter().any(|(_, given_up)| *given_up) {
            move_boundary(boundary, &bare, &walls, v);
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
        let children = &self.children[u.0 as usize];
        let own = compact.quartering_bits(children.len() as u32);
        for (_, t) in &canonical.walls {
            let remover = self.mt.removed_by(*t);
            let child = remover.map_or(0, |c| 1 + children.partition_point(|&x| x < c.0));
            bits.push(child as u64, width_of(children.len() as u32));
            bits.push(u64::from(self.mt.quarterings_of(*t)), own);
        }
        let torn = ConvertError::Update { update: u.0, why: "it does not fill the hole that it leaves" };
        let Canonical { link, walls, removed, .. } = canonical;
        let spheres = || Spheres::of(link.iter().map(|&v| self.mt.position(VertexId(v))));
        let faces: Vec<Face> = walls.iter().map(|(face, _)| *face).collect();
        if !are_faces_of(&faces, removed) {
            return Err(torn);
        }
        let hole = Hole { vertices: link.len() as u32, faces: &faces, removed, on_boundary };
        write_removed(&mut self.glue, bits, hole, spheres).ok_or(torn)
    }
}

/// Appends how many tetrahedra are removed, and which of their faces on the boundary are given up, if any is. None if there are too
/// many.
pub(in crate::mt) fn write_given_up(bits: &mut Bits, removed: usize, given_up: &[bool]) -> Option<()> {
    bits.push(removed as u64, COUNT_BITS);
    bits.push(u64::from(!given_up.is_empty()), 1);
    if !given_up.is_empty() {
        if given_up.len() >= 1 << COUNT_BITS {
            return None;
        }
        bits.push(given_up.len() as u64, COUNT_BITS);
        given_up.iter().for_each(|&given_up| bits.push(u64::from(given_up), 1));
    }
    Some(())
}

/// Π_u and T_u in canonical numbers.
#[derive(Clone, Copy, Debug)]
pub(in crate::mt) struct Hole<'a> {
    pub vertices: u32,
    /// The faces of Π_u, turned and in canonical order.
    pub faces: &'a [Face],
    pub removed: &'a [[u8; 4]],
    /// Whether faces on the boundary are given up.
    pub on_boundary: bool,
}

/// Appends how T_u fills Π_u, all faces of which are such of T_u.
pub(in crate::mt) fn write_removed(
    glue: &mut Glue,
    bits: &mut Bits,
    Hole { vertices, faces, removed, on_boundary }: Hole<'_>,
    spheres: impl FnOnce() -> Spheres,
) -> Option<()> {
    let corners = |tet: &[u8; 4]| tet.iter().fold(0, |set, &x| set | 1_u64 << (x % 64));
    let shared = removed.iter().fold(u64::MAX, |set, tet| set & corners(tet));
    // All of T_u meets in a vertex, and stands on the faces of Π_u without that vertex: each of these has one of it behind it.
    let in_all = (shared != 0).then(|| shared.trailing_zeros() as u8);
    let fan = in_all.filter(|x| faces.iter().filter(|face| !face.contains(x)).count() == removed.len());
    bits.push(u64::from(fan.is_some()), 1);
    if let Some(apex) = fan {
        bits.push(u64::from(apex), width_of(vertices - 1));
        // These are the tetrahedra, whatever the way.
        return Some(());
    }
    // By the face that it stands on: the vertex of the tetrahedron opposite it.
    let sides =
        |tet: &[u8; 4]| [0, 1, 2, 3].map(|i| u32::from(tet[i]) | oriented(FACES[i].map(|k| tet[k])) << 6);
    let mut behind = [u32::MAX; 4 * MAX_REMOVED];
    let behind = &mut behind[..4 * removed.len().min(MAX_REMOVED)];
    behind.iter_mut().zip(removed.iter().flat_map(sides)).for_each(|(entry, side)| *entry = side);
    behind.sort_unstable();
    let behind = |face: Face| {
        let key = oriented(face) << 6;
        let found = behind.get(behind.partition_point(|&entry| entry < key));
        found.filter(|&&entry| entry >> 6 == key >> 6).map(|&entry| (entry & 63) as u8)
    };
    let spheres = spheres();
    let (mut plain, mut places) = (Vec::with_capacity(removed.len()), Vec::with_capacity(removed.len()));
    let written = glue.build(faces, !on_boundary, |face, of_link| {
        let apex = behind(face);
        let choices = choices(vertices, on_boundary, of_link)?;
        let (close, chosen) = match apex {
            Some(x) => {
                let smaller = face.iter().filter(|&&own| own < x).count();
                (Close::With(x), u32::from(x) - smaller as u32)
            }
            None if on_boundary && !of_link => (Close::Leave, vertices - 3),
            None => return None,
        };
        plain.push((chosen, width_of(choices - 1)));
        places.push(apex.and_then(|x| spheres.place(face, x)));
        Some(close)
    });
    written?;
    write_closed(bits, &plain, &places);
    // Each tetrahedron that was built is one of T_u, and no two are the same; these must be all.
    (glue.len == removed.len()).then_some(())
}

/// A face as one number: its turned vertices, by six bits each.
fn oriented(face: [u8; 3]) -> u32 {
    let [a, b, c] = turned(face).map(u32::from);
    a << 12 | b << 6 | c
}

/// Appends how faces are closed, in that way which takes the fewest bits: the number of a vertex and its width for each, or its
/// place in the order of spheres, where all have one.
fn write_closed(bits: &mut Bits, plain: &[(u32, u32)], places: &[Option<u32>]) {
    let places: Option<Vec<u32>> = places.iter().copied().collect();
    let size = |apex_code: &ApexCode| match (apex_code, &places) {
        (ApexCode::Vertex, _) => plain.iter().map(|(_, width)| width).sum(),
        (apex_code, Some(places)) => places.iter().map(|&place| apex_code.code(place).1).sum(),
        (_, None) => u32::MAX,
    };
    let apex_code = ApexCode::ALL.into_iter().min_by_key(size).unwrap_or(ApexCode::Vertex);
    bits.push(ApexCode::ALL.iter().position(|&other| other == apex_code).unwrap_or(0) as u64, 2);
    match (apex_code, &places) {
        (ApexCode::Vertex, _) | (_, None) => {
            plain.iter().for_each(|&(chosen, width)| bits.push(u64::from(chosen), width));
        }
        (apex_code, Some(places)) => {
            for (code, width) in places.iter().map(|&place| apex_code.code(place)) {
                bits.push(code, width);
            }
        }
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
