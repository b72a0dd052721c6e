//! Medit's meshes in binary (`.meshb`), with solutions in the `.solb` file of the same name, if there is one: versions
//! 1 to 4, either byte order.

use std::ops::RangeInclusive;

use crate::error::{At, ReadError, ReadReason, in_file};
use crate::formats::medit::{FLAT, Layout, Numbers, Parts, beside_if, expect_three};
use crate::formats::medit_cells::{expect_known, refused};
use crate::number::NumberType;
use crate::options::{Beside, ReadOptions};
use crate::scanner::Scanner;
use tetralod::mesh::TetMesh;

/// Numbers of sections that are read; those of cells and solutions are with their names.
const DIMENSION: i64 = 3;
const VERTICES: i64 = 4;
const BEZIER: i64 = 125;
const END: i64 = 54;
/// Sections with the order of points of quadratic cells.
const ORDERINGS: RangeInclusive<i64> = 133..=139;
/// Sections that change neither places nor values: what has no volume, what belongs to it, and geometry.
const HARMLESS: [RangeInclusive<i64>; 7] = [1..=7, 11..=25, 27..=29, 31..=32, 34..=45, 47..=61, 126..=132];

/// Whether a file begins with these bytes: a one in either byte order, then the version.
pub(super) fn is_first(bytes: &[u8]) -> bool {
    layout(bytes).is_some()
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
    let mut parts = Parts::new(options);
    read_sections(bytes, &mut parts)?;
    if let Some(bytes) = beside_if(beside, solution).in_file(solution)? {
        read_sections(&bytes, &mut parts).map_err(|error| in_file(error, solution))?;
    }
    parts.finish().at(String::new)
}

/// Reads the sections of a mesh or of a solution.
fn read_sections(bytes: &[u8], parts: &mut Parts<'_>) -> Result<(), ReadError> {
    let wrong = || ReadReason::Damaged("it does not begin as such a file does".into());
    let layout = layout(bytes).ok_or_else(wrong).at(String::new)?;
    // Behind the mark of the byte order and the version.
    let mut at = 8;
    while at < bytes.len() {
        let mut file = Scanner::new(&bytes[at..]);
        // One number is asked for at a time, so there is one.
        let mut integer = |kind: NumberType| Ok(file.integers(1, kind, layout.big)?[0]);
        let number = integer(NumberType::I32).at(|| format!("byte {at}"))?;
        let place = || format!("section {number} at byte {at}");
        if number == END {
            break;
        }
        let next = integer(layout.position).at(place)?;
        match number {
            DIMENSION => integer(NumberType::I32).and_then(expect_three).at(place)?,
            BEZIER => parts.cells.is_bezier = integer(NumberType::I32).at(place)? != 0,
            _ => read_section(&mut Numbers { file: &mut file, layout: Some(layout) }, number, parts)
                .at(place)?,
        }
        if next == 0 {
            break;
        }
        let next = usize::try_from(next).ok().filter(|next| *next > at);
        let damaged = || ReadReason::Damaged("the next section is not behind this one".into());
        at = next.ok_or_else(damaged).at(place)?;
    }
    Ok(())
}

/// Reads the section of this number.
fn read_section(numbers: &mut Numbers<'_, '_>, number: i64, parts: &mut Parts<'_>) -> Result<(), ReadReason> {
    if numbers.section(parts, |_, known| known == number)? {
        return Ok(());
    }
    if let Some((_, _, kind)) = FLAT.iter().find(|(_, known, _)| *known == number) {
        parts.draft.add_flat(*kind, numbers.count()? as u64);
        return Ok(());
    }
    match number {
        VERTICES => numbers.vertices(parts),
        number if HARMLESS.iter().chain([&ORDERINGS]).any(|range| range.contains(&number)) => Ok(()),
        number => match refused(number) {
            Some(name) => expect_known(name),
            None => parts.skip(&format!("number {number}")),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellData;

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
        let mut parts = vec![Start(DIMENSION), Int(3), Start(62), Wide(4), Int(2), Int(1), Int(2)];
        for i in 0..4 {
            parts.extend([0, 1, 2, 3].map(|c| Float(f64::from(4 * i + c))));
        }
        parts.push(Start(END));
        written(version, big, &parts)
    }

    fn read_both(mesh: &[u8], solution: &[u8]) -> Result<TetMesh, ReadError> {
        let options = ReadOptions { cells: CellData::Values, ..ReadOptions::default() };
        let beside = |_: &str| match solution {
            [] => Err(ReadReason::Io("none".into())),
            solution => Ok(solution.to_vec()),
        };
        read(mesh, "a.solb", &options, &|name| beside(name).map(Into::into))
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
    fn quadratic_cells_with_their_order() {
        for version in 1..5 {
            // The edges of the last vertex first.
            let edges = [[0, 3], [1, 3], [2, 3], [0, 1], [1, 2], [2, 0]];
            let corners = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.], [0., 0., 2.]];
            let middle = |[a, b]: [usize; 2]| [0, 1, 2].map(|i| (corners[a][i] + corners[b][i]) / 2.0);
            let mut parts = vec![Start(DIMENSION), Int(3), Start(VERTICES), Wide(10)];
            for [x, y, z] in corners.into_iter().chain(edges.map(middle)) {
                parts.extend([Float(x), Float(y), Float(z), Wide(0)]);
            }
            parts.extend([Start(30), Wide(1)]);
            parts.extend((1..=10).chain([7]).map(Wide));
            parts.extend([Start(133), Wide(10)]);
            for place in (0..4).map(|c| [c, c]).chain(edges) {
                parts.extend((0..4).map(|i| Int(place.iter().filter(|&&c| c == i).count() as i64)));
            }
            parts.extend([Start(108), Start(END)]);
            let mesh = read_both(&written(version, true, &parts), b"").unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(mesh.tets.len(), 8);
            let volume = |tet: &[u32; 4]| {
                let [a, b, c, d] = tet.map(|v| glam::DVec3::from_array(mesh.positions[v as usize]));
                (b - a).cross(c - a).dot(d - a) / 6.0
            };
            assert!(mesh.tets.iter().all(|tet| (volume(tet) - 1.0 / 6.0).abs() < 1e-12));
            assert_eq!(mesh.notes, ["section number 108 is left out"]);
        }
        let cubic = written(2, false, &[Start(DIMENSION), Int(3), Start(96), Wide(0), Start(END)]);
        assert!(read_both(&cubic, b"").unwrap_err().to_string().contains("TetrahedraP3"));
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
