//! Promise: what fuzzing has found once does not come back. Each file in `tests/regressions` goes to the fuzz target that its
//! name begins with.

#[path = "../../fuzz/src/exercise.rs"]
mod exercise;

use crate::support::files::{assemble, bytes_in_blocks, half_edge, inserted, sample, sections};
use std::fs;
use std::path::Path;

const TARGETS: [&str; 7] = ["decode_fixed", "decode", "index", "refine", "import", "folder", "hdf5"];

#[test]
fn no_finding_comes_back() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions");
    let entries = fs::read_dir(folder).expect("the folder is there");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    assert!(!files.is_empty());
    for file in files {
        let name = file.file_name().and_then(|name| name.to_str()).expect("a plain name");
        let target = TARGETS.iter().find(|target| name.starts_with(&format!("{target}-")));
        let input = fs::read(&file).expect("it is there");
        assert!(target.is_some_and(|target| exercise::run(target, &input)), "{name}");
    }
}

/// The targets find nothing in good files, and the harness leaves these as they are.
#[test]
fn good_files_pass() {
    let script = [0, 1, 2, 3, 60, 5, 36, 97, 200, 66, 10, 11, 193, 13, 74, 15];
    for mt in [sample(2, 60), inserted(2, 1, 60), half_edge(2, 1, 60)] {
        let file = bytes_in_blocks(&mt, 4);
        assert_eq!(exercise::repaired(&file), file);
        let input = [&script[..], &file].concat();
        for target in TARGETS {
            assert!(exercise::run(target, &input));
        }
        // Damage in a section is behind a good checksum again.
        let mut other = sections(&file);
        let last = other.len() - 1;
        other[last].1[3] ^= 1;
        let mut damaged = file.clone();
        let place = file.len() - 24 - other[last].1.len() + 3;
        damaged[place] ^= 1;
        assert_eq!(exercise::repaired(&damaged), assemble(&other, 60));
    }
}
