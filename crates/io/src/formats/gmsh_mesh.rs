//! What has been read of a Gmsh file.

use std::collections::HashMap;

use crate::ReadOptions;
use crate::formats::draft::Draft;
use crate::formats::gmsh_layout::Layout;
use crate::formats::gmsh_views::{Head, View};

/// What was read so far.
pub(super) struct Mesh<'a> {
    pub layout: Option<Layout>,
    pub draft: Draft<'a>,
    /// The index of each node, by its tag.
    pub nodes: HashMap<i64, usize>,
    /// The tags of the cells that are kept.
    pub cell_tags: Vec<i64>,
    pub entities: Vec<f64>,
    pub physical: Vec<f64>,
    /// The physical group of each volume, by its tag, if it has one; none if no volume has one.
    pub groups: HashMap<i64, Option<i64>>,
    /// The geometric entity that a partition of a volume is of, and its physical group.
    pub partitions: HashMap<i64, (i64, Option<i64>)>,
    /// The tags of the nodes of each element with a volume, if views at nodes of elements need them.
    pub element_nodes: Option<HashMap<i64, Vec<i64>>>,
    pub heads: Vec<Head>,
    pub views: Vec<View>,
    /// The names of physical groups of volumes.
    pub names: Vec<(i64, String)>,
    /// Sections that are left out.
    pub skipped: Vec<String>,
}

impl<'a> Mesh<'a> {
    /// Nothing yet.
    pub fn new(options: &'a ReadOptions) -> Self {
        Self {
            layout: None,
            draft: Draft::new(options),
            nodes: HashMap::new(),
            cell_tags: Vec::new(),
            entities: Vec::new(),
            physical: Vec::new(),
            groups: HashMap::new(),
            partitions: HashMap::new(),
            element_nodes: None,
            heads: Vec::new(),
            views: Vec::new(),
            names: Vec::new(),
            skipped: Vec::new(),
        }
    }
}
