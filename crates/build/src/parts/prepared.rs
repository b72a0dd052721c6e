//! A piece of a mesh on the lattices of the whole.

use super::PartsError;
use super::cut::shift;
use crate::BuildError;
use crate::lattice::location::{self, Location};
use crate::lattice::position_lattice::Placed;
use crate::lattice::quantize::{self, Quantized};
use crate::lattice::sides::Sides;
use serde::{Deserialize, Serialize};
use tetralod::geom::Lattice;
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::FieldInfo;

/// A piece as it lies in the scratch.
#[derive(Serialize, Deserialize)]
pub(super) struct Stored {
    pub points: Vec<u32>,
    pub positions: Vec<[f64; 3]>,
    /// Field by field.
    pub values: Vec<Vec<f64>>,
    pub tets: Vec<[u32; 4]>,
}

impl Stored {
    /// What is kept of a piece: points that none of its tetrahedra uses tell nothing of it.
    pub fn of(mut points: Vec<u32>, mesh: TetMesh) -> Self {
        let TetMesh { mut positions, fields, mut tets, .. } = mesh;
        let mut values: Vec<Vec<f64>> = fields.into_iter().map(|field| field.values).collect();
        let mut used = vec![false; points.len()];
        tets.iter().flatten().for_each(|&v| used[v as usize] = true);
        if used.contains(&false) {
            let mut next = 0;
            let place = |&used: &bool| {
                next += u32::from(used);
                next.wrapping_sub(1)
            };
            let places: Vec<u32> = used.iter().map(place).collect();
            tets.iter_mut().for_each(|tet| *tet = tet.map(|v| places[v as usize]));
            keep(&mut points, &used);
            keep(&mut positions, &used);
            values.iter_mut().for_each(|values| keep(values, &used));
        }
        Self { points, positions, values, tets }
    }
}

/// Leaves the items at these places.
fn keep<T>(items: &mut Vec<T>, places: &[bool]) {
    let mut places = places.iter();
    items.retain(|_| places.next() == Some(&true));
}

/// What is the same for all pieces, once the lattices are known.
pub(super) struct Whole {
    pub lattice: Lattice,
    /// Numbers of the chosen fields.
    pub chosen: Vec<usize>,
    pub fields: Vec<FieldInfo>,
    /// Points that are in several pieces, ascending.
    pub shared: Vec<u32>,
    /// Level by level and half by half the axis of a cut and the first place behind it.
    pub cuts: Vec<Vec<(usize, usize)>>,
}

/// The least place of each tetrahedron along each axis, as far as it decides on cuts.
pub(super) fn places(
    positions: &[[f64; 3]],
    tets: &[[u32; 4]],
    lattice: &Lattice,
    shift: u32,
) -> Vec<[u16; 3]> {
    let placed: Vec<[i32; 3]> = positions.iter().map(|&p| lattice.nearest(p)).collect();
    let least = |tet: &[u32; 4], axis: usize| {
        let least = tet.iter().map(|&v| placed[v as usize][axis]).min();
        (least.unwrap_or(0) >> shift) as u16
    };
    tets.iter().map(|tet| [0, 1, 2].map(|axis| least(tet, axis))).collect()
}

impl Whole {
    /// The part of a tetrahedron at a place.
    pub fn part_of(&self, place: [u16; 3]) -> u16 {
        self.cuts.iter().fold(0, |part, cuts| {
            let (axis, first) = cuts[usize::from(part)];
            2 * part + u16::from(usize::from(place[axis]) >= first)
        })
    }

    /// The parts of tetrahedra.
    pub fn parts_of(&self, positions: &[[f64; 3]], tets: &[[u32; 4]]) -> Vec<u16> {
        let places = places(positions, tets, &self.lattice, shift(self.lattice.bits));
        places.into_iter().map(|place| self.part_of(place)).collect()
    }

    pub fn are_shared(&self, points: &[u32]) -> Vec<bool> {
        points.iter().map(|number| self.shared.binary_search(number).is_ok()).collect()
    }

    /// A mesh of some of the whole, with the chosen fields, on the lattices; without locations.
    pub fn quantized(&self, mesh: &TetMesh) -> Quantized {
        let positions = mesh.positions.iter().map(|&p| self.lattice.nearest(p)).collect();
        let placed = Placed { lattice: self.lattice, positions };
        let chosen: Vec<&Field> = mesh.fields.iter().collect();
        quantize::on_lattices(mesh, placed, &chosen, self.fields.clone(), Sides::default())
    }

    /// The chosen fields.
    pub fn fields_of(&self, mut values: Vec<Vec<f64>>) -> Vec<Field> {
        let taken = self.chosen.iter().map(|&number| std::mem::take(&mut values[number]));
        self.fields.iter().zip(taken).map(|(info, values)| Field::new(info.name.clone(), values)).collect()
    }
}

/// A piece on the lattices.
pub(super) struct Prepared {
    pub points: Vec<u32>,
    pub mesh: TetMesh,
    /// With the locations that the piece alone tells.
    pub quantized: Quantized,
    /// Points that may lie in a tetrahedron of another piece.
    pub beyond: Vec<u32>,
}

impl Prepared {
    pub fn of(whole: &Whole, stored: Stored) -> Result<Self, PartsError> {
        let Stored { points, positions, values, tets } = stored;
        let mesh = TetMesh { positions, fields: whole.fields_of(values), tets, ..TetMesh::default() };
        let mut quantized = whole.quantized(&mesh);
        let is_shared = whole.are_shared(&points);
        let (locations, beyond): (Vec<Location>, Vec<u32>) =
            location::locations_in_piece(&mesh.tets, &quantized.positions, &quantized.places, &is_shared)
                .map_err(BuildError::from)?;
        quantized.locations = locations;
        Ok(Self { points, mesh, quantized, beyond })
    }
}
