//! Promise: arrays of Zarr in both versions, packed in any way, give the same values; images of OME-Zarr lie where they say; what cannot be read
//! is named, with its array or chunk; boxes are read without the chunks beside them; servers are asked for what is needed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::grid_boxes::parts_of;
use serde_json::{Value, json};
use tempfile::TempDir;
use tetralod::mesh::TetMesh;
use tetralod_build::{BuildConfig, FieldPrecision};
use tetralod_io::{self as io, Pieces, ReadOptions, ReadReason};
use zarrs::array::{Array, ArrayBytes, ArrayMetadata};
use zarrs::storage::store::MemoryStore;
use zarrs::storage::{ListableStorageTraits, ReadableStorageTraits};

/// A folder that is gone afterwards.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, content).expect("a file");
    }

    fn write_json(&self, name: &str, content: &Value) {
        self.write(name, content.to_string());
    }

    /// Writes an array by its metadata, of either version, with these bytes of samples, as this machine has them.
    fn array(&self, name: &str, metadata: &Value, samples: Vec<u8>) {
        let file = if metadata["zarr_format"] == 3 { "zarr.json" } else { ".zarray" };
        self.write_json(&format!("{name}/{file}"), metadata);
        let store = Arc::new(MemoryStore::new());
        let metadata: ArrayMetadata = serde_json::from_value(metadata.clone()).expect("metadata");
        let array = Array::new_with_metadata(Arc::clone(&store), "/", metadata).expect("an array");
        let bytes = ArrayBytes::new_flen(samples);
        array.store_array_subset(&array.subset_all(), bytes).expect("it is stored");
        for key in store.list().expect("a list") {
            let bytes = store.get(&key).expect("no error").expect("it is there");
            self.write(&format!("{name}/{}", key.as_str()), bytes);
        }
    }

    fn read(&self, name: &str) -> TetMesh {
        io::read(&self.path(name)).unwrap_or_else(|error| panic!("{error}"))
    }

    fn refused(&self, name: &str) -> String {
        io::read(&self.path(name)).expect_err(name).to_string()
    }
}

/// The shape of the arrays here, z first.
const SHAPE: [u64; 3] = [5, 4, 3];

/// The value of a sample: it tells where it is.
fn value([x, y, z]: [u64; 3]) -> u16 {
    (x + 10 * y + 100 * z) as u16
}

/// All values, x fastest.
fn values() -> Vec<u16> {
    let row = |z, y| (0..SHAPE[2]).map(move |x| value([x, y, z]));
    (0..SHAPE[0]).flat_map(|z| (0..SHAPE[1]).flat_map(move |y| row(z, y))).collect()
}

fn bytes_of(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_ne_bytes()).collect()
}

fn version_3(codecs: &Value) -> Value {
    json!({
        "zarr_format": 3, "node_type": "array", "shape": SHAPE, "data_type": "uint16", "fill_value": 7,
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [2, 3, 2] } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "codecs": codecs,
    })
}

fn version_2(changes: &Value) -> Value {
    let mut metadata = json!({
        "zarr_format": 2, "shape": SHAPE, "chunks": [2, 3, 2], "dtype": "<u2", "order": "C", "fill_value": 7,
        "compressor": null, "filters": null,
    });
    let all = metadata.as_object_mut().expect("an object");
    all.extend(changes.as_object().expect("an object").clone());
    metadata
}

/// Members of the metadata of an array of version 3, changed.
fn changed(mut metadata: Value, changes: &[(&str, Value)]) -> Value {
    changes.iter().for_each(|(name, value)| metadata[*name] = value.clone());
    metadata
}

fn bytes_codec(endian: &str) -> Value {
    json!({ "name": "bytes", "configuration": { "endian": endian } })
}

fn plain() -> Value {
    version_3(&json!([bytes_codec("little")]))
}

