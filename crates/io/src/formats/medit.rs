//! Medit's meshes in text (`.mesh`), with solutions in the `.sol` file of the same name, if there is one. By the keywords of libMeshb 7:
//! <https://github.com/LoicMarechal/libMeshb>.
//!
//! References become the field `ref` at cells. What has no volume is left out.

use crate::error::{At, ReadError, ReadReason, in_file, shown};
use crate::fields::in_order;
use crate::formats::draft::Draft;
use crate::formats::medit_cells::{Cells, KINDS, expect_known, ordering};
use crate::memory::FileBytes;
use crate::number::NumberType;
use crate::options::{Beside, ReadOptions};
use crate::scanner::Scanner;
use tetralod::mesh::TetMesh;

/// The first word of every file.
pub(super) const FIRST: &str = "MeshVersionFormatted";

/// What solutions may be at: the section, its number in binary, and the cells, none of vertices.
pub(super) const SOLUTIONS: [(&str, i64, Option<&str>); 6] = [
    ("SolAtVertices", 62, None),
    ("SolAtTetrahedra", 66, Some("Tetrahedra")),
    ("SolAtPrisms", 67, Some("Prisms")),
    ("SolAtHexahedra", 68, Some("Hexahedra")),
    ("SolAtPyramids", 26, Some("Pyramids")),
    ("SolAtPentahedra", 67, Some("Pentahedra")),
];

/// Cells without a volume: the section, its number in binary, and VTK's type.
pub(super) const FLAT: [(&str, i64, i64); 6] = [
    ("Edges", 5, 3),
    ("Triangles", 6, 5),
    ("Quadrilaterals", 7, 9),
    ("TrianglesP2", 24, 22),
    ("EdgesP2", 25, 21),
    ("QuadrilateralsQ2", 27, 28),
];

/// Beginnings of the names of sections that change neither places nor values.
const HARMLESS: [&str; 22] = [
    "Edges",
    "Triangles",
    "Quadrilaterals",
    "Polygons",
    "Corners",
    "Ridges",
    "Required",
    "Tangent",
    "Normal",
    "Vertices",
    "Geometry",
    "SubDomain",
    "BoundingBox",
    "Angle",
    "Identifier",
    "AssociatedSurfaceMesh",
    "NormalAt",
    "ExtraVertices",
    "Reserved",
    "Iterations",
    "Time",
    "Coarse",
];

/// What is read of a mesh and its solution.
pub(super) struct Parts<'a> {
    pub draft: Draft<'a>,
    pub cells: Cells,
    /// Sections that are left out.
    skipped: Vec<String>,
}

impl<'a> Parts<'a> {
    pub fn new(options: &'a ReadOptions) -> Self {
        Self { draft: Draft::new(options), cells: Cells::default(), skipped: Vec::new() }
    }

    /// Notes that a section is left out, if its content is of use.
    pub fn skip(&mut self, name: &str) -> Result<(), ReadReason> {
        expect_known(name)?;
        let is_harmless = HARMLESS.iter().any(|known| name.starts_with(known)) || name.ends_with("Ordering");
        if !is_harmless && !self.skipped.iter().any(|known| known == name) && self.skipped.len() < 16 {
            self.skipped.push(name.chars().take(48).collect());
        }
        Ok(())
    }

    /// Keeps the arrays of a solution, each of which has the values of one type.
    pub fn solution(&mut self, of: Option<&str>, arrays: Vec<Array>) -> Result<(), ReadReason> {
        let is_all = |name: &str| matches!(self.cells.counts.as_slice(), [(only, _)] if *only == name);
        if of.is_some_and(|name| !is_all(name)) {
            // Other cells have no values.
            return self.skip(&format!("SolAt{}", of.unwrap_or_default()));
        }
        for Array { components, values } in arrays {
            let values = match components {
                6 => in_order(&values, 6, &LOWER_TRIANGLE),
                _ => values,
            };
            match of {
                None => self.draft.at_points("sol", components, false, || Ok(values))?,
                Some(_) => self.draft.at_cells("sol", components, false, || Ok(values))?,
            }
        }
        Ok(())
    }

    /// The mesh.
    pub fn finish(self) -> Result<TetMesh, ReadReason> {
        let Self { mut draft, cells, skipped } = self;
        cells.finish(&mut draft)?;
        draft.notes.extend(skipped.into_iter().map(|name| format!("section {name} is left out")));
        draft.finish()
    }
}

/// Values of one type of a solution.
pub(super) struct Array {
    pub components: usize,
    pub values: Vec<f64>,
}

/// Where `xx`, `yy`, `zz`, `xy`, `yz`, `xz` are in the lower triangle of a matrix, row by row, as the format has symmetric tensors.
const LOWER_TRIANGLE: [usize; 6] = [0, 2, 5, 1, 4, 3];

