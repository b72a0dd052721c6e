//! Promise: a mesh in several files is read as the mesh that was parted.

use crate::files::*;
use std::path::{Path, PathBuf};
use tetralod::mesh;
use tetralod::mesh::{Field, TetMesh};
use tetralod_io as io;

/// A folder that is gone with the test.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("tetralod-{name}-{}", std::process::id()));
        std::fs::create_dir_all(path.join("parts")).unwrap();
        Self(path)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Cubes with their lower corner at these places, as hexahedra; their points come in another order in each file.
pub fn cubes(places: &[[f64; 3]], turn: usize) -> Vec<u8> {
    let corners = [
        [0., 0., 0.],
        [1., 0., 0.],
        [1., 1., 0.],
        [0., 1., 0.],
        [0., 0., 1.],
        [1., 0., 1.],
        [1., 1., 1.],
        [0., 1., 1.],
    ];
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut cells: Vec<Vec<usize>> = Vec::new();
    for place in places {
        let cell = corners.iter().map(|corner| {
            let point = [0, 1, 2].map(|i| place[i] + corner[i]);
            points.iter().position(|p| *p == point).unwrap_or_else(|| {
                points.push(point);
                points.len() - 1
            })
        });
        cells.push(cell.collect());
    }
    let n = points.len();
    let order: Vec<usize> = (0..n).map(|i| (i + turn) % n).collect();
    let place_of = |p: usize| order.iter().position(|o| *o == p).unwrap() as f64;
    let ids: Vec<f64> = cells.iter().flatten().map(|&p| place_of(p)).collect();
    let ordered: Vec<f64> = order.iter().flat_map(|&o| points[o]).collect();
    let field: Vec<f64> = ordered.chunks(3).map(|p| p[0] + 10.0 * p[1] + 100.0 * p[2]).collect();
    let ends: Vec<f64> = (1..=cells.len()).map(|i| 8.0 * i as f64).collect();
    let arrays = vec![
        Array::new("PointData", "linear", "Float32", 1, &field),
        Array::new("Points", "Points", "Float32", 3, &ordered),
        Array::new("Cells", "connectivity", "Int32", 1, &ids),
        Array::new("Cells", "offsets", "Int32", 1, &ends),
        Array::new("Cells", "types", "UInt8", 1, &vec![12.0; cells.len()]),
    ];
    let attributes = format!("NumberOfPoints=\"{n}\" NumberOfCells=\"{}\"", cells.len());
    xml(Style::PLAIN, "UnstructuredGrid", "", &[(attributes, arrays)])
}

pub fn list(sources: &[&str]) -> String {
    let pieces: String = sources.iter().map(|source| format!("<Piece Source=\"{source}\"/>")).collect();
    format!(
        "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid GhostLevel=\"0\"><PPointData>\
         <PDataArray type=\"Float32\" Name=\"linear\"/></PPointData>{pieces}</PUnstructuredGrid></VTKFile>"
    )
}

