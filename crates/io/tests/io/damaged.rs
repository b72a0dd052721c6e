//! Files that are cut short, flipped or lie about their sizes: a typed error or the same mesh, never a panic.

use crate::files::*;
use crate::polyhedra;
use tetralod::mesh;
use tetralod::mesh::TetMesh;
use tetralod_io as io;
use tetralod_io::{CellData, ReadOptions, ReadReason};

/// A few small files, one of each kind, and what they hold.
pub fn files() -> Vec<(String, Vec<u8>, TetMesh)> {
    let mut list = Vec::new();
    let style = |format, compressor, big| Style { format, compressor, wide: big, big, ..Style::PLAIN };
    for style in [
        style(Format::Ascii, "", false),
        style(Format::Inline, "ZLib", true),
        style(Format::AppendedBase64, "", false),
        style(Format::AppendedRaw, "", true),
        style(Format::AppendedRaw, "ZLib", false),
        style(Format::AppendedRaw, "LZ4", false),
        style(Format::AppendedRaw, "LZMA", true),
    ] {
        list.push((format!("{style:?}.vtu"), sample_vtu(style), sample()));
    }
    list.push(("a.vti".into(), sample_vti(style(Format::AppendedRaw, "ZLib", false)), grid_sample()));
    for version in ["3.0", "5.1"] {
        for binary in [false, true] {
            list.push((format!("{version} {binary}.vtk"), sample_vtk(version, binary), sample()));
        }
    }
    list.push(("points.vtk".into(), sample_points_vtk(true), grid_sample()));
    list.push(("a.vtr".into(), sample_vtr(style(Format::AppendedRaw, "ZLib", false)), uneven_sample()));
    list.push(("a.vts".into(), sample_vts(style(Format::Ascii, "", false)), uneven_sample()));
    list.push(("rectilinear.vtk".into(), sample_rectilinear_vtk(true), uneven_sample()));
    list.push(("structured.vtk".into(), sample_structured_vtk(false), uneven_sample()));
    list.push(("mixed.vtu".into(), mixed_vtu(style(Format::Ascii, "", false)), mixed_sample()));
    list.push(("mixed 3.0.vtk".into(), mixed_vtk("3.0", true), mixed_sample()));
    list.push(("mixed 5.1.vtk".into(), mixed_vtk("5.1", false), mixed_sample()));
    list
}

#[test]
fn every_truncation_is_refused_or_harmless() {
    for (name, file, whole) in files().into_iter().chain(polyhedra::files()) {
        for length in 0..file.len() {
            let Ok(mesh) = io::read_bytes(&name, &file[..length]) else { continue };
            // Text can be cut inside its last number, and legacy files between two arrays, without a trace.
            let traceless = name.ends_with(".vtk");
            assert!(mesh == whole || traceless, "{name} cut to {length} of {}", file.len());
            assert_eq!(mesh.positions, whole.positions, "{name} cut to {length}");
            assert_eq!(mesh.tets, whole.tets, "{name} cut to {length}");
        }
    }
}

