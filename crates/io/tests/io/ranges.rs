//! Promise: a file that is read by ranges of cells is the mesh that it is as a whole.

use crate::files::*;
use crate::pieces::Folder;
use std::path::Path;
use tetralod::mesh::{Field, Grid, MeshPiece, TetMesh};
use tetralod_io as io;
use tetralod_io::{CellData, Pieces, ReadOptions};

/// The pieces of a file whose ranges become so many tetrahedra; the reason if it has to be read as a whole.
pub fn pieces(path: &Path, most: u64) -> Result<Result<Vec<MeshPiece>, Option<&'static str>>, io::ReadError> {
    let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
    let opened = match Pieces::open_ranges(path, &options, Some(most))? {
        Ok(opened) => opened,
        Err(why) => return Ok(Err(why)),
    };
    let (counts, mut all) = (opened.counts()?, Vec::new());
    opened.for_each::<io::ReadError>(&mut |piece| {
        all.push(piece);
        Ok(())
    })?;
    let ranges = all.iter().filter(|piece| !piece.mesh.tets.is_empty()).count() as u64;
    let tets: usize = all.iter().map(|piece| piece.mesh.tets.len()).sum();
    assert!(counts.pieces >= ranges && ranges > 0 && counts.tetrahedra >= tets as u64 && tets > 0);
    Ok(Ok(all))
}

/// The pieces as one mesh.
pub fn joined(pieces: &[MeshPiece]) -> TetMesh {
    let mut whole = TetMesh::default();
    for MeshPiece { points, mesh } in pieces {
        if whole.positions.is_empty() {
            whole.fields = mesh.fields.iter().map(Field::without_values).collect();
            whole.cell_fields.clone_from(&mesh.cell_fields);
        }
        for (i, &number) in points.iter().enumerate() {
            let number = number as usize;
            if number == whole.positions.len() {
                whole.positions.push(mesh.positions[i]);
                whole
                    .fields
                    .iter_mut()
                    .zip(&mesh.fields)
                    .for_each(|(all, own)| all.values.push(own.values[i]));
            }
            assert_eq!(whole.positions[number], mesh.positions[i], "point {number}");
            for (all, own) in whole.fields.iter_mut().zip(&mesh.fields) {
                assert_eq!((&all.name, all.values[number]), (&own.name, own.values[i]), "point {number}");
                all.integer &= own.integer;
            }
        }
        whole.tets.extend(mesh.tets.iter().map(|tet| tet.map(|v| points[v as usize])));
        whole
            .input
            .append(tetralod::mesh::MeshInput { notes: mesh.input.notes.clone(), ..Default::default() });
    }
    whole.notes = whole.input.lines();
    whole
}

/// Checks that ranges of some sizes are the whole.
fn check(path: &Path, what: &str) {
    let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
    let whole = io::read_with(path, &options).unwrap_or_else(|error| panic!("{what}: {error}"));
    for most in [1, 3] {
        let pieces = pieces(path, most).unwrap_or_else(|error| panic!("{what}, {most}: {error}"));
        let pieces = pieces.unwrap_or_else(|why| panic!("{what}, {most}: {why:?}"));
        let found = joined(&pieces);
        assert_eq!((&found.positions, &found.tets), (&whole.positions, &whole.tets), "{what}, {most}");
        assert_eq!(
            (&found.fields, &found.cell_fields),
            (&whole.fields, &whole.cell_fields),
            "{what}, {most}"
        );
        assert_eq!(found.notes, whole.notes, "{what}, {most}");
    }
}

#[test]
fn ranges_are_the_whole_in_every_style() {
    let folder = Folder::new("ranges");
    let path = folder.0.join("a.vtu");
    for style in Style::all() {
        let file = sample_vtu(style);
        std::fs::write(&path, &file).unwrap();
        match style.format {
            Format::Ascii => assert_eq!(pieces(&path, 5), Ok(Err(Some("its numbers are text")))),
            Format::Inline => {
                assert_eq!(pieces(&path, 5), Ok(Err(Some("its arrays are not in one piece"))), "{style:?}");
                let in_lines = String::from_utf8(file).unwrap().replace("\n   ", "");
                std::fs::write(&path, in_lines).unwrap();
                check(&path, &format!("{style:?}"));
            }
            _ => check(&path, &format!("{style:?}")),
        }
    }
    assert_eq!(pieces(&path, 12), Ok(Err(None)), "one range is the whole");
}

