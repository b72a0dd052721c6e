//! The parts of a mesh: halves of halves, each cut across its longest side into two of about as many tetrahedra.
//!
//! A tetrahedron is where its lowest corner is along the axis of a cut: the six of a grid's cube stay together, so cuts of grids are flat.

use super::PartsError;
use super::cut::{CUT_BITS, best_cut, shift};
use super::grid::GridCut;
use super::piece::{Head, Made, Part, Piece};
use super::plan::{MOST_PARTS, Node, Plan};
use crate::lattice::field_selection;
use crate::lattice::quantize::{self, Quantized};
use crate::restrict::restrictions::Restrictions;
use crate::{BuildConfig, BuildCriterion, BuildError, Construction};
use std::collections::BTreeMap;
use tetralod::geom::Bounds;
use tetralod::mesh::{FACES, NONE, TetMesh};
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
    put: &mut dyn FnMut(Part) -> Result<(), PartsError>,
) -> Result<Plan, PartsError> {
    let Construction::HalfEdge { purpose } = config.construction else { return Err(PartsError::Kind) };
    if !parts.is_power_of_two() || parts > MOST_PARTS {
        return Err(PartsError::Count { parts });
    }
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
        let alone = if config.preserve.is_empty() { GridCut::new(mesh, config, parts)? } else { None };
        if let Some(cut) = alone {
            return cut.part(config, purpose, metadata, put);
        }
        let mut whole = mesh.clone();
        whole.expand_grid();
        return part(&whole, config, parts, metadata, put);
    }
    tetralod::mesh::check_arrays(mesh).map_err(BuildError::from)?;
    let quantized = quantize::quantize_cells(mesh, config)?;
    let restrictions = Restrictions::of(config, mesh, &quantized, BuildCriterion::HalfEdge)?;
    let displacement_per_error = config.displacement * Bounds::of(&mesh.positions).diagonal();
    let info = quantized.info(mesh.tets.len(), displacement_per_error);
    let whole = (parts, checksum(mesh), sides(&quantized.positions));
    let plan = Plan::new(&info, config, purpose, whole, metadata);
    let part_of = parts_of(&mesh.tets, &quantized, parts)?;
    let cut = Cut::new(mesh, config, &quantized, &part_of)?;
    let cut = Cut { restrictions, ..cut };
    let mut local = vec![NONE; mesh.positions.len()];
    for index in 0..parts {
        let head = Head { plan: plan.clone(), node: Node { level: 0, index }, built: false };
        put(Part { head, piece: cut.piece(index, &mut local) })?;
    }
    Ok(plan)
}

/// The sides of the box around some positions.
fn sides(positions: &[[i32; 3]]) -> [i32; 3] {
    let ends = |k: usize| positions.iter().map(move |p| p[k]);
    [0, 1, 2].map(|k| ends(k).max().unwrap_or(0) - ends(k).min().unwrap_or(0))
}

/// Of what the parts depend on.
fn checksum(mesh: &TetMesh) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    mesh.positions.iter().flatten().for_each(|x| hasher.update(&x.to_le_bytes()));
    mesh.tets.iter().flatten().for_each(|v| hasher.update(&v.to_le_bytes()));
    mesh.fields.iter().flat_map(|field| &field.values).for_each(|x| hasher.update(&x.to_le_bytes()));
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
        let now = 1_usize << level;
        let mut spans = vec![[[usize::MAX, 0]; 3]; now];
        let mut counts = vec![[const { Vec::new() }; 3]; now];
        counts.iter_mut().flatten().for_each(|all| *all = vec![0_u32; 1 << CUT_BITS]);
        for (tet, &part) in tets.iter().zip(&part_of) {
            for axis in 0..3 {
                let x = place(tet, axis);
                let [low, high] = &mut spans[part as usize][axis];
                (*low, *high) = ((*low).min(x), (*high).max(x));
                counts[part as usize][axis][x] += 1;
            }
        }
        let cuts: Option<Vec<(usize, usize)>> =
            spans.iter().zip(&counts).map(|(spans, counts)| best_cut(spans, counts, step)).collect();
        let cuts = cuts.ok_or(PartsError::TooMany { parts, tetrahedra: tets.len() as u64 })?;
        for (tet, part) in tets.iter().zip(&mut part_of) {
            let (axis, first) = cuts[*part as usize];
            *part = 2 * *part + u16::from(place(tet, axis) >= first);
        }
    }
    Ok(part_of)
}

