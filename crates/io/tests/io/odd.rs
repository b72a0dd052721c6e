//! Valid files of VTK's formats that are unusual: hidden cells, turned grids, cells of any order, empty pieces, packed files, and what
//! nobody asked for.

use crate::curved::HEXAHEDRON;
use crate::data::real_data;
use crate::files::gzip;
use tetralod::mesh::TetMesh;
use tetralod_io::{self as io, CellData, ReadOptions};

fn read_with(name: &str, file: &[u8], options: &ReadOptions) -> TetMesh {
    io::read_bytes_with(name, file, options).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn read(name: &str, file: &str) -> TetMesh {
    read_with(name, file.as_bytes(), &ReadOptions::default())
}

fn refused(name: &str, file: &str) -> String {
    io::read_bytes(name, file.as_bytes()).unwrap_err().to_string()
}

/// The options for these fields alone.
fn only(names: &[&str]) -> ReadOptions {
    let fields = Some(names.iter().map(|&name| name.to_owned()).collect());
    ReadOptions { fields, cells: CellData::Values, ..ReadOptions::default() }
}

fn volume(mesh: &TetMesh) -> f64 {
    let volume = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| glam::DVec3::from_array(mesh.positions[v as usize]));
        ((b - a).cross(c - a).dot(d - a) / 6.0).abs()
    };
    mesh.tets.iter().map(volume).sum()
}

fn list<T: ToString>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|value| value.to_string()).collect::<Vec<_>>().join(" ")
}

fn array(name: &str, kind: &str, components: usize, values: &str) -> String {
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">{values}</DataArray>"
    )
}

fn document(kind: &str, attributes: &str, body: &str) -> String {
    format!(
        "<VTKFile type=\"{kind}\" version=\"2.2\" byte_order=\"LittleEndian\"><{kind} {attributes}>{body}</{kind}></VTKFile>"
    )
}

/// A piece of an unstructured grid.
fn piece(points: &[[f64; 3]], cells: &[(u8, &[usize])], data: &str) -> String {
    let mut end = 0;
    let ends = cells.iter().map(|(_, points)| {
        end += points.len();
        end
    });
    format!(
        "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">{data}<Points>{}</Points><Cells>{}{}{}</Cells></Piece>",
        points.len(),
        cells.len(),
        array("Points", "Float64", 3, &list(points.iter().flatten())),
        array("connectivity", "Int64", 1, &list(cells.iter().flat_map(|(_, points)| points.iter()))),
        array("offsets", "Int64", 1, &list(ends)),
        array("types", "UInt8", 1, &list(cells.iter().map(|(kind, _)| kind))),
    )
}

fn vtu(points: &[[f64; 3]], cells: &[(u8, &[usize])], data: &str) -> String {
    document("UnstructuredGrid", "", &piece(points, cells, data))
}

const TETRAHEDRON: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const ALL: [usize; 4] = [0, 1, 2, 3];

/// Points of a grid of two cubes along x, with values that are their numbers.
fn two_cubes() -> (Vec<[f64; 3]>, String) {
    let points = (0..12).map(|i| [i % 3, i / 3 % 2, i / 6].map(f64::from)).collect();
    (points, list(0..12))
}