/// An array of unsigned 16-bit integers, one of each way to store it.
fn all_ways() -> Vec<(String, Value)> {
    let blosc = |name: &str, shuffle: &str| {
        let configuration =
            json!({ "cname": name, "clevel": 5, "shuffle": shuffle, "typesize": 2, "blocksize": 0 });
        json!({ "name": "blosc", "configuration": configuration })
    };
    let zstd = json!({ "name": "zstd", "configuration": { "level": 3, "checksum": true } });
    let gzip = json!({ "name": "gzip", "configuration": { "level": 1 } });
    let crc32c = json!({ "name": "crc32c" });
    let transpose = json!({ "name": "transpose", "configuration": { "order": [2, 0, 1] } });
    let shard = |codecs: &Value, at: &str| {
        let index = json!([bytes_codec("little"), crc32c]);
        let configuration = json!({ "chunk_shape": [1, 3, 1], "codecs": codecs, "index_codecs": index, "index_location": at });
        json!({ "name": "sharding_indexed", "configuration": configuration })
    };
    let little = bytes_codec("little");
    let of_3 = [
        ("plain", json!([little])),
        ("big", json!([bytes_codec("big")])),
        ("zstd", json!([little, zstd])),
        ("gzip-crc32c", json!([bytes_codec("big"), gzip, crc32c])),
        ("blosc-lz4", json!([little, blosc("lz4", "shuffle")])),
        ("blosc-zstd", json!([little, blosc("zstd", "bitshuffle")])),
        ("blosc-blosclz", json!([little, blosc("blosclz", "noshuffle")])),
        ("blosc-zlib", json!([little, blosc("zlib", "shuffle")])),
        ("lz4", json!([little, { "name": "numcodecs.lz4", "configuration": { "acceleration": 1 } }])),
        ("transpose", json!([transpose, little, zstd])),
        ("shards", json!([shard(&json!([little, zstd]), "end")])),
        ("shards-start", json!([shard(&json!([transpose, bytes_codec("big")]), "start")])),
    ];
    let of_2 = [
        ("plain", json!({})),
        ("big-f", json!({ "dtype": ">u2", "order": "F" })),
        ("slash", json!({ "dimension_separator": "/" })),
        ("zlib", json!({ "compressor": { "id": "zlib", "level": 1 } })),
        ("gzip-f", json!({ "compressor": { "id": "gzip", "level": 1 }, "order": "F" })),
        ("zstd", json!({ "compressor": { "id": "zstd", "level": 1 } })),
        ("lz4", json!({ "compressor": { "id": "lz4", "acceleration": 1 } })),
        (
            "blosc",
            json!({ "compressor": { "id": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1, "blocksize": 0 } }),
        ),
        ("large-chunk", json!({ "chunks": [8, 8, 8] })),
    ];
    let of_3 = of_3.into_iter().map(|(name, codecs)| (format!("3-{name}.zarr"), version_3(&codecs)));
    let of_2 = of_2.into_iter().map(|(name, changes)| (format!("2-{name}.zarr"), version_2(&changes)));
    of_3.chain(of_2).collect()
}

/// The bytes of a number in some type.
type ToBytes<'a> = &'a dyn Fn(u16) -> Vec<u8>;

#[test]
fn all_versions_codecs_orders_and_shards_give_the_same_mesh() {
    let folder = Folder::new();
    for (name, metadata) in all_ways() {
        folder.array(&name, &metadata, bytes_of(&values()));
        let mesh = folder.read(&name);
        assert_eq!((mesh.fields.len(), mesh.fields[0].name.as_str()), (1, "value"), "{name}");
        assert!(mesh.fields[0].integer, "{name}");
        assert!(mesh.fields[0].values.iter().copied().eq(values().into_iter().map(f64::from)), "{name}");
        assert_eq!(mesh.grid.expect("a grid").dims, [3, 4, 5], "{name}");
        assert_eq!(mesh.tets.len(), 6 * 4 * 3 * 2, "{name}");
    }
}

#[test]
fn all_types_of_numbers_are_read() {
    let folder = Folder::new();
    let types: [(&str, ToBytes<'_>); 14] = [
        ("bool", &|v| vec![(v % 2) as u8]),
        ("int8", &|v| vec![(v % 2) as u8]),
        ("uint8", &|v| vec![(v % 2) as u8]),
        ("int16", &|v| ((v % 2) as i16).to_ne_bytes().to_vec()),
        ("uint16", &|v| (v % 2).to_ne_bytes().to_vec()),
        ("int32", &|v| i32::from(v % 2).to_ne_bytes().to_vec()),
        ("uint32", &|v| u32::from(v % 2).to_ne_bytes().to_vec()),
        ("int64", &|v| i64::from(v % 2).to_ne_bytes().to_vec()),
        ("uint64", &|v| u64::from(v % 2).to_ne_bytes().to_vec()),
        ("float16", &|v| half::f16::from_f64(f64::from(v % 2)).to_ne_bytes().to_vec()),
        ("bfloat16", &|v| half::bf16::from_f64(f64::from(v % 2)).to_ne_bytes().to_vec()),
        ("float32", &|v| f32::from(v % 2).to_ne_bytes().to_vec()),
        ("float64", &|v| f64::from(v % 2).to_ne_bytes().to_vec()),
        ("uint16", &|v| (v % 2).to_ne_bytes().to_vec()),
    ];
    for (number, (name, bytes)) in types.into_iter().enumerate() {
        let fill = if name == "bool" { json!(false) } else { json!(0) };
        let metadata = changed(
            version_3(&json!([bytes_codec("big")])),
            &[("data_type", json!(name)), ("fill_value", fill)],
        );
        let path = format!("{number}.zarr");
        folder.array(&path, &metadata, values().into_iter().flat_map(bytes).collect());
        let field = &folder.read(&path).fields[0];
        assert_eq!(field.integer, !name.contains("float"), "{name}");
        assert!(field.values.iter().copied().eq(values().into_iter().map(|v| f64::from(v % 2))), "{name}");
    }
}

/// Everything by hand: what is written here does not know the crate that reads.
#[test]
fn metadata_and_chunks_that_were_written_by_hand_are_read() {
    let folder = Folder::new();
    folder.write(
        "hand.zarr/.zarray",
        r#"{ "zarr_format": 2, "shape": [2, 2, 3], "chunks": [2, 2, 2], "dtype": ">i2", "order": "F",
             "compressor": null, "fill_value": -5, "filters": null }"#,
    );
    // z fastest, as the order says.
    let chunk: Vec<u8> =
        [0_i16, 100, 10, 110, 1, 101, 11, 111].iter().flat_map(|v| v.to_be_bytes()).collect();
    folder.write("hand.zarr/0.0.0", chunk);
    // The other chunk is missing: it is the fill value.
    let expected = [0., 1., -5., 10., 11., -5., 100., 101., -5., 110., 111., -5.];
    assert_eq!(folder.read("hand.zarr").fields[0].values, expected);
    folder.write(
        "hand.zarr/.zattrs",
        r#"{ "_ARRAY_DIMENSIONS": ["x", "z", "y"], "scale_factor": 0.5, "add_offset": 1, "units": "K" }"#,
    );
    let mesh = folder.read("hand.zarr");
    assert_eq!(mesh.grid.expect("a grid").dims, [2, 3, 2]);
    let field = &mesh.fields[0];
    assert_eq!((field.unit.as_str(), field.integer), ("K", false));
    // x is the first axis, y the last one.
    let expected = [0., 100., 1., 101., -5., -5., 10., 110., 11., 111., -5., -5.].map(|v: f64| v * 0.5 + 1.0);
    assert_eq!(field.values, expected);
}

