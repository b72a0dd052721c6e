//! Table 1: what the structures cost.

use anyhow::Result;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mt::{Mt, MtStats, stats};

use crate::markdown::{Table, count};
use crate::model::{DataSet, Recipe};
use crate::published;
use crate::published::PublishedMt;

/// An MT and what it costs.
pub struct Row {
    pub data: String,
    pub recipe: Recipe,
    pub stats: MtStats,
    /// Bits that describe shapes, per node; only vertex-based MTs have them.
    pub shape_bits: Option<f64>,
    pub file_bytes: u64,
}

/// The rows of a data set.
pub fn rows(data: &DataSet) -> Result<Vec<Row>> {
    let row = |model: &crate::model::Model| -> Result<Row> {
        let stats = stats(&model.mt)?;
        let nodes = f64::from(stats.updates.max(1));
        let shape_bits = match &model.mt {
            Mt::Vertex(mt) => Some(mt.shape_bits() as f64 / nodes),
            _ => None,
        };
        let file_bytes = encode(&model.mt, &EncodeOptions::default())?.len() as u64;
        Ok(Row { data: data.name.clone(), recipe: model.recipe, stats, shape_bits, file_bytes })
    };
    data.models.iter().map(row).collect()
}

/// Bytes of one MT and of its reference mesh, whoever counted them.
struct Bytes {
    explicit: u64,
    compact: u64,
    indexed: u64,
    adjacency: u64,
}

impl Bytes {
    /// Explicit, its two overheads, compact, its three compression factors.
    fn cells(&self) -> [String; 7] {
        let factor = |a: u64, b: u64| format!("{:.1}", a as f64 / b.max(1) as f64);
        [
            count(self.explicit),
            factor(self.explicit, self.indexed),
            factor(self.explicit, self.adjacency),
            count(self.compact),
            factor(self.indexed, self.compact),
            factor(self.adjacency, self.compact),
            factor(self.explicit, self.compact),
        ]
    }
}

/// The paper's table, with all factors worked out from the bytes.
pub fn storage(rows: &[Row], missing: &[&str]) -> String {
    let heads = [
        "data",
        "MT",
        "explicit",
        "÷ indexed",
        "÷ adjacency",
        "compact",
        "indexed ÷",
        "adjacency ÷",
        "explicit ÷",
        "file",
    ];
    let mut table = Table::new(&heads, 2);
    for theirs in [&published::EDGE, &published::VERTEX] {
        let bytes = Bytes {
            explicit: theirs.explicit_bytes,
            compact: theirs.compact_bytes,
            indexed: published::INDEXED_BYTES,
            adjacency: published::ADJACENCY_BYTES,
        };
        let names = ["*paper:* Smallbucky".to_owned(), format!("*{}*", theirs.kind)];
        table.row(&[&names[..], &bytes.cells()[..]].concat());
    }
    for Row { data, recipe, stats, file_bytes, .. } in rows {
        let bytes = Bytes {
            explicit: stats.explicit_bytes,
            compact: stats.compact_bytes,
            indexed: stats.indexed_bytes,
            adjacency: stats.adjacency_bytes,
        };
        let names = [data.clone(), recipe.name().to_owned()];
        table.row(&[&names[..], &bytes.cells()[..], &[count(*file_bytes)]].concat());
    }
    missing.iter().for_each(|name| table.row(&[(*name).to_owned(), NOT_HERE.to_owned()]));
    table.finish()
}

/// What stands in the place of data that was not there.
pub const NOT_HERE: &str = "not measured: `TETRALOD_DATA` named no folder with it";

/// What the MTs are like: updates, arcs, bits.
pub fn structure(rows: &[Row], missing: &[&str]) -> String {
    let heads = [
        "data",
        "MT",
        "vertices n",
        "tetrahedra",
        "base tets",
        "m ÷ n",
        "tets in u+",
        "tets in u−",
        "arcs a node",
        "depth",
        "shape bits a node",
        "by the paper's code",
        "compact bytes ÷ n",
    ];
    let mut table = Table::new(&heads, 2);
    for theirs in [&published::EDGE, &published::VERTEX] {
        table.row(&published_structure(theirs));
    }
    let one = |x: f64| format!("{x:.1}");
    for Row { data, recipe, stats, shape_bits, .. } in rows {
        let n = f64::from(stats.vertices.max(1));
        table.row(&[
            data.clone(),
            recipe.name().to_owned(),
            count(stats.vertices),
            count(stats.tetrahedra),
            count(stats.mt_tetrahedra - stats.inserted),
            one(stats.mt_tetrahedra as f64 / n),
            one(stats.inserted_per_update()),
            one(stats.removed_per_update()),
            one(stats.arcs_per_update()),
            count(stats.depth),
            shape_bits.map_or(String::new(), one),
            shape_bits.map_or(String::new(), |_| one(bits_by_the_paper(stats))),
            one(stats.compact_bytes as f64 / n),
        ]);
    }
    missing.iter().for_each(|name| table.row(&[(*name).to_owned(), NOT_HERE.to_owned()]));
    table.finish()
}

/// Bits a node for a seed and the tree of T_u: 12, and 6 p − q + 1 where u+ removes p tetrahedra and inserts q [§5].
fn bits_by_the_paper(stats: &MtStats) -> f64 {
    12.0 + 6.0 * stats.removed_per_update() - stats.inserted_per_update() + 1.0
}

/// The explicit structure by the paper's formula: 24 n + 28 m bytes [§3].
pub fn bytes_by_the_paper(vertices: u64, mt_tetrahedra: u64) -> u64 {
    24 * vertices + 28 * mt_tetrahedra
}

fn published_structure(theirs: &PublishedMt) -> [String; 13] {
    let n = published::VERTICES;
    let known = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.0}"));
    [
        "*paper:* Smallbucky".to_owned(),
        format!("*{}*", theirs.kind),
        count(n),
        count(published::TETRAHEDRA),
        String::new(),
        String::new(),
        known(Some(theirs.inserted_per_update)),
        known(theirs.removed_per_update),
        known(theirs.arcs_per_update),
        String::new(),
        known(theirs.shape_bits),
        known(theirs.shape_bits),
        format!("{:.1}", theirs.compact_bytes as f64 / n as f64),
    ]
}
