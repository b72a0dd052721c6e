//! The parts of a mesh: halves of halves, each cut across its longest side into two of about as many tetrahedra.
//!
//! A tetrahedron is where its lowest corner is along the axis of a cut: the six of a grid's cube stay together, so cuts of grids are flat.

use super::PartsError;
use super::cut::{Places, shift};
use super::fragments::{InParts, ends, joined, ranks};
use super::grid::GridCut;
use super::piece::{Part, Piece, Sided};
use super::plan::{Plan, PlanRegions, purpose};
use crate::lattice::field_selection;
use crate::lattice::quantize::{self, Quantized};
use crate::lattice::sides;
use crate::restrict::restrictions::Restrictions;
use crate::{BuildConfig, BuildCriterion, BuildError};
use std::collections::BTreeMap;
use tetralod::geom::Bounds;
use tetralod::mesh::{FACES, Field, MAX_TETS, TetMesh};
use tetralod::mt::MAX_UPDATES;

/// Parts `mesh`, which must be valid, or a grid alone ([`TetMesh::of_grid_alone`]), of which no more than the values and a part are in
/// memory at a time, and passes on each part, in the order of their numbers. `metadata` is kept in the plan.
///
/// # Errors
/// If `config` is not of half-edge MTs, there is no such number of parts or the mesh too small for it, or as
/// [`build`](crate::build); the first error of `put`.
pub fn part(
    mesh: &TetMesh,
    config: &BuildConfig,
    parts: u32,
    metadata: BTreeMap<String, String>,
    put: &mut dyn FnMut(Part<'static>) -> Result<(), PartsError>,
) -> Result<Plan, PartsError> {
    let purpose = purpose(config, parts)?;
    if mesh.positions.len() > MAX_UPDATES as usize {
        return Err(BuildError::TooLarge.into());
    }
    // How far interfaces have moved already does not travel with the parts.
    if config.preserve_within > 0.0 && !config.preserve.is_empty() {
        let which =
            ["a tolerance for interfaces (preserve_within)".to_owned(), "building in parts".to_owned()];
        let instead =
            "parts keep interfaces as they are: leave the tolerance out, or build the mesh as a whole";
        return Err(BuildError::Combination { which, instead }.into());
    }
    if mesh.is_grid_alone() {
        // Regions need the labels of cells.
        let alone = if config.preserve.is_empty() { GridCut::new(mesh, None, config, parts)? } else { None };
        if let Some(cut) = alone {
            return cut.part(config, purpose, metadata, put);
        }
        if mesh.counts()[1] > MAX_TETS as u64 {
            return Err(BuildError::TooLarge.into());
        }
        let mut whole = mesh.clone();
        whole.expand_grid();
        return part(&whole, config, parts, metadata, put);
    }
    tetralod::mesh::check_arrays(mesh).map_err(BuildError::from)?;
    let quantized = quantize::quantize_cells(mesh, config)?;
    let restrictions = Restrictions::of(config, mesh, &quantized, BuildCriterion::HalfEdge)?;
    let displacement_per_error = config.displacement * Bounds::of(&mesh.positions).diagonal();
    let info = quantized.info(mesh.tets.len() as u64, displacement_per_error);
    let whole = (parts, checksum(mesh), domain(&quantized.positions));
    let regions = restrictions.region_table().map(PlanRegions::new);
    let plan = Plan::new(&info, config, purpose, whole, (regions, &quantized.sides.jumps), metadata);
    let part_of = parts_of(&mesh.tets, &quantized, parts)?;
    let ends = ends(mesh.positions.len(), &mesh.tets, &part_of);
    if let Some(point) = ends.iter().position(|[first, last]| first > last) {
        return Err(PartsError::UnusedPoint { point: point as u32 });
    }
    let chosen = field_selection::fields(mesh, config)?;
    let interface = interface(&mesh.tets, &part_of, &ends)?;
    let is_located = !quantized.locations.is_empty();
    let cut = InParts {
        tets: &mesh.tets,
        quantized: &quantized,
        values: chosen.iter().map(|field| &field.values[..]).collect(),
        part_of: &part_of,
        ends: &ends,
        shortest: &quantized.shortest_edges(&mesh.tets),
        ranks: &if is_located { ranks(&part_of, &mut vec![0; parts as usize]) } else { Vec::new() },
    };
    cut.each(|v| v, &mut |part, fragment| {
        let index = u32::from(part);
        let mut piece = joined(index, chosen.len(), std::iter::once(&fragment), &interface);
        let regions = part_of.iter().zip(restrictions.regions()).filter(|(of, _)| **of == part);
        let regions = regions.map(|(_, &region)| region).collect();
        let kept = (0..).zip(&piece.points).filter(|(_, v)| restrictions.keeps(**v));
        piece.carried.kept = kept.map(|(i, _)| i).collect();
        let of_sides = Sided::of(&piece.points, &quantized.sides, |point| {
            chosen.iter().map(move |field| sides::value(mesh, field, point as usize))
        });
        put(Part::of(&plan, index, Piece { regions, sided: of_sides, ..piece }))
    })?;
    Ok(plan)
}

/// The sides of the box around some positions.
fn domain(positions: &[[i32; 3]]) -> [i32; 3] {
    let ends = |k: usize| positions.iter().map(move |p| p[k]);
    [0, 1, 2].map(|k| ends(k).max().unwrap_or(0) - ends(k).min().unwrap_or(0))
}

/// Of what the parts depend on.
fn checksum(mesh: &TetMesh) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    mesh.positions.iter().flatten().for_each(|x| hasher.update(&x.to_le_bytes()));
    mesh.tets.iter().flatten().for_each(|v| hasher.update(&v.to_le_bytes()));
    mesh.fields.iter().flat_map(Field::all_values).for_each(|x| hasher.update(&x.to_le_bytes()));
    hasher.finalize()
}