/// An image at two levels, with these axes, of this shape; each level is half as fine in space.
fn image(folder: &Folder, name: &str, axes: &[(&str, &str, &str)], shape: &[u64], version: u32) {
    let levels = ["0", "1"].map(|path| {
        let factor = if path == "0" { 1.0 } else { 2.0 };
        let scale: Vec<f64> = axes
            .iter()
            .map(|(name, kind, _)| match (*kind, *name) {
                ("space", "z") => 3.0 * factor,
                ("space", _) => 0.5 * factor,
                ("time", _) => 0.25,
                _ => 1.0,
            })
            .collect();
        let shift: Vec<f64> =
            axes.iter().map(|(_, kind, _)| if *kind == "space" { 1.0 } else { 0.0 }).collect();
        let transformations =
            json!([{ "type": "scale", "scale": scale }, { "type": "translation", "translation": shift }]);
        json!({ "path": path, "coordinateTransformations": transformations })
    });
    let axes: Vec<Value> =
        axes.iter().map(|(name, kind, unit)| json!({ "name": name, "type": kind, "unit": unit })).collect();
    let mut all = json!({
        "multiscales": [{ "name": "scan", "axes": axes, "datasets": levels }],
        "omero": { "channels": [{ "label": "DAPI" }, { "label": "" }] },
    });
    for path in ["0", "1"] {
        let shape: Vec<u64> = shape.to_vec();
        let count: u64 = shape.iter().product();
        let offset = if path == "0" { 0 } else { 1000 };
        let metadata = if version == 4 {
            changed(
                version_2(&json!({ "dimension_separator": "/" })),
                &[("shape", json!(shape)), ("chunks", json!(shape))],
            )
        } else {
            let grid = json!({ "name": "regular", "configuration": { "chunk_shape": shape } });
            changed(plain(), &[("shape", json!(shape)), ("chunk_grid", grid)])
        };
        let samples: Vec<u16> = (0..count).map(|i| offset + i as u16).collect();
        folder.array(&format!("{name}/{path}"), &metadata, bytes_of(&samples));
    }
    if version == 4 {
        folder.write_json(&format!("{name}/.zgroup"), &json!({ "zarr_format": 2 }));
        folder.write_json(&format!("{name}/.zattrs"), &all);
    } else {
        all["version"] = json!("0.5");
        let group = json!({ "zarr_format": 3, "node_type": "group", "attributes": { "ome": all } });
        folder.write_json(&format!("{name}/zarr.json"), &group);
    }
}

const SPACE: [(&str, &str, &str); 3] =
    [("z", "space", "nm"), ("y", "space", "micrometer"), ("x", "space", "micrometer")];

#[test]
fn images_lie_where_they_say() {
    let folder = Folder::new();
    for version in [4, 5] {
        let name = format!("{version}.ome.zarr");
        image(&folder, &name, &SPACE, &[2, 3, 4], version);
        let mesh = folder.read(&name);
        let grid = mesh.grid.expect("a grid");
        // z in the unit of x.
        assert_eq!((grid.dims, grid.spacing, grid.origin), ([4, 3, 2], [0.5, 0.5, 0.003], [1.0, 1.0, 0.001]));
        assert_eq!(mesh.fields[0].name, "scan");
        assert!(mesh.notes.contains(&"lengths are in micrometers".to_owned()), "{:?}", mesh.notes);
        let coarse = folder.read(&format!("{name}/1"));
        assert_eq!(coarse.grid.expect("a grid").spacing, [1.0, 1.0, 0.006]);
        assert_eq!(coarse.fields[0].values[0], 1000.0);
    }
}

