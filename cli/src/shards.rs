//! MT files in shards, for hosts that limit the size of a file: cut when they are whole, and put in their places together.

use super::{files, parse};
use anyhow::{Context, Result, ensure};
use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use tetralod::stream::{ShardedFile, shard_suffix};

/// Whether an MT file is written in shards.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub struct Sharding {
    /// Cut the MT file after every so many bytes, for hosts that limit the size of a file: the first shard is FILE, the next ones FILE.0001,
    /// FILE.0002 and so on. All that opens FILE reads them, too; one behind the other they are the whole file. K, M and G are powers of
    /// 1024; at least 64K; `none` writes one file, as if nothing is said.
    #[arg(long, value_name = "BYTES", requires = "output", value_parser = parse::parse_shard_size)]
    shard_size: Option<u64>,
}

/// Bytes with which an MT file says how many it has.
const START: u64 = 24;

/// Shards at most: up to here their names are in their order.
const MOST: u64 = 10_000;

impl Sharding {
    /// The MT file that `write` writes, at the path that it is given, and whose length it returns, comes to `path`: whole or in shards. Shards
    /// of the file that was there are removed if they are left over; files that only have such names are not.
    pub fn write(self, path: &Path, write: impl FnOnce(&Path) -> Result<u64>) -> Result<u64> {
        let older = older_shards(path);
        let Some(size) = self.size() else {
            let bytes = write(path)?;
            files::uninterrupted(|| remove_all(path, 1..older))?;
            return Ok(bytes);
        };
        let is_other = fs::metadata(path).is_ok_and(|found| !found.is_file());
        ensure!(
            !is_other,
            "{}: shards are files, and this is none; give another name after -o",
            path.display()
        );
        files::in_folder_beside(path, |folder| {
            let whole = folder.join("whole");
            let bytes = write(&whole)?;
            let count = cut(&whole, size)?;
            (0..count).try_for_each(|number| files::check_inputs(&shard(path, number)))?;
            let placed = files::uninterrupted(|| place(&whole, path, count..older));
            placed.with_context(|| format!("{} could not be written", path.display()))?;
            Ok(bytes)
        })
    }

    /// In how many files one of so many bytes is; nothing if that is not asked for.
    pub fn count(self, bytes: u64) -> Option<u64> {
        self.size().map(|size| bytes.div_ceil(size).max(1))
    }

    fn size(self) -> Option<u64> {
        self.shard_size.filter(|&size| size < u64::MAX)
    }
}

/// The path of a shard of the file at `path`.
fn shard(path: &Path, number: u64) -> PathBuf {
    files::with_suffix(path, &shard_suffix(number))
}

/// Cuts a file: what goes to other shards is moved there from its end, so that the disk never has to hold it twice. Returns how many there are.
fn cut(path: &Path, size: u64) -> Result<u64> {
    let mut whole = File::options().read(true).write(true).open(path)?;
    let count = whole.metadata()?.len().div_ceil(size).max(1);
    ensure!(count <= MOST, "--shard-size: that makes {count} shards, more than {MOST}; give a larger size");
    for number in (1..count).rev() {
        whole.seek(SeekFrom::Start(number * size))?;
        files::write_file(&shard(path, number), |out| Ok(io::copy(&mut whole, out)?))?;
        whole.set_len(number * size)?;
    }
    whole.sync_all()?;
    Ok(count)
}

/// Moves shards to their places: as many as come before those of an older file that are left over. At no moment is there a first one beside
/// others that are not its own.
fn place(from: &Path, to: &Path, left_over: Range<u64>) -> io::Result<()> {
    if shard(to, 1).exists() {
        remove(to)?;
    }
    for number in (0..left_over.start).rev() {
        fs::rename(shard(from, number), shard(to, number))?;
    }
    remove_all(to, left_over)
}

/// Whether the MT file at a path has all bytes that it says it has, without shards.
pub fn is_whole(path: &Path) -> bool {
    let has_start = fs::metadata(path).is_ok_and(|found| found.len() >= START);
    has_start && older_shards(path) == 1
}

/// In how many shards the MT file at a path is; 1 if there is none.
fn older_shards(path: &Path) -> u64 {
    // Pipes are not opened twice.
    if !path.is_file() {
        return 1;
    }
    let none = |_: &str| Err(io::ErrorKind::NotFound.into());
    let opened = File::open(path).and_then(|file| ShardedFile::new(file, none));
    opened.map_or(1, |file| file.count().min(MOST))
}

/// Removes shards.
fn remove_all(path: &Path, numbers: Range<u64>) -> io::Result<()> {
    numbers.rev().try_for_each(|number| remove(&shard(path, number)))
}

/// Removes a file, if it is there.
fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
