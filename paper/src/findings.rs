//! What the page is made of.

use anyhow::Result;

use crate::figure8::{self, Curves};
use crate::figures::{self, AtZero, Boxed, Pair};
use crate::model::{DataSet, Recipe};
use crate::own::Own;
use crate::published;
use crate::table1::Row;

/// All results.
pub struct Findings {
    pub rows: Vec<Row>,
    /// Data sets that were not there.
    pub missing: Vec<&'static str>,
    pub figure_6: Pair,
    pub figure_7: Pair,
    pub uniform: Curves,
    pub variable: Curves,
    pub own: Vec<Own>,
    pub boxes: Vec<Boxed>,
    pub at_zero: Vec<AtZero>,
    pub scan: Option<Scan>,
}

/// Figures 6 to 8 of a volume that was measured, not computed.
pub struct Scan {
    pub name: &'static str,
    pub figure_6: Pair,
    pub figure_7: Pair,
    pub uniform: Curves,
    pub variable: Curves,
    pub boxes: Vec<Boxed>,
    pub at_zero: Vec<AtZero>,
}

impl Scan {
    pub fn of(name: &'static str, data: &DataSet) -> Result<Self> {
        let inserted = &data.model(Recipe::Insert).mt;
        let figure_6 = figures::around_isovalue(inserted, 0.001, published::FIGURE_6.uniform_facets)?;
        Ok(Self {
            name,
            figure_7: figures::in_an_octant(&data.model(Recipe::Edge).mt, figure_6.isovalue)?,
            uniform: figure8::curves(data, None)?,
            variable: figure8::curves(data, Some(figure_6.isovalue))?,
            boxes: figures::boxes(data)?,
            at_zero: figures::at_zero(data)?,
            figure_6,
        })
    }
}
