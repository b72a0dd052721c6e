//! How much memory a build needs: known before it begins, from counts alone.

use crate::options::BuildOptions;
use tetralod_build::memory_needed;
use tetralod_io::Survey;

/// The most memory that is relied on: a wasm module has 2^32 bytes, of which the allocator cannot use all.
pub const LARGEST_MEMORY: u64 = (1 << 32) - (1 << 28);

/// Bytes that are taken before any file.
const FIXED: u64 = 4 << 20;

/// The memory that a build needs at most, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Forecast {
    /// While the files are read.
    pub reading: u64,
    /// While the MT is built.
    pub building: u64,
}

impl Forecast {
    /// For `steps` files of so many bytes together, each like `survey`.
    pub fn of(survey: &Survey, files: u64, steps: u64, options: &BuildOptions) -> Self {
        let &Survey { points, cells, .. } = survey;
        let fields = fields(survey, options).saturating_mul(steps.max(1));
        let values = points.saturating_mul(8).saturating_mul(fields);
        // Coordinates and indices are decoded as 64 bits each before they become those of the mesh.
        let mesh = points.saturating_mul(24).saturating_add(cells.saturating_mul(16));
        let mut decoding = points.saturating_mul(24).max(cells.saturating_mul(72));
        if ["nrrd", "metaimage"].contains(&survey.format) {
            // All values of a sample are unpacked and decoded, whichever of them are wanted.
            decoding = decoding.max(points.saturating_mul(16).saturating_mul(survey.fields.len() as u64));
        }
        let reading = [files, mesh, values, decoding, FIXED];
        let construction = options.config.construction;
        let building = [memory_needed(construction, points, cells, fields), FIXED];
        let sum = |all: &[u64]| all.iter().fold(0_u64, |sum, bytes| sum.saturating_add(*bytes));
        Self { reading: sum(&reading), building: sum(&building) }
    }

    /// The larger of both.
    pub fn peak(&self) -> u64 {
        self.reading.max(self.building)
    }
}

/// How many fields are read of a file.
fn fields(survey: &Survey, options: &BuildOptions) -> u64 {
    let config = &options.config;
    let at_cells = survey.cell_fields.iter().filter(|_| options.cells);
    let all = survey.fields.iter().chain(at_cells);
    let wanted = match () {
        () if config.all_fields => all.count(),
        () if config.fields.is_empty() => 1,
        () => all.filter(|field| config.fields.iter().any(|name| field.answers_to(name))).count(),
    };
    // Labels have a value for each cell.
    let labels = config.preserve.len() * survey.cells.div_ceil(survey.points.max(1)) as usize;
    (wanted.max(1) + labels) as u64
}
