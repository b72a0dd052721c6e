//! Promise: an MT file in shards is the same bytes in several files, which all commands read as one, here and from a server; shards of an
//! older file are never left to be taken for those of another.

use crate::support::{Folder, Server, bad, bucky, good, json};
use std::fs;
use std::path::Path;

/// The files of a folder that are of an MT file of this name, one behind the other.
fn shards(folder: &Folder, name: &str) -> (Vec<String>, Vec<u8>) {
    let names: Vec<String> = folder.names().into_iter().filter(|found| found.starts_with(name)).collect();
    let bytes = names.iter().flat_map(|name| fs::read(folder.path(name)).expect("it is there"));
    (names.clone(), bytes.collect())
}

#[test]
fn files_are_cut_put_together_and_read_as_one() {
    let folder = Folder::new("shards");
    let [grid, mt, cut, back, built] =
        ["b.vti", "b.mt", "cut.mt", "back.mt", "built.mt"].map(|name| folder.path(name));
    bucky(33, &grid, &mt);
    let whole = fs::read(&mt).expect("it is there");
    let count = whole.len().div_ceil(64 << 10);
    assert!(count >= 3, "{} bytes", whole.len());
    let report = json(&["convert", &mt, "--shard-size", "64K", "-o", &cut, "--json"]);
    assert_eq!(
        (report["shards"].as_u64(), report["file_bytes"].as_u64()),
        (Some(count as u64), Some(whole.len() as u64))
    );
    let (names, bytes) = shards(&folder, "cut.mt");
    assert_eq!((names.len(), &names[..2]), (count, &["cut.mt".to_owned(), "cut.mt.0001".to_owned()][..]));
    assert!(bytes == whole, "in their order they are the file");
    let lengths = names.iter().map(|name| fs::metadata(folder.path(name)).expect("it is there").len());
    assert!(lengths.take(count - 1).all(|length| length == 64 << 10));
    // Built so at once, and by another file of shards.
    good(&["build", &grid, "-o", &built, "--shard-size", "64K", "--quiet"]);
    assert!(shards(&folder, "built.mt").1 == whole);

    let server = Server::start(&[&cut]);
    let of_folder = Server::start(&[&folder.path("")]);
    let in_folder = format!("{}cut.mt?name=b", of_folder.url);
    for file in [&cut, &server.url, &in_folder] {
        let ask =
            |file: &str| json(&["extract", file, "--error", "1%", "-o", &folder.path("out.vtu"), "--json"]);
        let (here, there) = (ask(&mt), ask(file));
        for key in ["hash", "file_bytes", "relative_error_bound"] {
            assert_eq!(here[key], there[key], "{file}: {key}");
        }
        assert_eq!(json(&["info", &mt, "--json"]), json(&["info", file, "--json"]), "{file}");
        good(&["convert", file, "--shard-size", "none", "-o", &back, "--quiet"]);
        assert!(fs::read(&back).expect("it is there") == whole, "{file}");
    }
    good(&["verify", &cut, "--against", &grid, "--quick"]);

    // What is left of an older file goes, and nothing else is left. A file that only has such a name stays.
    let other = folder.path("back.mt.0001");
    fs::write(&other, "mine").expect("a file");
    good(&["convert", &cut, "--shard-size", "none", "-o", &back, "--quiet"]);
    assert_eq!(fs::read(&other).expect("it is there"), b"mine");
    good(&["convert", &mt, "--shard-size", "100K", "-o", &cut, "--quiet"]);
    let (names, bytes) = shards(&folder, "cut.mt");
    assert_eq!(names.len(), whole.len().div_ceil(100 << 10));
    assert!(bytes == whole);
    good(&["convert", &back, "--kind", "vertex", "-o", &cut, "--quiet"]);
    assert_eq!(shards(&folder, "cut.mt").0, ["cut.mt"]);
    assert!(folder.names().iter().all(|name| !name.starts_with('.')), "{:?}", folder.names());
}

#[test]
fn shards_that_are_not_as_they_must_be_are_named() {
    let folder = Folder::new("shards-bad");
    let [grid, mt, cut, out] = ["b.vti", "b.mt", "cut.mt", "out.vtu"].map(|name| folder.path(name));
    bucky(33, &grid, &mt);
    good(&["convert", &mt, "--shard-size", "64K", "-o", &cut, "--quiet"]);
    let server = Server::start(&[&cut]);
    let second = folder.path("cut.mt.0001");
    let bytes = fs::read(&second).expect("it is there");
    let mut longer = bytes.clone();
    longer.push(0);
    let told = |words: &[&str]| {
        for file in [&cut, &server.url] {
            let all: Vec<&str> = words.iter().copied().chain([&**file]).collect();
            bad(1, &["extract", file, "-o", &out], &all);
        }
        bad(1, &["convert", &cut, "--shard-size", "none", "-o", &out.replace(".vtu", ".mt")], words);
        assert!(!Path::new(&out).exists() && !Path::new(&out.replace(".vtu", ".mt")).exists());
    };
    fs::write(&second, &bytes[..1000]).expect("it is there");
    told(&["`.0001`", "1000 bytes instead of 65536"]);
    fs::write(&second, &longer).expect("it is there");
    told(&["`.0001`", "65537 bytes instead of 65536"]);
    fs::remove_file(&second).expect("it is there");
    told(&["`.0001`", "cut off", "shards"]);
    // Options.
    bad(2, &["convert", &mt, "--shard-size", "63K", "-o", &cut], &["64K"]);
    bad(2, &["convert", &mt, "-o", &cut], &["--kind"]);
    bad(1, &["convert", &mt, "--shard-size", "64K", "-o", &mt], &["input"]);
    bad(
        1,
        &["convert", &grid, "--shard-size", "64K", "-o", &out.replace(".vtu", ".mt")],
        &["not an MT file"],
    );
    if cfg!(unix) {
        bad(1, &["convert", &mt, "--shard-size", "64K", "-o", "/dev/null"], &["/dev/null"]);
    }
}
