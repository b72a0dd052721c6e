//! TetGen's meshes: points in a `.node` file, tetrahedra in the `.ele` file of the same name.
//!
//! Attributes of points become fields, those of tetrahedra (regions) fields at cells. Of tetrahedra of the second order the four
//! corners are kept.

use std::path::Path;

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::fields::component_of;
use crate::io::formats::draft::Draft;
use crate::io::formats::scanner::Scanner;
use crate::io::{ReadOptions, in_file, load};
use crate::mesh::TetMesh;

/// Reads the two files of which `path` is one.
pub(in crate::io) fn read(path: &Path, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let [nodes, cells] = ["node", "ele"].map(|ending| path.with_extension(ending));
    let name = |path: &Path| path.display().to_string();
    let (node_bytes, cell_bytes) = (load(&nodes)?, load(&cells)?);
    let mut draft = Draft::new(options);
    let mut file = Scanner::with_comments(&node_bytes);
    let first = read_nodes(&mut file, &mut draft);
    let first = first.at(|| file.line_number()).map_err(|error| in_file(error, &name(&nodes)))?;
    let mut file = Scanner::with_comments(&cell_bytes);
    let read = read_cells(&mut file, &mut draft, first);
    read.at(|| file.line_number()).map_err(|error| in_file(error, &name(&cells)))?;
    draft.finish().at(String::new).map_err(|error| in_file(error, &name(&cells)))
}

/// Reads points; returns the number of the first one.
fn read_nodes(file: &mut Scanner<'_>, draft: &mut Draft<'_>) -> Result<i64, ReadReason> {
    let [count, dimension, attributes, markers] = file.numbers::<usize, 4>()?;
    if dimension != 3 {
        let what = format!("points in {dimension} dimensions");
        return Err(ReadReason::Unsupported { what, remedy: "give points in three".into() });
    }
    let mut first = 0;
    let mut values = Vec::new();
    for i in 0..count {
        let number: i64 = file.number()?;
        if i == 0 {
            first = number;
        }
        if i64::try_from(i).ok().and_then(|i| i.checked_add(first)) != Some(number) {
            return Err(ReadReason::Syntax(format!("point {number} is not in order")));
        }
        draft.coordinates.extend(file.numbers::<f64, 3>()?);
        for _ in 0..attributes {
            values.push(file.number::<f64>()?);
        }
        for _ in 0..markers {
            file.number::<f64>()?;
        }
    }
    for i in 0..attributes.min(values.len()) {
        let of_one = component_of(&values, i, attributes);
        draft.at_points(&format!("attribute_{}", i + 1), 1, of_one, false)?;
    }
    Ok(first)
}

fn read_cells(file: &mut Scanner<'_>, draft: &mut Draft<'_>, first: i64) -> Result<(), ReadReason> {
    let [count, points, attributes] = file.numbers::<usize, 3>()?;
    if points != 4 && points != 10 {
        return Err(ReadReason::Syntax(format!("tetrahedra of {points} points")));
    }
    let mut values = Vec::new();
    for _ in 0..count {
        file.number::<i64>()?;
        let corners = file.numbers::<i64, 4>()?.map(|point| point.saturating_sub(first));
        draft.add_cell(10, corners);
        for _ in 4..points {
            file.number::<i64>()?;
        }
        for _ in 0..attributes {
            values.push(file.number::<f64>()?);
        }
    }
    for i in 0..attributes.min(values.len()) {
        let of_one = component_of(&values, i, attributes);
        draft.at_cells(&format!("region_{}", i + 1), 1, of_one, false)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::CellData;

    const OPTIONS: ReadOptions = ReadOptions { fields: None, first: false, cells: CellData::Values, step: 0 };
    const NODES: &str =
        "# points\n5 3 1 1\n1 0 0 0 10 1\n2 1 0 0 20 1\n3 0 1 0 30 1\n4 0 0 1 40 0\n5 0 0 -1 50 0\n";
    const CELLS: &str = "2 4 1\n1 1 2 3 4 7\n2 1 3 2 5 8\n# made by hand\n";

    fn read_both(nodes: &str, cells: &str) -> Result<TetMesh, ReadReason> {
        let mut draft = Draft::new(&OPTIONS);
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