/// A mesh with its parts.
struct Cut<'a> {
    mesh: &'a TetMesh,
    quantized: &'a Quantized,
    part_of: &'a [u16],
    values: Vec<&'a [f64]>,
    shortest: Vec<f64>,
    /// The first and the last part that has each point.
    shared: Vec<[u16; 2]>,
    /// The faces between parts, those of each part in a row.
    interface: Vec<(u16, [u32; 3], u16)>,
    /// The number of each tetrahedron in its part, if that is needed.
    ranks: Vec<u32>,
    restrictions: Restrictions,
}

impl<'a> Cut<'a> {
    fn new(
        mesh: &'a TetMesh,
        config: &BuildConfig,
        quantized: &'a Quantized,
        part_of: &'a [u16],
    ) -> Result<Self, PartsError> {
        let mut shared = vec![[u16::MAX, 0]; mesh.positions.len()];
        for (tet, &part) in mesh.tets.iter().zip(part_of) {
            for &v in tet {
                let [first, last] = &mut shared[v as usize];
                (*first, *last) = ((*first).min(part), (*last).max(part));
            }
        }
        if let Some(point) = shared.iter().position(|[first, last]| first > last) {
            return Err(PartsError::UnusedPoint { point: point as u32 });
        }
        let chosen = field_selection::fields(mesh, config)?;
        let interface = interface(&mesh.tets, part_of, &shared)?;
        let values = chosen.into_iter().map(|field| &field.values[..]).collect();
        let shortest = quantized.shortest_edges(&mesh.tets);
        let is_needed = !quantized.locations.is_empty();
        let ranks = if is_needed { ranks(part_of) } else { Vec::new() };
        let restrictions = Restrictions::default();
        Ok(Self { mesh, quantized, part_of, values, shortest, shared, interface, ranks, restrictions })
    }

    /// A part. `local` has [`NONE`] for each point, before and after.
    fn piece(&self, index: u32, local: &mut [u32]) -> Piece {
        let own = |part: u16| u32::from(part) == index;
        let quantized = self.quantized;
        let tets = || self.mesh.tets.iter().zip(self.part_of).filter(|(_, part)| own(**part));
        let here = |tet: u32| own(self.part_of[tet as usize]);
        let mut points: Vec<u32> = Vec::new();
        let located = quantized.locations.iter().filter(|at| here(at.tet)).map(|at| at.point);
        for v in tets().flat_map(|(tet, _)| *tet).chain(located) {
            if local[v as usize] == NONE {
                local[v as usize] = 0;
                points.push(v);
            }
        }
        points.sort_unstable();
        (0..).zip(&points).for_each(|(i, &v)| local[v as usize] = i);
        let number = |v: u32| local[v as usize];
        let first = self.interface.partition_point(|(part, ..)| u32::from(*part) < index);
        let faces = self.interface[first..].iter().take_while(|(part, ..)| own(*part));
        let here_located = || quantized.locations.iter().filter(|at| here(at.tet));
        let piece = Piece {
            positions: points.iter().map(|&v| quantized.positions[v as usize]).collect(),
            values: points.iter().flat_map(|&v| self.values.iter().map(move |all| all[v as usize])).collect(),
            shortest: points.iter().map(|&v| self.shortest[v as usize]).collect(),
            moved: points
                .iter()
                .filter(|&&v| quantized.is_moved(v))
                .map(|&v| (number(v), quantized.places.at(v).to_array()))
                .collect(),
            shared: points
                .iter()
                .filter_map(|&v| {
                    let [first, last] = self.shared[v as usize];
                    (first != last || !own(first)).then(|| (number(v), u32::from(first), u32::from(last)))
                })
                .collect(),
            tets: tets().map(|(tet, _)| tet.map(number)).collect(),
            interface: faces.map(|&(_, face, other)| (face.map(number), u32::from(other))).collect(),
            inside: here_located().map(|at| (number(at.point), self.ranks[at.tet as usize])).collect(),
            outside: here_located().filter(|at| at.outside).map(|at| number(at.point)).collect(),
            regions: (0..)
                .zip(self.restrictions.regions())
                .filter(|(tet, _)| here(*tet))
                .map(|(_, &region)| region)
                .collect(),
            kept: points.iter().filter(|&&v| self.restrictions.keeps(v)).map(|&v| number(v)).collect(),
            earlier: Vec::<Made>::new(),
            ..Piece::default()
        };
        points.iter().for_each(|&v| local[v as usize] = NONE);
        Piece { points, ..piece }
    }
}

/// The number of each tetrahedron in its part.
fn ranks(part_of: &[u16]) -> Vec<u32> {
    let mut next = vec![0; usize::from(part_of.iter().copied().max().unwrap_or(0)) + 1];
    let mut rank = |&part: &u16| {
        next[usize::from(part)] += 1;
        next[usize::from(part)] - 1
    };
    part_of.iter().map(&mut rank).collect()
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
