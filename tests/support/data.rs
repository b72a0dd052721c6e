//! The folder of real data sets.

use std::path::PathBuf;

/// The folder that `TETRALOD_DATA` names. Tests that need it are ignored by `cargo test`; `cargo xtask test` runs them where the variable is set.
pub fn real_data() -> PathBuf {
    std::env::var_os("TETRALOD_DATA")
        .map(PathBuf::from)
        .expect("TETRALOD_DATA names the folder of the data sets")
}
