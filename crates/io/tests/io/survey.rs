//! Promise: a survey says of a file what reading it gives, without its values, and refuses no file that can be read.

use crate::damaged::files;
use crate::files::*;
use crate::polyhedra;
use tetralod::mesh::{Field, TetMesh, VectorPart};
use tetralod_io as io;
use tetralod_io::{CellData, ReadOptions, Survey};

fn described(fields: &[Field]) -> Vec<(&str, &str, Option<&VectorPart>)> {
    fields.iter().map(|field| (field.name.as_str(), field.unit.as_str(), field.vector.as_ref())).collect()
}

pub fn assert_agrees(survey: &Survey, mesh: &TetMesh, name: &str) {
    // Polyhedra may get points in their middle; points that several pieces have count in each.
    let points = mesh.positions.len() as u64;
    assert!(survey.points == points || name.contains("polyhedra") || survey.format == "pvtu", "{name}");
    assert!(survey.points <= points || survey.format == "pvtu", "{name}");
    // Hexahedra with points that are the same become fewer tetrahedra.
    // Where bent faces of polyhedra get points in their middle, there are more.
    let part = if name.contains("polyhedra") { 3 } else { 1 };
    assert!(part * survey.cells >= mesh.tets.len() as u64, "{name}");
    assert_eq!(survey.grid, mesh.grid, "{name}");
    assert_eq!(described(&survey.fields), described(&mesh.fields), "{name}");
    assert_eq!(described(&survey.cell_fields), described(&mesh.cell_fields), "{name}");
    assert!(survey.fields.iter().chain(&survey.cell_fields).all(|field| field.values.is_empty()), "{name}");
}

fn everything() -> ReadOptions {
    ReadOptions { cells: CellData::Values, ..ReadOptions::default() }
}

#[test]
fn of_every_format_and_encoding() {
    for (name, file, _) in files() {
        let survey = io::survey(&name, &file).unwrap();
        assert_agrees(&survey, &io::read_bytes_with(&name, &file, &everything()).unwrap(), &name);
        let mesh = io::read_bytes(&name, &file).unwrap();
        assert_eq!(survey.cells, mesh.tets.len() as u64, "{name}");
        assert!(name.ends_with(survey.format), "{name} is {}", survey.format);
        assert!(!survey.fields.is_empty(), "{name}");
    }
}

#[test]
fn of_legacy_files_with_cells_of_any_order() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for version in ["3.0", "5.1"] {
        let list = vec![0.0, 1.0, 2.0, 3.0];
        let file = legacy_vtk(version, false, &corners, &[list], &[71.0], &[0.0; 4], &[0.0]);
        assert_eq!(io::survey("a.vtk", &file).unwrap().cells, 1, "{version}");
    }
}

#[test]
fn of_cut_and_flipped_files_that_can_be_read() {
    for (name, mut file, _) in files().into_iter().chain(polyhedra::files()) {
        let agrees = |file: &[u8], what: &str| {
            let survey = io::survey(&name, file);
            if let Ok(mesh) = io::read_bytes_with(&name, file, &everything()) {
                assert_agrees(&survey.unwrap(), &mesh, &format!("{name} {what}"));
            }
        };
        (0..file.len()).for_each(|length| agrees(&file[..length], &format!("cut to {length}")));
        for bit in 0..8 * file.len() {
            file[bit / 8] ^= 1 << (bit % 8);
            agrees(&file, &format!("bit {bit}"));
            file[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

#[test]
fn what_is_not_read_is_refused_alike() {
    for file in
        ["", "hello", "<VTKFile type=\"PolyData\"><PolyData/></VTKFile>", "# vtk DataFile Version 9.0\nx\n"]
    {
        let error = io::survey("a.vtu", file.as_bytes()).unwrap_err();
        assert_eq!(error, io::read_bytes("a.vtu", file.as_bytes()).unwrap_err(), "{file}");
    }
}