#[test]
fn an_image_that_is_too_large_names_a_level_that_is_not() {
    let folder = Folder::new();
    image(&folder, "large.zarr", &SPACE, &[2, 3, 4], 5);
    folder.write_json(
        "large.zarr/0/zarr.json",
        &changed(plain(), &[("shape", json!([1 << 11, 1 << 11, 1 << 11]))]),
    );
    let said = folder.refused("large.zarr");
    assert!(said.contains("z (2048), y (2048), x (2048)") && said.ends_with("large.zarr/1"), "{said}");
    assert_eq!(folder.read("large.zarr/1").grid.expect("a grid").dims, [4, 3, 2]);
}

#[test]
fn times_are_steps_and_channels_are_fields() {
    let folder = Folder::new();
    let axes = [&[("t", "time", "second"), ("c", "channel", "")], &SPACE[..]].concat();
    image(&folder, "all.zarr", &axes, &[3, 2, 2, 2, 2], 5);
    let path = folder.path("all.zarr");
    let steps = io::steps(&path).expect("steps");
    assert_eq!(steps.iter().map(|step| step.time).collect::<Vec<_>>(), [Some(0.0), Some(0.25), Some(0.5)]);
    for (number, step) in steps.iter().enumerate() {
        let options = ReadOptions { step: step.number, ..ReadOptions::default() };
        let mesh = io::read_with(&path, &options).expect("a step");
        let names: Vec<&str> = mesh.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["scan_DAPI", "scan_1"]);
        for (channel, field) in mesh.fields.iter().enumerate() {
            let first = (16 * number + 8 * channel) as f64;
            assert_eq!((field.values[0], field.values[7], field.time), (first, first + 7.0, step.time));
        }
    }
    let options = ReadOptions { fields: Some(vec!["scan_1".into()]), ..ReadOptions::default() };
    let one = io::read_with(&path, &options).expect("one field");
    assert_eq!((one.fields.len(), one.input.other_fields[0].name.as_str()), (1, "scan_DAPI"));
    let beyond = io::read_with(&path, &ReadOptions { step: 3, ..ReadOptions::default() });
    assert!(beyond.unwrap_err().to_string().contains("time step 3 of 3"));
}

#[test]
fn arrays_of_a_group_are_fields_of_one_grid() {
    let folder = Folder::new();
    let named = |names: &[&str]| changed(plain(), &[("dimension_names", json!(names))]);
    folder.write_json("g.zarr/zarr.json", &json!({ "zarr_format": 3, "node_type": "group" }));
    folder.array("g.zarr/density", &named(&["z", "lat", "x"]), bytes_of(&values()));
    let pressure = changed(named(&["z", "lat", "x"]), &[("attributes", json!({ "units": "Pa" }))]);
    folder.array("g.zarr/pressure", &pressure, bytes_of(&values()));
    let mesh = folder.read("g.zarr");
    let names: Vec<(&str, &str)> = mesh.fields.iter().map(|f| (f.name.as_str(), f.unit.as_str())).collect();
    assert_eq!(names, [("density", ""), ("pressure", "Pa")]);
    // Coordinates, as xarray writes them: even ones make a regular grid.
    let along = |name: &str, list: &[f64], folder: &Folder| {
        let grid = json!({ "name": "regular", "configuration": { "chunk_shape": [list.len()] } });
        let metadata = changed(
            plain(),
            &[
                ("shape", json!([list.len()])),
                ("data_type", json!("float64")),
                ("chunk_grid", grid),
                ("dimension_names", json!([name])),
            ],
        );
        folder.array(
            &format!("g.zarr/{name}"),
            &metadata,
            list.iter().flat_map(|x| x.to_ne_bytes()).collect(),
        );
    };
    along("x", &[2.0, 2.5, 3.0], &folder);
    let grid = folder.read("g.zarr").grid.expect("a grid");
    assert_eq!((grid.origin, grid.spacing), ([2.0, 0.0, 0.0], [0.5, 1.0, 1.0]));
    assert_eq!(folder.read("g.zarr/pressure").grid, Some(grid), "also of one array");
    along("lat", &[0.0, 1.0, 3.0, 4.0], &folder);
    let uneven = folder.read("g.zarr");
    assert_eq!((uneven.grid, uneven.positions[6]), (None, [2.0, 3.0, 0.0]));
    along("lat", &[0.0, 3.0, 1.0, 4.0], &folder);
    assert!(folder.refused("g.zarr").contains("coordinates"));

    // An array of one axis that is no coordinate is left out, which is said.
    fs::remove_dir_all(folder.path("g.zarr/lat")).expect("a folder");
    along("other", &[1.0, 2.0], &folder);
    assert!(folder.read("g.zarr").notes[0].contains("array \"other\" is left out: its axes are other (2)"));
    // Another shape is an error that says what there is, and what to give.
    let grid = json!({ "name": "regular", "configuration": { "chunk_shape": [2, 2, 2] } });
    folder.array(
        "g.zarr/small",
        &changed(plain(), &[("shape", json!([2, 2, 2])), ("chunk_grid", grid)]),
        vec![0; 16],
    );
    let refused = folder.refused("g.zarr");
    assert!(refused.contains("\"density\" with z (5), lat (4), x (3)"), "{refused}");
    assert!(refused.contains("\"small\" with 2 x 2 x 2") && refused.contains("g.zarr/density"), "{refused}");
    assert_eq!(folder.read("g.zarr/small").fields[0].name, "small");
}