/// The same grid in every structured format of VTK, with these flags at points and cubes.
fn grids(of_points: &str, of_cubes: &str) -> Vec<(&'static str, String)> {
    let (points, values) = two_cubes();
    let places = list(points.iter().flatten());
    let data = format!(
        "<PointData>{}{}</PointData><CellData>{}</CellData>",
        array("T", "Float64", 1, &values),
        array("vtkGhostType", "UInt8", 1, of_points),
        array("vtkGhostType", "UInt8", 1, of_cubes)
    );
    let extent = "0 2 0 1 0 1";
    let whole = format!("WholeExtent=\"{extent}\"");
    let xml = |kind: &str, more: &str| {
        document(kind, &whole, &format!("<Piece Extent=\"{extent}\">{data}{more}</Piece>"))
    };
    let axis = |values: &str| array("", "Float64", 1, values);
    let axes = format!("<Coordinates>{}{}{}</Coordinates>", axis("0 1 2"), axis("0 1"), axis("0 1"));
    let placed = format!("<Points>{}</Points>", array("", "Float64", 3, &places));
    let legacy = |head: &str| {
        format!(
            "# vtk DataFile Version 3.0\nx\nASCII\nDATASET {head}\nCELL_DATA 2\nFIELD f 1\nvtkGhostType 1 2 unsigned_char\n{of_cubes}\n\
             POINT_DATA 12\nSCALARS T double\nLOOKUP_TABLE default\n{values}\nFIELD f 1\nvtkGhostType 1 12 unsigned_char\n{of_points}\n"
        )
    };
    vec![
        ("a.vti", xml("ImageData", "")),
        ("a.vtr", xml("RectilinearGrid", &axes)),
        ("a.vts", xml("StructuredGrid", &placed)),
        ("points.vtk", legacy("STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 0 0 0\nSPACING 1 1 1")),
        ("grid.vtk", legacy(&format!("STRUCTURED_GRID\nDIMENSIONS 3 2 2\nPOINTS 12 double\n{places}"))),
        (
            "axes.vtk",
            legacy(
                "RECTILINEAR_GRID\nDIMENSIONS 3 2 2\nX_COORDINATES 3 double\n0 1 2\nY_COORDINATES 2 double\n0 1\n\
                 Z_COORDINATES 2 double\n0 1",
            ),
        ),
        (
            "cells.vtk",
            legacy(&format!(
                "UNSTRUCTURED_GRID\nPOINTS 12 double\n{places}\nCELLS 2 18\n8 0 1 4 3 6 7 10 9\n8 1 2 5 4 7 8 11 10\n\
                 CELL_TYPES 2\n12 12"
            )),
        ),
    ]
}

#[test]
fn hidden_cubes_and_points_are_left_out_in_every_format() {
    let none = list([0; 12]);
    for (name, file) in grids(&none, "0 0") {
        let mesh = read(name, &file);
        assert!((volume(&mesh) - 2.0).abs() < 1e-12 && mesh.input.lines().is_empty(), "{name}");
    }
    for (flag, what) in [(32, "hidden"), (1, "ghost")] {
        for (name, file) in grids(&none, &format!("0 {flag}")) {
            let mesh = read(name, &file);
            assert!((volume(&mesh) - 1.0).abs() < 1e-12, "{name}");
            assert_eq!(mesh.input.lines(), [format!("left out: 1 {what} cell")], "{name}");
            assert!(mesh.grid.is_none(), "{name}");
            assert_eq!(mesh.fields.len(), 1, "{name}");
        }
    }
    // A point of the second cube alone.
    for (name, file) in grids("0 0 2 0 0 0 0 0 0 0 0 0", "0 0") {
        assert!((volume(&read(name, &file)) - 1.0).abs() < 1e-12, "{name}");
    }
}

#[test]
fn what_is_hidden_may_hold_anything() {
    for (name, file) in grids(&list([0; 12]), "0 32") {
        let file = file.replace("0 1 2 3 4 5 6 7 8 9 10 11", "0 1 nan 3 4 5 6 7 8 9 10 11");
        assert!(read(name, &file).fields[0].values.iter().all(|value| value.is_finite()), "{name}");
    }
    for (name, file) in grids(&list([0; 12]), "0 0") {
        let file = file.replace("0 1 2 3 4 5 6 7 8 9 10 11", "0 1 nan 3 4 5 6 7 8 9 10 11");
        let error = refused(name, &file);
        assert!(error.contains("\"T\" at point 2"), "{name}: {error}");
    }
}

