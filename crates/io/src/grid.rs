//! Grids of cubes, however they are stored: checks, where their points lie, and the meshes that they become.
//!
//! Every cube is split as that of a regular grid, so neighbours agree.

use crate::MemoryLimit;
use crate::error::{ReadReason, expect_count};
use crate::fields::{check_finite, check_finite_cells};
use crate::ghosts::HIDDEN_POINT;
use crate::{cell_types, cells};
use tetralod::mesh::{CellNumbers, Field, Grid, MAX_TETS, MeshInput, TetMesh, kuhn_tets};
use tetralod::mt::MAX_VERTICES;

/// Most points of a grid: as many as an MT has vertices, some 1625³, where memory has addresses for them.
pub(super) const MAX_GRID_POINTS: u64 = if usize::BITS < 64 { 1 << 27 } else { MAX_VERTICES as u64 };

/// First and last index along x, y and z.
pub(super) type Extent = [i64; 6];

/// A grid that was checked: at least two points along each axis, finite, not too large.
pub(super) fn checked_grid(dims: [u64; 3], origin: [f64; 3], spacing: [f64; 3]) -> Result<Grid, ReadReason> {
    if dims.iter().any(|d| *d < 2) {
        let what = format!("a grid of {} x {} x {} points", dims[0], dims[1], dims[2]);
        return Err(ReadReason::unsupported(what, "give at least two points along each axis"));
    }
    if !has_numbers(dims) {
        return Err(too_many_points(dims));
    }
    let far = [0, 1, 2].map(|i| origin[i] + spacing[i] * dims[i] as f64);
    if far.iter().chain(&origin).any(|x| !x.is_finite()) || spacing.iter().any(|s| s.is_nan() || *s <= 0.0) {
        let what = format!("a grid with spacing {spacing:?} and origin {origin:?}");
        return Err(ReadReason::unsupported(what, "spacing must be positive, both finite"));
    }
    // Each dimension is at most the number of points.
    Ok(Grid { dims: dims.map(|d| d as u32), origin, spacing })
}

/// Whether a grid has no more points than may be.
fn has_numbers(dims: [u64; 3]) -> bool {
    let points = dims.iter().try_fold(1_u64, |n, d| n.checked_mul(*d));
    points.is_some_and(|n| n <= MAX_GRID_POINTS)
}

/// That a grid has too many points, and how coarse it could be.
fn too_many_points(dims: [u64; 3]) -> ReadReason {
    let words = |[x, y, z]: [u64; 3]| format!("{x} x {y} x {z}");
    let coarser = |step: u64| dims.map(|count| count.div_ceil(step));
    let fits = |dims: [u64; 3]| !dims.contains(&1) && has_numbers(dims);
    let fitting = (2..=COARSEST).find(|step| fits(coarser(*step)));
    let instead =
        fitting.map(|step| format!("; one of {step} along each axis would be {}", words(coarser(step))));
    let what = format!("grid points (there are {}{})", words(dims), instead.unwrap_or_default());
    ReadReason::TooLarge { what, limit: MAX_GRID_POINTS }
}

/// No grid is said to be kept by less than one of so many points along an axis.
const COARSEST: u64 = 16;

/// Where the points of a grid lie: the first one, and the steps from one to the next along each axis of the grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placement {
    pub dims: [u64; 3],
    pub origin: [f64; 3],
    pub steps: [[f64; 3]; 3],
}

impl Placement {
    /// The grid, if it lies along the axes of space and in their direction; it was checked then.
    pub fn grid(&self) -> Result<Option<Grid>, ReadReason> {
        let along = [0, 1, 2].map(|i| self.steps[i][i]);
        let is_aligned = (0..9).all(|k| k / 3 == k % 3 || self.steps[k / 3][k % 3] == 0.0);
        if !is_aligned || along.iter().any(|step| *step < 0.0) {
            return Ok(None);
        }
        checked_grid(self.dims, self.origin, along).map(Some)
    }