/// Reads a mesh, and the solution in the file called `solution` beside it.
pub(super) fn read(
    bytes: &[u8],
    solution: &str,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<TetMesh, ReadError> {
    let mut file = Scanner::with_comments(bytes);
    let mut parts = Parts::new(options);
    let read = read_sections(&mut file, &mut parts);
    read.at(|| file.line_number())?;
    if let Some(bytes) = beside_if(beside, solution).in_file(solution)? {
        let mut file = Scanner::with_comments(&bytes);
        let read = read_sections(&mut file, &mut parts);
        read.at(|| file.line_number()).map_err(|error| in_file(error, solution))?;
    }
    parts.finish().at(String::new)
}

/// The file with the solution; a mesh need not have one.
pub(super) fn beside_if<'a>(beside: Beside<'a>, solution: &str) -> Result<Option<FileBytes<'a>>, ReadReason> {
    match beside(solution) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(reason @ (ReadReason::SeveralGiven(_) | ReadReason::Memory { .. })) => Err(reason),
        Err(_) => Ok(None),
    }
}

/// Reads the sections of a mesh or of a solution.
fn read_sections(file: &mut Scanner<'_>, parts: &mut Parts<'_>) -> Result<(), ReadReason> {
    if file.word_if(|word| word == FIRST).is_some() {
        file.number::<u32>()?;
    }
    while let Some(word) = file.next_word()? {
        match word {
            "End" => break,
            "Dimension" => expect_three(file.number()?)?,
            "Vertices" => Numbers { file, layout: None }.vertices(parts)?,
            "BezierBasis" => parts.cells.is_bezier = file.number::<i64>()? != 0,
            name => read_section(file, parts, name)?,
        }
    }
    Ok(())
}

fn read_section(file: &mut Scanner<'_>, parts: &mut Parts<'_>, name: &str) -> Result<(), ReadReason> {
    if (Numbers { file, layout: None }).section(parts, |known, _| known == name)? {
        return Ok(());
    }
    if let Some((_, _, kind)) = FLAT.iter().find(|(known, ..)| *known == name) {
        parts.draft.add_flat(*kind, file.number()?);
    }
    parts.skip(name)?;
    skip_numbers(file, name)
}

/// Refuses meshes of surfaces in a plane.
pub(super) fn expect_three(dimension: i64) -> Result<(), ReadReason> {
    if dimension == 3 {
        return Ok(());
    }
    Err(ReadReason::unsupported(format!("a mesh in {dimension} dimensions"), "give a mesh of volumes"))
}

/// Steps over a section that is not needed, up to the next keyword.
fn skip_numbers(file: &mut Scanner<'_>, keyword: &str) -> Result<(), ReadReason> {
    if !keyword.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Err(ReadReason::Syntax(format!("\"{}\" instead of a keyword", shown(keyword))));
    }
    let is_content = |word: &str| word.parse::<f64>().is_ok() || word.starts_with('"');
    while let Some(word) = file.word_if(is_content) {
        // A text goes to the end of its line.
        if word.starts_with('"') {
            file.skip_line();
        }
    }
    Ok(())
}

/// Numbers of either encoding.
pub(super) struct Numbers<'s, 'a> {
    pub file: &'s mut Scanner<'a>,
    /// How they are written; none of text.
    pub layout: Option<Layout>,
}

/// How the numbers of a binary file are written.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    pub big: bool,
    /// Counts and numbers of vertices.
    pub integer: NumberType,
    /// Where the next section is.
    pub position: NumberType,
    pub float: NumberType,
}

impl Numbers<'_, '_> {
    pub fn count(&mut self) -> Result<usize, ReadReason> {
        let Some(Layout { big, integer, .. }) = self.layout else { return self.file.number() };
        let count = self.file.integers(1, integer, big)?[0];
        usize::try_from(count).map_err(|_| ReadReason::Syntax(format!("{count} is not a count")))
    }

    /// The next `count` numbers that are an `int` in binary files.
    fn ints(&mut self, count: usize) -> Result<Vec<i64>, ReadReason> {
        match self.layout {
            Some(Layout { big, .. }) => self.file.integers(count, NumberType::I32, big),
            None => (0..count).map(|_| self.file.number()).collect(),
        }
    }

    fn floats(&mut self, count: usize) -> Result<Vec<f64>, ReadReason> {
        match self.layout {
            Some(Layout { big, float, .. }) => self.file.floats(count, float, big),
            None => (0..count).map(|_| self.file.number()).collect(),
        }
    }

