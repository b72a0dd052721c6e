//! The parts of a regular grid, made one at a time: nothing but the values of the whole is in memory, or of [`GridValues`] those of a part.
//!
//! The parts are those that [`part`](super::part) makes of the grid's points and tetrahedra, byte for byte.

use super::PartsError;
use super::cut::{CUT_BITS, best_cut, shift};
use super::piece::{Carried, Part, Piece};
use super::plan::{Plan, purpose};
use crate::error::points::as_vec;
use crate::lattice::field_lattice;
use crate::lattice::field_selection;
use crate::lattice::position_lattice;
use crate::lattice::quantize;
use crate::restrict::preserve::NEAR;
use crate::restrict::restrictions::Restrictions;
use crate::{BuildConfig, BuildError, Purpose};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use tetralod::geom::{Bounds, Lattice, ON_LATTICE, bits_of};
use tetralod::mesh::{Extremes, Field, Grid, MAX_TETS, MOST_LABELS, MeshError, TetMesh, kuhn_tets};
use tetralod::mt::{FieldInfo, MAX_VERTICES, MtInfo, MtKind};

/// The points in a box of a grid.
pub type PointBox = [Range<u32>; 3];

/// A regular grid whose values are read in parts, never as a whole.
pub struct GridValues<'a> {
    /// The grid alone, with the fields without values.
    pub mesh: TetMesh,
    /// Layers of points across z that are best read together.
    pub layers: u32,
    /// Reads the values of a field, by its number, at the points in a box, x fastest: finite ones.
    pub read: &'a dyn Fn(usize, PointBox) -> Result<Vec<f64>, PartsError>,
}

/// What is known of all values of a grid when each was read once.
pub(super) struct Known<'a> {
    of: &'a GridValues<'a>,
    extremes: Vec<Option<Extremes>>,
    hashers: Vec<crc32fast::Hasher>,
}

/// Parts a grid whose values are read in parts, as [`part`](super::part) would with all values: whether fields are labels, and what else
/// depends on their values, `prepare` says of a mesh that has each value of few, and some of many.
///
/// # Errors
/// As [`part`](super::part), and [`PartsError::NeedsWhole`] if `config` asks for what all values at once tell; those of reading.
pub fn part_grid(
    grid: &GridValues<'_>,
    prepare: &dyn Fn(&mut TetMesh) -> Result<(), PartsError>,
    config: &BuildConfig,
    parts: u32,
    metadata: BTreeMap<String, String>,
    put: &mut dyn FnMut(Part<'static>) -> Result<(), PartsError>,
) -> Result<Plan, PartsError> {
    let whole = |why| Err(PartsError::NeedsWhole { why });
    let purpose = purpose(config, parts)?;
    if !config.preserve.is_empty() {
        return whole("regions are kept");
    }
    if config.position_tolerance.is_some() || field_lattice::has_tolerance(config) {
        return whole("a tolerance is given");
    }
    let (mut mesh, known) = Known::of(grid)?;
    prepare(&mut mesh)?;
    match GridCut::new(&mesh, Some(&known), config, parts)? {
        Some(cut) => cut.part(config, purpose, metadata, put),
        None => whole("its points are not on a lattice of its own"),
    }
}

impl<'a> Known<'a> {
    /// Reads each value once; the mesh has some values of each field, the least and the largest among them.
    fn of(of: &'a GridValues<'a>) -> Result<(TetMesh, Self), PartsError> {
        let mut mesh = of.mesh.clone();
        let Some(grid) = mesh.grid else { return Err(BuildError::Empty.into()) };
        let (mut extremes, mut hashers) = (Vec::new(), Vec::new());
        for (number, field) in mesh.fields.iter_mut().enumerate() {
            let (mut ends, mut hasher, mut some) = (None, crc32fast::Hasher::new(), BTreeSet::new());
            of.each_slab(number, grid.dims, &mut |points, values| {
                let before: Option<Extremes> = ends.take();
                let before = before.iter().flat_map(Extremes::both).map(|at| (at.value, at.place));
                let here = values.iter().copied().zip(indices(points).map(|index| grid.point(index)));
                ends = Extremes::of(before.chain(here));
                values.iter().for_each(|x| hasher.update(&x.to_le_bytes()));
                field.integer &= values.iter().all(field_lattice::is_exact_integer);
                for &value in values {
                    if some.len() > MOST_LABELS {
                        break;
                    }
                    some.insert(bits_of(value));
                }
            })?;
            let ends_of = ends.iter().flat_map(Extremes::both).map(|at| at.value);
            field.values = some.into_iter().map(f64::from_bits).chain(ends_of).collect();
            extremes.push(ends);
            hashers.push(hasher);
        }
        Ok((mesh, Self { of, extremes, hashers }))
    }
}

impl GridValues<'_> {
    /// Reads a field in layers across z, with the points of each.
    fn each_slab(
        &self,
        field: usize,
        [nx, ny, nz]: [u32; 3],
        each: &mut dyn FnMut(PointBox, &[f64]),
    ) -> Result<(), PartsError> {
        for start in (0..nz).step_by(self.layers.max(1) as usize) {
            let points = [0..nx, 0..ny, start..nz.min(start + self.layers.max(1))];
            let values = self.values(field, &points)?;
            each(points, &values);
        }
        Ok(())
    }

    fn values(&self, field: usize, points: &PointBox) -> Result<Vec<f64>, PartsError> {
        let values = (self.read)(field, points.clone())?;
        let count: usize = points.iter().map(Range::len).product();
        if values.len() == count {
            return Ok(values);
        }
        let field = self.mesh.fields[field].name.clone();
        Err(BuildError::from(MeshError::FieldLength { field, values: values.len(), points: count }).into())
    }
}