    /// The places of all points of a grid that is turned.
    pub fn positions(&self) -> Result<Vec<[f64; 3]>, ReadReason> {
        let dims = checked_dims(self.dims)?;
        let place = |x: u32, y: u32, z: u32| {
            let by = [x, y, z].map(f64::from);
            [0, 1, 2].map(|i| self.origin[i] + (0..3).map(|axis| by[axis] * self.steps[axis][i]).sum::<f64>())
        };
        let mut positions = Vec::with_capacity(dims.iter().map(|d| *d as usize).product());
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                positions.extend((0..dims[0]).map(|x| place(x, y, z)));
            }
        }
        if positions.as_flattened().iter().any(|x| !x.is_finite()) {
            return Err(ReadReason::Syntax("the origin or a direction of the grid is not finite".into()));
        }
        Ok(positions)
    }

    /// The mesh of a grid, without points and tetrahedra if it lies along the axes and nothing else needs them.
    pub fn mesh(&self, values: GridValues, memory: &MemoryLimit) -> Result<TetMesh, ReadReason> {
        if let Some(grid) = self.grid()? {
            return grid_mesh(grid, values, memory);
        }
        let dims = checked_dims(self.dims)?;
        memory.expect(bytes(dims)?)?;
        mesh(dims, self.positions()?, values, memory)
    }
}

/// What a grid has at its points and at its cubes.
#[derive(Debug, Default)]
pub(super) struct GridValues {
    pub fields: Vec<Field>,
    /// Fields at cubes, one value a cube; without values where only names are asked for.
    pub cubes: Vec<Field>,
    /// What hides points and cubes.
    pub ghosts: Ghosts,
    /// Fields that nobody asked for, at points and cubes.
    pub others: [Vec<Field>; 2],
}

/// The mesh of a grid along the axes.
pub(super) fn grid_mesh(grid: Grid, values: GridValues, memory: &MemoryLimit) -> Result<TetMesh, ReadReason> {
    with_values(TetMesh { grid: Some(grid), ..TetMesh::default() }, grid.dims, values, memory)
}

/// The directions of a grid that is not turned: its axes are the columns of this matrix.
pub(super) const ALONG_THE_AXES: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// The places of the points of VTK's image data.
pub(super) fn placed(
    whole: Extent,
    origin: [f64; 3],
    spacing: [f64; 3],
    direction: [f64; 9],
) -> Result<(Placement, Extent), ReadReason> {
    let dims = dims_in(whole, whole)?;
    checked_dims(dims)?;
    // Products with 0 must not have a sign, or be not finite.
    let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
    let steps = [0, 1, 2].map(|axis| [0, 1, 2].map(|i| times(direction[3 * i + axis], spacing[axis])));
    let is_flat = |step: &[f64; 3]| step.iter().all(|x| *x == 0.0);
    let is_finite = [&origin[..], steps.as_flattened()].into_iter().flatten().all(|x| x.is_finite());
    if !is_finite || steps.iter().any(is_flat) {
        let what = format!("a grid with spacing {spacing:?}, origin {origin:?} and directions {direction:?}");
        return Err(ReadReason::unsupported(what, "spacing and directions must be finite and not 0"));
    }
    // VTK's origin is the position of index (0, 0, 0), which need not be in the grid.
    let first = [0, 1, 2].map(|i| {
        let moves = (0..3).map(|axis| times(steps[axis][i], whole[2 * axis] as f64));
        origin[i] + moves.sum::<f64>()
    });
    Ok((Placement { dims, origin: first, steps }, whole))
}

/// How many points `extent` has along each axis; it must lie in `whole`.
pub(super) fn dims_in(extent: Extent, whole: Extent) -> Result<[u64; 3], ReadReason> {
    let outside = || ReadReason::Syntax(format!("extent {extent:?} is empty or not in {whole:?}"));
    let mut dims = [0; 3];
    for (i, dim) in dims.iter_mut().enumerate() {
        let (low, high) = (extent[2 * i], extent[2 * i + 1]);
        if low < whole[2 * i] || high > whole[2 * i + 1] || low > high {
            return Err(outside());
        }
        *dim = high.abs_diff(low).checked_add(1).ok_or_else(outside)?;
    }
    Ok(dims)
}

/// Points along each axis: at least two, and not too many together.
pub(super) fn checked_dims(dims: [u64; 3]) -> Result<[u32; 3], ReadReason> {
    checked_grid(dims, [0.0; 3], [1.0; 3]).map(|grid| grid.dims)
}

/// How many cubes there are between so many points.
pub(super) fn cubes(dims: [u32; 3]) -> usize {
    dims.map(|d| d as usize - 1).iter().product()
}

