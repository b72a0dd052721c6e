//! Whether a mesh is built as a whole or in parts, so that it fits the memory.

use super::options::BuildOptions;
use crate::machine;
use crate::output::{self, Verbosity, bytes, count};
use anyhow::{Context, Result, anyhow};
use tetralod::mesh::{Field, TetMesh};
use tetralod_build::parts::MOST_PARTS;
use tetralod_build::{
    BuildConfig, Construction, memory_needed, memory_needed_in_parts, memory_needed_in_pieces,
};

/// How a mesh is built.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Way {
    Whole,
    /// In so many parts, of which so many joins run at a time.
    Parts {
        parts: u32,
        joins: u32,
    },
}

impl Way {
    /// In so many parts, with as many joins at a time as there are threads.
    pub fn parts(parts: u32) -> Self {
        Self::Parts { parts, joins: rayon::current_num_threads() as u32 }
    }
}

/// How many fields of a mesh are kept.
pub(super) fn kept_fields(config: &BuildConfig, mesh: &TetMesh) -> u64 {
    let is_kept = |field: &&Field| config.fields.iter().any(|name| field.answers_to(name));
    let fields = match config.all_fields {
        true => mesh.fields.len(),
        false => mesh.fields.iter().filter(is_kept).count(),
    };
    fields.max(1) as u64
}

/// From so much memory on, the command says what it needs.
const MUCH_MEMORY: u64 = 1 << 30;

/// What was asked for on the command line.
pub(super) struct Asked<'a> {
    pub options: &'a BuildOptions,
    pub parts: Option<u32>,
    pub memory: Option<u64>,
    pub verbosity: &'a Verbosity,
}

/// Says how much memory building takes where that is much, and chooses how to keep to what is allowed.
///
/// Of a mesh of so many points, tetrahedra and fields; if it comes in pieces, so many points are in several, and the largest one has so many
/// tetrahedra.
pub(super) fn way(
    asked: &Asked<'_>,
    config: &BuildConfig,
    [points, tetrahedra, fields]: [u64; 3],
    pieces: Option<[u64; 2]>,
) -> Result<Way> {
    let &Asked { options, parts, memory, verbosity } = asked;
    let needed = memory_needed(config.construction, points, tetrahedra, fields);
    let what = format!("building {} tetrahedra takes about {}", count(tetrahedra), bytes(needed));
    let tell = |line: String| {
        if !verbosity.quiet {
            output::note(&format!("{}: {line}", options.name()));
        }
    };
    if let Some(parts) = parts {
        return Ok(if parts == 1 { Way::Whole } else { Way::parts(parts) });
    }
    match memory {
        Some(most) if needed > most => {
            if let Some((parts, joins)) = count_for(config, [points, tetrahedra, fields], pieces, most) {
                let disk = bytes(disk_in_parts([points, tetrahedra, fields]));
                tell(format!(
                    "{what} of memory at once, so it is built in {parts} parts, with about {disk} of files beside the output until it is done"
                ));
                return Ok(Way::Parts { parts, joins });
            }
            let in_parts = match least_memory(config, [points, tetrahedra, fields], pieces) {
                Some(least) => format!("in parts about {}, ", bytes(least)),
                None => "and only kind half-edge is built in parts, ".to_owned(),
            };
            Err(anyhow!(
                "{what} of memory, {in_parts}more than --memory allows ({}): allow more, keep fewer fields, or build a coarser mesh",
                bytes(most)
            ))
            .with_context(|| options.name())
        }
        None if let Some(most) = machine::memory().filter(|most| needed > *most) => Err(anyhow!(
            "{what} of memory at most, more than there is ({}): with --memory it is built in parts, or tried all the same",
            bytes(most)
        ))
        .with_context(|| options.name()),
        _ => {
            if needed >= MUCH_MEMORY {
                tell(format!("{what} of memory at most"));
            }
            Ok(Way::Whole)
        }
    }
}

/// About how many bytes the files of the steps of a build in parts take: those of the mesh, at each level what is left and the updates, the points
/// that a join does not have in memory, and what the last step puts aside. Of 800 million tetrahedra in 1024 parts they are 93 bytes each, in the
/// last join; fewer parts have fewer levels, and take less.
fn disk_in_parts([points, tetrahedra, fields]: [u64; 3]) -> u64 {
    let more_fields = fields.saturating_sub(1).saturating_mul(points);
    tetrahedra.saturating_mul(95).saturating_add(more_fields.saturating_mul(60))
}

/// In how many parts a mesh of so many points, tetrahedra and fields is built within so much memory, as many at a time as there are threads, and
/// how many joins run at a time; none if it is not.
///
/// If it comes in pieces, so many points are in several, and the largest one has so many tetrahedra.
fn count_for(
    config: &BuildConfig,
    counts: [u64; 3],
    pieces: Option<[u64; 2]>,
    most: u64,
) -> Option<(u32, u32)> {
    let fits = |(way, needed): (_, u64)| (needed <= most).then_some(way);
    memory_in_parts(config, counts, pieces).find_map(fits)
}

/// The least memory in which it is built in parts; none if it is not.
fn least_memory(config: &BuildConfig, counts: [u64; 3], pieces: Option<[u64; 2]>) -> Option<u64> {
    memory_in_parts(config, counts, pieces).map(|(_, needed)| needed).min()
}

/// The memory that each number of parts takes, and of joins at a time; nothing if it is not built in parts. Those that take less time come first.
fn memory_in_parts(
    config: &BuildConfig,
    counts: [u64; 3],
    pieces: Option<[u64; 2]>,
) -> impl Iterator<Item = ((u32, u32), u64)> {
    let most = if matches!(config.construction, Construction::HalfEdge { .. }) { MOST_PARTS } else { 1 };
    let threads = rayon::current_num_threads() as u32;
    let needed = move |(parts, joins): (u32, u32)| match pieces {
        None => memory_needed_in_parts(counts, parts, [threads, joins]),
        Some(pieces) => memory_needed_in_pieces(counts, pieces, parts, [threads, joins]),
    };
    let parts = std::iter::successors(Some(2_u32), |count| Some(2 * count)).take_while(move |&n| n <= most);
    let ways = parts.flat_map(move |parts| (1..=threads).rev().map(move |joins| (parts, joins)));
    ways.map(move |way| (way, needed(way)))
}
