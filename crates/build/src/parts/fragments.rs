//! What each piece of a mesh has of each part, and the parts that are made of it.

use super::PartsError;
use super::piece::Piece;
use super::prepared::{Prepared, Stored, Whole};
use crate::BuildError;
use crate::lattice::location;
use crate::lattice::quantize::Quantized;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use tetralod::geom::{Lattice, PointGrid};
use tetralod::mesh::{MAX_TETS, NONE, TetMesh};

/// What one piece has of a part. Points are places in `points` unless it says otherwise.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Fragment {
    /// Numbers of the whole, ascending.
    points: Vec<u32>,
    positions: Vec<[i32; 3]>,
    values: Vec<f64>,
    shortest: Vec<f64>,
    /// The first and the last part that has each point.
    ends: Vec<[u16; 2]>,
    moved: Vec<(u32, [f64; 3])>,
    tets: Vec<[u32; 4]>,
    /// Points, and the numbers of tetrahedra in the part.
    inside: Vec<(u32, u32)>,
    outside: Vec<u32>,
}

/// A mesh or a piece of one, and the parts of its tetrahedra.
pub(super) struct InParts<'a> {
    pub tets: &'a [[u32; 4]],
    pub quantized: &'a Quantized,
    /// Field by field.
    pub values: Vec<&'a [f64]>,
    pub part_of: &'a [u16],
    /// For each point the first and the last part that has it, and the square of the shortest edge there.
    pub ends: &'a [[u16; 2]],
    pub shortest: &'a [f64],
    /// The number of each tetrahedron in its part; nothing is there if no point was located.
    pub ranks: &'a [u32],
}

impl InParts<'_> {
    /// Passes on what each part has of it. `number` gives the number of a point in the whole.
    pub fn each(
        &self,
        number: impl Fn(u32) -> u32,
        put: &mut dyn FnMut(u16, Fragment) -> Result<(), PartsError>,
    ) -> Result<(), PartsError> {
        let &Self { tets, quantized, part_of, ends, shortest, ranks, .. } = self;
        let part = |t: u32| part_of[t as usize];
        let mut order: Vec<u32> = (0..tets.len() as u32).collect();
        order.sort_unstable_by_key(|&t| (part(t), t));
        let mut located: Vec<(u16, u32)> =
            quantized.locations.iter().map(|at| part(at.tet)).zip(0..).collect();
        located.sort_unstable();
        let mut own = vec![NONE; ends.len()];
        for group in order.chunk_by(|&a, &b| part(a) == part(b)) {
            let part = part(group[0]);
            let from = located.partition_point(|(other, _)| *other < part);
            let here: Vec<_> = located[from..]
                .iter()
                .take_while(|(other, _)| *other == part)
                .map(|(_, i)| quantized.locations[*i as usize])
                .collect();
            let mut taken: Vec<u32> = group.iter().flat_map(|t| tets[*t as usize]).collect();
            taken.extend(here.iter().map(|at| at.point));
            taken.sort_unstable_by_key(|&v| number(v));
            taken.dedup();
            (0..).zip(&taken).for_each(|(i, &v)| own[v as usize] = i);
            let of = |v: u32| own[v as usize];
            let values = taken.iter().flat_map(|&v| self.values.iter().map(move |all| all[v as usize]));
            let fragment = Fragment {
                points: taken.iter().map(|&v| number(v)).collect(),
                positions: taken.iter().map(|&v| quantized.positions[v as usize]).collect(),
                values: values.collect(),
                shortest: taken.iter().map(|&v| shortest[v as usize]).collect(),
                ends: taken.iter().map(|&v| ends[v as usize]).collect(),
                moved: taken
                    .iter()
                    .filter(|&&v| quantized.is_moved(v))
                    .map(|&v| (of(v), quantized.places.at(v).to_array()))
                    .collect(),
                tets: group.iter().map(|t| tets[*t as usize].map(of)).collect(),
                inside: here.iter().map(|at| (of(at.point), ranks[at.tet as usize])).collect(),
                outside: here.iter().filter(|at| at.outside).map(|at| of(at.point)).collect(),
            };
            put(part, fragment)?;
        }
        Ok(())
    }
}