    /// The points of a cell, which are numbered from 1, and its reference.
    fn cell(&mut self, points: usize) -> Result<(Vec<i64>, f64), ReadReason> {
        let Some(Layout { big, integer, .. }) = self.layout else {
            return Ok((self.ints(points)?, self.file.number()?));
        };
        let mut numbers = self.file.integers(points + 1, integer, big)?;
        let reference = numbers.pop().unwrap_or_default();
        Ok((numbers, reference as f64))
    }

    pub fn vertices(&mut self, parts: &mut Parts<'_>) -> Result<(), ReadReason> {
        for _ in 0..self.count()? {
            parts.draft.coordinates.extend(self.floats(3)?);
            // As a cell without points.
            self.cell(0)?;
        }
        Ok(())
    }

    /// Reads a section if it has cells, a solution or the order of points, and `is_it` says so of its name and number.
    pub fn section(
        &mut self,
        parts: &mut Parts<'_>,
        is_it: impl Fn(&str, i64) -> bool,
    ) -> Result<bool, ReadReason> {
        if let Some(kind) = KINDS.iter().position(|kind| is_it(kind.name, kind.number)) {
            self.cells(kind, parts)?;
        } else if let Some((_, _, of)) = SOLUTIONS.iter().find(|(name, number, _)| is_it(name, *number)) {
            let arrays = self.solution()?;
            parts.solution(*of, arrays)?;
        } else if let Some((order, width)) = ordering(|(name, number)| is_it(name, number)) {
            let count = self.count()?.saturating_mul(width);
            parts.cells.orders.insert(order, self.ints(count)?);
        } else {
            return Ok(false);
        }
        Ok(true)
    }

    fn cells(&mut self, kind: usize, parts: &mut Parts<'_>) -> Result<(), ReadReason> {
        let count = self.count()?;
        for _ in 0..count {
            let (mut points, reference) = self.cell(KINDS[kind].points)?;
            points.iter_mut().for_each(|point| *point = point.saturating_sub(1));
            parts.cells.add(&mut parts.draft, kind, &points, reference);
        }
        parts.cells.counts.push((KINDS[kind].name, count));
        Ok(())
    }

    fn solution(&mut self) -> Result<Vec<Array>, ReadReason> {
        let count = self.count()?;
        let types = match self.layout {
            Some(_) => usize::try_from(self.ints(1)?[0]).unwrap_or(0),
            None => self.file.number()?,
        };
        let mut arrays = Vec::new();
        for _ in 0..types {
            arrays.push(Array { components: components_of(self.ints(1)?[0])?, values: Vec::new() });
        }
        if arrays.is_empty() {
            return Err(ReadReason::Syntax("a solution without values".into()));
        }
        for _ in 0..count {
            for Array { components, values } in &mut arrays {
                values.extend(self.floats(*components)?);
            }
        }
        Ok(arrays)
    }
}

