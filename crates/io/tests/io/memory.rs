//! Promise: reading takes no more memory than it may, whatever a file claims or unpacks to.

use crate::damaged::files;
use crate::files::*;
use flate2::Compression;
use std::io::Write;
use tetralod::mesh::{Field, TetMesh};
use tetralod_io::{self as io, CellData, MemoryLimit, ReadError, ReadOptions, ReadReason};

fn read(name: &str, file: &[u8], limit: u64, fields: Option<&[&str]>) -> Result<TetMesh, ReadError> {
    let fields = fields.map(|names| names.iter().map(|&name| name.to_owned()).collect());
    let memory = MemoryLimit::of(limit);
    io::read_bytes_with(
        name,
        file,
        &ReadOptions { fields, memory, cells: CellData::Values, ..ReadOptions::default() },
    )
}

fn is_refused(read: &Result<TetMesh, ReadError>) -> bool {
    matches!(read, Err(ReadError { reason: ReadReason::Memory { .. }, .. }))
}

/// What a mesh takes as long as it is there.
fn bytes_of(mesh: &TetMesh) -> u64 {
    let values: usize =
        mesh.fields.iter().chain(&mesh.cell_fields).map(|field: &Field| field.values.len()).sum();
    (24 * mesh.positions.len() + 16 * mesh.tets.len() + 8 * values) as u64
}

#[test]
fn what_stays_counts_in_every_format() {
    for (name, file, _) in files() {
        let whole = read(&name, &file, u64::MAX, None).unwrap();
        let least = (0..).find(|shift| read(&name, &file, 1 << shift, None).is_ok()).unwrap();
        let kept = bytes_of(&whole);
        assert!(1 << least >= kept, "{name}: {kept} bytes were read within {}", 1 << least);
        assert!(1 << least <= 16 * kept, "{name}: {kept} bytes were not read within {}", 1 << (least - 1));
        assert_eq!(read(&name, &file, 1 << least, None).unwrap(), whole, "{name}");
        for shift in 0..least {
            assert!(is_refused(&read(&name, &file, 1 << shift, None)), "{name}: within {}", 1 << shift);
        }
    }
}

/// A grid of 32³ points with so many arrays of bytes that are all in one place, unpacked or not.
fn shared(arrays: usize, compressor: &'static str) -> Vec<u8> {
    let style = Style { format: Format::AppendedRaw, compressor, wide: true, block: 32768, ..Style::PLAIN };
    let values = Array::new("PointData", "f0", "UInt8", 1, &vec![7.0; 1 << 15]);
    let extent = "0 31 0 31 0 31";
    let piece = (format!("Extent=\"{extent}\""), vec![values]);
    let file = xml(style, "ImageData", &format!("WholeExtent=\"{extent}\""), &[piece]);
    let text = String::from_utf8_lossy(&file);
    let start = text.find("<DataArray").unwrap();
    let end = text.find("</PointData>").unwrap();
    let one = &text[start..end];
    let more: String = (1..arrays).map(|i| one.replace("\"f0\"", &format!("\"f{i}\""))).collect();
    [&file[..end], more.as_bytes(), &file[end..]].concat()
}

#[test]
fn arrays_in_one_place_count_each() {
    for compressor in ["", "ZLib"] {
        let file = shared(100, compressor);
        assert!(file.len() < 1 << 16);
        // A field takes 256 KiB, and the grid that is made of its counts 3.6 MB.
        let limit = 6 << 20;
        assert!(is_refused(&read("a.vti", &file, limit, None)), "{compressor}");
        let some = read("a.vti", &file, limit, Some(&["f3", "f99"])).unwrap();
        assert_eq!(some.fields.len(), 2);
        assert_eq!(read("a.vti", &file, 64 << 20, None).unwrap().fields.len(), 100);
    }
}

#[test]
fn pieces_in_one_place_count_each() {
    let style = Style { format: Format::AppendedRaw, wide: true, ..Style::PLAIN };
    let file = String::from_utf8_lossy(&sample_vtu(style)).into_owned();
    let (start, end) = (file.find("<Piece").unwrap(), file.find("</Piece>").unwrap() + "</Piece>".len());
    let many = file[start..end].repeat(1000);
    // Bytes behind the marks of the file are not text.
    let raw = sample_vtu(style);
    let file = [&raw[..start], many.as_bytes(), &raw[end..]].concat();
    let whole = read("a.vtu", &file, u64::MAX, None).unwrap();
    assert!(is_refused(&read("a.vtu", &file, bytes_of(&whole) / 2, None)));
    assert_eq!(read("a.vtu", &file, 3 * bytes_of(&whole), None).unwrap(), whole);
}

#[test]
fn packed_files_count_as_what_they_unpack_to() {
    // A comment of 64 MB.
    let mut file = sample_vti(Style::PLAIN);
    let end = file.windows(5).position(|window| window == b"made ").unwrap();
    file.splice(end..end, std::iter::repeat_n(b' ', 64 << 20));
    let packed = gzip(&file);
    assert!(packed.len() < 1 << 17);
    assert!(is_refused(&read("a.vti.gz", &packed, 16 << 20, None)));
}

#[test]
fn lists_are_not_unpacked_to_any_size() {
    let folder = std::env::temp_dir().join(format!("tetralod-lists-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let list = folder.join("a.pvd.gz");
    std::fs::write(&list, gzip(&vec![b' '; 80 << 20])).unwrap();
    let refused = io::steps(&list);
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(matches!(refused, Err(ReadError { reason: ReadReason::Memory { .. }, .. })));
}

#[cfg(not(target_arch = "wasm32"))]
#[test]
fn packed_samples_count_as_what_they_unpack_to() {
    let head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 128 128 128\nencoding: gzip\n\n";
    let nrrd = [head.as_bytes(), &gzip(&vec![1; 1 << 21])].concat();
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), Compression::best());
    zlib.write_all(&vec![1; 1 << 21]).unwrap();
    let head = "ObjectType = Image\nNDims = 3\nDimSize = 128 128 128\nElementType = MET_UCHAR\nCompressedData = True\n\
                ElementDataFile = LOCAL\n";
    let mha = [head.as_bytes(), &zlib.finish().unwrap()].concat();
    for (name, file) in [("a.nrrd", nrrd), ("a.mha", mha)] {
        assert!(file.len() < 4000);
        for limit in [1 << 20, 1 << 23, 1 << 25] {
            assert!(is_refused(&read(name, &file, limit, None)), "{name}: {limit}");
        }
        assert_eq!(read(name, &file, 1 << 29, None).unwrap().fields[0].values.len(), 1 << 21, "{name}");
    }
}
