//! Promise: an MT file of a Zarr array has the bytes of that of the same samples in another format, whole and in parts, of which each reads the
//! chunks that it needs, as does `verify --samples`; an address that is none of Zarr is refused.

use crate::support::{Folder, bad, good, json, run, text};
use std::fs;

/// Points along x, y and z, and those of a chunk.
const DIMS: [usize; 3] = [21, 18, 25];
const CHUNK: [usize; 3] = [8, 10, 7];

/// A sample, which varies in all directions.
fn sample([x, y, z]: [usize; 3]) -> f32 {
    let [x, y, z] = [x, y, z].map(|i| i as f32 * 0.25);
    x * x - y * z + (x * y).min(z)
}

/// The bytes of the samples in a box, x fastest; those outside of the volume are 0.
fn samples(first: [usize; 3], count: [usize; 3], bytes: &dyn Fn(f32) -> Vec<u8>) -> Vec<u8> {
    let mut all = Vec::new();
    for z in first[2]..first[2] + count[2] {
        for y in first[1]..first[1] + count[1] {
            for x in first[0]..first[0] + count[0] {
                let is_in = [x, y, z].iter().zip(DIMS).all(|(at, count)| *at < count);
                all.extend(bytes(if is_in { sample([x, y, z]) } else { 0.0 }));
            }
        }
    }
    all
}

/// Writes the samples as `name.zarr` and `name.raw` with its `.json`.
fn write(
    folder: &Folder,
    name: &str,
    [of_zarr, of_raw]: [&str; 2],
    bytes: &dyn Fn(f32) -> Vec<u8>,
) -> [String; 2] {
    let [zarr, raw, sidecar] = ["zarr", "raw", "json"].map(|ending| folder.path(&format!("{name}.{ending}")));
    fs::create_dir(&zarr).expect("a folder");
    let reversed = |list: [usize; 3]| format!("[{}, {}, {}]", list[2], list[1], list[0]);
    let metadata = format!(
        r#"{{ "zarr_format": 2, "shape": {}, "chunks": {}, "dtype": "{of_zarr}", "order": "C", "compressor": null, "fill_value": 0, "filters": null }}"#,
        reversed(DIMS),
        reversed(CHUNK)
    );
    fs::write(format!("{zarr}/.zarray"), metadata).expect("a file");
    let chunks = [0, 1, 2].map(|k| DIMS[k].div_ceil(CHUNK[k]));
    for k in 0..chunks[2] {
        for j in 0..chunks[1] {
            for i in 0..chunks[0] {
                let first = [i * CHUNK[0], j * CHUNK[1], k * CHUNK[2]];
                fs::write(format!("{zarr}/{k}.{j}.{i}"), samples(first, CHUNK, bytes)).expect("a chunk");
            }
        }
    }
    fs::write(&raw, samples([0; 3], DIMS, bytes)).expect("a file");
    let remarks = format!(r#"{{ "dims": {DIMS:?}, "type": "{of_raw}", "field": "value" }}"#);
    fs::write(&sidecar, remarks).expect("a file");
    [zarr, sidecar]
}

#[test]
fn the_whole_and_its_parts_are_those_of_other_formats() {
    let folder = Folder::new("zarr");
    let floats = write(&folder, "floats", ["<f4", "float32"], &|x| x.to_le_bytes().to_vec());
    let integers = write(&folder, "integers", ["<i2", "int16"], &|x| (x as i16).to_le_bytes().to_vec());
    let [one, other] = ["one.mt", "other.mt"].map(|name| folder.path(name));
    let bytes = |path: &str| fs::read(path).expect("a file");
    for [zarr, raw] in [&floats, &integers] {
        for options in [
            &[][..],
            &["--parts", "4"],
            &["--parts", "16", "--lossless"],
            &["--parts", "2", "--label", "value"],
            &["--parts", "2", "--field-tolerance", "0.1"],
        ] {
            if options.contains(&"--label") && zarr.contains("floats") {
                continue;
            }
            good(&[&["build", zarr, "-o", &one, "--quiet"], options].concat());
            good(&[&["build", raw, "-o", &other, "--quiet"], options].concat());
            assert!(bytes(&one) == bytes(&other), "{zarr} {options:?}");
        }
    }
    assert_eq!(json(&["verify", &one, "--against", &integers[0], "--quick", "--json"])["valid"], true);
    // As `tetralod part` has it, too, and each chunk is there for a reason.
    let [dir, again] = ["dir", "again"].map(|name| folder.path(name));
    good(&["part", &floats[0], "--parts", "8", "-o", &dir]);
    good(&["part", &floats[1], "--parts", "8", "-o", &again]);
    for index in 0..8 {
        let part = format!("input-{index}.part");
        assert!(bytes(&format!("{dir}/{part}")) == bytes(&format!("{again}/{part}")), "{part}");
    }
    // What needs all values at once is said.
    let output = run(&["build", &floats[0], "-o", &one, "--parts", "2", "--field-tolerance", "0.1"]);
    assert!(text(&output.stderr).contains("a tolerance is given"), "{}", text(&output.stderr));
    fs::write(format!("{}/1.1.1", floats[0]), "cut").expect("a file");
    for options in [&["--parts", "4"][..], &[]] {
        bad(
            1,
            &[&["build", &floats[0], "-o", &one], options].concat(),
            &["floats.zarr", "chunk \"1.1.1\"", "damaged"],
        );
    }
}

#[test]
fn samples_are_verified_against_boxes_of_a_grid() {
    let folder = Folder::new("zarr-verify");
    let [zarr, raw] = write(&folder, "floats", ["<f4", "float32"], &|x| x.to_le_bytes().to_vec());
    let mt = folder.path("one.mt");
    good(&["build", &zarr, "-o", &mt, "--quiet"]);
    let verify = ["verify", &mt, "--samples", "9", "--json", "--against"];
    let reports = [&zarr, &raw].map(|input| json(&[&verify[..], &[input.as_str()]].concat()));
    assert_eq!((&reports[0]["valid"], &reports[0]["queries"]), (&true.into(), &9.into()));
    assert_eq!(reports[0], reports[1]);
    // What cannot be read is an error of the input, and none of the file.
    let samples = raw.replace(".json", ".raw");
    let mut bytes = fs::read(&samples).expect("a file");
    bytes[4 * 4000..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(&samples, bytes).expect("a file");
    bad(1, &[&verify[..], &[&raw]].concat(), &["floats.json", "point 4000"]);
    fs::write(format!("{zarr}/1.1.1"), "cut").expect("a file");
    bad(1, &[&verify[..], &[&zarr]].concat(), &["floats.zarr", "chunk \"1.1.1\"", "damaged"]);
}

#[test]
fn addresses_of_other_formats_are_refused() {
    let folder = Folder::new("zarr-address");
    let one = folder.path("one.mt");
    bad(
        1,
        &["build", "http://localhost/mesh.vtu", "-o", &one],
        &["meshes are not read by http, but for Zarr", "fetch"],
    );
    bad(1, &["build", "ftp://localhost/a.zarr", "-o", &one], &["not read by ftp"]);
    bad(
        1,
        &["build", "http://127.0.0.1:1/a.zarr", "-o", &one],
        &["http://127.0.0.1:1/a.zarr", "cannot be reached"],
    );
}