/// The number of each tetrahedron in its part, of which there are so many already.
pub(super) fn ranks(part_of: &[u16], counts: &mut [u32]) -> Vec<u32> {
    let rank = |&part: &u16| {
        counts[usize::from(part)] += 1;
        counts[usize::from(part)] - 1
    };
    part_of.iter().map(rank).collect()
}

/// A piece, and the parts of its tetrahedra.
pub(super) struct PieceParts {
    pub prepared: Prepared,
    pub part_of: Vec<u16>,
    /// For each point the first and the last part that has it, and the square of the shortest edge there.
    pub ends: Vec<[u16; 2]>,
    pub shortest: Vec<f64>,
}

impl PieceParts {
    pub fn of(whole: &Whole, stored: Stored) -> Result<Self, PartsError> {
        let part_of = whole.parts_of(&stored.positions, &stored.tets);
        let ends = ends(stored.points.len(), &stored.tets, &part_of);
        let prepared = Prepared::of(whole, stored)?;
        let shortest = prepared.quantized.shortest_edges(&prepared.mesh.tets);
        Ok(Self { prepared, part_of, ends, shortest })
    }
}

/// For each point the first and the last part of the tetrahedra there.
pub(super) fn ends(points: usize, tets: &[[u32; 4]], part_of: &[u16]) -> Vec<[u16; 2]> {
    let mut ends = vec![[u16::MAX, 0]; points];
    for (tet, &part) in tets.iter().zip(part_of) {
        for &v in tet {
            let [first, last] = &mut ends[v as usize];
            (*first, *last) = ((*first).min(part), (*last).max(part));
        }
    }
    ends
}

/// The tetrahedra of all pieces near points that may lie in a tetrahedron of another piece.
pub(super) struct Band {
    /// Their numbers in the whole, ascending.
    sought: Vec<u32>,
    near: PointGrid,
    /// By numbers of its own.
    pub mesh: TetMesh,
    /// With the locations of these points.
    pub quantized: Option<Quantized>,
    /// The number in the whole of each of its points, and the place of each number.
    points: Vec<u32>,
    places: HashMap<u32, u32>,
    values: Vec<Vec<f64>>,
    /// The number in the whole of each tetrahedron, and, once pieces have been sorted in, its part and its number there.
    tets: Vec<u64>,
    ranks: Vec<(u16, u32)>,
}

impl Band {
    /// Around points of these numbers, which ascend, at these positions on the lattice.
    pub fn new(sought: Vec<(u32, [i32; 3])>) -> Self {
        Self {
            near: PointGrid::new(sought.iter().map(|(_, position)| *position).collect()),
            sought: sought.into_iter().map(|(number, _)| number).collect(),
            mesh: TetMesh::default(),
            quantized: None,
            points: Vec::new(),
            places: HashMap::new(),
            values: Vec::new(),
            tets: Vec::new(),
            ranks: Vec::new(),
        }
    }

    /// Whether no points are sought.
    pub fn is_empty(&self) -> bool {
        self.sought.is_empty()
    }

    /// Takes from a piece, whose first tetrahedron has the number `first`, what a search for these points may look at: tetrahedra whose
    /// bounding boxes touch the way from the point to where the lattice has put it.
    pub fn add(&mut self, stored: &Stored, lattice: &Lattice, first: u64) {
        self.values.resize(stored.values.len(), Vec::new());
        for (t, tet) in (first..).zip(&stored.tets) {
            let mut is_near = false;
            let corners = tet.map(|v| lattice.nearest(stored.positions[v as usize]));
            self.near.near_tet(&corners, |_| is_near = true);
            if is_near {
                let own = tet.map(|v| self.point(stored, v as usize));
                self.mesh.tets.push(own);
                self.tets.push(t);
            }
        }
    }