#[test]
fn what_cannot_be_read_is_named() {
    let folder = Folder::new();
    let put = |name: &str, metadata: &Value| {
        folder.write_json(&format!("{name}/zarr.json"), metadata);
        folder.refused(name)
    };
    let with = |name: &str, changes: &[(&str, Value)], expected: &[&str]| {
        let said = put(name, &changed(plain(), changes));
        assert!(expected.iter().all(|part| said.contains(part)), "{name}: {said}");
    };
    let codec = json!([bytes_codec("little"), { "name": "fancy", "configuration": {} }]);
    with("codec.zarr", &[("codecs", codec)], &["codec.zarr", "the array", "fancy", "zstd or blosc"]);
    with(
        "complex.zarr",
        &[("data_type", json!("complex64")), ("fill_value", json!([0, 0]))],
        &["complex64", "real part"],
    );
    with(
        "string.zarr",
        &[
            ("data_type", json!("string")),
            ("fill_value", json!("")),
            ("codecs", json!([{ "name": "vlen-utf8" }])),
        ],
        &["string"],
    );
    let grid = |shape: &[u64]| json!({ "name": "regular", "configuration": { "chunk_shape": shape } });
    with("2d.zarr", &[("shape", json!([3, 3])), ("chunk_grid", grid(&[3, 3]))], &["3 x 3", "stack"]);
    with(
        "4d.zarr",
        &[("shape", json!([3, 3, 3, 3])), ("chunk_grid", grid(&[3, 3, 3, 3]))],
        &["3 x 3 x 3 x 3", "dimension_names"],
    );
    with("names.zarr", &[("dimension_names", json!(["z", "y"]))], &["names of axes", "expected 3, found 2"]);
    with("thin.zarr", &[("shape", json!([1, 3, 3]))], &["3 x 3 x 1 points"]);
    with("huge.zarr", &[("shape", json!([1_u64 << 40, 3, 3]))], &["grid points"]);
    with("chunk.zarr", &[("chunk_grid", grid(&[1 << 20, 1 << 20, 1 << 20]))], &["bytes in a chunk"]);
    with("shape.zarr", &[("shape", json!("big"))], &["shape"]);
    with("kind.zarr", &[("node_type", json!("thing"))], &["node_type"]);
    folder.write("json.zarr/zarr.json", "{");
    assert!(folder.refused("json.zarr").contains("zarr.json: it is no object in JSON"));
    fs::create_dir_all(folder.path("empty.zarr")).expect("a folder");
    let said = folder.refused("empty.zarr");
    assert!(said.contains("zarr.json (version 3), .zarray or .zgroup (version 2) is missing"), "{said}");
    folder.write_json("groups.zarr/zarr.json", &json!({ "zarr_format": 3, "node_type": "group" }));
    assert!(folder.refused("groups.zarr").contains("an array in this group"));
    folder.write_json("groups.zarr/a/zarr.json", &json!({ "zarr_format": 3, "node_type": "group" }));
    let said = folder.refused("groups.zarr");
    assert!(said.contains("a group of groups (a)") && said.contains("groups.zarr/a"), "{said}");
    // Values that are not finite, here of chunks that are missing, as in other formats.
    with(
        "nan.zarr",
        &[("data_type", json!("float32")), ("fill_value", json!("NaN"))],
        &["\"value\" at point 0", "replace it"],
    );
    // A path of an image leads nowhere else.
    let datasets = json!([{ "path": "../codec.zarr", "coordinateTransformations": [] }]);
    let multiscales = json!({ "ome": { "multiscales": [{ "axes": [], "datasets": datasets }] } });
    let group = json!({ "zarr_format": 3, "node_type": "group", "attributes": multiscales });
    assert!(put("away.zarr", &group).contains("another folder"));
}

