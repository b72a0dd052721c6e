//! Promise: a grid whose values are read in boxes is the grid that it is as a whole.

use crate::files::*;
use crate::pieces::Folder;
use std::collections::BTreeMap;
use std::path::Path;
use tetralod::mesh::{Field, TetMesh};
use tetralod_build::parts::{self, GridValues, Part, PartsError, Plan, PointBox};
use tetralod_build::{BuildConfig, mark_labels};
use tetralod_io as io;
use tetralod_io::{CellData, Pieces, ReadOptions, ReadReason};

/// Takes a part.
type PutPart<'a> = &'a mut dyn FnMut(Part) -> Result<(), PartsError>;

/// Parts a volume.
type Parting<'a> = &'a dyn Fn(PutPart<'_>) -> Result<Plan, PartsError>;

/// The parts of a volume, as bytes: of all values, and of values that are read for each part.
pub fn parts_of(path: &Path, config: &BuildConfig, count: u32) -> [Result<Vec<Vec<u8>>, String>; 2] {
    let collect = |part: Parting<'_>| {
        let mut all = Vec::new();
        let plan = part(&mut |part| {
            let mut bytes = Vec::new();
            part.write(&mut bytes)?;
            all.push(bytes);
            Ok(())
        });
        plan.map(|_| all).map_err(|error| error.to_string())
    };
    let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
    let mut mesh = io::read_unexpanded(path, &options).expect("a mesh");
    mark_labels(&mut mesh, &[], config).expect("labels");
    let pieces = Pieces::open_ranges(path, &options, None).expect("no error").expect("in parts");
    let grid = pieces.grid().expect("a grid");
    let read = |field: usize, points: PointBox| grid.values(field, points).map_err(PartsError::other);
    let values = GridValues { mesh: grid.mesh().clone(), layers: grid.layers(), read: &read };
    let prepare = |mesh: &mut TetMesh| Ok(mark_labels(mesh, &[], config)?);
    [
        collect(&|put| parts::part(&mesh, config, count, BTreeMap::new(), put)),
        collect(&|put| parts::part_grid(&values, &prepare, config, count, BTreeMap::new(), put)),
    ]
}

fn open(path: &Path, options: &ReadOptions) -> Result<Result<Pieces, Option<&'static str>>, io::ReadError> {
    Pieces::open_ranges(path, options, None)
}

/// Why a file is read as a whole; nothing if nothing is to be said of that.
fn why_whole(path: &Path) -> Option<&'static str> {
    open(path, &ReadOptions::default()).expect("no error").expect_err("read as a whole")
}

/// The values in a box of all values.
fn in_box(values: &[f64], [nx, ny, _]: [u32; 3], [xs, ys, zs]: &PointBox) -> Vec<f64> {
    let at = |x: u32, y: u32, z: u32| values[(x + nx * (y + ny * z)) as usize];
    let row = |y: u32, z: u32| xs.clone().map(move |x| at(x, y, z));
    zs.clone().flat_map(|z| ys.clone().flat_map(move |y| row(y, z)).collect::<Vec<_>>()).collect()
}

/// Checks that boxes are what the whole has there.
fn check(path: &Path, options: &ReadOptions, what: &str) {
    let whole = io::read_unexpanded(path, options).unwrap_or_else(|error| panic!("{what}: {error}"));
    let pieces = open(path, options).unwrap_or_else(|error| panic!("{what}: {error}"));
    let pieces = pieces.unwrap_or_else(|why| panic!("{what}: {why:?}"));
    let grid = pieces.grid().expect("a grid");
    let alone = |mesh: &TetMesh| TetMesh {
        fields: mesh.fields.iter().map(Field::without_values).collect(),
        ..mesh.clone()
    };
    assert_eq!(alone(grid.mesh()), alone(&whole), "{what}");
    let dims = whole.grid.expect("a grid").dims;
    let layers = grid.layers();
    assert!((1..=dims[2]).contains(&layers), "{what}: {layers}");
    let all: PointBox = dims.map(|n| 0..n);
    let inner: PointBox = [1..3, 1..2, 0..1];
    let last = dims.map(|n| n - 1..n);
    let layer: PointBox = [0..dims[0], 0..dims[1], 1..2];
    for (field, values) in whole.fields.iter().enumerate() {
        for points in [&all, &inner, &last, &layer] {
            let found = grid.values(field, points.clone()).unwrap_or_else(|error| panic!("{what}: {error}"));
            assert_eq!(found, in_box(&values.values, dims, points), "{what}, {}", values.name);
        }
    }
}