/// How many tetrahedra they are split into.
pub(super) fn most_tets(dims: [u64; 3]) -> u64 {
    dims.iter().map(|d| d.saturating_sub(1)).fold(6, u64::saturating_mul)
}

/// Bytes of the points and tetrahedra of a grid, which one mesh must be able to hold: a grid alone may be larger.
pub(super) fn bytes(dims: [u32; 3]) -> Result<u64, ReadReason> {
    let points: u64 = dims.iter().map(|d| u64::from(*d)).product();
    let cubes = cubes(dims) as u64;
    if cubes > MAX_TETS as u64 / 6 {
        let what = "tetrahedra of a grid that is read as one mesh, six for each of its cubes".into();
        return Err(ReadReason::TooLarge { what, limit: MAX_TETS as u64 });
    }
    Ok(24 * points + 6 * 16 * cubes)
}

/// The positions of a grid with these coordinates along each axis.
pub(super) fn rectilinear([x, y, z]: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut positions = Vec::with_capacity(3 * x.len() * y.len() * z.len());
    for z in z {
        for y in y {
            positions.extend(x.iter().flat_map(|x| [*x, *y, *z]));
        }
    }
    positions
}

/// What VTK's flags hide of a grid; none without flags.
#[derive(Debug, Default)]
pub(super) struct Ghosts {
    pub points: Option<Vec<i64>>,
    pub cubes: Option<Vec<i64>>,
}

impl Ghosts {
    /// Why each cube is left out, or 0 where it is not; none if all are there.
    fn left_out(&self, dims: [u32; 3]) -> Option<Vec<i64>> {
        let mut left_out = vec![0; cubes(dims)];
        for (kind, flags) in left_out.iter_mut().zip(self.cubes.iter().flatten()) {
            *kind = cells::left_out_by(*flags).unwrap_or(0);
        }
        if let Some(points) = self.points.as_ref().filter(|flags| flags.iter().any(|f| f & HIDDEN_POINT != 0))
        {
            let hidden = |corners: [usize; 8]| {
                corners.iter().any(|&p| points.get(p).is_some_and(|f| f & HIDDEN_POINT != 0))
            };
            let around = (0..left_out.len()).map(|cube| hidden(corners(dims, cube)));
            left_out
                .iter_mut()
                .zip(around)
                .filter(|(_, hidden)| *hidden)
                .for_each(|(kind, _)| *kind = cell_types::HIDDEN);
        }
        left_out.iter().any(|kind| *kind != 0).then_some(left_out)
    }
}

/// The points at the corners of a cube.
fn corners(dims: [u32; 3], cube: usize) -> [usize; 8] {
    let [x, y, _] = dims.map(|d| d as usize);
    let (row, layer) = (x - 1, (x - 1) * (y - 1));
    let first = cube % row + x * (cube % layer / row) + x * y * (cube / layer);
    [0, 1, x, x + 1, x * y, x * y + 1, x * y + x, x * y + x + 1].map(|offset| first + offset)
}

/// The mesh of a grid of checked dimensions with these points, and fields at points and cubes.
pub(super) fn mesh(
    dims: [u32; 3],
    positions: Vec<[f64; 3]>,
    values: GridValues,
    memory: &MemoryLimit,
) -> Result<TetMesh, ReadReason> {
    expect_count("points", dims.iter().map(|d| u64::from(*d)).product::<u64>(), positions.len())?;
    memory.take(bytes(dims)?)?;
    with_values(TetMesh { positions, tets: kuhn_tets(dims), ..TetMesh::default() }, dims, values, memory)
}