    fn point(&mut self, stored: &Stored, v: usize) -> u32 {
        let number = stored.points[v];
        if let Some(&place) = self.places.get(&number) {
            return place;
        }
        let place = self.points.len() as u32;
        self.places.insert(number, place);
        self.points.push(number);
        self.mesh.positions.push(stored.positions[v]);
        self.values.iter_mut().zip(&stored.values).for_each(|(all, own)| all.push(own[v]));
        place
    }

    /// Locates the points, once all pieces have been taken.
    pub fn locate(&mut self, whole: &Whole) -> Result<(), PartsError> {
        if self.is_empty() {
            return Ok(());
        }
        self.mesh.fields = whole.fields_of(std::mem::take(&mut self.values));
        let mut quantized = whole.quantized(&self.mesh);
        let points = self.sought.iter().map(|number| self.places[number]);
        let located =
            location::locations_of(&self.mesh.tets, &quantized.positions, &quantized.places, points);
        quantized.locations = located.map_err(BuildError::from)?;
        self.quantized = Some(quantized);
        self.ranks = vec![(0, 0); self.tets.len()];
        Ok(())
    }

    /// Notes the parts of the tetrahedra of a piece, and their numbers there.
    fn note(&mut self, first: u64, part_of: &[u16], ranks: &[u32]) {
        let from = self.tets.partition_point(|&t| t < first);
        for (&t, noted) in self.tets[from..].iter().zip(&mut self.ranks[from..]) {
            let Some(&part) = part_of.get((t - first) as usize) else { return };
            *noted = (part, ranks[(t - first) as usize]);
        }
    }
}

/// What keeps a fragment under a name.
type Keep<'a> = &'a mut dyn FnMut(&str, &Fragment) -> Result<(), PartsError>;

/// The fragments of all parts.
pub(super) struct Fragments {
    fields: usize,
    /// The pieces that have something of each part.
    pieces: Vec<Vec<u32>>,
    /// How many tetrahedra each part has so far, and all together.
    counts: Vec<u32>,
    all: u64,
    /// The faces between parts, those of each part in a row: see `partition::between`.
    pub interface: Vec<(u16, [u32; 3], u16)>,
    of_band: BTreeMap<u16, Fragment>,
}

impl Fragments {
    pub fn new(parts: u32, fields: usize) -> Self {
        let parts = parts as usize;
        Self {
            fields,
            pieces: vec![Vec::new(); parts],
            counts: vec![0; parts],
            all: 0,
            interface: Vec::new(),
            of_band: BTreeMap::new(),
        }
    }

    /// The names of what is kept of a part.
    pub fn names(&self, part: u32) -> Vec<String> {
        self.pieces[part as usize].iter().map(|piece| format!("part-{part}-{piece}")).collect()
    }

    /// Sorts the next piece into the parts.
    pub fn sort_in(
        &mut self,
        index: u32,
        piece: &PieceParts,
        band: &mut Band,
        keep: Keep<'_>,
    ) -> Result<(), PartsError> {
        let PieceParts { prepared: Prepared { points, mesh, quantized, .. }, part_of, ends, shortest } =
            piece;
        let ranks = &ranks(part_of, &mut self.counts);
        if self.counts.iter().any(|&count| count as usize > MAX_TETS) {
            return Err(BuildError::TooLarge.into());
        }
        band.note(self.all, part_of, ranks);
        self.all += part_of.len() as u64;
        let values = mesh.fields.iter().map(|field| &field.values[..]).collect();
        let parted = InParts { tets: &mesh.tets, quantized, values, part_of, ends, shortest, ranks };
        parted.each(|v| points[v as usize], &mut |part, fragment| {
            self.pieces[usize::from(part)].push(index);
            keep(&format!("part-{part}-{index}"), &fragment)
        })
    }