#[test]
fn no_bit_flip_panics_and_no_mesh_is_inconsistent() {
    let everything = ReadOptions { cells: CellData::Values, ..ReadOptions::default() };
    for (name, mut file, _) in files().into_iter().chain(polyhedra::files()) {
        for bit in 0..8 * file.len() {
            file[bit / 8] ^= 1 << (bit % 8);
            if let Ok(found) = io::read_bytes_with(&name, &file, &everything) {
                for field in &found.fields {
                    assert_eq!(field.values.len(), found.positions.len(), "{name} bit {bit}");
                    assert!(field.values.iter().all(|v| v.is_finite()), "{name} bit {bit}");
                }
                for field in &found.cell_fields {
                    assert_eq!(field.values.len(), found.tets.len(), "{name} bit {bit}");
                    assert!(field.values.iter().all(|v| v.is_finite()), "{name} bit {bit}");
                }
                let points = found.positions.len() as u32;
                assert!(found.tets.iter().flatten().all(|v| *v < points), "{name} bit {bit}");
                if let Ok((repaired, _)) = mesh::repair(found) {
                    assert_eq!(mesh::check(&repaired), Ok(()), "{name} bit {bit}");
                }
            }
            file[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

#[test]
fn no_bit_flip_in_lzma_panics() {
    let mut file = include_bytes!("../data/lzma.vtu").to_vec();
    // Every third byte, at a bit that changes from byte to byte; all bits of the first block's beginning.
    let bits = (0..file.len()).step_by(3).map(|i| 8 * i + i % 8).chain(8 * 900..8 * 1100);
    let (mut good, mut bad) = (0, 0);
    for bit in bits {
        file[bit / 8] ^= 1 << (bit % 8);
        match io::read_bytes("a.vtu", &file) {
            Ok(_) => good += 1,
            Err(_) => bad += 1,
        }
        file[bit / 8] ^= 1 << (bit % 8);
    }
    // The check sums see what happens inside the blocks; the padding and index after them do not matter.
    assert!(bad > 3 * good, "{bad} refused, {good} read");
}

#[test]
fn sidecars_are_cut_and_flipped() {
    let samples = numbers("UInt8", &grid_sample().fields[0].values, false);
    let mut sidecar = sample_sidecar("uint8", "little").into_bytes();
    for length in 0..sidecar.len() {
        assert!(io::read_raw("a", &sidecar[..length], &samples).is_err());
    }
    for bit in 0..8 * sidecar.len() {
        sidecar[bit / 8] ^= 1 << (bit % 8);
        if let Ok(mesh) = io::read_raw("a", &sidecar, &samples) {
            assert_eq!(mesh.positions.len(), 24);
        }
        sidecar[bit / 8] ^= 1 << (bit % 8);
    }
}

/// The sample as text with `from` replaced by `to`, which must be there.
fn edited(from: &str, to: &str) -> ReadReason {
    let text = String::from_utf8(sample_vtu(Style::PLAIN)).unwrap();
    assert!(text.contains(from), "{from}");
    io::read_bytes("a.vtu", text.replacen(from, to, 1).as_bytes()).unwrap_err().reason
}

#[test]
fn counts_that_lie_do_not_size_anything() {
    for huge in ["4294967295", "9223372036854775807", "18446744073709551615"] {
        for name in ["NumberOfPoints=\"12\"", "NumberOfCells=\"12\""] {
            let lie = name.replace("12", huge);
            assert!(
                matches!(
                    edited(name, &lie),
                    ReadReason::Count { .. } | ReadReason::Truncated { .. } | ReadReason::TooLarge { .. }
                ),
                "{lie}"
            );
        }
    }
    assert!(matches!(
        edited("NumberOfComponents=\"2\"", "NumberOfComponents=\"1000000000000\""),
        ReadReason::TooLarge { .. }
    ));
    for (file, from, to) in [
        (sample_points_vtk(true), "DIMENSIONS 4 3 2", "DIMENSIONS 4000 3000 2000"),
        (sample_points_vtk(true), "DIMENSIONS 4 3 2", "DIMENSIONS 4294967296 4294967296 2"),
        (sample_points_vtk(false), "POINT_DATA 24", "POINT_DATA 18446744073709551615"),
        (sample_vtk("4.2", false), "POINTS 12", "POINTS 9999999999999"),
        (sample_vtk("4.2", false), "CELLS 12 60", "CELLS 12 9999999999999"),
        (sample_vtk("5.1", false), "CELLS 13 48", "CELLS 18446744073709551615 48"),
        (sample_vtk("4.2", false), "v 2 12 short", "v 99999999999 99999999999 short"),
    ] {
        let text = String::from_utf8(file).unwrap();
        assert!(text.contains(from), "{from}");
        let error = io::read_bytes("a.vtk", text.replacen(from, to, 1).as_bytes());
        assert!(error.is_err(), "{to}");
    }
}

#[test]
fn grids_without_data_do_not_size_anything() {
    let file = "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 400 0 400 0 400\">\
                <Piece Extent=\"0 400 0 400 0 400\"/></ImageData></VTKFile>";
    let error = io::read_bytes("a.vti", file.as_bytes()).unwrap_err();
    assert!(matches!(error.reason, ReadReason::Missing(_)), "{error}");
    // Neither do values of a small piece, nor no piece at all.
    let array = |name: &str| {
        format!("<DataArray type=\"UInt8\" Name=\"{name}\" format=\"ascii\">0 0 0 0 0 0 0 0</DataArray>")
    };
    let piece = |data: String| format!("<Piece Extent=\"0 1 0 1 0 1\">{data}</Piece>");
    for pieces in [
        piece(format!("<PointData>{}</PointData>", array("vtkGhostType"))),
        piece(format!("<CellData>{}</CellData>", array("c").replace(" 0 0 0 0 0 0 0", ""))),
        String::new(),
    ] {
        let file = file.replace("<Piece Extent=\"0 400 0 400 0 400\"/>", &pieces);
        let error = io::read_bytes("a.vti", file.as_bytes()).unwrap_err();
        assert!(matches!(error.reason, ReadReason::Missing(_)), "{error}");
    }
    for extent in ["0 9999 0 9999 0 9999", "-9223372036854775808 9223372036854775807 0 1 0 1"] {
        let error =
            io::read_bytes("a.vti", file.replace("0 400 0 400 0 400", extent).as_bytes()).unwrap_err();
        assert!(matches!(error.reason, ReadReason::TooLarge { .. } | ReadReason::Syntax(_)), "{error}");
    }
}

#[test]
fn components_without_points_do_not_size_anything() {
    let file = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"1\" NumberOfCells=\"0\">\
                <Points><DataArray type=\"Int8\" NumberOfComponents=\"3\">0 0 0</DataArray></Points><PointData><DataArray type=\"Int8\" NumberOfComponents=\"4000000000\" format=\"ascii\"/></PointData>\
                </Piece></UnstructuredGrid></VTKFile>";
    let error = io::read_bytes("a.vtu", file.as_bytes()).unwrap_err();
    assert!(matches!(error.reason, ReadReason::TooLarge { .. }), "{error}");
}

#[test]
fn blocks_that_unpack_to_more_than_stated_are_refused() {
    for compressor in ["ZLib", "LZ4", "LZMA"] {
        // A block of a million zeros under a header that states 12 bytes.
        let style = Style { format: Format::AppendedRaw, compressor, block: 1_000_000, ..Style::PLAIN };
        let zeros = Array::new("PointData", "density", "UInt8", 1, &vec![0.0; 1_000_000]);
        let packed = block(style, &zeros)[1].clone();
        let header = [1_u32, 24, 0, packed.len() as u32].map(u32::to_le_bytes).concat();
        let file = sample_vti(Style { format: Format::AppendedRaw, compressor, ..style });
        let start = file.windows(3).position(|w| w == b"  _").unwrap() + 3;
        let file = [&file[..start], &header, &packed].concat();
        let error = io::read_bytes("a.vti", &file).unwrap_err();
        assert!(matches!(error.reason, ReadReason::Damaged(_)), "{compressor}: {error}");
    }
}

#[test]
fn deep_nesting_is_refused() {
    let file = format!("<VTKFile type=\"UnstructuredGrid\">{}", "<a>".repeat(1_000_000));
    let error = io::read_bytes("a.vtu", file.as_bytes()).unwrap_err();
    assert!(matches!(error.reason, ReadReason::TooLarge { .. }), "{error}");
}

#[test]
fn errors_say_file_place_reason_and_remedy() {
    let text = |from: &str, to: &str| {
        let file = String::from_utf8(sample_vtu(Style::PLAIN)).unwrap();
        assert!(file.contains(from), "{from}");
        io::read_bytes("dir/a.vtu", file.replacen(from, to, 1).as_bytes()).unwrap_err().to_string()
    };
    assert_eq!(
        text("\n-2 -1.625", "\n-2 nan"),
        "dir/a.vtu: piece 0: the value of \"scalar <&> \"1\"\" at point 1 is infinite or not a number; replace it, or name other \
         fields to read"
    );
    assert_eq!(
        text("\n10 10 10 10", "\n41 41 13 5"),
        "dir/a.vtu: piece 0, <Cells>, array \"types\": 12 cells: 1 triangle, 8 tetrahedra, 1 wedge, 2 convex point sets; \
         tetrahedra, hexahedra, voxels, wedges, pyramids, prisms and polyhedra are read, also quadratic ones and Lagrange cells of \
         the first two orders, and what has no volume is left out beside them: convert the others (in ParaView: Tetrahedralize), or save them \
         with an order of at most 2"
    );
    assert_eq!(
        text("\n0 1 4 10", "\n0 1 4 12"),
        "dir/a.vtu: piece 0, <Cells>, array \"connectivity\": cell 0 refers to point 12, but there are 12 points; the \
         cells and the points do not belong together"
    );
    assert!(text("\n0 1 4 10", "\n0 -1 4 10").contains("refers to point -1"));
    assert!(
        text("\n-1.5 0.25 1000", "\n-1.5 0.25 inf").contains("point 0 has a coordinate that is infinite")
    );
    assert!(text("4 8 12", "4 9 12").contains("cell 1, a tetrahedron, has 5 points, not 4"));
    assert!(text("Name=\"types\"", "Name=\"tapes\"").contains("array \"types\" of <Cells> is missing"));
    assert!(
        text("format=\"ascii\"", "format=\"appended\" offset=\"0\"").contains("<AppendedData> is missing")
    );
    assert!(text("type=\"UnstructuredGrid\"", "type=\"PolyData\"").contains("PolyData"));
    assert!(text("LittleEndian", "MiddleEndian").contains("byte_order=\"MiddleEndian\" is not known"));
    assert!(text("</Cells>", "</Sells>").contains("not well-formed XML"));
    let section = |name: &str| format!("</Cells><{name}><DataArray type=\"Int8\" Name=\"a\"/></{name}>");
    assert!(text("</Cells>", &section("Sells")).contains("a section <Sells> of a piece cannot be read"));
    assert!(
        text("</Cells>", &[section("Cells"), section("Cells")].concat()).contains("two sections <Cells>")
    );
    assert!(text("Grid\" version=\"", "Grid\" version=\"3").contains("version 3"));
    let unknown = io::read_bytes("a.txt", b"words").unwrap_err();
    assert_eq!(unknown.reason, ReadReason::UnknownFormat);
    let surface = io::read_bytes("a.stl", b"solid").unwrap_err().to_string();
    assert!(
        surface.contains("a surface mesh (STL) cannot be read here; fill it with tetrahedra"),
        "{surface}"
    );
    let empty = io::read_bytes("a.vtu", b"").unwrap_err();
    assert_eq!(empty.reason, ReadReason::UnknownFormat);
}