const EXTENT: &str = "WholeExtent=\"2 5 0 2 -1 0\" Origin=\"0 2 -2.75\" Spacing=\"0.5 1 0.25\"";

/// A file with vectors, a tensor, whole numbers and a field at cells.
fn mixed(style: Style) -> Vec<u8> {
    let some = |count: usize, by: f64| -> Vec<f64> { (0..count).map(|i| (i as f64 * by).sin()).collect() };
    let whole: Vec<f64> = (0..24).map(|i| f64::from(i * 7 % 11)).collect();
    let arrays = vec![
        Array::new("PointData", "pressure", "Float32", 1, &[0.5; 24]),
        Array::new("PointData", "velocity", "Float64", 3, &some(72, 0.7)),
        Array::new("PointData", "stress", "Float64", 6, &some(144, 0.3)),
        Array::new("PointData", "rank", "Int16", 1, &whole),
        Array::new("CellData", "porosity", "Float32", 1, &[0.25; 6]),
    ];
    xml(style, "ImageData", EXTENT, &[("Extent=\"2 5 0 2 -1 0\"".to_owned(), arrays)])
}

#[test]
fn images_in_every_style() {
    let folder = Folder::new("boxes-vti");
    let every = ReadOptions { fields: None, cells: CellData::Names, ..ReadOptions::default() };
    for style in Style::all() {
        let what = format!("{style:?}");
        for (name, bytes) in [("a.vti", sample_vti(style)), ("mixed.vti", mixed(style))] {
            let path = folder.write(name, &bytes);
            match style.format {
                Format::Ascii => {
                    assert_eq!(why_whole(&path), Some("its numbers are text"), "{what}");
                    continue;
                }
                Format::Inline => {
                    // Numbers that spaces cut take the whole: see `ranges`.
                    let in_lines = String::from_utf8(bytes).expect("text").replace("\n   ", "");
                    folder.write(name, in_lines.as_bytes());
                }
                _ => {}
            }
            check(&path, &ReadOptions::default(), &what);
            check(&path, &every, &what);
        }
    }
}

