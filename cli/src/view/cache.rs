//! MT files that were built for `tetralod view`, kept until their inputs change: each with a JSON that says of what it was built.

use anyhow::{Context, Result};
use etcetera::{BaseStrategy, choose_base_strategy};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The most that is kept, beside what is in use, in bytes: what was shown longest ago goes.
const MOST: u64 = 16 << 30;

/// What is built is in a folder with such a name until it is whole.
const UNFINISHED: &str = ".building-";

/// After so long nothing of such a folder is in use: whoever built in it was ended.
const LEFT: Duration = Duration::from_secs(7 * 24 * 60 * 60);

/// How a mesh is built if nothing is said: with all that it has.
const BUILD: [&str; 2] = ["--all-fields", "--cell-to-point"];

pub struct Cache {
    folder: PathBuf,
    /// Options of `tetralod build`.
    pub options: Vec<String>,
}

/// A file as it was when it was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seen {
    /// Of the system, since a path may be no text.
    path: OsString,
    /// None of a file that is not there.
    state: Option<(u64, u64)>,
}

impl Seen {
    pub fn path(&self) -> &Path {
        Path::new(&self.path)
    }

    pub fn now(path: &Path) -> Self {
        let nanoseconds = |time: SystemTime| {
            let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
            u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
        };
        let state = |found: Metadata| Some((found.len(), found.modified().map(nanoseconds).ok()?));
        Self { path: path.into(), state: fs::metadata(path).ok().and_then(state) }
    }

    pub fn is_there(&self) -> bool {
        self.state.is_some()
    }

    pub fn has_changed(&self) -> bool {
        *self != Self::now(self.path())
    }

    /// Tells this state of the file from others.
    pub fn version(&self) -> String {
        self.state.map(|(bytes, time)| format!("{bytes}-{time}")).unwrap_or_default()
    }
}

/// What an MT file was built of.
#[derive(Serialize, Deserialize)]
struct Origin {
    /// Of the command.
    version: String,
    inputs: Vec<Seen>,
}

impl Cache {
    pub fn of(folder: Option<PathBuf>, options: &[String]) -> Result<Self> {
        let usual = || Some(choose_base_strategy().ok()?.cache_dir().join("tetralod"));
        let folder = folder.or_else(usual).context("there is no folder for caches; give one by --cache")?;
        let usual = BUILD.map(str::to_owned).to_vec();
        Ok(Self { folder, options: if options.is_empty() { usual } else { options.to_vec() } })
    }

    /// The MT file that is or will be built of `input`.
    pub fn place(&self, input: &Path) -> PathBuf {
        let mut hash = DefaultHasher::new();
        (env!("CARGO_PKG_VERSION"), &self.options).hash(&mut hash);
        fs::canonicalize(input).unwrap_or_else(|_| input.to_owned()).hash(&mut hash);
        let stem = input.file_stem().unwrap_or_default().to_string_lossy();
        self.folder.join(format!("{stem}-{:016x}.mt", hash.finish()))
    }

    /// The inputs of the MT file at `place`, if it is there and they are as they were.
    pub fn inputs(place: &Path) -> Option<Vec<Seen>> {
        let origin: Origin = serde_json::from_slice(&fs::read(place.with_extension("json")).ok()?).ok()?;
        let holds = origin.version == env!("CARGO_PKG_VERSION")
            && place.is_file()
            && !origin.inputs.iter().any(Seen::has_changed);
        if !holds {
            return None;
        }
        // What was used last is kept longest; a folder that cannot be written to keeps what it has.
        let _ = fs::File::options()
            .append(true)
            .open(place)
            .and_then(|file| file.set_modified(SystemTime::now()));
        Some(origin.inputs)
    }

    /// An empty folder in which a file is built.
    pub fn workplace(&self) -> Result<tempfile::TempDir> {
        let place = || self.folder.display().to_string();
        fs::create_dir_all(&self.folder).with_context(place)?;
        tempfile::Builder::new().prefix(UNFINISHED).tempdir_in(&self.folder).with_context(place)
    }

    /// Puts what was built of `inputs` into its place, and makes room for it.
    pub fn keep(&self, built: &Path, place: &Path, inputs: &[Seen]) -> Result<()> {
        let origin = Origin { version: env!("CARGO_PKG_VERSION").to_owned(), inputs: inputs.to_vec() };
        let said = place.with_extension("json");
        // What is not said to be of something is of nothing.
        let _ = fs::remove_file(&said);
        fs::rename(built, place).with_context(|| place.display().to_string())?;
        fs::write(&said, serde_json::to_vec(&origin)?).with_context(|| said.display().to_string())?;
        self.make_room(place);
        Ok(())
    }

    /// Removes what was used longest ago. What cannot be removed stays.
    fn make_room(&self, kept: &Path) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        let found = entries.flatten().filter_map(|entry| {
            let data = entry.metadata().ok()?;
            Some((data.modified().ok()?, data.len(), entry.path()))
        });
        let (left, mut all): (Vec<_>, Vec<_>) = found.partition(|(.., path)| path.is_dir());
        let is_unfinished =
            |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(UNFINISHED));
        for (time, _, path) in left {
            if is_unfinished(&path) && time.elapsed().is_ok_and(|age| age > LEFT) {
                let _ = fs::remove_dir_all(path);
            }
        }
        all.retain(|(.., path)| path != kept && path.extension().is_some_and(|ending| ending == "mt"));
        all.sort_unstable_by(|a, b| b.cmp(a));
        let mut sum = 0_u64;
        for (_, bytes, path) in all {
            sum = sum.saturating_add(bytes);
            if sum > MOST {
                let _ = fs::remove_file(path.with_extension("json"));
                let _ = fs::remove_file(path);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_built_holds_until_an_input_changes() -> Result<()> {
        let folder = tempfile::tempdir()?;
        let cache = Cache::of(Some(folder.path().join("cache")), &[])?;
        // A name that is no text, where a system may have one.
        #[cfg(target_os = "linux")]
        let name: &std::ffi::OsStr = std::os::unix::ffi::OsStrExt::from_bytes(b"mesh\xff.vtu");
        #[cfg(not(target_os = "linux"))]
        let name: &std::ffi::OsStr = "mesh.vtu".as_ref();
        let input = folder.path().join(name);
        fs::write(&input, "1")?;
        let place = cache.place(&input);
        assert!(Cache::inputs(&place).is_none());
        let seen = [Seen::now(&input)];
        let workplace = cache.workplace()?;
        let built = workplace.path().join("built.mt");
        fs::write(&built, "MT")?;
        cache.keep(&built, &place, &seen)?;
        assert_eq!(Cache::inputs(&place).as_deref(), Some(&seen[..]));
        fs::write(&input, "12")?;
        assert!(Cache::inputs(&place).is_none());
        fs::remove_file(&input)?;
        assert!(Cache::inputs(&place).is_none());
        let other = Cache::of(Some(folder.path().join("cache")), &["--kind".to_owned(), "edge".to_owned()])?;
        assert_ne!(other.place(&input), place);
        Ok(())
    }
}