/// A grid and its parts.
pub(super) struct GridCut<'a> {
    grid: Grid,
    lattice: Lattice,
    /// log2 of the lattice's steps in a cell.
    spare: u32,
    fields: Vec<&'a Field>,
    /// All values, of these fields or not, for the checksum; few of each field if they are read.
    mesh: &'a TetMesh,
    read: Option<&'a Known<'a>>,
    /// Level by level and box by box the axis of a cut and the first cell behind it.
    cuts: Vec<Vec<(usize, u32)>>,
    /// Points that stay: their numbers, ascending.
    kept: Vec<u32>,
    /// The cells of each part along each axis.
    boxes: Vec<[Range<u32>; 3]>,
}

impl<'a> GridCut<'a> {
    /// Cuts a grid alone; none if its points are not all on a lattice of its own, where the whole mesh decides on another one.
    pub fn new(
        mesh: &'a TetMesh,
        read: Option<&'a Known<'a>>,
        config: &BuildConfig,
        parts: u32,
    ) -> Result<Option<Self>, PartsError> {
        let Some(grid) = mesh.grid else { return Ok(None) };
        let [points, tetrahedra] = mesh.counts();
        if points > u64::from(MAX_VERTICES) {
            return Err(BuildError::Points { points }.into());
        }
        if tetrahedra == 0 {
            return Err(BuildError::Empty.into());
        }
        let fields = field_selection::fields(mesh, config)?;
        // What is read is checked then.
        for field in fields.iter().filter(|_| read.is_none()) {
            if field.values.len() as u64 != points {
                let error = MeshError::FieldLength {
                    field: field.name.clone(),
                    values: field.values.len(),
                    points: points as usize,
                };
                return Err(BuildError::from(error).into());
            }
            if let Some(point) = field.values.iter().position(|x| !x.is_finite()) {
                return Err(BuildError::NotFinite { point: point as u32 }.into());
            }
        }
        let Some(lattice) = position_lattice::of_grid(&grid, config) else { return Ok(None) };
        position_lattice::check_scale(&lattice)?;
        let spare = ((grid.spacing[0] / lattice.step[0]) as u32).ilog2();
        let mut cut = Self {
            grid,
            lattice,
            spare,
            fields,
            mesh,
            read,
            cuts: Vec::new(),
            kept: Vec::new(),
            boxes: Vec::new(),
        };
        cut.kept = cut.kept_points(config)?;
        if !cut.is_exact() {
            return Ok(None);
        }
        cut.cut(parts)?;
        Ok(Some(cut))
    }

    /// The points at the places that a configuration keeps, ascending: see `preserve::kept_points`.
    fn kept_points(&self, config: &BuildConfig) -> Result<Vec<u32>, PartsError> {
        let Grid { dims, origin, spacing } = self.grid;
        let ends = [[0; 3], dims.map(|n| n - 1)].map(|index| self.grid.point(index));
        let near = NEAR * Bounds::of(&ends).diagonal();
        let mut kept = Vec::new();
        for &place in &config.keep_points {
            let along =
                |k: usize| ((place[k] - origin[k]) / spacing[k]).round().clamp(0.0, f64::from(dims[k] - 1));
            let index = [0, 1, 2].map(|k| along(k) as u32);
            if DVec3::from(self.grid.point(index))
                .distance(DVec3::from(place))
                .partial_cmp(&near)
                .is_none_or(std::cmp::Ordering::is_gt)
            {
                return Err(BuildError::NoPoint { place }.into());
            }
            kept.push(index[0] + dims[0] * (index[1] + dims[1] * index[2]));
        }
        kept.sort_unstable();
        kept.dedup();
        Ok(kept)
    }

