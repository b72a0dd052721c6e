//! Sessions for files of which only those blocks come that are needed: what both classes do with them.

use crate::format::DecodeOptions;
use crate::session::Session;
use crate::session::WantedBytes;

/// A session for the fields of these names, or for all if none is named; with `room`, for a file that comes in parts, whose
/// blocks may take so many bytes.
pub fn session(fields: Vec<String>, room: Option<f64>) -> Session {
    let options = DecodeOptions { fields, ..DecodeOptions::default() };
    match room {
        Some(room) => Session::in_parts(options, room as u64),
        None => Session::with_options(options),
    }
}

/// Whether there is more to come of the file, if all goes well.
pub fn is_coming(session: &Session, in_parts: bool) -> bool {
    if in_parts { !session.wanted().is_empty() } else { !session.progress().complete }
}

/// Start, end and priority of each range of bytes that is wanted, as `RangeLoader` takes them.
pub fn wanted(session: &Session) -> Vec<f64> {
    let wanted = session.wanted();
    let triple = |part: &WantedBytes| [part.range.start as f64, part.range.end as f64, part.priority];
    wanted.iter().flat_map(triple).collect()
}
