//! What the name of a file and its first bytes say of its kind.

use std::path::Path;

/// The name of a file before it was packed.
pub(super) fn without_gz(name: &str) -> &str {
    let end = name.len().wrapping_sub(3);
    match name.get(end..) {
        Some(ending) if ending.eq_ignore_ascii_case(".gz") => &name[..end],
        _ => name,
    }
}

/// XML may have a byte order mark and white space in front of it.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start()
}

/// The ending of a name, in lower case.
pub(super) fn lower_extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}
