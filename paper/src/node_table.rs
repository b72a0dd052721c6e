//! The table of both node codes: see [`crate::node_code`].

use tetralod::mt::TreeExceptions;

use crate::markdown::{Table, count};
use crate::node_code::Trees;
use crate::table1::Row;

/// Both codes of all data sets.
pub fn table(rows: &[Row]) -> String {
    let heads = [
        "data",
        "MT",
        "tets in u−",
        "tets in u+",
        "T_u, ours",
        "T_u, §5, 32",
        "T_u, §5, 64",
        "removers",
        "compact, ours",
        "compact, §5, 32",
        "compact, §5, 64",
        "exceptions, 32",
        "exceptions, 64",
        "over 32 neighbours",
        "most neighbours",
    ];
    let mut table = Table::new(&heads, 2);
    let one = |x: f64| format!("{x:.1}");
    for row in rows {
        let (Some(codes), Some(shape_bits)) = (&row.codes, row.shape_bits) else { continue };
        let [narrow, wide] = &codes.trees;
        table.row(&[
            row.data.clone(),
            row.recipe.name().to_owned(),
            one(row.stats.removed_per_update()),
            one(row.stats.inserted_per_update()),
            one(row.per_node(shape_bits - codes.remover_bits)),
            one(row.per_node(narrow.code_bits)),
            one(row.per_node(wide.code_bits)),
            one(row.per_node(codes.remover_bits)),
            count(row.stats.compact_bytes),
            count(narrow.bytes),
            count(wide.bytes),
            exceptions(narrow),
            exceptions(wide),
            count(codes.many_neighbors),
            count(codes.most_neighbors),
        ]);
    }
    table.finish()
}

fn exceptions(trees: &Trees) -> String {
    let TreeExceptions { faces, given_up, trees: streams } = trees.exceptions;
    let parts = [faces, given_up, streams].map(count).join(" + ");
    format!("{parts}: {} bytes", count(trees.exception_bytes))
}