#[test]
fn turned_images_are_placed() {
    let grid = |direction: &str| {
        let attributes = format!(
            "WholeExtent=\"1 2 0 2 0 1\" Origin=\"10 20 30\" Spacing=\"1 2 3\" Direction=\"{direction}\""
        );
        let values = array("T", "Float64", 1, &list(0..12));
        let piece = format!("<Piece Extent=\"1 2 0 2 0 1\"><PointData>{values}</PointData></Piece>");
        document("ImageData", &attributes, &piece)
    };
    // As vtkImageData::TransformIndexToPhysicalPoint has them.
    let mesh = read("a.vti", &grid("-1 0 0 0 -1 0 0 0 1"));
    assert_eq!((mesh.positions[0], mesh.positions[11]), ([9.0, 20.0, 30.0], [8.0, 16.0, 33.0]));
    assert!(mesh.grid.is_none() && (volume(&mesh) - 12.0).abs() < 1e-12);
    // The axes are the columns.
    let mesh = read("a.vti", &grid("0 -1 0 1 0 0 0 0 1"));
    assert_eq!((mesh.positions[0], mesh.positions[11]), ([10.0, 21.0, 30.0], [6.0, 22.0, 33.0]));
    assert_eq!(io::survey("a.vti", grid("0 -1 0 1 0 0 0 0 1").as_bytes()).unwrap().points, 12);
    assert!(read("a.vti", &grid("1 0 0 0 1 0 0 0 1")).grid.is_some());
    assert!(refused("a.vti", &grid("1 0 0 0 1 0 0 0 0")).contains("not 0"));
}

#[test]
fn cells_of_any_order_are_read_up_to_the_second() {
    let mesh = read("a.vtu", &vtu(&TETRAHEDRON, &[(71, &ALL)], ""));
    assert_eq!(mesh.tets.len(), 1);
    let middle = |a: usize, b: usize| [0, 1, 2].map(|i| (TETRAHEDRON[a][i] + TETRAHEDRON[b][i]) / 2.0);
    let middles = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)].map(|(a, b)| middle(a, b));
    let points = [&TETRAHEDRON[..], &middles[..]].concat();
    let all: Vec<usize> = (0..10).collect();
    let file = vtu(&points, &[(71, &all)], "");
    assert_eq!(read("a.vtu", &file).tets.len(), 8);
    assert!((volume(&read("a.vtu", &file)) - 1.0 / 6.0).abs() < 1e-12);
    assert_eq!(io::survey("a.vtu", file.as_bytes()).unwrap().cells, 8);
    let twenty: Vec<usize> = (0..20).collect();
    let error = refused("a.vtu", &vtu(&[points.as_slice(), &points].concat(), &[(71, &twenty)], ""));
    assert!(error.contains("1 Lagrange tetrahedron of 20 points") && error.contains("order"), "{error}");
    let error = refused("a.vtu", &vtu(&points, &[(78, &all)], ""));
    assert!(error.contains("1 Bezier tetrahedron of 10 points"), "{error}");
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn hexahedra_of_old_versions_have_two_edges_in_another_order() {
    // The order of version 9: corners, edges (upright ones at corners 0, 1, 2, 3), faces, middle.
    let middles = [[0, 1, 1], [2, 1, 1], [1, 0, 1], [1, 2, 1], [1, 1, 0], [1, 1, 2], [1, 1, 1]];
    let order = [HEXAHEDRON.1, &middles].concat();
    let mut points: Vec<[f64; 3]> = order.iter().map(|p| p.map(f64::from)).collect();
    let all: Vec<usize> = (0..27).collect();
    let file = |points: &[[f64; 3]]| vtu(points, &[(72, &all)], "");
    let is_sound = |file: &str| {
        let mesh = read("a.vtu", file);
        tetralod::mesh::check(&mesh).is_ok() && (volume(&mesh) - 8.0).abs() < 1e-12
    };
    assert!(is_sound(&file(&points)));
    points.swap(18, 19);
    let old = file(&points);
    assert!(is_sound(&old.replace("version=\"2.2\"", "version=\"1.0\"")));
    assert!(!is_sound(&old));
}

