//! Promises of what readers tell of fields: units, times, vectors, fields at cells, and that no more is kept than is wanted.

use tetralod::mesh::TetMesh;
use tetralod_io as io;
use tetralod_io::{CellData, ReadOptions};

fn read(name: &str, file: &str, options: &ReadOptions) -> TetMesh {
    io::read_bytes_with(name, file.as_bytes(), options).unwrap_or_else(|error| panic!("{error}"))
}

fn cells(cells: CellData) -> ReadOptions {
    ReadOptions { cells, ..ReadOptions::default() }
}

fn only(names: &[&str], cells: CellData) -> ReadOptions {
    ReadOptions {
        fields: Some(names.iter().map(|&name| name.to_owned()).collect()),
        cells,
        ..ReadOptions::default()
    }
}

fn names(mesh: &TetMesh) -> Vec<&str> {
    mesh.fields.iter().chain(&mesh.cell_fields).map(|field| field.name.as_str()).collect()
}

/// One tetrahedron with units, a time, and fields at its cell.
const VTK: &str = "# vtk DataFile Version 5.1\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\n\
    FIELD FieldData 1\nTimeValue 1 1 double\n-1.5\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\n\
    METADATA\nINFORMATION 1\nNAME UNITS_LABEL LOCATION vtkDataArray\nDATA mm\n\n\
    CELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\n\
    CELL_DATA 1\nSCALARS rho float 1\nLOOKUP_TABLE default\n7.5\n\
    METADATA\nINFORMATION 1\nNAME UNITS_LABEL LOCATION vtkDataArray\nDATA kg%20m-3\n\n\
    POINT_DATA 4\nSCALARS p int 1\nLOOKUP_TABLE default\n1 2 3 4\n\
    FIELD FieldData 2\nU 3 4 float\n1 2 3 4 5 6 7 8 9 1 2 3\n\
    METADATA\nINFORMATION 1\nNAME UNITS_LABEL LOCATION vtkDataArray\nDATA m/s\n\n\
    bad 1 4 float\nnan nan nan nan\n";

#[test]
fn legacy_files_tell_units_and_times() {
    let mesh = read("a.vtk", VTK, &only(&["p", "U", "rho"], CellData::Values));
    assert_eq!(names(&mesh), ["p", "U_x", "U_y", "U_z", "rho"]);
    let units: Vec<&str> = mesh.fields.iter().map(|field| field.unit.as_str()).collect();
    assert_eq!(units, ["", "m/s", "m/s", "m/s"]);
    assert_eq!((mesh.cell_fields[0].unit.as_str(), &mesh.cell_fields[0].values[..]), ("kg m-3", &[7.5][..]));
    assert!(mesh.fields.iter().chain(&mesh.cell_fields).all(|field| field.time == Some(-1.5)));
    assert_eq!((mesh.fields[0].integer, mesh.fields[1].integer), (true, false));
    let before =
        VTK.replace("DATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTimeValue 1 1 double\n-1.5\n", "");
    let before = before
        .replace("ASCII\n", "ASCII\nFIELD FieldData 1\nTimeValue 1 1 double\n3\nDATASET UNSTRUCTURED_GRID\n");
    assert_eq!(read("a.vtk", &before, &only(&["p"], CellData::LeaveOut)).fields[0].time, Some(3.0));
}

#[test]
fn what_is_not_wanted_may_be_anything() {
    let error = io::read_bytes("a.vtk", VTK.as_bytes()).expect_err("values that are not finite");
    assert!(error.to_string().contains("point 0"), "{error}");
    assert_eq!(names(&read("a.vtk", VTK, &only(&["U_y"], CellData::Names))), ["U_y"]);
    let bad_cell = VTK.replace("7.5", "inf").replace("nan", "0");
    assert_eq!(names(&read("a.vtk", &bad_cell, &cells(CellData::LeaveOut))).len(), 6);
    assert_eq!(names(&read("a.vtk", &bad_cell, &cells(CellData::Names))).last(), Some(&"rho"));
    let error = io::read_bytes_with("a.vtk", bad_cell.as_bytes(), &cells(CellData::Values));
    assert!(error.expect_err("a value that is not finite").to_string().contains("cell 0"));
    let short = VTK.replace("nan", "0").replace("CELL_DATA 1\n", "CELL_DATA 2\n").replace("7.5\n", "7.5 8\n");
    let error = io::read_bytes_with("a.vtk", short.as_bytes(), &cells(CellData::Values));
    assert!(error.expect_err("a value too many").to_string().contains("CELL_DATA"));
}

/// One tetrahedron; `more` goes into its piece.
fn vtu(data_set: &str, pieces: &[&str]) -> String {
    let piece = |more: &&str| {
        format!(
            "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">{more}<Points>\
             <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray>\
             </Points><Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\
             <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece>"
        )
    };
    let pieces: String = pieces.iter().map(piece).collect();
    format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{data_set}{pieces}</UnstructuredGrid></VTKFile>"
    )
}

