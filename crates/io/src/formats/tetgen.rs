//! TetGen's meshes: points in a `.node` file, tetrahedra in the `.ele` file of the same name.
//!
//! Attributes of points become fields, those of tetrahedra (regions) fields at cells. Markers of the boundary are left out. By
//! <https://wias-berlin.de/software/tetgen/fformats.html>.

use std::path::Path;

use crate::ReadOptions;
use crate::beside::FilesOf;
use crate::cell_types::TETRAHEDRON;
use crate::error::{At, ReadError, ReadReason, in_file};
use crate::fields::component_of;
use crate::formats::draft::Draft;
use crate::formats::medit_cells;
use crate::scanner::{Scanner, parsed};
use tetralod::mesh::TetMesh;

/// What the survey of a mesh calls the format.
pub(crate) const NAME: &str = "tetgen";

/// The endings of the names of files that belong to the one with the points; all but the first say nothing that is read.
pub(crate) const BESIDE_NODES: [&str; 6] = ["ele", "face", "edge", "neigh", "smesh", "poly"];

/// Reads the two files of which one is given.
pub(crate) fn read(files: &FilesOf<'_>, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let [nodes, cells] = ["node", "ele"].map(|ending| files.given.with_extension(ending));
    let name = |path: &Path| path.display().to_string();
    let (node_bytes, cell_bytes) = (files.load_one(&nodes)?, files.load_one(&cells)?);
    let mut draft = Draft::new(options);
    let mut file = Scanner::with_comments(&node_bytes);
    let first = read_nodes(&mut file, &mut draft);
    let first = first.at(|| file.line_number()).map_err(|error| in_file(error, &name(&nodes)))?;
    let mut file = Scanner::with_comments(&cell_bytes);
    let read = read_cells(&mut file, &mut draft, first);
    read.at(|| file.line_number()).map_err(|error| in_file(error, &name(&cells)))?;
    draft.finish().in_file(&name(&cells))
}

/// The numbers of a header; those that are left out at its end are as the format has them.
fn header<const N: usize>(file: &mut Scanner<'_>, defaults: [usize; N]) -> Result<[usize; N], ReadReason> {
    let row = file.row()?.ok_or(ReadReason::Truncated { needed: 1, found: 0 })?;
    let mut numbers = defaults;
    for (number, word) in numbers.iter_mut().zip(row) {
        *number = parsed(word)?;
    }
    Ok(numbers)
}

/// The next row, which has at least `needed` words.
fn row<'a>(file: &mut Scanner<'a>, needed: usize) -> Result<Vec<&'a str>, ReadReason> {
    let row = file.row()?.unwrap_or_default();
    if row.len() < needed {
        return Err(ReadReason::Truncated { needed: needed as u64, found: row.len() as u64 });
    }
    Ok(row)
}

/// Reads points; returns the number of the first one.
fn read_nodes(file: &mut Scanner<'_>, draft: &mut Draft<'_>) -> Result<i64, ReadReason> {
    let [count, dimension, attributes, markers] = header(file, [0, 3, 0, 0])?;
    if dimension != 3 {
        let what = format!("points in {dimension} dimensions");
        return Err(ReadReason::unsupported(what, "give points in three"));
    }
    let words = needed(4, attributes)?;
    let (mut first, mut has_more) = (0, false);
    let mut values = Vec::new();
    for i in 0..count {
        let row = row(file, words)?;
        let number: i64 = parsed(row[0])?;
        if i == 0 {
            first = number;
        }
        if i64::try_from(i).ok().and_then(|i| i.checked_add(first)) != Some(number) {
            return Err(ReadReason::Syntax(format!("point {number} is not in order")));
        }
        for word in &row[1..4] {
            draft.coordinates.push(parsed(word)?);
        }
        for word in &row[4..words] {
            values.push(parsed(word)?);
        }
        has_more |= row.len() > words + markers;
    }
    if has_more {
        draft.notes.push("rows of points have more numbers than the header says; these are left out".into());
    }
    for i in 0..attributes.min(values.len()) {
        let of_one = component_of(&values, i, attributes);
        draft.at_points(&format!("attribute_{}", i + 1), 1, false, || Ok(of_one))?;
    }
    Ok(first)
}

/// How many words a row has with these attributes.
fn needed(others: usize, attributes: usize) -> Result<usize, ReadReason> {
    others.checked_add(attributes).ok_or(ReadReason::TooLarge { what: "attributes".into(), limit: u64::MAX })
}

fn read_cells(file: &mut Scanner<'_>, draft: &mut Draft<'_>, first: i64) -> Result<(), ReadReason> {
    let [count, points, attributes] = header(file, [0, 4, 0])?;
    if points != 4 && points != 10 {
        return Err(ReadReason::Syntax(format!("tetrahedra of {points} points")));
    }
    let words = needed(1 + points, attributes)?;
    let (mut cells, mut values) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let row = row(file, words)?;
        for word in &row[1..=points] {
            cells.push(parsed::<i64>(word)?.saturating_sub(first));
        }
        for word in &row[1 + points..words] {
            values.push(parsed(word)?);
        }
    }
    add_cells(draft, &cells, points);
    for i in 0..attributes.min(values.len()) {
        let of_one = component_of(&values, i, attributes);
        draft.at_cells(&format!("region_{}", i + 1), 1, false, || Ok(of_one))?;
    }
    Ok(())
}