    /// Adds the points that were located across pieces, once all pieces have been sorted in.
    pub fn add_band(&mut self, whole: &Whole, band: &Band) {
        let Some(quantized) = &band.quantized else { return };
        let part_of = whole.parts_of(&band.mesh.positions, &band.mesh.tets);
        // All tetrahedra around these points are here.
        let ends = ends(band.points.len(), &band.mesh.tets, &part_of);
        let shortest = quantized.shortest_edges(&band.mesh.tets);
        for at in &quantized.locations {
            let (part, rank) = band.ranks[at.tet as usize];
            let fragment = self.of_band.entry(part).or_default();
            let (v, own) = (at.point as usize, fragment.points.len() as u32);
            fragment.points.push(band.points[v]);
            fragment.positions.push(quantized.positions[v]);
            fragment.values.extend(band.mesh.fields.iter().map(|field| field.values[v]));
            fragment.shortest.push(shortest[v]);
            fragment.ends.push(ends[v]);
            fragment.moved.push((own, quantized.places.at(at.point).to_array()));
            fragment.inside.push((own, rank));
            if at.outside {
                fragment.outside.push(own);
            }
        }
    }

    /// A part; `read` reads what was kept.
    pub fn piece(
        &self,
        part: u32,
        read: impl Fn(&str) -> Result<Fragment, PartsError>,
    ) -> Result<Piece, PartsError> {
        let kept = self.names(part).iter().map(|name| read(name)).collect::<Result<Vec<_>, _>>()?;
        let of_band = self.of_band.get(&(part as u16));
        Ok(joined(part, self.fields, kept.iter().chain(of_band), &self.interface))
    }
}

/// A part of what pieces have of it; `interface` has the faces of all parts.
pub(super) fn joined<'f>(
    part: u32,
    fields: usize,
    fragments: impl Iterator<Item = &'f Fragment> + Clone,
    interface: &[(u16, [u32; 3], u16)],
) -> Piece {
    let mut piece = Piece::over(fragments.clone().map(|fragment| &fragment.points), fields);
    let mut ends = vec![[0; 2]; piece.points.len()];
    for fragment in fragments {
        let Fragment { points, positions, values, shortest, .. } = fragment;
        let number = piece.places(points);
        piece.put(&number, positions, values, shortest);
        number.iter().zip(&fragment.ends).for_each(|(&v, own)| ends[v as usize] = *own);
        let of = |v: u32| number[v as usize];
        let carried = &mut piece.carried;
        carried.moved.extend(fragment.moved.iter().map(|&(v, place)| (of(v), place)));
        piece.tets.extend(fragment.tets.iter().map(|tet| tet.map(of)));
        carried.inside.extend(fragment.inside.iter().map(|&(v, t)| (of(v), t)));
        carried.outside.extend(fragment.outside.iter().map(|&v| of(v)));
    }
    let carried = &mut piece.carried;
    carried.moved.sort_unstable_by_key(|(v, _)| *v);
    carried.moved.dedup_by_key(|(v, _)| *v);
    carried.inside.sort_unstable();
    carried.outside.sort_unstable();
    let is_elsewhere = |[first, last]: [u16; 2]| first != last || u32::from(first) != part;
    let shared = (0..).zip(&ends).filter(|(_, ends)| is_elsewhere(**ends));
    carried.shared = shared.map(|(v, [first, last])| (v, u32::from(*first), u32::from(*last))).collect();
    let from = interface.partition_point(|(other, ..)| u32::from(*other) < part);
    let faces = interface[from..].iter().take_while(|(other, ..)| u32::from(*other) == part);
    let number = |v: u32| piece.points.partition_point(|&other| other < v) as u32;
    carried.interface = faces.map(|&(_, face, other)| (face.map(number), u32::from(other))).collect();
    piece
}