/// A grid, alone or with its points and tetrahedra, with its values and without what is hidden.
pub(super) fn with_values(
    mut mesh: TetMesh,
    dims: [u32; 3],
    values: GridValues,
    memory: &MemoryLimit,
) -> Result<TetMesh, ReadReason> {
    let GridValues { fields, cubes, ghosts, others: [other_fields, other_cell_fields] } = values;
    let left_out = ghosts.left_out(dims);
    check_finite(&mesh.positions, &fields, &|| left_out.as_ref().map(|left_out| used(dims, left_out)))?;
    check_finite_cells(&cubes, |cube| left_out.as_ref().is_none_or(|left_out| left_out[cube] == 0))?;
    (mesh.fields, mesh.cell_fields) = (fields, cubes);
    mesh.input = MeshInput { other_fields, other_cell_fields, ..MeshInput::default() };
    let count = self::cubes(dims);
    if left_out.is_some() || mesh.cell_fields.iter().any(|field| !field.values.is_empty()) {
        if mesh.is_grid_alone() {
            memory.take(bytes(dims)?)?;
        }
        mesh.expand_grid();
    }
    let Some(left_out) = left_out else {
        mesh.input.cells = CellNumbers::equal(count, 6, CUBE);
        let spread = |&value: &f64| [value; 6];
        mesh.cell_fields.iter_mut().for_each(|f| f.values = f.values.iter().flat_map(spread).collect());
        return Ok(mesh);
    };
    // What is left is no regular grid.
    let is_there = |cube: usize| left_out[cube] == 0;
    mesh.grid = None;
    cells::leave_out(
        &left_out.iter().copied().filter(|kind| *kind != 0).collect::<Vec<_>>(),
        &mut mesh.input,
    );
    let kept: Vec<u32> =
        (0..count as u32).filter(|&cube| is_there(cube as usize)).flat_map(|cube| [cube; 6]).collect();
    let mut tet = 0;
    mesh.tets.retain(|_| {
        tet += 1;
        is_there((tet - 1) / 6)
    });
    for field in mesh.cell_fields.iter_mut().filter(|field| !field.values.is_empty()) {
        field.values = kept.iter().map(|&cube| field.values[cube as usize]).collect();
    }
    mesh.input.cells = CellNumbers::each(kept, count, vec![(0, CUBE)]);
    Ok(mesh)
}

/// What the cells of a grid are called in messages.
const CUBE: &str = "cube of the grid";

/// Which points the cubes use that are not left out.
fn used(dims: [u32; 3], left_out: &[i64]) -> Vec<bool> {
    let mut used = vec![false; dims.iter().map(|d| *d as usize).product()];
    for (cube, _) in left_out.iter().enumerate().filter(|(_, kind)| **kind == 0) {
        corners(dims, cube).into_iter().for_each(|point| used[point] = true);
    }
    used
}

#[cfg(all(test, target_pointer_width = "64"))]
mod tests {
    use super::*;

    #[test]
    fn what_numbers_of_32_bits_tell_apart_is_a_grid() {
        let said = |dims: [u64; 3]| checked_dims(dims).map_err(|error| error.to_string());
        assert_eq!(said([1625, 1625, 1626]), Ok([1625, 1625, 1626]));
        assert_eq!(said([2, 2, (1 << 30) - 1]), Ok([2, 2, (1 << 30) - 1]));
        assert_eq!(said([2, 3, 715_827_882]), Ok([2, 3, 715_827_882]));
        let most = "more than 4294967294 grid points";
        for (dims, there) in [
            ([4096; 3], "4096 x 4096 x 4096; one of 3 along each axis would be 1366 x 1366 x 1366"),
            ([1626; 3], "1626 x 1626 x 1626; one of 2 along each axis would be 813 x 813 x 813"),
            // As many as there are numbers, of which one means none.
            ([3, 5, 286_331_153], "3 x 5 x 286331153; one of 2 along each axis would be 2 x 3 x 143165577"),
            ([2, 2, 1 << 30], "2 x 2 x 1073741824"),
            ([1 << 32, 1 << 32, 2], "4294967296 x 4294967296 x 2"),
        ] {
            assert_eq!(said(dims), Err(format!("{most} (there are {there}); split the data")));
        }
        assert!(said([u64::MAX; 3]).is_err_and(|error| error.starts_with(most)));
        // One mesh has fewer tetrahedra.
        assert_eq!(bytes([513; 3]), Ok(24 * 513_u64.pow(3) + 96 * 512_u64.pow(3)));
        let error = bytes([565; 3]).unwrap_err().to_string();
        assert!(
            error.contains("more than 1073741823 tetrahedra of a grid that is read as one mesh"),
            "{error}"
        );
        let whole = Placement {
            dims: [1600; 3],
            origin: [0.0; 3],
            steps: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        };
        let refused = whole.mesh(GridValues::default(), &MemoryLimit::default());
        assert!(matches!(refused, Err(ReadReason::TooLarge { .. })), "{refused:?}");
    }
}
