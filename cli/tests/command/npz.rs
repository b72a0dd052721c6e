//! Promise: `.npz` files have the arrays of the other formats, as NumPy reads them.

use crate::support::{Folder, bucky, good};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use tetralod_io::read;
use zip::ZipArchive;

/// An array: its type and shape as NumPy writes them, and its bytes.
struct Array {
    number: String,
    shape: String,
    bytes: Vec<u8>,
}

impl Array {
    fn doubles(&self) -> Vec<f64> {
        assert_eq!(self.number, "<f8");
        self.bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
    }

    fn singles(&self) -> Vec<f32> {
        assert_eq!(self.number, "<f4");
        self.bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
    }

    fn indices(&self) -> Vec<u32> {
        assert_eq!(self.number, "<u4");
        self.bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect()
    }
}

/// The text between two others.
fn between<'a>(text: &'a str, before: &str, after: &str) -> &'a str {
    let (_, rest) = text.split_once(before).expect("a key");
    rest.split_once(after).expect("its end").0
}

/// The arrays of a file by name, read by the description of the format.
fn arrays(path: &str) -> BTreeMap<String, Array> {
    let mut archive = ZipArchive::new(File::open(path).expect("a file")).expect("an archive");
    let mut arrays = BTreeMap::new();
    for number in 0..archive.len() {
        let mut entry = archive.by_index(number).expect("an entry");
        let name = entry.name().expect("UTF-8").strip_suffix(".npy").expect("an array").to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("all of it");
        assert_eq!(bytes[..8], *b"\x93NUMPY\x01\x00");
        let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert!(start.is_multiple_of(64) && bytes[start - 1] == b'\n');
        let head = std::str::from_utf8(&bytes[10..start]).expect("a dictionary");
        assert!(head.contains("'fortran_order': False"), "{head}");
        let [number, shape] =
            [("'descr': '", "'"), ("'shape': ", ", }")].map(|(a, b)| between(head, a, b).to_owned());
        arrays.insert(name, Array { number, shape, bytes: bytes[start..].to_vec() });
    }
    arrays
}

#[test]
fn a_mesh_has_the_arrays_of_its_vtu() {
    let folder = Folder::new("npz-mesh");
    let [list, mt, vtu, npz] = ["f.pvd", "f.mt", "m.vtu", "m.npz"].map(|name| folder.path(name));
    good(&["generate", "abc-flow", "--size", "6", "--steps", "2", "-o", &list]);
    good(&["build", &folder.path("f-0.vti"), "--all-fields", "-o", &mt, "--quiet"]);
    for out in [&vtu, &npz] {
        good(&["extract", &mt, "--error", "5%", "-o", out]);
    }
    let mesh = read(Path::new(&vtu)).expect("a mesh");
    let found = arrays(&npz);
    assert!(found.keys().eq(["positions", "pressure", "tets", "velocity"]));
    let (points, tets) = (mesh.positions.len(), mesh.tets.len());
    assert_eq!(found["positions"].shape, format!("({points}, 3)"));
    assert_eq!(found["positions"].doubles(), mesh.positions.as_flattened());
    assert_eq!(found["tets"].shape, format!("({tets}, 4)"));
    assert_eq!(found["tets"].indices(), mesh.tets.as_flattened());
    let column = |name: &str| &mesh.fields.iter().find(|field| field.name == name).expect("a field").values;
    assert_eq!(found["pressure"].shape, format!("({points},)"));
    assert_eq!(found["pressure"].doubles(), *column("pressure"));
    assert_eq!(found["velocity"].shape, format!("({points}, 3)"));
    // Each row has x, y and z: the second of every three numbers is y.
    let y: Vec<f64> = found["velocity"].doubles().into_iter().skip(1).step_by(3).collect();
    assert_eq!(y, *column("velocity_y"));

    // Steps have names of their own.
    good(&["build", &list, "--field", "velocity", "-o", &mt, "--quiet"]);
    good(&["extract", &mt, "-o", &npz]);
    let names = ["x", "y", "z"].map(|axis| [0.0, 1.0].map(|time| format!("velocity_{axis}@{time:?}")));
    assert!(names.as_flattened().iter().all(|name| arrays(&npz).contains_key(name)));
}

#[test]
fn surfaces_and_lines_come_by_name_too() {
    let folder = Folder::new("npz-surfaces");
    let [input, mt, out] = ["b.vti", "b.mt", "s.npz"].map(|name| folder.path(name));
    bucky(9, &input, &mt);
    good(&["isosurface", &mt, "--iso", "0.4", "-o", &out]);
    let surface = arrays(&out);
    let points = surface["positions"].singles().len() / 3;
    for (name, shape) in [("positions", format!("({points}, 3)")), ("normals", format!("({points}, 3)"))] {
        assert_eq!(surface[name].shape, shape);
    }
    assert!(surface["density"].singles().iter().all(|value| (value - 0.4).abs() < 1e-6));
    let triangles = surface["triangles"].indices();
    assert!(!triangles.is_empty() && triangles.iter().all(|v| (*v as usize) < points));

    good(&["streamlines", &mt, "--vector", "density,density,density", "--seed", "0.4,0.4,0.4", "-o", &out]);
    let lines = arrays(&out);
    assert_eq!(lines["line_ends"].indices(), [lines["lines"].indices().len() as u32]);

    good(&["slice", &mt, "--plane", "z=0.5", "--edges", "-o", &out]);
    let section = arrays(&out);
    assert_eq!(section["lines"].indices().len(), 2 * section["line_ends"].indices().len());
}