    /// All points of the grid: their indices.
    fn points(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        indices(self.grid.dims.map(|n| 0..n))
    }

    /// A point on the lattice.
    fn position(&self, index: [u32; 3]) -> [i32; 3] {
        index.map(|i| (i << self.spare) as i32)
    }

    /// Whether the lattice has each point where it is.
    fn is_exact(&self) -> bool {
        let (origin, step) = (DVec3::from(self.lattice.origin), DVec3::from(self.lattice.step));
        let mut points = self.points();
        points.all(|index| {
            let (p, q) = (self.grid.point(index), self.position(index));
            let place = (DVec3::from(p) - origin) / step;
            self.lattice.nearest(p) == q && place.distance(as_vec(q)) < ON_LATTICE
        })
    }

    /// Cuts the cells as the tetrahedra would be.
    fn cut(&mut self, parts: u32) -> Result<(), PartsError> {
        let Self { grid, lattice, spare, .. } = self;
        let shift = shift(lattice.bits);
        let place = |cell: u32| ((cell << *spare) >> shift) as usize;
        let mut boxes = vec![grid.dims.map(|n| 0..n - 1)];
        for _ in 0..parts.ilog2() {
            let mut cuts = Vec::with_capacity(boxes.len());
            let mut halves = Vec::with_capacity(2 * boxes.len());
            for cells in boxes {
                let counts = [0, 1, 2].map(|axis: usize| {
                    let others: u64 =
                        (0..3).filter(|&k| k != axis).map(|k: usize| cells[k].len() as u64).product();
                    let mut counts = vec![0_u64; 1 << CUT_BITS];
                    cells[axis].clone().for_each(|cell| counts[place(cell)] += 6 * others);
                    counts
                });
                let tetrahedra = self.mesh.counts()[1];
                let (axis, behind) =
                    best_cut(&counts, lattice.step).ok_or(PartsError::TooMany { parts, tetrahedra })?;
                let first =
                    cells[axis].clone().find(|&cell| place(cell) >= behind).unwrap_or(cells[axis].end);
                let (mut below, mut above) = (cells.clone(), cells);
                (below[axis].end, above[axis].start) = (first, first);
                cuts.push((axis, first));
                halves.extend([below, above]);
            }
            self.cuts.push(cuts);
            boxes = halves;
        }
        let tets =
            |cells: &[Range<u32>; 3]| 6 * cells.iter().map(|range| range.len() as u64).product::<u64>();
        if boxes.iter().any(|cells| tets(cells) > MAX_TETS as u64) {
            return Err(BuildError::TooLarge.into());
        }
        self.boxes = boxes;
        Ok(())
    }

    /// The part that a cell belongs to.
    fn part_of(&self, cell: [u32; 3]) -> u32 {
        self.cuts.iter().fold(0, |part, cuts| {
            let (axis, first) = cuts[part as usize];
            2 * part + u32::from(cell[axis] >= first)
        })
    }