#[test]
fn what_nobody_asked_for_is_not_judged() {
    let (points, cells) = (TETRAHEDRON, [(10, &ALL[..])]);
    let data = format!(
        "<PointData>{}{}{}{}</PointData>",
        array("bad", "Float64", 1, "1 nan 2 3"),
        array("many", "Float64", 1100, &list([0; 4400])),
        array("short", "Float64", 1, "1 2"),
        array("T", "Float64", 1, "1 2 3 4")
    );
    let file = vtu(&points, &cells, &data);
    let mesh = read_with("a.vtu", file.as_bytes(), &only(&["T"]));
    assert_eq!((mesh.fields.len(), &mesh.fields[0].values), (1, &vec![1.0, 2.0, 3.0, 4.0]));
    let others: Vec<&str> = mesh.input.other_fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(others, ["bad", "many", "short"]);
    let names = io::survey("a.vtu", file.as_bytes()).unwrap().fields;
    assert_eq!(
        names.iter().map(|field| field.name.as_str()).collect::<Vec<_>>(),
        ["bad", "many", "short", "T"]
    );
    let error = io::read_bytes_with("a.vtu", file.as_bytes(), &only(&["bad"])).unwrap_err().to_string();
    assert!(error.contains("\"bad\" at point 1"), "{error}");

    let legacy = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n\
                  CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nSCALARS bad float\nLOOKUP_TABLE default\n1 nan x 3\n\
                  FIELD f 2\nmany 1100 0 float\n\nT 1 4 float\n1 2 3 4\n";
    let mesh = read_with("a.vtk", legacy.as_bytes(), &only(&["T"]));
    assert_eq!((mesh.fields.len(), mesh.fields[0].values[3]), (1, 4.0));
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn points_that_no_cell_uses_may_have_no_place() {
    let points = [&TETRAHEDRON[..], &[[f64::NAN, 0.0, f64::INFINITY]]].concat();
    let data = |values: &str| format!("<PointData>{}</PointData>", array("T", "Float64", 1, values));
    let file = |values: &str| vtu(&points, &[(10, &ALL)], &data(values)).replace("NaN", "nan");
    let mesh = read("a.vtu", &file("1 2 3 4 nan"));
    assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
    let (mended, report) = tetralod::mesh::repair(mesh).unwrap();
    assert_eq!((mended.positions.len(), report.unused_points), (4, 1));
    assert!(refused("a.vtu", &file("1 2 3 nan 5")).contains("\"T\" at point 3"));
}

#[test]
fn empty_pieces_are_skipped() {
    let full = piece(
        &TETRAHEDRON,
        &[(10, &ALL)],
        &format!("<PointData>{}</PointData>", array("T", "Float64", 1, "1 2 3 4")),
    );
    let empty = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>";
    let mesh = read("a.vtu", &document("UnstructuredGrid", "", &format!("{empty}{full}{empty}")));
    assert_eq!((mesh.tets.len(), mesh.fields[0].values.len()), (1, 4));
    let values = array("T", "Float64", 1, &list(0..8));
    let parts = format!(
        "<Piece Extent=\"0 -1 0 -1 0 -1\"/><Piece Extent=\"0 1 0 1 0 1\"><PointData>{values}</PointData></Piece>"
    );
    assert_eq!(read("a.vti", &document("ImageData", "WholeExtent=\"0 1 0 1 0 1\"", &parts)).tets.len(), 6);
}

#[test]
fn what_is_not_stated_is_text() {
    let file = vtu(&TETRAHEDRON, &[(10, &ALL)], "");
    for format in ["format=\"ASCII\"", "format=\"Ascii\"", ""] {
        assert_eq!(read("a.vtu", &file.replace("format=\"ascii\"", format)).tets.len(), 1, "{format}");
    }
}

#[test]
fn packed_files_are_unpacked_or_named() {
    let file = vtu(&TETRAHEDRON, &[(10, &ALL)], "");
    let packed = gzip(file.as_bytes());
    assert_eq!(read_with("a.vtu.gz", &packed, &ReadOptions::default()), read("a.vtu", &file));
    assert_eq!((io::format_of(&packed), io::survey("a", &packed).unwrap().points), (Some("vtu"), 4));
    let error = io::read_bytes("a.vtu.bz2", b"BZh91AY&SY").unwrap_err().to_string();
    assert!(error.contains("bzip2") && error.contains("unpack it first"), "{error}");
}

#[test]
fn surfaces_are_called_surfaces() {
    let triangle = vtu(&TETRAHEDRON, &[(5, &ALL[..3])], "");
    let legacy = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 2\n";
    let poly = document("PolyData", "", "<Piece NumberOfPoints=\"0\"/>");
    for (name, file) in [("a.vtu", triangle.as_str()), ("a.vtk", legacy), ("a.vtp", &poly)] {
        let error = refused(name, file);
        assert!(error.contains("no volume") && error.contains("tetrahedra first"), "{error}");
    }
}

#[test]
fn messages_name_the_cells_of_the_input() {
    // A hexahedron that is turned inside itself: one of its corners is pulled through it.
    let (mut points, _) = two_cubes();
    points[11] = [-3.0, -3.0, -3.0];
    let cells: [(u8, &[usize]); 3] =
        [(5, &[0, 1, 2]), (12, &[0, 1, 4, 3, 6, 7, 10, 9]), (12, &[1, 2, 5, 4, 7, 8, 11, 10])];
    let mesh = read("a.vtu", &vtu(&points, &cells, ""));
    assert_eq!(mesh.input.lines(), ["left out: 1 triangle"]);
    let error = tetralod::mesh::repair(mesh).unwrap_err().to_string();
    assert!(error.contains("cell 2 (hexahedron)") || error.contains("2 (hexahedron)"), "{error}");
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn odd_inputs_have_their_right_values() {
    let folder = real_data().join("field");
    let load = |name: &str| io::read(&folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
    assert!((volume(&load("blank.vts")) - 32.0).abs() < 1e-9);
    assert!(volume(&load("lag_tet2.vtu")) > 0.0);
    assert!(load("dir_lps.vti").tets.len() > 1);
    assert_eq!(load("empty_first.pvtu").fields.len(), 1);
    assert!(!load("format_ASCII.vtu").tets.is_empty() && !load("g.vtu.gz").tets.is_empty());
    assert_eq!(io::steps(&folder.join("notime.pvd")).unwrap().len(), 1);
    for name in ["nan_field.vtk", "manycomp.vtu"] {
        let mesh = io::read_with(&folder.join(name), &only(&["T"])).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(mesh.fields.len(), 1, "{name}");
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn comments_between_numbers_are_nothing_however_many() {
    // The white space is looked at once, not again at each comment: that would take a minute.
    let (space, comments) = (" ".repeat(1 << 20), "<!-- -->".repeat(1 << 17));
    let file = |points: &str| {
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points>\
             <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{points}</DataArray></Points><Cells>\
             <DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\
             <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"
        )
    };
    let plain = read("plain.vtu", &file("0 0 0 1 0 0 0 1 0 0 0 1"));
    for points in [
        format!("0{space}{comments}0 0 1 0 0 0 1 0 0 0 1"),
        format!("{space}{comments} {comments}0 0 0 1 0 0 0 1 0 0 0 1"),
        "0 0 0<!-- --> <!-- -->1 0 0 0<!-- -->\n<!-- -->1 0 0 0 1".to_owned(),
    ] {
        assert_eq!(read("comments.vtu", &file(&points)), plain);
    }
}
