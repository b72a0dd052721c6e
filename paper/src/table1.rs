//! Table 1: what the structures cost.

use anyhow::Result;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mt::{Mt, MtStats, stats};

use crate::markdown::{Table, count};
use crate::model::{DataSet, Recipe};
use crate::node_code::NodeCodes;
use crate::published;
use crate::published::PublishedMt;

/// An MT and what it costs.
pub struct Row {
    pub data: String,
    pub recipe: Recipe,
    pub stats: MtStats,
    /// Bits of all nodes that describe shapes; only vertex-based MTs have them.
    pub shape_bits: Option<u64>,
    /// Bits of these nodes in the paper's code; only of vertex-based MTs whose tetrahedra have no errors of their own.
    pub codes: Option<NodeCodes>,
    pub file_bytes: u64,
}

impl Row {
    /// Bits per node of one of the numbers of all nodes.
    pub fn per_node(&self, bits: u64) -> f64 {
        bits as f64 / f64::from(self.stats.updates.max(1))
    }
}

/// The rows of a data set.
pub fn rows(data: &DataSet) -> Result<Vec<Row>> {
    let row = |model: &crate::model::Model| -> Result<Row> {
        let stats = stats(&model.mt)?;
        let shape_bits = match &model.mt {
            Mt::Vertex(mt) => Some(mt.shape_bits()),
            _ => None,
        };
        let codes = NodeCodes::of(&model.mt)?;
        let file_bytes = encode(&model.mt, &EncodeOptions::default())?.len() as u64;
        Ok(Row { data: data.name.clone(), recipe: model.recipe, stats, shape_bits, codes, file_bytes })
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
    for Row { data, recipe, stats, codes, file_bytes, .. } in rows {
        let bytes = |compact| Bytes {
            explicit: stats.explicit_bytes,
            compact,
            indexed: stats.indexed_bytes,
            adjacency: stats.adjacency_bytes,
        };
        let names = [data.clone(), recipe.name().to_owned()];
        let ours = bytes(stats.compact_bytes).cells();
        table.row(&[&names[..], &ours[..], &[count(*file_bytes)]].concat());
        if let Some(trees) = codes.as_ref().map(NodeCodes::of_the_paper) {
            let names = [data.clone(), in_the_papers_code(*recipe)];
            table.row(&[&names[..], &bytes(trees.bytes).cells()[..]].concat());
        }
    }
    missing.iter().for_each(|name| table.row(&[(*name).to_owned(), NOT_HERE.to_owned()]));
    table.finish()
}

fn in_the_papers_code(recipe: Recipe) -> String {
    format!("{}; nodes of §5", recipe.name())
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
        "compact bytes ÷ n",
    ];
    let mut table = Table::new(&heads, 2);
    for theirs in [&published::EDGE, &published::VERTEX] {
        table.row(&published_structure(theirs));
    }
    let one = |x: f64| format!("{x:.1}");
    for row in rows {
        let n = f64::from(row.stats.vertices.max(1));
        let cells = |name: String, shape_bits: Option<u64>, compact: u64| {
            let stats = &row.stats;
            [
                row.data.clone(),
                name,
                count(stats.vertices),
                count(stats.tetrahedra),
                count(stats.mt_tetrahedra - stats.inserted),
                one(stats.mt_tetrahedra as f64 / n),
                one(stats.inserted_per_update()),
                one(stats.removed_per_update()),
                one(stats.arcs_per_update()),
                count(stats.depth),
                shape_bits.map_or(String::new(), |bits| one(row.per_node(bits))),
                one(compact as f64 / n),
            ]
        };
        table.row(&cells(row.recipe.name().to_owned(), row.shape_bits, row.stats.compact_bytes));
        if let Some(codes) = &row.codes {
            let trees = codes.of_the_paper();
            let bits = trees.code_bits + codes.remover_bits;
            table.row(&cells(in_the_papers_code(row.recipe), Some(bits), trees.bytes));
        }
    }
    missing.iter().for_each(|name| table.row(&[(*name).to_owned(), NOT_HERE.to_owned()]));
    table.finish()
}

/// The explicit structure by the paper's formula: 24 n + 28 m bytes [§3].
pub fn bytes_by_the_paper(vertices: u64, mt_tetrahedra: u64) -> u64 {
    24 * vertices + 28 * mt_tetrahedra
}

fn published_structure(theirs: &PublishedMt) -> [String; 12] {
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
        format!("{:.1}", theirs.compact_bytes as f64 / n as f64),
    ]
}