/// Adds tetrahedra of four points, or of ten, the order of whose last six follows from their places.
fn add_cells(draft: &mut Draft<'_>, cells: &[i64], points: usize) {
    let places = medit_cells::places(QUADRATIC);
    let order =
        (points > 4).then(|| medit_cells::order_by_places(&places, cells, &draft.coordinates)).flatten();
    if points > 4 && order.is_none() && !cells.is_empty() {
        draft.notes.push("points in the middle of edges are left out: it is not clear of which edges".into());
    }
    for cell in cells.chunks_exact(points) {
        match &order {
            Some(order) => draft.add_cell(QUADRATIC, order.iter().map(|&p| cell[p])),
            None => draft.add_cell(TETRAHEDRON, cell[..4].iter().copied()),
        }
    }
}

/// VTK's type of tetrahedra of ten points.
const QUADRATIC: i64 = 24;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellData;

    const NODES: &str =
        "# points\n5 3 1 1\n1 0 0 0 10 1\n2 1 0 0 20 1\n3 0 1 0 30 1\n4 0 0 1 40 0\n5 0 0 -1 50 0\n";
    const CELLS: &str = "2 4 1\n1 1 2 3 4 7\n2 1 3 2 5 8\n# made by hand\n";

    fn read_both(nodes: &str, cells: &str) -> Result<TetMesh, ReadReason> {
        let options = ReadOptions { cells: CellData::Values, ..ReadOptions::default() };
        let mut draft = Draft::new(&options);
        let first = read_nodes(&mut Scanner::with_comments(nodes.as_bytes()), &mut draft)?;
        read_cells(&mut Scanner::with_comments(cells.as_bytes()), &mut draft, first)?;
        draft.finish()
    }

    #[test]
    fn points_cells_and_attributes() {
        let mesh = read_both(NODES, CELLS).unwrap();
        assert_eq!((mesh.positions.len(), &mesh.tets), (5, &vec![[0, 1, 2, 3], [0, 2, 1, 4]]));
        assert_eq!(mesh.fields[0].values, [10., 20., 30., 40., 50.]);
        assert_eq!(mesh.cell_fields[0].values, [7., 8.]);
    }

    #[test]
    fn counts_that_are_left_out_are_those_of_the_format() {
        let nodes = "# made\n\n 4  3\n0 0 0 0\n1 1 0 0 # a remark\n2 0 1 0\n3 0 0 1 9\n";
        let mesh = read_both(nodes, "1\n0 0 1 2 3\n").unwrap();
        assert_eq!((mesh.positions.len(), &mesh.tets), (4, &vec![[0, 1, 2, 3]]));
        assert_eq!(mesh.notes.len(), 1, "{:?}", mesh.notes);
        let alone = nodes.replace(" 4  3", "4").replace(" 9\n", "\n");
        let mesh = read_both(&alone, "1 4\n0 0 1 2 3\n").unwrap();
        assert!(mesh.fields.is_empty() && mesh.notes.is_empty());
        assert!(
            read_both(&alone, "1 4 1\n0 0 1 2 3\n").unwrap_err().to_string().contains("6 needed, 5 left")
        );
    }

    #[test]
    fn tetrahedra_of_ten_points_keep_them() {
        let corners = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]];
        let edges = [[2, 3], [0, 2], [0, 1], [1, 2], [1, 3], [0, 3]];
        let middle = |[a, b]: [usize; 2]| [0, 1, 2].map(|i| (corners[a][i] + corners[b][i]) / 2);
        let rows = corners.into_iter().chain(edges.map(middle)).enumerate();
        let rows: String = rows.map(|(i, [x, y, z])| format!("{} {x} {y} {z} {i}\n", i + 1)).collect();
        let cells = "1 10 1\n1 1 2 3 4 5 6 7 8 9 10 7\n";
        let mesh = read_both(&format!("10 3 1 0\n{rows}"), cells).unwrap();
        assert_eq!((mesh.tets.len(), mesh.fields[0].values[9], mesh.cell_fields[0].values[7]), (8, 9.0, 7.0));
        tetralod::mesh::check(&mesh).unwrap();
        let bad = rows.replace("6 0 1 0", "6 1 0 0");
        let mesh = read_both(&format!("10 3 1 0\n{bad}"), cells).unwrap();
        assert_eq!((mesh.tets.len(), mesh.notes.len()), (1, 1));
    }

    #[test]
    fn damaged_files_are_refused() {
        assert!(
            read_both(&NODES.replace("\n3 0", "\n9 0"), CELLS).unwrap_err().to_string().contains("in order")
        );
        let far = CELLS.replace("3 2 5 8", "3 2 6 8");
        assert!(matches!(read_both(NODES, &far), Err(ReadReason::MissingPoint { cell: 1, point: 5, .. })));
        assert!(matches!(read_both(NODES, "9000000000 4 0"), Err(ReadReason::Truncated { .. })));
        (0..NODES.len()).for_each(|length| drop(read_both(&NODES[..length], CELLS)));
        (0..CELLS.len()).for_each(|length| drop(read_both(NODES, &CELLS[..length])));
    }
}
