//! Promise: files of meshers and images are recognised by their content, and read with what lies beside them.

use std::fs;
use tetralod_io as io;

pub const TETGEN: [(&str, &str); 2] = [
    ("a.1.node", "4 3 1 0\n0 0 0 0 10\n1 1 0 0 20\n2 0 1 0 30\n3 0 0 1 40\n"),
    ("a.1.ele", "1 4 0\n0 0 1 2 3\n"),
];
pub const MEDIT: [(&str, &str); 2] = [
    (
        "a.mesh",
        "MeshVersionFormatted 1\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 1\n1 2 3 4 0\nEnd\n",
    ),
    ("a.sol", "MeshVersionFormatted 1\nDimension 3\nSolAtVertices 4\n1 1\n10 20 30 40\nEnd\n"),
];
pub const META: [(&str, &str); 2] = [
    (
        "a.mhd",
        "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementSpacing = 1 1 2\nElementDataFile = a.zraw\n",
    ),
    ("a.zraw", "ABCDEFGH"),
];
pub const NRRD: [(&str, &str); 2] = [
    ("a.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: a.raw\n\n"),
    ("a.raw", "ABCDEFGH"),
];

#[test]
fn files_are_read_with_those_beside_them() {
    let folder = std::env::temp_dir().join(format!("tetralod-meshers-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    for (name, content) in [TETGEN, MEDIT, META, NRRD].iter().flatten() {
        fs::write(folder.join(name), content).unwrap();
    }
    let read = |name: &str| io::read(&folder.join(name)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(read("a.1.node"), read("a.1.ele"));
    for name in ["a.1.node", "a.mesh"] {
        let mesh = read(name);
        assert_eq!(mesh.tets, [[0, 1, 2, 3]], "{name}");
        assert_eq!(mesh.fields[0].values, [10.0, 20.0, 30.0, 40.0], "{name}");
    }
    for name in ["a.mhd", "a.nhdr"] {
        let mesh = read(name);
        assert_eq!((mesh.tets.len(), mesh.fields[0].values[7]), (6, 72.0), "{name}");
    }
    fs::remove_file(folder.join("a.1.ele")).unwrap();
    let error = io::read(&folder.join("a.1.node")).unwrap_err();
    assert!(error.file.ends_with("a.1.ele"), "{error}");
    fs::remove_file(folder.join("a.zraw")).unwrap();
    let error = io::read(&folder.join("a.mhd")).unwrap_err().to_string();
    assert!(error.contains("a.mhd: ElementDataFile: \"a.zraw\": "), "{error}");
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn formats_are_named_by_their_content() {
    for (content, format) in [
        ("$MeshFormat\n", Some("gmsh")),
        ("\n$NOD\n", Some("gmsh")),
        (MEDIT[0].1, Some("medit")),
        (META[0].1, Some("metaimage")),
        (NRRD[0].1, Some("nrrd")),
        ("# made by hand\nmesh3d\n", Some("netgen")),
        ("# vtk DataFile Version 3.0\n", Some("vtk")),
        ("<?xml version=\"1.0\"?>\n<VTKFile type='PUnstructuredGrid'>", Some("pvtu")),
        ("<VTKFile type=\"StructuredGrid\"", Some("vts")),
        ("<VTKFile type=", None),
        (TETGEN[0].1, None),
        ("", None),
    ] {
        assert_eq!(io::format_of(content.as_bytes()), format, "{content}");
    }
    let survey = io::survey("a.mesh", MEDIT[0].1.as_bytes()).unwrap();
    assert_eq!((survey.format, survey.points, survey.cells), ("medit", 4, 1));
    let error = io::read_bytes("a.mhd", META[0].1.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("a file that needs another (\"a.zraw\")"), "{error}");
}