    /// Passes on all parts.
    pub fn part(
        &self,
        config: &BuildConfig,
        purpose: Purpose,
        metadata: BTreeMap<String, String>,
        put: &mut dyn FnMut(Part<'static>) -> Result<(), PartsError>,
    ) -> Result<Plan, PartsError> {
        let info = self.info(config)?;
        let sides = self.position(self.grid.dims.map(|n| n - 1));
        let whole = (self.boxes.len() as u32, self.checksum(), sides);
        let plan = Plan::new(&info, config, purpose, whole, (None, &[]), metadata);
        // Angles are measured by the lattices alone.
        let alone = quantize::lattices_alone(info.lattice, info.fields.clone(), info.quantization);
        Restrictions::of_angles(config, &alone)?;
        for (index, cells) in (0..).zip(&self.boxes) {
            put(Part::of(&plan, index, self.piece(index, cells)?))?;
        }
        Ok(plan)
    }

    fn info(&self, config: &BuildConfig) -> Result<MtInfo, PartsError> {
        let mut fields: Vec<FieldInfo> = field_lattice::field_lattices(&self.fields, config)?;
        match self.read {
            Some(known) => self.measure(known, &mut fields)?,
            None => field_lattice::set_extremes(&mut fields, &self.fields, || {
                self.points().map(|at| self.grid.point(at))
            }),
        }
        let [points, tetrahedra] = self.mesh.counts();
        let ends = [[0; 3], self.grid.dims.map(|n| n - 1)].map(|index| self.grid.point(index));
        let moved = |index| {
            position_lattice::distance(self.grid.point(index), self.lattice.point(self.position(index)))
        };
        Ok(MtInfo {
            kind: MtKind::HalfEdge,
            lattice: self.lattice,
            fields,
            // No grid of more is cut.
            vertices: points as u32,
            tetrahedra,
            updates: 0,
            displacement_per_error: config.displacement * Bounds::of(&ends).diagonal(),
            quantization: self.points().map(moved).fold(0.0, f64::max),
            bounds: None,
        })
    }

    /// The number of a chosen field among all.
    fn number(&self, field: &Field) -> usize {
        // It is one of them.
        self.mesh.fields.iter().position(|known| std::ptr::eq(known, field)).unwrap_or_default()
    }

    /// What the lattices of fields lose, of values that are read again for it.
    fn measure(&self, known: &Known<'_>, infos: &mut [FieldInfo]) -> Result<(), PartsError> {
        for (info, &field) in infos.iter_mut().zip(&self.fields) {
            let number = self.number(field);
            info.extremes.clone_from(&known.extremes[number]);
            info.quantization = 0.0;
            // Integers are where such lattices have them.
            if field.integer && info.step == 1.0 && info.origin.fract() == 0.0 {
                continue;
            }
            let of = info.clone();
            known.of.each_slab(number, self.grid.dims, &mut |_, values| {
                let losses = values.iter().map(|&value| field_lattice::loss(&of, value));
                info.quantization = losses.fold(info.quantization, f64::max);
            })?;
        }
        Ok(())
    }

    /// The values of a field at the points in a box.
    fn values(&self, field: &Field, points: &PointBox) -> Result<Vec<f64>, PartsError> {
        if let Some(known) = self.read {
            return known.of.values(self.number(field), points);
        }
        let [nx, ny, _] = self.grid.dims;
        Ok(indices(points.clone()).map(|[x, y, z]| field.values[(x + nx * (y + ny * z)) as usize]).collect())
    }

    /// As of the whole mesh.
    fn checksum(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        let mut row = Vec::new();
        let [nx, ny, nz] = self.grid.dims;
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            row.clear();
            (0..nx).for_each(|x| row.extend(self.grid.point([x, y, z]).iter().flat_map(|x| x.to_le_bytes())));
            hasher.update(&row);
        }
        let first = |[x, y, z]: [u32; 3]| x + nx * (y + ny * z);
        let cube = kuhn_tets([2; 3]);
        for (z, y) in (0..nz - 1).flat_map(|z| (0..ny - 1).map(move |y| (z, y))) {
            row.clear();
            for x in 0..nx - 1 {
                let corner = |v: u32| first([x + (v & 1), y + (v >> 1 & 1), z + (v >> 2)]);
                row.extend(cube.iter().flatten().flat_map(|&v| corner(v).to_le_bytes()));
            }
            hasher.update(&row);
        }
        if let Some(known) = self.read {
            known.hashers.iter().for_each(|of_field| hasher.combine(of_field));
            return hasher.finalize();
        }
        for values in self.mesh.fields.iter().flat_map(|field| field.values.chunks(4096)) {
            row.clear();
            row.extend(values.iter().flat_map(|x| x.to_le_bytes()));
            hasher.update(&row);
        }
        hasher.finalize()
    }