#[test]
fn images_that_take_the_whole_and_damaged_ones() {
    let folder = Folder::new("boxes-odd");
    let style = Style { format: Format::AppendedRaw, ..Style::PLAIN };
    let values = &grid_sample().fields[0].values;
    let array = |section, count: usize| Array::new(section, "density", "UInt8", 1, &values[..count]);
    let file = |dataset: &str, pieces: &[(&str, Vec<Array>)]| {
        let pieces: Vec<(String, Vec<Array>)> =
            pieces.iter().map(|(extent, arrays)| (format!("Extent=\"{extent}\""), arrays.clone())).collect();
        folder.write("odd.vti", &xml(style, "ImageData", dataset, &pieces))
    };
    let points = || array("PointData", 24);
    let halves =
        [("2 3 0 2 -1 0", vec![array("PointData", 12)]), ("3 5 0 2 -1 0", vec![array("PointData", 18)])];
    assert_eq!(why_whole(&file(EXTENT, &halves)), Some("it is in several pieces"));
    let ghosts = Array::new("CellData", "vtkGhostType", "UInt8", 1, &[32.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let marked = file(EXTENT, &[("2 5 0 2 -1 0", vec![points(), ghosts])]);
    assert_eq!(why_whole(&marked), Some("it marks cells or points as ghosts"));
    let turned = format!("{EXTENT} Direction=\"0 1 0 -1 0 0 0 0 1\"");
    assert_eq!(why_whole(&file(&turned, &[("2 5 0 2 -1 0", vec![points()])])), Some("its axes are turned"));
    // Without values its reader says what is missing.
    assert_eq!(why_whole(&file(EXTENT, &[("2 5 0 2 -1 0", Vec::new())])), None);
    // Too few values, and some that are no numbers.
    let few = open(&file(EXTENT, &[("2 5 0 2 -1 0", vec![array("PointData", 23)])]), &ReadOptions::default());
    let said = few.expect_err("too few").to_string();
    assert!(said.contains("odd.vti") && said.contains("density"), "{said}");
    let bad: Vec<f64> = values.iter().map(|&x| if x == 17.0 { f64::NAN } else { x }).collect();
    let bad = Array::new("PointData", "density", "Float32", 1, &bad);
    let pieces = open(&file(EXTENT, &[("2 5 0 2 -1 0", vec![bad])]), &ReadOptions::default());
    let pieces = pieces.expect("no error").expect("in parts");
    let error = pieces.grid().expect("a grid").values(0, [0..4, 1..3, 1..2]).expect_err("no number");
    assert_eq!(error.reason, ReadReason::NotFinite { array: "density".to_owned(), point: 17 });
}

/// Samples of a grid of 4 by 3 by 2, so many for each point.
fn samples(each: usize) -> Vec<f64> {
    (0..24 * each).map(|i| f64::from((i * 37 % 101) as u8)).collect()
}

#[test]
fn raw_samples_of_every_type() {
    let folder = Folder::new("boxes-raw");
    for kind in TYPES {
        for endian in ["little", "big"] {
            let kind_there = kind.to_lowercase();
            folder.write("a.json", sample_sidecar(&kind_there, endian).as_bytes());
            let raw = folder.write("a.raw", &numbers(kind, &samples(1), endian == "big"));
            for path in [&raw, &raw.with_extension("json")] {
                check(path, &ReadOptions::default(), &format!("{kind}, {endian}"));
            }
        }
    }
    // One byte too few, or too many: its reader says it.
    for count in [23, 25] {
        let raw = folder.write("a.raw", &vec![1; count]);
        folder.write("a.json", sample_sidecar("uint8", "little").as_bytes());
        assert_eq!(why_whole(&raw), None);
    }
}

#[test]
fn nrrd_and_meta_image() {
    let folder = Folder::new("boxes-nrrd");
    let scalar = numbers("Int16", &samples(1), true);
    let vector = numbers("Float32", &samples(3), false);
    let nrrd = |sizes: &str, kinds: &str, kind: &str, more: &str| {
        let dimension = sizes.split(' ').count();
        format!(
            "NRRD0005\n# made by a test\ntype: {kind}\ndimension: {dimension}\nsizes: {sizes}\nkinds: {kinds}\nencoding: raw\n{more}"
        )
    };
    let mha = |more: &str| {
        format!("ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2 0.5\n{more}")
    };
    let in_three = "space domain domain";
    let behind = |header: String, samples: &[u8]| [header.as_bytes(), samples].concat();
    let skipped = [&[9; 5], &scalar[..], &[8; 1]].concat();
    folder.write("x.raw", &skipped);
    folder.write("y.raw", &vector);
    let of_vectors = nrrd("3 4 3 2", "vector domain domain domain", "float", "endian: little\n");
    let files = [
        ("a.nrrd", behind(nrrd("4 3 2", in_three, "short", "endian: big\nspacings: 1 2 0.5\n\n"), &scalar)),
        ("b.nrrd", behind(nrrd("4 3 2", in_three, "short", "endian: big\nbyte skip: 5\n\n"), &skipped)),
        ("c.nrrd", behind(nrrd("4 3 2", in_three, "short", "endian: big\nbyte skip: -2\n\n"), &skipped)),
        ("d.nhdr", nrrd("4 3 2", in_three, "short", "endian: big\nbyte skip: 5\ndata file: x.raw\n").into()),
        ("e.nrrd", behind(format!("{of_vectors}\n"), &vector)),
        ("f.nhdr", format!("{of_vectors}data file: y.raw\n").into()),
        ("g.mha", behind(mha("BinaryDataByteOrderMSB = True\nElementType = MET_SHORT\nElementDataFile = LOCAL\n"), &scalar)),
        ("h.mhd", mha("ElementNumberOfChannels = 3\nElementType = MET_FLOAT\nElementDataFile = y.raw\n").into()),
        ("i.mhd", mha("HeaderSize = 5\nElementByteOrderMSB = True\nElementType = MET_SHORT\nElementDataFile = x.raw\n").into()),
        ("j.mhd", mha("HeaderSize = -1\nElementType = MET_SHORT\nElementDataFile = x.raw\n").into()),
    ];
    for (name, bytes) in &files {
        check(&folder.write(name, bytes), &ReadOptions::default(), name);
    }
    // What is packed, text, in layers of values, in several files or too short is read as a whole.
    for (name, bytes) in [
        ("k.nrrd", behind(nrrd("4 3 2", in_three, "short", "endian: big\n\n"), &scalar[1..])),
        (
            "l.nrrd",
            behind(nrrd("4 3 2 3", "domain domain domain vector", "float", "endian: little\n\n"), &vector),
        ),
        ("m.mha", mha("CompressedData = True\nElementType = MET_SHORT\nElementDataFile = LOCAL\n").into()),
        ("n.mhd", mha("ElementType = MET_SHORT\nElementDataFile = x.raw y.raw LIST\n").into()),
    ] {
        assert_eq!(why_whole(&folder.write(name, &bytes)), None, "{name}");
    }
}

#[test]
fn parts_are_those_of_all_values() {
    let folder = Folder::new("boxes-parts");
    let style = Style { format: Format::AppendedRaw, compressor: "ZLib", ..Style::PLAIN };
    let image = folder.write("a.vti", &mixed(style));
    folder.write("b.json", sample_sidecar("float32", "little").as_bytes());
    let raw = folder.write("b.raw", &numbers("Float32", &samples(1), false));
    for path in [image, raw] {
        for (count, all_fields) in [(2, false), (4, true)] {
            let config = BuildConfig { all_fields, ..BuildConfig::default() };
            let [whole, read] = parts_of(&path, &config, count);
            assert_eq!(whole.as_ref().map(Vec::len), Ok(count as usize), "{}", path.display());
            assert!(whole == read, "{}", path.display());
        }
    }
}

#[test]
fn boxes_that_were_read_before_take_no_memory() {
    let folder = Folder::new("boxes-memory");
    let style = Style { format: Format::AppendedRaw, ..Style::PLAIN };
    folder.write("b.json", sample_sidecar("float32", "little").as_bytes());
    let header = "NRRD0005\ntype: short\ndimension: 3\nsizes: 4 3 2\nencoding: raw\nendian: big\n\n";
    let nrrd = [header.as_bytes(), &numbers("Int16", &samples(1), true)].concat();
    let files = [
        folder.write("a.vti", &sample_vti(style)),
        folder.write("b.raw", &numbers("Float32", &samples(1), false)),
        folder.write("c.nrrd", &nrrd),
    ];
    for path in files {
        let options = ReadOptions { memory: io::MemoryLimit::of(1 << 12), ..ReadOptions::default() };
        let pieces = open(&path, &options).expect("no error").expect("in parts");
        let grid = pieces.grid().expect("a grid");
        for _ in 0..100 {
            assert_eq!(grid.values(0, [0..4, 0..3, 0..2]).expect("a box").len(), 24, "{}", path.display());
        }
    }
}
