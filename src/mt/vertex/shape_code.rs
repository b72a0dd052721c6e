//! How a node stores what its insertion removes: the bits behind its links.

use super::bit_string::{Bits, width_of};
use super::cavity_fill::{CavityFill, Close, Face, turned};
use super::limits::{COUNT_BITS, MAX_REMOVED};
use super::sphere_order::{ApexCode, Spheres};
use crate::mesh::FACES;

/// Reads how the faces inside Π_u are closed.
pub(in crate::mt) struct Code {
    at: u64,
    /// Vertices of Π_u.
    vertices: u32,
    boundary: bool,
    apex_code: ApexCode,
    /// Where the codes of places in their order are.
    spheres: Option<Spheres>,
}

impl Code {
    pub fn new(at: u64, vertices: u32, boundary: bool) -> Self {
        Self { at, vertices, boundary, apex_code: ApexCode::Vertex, spheres: None }
    }

    pub fn read(&mut self, nodes: &Bits, width: u32) -> u32 {
        let value = nodes.get(self.at, width) as u32;
        self.at += u64::from(width);
        value
    }

    /// The vertex that all of T_u has, if the code says that there is one.
    #[inline]
    pub fn apex_of_all(&mut self, nodes: &Bits) -> Option<u8> {
        let fan = self.read(nodes, 1) == 1;
        fan.then(|| self.read(nodes, width_of(self.vertices.saturating_sub(1))) as u8)
    }

    /// Reads how the apexes of faces are coded; `spheres` are made only if that takes them.
    #[inline]
    pub fn read_apex_code(&mut self, nodes: &Bits, spheres: impl FnOnce() -> Spheres) {
        self.apex_code = ApexCode::ALL[self.read(nodes, 2) as usize % ApexCode::ALL.len()];
        self.spheres = (self.apex_code != ApexCode::Vertex).then(spheres);
    }

    /// How to close a face. Its own vertices are left out of the count; at the boundary of the domain, one more choice
    /// for a face inside Π_u is that nothing lies behind it.
    #[inline]
    pub fn close(&mut self, nodes: &Bits, face: Face, of_link: bool) -> Option<Close> {
        if let Some(spheres) = &self.spheres {
            let at = &mut self.at;
            let place = self.apex_code.read(&mut || {
                *at += 1;
                nodes.get(*at - 1, 1) == 1
            });
            return spheres.vertex(face, place).map(Close::With);
        }
        let choices = choices(self.vertices, self.boundary, of_link)?;
        let chosen = self.read(nodes, width_of(choices - 1));
        if chosen + 3 == self.vertices && self.boundary && !of_link {
            return Some(Close::Leave);
        }
        // The least vertex comes first.
        let [a, b, c] = face;
        let mut x = chosen as u8;
        [a, b.min(c), b.max(c)].iter().for_each(|&own| x += u8::from(x >= own));
        (u32::from(x) < self.vertices).then_some(Close::With(x))
    }
}

/// How many ways there are to close a face.
#[inline]
fn choices(vertices: u32, boundary: bool, of_link: bool) -> Option<u32> {
    let choices = vertices.checked_sub(3)? + u32::from(boundary && !of_link);
    (choices > 0).then_some(choices)
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
    fill: &mut CavityFill,
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
    let written = fill.build(faces, !on_boundary, |face, of_link| {
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
    (fill.len == removed.len()).then_some(())
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
