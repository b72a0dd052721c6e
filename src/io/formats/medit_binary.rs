//! Medit's meshes in binary (`.meshb`), with solutions at vertices in the `.solb` file of the same name, if there is one: versions
//! 1 to 4, either byte order.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::formats::draft::Draft;
use crate::io::formats::medit::{CELLS, components_of};
use crate::io::formats::scanner::Scanner;
use crate::io::number::NumberType;
use crate::io::{Beside, ReadOptions, in_file};
use crate::mesh::TetMesh;

/// Numbers of the sections that are read; others are stepped over.
const DIMENSION: i64 = 3;
const VERTICES: i64 = 4;
const SOLUTION_AT_VERTICES: i64 = 62;
const END: i64 = 54;
/// Those of cells with a volume, and their names in text.
const CELL_SECTIONS: [(i64, &str); 4] =
    [(8, "Tetrahedra"), (9, "Prisms"), (10, "Hexahedra"), (49, "Pyramids")];

/// Whether a file begins with these bytes: a one in either byte order, then the version.
pub(super) fn is_first(bytes: &[u8]) -> bool {
    layout(bytes).is_some()
}

/// How the numbers of a file are written.
#[derive(Clone, Copy)]
struct Layout {
    big: bool,
    /// Counts and numbers of vertices.
    integer: NumberType,
    /// Where the next section is.
    position: NumberType,
    float: NumberType,
}

fn layout(bytes: &[u8]) -> Option<Layout> {
    let big = match bytes.get(..4)? {
        [1, 0, 0, 0] => false,
        [0, 0, 0, 1] => true,
        _ => return None,
    };
    let version = bytes.get(4..8)?;
    let version = if big {
        [version[3], version[2], version[1], version[0]]
    } else {
        [version[0], version[1], version[2], version[3]]
    };
    let (integer, position, float) = match version {
        [1, 0, 0, 0] => (NumberType::I32, NumberType::I32, NumberType::F32),
        [2, 0, 0, 0] => (NumberType::I32, NumberType::I32, NumberType::F64),
        [3, 0, 0, 0] => (NumberType::I32, NumberType::I64, NumberType::F64),
        [4, 0, 0, 0] => (NumberType::I64, NumberType::I64, NumberType::F64),
        _ => return None,
    };
    Some(Layout { big, integer, position, float })
}

/// Reads a mesh, and the solution in the file called `solution` beside it.
pub(super) fn read(
    bytes: &[u8],
    solution: &str,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<TetMesh, ReadError> {
    let mut draft = Draft::new(options);
    let mut references = Vec::new();
    each_section(bytes, &mut |section, number| {
        if number == VERTICES {
            section.vertices(&mut draft)?;
        }
        match CELL_SECTIONS.iter().find(|(of, _)| *of == number) {
            Some((_, name)) => section.cells(name, &mut draft, &mut references),
            None => Ok(()),
        }
    })?;
    draft.at_cells("ref", 1, references, true).at(String::new)?;
    // A mesh need not have one.
    if let Ok(bytes) = beside(solution) {
        let read = each_section(&bytes, &mut |section, number| {
            if number == SOLUTION_AT_VERTICES { section.solution(&mut draft) } else { Ok(()) }
        });
        read.map_err(|error| in_file(error, solution))?;
    }
    draft.finish().at(String::new)
}

/// The data of a section.
struct Section<'a> {
    data: Scanner<'a>,
    layout: Layout,
}

