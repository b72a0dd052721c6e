//! Promise: cells of every type become tetrahedra that fit those of their neighbours, and fields at cells follow.

use crate::files::*;
use tetralod::mesh;
use tetralod::mesh::TetMesh;
use tetralod_io as io;
use tetralod_io::{CellData, ReadOptions};

fn everything(name: &str, file: &[u8]) -> TetMesh {
    let options = ReadOptions { cells: CellData::Values, ..ReadOptions::default() };
    io::read_bytes_with(name, file, &options).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn mixed_cells_are_split_alike_in_every_format() {
    let files = Style::all().into_iter().map(|style| (format!("{style:?}"), mixed_vtu(style)));
    let legacy = [("2.0", true), ("4.2", false), ("5.1", true), ("5.1", false)];
    let legacy = legacy.map(|(version, binary)| (format!("{version} {binary}"), mixed_vtk(version, binary)));
    for (name, file) in files.chain(legacy) {
        let found = everything(&name, &file);
        let of_cells: Vec<f64> = [(0, 6), (2, 3), (3, 2), (4, 1)]
            .iter()
            .flat_map(|&(cell, tets)| std::iter::repeat_n(f64::from(cell), tets))
            .collect();
        assert_eq!(found.cell_fields[0].values, of_cells, "{name}");
        assert_eq!(TetMesh { cell_fields: Vec::new(), ..found }, mixed_sample(), "{name}");
    }
}

#[test]
fn neighbours_of_different_types_meet() {
    let (mended, report) = mesh::repair(mixed_sample()).unwrap();
    assert_eq!(report.to_string(), "");
    let topology = mesh::topology(mended.positions.len(), &mended.tets).unwrap();
    // The hexahedron has 4 squares left, the wedge 2 and a triangle, the pyramid 4 triangles, the tetrahedron 3.
    assert_eq!((topology.components, topology.boundary_faces), (1, 8 + 4 + 1 + 4 + 3));
}

#[test]
fn grids_with_places_of_their_own_in_every_format() {
    for style in Style::all() {
        assert_eq!(io::read_bytes("a.vtr", &sample_vtr(style)).unwrap(), uneven_sample(), "{style:?}");
        assert_eq!(io::read_bytes("a.vts", &sample_vts(style)).unwrap(), uneven_sample(), "{style:?}");
    }
    for binary in [false, true] {
        assert_eq!(io::read_bytes("a.vtk", &sample_rectilinear_vtk(binary)).unwrap(), uneven_sample());
        assert_eq!(io::read_bytes("a.vtk", &sample_structured_vtk(binary)).unwrap(), uneven_sample());
    }
}

#[test]
fn rectilinear_grids_without_data_do_not_size_anything() {
    let many = vec!["1"; 400].join(" ");
    let array = format!("<DataArray type=\"Int8\" format=\"ascii\">{many}</DataArray>").repeat(3);
    let file = format!(
        "<VTKFile type=\"RectilinearGrid\"><RectilinearGrid WholeExtent=\"0 399 0 399 0 399\"><Piece \
         Extent=\"0 399 0 399 0 399\"><Coordinates>{array}</Coordinates></Piece></RectilinearGrid></VTKFile>"
    );
    let error = io::read_bytes("a.vtr", file.as_bytes()).unwrap_err();
    assert!(
        error.to_string().contains("an array with a value for every point or cell is missing"),
        "{error}"
    );
    let axis = |name: &str| format!("{name}_COORDINATES 400 char\n{many}\n");
    let axes = ["X", "Y", "Z"].map(axis).concat();
    let file = format!(
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 400 400 400\n{axes}"
    );
    let error = io::read_bytes("a.vtk", file.as_bytes()).unwrap_err();
    assert!(
        error.to_string().contains("an array with a value for every point or cell is missing"),
        "{error}"
    );
}

#[test]
fn cells_that_another_piece_has_and_hidden_ones_are_left_out() {
    let file = String::from_utf8(mixed_vtu(Style::PLAIN)).unwrap();
    let ghosts =
        "<CellData><DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">1 0 32 0 2</DataArray>";
    let found = everything("a.vtu", file.replace("<CellData>", ghosts).as_bytes());
    assert_eq!(found.tets, mixed_sample().tets[9..]);
    assert_eq!((found.cell_fields.len(), found.cell_fields[0].name.as_str()), (1, "m"));
    assert_eq!(found.cell_fields[0].values, [3.0, 3.0, 4.0]);
}
