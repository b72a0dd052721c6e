//! The lattice of the positions: as coarse as the configuration and the cells allow.

use crate::{BuildConfig, BuildError};
use tetralod::geom::{Bounds, Lattice, WIDE_BITS, orient3d};
use tetralod::mesh::{Grid, TetMesh};
use tetralod::mt::MtKind;

/// The fewest position bits that are tried unless the caller says otherwise.
pub(crate) const FEWEST_BITS: u32 = 16;
/// Bits added to the fewest that keep every cell positive, so that thin cells keep their shape, too.
pub(crate) const SPARE_BITS: u32 = 2;

/// The smallest step of a lattice and the largest coordinate or value, as powers of 2: the squares of volumes are still ordinary numbers in
/// double precision, and so is all that meshes are measured by.
const ORDINARY: [f64; 2] = [f64::from_bits((1023 - 170) << 52), f64::from_bits((1023 + 170) << 52)];

/// Whether double precision can compute with a lattice of so many bits along an axis.
pub(crate) fn is_ordinary(origin: f64, step: f64, bits: u32) -> bool {
    let [smallest, largest] = ORDINARY;
    let end = origin + step * f64::from(1_u32 << bits);
    step >= smallest && origin.abs() <= largest && end.abs() <= largest
}

/// Refuses lattices that double precision cannot compute with.
pub(crate) fn check_scale(lattice: &Lattice) -> Result<(), BuildError> {
    let is_ordinary = |k: usize| is_ordinary(lattice.origin[k], lattice.step[k], lattice.bits);
    match (0..3).find(|&k| !is_ordinary(k)) {
        None => Ok(()),
        Some(k) => Err(BuildError::Scale { field: None, step: lattice.step[k], origin: lattice.origin[k] }),
    }
}

/// Points on a lattice.
pub(crate) struct Placed {
    pub lattice: Lattice,
    pub positions: Vec<[i32; 3]>,
}

/// Puts the points on a lattice that keeps every cell positive or, where there are none, the points apart:
/// - of the configured number of bits;
/// - the coarsest one that keeps every point within the configured tolerance;
/// - if neither is configured, the coarsest one of at least [`FEWEST_BITS`], with [`SPARE_BITS`] more where it had to
///   be finer.
pub(crate) fn place(mesh: &TetMesh, config: &BuildConfig) -> Result<Placed, BuildError> {
    // Before cells are said to be too thin for a lattice.
    if !mesh.positions.is_empty() {
        check_scale(&lattice(mesh, FEWEST_BITS))?;
    }
    match (config.position_bits, config.position_tolerance) {
        (Some(_), Some(_)) => {
            Err(BuildError::Option { name: "position-tolerance", expected: "given without position-bits" })
        }
        (Some(bits), None) => with_bits(mesh, bits),
        (None, Some(tolerance)) => within(mesh, tolerance),
        // Half-edge updates make no new positions: the points of a grid need no finer lattice than the grid.
        (None, None) if config.construction.kind() == MtKind::HalfEdge && grid_bits(mesh).is_some() => {
            Ok(on(mesh, grid_bits(mesh).unwrap_or(FEWEST_BITS)))
        }
        (None, None) => by_cells(mesh),
    }
}

/// How far the lattice moves a point at most, in model units, rounded up.
pub(crate) fn largest_move(mesh: &TetMesh, lattice: &Lattice, positions: &[[i32; 3]]) -> f64 {
    let moves = mesh.positions.iter().zip(positions).map(|(&p, &q)| distance(p, lattice.point(q)));
    moves.fold(0.0, f64::max)
}

/// The distance, a little too large rather than too small; 0 only between equal points.
pub(crate) fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    let away = [0, 1, 2].map(|i| (p[i] - q[i]).abs());
    let largest = away.into_iter().fold(0.0, f64::max);
    if largest == 0.0 {
        return 0.0;
    }
    let squares: f64 = away.into_iter().map(|x| (x / largest) * (x / largest)).sum();
    (largest * squares.sqrt() * (1.0 + 8.0 * f64::EPSILON)).next_up()
}

fn with_bits(mesh: &TetMesh, bits: u32) -> Result<Placed, BuildError> {
    let placed = on(mesh, bits);
    match flat_cell(mesh, &placed) {
        // Points in one place are the business of those who build from points.
        None => Ok(placed),
        Some(cell) => {
            let enough = (bits + 1..=WIDE_BITS).find(|&bits| flat_cell(mesh, &on(mesh, bits)).is_none());
            Err(BuildError::TooThin { cell: mesh.input.cells.cell_of(cell), bits, enough })
        }
    }
}