/// A cube of cubes, whose arrays are long.
fn long() -> TetMesh {
    let grid = Grid { dims: [9; 3], origin: [0.0; 3], spacing: [0.1, 0.2, 0.3] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let values = |f: fn(f64) -> f64| (0..729).map(|i| f(f64::from(i))).collect();
    mesh.fields = vec![
        Field::new("a", values(f64::sin)),
        Field::new("v_x", values(|i| i)),
        Field::new("v_y", values(|i| -2.0 * i)),
    ];
    mesh.grid = None;
    mesh
}

#[test]
fn long_arrays_are_left_in_the_file() {
    let folder = Folder::new("ranges-long");
    let path = folder.0.join("a.vtu");
    for format in [Format::Inline, Format::AppendedBase64, Format::AppendedRaw] {
        for (compressor, wide, block) in
            [("", false, 96), ("", true, 96), ("ZLib", false, 1000), ("ZLib", true, 32768)]
        {
            let style = Style { format, compressor, wide, big: wide, block, version: "1.0" };
            let file = xml(style, "UnstructuredGrid", "", &[piece(&long(), "Float32", "Int64")]);
            let file = if format == Format::Inline {
                String::from_utf8(file).unwrap().replace("\n   ", "").replace("\n<", "  \n  <").into_bytes()
            } else {
                file
            };
            std::fs::write(&path, &file).unwrap();
            let whole = io::read(&path).unwrap();
            for most in [700, 1500] {
                let found =
                    joined(&pieces(&path, most).unwrap().unwrap_or_else(|why| panic!("{style:?}: {why:?}")));
                assert_eq!((&found.positions, &found.tets), (&whole.positions, &whole.tets), "{style:?}");
                assert_eq!(found.fields, whole.fields, "{style:?}");
            }
            // Cut off anywhere it is an error, never a panic.
            for length in (0..file.len() - 200).step_by(file.len() / 40) {
                std::fs::write(&path, &file[..length]).unwrap();
                let cut = pieces(&path, 700);
                assert!(!matches!(cut, Ok(Ok(_))), "{style:?}, {length}");
            }
        }
    }
}

const RAW: Style =
    Style { format: Format::AppendedRaw, compressor: "", wide: true, big: false, block: 96, version: "1.0" };

#[test]
fn cells_of_all_kinds_come_by_ranges() {
    let folder = Folder::new("ranges-mixed");
    let path = folder.write("a.vtu", &mixed_vtu(RAW));
    check(&path, "mixed");
    // Two pieces, whose points stay apart; between the cells of the first one a boundary.
    let (attributes, mut arrays) = piece(&sample(), "Float64", "Int32");
    let flat = |arrays: &mut Vec<Array>, name: &str, value: &dyn Fn(&[f64]) -> Vec<f64>| {
        let array = arrays.iter_mut().find(|array| array.name == name).unwrap();
        array.values = value(&array.values);
    };
    flat(&mut arrays, "types", &|_| [&[10.0; 6][..], &[5.0; 6], &[10.0; 6]].concat());
    flat(&mut arrays, "connectivity", &|ids| [&ids[..24], &[0.0, 1.0, 2.0].repeat(6), &ids[24..]].concat());
    let ends: Vec<f64> = [[4.0; 6], [3.0; 6], [4.0; 6]]
        .concat()
        .iter()
        .scan(0.0, |end, count| {
            *end += count;
            Some(*end)
        })
        .collect();
    flat(&mut arrays, "offsets", &|_| ends.clone());
    flat(&mut arrays, "left out", &|_| vec![1.0; 18]);
    let attributes = attributes.replace("Cells=\"12\"", "Cells=\"18\"");
    let two = [(attributes, arrays), piece(&sample(), "Float64", "Int32")];
    let path = folder.write("b.vtu", &xml(RAW, "UnstructuredGrid", "", &two));
    check(&path, "two pieces");
    // The time is an array as others.
    let mut timed = sample();
    timed.fields.iter_mut().for_each(|field| field.time = Some(2.5));
    let mut bytes = Vec::new();
    io::write_vtu(&timed, &mut bytes).unwrap();
    let path = folder.write("c.vtu", &bytes);
    assert_eq!(io::read(&path).unwrap().fields[0].time, Some(2.5));
    check(&path, "time");
}

/// What is done to the values of an array.
type Change<'a> = &'a dyn Fn(&mut Vec<f64>);

#[test]
fn errors_are_those_of_the_whole() {
    let folder = Folder::new("ranges-bad");
    let wrong = |name: &str, change: &dyn Fn(&mut Vec<f64>)| {
        let mut data = piece(&sample(), "Float64", "Int32");
        change(&mut data.1.iter_mut().find(|array| array.name == name).unwrap().values);
        let path = folder.write("a.vtu", &xml(RAW, "UnstructuredGrid", "", &[data]));
        (pieces(&path, 5), io::read(&path))
    };
    let changes: [(&str, Change<'_>); 5] = [
        ("connectivity", &|ids| ids[30] = 12.0),
        ("connectivity", &|ids| ids[47] = -1.0),
        ("offsets", &|ends| ends[8] = 37.0),
        ("offsets", &|ends| ends[6] = 3.0),
        ("types", &|types| types[9] = 41.0),
    ];
    for (name, change) in changes {
        let (found, expected) = wrong(name, change);
        assert_eq!(found.unwrap_err(), expected.unwrap_err(), "{name}");
    }
    // What is no number is for the whole to say, which knows whether a cell uses it.
    let (found, expected) = wrong("Points", &|points| points[9] = f64::NAN);
    assert!(found.is_ok() && expected.is_err());
    let whole = |types: &dyn Fn(&mut Vec<f64>)| wrong("types", types).0;
    assert_eq!(whole(&|types| types[3] = 42.0), Ok(Err(Some("it has polyhedra"))));
    assert_eq!(whole(&|types| types.fill(1.0)), Ok(Err(Some("it has no cells"))));
    let mut data = piece(&sample(), "Float64", "Int32");
    data.1.push(Array::new("CellData", "vtkGhostType", "UInt8", 1, &[0.0; 12]));
    let path = folder.write("b.vtu", &xml(RAW, "UnstructuredGrid", "", &[data]));
    assert_eq!(pieces(&path, 5), Ok(Err(Some("it marks cells or points as ghosts"))));
    for (name, bytes) in [("c.vtu", gzip(&sample_vtu(RAW))), ("d.vtu", sample_vtr(RAW))] {
        assert_eq!(pieces(&folder.write(name, &bytes), 5), Ok(Err(None)), "{name}");
    }
    assert!(pieces(&folder.0.join("none.vtu"), 5).is_err());
    // Counts that no file can have, which would not fit into numbers as bytes.
    for name in ["NumberOfPoints=\"", "NumberOfCells=\""] {
        let mut bytes = sample_vtu(RAW);
        let at = bytes.windows(name.len()).position(|word| word == name.as_bytes()).unwrap() + name.len();
        let length = bytes[at..].iter().position(|&byte| byte == b'"').unwrap();
        bytes.splice(at..at + length, *b"2305843009213693953");
        // As the data would say it, too.
        let data = bytes.iter().position(|&byte| byte == b'_').unwrap() + 1;
        bytes[data..].chunks_exact_mut(8).for_each(|number| number.fill(0xff));
        assert!(pieces(&folder.write("e.vtu", &bytes), 5).is_err(), "{name}");
    }
}

#[cfg(feature = "hdf5")]
#[test]
fn partitions_and_ranges_of_vtkhdf_are_the_whole() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    check(&data.join("cells.vtkhdf"), "ranges");
    let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
    let path = data.join("pieces.vtkhdf");
    let whole = io::read_with(&path, &options).unwrap();
    let found = joined(&pieces(&path, 1).unwrap().unwrap());
    assert_eq!((&found.positions, &found.tets), (&whole.positions, &whole.tets));
    assert_eq!((&found.fields, &found.cell_fields), (&whole.fields, &whole.cell_fields));
    assert_eq!(pieces(&data.join("polyhedra.vtkhdf"), 1), Ok(Err(Some("it has polyhedra"))));
    for other in ["image.vtkhdf", "netcdf4.exo", "steps.vtkhdf"] {
        assert_eq!(pieces(&data.join(other), 1), Ok(Err(None)), "{other}");
    }
    // Damaged ones are refused, or say what the whole says.
    let folder = Folder::new("ranges-hdf5");
    let bytes = std::fs::read(data.join("cells.vtkhdf")).unwrap();
    for bit in (0..8 * bytes.len()).step_by(97) {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let path = folder.write("a.vtkhdf", &damaged);
        if let (Ok(Ok(pieces)), Ok(whole)) = (pieces(&path, 5), io::read_with(&path, &options)) {
            let found = joined(&pieces);
            assert_eq!(
                (found.positions.len(), &found.tets),
                (whole.positions.len(), &whole.tets),
                "bit {bit}"
            );
        }
    }
}