#[test]
fn chunks_that_are_damaged_are_named() {
    let folder = Folder::new();
    let crc32c = json!([bytes_codec("little"), { "name": "crc32c" }]);
    for (name, metadata) in [("plain.zarr", plain()), ("crc.zarr", version_3(&crc32c))] {
        folder.array(name, &metadata, bytes_of(&values()));
        // Also where the chunk reaches beyond the array.
        let chunk = format!("{name}/c/1/0/1");
        let mut bytes = fs::read(folder.path(&chunk)).expect("a chunk");
        if name == "plain.zarr" {
            bytes.truncate(bytes.len() - 1)
        } else {
            bytes[3] ^= 1
        }
        folder.write(&chunk, bytes);
        let said = folder.refused(name);
        assert!(said.contains("chunk \"c/1/0/1\": the data is damaged"), "{said}");
    }
    #[cfg(unix)]
    {
        let chunk = folder.path("plain.zarr/c/1/0/1");
        fs::remove_file(&chunk).expect("a file");
        fs::create_dir(&chunk).expect("a folder");
        assert!(folder.refused("plain.zarr").contains("c/1/0/1\": it is no file"));
    }
}

#[test]
fn no_cut_and_no_bit_flip_of_metadata_panics() {
    let folder = Folder::new();
    folder.array("a.zarr", &plain(), bytes_of(&values()));
    let metadata = fs::read(folder.path("a.zarr/zarr.json")).expect("metadata");
    let options = ReadOptions { memory: io::MemoryLimit::of(1 << 24), ..ReadOptions::default() };
    for length in 0..metadata.len() {
        folder.write("a.zarr/zarr.json", &metadata[..length]);
        assert!(io::read(&folder.path("a.zarr")).is_err(), "{length}");
    }
    for bit in 0..8 * metadata.len() {
        let mut flipped = metadata.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        folder.write("a.zarr/zarr.json", flipped);
        drop(io::read_with(&folder.path("a.zarr"), &options));
    }
}

#[test]
fn memory_is_limited() {
    let folder = Folder::new();
    folder.array("a.zarr", &plain(), bytes_of(&values()));
    let read = |most| {
        let options = ReadOptions { memory: io::MemoryLimit::of(most), ..ReadOptions::default() };
        io::read_with(&folder.path("a.zarr"), &options)
    };
    assert!(read(1 << 20).is_ok());
    assert_eq!(read(300).unwrap_err().reason, ReadReason::Memory { limit: 300 });
}

#[test]
fn boxes_are_read_without_the_chunks_beside_them() {
    let folder = Folder::new();
    let mut read = BTreeMap::new();
    for (name, metadata) in all_ways() {
        folder.array(&name, &metadata, bytes_of(&values()));
        let pieces = Pieces::open_ranges(&folder.path(&name), &ReadOptions::default(), None);
        let pieces = pieces.expect("it can be read").expect("in parts");
        let grid = pieces.grid().expect("a grid");
        assert_eq!((grid.mesh().counts(), grid.mesh().fields[0].values.len()), ([60, 144], 0));
        let expected = |range: [std::ops::Range<u64>; 3]| -> Vec<f64> {
            let [xs, ys, zs] = range;
            let row = |z: u64, y: u64| xs.clone().map(move |x| f64::from(value([x, y, z])));
            zs.flat_map(|z| ys.clone().flat_map(move |y| row(z, y)).collect::<Vec<_>>()).collect()
        };
        for range in [[0..3, 0..4, 0..5], [1..2, 1..4, 2..4], [2..3, 3..4, 4..5]] {
            let points = range.clone().map(|r: std::ops::Range<u64>| r.start as u32..r.end as u32);
            assert_eq!(grid.values(0, points).expect("a box"), expected(range), "{name}");
        }
        read.insert(name, grid.layers());
    }
    assert_eq!(
        (read["3-plain.zarr"], read["3-shards.zarr"]),
        (4, 5),
        "as many chunks as there are whole, and all layers"
    );
    // What is beside a box may be damaged.
    folder.write("3-plain.zarr/c/2/1/1", "");
    let pieces = Pieces::open_ranges(&folder.path("3-plain.zarr"), &ReadOptions::default(), None);
    let pieces = pieces.expect("it can be read").expect("in parts");
    let grid = pieces.grid().expect("a grid");
    assert_eq!(grid.values(0, [0..2, 0..3, 0..2]).expect("a box").len(), 12);
    let said = pieces.named(grid.values(0, [0..3, 0..4, 0..5]).unwrap_err()).to_string();
    assert!(said.contains("3-plain.zarr") && said.contains("c/2/1/1"), "{said}");
}