const POINT_DATA: &str = "<PointData><DataArray type=\"Float32\" Name=\"p\" Unit=\"Pa\" format=\"ascii\">1 2 3 4</DataArray>\
    <DataArray type=\"Int8\" Name=\"n\" format=\"ascii\">1 2 3 4\
    <InformationKey name=\"OTHER\" location=\"x\">no</InformationKey>\
    <InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">mol</InformationKey></DataArray></PointData>";

#[test]
fn xml_files_tell_units_and_times() {
    let time = |text: &str| {
        format!(
            "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{text}</DataArray></FieldData>"
        )
    };
    let mesh = read("a.vtu", &vtu(&time("0.25"), &[POINT_DATA]), &ReadOptions::default());
    let told: Vec<_> =
        mesh.fields.iter().map(|f| (f.name.as_str(), f.unit.as_str(), f.time, f.integer)).collect();
    assert_eq!(told, [("p", "Pa", Some(0.25), false), ("n", "mol", Some(0.25), true)]);
    assert_eq!(mesh.fields[1].values, [1.0, 2.0, 3.0, 4.0]);
    for not_a_time in ["nan", "x", "1 2", ""] {
        let mesh = read("a.vtu", &vtu(&time(not_a_time), &[POINT_DATA]), &ReadOptions::default());
        assert_eq!(mesh.fields[0].time, None, "{not_a_time}");
    }
}

#[test]
fn xml_pieces_have_fields_at_their_cells() {
    let cell = |value: &str| {
        format!(
            "<CellData><DataArray type=\"Float32\" Name=\"c\" format=\"ascii\">{value}</DataArray></CellData>"
        )
    };
    let (one, two) = (cell("5"), cell("6"));
    let both = vtu("", &[&one, &two]);
    assert_eq!(read("a.vtu", &both, &cells(CellData::Values)).cell_fields[0].values, [5.0, 6.0]);
    let named = read("a.vtu", &both, &cells(CellData::Names)).cell_fields;
    assert!(named.len() == 1 && named[0].values.is_empty());
    assert!(read("a.vtu", &both, &cells(CellData::LeaveOut)).cell_fields.is_empty());
    let error = io::read_bytes_with("a.vtu", vtu("", &[&one, ""]).as_bytes(), &cells(CellData::Values));
    assert!(error.expect_err("a piece without the field").to_string().contains("\"c\""));
    let error = io::read_bytes_with("a.vtu", vtu("", &[&cell("nan")]).as_bytes(), &cells(CellData::Values));
    assert!(error.expect_err("not finite").to_string().contains("cell 0"));
}

#[test]
fn cubes_of_grids_give_their_values_to_their_tetrahedra() {
    let piece = |extent: &str, values: &str| {
        format!(
            "<Piece Extent=\"{extent}\"><CellData><DataArray type=\"UInt8\" Name=\"c\" format=\"ascii\">{values}</DataArray>\
             </CellData></Piece>"
        )
    };
    let file = |pieces: &str| {
        format!(
            "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 3 0 1 0 1\">{pieces}</ImageData></VTKFile>"
        )
    };
    let whole = read("a.vti", &file(&piece("0 3 0 1 0 1", "1 2 3")), &cells(CellData::Values));
    let parts = [piece("0 1 0 1 0 1", "1"), piece("1 3 0 1 0 1", "2 3")].concat();
    assert_eq!(read("a.vti", &file(&parts), &cells(CellData::Values)), whole);
    assert_eq!(whole.cell_fields[0].values.len(), whole.tets.len());
    for (tet, value) in whole.tets.iter().zip(&whole.cell_fields[0].values) {
        let x = tet.iter().map(|&v| whole.positions[v as usize][0]).fold(f64::INFINITY, f64::min);
        assert_eq!(x + 1.0, *value);
    }
    // A grid that nothing is read of must have values even so: else nothing says that it is not of any size.
    let unread = read("a.vti", &file(&piece("0 3 0 1 0 1", "1 2 3")), &cells(CellData::LeaveOut));
    assert_eq!((unread.tets.len(), unread.fields.len() + unread.cell_fields.len()), (whole.tets.len(), 0));
    assert!(io::read_bytes("a.vti", file(&piece("0 3 0 1 0 1", "1 2")).as_bytes()).is_err());
    assert!(
        io::read_bytes_with("a.vti", file(&parts[..parts.len() / 2]).as_bytes(), &cells(CellData::Values))
            .is_err()
    );
}

#[test]
fn no_cut_of_a_file_with_all_that_panics() {
    let time = "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" format=\"ascii\">1</DataArray></FieldData>";
    for (name, file) in [("a.vtk", VTK.replace("nan", "0")), ("a.vtu", vtu(time, &[POINT_DATA]))] {
        for length in 0..file.len() {
            if let Ok(mesh) = io::read_bytes_with(name, &file.as_bytes()[..length], &cells(CellData::Values))
            {
                assert!(mesh.fields.iter().all(|field| field.values.len() == mesh.positions.len()));
                assert!(mesh.cell_fields.iter().all(|field| field.values.len() == mesh.tets.len()));
            }
        }
    }
}
