//! The folder of real data sets.

use std::path::PathBuf;

/// The folder that `TETRALOD_DATA` names, or `None` after saying that this run has none. Set `TETRALOD_NEED_DATA` to make that a
/// failure.
pub fn real_data() -> Option<PathBuf> {
    let folder = std::env::var_os("TETRALOD_DATA").map(PathBuf::from);
    if folder.is_none() {
        assert!(std::env::var_os("TETRALOD_NEED_DATA").is_none(), "TETRALOD_DATA is not set");
        println!("skipped: TETRALOD_DATA is not set");
    }
    folder
}