#[test]
fn boxes_at_the_end_of_a_grid_of_as_many_samples_as_have_numbers() {
    const CHUNK: usize = 64;
    let folder = Folder::new();
    let large = |shape: [u64; 3]| {
        let chunk = [CHUNK; 3];
        let chunks = json!({ "name": "regular", "configuration": { "chunk_shape": chunk } });
        changed(
            version_3(&json!([bytes_codec("little")])),
            &[("shape", json!(shape)), ("chunk_grid", chunks)],
        )
    };
    // Some 8 GB, of which there is one chunk: the last.
    folder.write_json("large.zarr/zarr.json", &large([1626, 1625, 1625]));
    let at = |k: usize| (k % CHUNK + 100 * (k / CHUNK % CHUNK) + 7 * (k / CHUNK / CHUNK)) as u16;
    let chunk: Vec<u8> = (0..CHUNK.pow(3)).flat_map(|k| at(k).to_le_bytes()).collect();
    folder.write("large.zarr/c/25/25/25", chunk);
    let pieces = Pieces::open_ranges(&folder.path("large.zarr"), &ReadOptions::default(), None);
    let pieces = pieces.expect("it can be read").expect("in parts");
    let counts = pieces.counts().expect("counts");
    assert_eq!([counts.points, counts.tetrahedra], [1625 * 1625 * 1626, 6 * 1624 * 1624 * 1625]);
    let grid = pieces.grid().expect("a grid");
    for range in [[1622..1625, 1600..1603, 1623..1626], [1598..1602, 1624..1625, 1599..1601]] {
        let values = grid.values(0, range.clone()).expect("a box");
        let [xs, ys, zs] = range;
        let expected = |[x, y, z]: [u32; 3]| match [x, y, z].map(|k| k.checked_sub(1600)) {
            [Some(x), Some(y), Some(z)] => f64::from(x + 100 * y + 7 * z),
            _ => 7.0,
        };
        let row = |y: u32, z: u32| xs.clone().map(move |x| expected([x, y, z]));
        let all = zs.flat_map(|z| ys.clone().flat_map(move |y| row(y, z)).collect::<Vec<_>>());
        assert_eq!(values, all.collect::<Vec<_>>());
    }
    // More have no numbers.
    folder.write_json("larger.zarr/zarr.json", &large([4096; 3]));
    let refused = Pieces::open_ranges(&folder.path("larger.zarr"), &ReadOptions::default(), None);
    let said = refused.expect_err("too many samples").to_string();
    let words = "more than 4294967294 grid points (there are 4096 x 4096 x 4096; one of 3 along each axis would be 1366 x 1366 x 1366)";
    assert!(said.contains("larger.zarr") && said.contains(words), "{said}");
}

#[test]
fn parts_of_values_that_are_read_for_each_are_those_of_the_whole() {
    let folder = Folder::new();
    for (name, metadata) in all_ways() {
        folder.array(&name, &metadata, bytes_of(&values()));
        let [whole, read] = parts_of(&folder.path(&name), &BuildConfig::default(), 4);
        assert_eq!(whole.as_ref().map(Vec::len), Ok(4), "{name}");
        assert!(whole == read, "{name}");
    }
    // Floating-point numbers, some fields, and one that is a label by its name.
    folder.write_json("g.zarr/zarr.json", &json!({ "zarr_format": 3, "node_type": "group" }));
    let floats = changed(plain(), &[("data_type", json!("float64"))]);
    let bytes = values().into_iter().flat_map(|v| f64::from(v).sin().to_ne_bytes()).collect();
    folder.array("g.zarr/density", &floats, bytes);
    let labels: Vec<u16> = values().into_iter().map(|v| v % 3).collect();
    folder.array("g.zarr/material", &plain(), bytes_of(&labels));
    for all_lossless in [false, true] {
        let config = BuildConfig { all_fields: true, all_lossless, ..BuildConfig::default() };
        let [whole, read] = parts_of(&folder.path("g.zarr"), &config, 8);
        assert_eq!(whole.as_ref().map(Vec::len), Ok(8));
        assert!(whole == read);
    }
    let config = BuildConfig { field_precision: FieldPrecision::Units(0.1), ..BuildConfig::default() };
    let [whole, read] = parts_of(&folder.path("g.zarr"), &config, 2);
    assert!(whole.is_ok() && read.expect_err("it needs all values").contains("a tolerance is given"));
}

#[cfg(feature = "http")]
mod on_servers {
    use super::*;
    use std::io::{BufRead, BufReader, Write};
    use std::net::{TcpListener, TcpStream};
    use std::sync::Mutex;
    use std::thread;

    /// A server of a folder, and what it was asked for.
    struct Server {
        address: String,
        asked: Arc<Mutex<Vec<String>>>,
    }

    impl Server {
        /// `broken` is what its answer to that path is instead.
        fn start(root: &Path, broken: Option<(&'static str, &'static str)>) -> Self {
            let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
            let address = format!("http://{}", listener.local_addr().expect("an address"));
            let (root, asked) = (root.to_owned(), Arc::new(Mutex::new(Vec::new())));
            let shared = Arc::clone(&asked);
            thread::spawn(move || {
                for stream in listener.incoming().flatten() {
                    let (root, asked) = (root.clone(), Arc::clone(&shared));
                    thread::spawn(move || while answer(&stream, &root, broken, &asked).is_some() {});
                }
            });
            Self { address, asked }
        }

        fn asked(&self) -> Vec<String> {
            self.asked.lock().expect("no panic").clone()
        }
    }

