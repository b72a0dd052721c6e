//! Regular grids of which boxes of values are read: no more of them is in memory.

use std::fmt::Debug;
use std::ops::Range;

use crate::error::{At, ReadError, ReadReason};
use tetralod::mesh::{Grid, TetMesh};

/// Most values of a field that are read at once where all of them pass by.
const MOST_IN_SLAB: u64 = 1 << 20;

/// The points in a box of a grid.
pub(super) type Points = [Range<u32>; 3];

/// Where the values of a grid are.
pub(super) trait Boxes: Debug {
    /// Layers of points across z that are best read together, if their thickness matters.
    fn layers(&self) -> u32 {
        1
    }

    /// The values of a field, by its number, at the points in a box, x fastest.
    fn values(&self, field: usize, points: &Points) -> Result<Vec<f64>, ReadError>;
}

/// A volume on a regular grid of which boxes are read.
#[derive(Debug)]
pub struct GridInParts {
    mesh: TetMesh,
    grid: Grid,
    boxes: Box<dyn Boxes>,
}

impl GridInParts {
    /// A grid alone, whose fields have their values elsewhere.
    pub(super) fn new(mut mesh: TetMesh, grid: Grid, boxes: Box<dyn Boxes>) -> Self {
        mesh.grid = Some(grid);
        mesh.fields.iter_mut().for_each(|field| field.values = Vec::new());
        Self { mesh, grid, boxes }
    }

    /// The grid alone, with the fields without values.
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// Layers of points across z that are best read together.
    pub fn layers(&self) -> u32 {
        let [nx, ny, nz] = self.grid.dims.map(u64::from);
        let fit = (MOST_IN_SLAB / (nx * ny).max(1)).clamp(1, nz) as u32;
        let best = self.boxes.layers().max(1);
        // As many of those as fit, or one that does not.
        (fit / best).max(1) * best
    }

    /// The finite values of a field, by its number, at the points in a box, x fastest.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn values(&self, field: usize, points: [Range<u32>; 3]) -> Result<Vec<f64>, ReadError> {
        let values = self.boxes.values(field, &points)?;
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            let [nx, ny, _] = self.grid.dims.map(u64::from);
            let [across, rows, _] = points.clone().map(|range| range.len());
            let [x, y, z] = [at % across, at / across % rows, at / (across * rows)];
            let [x, y, z] = [(x, 0), (y, 1), (z, 2)].map(|(at, k)| at as u64 + u64::from(points[k].start));
            let array = self.mesh.fields[field].name.clone();
            return Err(ReadReason::NotFinite { array, point: x + nx * (y + ny * z) }).at(String::new);
        }
        Ok(values)
    }
}

/// What a box has of values that `read` reads for points that follow one another, x fastest, so many for each point.
pub(super) fn in_box<E>(
    [nx, ny, _]: [u32; 3],
    points: &Points,
    each: usize,
    mut read: impl FnMut(Range<u64>) -> Result<Vec<f64>, E>,
) -> Result<Vec<f64>, E> {
    let [nx, ny] = [nx, ny].map(u64::from);
    let [xs, ys, zs] = points.clone().map(|range| u64::from(range.start)..u64::from(range.end));
    let in_rows = |rows: Range<u64>| rows.start * nx..rows.end * nx;
    if xs == (0..nx) && ys == (0..ny) {
        return read(in_rows(zs.start * ny..zs.end * ny));
    }
    let count: usize = points.iter().map(Range::len).product();
    let mut values = Vec::with_capacity(each * count);
    let of_row = |at: u64| each * at as usize;
    for z in zs {
        let rows = read(in_rows(z * ny + ys.start..z * ny + ys.end))?;
        let rows = rows.chunks_exact(of_row(nx).max(1));
        rows.for_each(|row| values.extend_from_slice(&row[of_row(xs.start)..of_row(xs.end)]));
    }
    Ok(values)
}