fn within(mesh: &TetMesh, tolerance: f64) -> Result<Placed, BuildError> {
    if tolerance.is_nan() || tolerance < 0.0 {
        return Err(BuildError::Option { name: "position-tolerance", expected: "a number of at least 0" });
    }
    // The first point that is too far away is usually among the first of all.
    let is_near = |placed: &Placed| {
        let mut pairs = mesh.positions.iter().zip(&placed.positions);
        pairs.all(|(&p, &q)| distance(p, placed.lattice.point(q)) <= tolerance)
    };
    let near =
        (1..=WIDE_BITS).map(|bits| on(mesh, bits)).find(|placed| is_near(placed) && fits(mesh, placed));
    near.ok_or_else(|| {
        let finest = on(mesh, WIDE_BITS);
        let reached = largest_move(mesh, &finest.lattice, &finest.positions);
        match flat_cell(mesh, &finest) {
            Some(cell) if reached <= tolerance => too_thin(mesh, cell),
            _ => BuildError::Tolerance { field: None, reached },
        }
    })
}

/// Why a mesh is refused of which a tetrahedron is flat on the finest lattice.
fn too_thin(mesh: &TetMesh, tet: u32) -> BuildError {
    BuildError::TooThin { cell: mesh.input.cells.cell_of(tet), bits: WIDE_BITS, enough: None }
}

fn by_cells(mesh: &TetMesh) -> Result<Placed, BuildError> {
    let found = (FEWEST_BITS..=WIDE_BITS).map(|bits| on(mesh, bits)).find(|placed| fits(mesh, placed));
    let Some(placed) = found else {
        let finest = on(mesh, WIDE_BITS);
        return match flat_cell(mesh, &finest) {
            Some(cell) => Err(too_thin(mesh, cell)),
            // Two points are in the same place in the input.
            None => Ok(finest),
        };
    };
    let bits = placed.lattice.bits;
    if mesh.tets.is_empty() || bits == FEWEST_BITS || bits + SPARE_BITS > WIDE_BITS {
        return Ok(placed);
    }
    let finer = on(mesh, bits + SPARE_BITS);
    Ok(if fits(mesh, &finer) { finer } else { placed })
}

fn on(mesh: &TetMesh, bits: u32) -> Placed {
    let lattice = lattice(mesh, bits);
    Placed { lattice, positions: mesh.positions.iter().map(|&p| lattice.nearest(p)).collect() }
}

/// Whether every cell is positive or, where there are none, all points are apart.
fn fits(mesh: &TetMesh, placed: &Placed) -> bool {
    if !mesh.tets.is_empty() {
        return flat_cell(mesh, placed).is_none();
    }
    let mut sorted = placed.positions.clone();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

/// The first cell that is not positive.
fn flat_cell(mesh: &TetMesh, placed: &Placed) -> Option<u32> {
    first_flat(&mesh.tets, &placed.positions)
}

/// The first tetrahedron that is not positive.
pub(crate) fn first_flat(tets: &[[u32; 4]], positions: &[[i32; 3]]) -> Option<u32> {
    let flat = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| positions[v as usize]);
        orient3d(a, b, c, d) <= 0
    };
    tets.iter().position(flat).map(|tet| tet as u32)
}

/// The lattice that [`place`] puts the points of a grid on, if it holds each of them exactly.
pub(crate) fn of_grid(grid: &Grid, config: &BuildConfig) -> Option<Lattice> {
    let bits = match (config.position_bits, config.position_tolerance) {
        (Some(bits @ 1..=WIDE_BITS), None) => bits,
        (None, None) => cell_bits(grid)?.max(1),
        _ => return None,
    };
    grid_lattice(grid, bits)
}

/// The lattice of `bits` over the mesh: on the points of a regular grid, else with equal steps along all axes.
fn lattice(mesh: &TetMesh, bits: u32) -> Lattice {
    if let Some(lattice) = mesh.grid.and_then(|grid| grid_lattice(&grid, bits)) {
        return lattice;
    }
    over(&Bounds::of(&mesh.positions), bits)
}

/// The lattice of `bits` over a box, with equal steps along all axes.
pub(crate) fn over(bounds: &Bounds, bits: u32) -> Lattice {
    let largest = bounds.extent().into_iter().fold(0.0, f64::max);
    let step = if largest > 0.0 { largest / f64::from(1_u32 << bits) } else { 1.0 };
    Lattice { origin: bounds.min, step: [step; 3], bits }
}

/// A lattice that holds every point of the grid exactly, with as many steps to a cell as a power of two can be.
fn grid_lattice(grid: &Grid, bits: u32) -> Option<Lattice> {
    let spare = bits.checked_sub(cell_bits(grid)?)?;
    let step = grid.spacing.map(|s| s / f64::from(1_u32 << spare));
    Some(Lattice { origin: grid.origin, step, bits })
}

/// The fewest bits of a lattice that holds every point of the grid exactly.
fn cell_bits(grid: &Grid) -> Option<u32> {
    let cells = grid.dims.iter().map(|n| n.saturating_sub(1)).max().filter(|&n| n > 0)?;
    Some(u32::BITS - (cells - 1).leading_zeros())
}

/// The fewest bits that hold the grid of a mesh exactly, if its cells are positive then.
fn grid_bits(mesh: &TetMesh) -> Option<u32> {
    let bits = cell_bits(&mesh.grid?)?.max(1);
    fits(mesh, &on(mesh, bits)).then_some(bits)
}