/// The part of each tetrahedron.
fn parts_of(tets: &[[u32; 4]], quantized: &Quantized, parts: u32) -> Result<Vec<u16>, PartsError> {
    let positions = &quantized.positions;
    let step = quantized.lattice.step;
    let shift = shift(quantized.lattice.bits);
    let place = |tet: &[u32; 4], axis: usize| {
        let least = tet.iter().map(|&v| positions[v as usize][axis]).min();
        (least.unwrap_or(0) >> shift) as usize
    };
    let mut part_of = vec![0_u16; tets.len()];
    for level in 0..parts.ilog2() {
        let mut places = Places::of(1 << level);
        for (tet, &part) in tets.iter().zip(&part_of) {
            places.add(part, [0, 1, 2].map(|axis| place(tet, axis)));
        }
        let cuts = places.cuts(step).ok_or(PartsError::TooMany { parts, tetrahedra: tets.len() as u64 })?;
        for (tet, part) in tets.iter().zip(&mut part_of) {
            let (axis, first) = cuts[*part as usize];
            *part = 2 * *part + u16::from(place(tet, axis) >= first);
        }
    }
    Ok(part_of)
}

/// The faces between parts: the part, the corners in ascending order, and the other part; those of each part in a row.
fn interface(
    tets: &[[u32; 4]],
    part_of: &[u16],
    shared: &[[u16; 2]],
) -> Result<Vec<(u16, [u32; 3], u16)>, PartsError> {
    let is_shared = |t: usize, k: usize| {
        let [first, last] = shared[tets[t][k] as usize];
        first != last
    };
    let mut faces = Vec::new();
    shared_faces(tets, part_of, is_shared, &mut faces);
    between(faces)
}

/// Appends the faces whose corners are all shared by parts, and the part of each; `is_shared` is of a tetrahedron and its corner.
pub(super) fn shared_faces(
    tets: &[[u32; 4]],
    part_of: &[u16],
    is_shared: impl Fn(usize, usize) -> bool,
    faces: &mut Vec<([u32; 3], u16)>,
) {
    for (t, (tet, &part)) in tets.iter().zip(part_of).enumerate() {
        if (0..4).filter(|&k| is_shared(t, k)).count() < 3 {
            continue;
        }
        for corners in FACES.into_iter().filter(|face| face.iter().all(|&k| is_shared(t, k))) {
            let mut face = corners.map(|k| tet[k]);
            face.sort_unstable();
            faces.push((face, part));
        }
    }
}

/// Of these faces those between parts: see [`interface`].
pub(super) fn between(mut faces: Vec<([u32; 3], u16)>) -> Result<Vec<(u16, [u32; 3], u16)>, PartsError> {
    faces.sort_unstable();
    let mut between = Vec::new();
    for group in faces.chunk_by(|a, b| a.0 == b.0) {
        match group {
            [(face, a), (_, b)] if a != b => between.extend([(*a, *face, *b), (*b, *face, *a)]),
            [_] | [_, _] => {}
            [(face, _), ..] => {
                let error = tetralod::mesh::MeshError::CrowdedFace { face: *face, tets: Vec::new() };
                return Err(BuildError::from(error).into());
            }
            [] => {}
        }
    }
    between.sort_unstable();
    Ok(between)
}