/// Calls `read` with each section and its number.
fn each_section(
    bytes: &[u8],
    read: &mut dyn FnMut(&mut Section<'_>, i64) -> Result<(), ReadReason>,
) -> Result<(), ReadError> {
    let wrong = || ReadReason::Damaged("it does not begin as such a file does".into());
    let layout = layout(bytes).ok_or_else(wrong).at(String::new)?;
    // Behind the mark of the byte order and the version.
    let mut at = 8;
    while at < bytes.len() {
        let mut section = Section { data: Scanner::new(&bytes[at..]), layout };
        let number = section.integer(NumberType::I32).at(|| format!("byte {at}"))?;
        let place = || format!("section {number} at byte {at}");
        if number == END {
            break;
        }
        let next = section.integer(layout.position).at(place)?;
        if number == DIMENSION {
            let dimension = section.integer(NumberType::I32).at(place)?;
            if dimension != 3 {
                let what = format!("a mesh in {dimension} dimensions");
                let remedy = "give a mesh of volumes".into();
                return Err(ReadReason::Unsupported { what, remedy }).at(place);
            }
        }
        read(&mut section, number).at(place)?;
        if next == 0 {
            break;
        }
        let next = usize::try_from(next).ok().filter(|next| *next > at);
        let damaged = || ReadReason::Damaged("the next section is not behind this one".into());
        at = next.ok_or_else(damaged).at(place)?;
    }
    Ok(())
}

impl Section<'_> {
    fn integer(&mut self, kind: NumberType) -> Result<i64, ReadReason> {
        // One number was asked for, so there is one.
        Ok(self.data.integers(1, kind, self.layout.big)?[0])
    }

    fn count(&mut self) -> Result<usize, ReadReason> {
        let count = self.integer(self.layout.integer)?;
        usize::try_from(count).map_err(|_| ReadReason::Syntax(format!("{count} is not a count")))
    }

    fn vertices(&mut self, draft: &mut Draft<'_>) -> Result<(), ReadReason> {
        for _ in 0..self.count()? {
            draft.coordinates.extend(self.data.floats(3, self.layout.float, self.layout.big)?);
            self.integer(self.layout.integer)?;
        }
        Ok(())
    }

    fn cells(
        &mut self,
        name: &str,
        draft: &mut Draft<'_>,
        references: &mut Vec<f64>,
    ) -> Result<(), ReadReason> {
        let Some((_, kind, order)) = CELLS.iter().find(|(of, ..)| *of == name) else { return Ok(()) };
        for _ in 0..self.count()? {
            let numbers = self.data.integers(order.len() + 1, self.layout.integer, self.layout.big)?;
            // They are numbered from 1.
            draft.add_cell(*kind, order.iter().map(|&p| numbers[p].saturating_sub(1)));
            references.push(numbers[order.len()] as f64);
        }
        Ok(())
    }

    fn solution(&mut self, draft: &mut Draft<'_>) -> Result<(), ReadReason> {
        let count = self.count()?;
        let kinds = self.integer(NumberType::I32)?;
        let mut components = Vec::new();
        for _ in 0..kinds {
            components.push(components_of(self.integer(NumberType::I32)?)?);
        }
        if components.is_empty() {
            return Err(ReadReason::Syntax("a solution without values".into()));
        }
        let mut arrays = vec![Vec::new(); components.len()];
        for _ in 0..count {
            for (array, components) in arrays.iter_mut().zip(&components) {
                array.extend(self.data.floats(*components, self.layout.float, self.layout.big)?);
            }
        }
        for (array, components) in arrays.into_iter().zip(components) {
            draft.at_points("sol", components, array, false)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::CellData;

    /// Numbers of a file, by what they are.
    enum Part {
        Int(i64),
        Wide(i64),
        Float(f64),
        /// The beginning of a section with this number.
        Section(i64),
    }

    use Part::{Float, Int, Section as Start, Wide};

    fn written(version: i32, big: bool, parts: &[Part]) -> Vec<u8> {
        let kinds = match version {
            1 => (NumberType::I32, NumberType::I32, NumberType::F32),
            2 => (NumberType::I32, NumberType::I32, NumberType::F64),
            3 => (NumberType::I32, NumberType::I64, NumberType::F64),
            _ => (NumberType::I64, NumberType::I64, NumberType::F64),
        };
        let mut bytes = Vec::new();
        let put = |value: f64, kind: NumberType, bytes: &mut Vec<u8>| kind.put(value, big, bytes);
        put(1.0, NumberType::I32, &mut bytes);
        put(f64::from(version), NumberType::I32, &mut bytes);
        let mut last: Option<usize> = None;
        for part in parts {
            match part {
                Int(value) => put(*value as f64, NumberType::I32, &mut bytes),
                Wide(value) => put(*value as f64, kinds.0, &mut bytes),
                Float(value) => put(*value, kinds.2, &mut bytes),
                Start(number) => {
                    if let Some(at) = last {
                        let mut position = Vec::new();
                        put(bytes.len() as f64, kinds.1, &mut position);
                        bytes[at..at + position.len()].copy_from_slice(&position);
                    }
                    put(*number as f64, NumberType::I32, &mut bytes);
                    last = Some(bytes.len());
                    put(0.0, kinds.1, &mut bytes);
                }
            }
        }
        bytes
    }

    fn mesh(version: i32, big: bool) -> Vec<u8> {
        let mut parts = vec![Start(DIMENSION), Int(3), Start(VERTICES), Wide(4)];
        for [x, y, z] in [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]] {
            parts.extend([Float(x), Float(y), Float(z), Wide(0)]);
        }
        // Triangles, which are left out.
        parts.extend([Start(6), Wide(1), Wide(1), Wide(2), Wide(3), Wide(9)]);
        parts.extend([Start(8), Wide(1), Wide(1), Wide(2), Wide(3), Wide(4), Wide(7), Start(END)]);
        written(version, big, &parts)
    }

    fn solution(version: i32, big: bool) -> Vec<u8> {
        let mut parts =
            vec![Start(DIMENSION), Int(3), Start(SOLUTION_AT_VERTICES), Wide(4), Int(2), Int(1), Int(2)];
        for i in 0..4 {
            parts.extend([0, 1, 2, 3].map(|c| Float(f64::from(4 * i + c))));
        }
        parts.push(Start(END));
        written(version, big, &parts)
    }

    fn read_both(mesh: &[u8], solution: &[u8]) -> Result<TetMesh, ReadError> {
        let options = ReadOptions { cells: CellData::Values, ..ReadOptions::default() };
        let beside = |_: &str| Ok(solution.to_vec());
        read(mesh, "a.solb", &options, &beside)
    }

    #[test]
    fn one_mesh_in_every_version() {
        for version in 1..5 {
            for big in [false, true] {
                assert!(is_first(&mesh(version, big)));
                let mesh = read_both(&mesh(version, big), &solution(version, big)).unwrap();
                assert_eq!((mesh.positions[1], &mesh.tets), ([1.0, 0.0, 0.0], &vec![[0, 1, 2, 3]]));
                assert_eq!(mesh.cell_fields[0].values, [7.0]);
                let names: Vec<_> = mesh.fields.iter().map(|field| field.name.as_str()).collect();
                assert_eq!(names, ["sol", "sol_2_x", "sol_2_y", "sol_2_z", "sol_2_magnitude"]);
                assert_eq!(mesh.fields[3].values, [3.0, 7.0, 11.0, 15.0]);
            }
        }
    }

    #[test]
    fn no_cut_and_no_bit_flip_panics() {
        for version in [1, 4] {
            let (mut mesh, mut solution) = (mesh(version, false), solution(version, false));
            (0..mesh.len()).for_each(|length| drop(read_both(&mesh[..length], &solution)));
            for bit in 0..8 * mesh.len() {
                mesh[bit / 8] ^= 1 << (bit % 8);
                drop(read_both(&mesh, &solution));
                mesh[bit / 8] ^= 1 << (bit % 8);
            }
            for bit in 0..8 * solution.len() {
                solution[bit / 8] ^= 1 << (bit % 8);
                drop(read_both(&mesh, &solution));
                solution[bit / 8] ^= 1 << (bit % 8);
            }
        }
        let cut = read_both(&mesh(2, false)[..100], &solution(2, false)).unwrap_err().to_string();
        assert!(cut.contains("section 4 at byte 20: the data ends too early"), "{cut}");
    }
}
