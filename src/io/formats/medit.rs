//! Medit's meshes in text (`.mesh`), with solutions at vertices in the `.sol` file of the same name, if there is one.
//!
//! References become the field `ref` at cells. What has no volume is left out.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::formats::draft::Draft;
use crate::io::formats::scanner::Scanner;
use crate::io::{Beside, ReadOptions, in_file};
use crate::mesh::TetMesh;

/// The first word of every file.
pub(super) const FIRST: &str = "MeshVersionFormatted";

/// The cells with a volume: VTK's type, and which of Medit's vertices is each of VTK's.
pub(super) const CELLS: [(&str, i64, &[usize]); 5] = [
    ("Tetrahedra", 10, &[0, 1, 2, 3]),
    ("Hexahedra", 12, &[0, 1, 2, 3, 4, 5, 6, 7]),
    ("Prisms", 13, &[0, 1, 2, 3, 4, 5]),
    ("Pentahedra", 13, &[0, 1, 2, 3, 4, 5]),
    ("Pyramids", 14, &[0, 1, 2, 3, 4]),
];

/// Reads a mesh, and the solution in the file called `solution` beside it.
pub(super) fn read(
    bytes: &[u8],
    solution: &str,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<TetMesh, ReadError> {
    let mut file = Scanner::with_comments(bytes);
    let mut draft = Draft::new(options);
    let read = read_mesh(&mut file, &mut draft);
    read.at(|| file.line_number())?;
    // A mesh need not have one.
    if let Ok(bytes) = beside(solution) {
        let mut file = Scanner::with_comments(&bytes);
        let read = read_solution(&mut file, &mut draft);
        read.at(|| file.line_number()).map_err(|error| in_file(error, solution))?;
    }
    draft.finish().at(String::new)
}

fn read_mesh(file: &mut Scanner<'_>, draft: &mut Draft<'_>) -> Result<(), ReadReason> {
    let mut references = Vec::new();
    let mut dimension = 3;
    file.word()?;
    file.number::<u32>()?;
    while let Some(word) = file.next_word()? {
        match word {
            "End" => break,
            "Dimension" => dimension = file.number()?,
            "Vertices" => {
                if dimension != 3 {
                    let what = format!("a mesh in {dimension} dimensions");
                    return Err(ReadReason::Unsupported { what, remedy: "give a mesh of volumes".into() });
                }
                for _ in 0..file.number::<usize>()? {
                    draft.coordinates.extend(file.numbers::<f64, 3>()?);
                    file.number::<f64>()?;
                }
            }
            _ => match CELLS.iter().find(|(name, ..)| *name == word) {
                Some((_, kind, order)) => {
                    for _ in 0..file.number::<usize>()? {
                        let mut points = [0_i64; 8];
                        for point in &mut points[..order.len()] {
                            // They are numbered from 1.
                            *point = file.number::<i64>()?.saturating_sub(1);
                        }
                        draft.add_cell(*kind, order.iter().map(|&p| points[p]));
                        references.push(file.number::<f64>()?);
                    }
                }
                None => skip_numbers(file, word)?,
            },
        }
    }
    draft.at_cells("ref", 1, references, true)
}

/// Steps over a section that is not needed, up to the next keyword.
fn skip_numbers(file: &mut Scanner<'_>, keyword: &str) -> Result<(), ReadReason> {
    if !keyword.starts_with(|c: char| c.is_ascii_alphabetic()) {
        let shown: String = keyword.chars().take(24).collect();
        return Err(ReadReason::Syntax(format!("\"{shown}\" instead of a keyword")));
    }
    while file.word_if(|word| word.parse::<f64>().is_ok()).is_some() {}
    Ok(())
}

fn read_solution(file: &mut Scanner<'_>, draft: &mut Draft<'_>) -> Result<(), ReadReason> {
    while let Some(word) = file.next_word()? {
        match word {
            "End" => break,
            "SolAtVertices" => {
                let count = file.number()?;
                let components: Vec<usize> =
                    (0..file.number::<usize>()?).map(|_| components(file)).collect::<Result<_, _>>()?;
                if components.is_empty() {
                    return Err(ReadReason::Syntax("a solution without values".into()));
                }
                let mut arrays = vec![Vec::new(); components.len()];
                for _ in 0..count {
                    for (array, components) in arrays.iter_mut().zip(&components) {
                        for _ in 0..*components {
                            array.push(file.number::<f64>()?);
                        }
                    }
                }
                for (array, components) in arrays.into_iter().zip(components) {
                    draft.at_points("sol", components, array, false)?;
                }
            }
            other => skip_numbers(file, other)?,
        }
    }
    Ok(())
}

fn components(file: &mut Scanner<'_>) -> Result<usize, ReadReason> {
    components_of(file.number()?)
}

/// How many values a scalar, a vector or a symmetric tensor has.
pub(super) fn components_of(kind: i64) -> Result<usize, ReadReason> {
    match kind {
        1 => Ok(1),
        2 => Ok(3),
        3 => Ok(6),
        other => Err(ReadReason::Syntax(format!("a solution of type {other}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::CellData;

    const MESH: &str = " MeshVersionFormatted 2\nDimension\n3\n# a comment\nVertices\n5\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 2\n\
        0 0 -1 2\nTriangles\n1\n1 2 3 7\nRequiredVertices 1 2\nTetrahedra\n2\n1 2 3 4 5\n1 3 2 5 6\nEnd\n";
    const SOL: &str = "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n5\n2 1 2\n1 0 0 9\n2 0 0 9\n3 0 0 9\n4 0 0 9\n5 0 0 9\nEnd\n";

    fn read_both(mesh: &str, sol: &str) -> Result<TetMesh, ReadError> {
        let options = ReadOptions { fields: None, first: false, cells: CellData::Values, step: 0 };
        let beside = |name: &str| match (name, sol) {
            ("a.sol", "") => Err(ReadReason::Io("none".into())),
            ("a.sol", sol) => Ok(sol.as_bytes().to_vec()),
            other => panic!("{other:?}"),
        };
        read(mesh.as_bytes(), "a.sol", &options, &beside)
    }

    #[test]
    fn a_mesh_and_its_solution() {
        let mesh = read_both(MESH, SOL).unwrap();
        assert_eq!((mesh.positions.len(), &mesh.tets), (5, &vec![[0, 1, 2, 3], [0, 2, 1, 4]]));
        let names: Vec<&str> = mesh.fields.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["sol", "sol_2_x", "sol_2_y", "sol_2_z", "sol_2_magnitude"]);
        assert_eq!((mesh.fields[0].values[4], mesh.fields[3].values[0]), (5.0, 9.0));
        assert_eq!(
            (mesh.cell_fields[0].name.as_str(), &mesh.cell_fields[0].values),
            ("ref", &vec![5.0, 6.0])
        );
        assert!(read_both(MESH, "").unwrap().fields.is_empty());
    }

    #[test]
    fn errors_say_where_and_what() {
        let refused =
            |from: &str, to: &str| read_both(&MESH.replacen(from, to, 1), "").unwrap_err().to_string();
        assert!(refused("1 3 2 5 6", "1 3 2 6 6").contains("cell 1 refers to point 5"));
        assert!(refused("1 3 2 5 6", "1 3 2 0 6").contains("cell 1 refers to point -1"));
        assert!(refused("0 1 0 1", "0 y 0 1").contains("line 9: \"y\" is not a number"));
        assert!(refused("Vertices\n5", "Vertices\n50000000000").contains("is not a number"));
        assert!(refused("\n3\n#", "\n2\n#").contains("2 dimensions"));
        let error = read_both(MESH, &SOL.replace("2 1 2", "2 1 7")).unwrap_err();
        assert!(error.to_string().starts_with("a.sol: line 5: a solution of type 7"), "{error}");
        let error = read_both(MESH, &SOL.replacen("\n5\n", "\n4\n", 1)).unwrap_err();
        assert!(error.to_string().contains("expected 5, found 4") || error.file == "a.sol", "{error}");
        (0..MESH.len()).for_each(|length| drop(read_both(&MESH[..length], "")));
        (0..SOL.len()).for_each(|length| drop(read_both(MESH, &SOL[..length])));
    }
}