/// How many values a scalar, a vector, a symmetric tensor or a matrix has.
fn components_of(kind: i64) -> Result<usize, ReadReason> {
    match kind {
        1 => Ok(1),
        2 => Ok(3),
        3 => Ok(6),
        4 => Ok(9),
        other => Err(ReadReason::Syntax(format!("a solution of type {other}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellData;
    use crate::memory::FileBytes;

    const MESH: &str = " MeshVersionFormatted 2\nDimension\n3\n# a comment\nVertices\n5\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 2\n\
        0 0 -1 2\nTriangles\n1\n1 2 3 7\nRequiredVertices 1 2\nTetrahedra\n2\n1 2 3 4 5\n1 3 2 5 6\nEnd\n";
    const SOL: &str = "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n5\n2 1 2\n1 0 0 9\n2 0 0 9\n3 0 0 9\n4 0 0 9\n5 0 0 9\nEnd\n";

    fn read_both(mesh: &str, sol: &str) -> Result<TetMesh, ReadError> {
        let options = ReadOptions { cells: CellData::Values, ..ReadOptions::default() };
        let beside = |name: &str| match (name, sol) {
            ("a.sol", "") => Err(ReadReason::Io("none".into())),
            ("a.sol", sol) => Ok(sol.as_bytes().to_vec()),
            other => panic!("{other:?}"),
        };
        read(mesh.as_bytes(), "a.sol", &options, &|name| beside(name).map(FileBytes::from))
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
    fn tensors_keep_their_components_and_names_differ() {
        let sol = "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n5\n3 3 2 4\n";
        let row = "1 10 2 20 30 3 5 6 7 11 12 13 21 22 23 31 32 33\n";
        let mesh = read_both(MESH, &format!("{sol}{}End\n", row.repeat(5))).unwrap();
        let found: Vec<_> = mesh.fields.iter().map(|f| (f.name.as_str(), f.values[4])).collect();
        let tensor = [
            ("sol_xx", 1.0),
            ("sol_yy", 2.0),
            ("sol_zz", 3.0),
            ("sol_xy", 10.0),
            ("sol_yz", 30.0),
            ("sol_xz", 20.0),
        ];
        assert_eq!(found[..6], tensor);
        assert_eq!(found[11..14], [("sol_2_x", 5.0), ("sol_2_y", 6.0), ("sol_2_z", 7.0)]);
        assert_eq!(found[15..18], [("sol_3_xx", 11.0), ("sol_3_xy", 12.0), ("sol_3_xz", 13.0)]);
        let vectors: Vec<_> =
            mesh.fields.iter().filter_map(|f| Some(f.vector.as_ref()?.name.as_str())).collect();
        assert_eq!([vectors[0], vectors[11], vectors[15]], ["sol", "sol_2", "sol_3"]);
    }

    /// Two tetrahedra of ten points and one of four in a cube's corner; points at edges in VTK's order.
    fn quadratic(order: [usize; 6], table: bool) -> String {
        let corners = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2], [0, 0, -2]];
        let edges = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
        let mut points = corners.map(|p| p.map(f64::from)).to_vec();
        for [a, b] in edges {
            points.push([0, 1, 2].map(|i| (points[a][i] + points[b][i]) / 2.0));
        }
        let vertices: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z} 0\n")).collect();
        let numbers: String = order.iter().map(|edge| format!("{} ", 6 + edge)).collect();
        let rows = ["1 1 0 0", "0 1 1 0", "1 0 1 0", "1 0 0 1", "0 1 0 1", "0 0 1 1"];
        let rows: String = order.iter().map(|&edge| format!("{}\n", rows[edge])).collect();
        let ordering = format!("TetrahedraP2Ordering\n10\n2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 2\n{rows}");
        format!(
            "MeshVersionFormatted 2\nDimension 3\nTetrahedraP2\n1\n1 2 3 4 {numbers}7\nVertices\n11\n{vertices}\
             Tetrahedra\n1\n1 3 2 5 8\n{}End\n",
            if table { &ordering } else { "" }
        )
    }

    #[test]
    fn quadratic_cells_beside_linear_ones() {
        for order in [[0, 1, 2, 3, 4, 5], [0, 2, 1, 5, 3, 4]] {
            for table in [false, true] {
                let mesh = read_both(&quadratic(order, table), "").unwrap();
                assert_eq!((mesh.positions.len(), mesh.tets.len()), (11, 9));
                let volume = |tet: &[u32; 4]| {
                    let [a, b, c, d] = tet.map(|v| glam::DVec3::from_array(mesh.positions[v as usize]));
                    (b - a).cross(c - a).dot(d - a) / 6.0
                };
                assert!(mesh.tets.iter().all(|tet| volume(tet) > 0.1), "{order:?} {table}");
                assert!((mesh.tets.iter().map(volume).sum::<f64>() - 8.0 / 3.0).abs() < 1e-12);
                assert_eq!(mesh.cell_fields[0].values, [8.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0]);
            }
        }
        let refused = |text: String| read_both(&text, "").unwrap_err().to_string();
        assert!(
            refused(quadratic([0, 0, 1, 2, 3, 4], true)).contains("the order of the points of TetrahedraP2")
        );
        assert!(refused(quadratic([0, 0, 1, 2, 3, 4], false)).contains("TetrahedraP2Ordering"));
        let bezier = quadratic([0, 1, 2, 3, 4, 5], false).replace("Vertices", "BezierBasis\n1\nVertices");
        assert!(refused(bezier).contains("BezierBasis"));
        let cubic = MESH.replace("Tetrahedra\n2", "TetrahedraP3\n2");
        assert!(refused(cubic).contains("cells in section TetrahedraP3"));
    }

    #[test]
    fn what_is_left_out_is_said() {
        let mesh = MESH.replace("Triangles", "Geometry \"a b\"\nHOSolAtTetrahedraP1\n1 1\nTriangles");
        assert_eq!(read_both(&mesh, "").unwrap().notes, ["section HOSolAtTetrahedraP1 is left out"]);
        let sol = SOL
            .replace("SolAtVertices\n5\n", "SolAtTetrahedra\n2\n")
            .replace("3 0 0 9\n4 0 0 9\n5 0 0 9\n", "");
        let of_cells = read_both(MESH, &sol).unwrap();
        let at_cells: Vec<_> = of_cells.cell_fields.iter().map(|f| (f.name.as_str(), f.values[1])).collect();
        assert_eq!(at_cells[0], ("sol", 2.0));
        assert!(at_cells.contains(&("sol_2_z", 9.0)) && of_cells.notes.is_empty(), "{at_cells:?}");
        let mixed = MESH.replace("Triangles\n1\n1 2 3 7", "Pyramids\n0\n");
        assert_eq!(read_both(&mixed, &sol).unwrap().notes, ["section SolAtTetrahedra is left out"]);
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