fn read(path: &Path) -> TetMesh {
    io::read(path).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn pieces_meet_whatever_the_order_of_their_points() {
    let folder = Folder::new("pvtu");
    for turn in 0..12 {
        folder.write("parts/0.vtu", &cubes(&[[0., 0., 0.], [0., 1., 0.]], turn));
        folder.write("parts/1.vtu", &cubes(&[[1., 0., 0.], [1., 1., 0.]], 5 * turn));
        folder.write("2.vtu", &cubes(&[[-0., 0., 1.], [1., 0., 1.]], 7 * turn));
        let path = folder.write("a.pvtu", list(&["parts/0.vtu", "./parts/1.vtu", "2.vtu"]).as_bytes());
        let (mended, report) = mesh::repair(read(&path)).unwrap();
        assert_eq!(report.to_string(), "", "{turn}");
        assert_eq!((mended.positions.len(), mended.tets.len()), (24, 36), "{turn}");
        let topology = mesh::topology(mended.positions.len(), &mended.tets).unwrap();
        assert_eq!((topology.components, topology.boundary_faces), (1, 44), "{turn}");
        let Field { name, values, .. } = &mended.fields[0];
        assert_eq!(name, "linear");
        for (point, value) in mended.positions.iter().zip(values) {
            assert_eq!(*value, point[0] + 10.0 * point[1] + 100.0 * point[2], "{turn}");
        }
    }
}

#[test]
fn pieces_that_cannot_be_read_are_named() {
    let folder = Folder::new("pvtu-bad");
    folder.write("0.vtu", &cubes(&[[0., 0., 0.]], 0));
    folder.write("1.vtu", b"<VTKFile type=\"UnstructuredGrid\"><Unstruct");
    folder.write("2.vtu", &sample_vti(Style::PLAIN));
    let refused = |sources: &[&str]| {
        let path = folder.write("a.pvtu", list(sources).as_bytes());
        io::read(&path).unwrap_err().to_string()
    };
    assert!(refused(&["0.vtu", "1.vtu"]).starts_with("1.vtu: "), "{}", refused(&["0.vtu", "1.vtu"]));
    assert!(refused(&["2.vtu"]).contains("a piece of type ImageData"));
    assert!(refused(&["3.vtu"]).contains("a.pvtu: piece 0: \"3.vtu\": "), "{}", refused(&["3.vtu"]));
    assert!(refused(&["../0.vtu"]).contains("another folder"));
    assert!(refused(&["/0.vtu"]).contains("another folder"));
    assert!(refused(&[""]).contains("another folder"));
    let alone = io::read_bytes("a.pvtu", list(&["0.vtu"]).as_bytes()).unwrap_err().to_string();
    assert!(alone.contains("a file that needs another (\"0.vtu\")"), "{alone}");
}

/// The part of a sample grid between two indices along x, as a file of its type.
pub fn slab(
    whole: &TetMesh,
    kind: &str,
    dims: [usize; 3],
    first: [i64; 3],
    [from, to]: [usize; 2],
) -> Vec<u8> {
    let inside = |i: &usize| (from..=to).contains(&(i % dims[0]));
    let points: Vec<usize> = (0..whole.positions.len()).filter(inside).collect();
    let values: Vec<f64> = points.iter().map(|&i| whole.fields[0].values[i]).collect();
    let mut arrays = vec![Array::new("PointData", "density", "Float64", 1, &values)];
    let cubes: Vec<f64> =
        (from..to).cycle().take((to - from) * (dims[1] - 1) * (dims[2] - 1)).map(|x| x as f64).collect();
    arrays.push(Array::new("CellData", "x", "Int32", 1, &cubes));
    let steps = [1, dims[0], dims[0] * dims[1]];
    match kind {
        "RectilinearGrid" => {
            for axis in 0..3 {
                let range = if axis == 0 { from..=to } else { 0..=dims[axis] - 1 };
                let along: Vec<f64> = range.map(|i| whole.positions[i * steps[axis]][axis]).collect();
                arrays.push(Array::new("Coordinates", "", "Float64", 1, &along));
            }
        }
        "StructuredGrid" => {
            let places: Vec<f64> = points.iter().flat_map(|&i| whole.positions[i]).collect();
            arrays.push(Array::new("Points", "Points", "Float64", 3, &places));
        }
        _ => {}
    }
    let extent = extent(dims, first, [from, to]);
    let dataset = format!("WholeExtent=\"{extent}\" Origin=\"0 2 -2.75\" Spacing=\"0.5 1 0.25\"");
    xml(Style::PLAIN, kind, &dataset, &[(format!("Extent=\"{extent}\""), arrays)])
}

pub fn extent(dims: [usize; 3], first: [i64; 3], [from, to]: [usize; 2]) -> String {
    let ends = [[from, to], [0, dims[1] - 1], [0, dims[2] - 1]];
    let words: Vec<String> =
        (0..3).flat_map(|axis| ends[axis].map(|end| (first[axis] + end as i64).to_string())).collect();
    words.join(" ")
}

#[test]
fn grids_in_several_files_are_put_together() {
    let folder = Folder::new("grids");
    let (even, uneven) = (grid_sample(), uneven_sample());
    for (kind, ending, whole, dims, first) in [
        ("ImageData", "vti", &even, [4, 3, 2], [2, 0, -1]),
        ("RectilinearGrid", "vtr", &uneven, [3, 2, 3], [0, 5, 0]),
        ("StructuredGrid", "vts", &uneven, [3, 2, 3], [0, 5, 0]),
    ] {
        let last = dims[0] - 1;
        let mut pieces = String::new();
        for (number, ends) in [[1, last], [0, 1]].into_iter().enumerate() {
            let name = format!("parts/{number}.{ending}");
            folder.write(&name, &slab(whole, kind, dims, first, ends));
            pieces += &format!("<Piece Extent=\"{}\" Source=\"{name}\"/>", extent(dims, first, ends));
        }
        let list = |pieces: &str| {
            format!(
                "<VTKFile type=\"P{kind}\"><P{kind} WholeExtent=\"{}\" Origin=\"0 2 -2.75\" Spacing=\"0.5 1 0.25\">\
                 {pieces}</P{kind}></VTKFile>",
                extent(dims, first, [0, last])
            )
        };
        let path = folder.write(&format!("a.p{ending}"), list(&pieces).as_bytes());
        let options = io::ReadOptions { cells: io::CellData::Values, ..io::ReadOptions::default() };
        let found = io::read_with(&path, &options).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            (&found.positions, &found.tets, found.grid),
            (&whole.positions, &whole.tets, whole.grid),
            "{kind}"
        );
        assert_eq!(found.fields[0].values, whole.fields[0].values, "{kind}");
        // Six tetrahedra a cube, whose number along x is the value.
        let along = |cell: usize| ((cell / 6) % last) as f64;
        assert_eq!(
            found.cell_fields[0].values,
            (0..found.tets.len()).map(along).collect::<Vec<_>>(),
            "{kind}"
        );
        assert_eq!(io::format_of(list(&pieces).as_bytes()), Some(format!("p{ending}").as_str()));
        let cut = folder
            .write(&format!("b.p{ending}"), list(pieces.split_inclusive("/>").next().unwrap()).as_bytes());
        let error = io::read(&cut).unwrap_err().to_string();
        assert!(error.contains("a piece of the grid is missing"), "{error}");
        let wrong = folder
            .write("c.pvtx", list(&pieces).replace(&format!("P{kind}"), "PUnstructuredGrid").as_bytes());
        let error = io::read(&wrong).unwrap_err().to_string();
        assert!(error.contains(&format!("a piece of type {kind}")), "{error}");
    }
}