    fn answer(
        stream: &TcpStream,
        root: &Path,
        broken: Option<(&str, &str)>,
        asked: &Mutex<Vec<String>>,
    ) -> Option<()> {
        let mut lines = BufReader::new(stream).lines();
        let path = lines.next()?.ok()?.split(' ').nth(1)?.trim_start_matches('/').to_owned();
        let mut range = None;
        for line in lines {
            let line = line.ok()?.to_ascii_lowercase();
            if line.is_empty() {
                break;
            }
            range = line.strip_prefix("range: bytes=").map(str::to_owned).or(range);
        }
        asked.lock().expect("no panic").push(path.clone());
        let mut stream = stream;
        let found = fs::read(root.join(&path)).ok();
        if let Some((_, status)) = broken.filter(|(broken, _)| path.ends_with(broken)) {
            write!(stream, "HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n").ok()?;
            return Some(());
        }
        let Some(bytes) = found else {
            write!(stream, "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n").ok()?;
            return Some(());
        };
        let range = range?;
        let (start, last) = range.split_once('-')?;
        let start: usize = start.parse().ok()?;
        let end = last.parse::<usize>().map_or(bytes.len(), |last| (last + 1).min(bytes.len()));
        let part = &bytes[start..end];
        let place = format!("bytes {start}-{}/{}", end - 1, bytes.len());
        let length = part.len();
        let kind = "application/octet-stream";
        write!(stream, "HTTP/1.1 206 Partial Content\r\nContent-Type: {kind}\r\nContent-Range: {place}\r\nContent-Length: {length}\r\n\r\n").ok()?;
        stream.write_all(part).ok()
    }

    #[test]
    fn arrays_and_images_on_servers_are_read() {
        let folder = Folder::new();
        let all = all_ways();
        for (name, metadata) in &all {
            folder.array(name, metadata, bytes_of(&values()));
        }
        image(&folder, "image.zarr", &SPACE, &[2, 3, 4], 4);
        fs::remove_file(folder.path("3-plain.zarr/c/0/0/0")).expect("a chunk");
        let server = Server::start(folder.0.path(), None);
        for name in all.iter().map(|(name, _)| name.as_str()).chain(["image.zarr", "image.zarr/1"]) {
            let address = PathBuf::from(format!("{}/{name}", server.address));
            let mesh = io::read(&address).unwrap_or_else(|error| panic!("{error}"));
            let local = folder.read(name);
            assert_eq!((&mesh.fields, mesh.grid), (&local.fields, local.grid), "{name}");
        }
        // A missing object is a missing chunk.
        assert_eq!(folder.read("3-plain.zarr").fields[0].values[0], 7.0);
        let asked = server.asked();
        assert!(asked.contains(&"image.zarr/0/0/0/0".to_owned()), "{asked:?}");
        // A box takes the chunks that it is in.
        let address = PathBuf::from(format!("{}/3-big.zarr", server.address));
        let pieces = Pieces::open_ranges(&address, &ReadOptions::default(), None);
        let pieces = pieces.expect("it can be read").expect("in parts");
        let before = server.asked().len();
        pieces.grid().expect("a grid").values(0, [0..1, 0..1, 0..1]).expect("a box");
        let asked = server.asked();
        assert!(asked[before..].iter().all(|path| path == "3-big.zarr/c/0/0/0"), "{:?}", &asked[before..]);
    }

    #[test]
    fn failures_of_servers_name_the_address() {
        let folder = Folder::new();
        folder.array("a.zarr", &plain(), bytes_of(&values()));
        let group = json!({ "zarr_format": 3, "node_type": "group" });
        folder.write_json("group.zarr/zarr.json", &group);
        let server = Server::start(folder.0.path(), Some(("c/1/0/0", "403 Forbidden")));
        let read = |name: &str| io::read(&PathBuf::from(format!("{}/{name}", server.address)));
        let said = read("a.zarr").unwrap_err().to_string();
        assert!(said.contains(&format!("{}/a.zarr/c/1/0/0", server.address)), "{said}");
        assert!(said.contains("HTTP 403"), "{said}");
        let said = read("none.zarr").unwrap_err().to_string();
        assert!(said.contains("none.zarr") && said.contains("zarr.json (version 3)"), "{said}");
        let said = read("group.zarr").unwrap_err().to_string();
        assert!(said.contains("does not say what is in it") && said.contains("consolidate"), "{said}");
        // Consolidated metadata say what is in a group.
        let server = Server::start(folder.0.path(), None);
        let read = |name: &str| io::read(&PathBuf::from(format!("{}/{name}", server.address)));
        folder.array("group.zarr/one", &plain(), bytes_of(&values()));
        let all = json!({ "kind": "inline", "must_understand": false, "metadata": { "one": plain() } });
        folder.write_json("group.zarr/zarr.json", &changed(group, &[("consolidated_metadata", all)]));
        assert_eq!(read("group.zarr").expect("a group").fields[0].name, "one");
    }
}
