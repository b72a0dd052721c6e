//! How to build: the options of all methods.

use crate::method::Construction;
use tetralod::mesh::CellsToPoints;
use tetralod::mt::MtKind;

/// How to build.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildConfig {
    /// The kind of MT and how it is built.
    pub construction: Construction,
    /// Names of the fields to keep, in this order; a vector's name means its components. Of a time series all steps are
    /// kept. If empty, the first field that is no component and does not number something or say where it is, by its name.
    pub fields: Vec<String>,
    /// Keep all fields but those that follow from components, as the lengths of vectors; those that are named come first.
    pub all_fields: bool,
    /// Bits of the position lattice, 1 to 30. If neither these nor a tolerance are given: 16 where that keeps every cell
    /// positive, else as few as do, and two more to spare. No side of the domain is longer than 2^bits steps.
    pub position_bits: Option<u32>,
    /// How far the lattice may move a point, in model units: as few bits are taken as keep within it, and every cell
    /// positive.
    pub position_tolerance: Option<f64>,
    /// How finely fields are kept. Fields of integers whose range fits 24 bits are exact unless they are named in
    /// [`BuildConfig::precision_of`].
    pub field_precision: FieldPrecision,
    /// How finely fields, or vectors, of these names are kept.
    pub precision_of: Vec<(String, FieldPrecision)>,
    /// Names of fields, or vectors, of which the exact values are kept as well.
    pub lossless: Vec<String>,
    /// Keep the exact values of all fields.
    pub all_lossless: bool,
    /// The displacement of the boundary that counts as much as an error of the field's whole range, as a fraction
    /// of the domain's diagonal; not negative. With 0.2, an error of 1 % allows the boundary to move by 0.2 % of the
    /// diagonal.
    pub displacement: f64,
    /// The displacement that counts as much, in lengths of the shortest edge of the reference mesh at each place, where that is less than
    /// [`BuildConfig::displacement`]; infinite where cells do not matter. With 10, an error of 1 % allows the boundary to move by a tenth of
    /// such an edge.
    pub displacement_edges: f64,
    /// No update makes a cell with a smaller dihedral angle than so many degrees, 0 to 70, unless one of the cells that it takes the
    /// place of had a smaller one still. Not by [`Method::Insert`](crate::Method::Insert).
    pub min_dihedral: Option<f64>,
    /// From so many degrees on, 1 to 90, two flat parts of the boundary meet at a crease that stays where it is; 60 if none.
    /// Not by [`Method::Insert`](crate::Method::Insert).
    pub feature_angle: Option<f64>,
    /// Names of labels, integers at cells or points: the surfaces between cells of different labels stay the sets of points that they are.
    /// A label at points is that of a cell, the least one at its corners. Only by [`Method::Decimate`](crate::Method::Decimate) with [`BuildCriterion::HalfEdge`](crate::BuildCriterion::HalfEdge).
    pub preserve: Vec<String>,
    /// How far, in model units, curved parts of these surfaces may move to have fewer triangles; 0 if they stay. Where a surface ends, at
    /// the boundary or at a third region, it stays.
    pub preserve_within: f64,
    /// Places of points of the mesh that stay in all meshes, in model units. Not by [`Method::Insert`](crate::Method::Insert).
    pub keep_points: Vec<[f64; 3]>,
    /// log2 of the updates that the blocks of the MT's file, and so pages of a half-edge MT, are going to have, 4 to 16: within a block of
    /// an edge-based MT updates are numbered so that they take few bits.
    pub block_bits: u32,
}

impl Default for BuildConfig {
    /// The default configuration of the default kind, [`MtKind::HalfEdge`].
    fn default() -> Self {
        Self::of(MtKind::HalfEdge)
    }
}

impl BuildConfig {
    /// The default configuration for a kind of MT.
    pub fn of(kind: MtKind) -> Self {
        Self {
            construction: Construction::default_for(kind),
            fields: Vec::new(),
            all_fields: false,
            position_bits: None,
            position_tolerance: None,
            field_precision: FieldPrecision::Bits(16),
            precision_of: Vec::new(),
            lossless: Vec::new(),
            all_lossless: false,
            displacement: 0.2,
            displacement_edges: 10.0,
            min_dihedral: None,
            feature_angle: None,
            preserve: Vec::new(),
            preserve_within: 0.0,
            keep_points: Vec::new(),
            block_bits: kind.usual_block_bits(),
        }
    }

    /// What fields at cells become if they are to become fields at points, and unless they are to be averaged across regions: for each region
    /// apart if there are any, and the kind can keep that.
    #[doc(hidden)]
    pub fn cells_to_points(&self, to_points: bool, across_regions: bool) -> CellsToPoints {
        let keeps_sides = self.construction.kind() == MtKind::HalfEdge && !self.preserve.is_empty();
        match (to_points, keeps_sides && !across_regions) {
            (false, _) => CellsToPoints::No,
            (true, false) => CellsToPoints::AcrossRegions,
            (true, true) => CellsToPoints::ByRegion,
        }
    }
}

/// The precision of a field's values; the loss remains as an error at full resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldPrecision {
    /// By a lattice of so many bits, 1 to 24.
    Bits(u32),
    /// By as few bits as keep each value within so many units of the field.
    Units(f64),
    /// By as few bits as keep each value within this fraction of the field's range.
    Fraction(f64),
}