    fn piece(&self, index: u32, cells: &[Range<u32>; 3]) -> Result<Piece, PartsError> {
        let [nx, ny, _] = self.grid.dims;
        let of_whole = |[x, y, z]: [u32; 3]| x + nx * (y + ny * z);
        // Points go one further than cells.
        let [xs, ys, zs] = cells.clone().map(|cells| cells.start..cells.end + 1);
        let here: Vec<[u32; 3]> = indices([xs.clone(), ys.clone(), zs.clone()]).collect();
        let (across, layer) = (xs.len() as u32, (xs.len() * ys.len()) as u32);
        let local = |[x, y, z]: [u32; 3]| (x - xs.start) + across * (y - ys.start) + layer * (z - zs.start);
        let cube = kuhn_tets([2; 3]);
        let mut tets = Vec::with_capacity(6 * cells.iter().map(Range::len).product::<usize>());
        for [x, y, z] in indices(cells.clone()) {
            let corner = |v: u32| local([x + (v & 1), y + (v >> 1 & 1), z + (v >> 2)]);
            tets.extend(cube.iter().map(|tet| tet.map(corner)));
        }
        let points = [xs.clone(), ys.clone(), zs.clone()];
        let values = self.fields.iter().map(|field| self.values(field, &points));
        let values: Vec<Vec<f64>> = values.collect::<Result<_, _>>()?;
        let shared = (0..).zip(&here).filter_map(|(i, &p)| {
            let [first, last] = self.parts_at(p);
            (first != last).then_some((i, first, last))
        });
        let kept = (0..).zip(&here).filter(|(_, p)| self.kept.binary_search(&of_whole(**p)).is_ok());
        let carried = Carried {
            shortest: here.iter().map(|&p| self.shortest(p)).collect(),
            shared: shared.collect(),
            interface: self.interface(index, cells, local),
            kept: kept.map(|(i, _)| i).collect(),
            ..Carried::default()
        };
        Ok(Piece {
            positions: here.iter().map(|&p| self.position(p)).collect(),
            values: (0..here.len()).flat_map(|i| values.iter().map(move |field| field[i])).collect(),
            points: here.iter().map(|&p| of_whole(p)).collect(),
            tets,
            carried,
            ..Piece::default()
        })
    }

    /// The first and the last part that have a point.
    fn parts_at(&self, p: [u32; 3]) -> [u32; 2] {
        let along = |k: usize| p[k].saturating_sub(1)..(p[k] + 1).min(self.grid.dims[k] - 1);
        let parts = indices([0, 1, 2].map(along)).map(|cell| self.part_of(cell));
        parts.fold([u32::MAX, 0], |ends, part| [ends[0].min(part), ends[1].max(part)])
    }

    /// The square of the shortest edge at a point: one along an axis.
    fn shortest(&self, p: [u32; 3]) -> f64 {
        let step = DVec3::from(self.lattice.step);
        let place = |p: [u32; 3]| as_vec(self.position(p)) * step;
        let mut least = f64::INFINITY;
        for k in 0..3 {
            for next in [p[k].checked_sub(1), Some(p[k] + 1).filter(|&i| i < self.grid.dims[k])] {
                let Some(next) = next else { continue };
                let mut other = p;
                other[k] = next;
                least = least.min(place(p).distance_squared(place(other)));
            }
        }
        least
    }

    /// The faces of a part to others: each side of a cell is cut from its lowest to its highest corner.
    fn interface(
        &self,
        index: u32,
        cells: &[Range<u32>; 3],
        local: impl Fn([u32; 3]) -> u32,
    ) -> Vec<([u32; 3], u32)> {
        let mut faces = Vec::new();
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let ends = [
                (cells[axis].start, cells[axis].start.checked_sub(1)),
                (cells[axis].end, Some(cells[axis].end).filter(|&cell| cell + 1 < self.grid.dims[axis])),
            ];
            for (plane, beyond) in ends {
                let Some(beyond) = beyond else { continue };
                for (a, b) in cells[u].clone().flat_map(|a| cells[v].clone().map(move |b| (a, b))) {
                    let at = |along: u32, i: u32, j: u32| {
                        let mut p = [0; 3];
                        (p[axis], p[u], p[v]) = (along, a + i, b + j);
                        p
                    };
                    let other = self.part_of(at(beyond, 0, 0));
                    debug_assert_ne!(other, index, "a part is a box");
                    let [low, high] = [at(plane, 0, 0), at(plane, 1, 1)].map(&local);
                    for middle in [at(plane, 1, 0), at(plane, 0, 1)].map(&local) {
                        faces.push(([low, middle, high], other));
                    }
                }
            }
        }
        faces.sort_unstable();
        faces
    }
}

/// All indices in a box, x fastest.
fn indices([xs, ys, zs]: [Range<u32>; 3]) -> impl Iterator<Item = [u32; 3]> {
    zs.flat_map(move |z| {
        let xs = xs.clone();
        ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alone(dims: [u32; 3]) -> TetMesh {
        let grid = Some(Grid { dims, origin: [0.0; 3], spacing: [1.0; 3] });
        TetMesh { grid, ..TetMesh::default() }
    }

    fn cut_alone<'a>(mesh: &'a TetMesh, read: Option<&'a Known<'a>>) -> GridCut<'a> {
        let grid = mesh.grid.expect("a grid");
        let lattice = position_lattice::of_grid(&grid, &BuildConfig::default()).expect("a lattice");
        let spare = ((grid.spacing[0] / lattice.step[0]) as u32).ilog2();
        let (fields, cuts, kept, boxes) = Default::default();
        GridCut { grid, lattice, spare, fields, mesh, cuts, kept, boxes, read }
    }

    #[test]
    fn a_grid_of_as_many_points_as_have_numbers_is_cut() {
        // As near to a cube as can be, and so flat that few layers have more tetrahedra than have numbers.
        for (dims, parts) in [([1625, 1625, 1626], 32), ([2, 65_535, 32_767], 16)] {
            let mesh = &alone(dims);
            let cut = |parts: u32| {
                let mut cut = cut_alone(mesh, None);
                cut.cut(parts).map(|()| cut)
            };
            // Half as many have too many each.
            assert!(matches!(cut(parts / 2), Err(PartsError::Build(BuildError::TooLarge))), "{dims:?}");
            let cut = cut(parts).expect("parts");
            let cells =
                |cells: &[Range<u32>; 3]| cells.iter().map(|range| range.len() as u64).product::<u64>();
            let [points, tetrahedra] = mesh.counts();
            assert_eq!(6 * cut.boxes.iter().map(cells).sum::<u64>(), tetrahedra);
            assert!(tetrahedra > 2 * u64::from(u32::MAX));
            assert!(
                (u64::from(MAX_VERTICES) - (1 << 22)..=MAX_VERTICES.into()).contains(&points),
                "{points}"
            );
            for (part, cells) in (0..).zip(&cut.boxes) {
                let corners =
                    [cells.clone().map(|range| range.start), cells.clone().map(|range| range.end - 1)];
                assert_eq!(corners.map(|cell| cut.part_of(cell)), [part; 2]);
            }
        }
    }

    #[test]
    fn a_part_at_the_end_of_a_grid_has_its_last_points() {
        let dims = [1625, 1625, 1626];
        let grid = Grid { dims, origin: [0.0; 3], spacing: [1.0; 3] };
        let field = Field::new("its number", Vec::new());
        let mesh = TetMesh { grid: Some(grid), fields: vec![field], ..TetMesh::default() };
        let [nx, ny, _] = dims.map(u64::from);
        let number = |[x, y, z]: [u32; 3]| u64::from(x) + nx * (u64::from(y) + ny * u64::from(z));
        let read = |_: usize, points: PointBox| -> Result<Vec<f64>, PartsError> {
            Ok(indices(points).map(|index| number(index) as f64).collect())
        };
        let values = GridValues { mesh: mesh.clone(), layers: 1, read: &read };
        let known = Known { of: &values, extremes: vec![None], hashers: vec![crc32fast::Hasher::new()] };
        let cut = GridCut { fields: vec![&mesh.fields[0]], ..cut_alone(&mesh, Some(&known)) };
        let piece = cut.piece(1, &dims.map(|n| n - 3..n - 1)).expect("values");
        assert_eq!((piece.points.len(), piece.tets.len()), (27, 48));
        assert_eq!(piece.points.last().map(|&last| u64::from(last)), Some(mesh.counts()[0] - 1));
        assert!(piece.points.is_sorted());
        assert_eq!(piece.values, piece.points.iter().map(|&point| f64::from(point)).collect::<Vec<_>>());
        assert_eq!(piece.positions.last(), Some(&cut.position(dims.map(|n| n - 1))));
    }

    #[test]
    fn more_is_refused_before_anything_else() {
        for dims in [[4096; 3], [1626; 3], [2, 1 << 16, 1 << 15], [3, 5, 286_331_153], [u32::MAX; 3]] {
            let (mesh, config) = (alone(dims), BuildConfig::default());
            let refused = GridCut::new(&mesh, None, &config, 64).err().expect("too many points");
            let PartsError::Build(BuildError::Points { points }) = refused else { panic!("{refused}") };
            assert_eq!(points, mesh.counts()[0]);
            let said = refused.to_string();
            let starts =
                format!("{points} points are more than one MT can number, 4294967294 (a grid of 1625");
            assert!(
                said.starts_with(&starts) && said.contains("keep fewer samples along each axis"),
                "{said}"
            );
        }
    }
}
