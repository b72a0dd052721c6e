//! Files in and out: MT files are read as far as they are needed, from disk or from a server; outputs appear whole or not at all.

use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::fs;
use std::fs::File;
use std::io::{BufWriter, Cursor, Seek, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tetralod::format::{DecodeOptions, EncodeOptions, encode_to};
use tetralod::mt::{Exact, Mt, MtInfo};
use tetralod::session::{Client, Session};
use tetralod::stream::{Arrived, FileSource, RangeSource, ShardedFile, StreamError, Traffic, WantedRange};
use tetralod::stream::{HttpOptions, HttpSource};
use tetralod_build::verify::Reference;
use tetralod_build::{Construction, Method};

/// Bytes that are read at a time.
const CHUNK: u64 = 1 << 20;

/// How long is waited for a server at a time.
pub const PATIENCE: Duration = Duration::from_secs(1);

/// Exit code after Ctrl-C, as shells have it.
pub const INTERRUPTED: i32 = 130;

/// Unfinished outputs, and folders that are not kept. Whoever holds the lock decides what becomes of them.
static PARTIAL: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn partial() -> MutexGuard<'static, Vec<PathBuf>> {
    // A path is whole even if a thread panicked while it held the lock.
    PARTIAL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does some work to its end, whenever Ctrl-C comes.
pub fn uninterrupted<T>(work: impl FnOnce() -> T) -> T {
    let _partial = partial();
    work()
}

/// Makes Ctrl-C (and SIGTERM) end the program without leaving a partial file.
pub fn remove_partial_output_on_interrupt() -> Result<()> {
    ctrlc::set_handler(|| interrupt()).context("the handler for Ctrl-C could not be set")
}

/// Ends the program without leaving a partial file.
pub fn interrupt() -> ! {
    // Reassembly to the end: no file can be created or put in place any more.
    let partial = partial();
    for path in &*partial {
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    eprintln!("\ninterrupted");
    std::process::exit(INTERRUPTED);
}

/// The inputs that were given or read, at their places without links.
static INPUTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn inputs() -> MutexGuard<'static, Vec<PathBuf>> {
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Notes that these files are inputs: no output replaces them.
pub fn note_inputs(files: &[PathBuf]) {
    inputs().extend(files.iter().filter_map(|file| fs::canonicalize(file).ok()));
}

/// All inputs that were read. What is no UTF-8 in a path, which JSON cannot say, is `U+FFFD` there.
pub fn read_inputs() -> Vec<String> {
    let mut all = inputs().clone();
    all.sort_unstable();
    all.dedup();
    all.iter().map(|path| path.to_string_lossy().into_owned()).collect()
}

/// Refuses an output that is one of the inputs, or that has no place, before any work is done for it.
pub fn check_output<'a>(path: &Path, given: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
    let name = path.display();
    if path == Path::new("-") {
        bail!("'-' is no name for a file; give one after -o, or /dev/stdout");
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        bail!("{name} cannot be written: there is no folder '{}'; make it first", folder.display());
    }
    let Ok(found) = fs::metadata(path) else { return Ok(()) };
    if found.is_dir() {
        bail!("{name} is a folder; give a file in it after -o");
    }
    given.into_iter().for_each(|input| note_inputs(std::slice::from_ref(input)));
    check_inputs(path)
}

/// Refuses an output that is one of the inputs, whoever named them. Pipes and devices are not replaced.
pub fn check_inputs(path: &Path) -> Result<()> {
    let is_input = fs::canonicalize(path).is_ok_and(|place| place.is_file() && inputs().contains(&place));
    ensure!(
        !is_input,
        "{} is an input, too, and would be replaced; give another file after -o",
        path.display()
    );
    Ok(())
}

/// The ending of a file's name in lower case, without the dot.
pub fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// What output files are called, and which command writes them.
const ENDINGS: [(&[&str], &str); 6] = [
    (&["html"], "`tetralod html` writes .html"),
    (&["mt"], "`tetralod build` writes .mt"),
    (&["vtu", "npz"], "`tetralod extract` writes .vtu and .npz"),
    (
        &["vtp", "stl", "ply", "obj", "csv"],
        "`tetralod surface`, `isosurface`, `slice`, `probe` and `streamlines` write .vtp, .stl, .ply, .obj, .csv and .npz",
    ),
    (&["png"], "`tetralod render` writes .png"),
    (&["vti", "vtk", "pvd", "raw", "json"], "this command does not write that format"),
];

/// Refuses a name that says of what format the file is, if that is another one than `format`.
pub fn check_ending(path: &Path, format: &str) -> Result<()> {
    let ending = ending(path);
    let other = ENDINGS.iter().find(|(endings, _)| endings.contains(&ending.as_str()) && ending != format);
    match other {
        Some((_, who)) => bail!("{}: this command writes .{format}; {who}", path.display()),
        None => Ok(()),
    }
}

/// Writes the file at `path` with `write`; on any failure what was there before stays.
pub fn write_file<T>(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<T>) -> Result<T> {
    let failed = || format!("{} could not be written", path.display());
    check_inputs(path)?;
    // Pipes and devices cannot be replaced by a file.
    if fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        let mut out = BufWriter::new(File::create(path).with_context(failed)?);
        return write(&mut out).and_then(|done| Ok(out.flush().map(|()| done)?)).with_context(failed);
    }
    let unfinished = {
        let mut partial = partial();
        let unfinished = beside(path).and_then(|(builder, folder)| Ok(builder.tempfile_in(folder)?));
        let unfinished = unfinished.with_context(failed)?;
        partial.push(unfinished.path().to_owned());
        unfinished
    };
    let (file, unfinished) = unfinished.into_parts();
    let mut out = BufWriter::new(file);
    let written = write(&mut out).and_then(|done| {
        out.flush()?;
        // A full disk of another machine is told here at the latest; and a file that is in its place is whole after a power cut, too.
        out.get_ref().sync_all()?;
        Ok(done)
    });
    drop(out);
    let mut partial = partial();
    partial.retain(|path| *path != *unfinished);
    let placed = written.and_then(|done| {
        unfinished.persist(path)?;
        Ok(done)
    });
    placed.with_context(failed)
}

/// Writes an MT with all that its file may keep of it; returns how many bytes that has.
pub fn write_mt(path: &Path, mt: &Mt, exact: Vec<Exact>, metadata: BTreeMap<String, String>) -> Result<u64> {
    write_file(path, |out| Ok(encode_to(mt, &EncodeOptions::complete(exact, metadata), out)?))
}

/// Works in a folder beside the place of an output; it is gone afterwards, also if the work fails.
pub fn in_folder_beside<T>(path: &Path, work: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    let folder = {
        let mut partial = partial();
        let folder = beside(path).and_then(|(mut builder, folder)| {
            // Folders are gone into.
            #[cfg(unix)]
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
            Ok(builder.tempdir_in(folder)?)
        });
        let folder = folder.with_context(|| format!("no folder beside {} could be made", path.display()))?;
        partial.push(folder.path().to_owned());
        folder
    };
    let done = work(folder.path());
    let mut partial = partial();
    partial.retain(|path| path != folder.path());
    done
}

/// Fills the folder at `path`, which is made if need be: the files that `work` writes into another folder are moved there together, once
/// it is done. The one called `last` says that all are there. What was there before stays if the work fails or is interrupted.
pub fn fill_folder<T>(path: &Path, last: &Path, work: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    let is_new = !path.exists();
    {
        let mut partial = partial();
        fs::create_dir_all(path).with_context(|| format!("{} could not be made", path.display()))?;
        if is_new {
            partial.push(path.to_owned());
        }
    }
    // In it, so that files are moved within one file system.
    let done = in_folder_beside(&path.join("new"), |folder| {
        let done = work(folder)?;
        for file in fs::read_dir(folder)? {
            check_inputs(&path.join(file?.file_name()))?;
        }
        let _uninterrupted = partial();
        move_all(folder, path, last).with_context(|| format!("{} could not be written", path.display()))?;
        Ok(done)
    });
    let mut partial = partial();
    partial.retain(|other| other != path);
    if is_new && done.is_err() {
        let _ = fs::remove_dir_all(path);
    }
    done
}

/// Moves all files of a folder, the one called `last` at last; before that there is none of that name.
fn move_all(from: &Path, to: &Path, last: &Path) -> std::io::Result<()> {
    match fs::remove_file(to.join(last)) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
        _ => (),
    }
    for file in fs::read_dir(from)? {
        let name = file?.file_name();
        if name != last.as_os_str() {
            fs::rename(from.join(&name), to.join(&name))?;
        }
    }
    fs::rename(from.join(last), to.join(last))
}

/// A file that is there as long as this value, and no longer than the program unless that is killed.
pub struct Transient {
    file: File,
    path: PathBuf,
}

impl Transient {
    /// Makes a file with this content. Of all processes that try it at a time one gets it: the others fail, as there is one already.
    pub fn create(path: PathBuf, content: &[u8]) -> std::io::Result<Self> {
        let mut partial = partial();
        let file = File::create_new(&path)?;
        partial.push(path.clone());
        drop(partial);
        let mut created = Self { file, path };
        created.append(content)?;
        Ok(created)
    }

    /// Writes more to its end, where others see it: to this file, even if there is another one of its name by now.
    pub fn append(&mut self, content: &[u8]) -> std::io::Result<()> {
        self.file.write_all(content)?;
        self.file.sync_all()
    }
}

impl Drop for Transient {
    fn drop(&mut self) {
        let mut partial = partial();
        partial.retain(|path| *path != self.path);
        // It may be gone already.
        let _ = fs::remove_file(&self.path);
    }
}

/// What can be gone back in.
pub trait WriteSeek: Write + Seek {}

impl<T: Write + Seek> WriteSeek for T {}

/// As [`write_file`], for formats whose beginning is written when the rest is there. Pipes get all of it at the end.
pub fn write_seekable(path: &Path, write: impl FnOnce(&mut dyn WriteSeek) -> Result<()>) -> Result<()> {
    write_file(path, |out| {
        if out.stream_position().is_ok() {
            return write(out);
        }
        let mut whole = Cursor::new(Vec::new());
        write(&mut whole)?;
        Ok(out.write_all(whole.get_ref())?)
    })
}

/// Where the output grows: beside its place, so that it can be moved there at once, under a hidden name that nobody else can know before.
fn beside(path: &Path) -> Result<(tempfile::Builder<'static, 'static>, &Path)> {
    ensure!(path.file_name().is_some(), "this is no name for a file; give one after -o");
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tetralod-").suffix(".partial");
    // As other files are: readable by others as far as the user lets them.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    Ok((builder, folder.unwrap_or(Path::new("."))))
}

/// An MT file: all of it, or what was needed.
pub struct Opened {
    pub session: Session,
    /// Of the file.
    pub bytes: u64,
    /// Bytes that were read: from a disk each counted once, over a network as they came.
    pub read: u64,
    /// What that took of a network, if the file is there.
    pub traffic: Option<Traffic>,
}

impl Opened {
    /// What a client has.
    pub fn of(client: Client<Bytes>) -> Self {
        let traffic = client.traffic();
        let read = traffic.map_or(client.session().arrived(), |traffic| traffic.received);
        let bytes = client.total().unwrap_or(read);
        Self { bytes, read, traffic, session: client.into_session() }
    }

    pub fn mt(&self) -> Result<&Mt> {
        self.session.mt().context("the MT has no base mesh")
    }

    pub fn info(&self) -> Result<&MtInfo> {
        self.session.info().context("the MT has no description")
    }

    /// What its reference mesh has in common with the input, by what the builder wrote into the file.
    pub fn reference(&self) -> Reference {
        let mut metadata = self.session.metadata().iter();
        let method =
            metadata.find(|(key, _)| *key == Construction::METADATA_KEYS[0]).map(|(_, value)| value.as_str());
        let found = Method::ALL.into_iter().find(|m| Some(m.name()) == method);
        if found.is_none_or(Method::keeps_the_mesh) { Reference::Mesh } else { Reference::Points }
    }
}

/// Bytes of a file here or on a server.
pub struct Bytes(Box<dyn RangeSource>);

impl RangeSource for Bytes {
    fn want(&mut self, wanted: &[WantedRange]) {
        self.0.want(wanted);
    }

    fn next(&mut self, patience: Duration) -> Result<Option<Arrived>, StreamError> {
        self.0.next(patience)
    }

    fn total(&self) -> Option<u64> {
        self.0.total()
    }

    fn held(&self) -> Option<&[Range<u64>]> {
        self.0.held()
    }

    fn traffic(&self) -> Option<Traffic> {
        self.0.traffic()
    }
}

impl Bytes {
    /// Of a part of a file.
    pub fn of_part(part: FileSource<Cursor<Vec<u8>>>) -> Self {
        Self(Box::new(part))
    }

    /// Hands on all bytes, one piece after the other; returns how many they are.
    pub fn read_all(mut self, mut take: impl FnMut(&[u8]) -> Result<()>) -> Result<u64> {
        let mut at = 0;
        loop {
            let range = at..at + CHUNK;
            self.want(&[WantedRange { range: range.clone(), priority: 0.0 }]);
            let bytes = loop {
                if let Some((_, bytes)) = self.next(PATIENCE)? {
                    break bytes;
                }
            };
            take(&bytes)?;
            at += bytes.len() as u64;
            if at < range.end {
                return Ok(at);
            }
        }
    }

    /// Of a path, or of an address that begins with `http://` or `https://`.
    pub fn of(path: &Path) -> Result<Self> {
        if let Some(url) = url(path) {
            return Ok(Self(Box::new(HttpSource::new(url, HttpOptions::default()))));
        }
        if let Some(scheme) = scheme(path) {
            bail!(
                "files cannot be read by {scheme}; give an address that begins with http:// or https://, or a file"
            );
        }
        if fs::metadata(path)?.is_file() {
            let shards = path.to_owned();
            let open = move |suffix: &str| File::open(with_suffix(&shards, suffix));
            return Ok(Self(Box::new(FileSource::new(ShardedFile::new(File::open(path)?, open)?)?)));
        }
        // Pipes cannot be sought in.
        Ok(Self(Box::new(FileSource::new(Cursor::new(fs::read(path)?))?)))
    }
}

/// A path with more behind its name.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// The address, if a path is one.
fn url(path: &Path) -> Option<&str> {
    path.to_str().filter(|text| ["http://", "https://"].iter().any(|scheme| text.starts_with(scheme)))
}

/// What stands in front of `://`, if a path looks like an address and is no file.
pub fn scheme(path: &Path) -> Option<&str> {
    let (scheme, _) = path.to_str()?.split_once("://")?;
    let is_scheme =
        !scheme.is_empty() && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    Some(scheme).filter(|_| is_scheme && !path.exists())
}

/// Whether a path is the address of a Zarr array or group on a server: one in or below what is called `.zarr`, or without an ending.
pub fn is_zarr_address(path: &Path) -> bool {
    let is_known = scheme(path).is_some_and(|scheme| ["http", "https", "s3"].contains(&scheme));
    let is_zarr = |part: &std::ffi::OsStr| ending(Path::new(part)) == "zarr";
    is_known && (path.iter().any(is_zarr) || path.extension().is_none())
}

/// Opens an MT file of which only what is needed is read.
pub fn open_parts(path: &Path) -> Result<Client<Bytes>> {
    Ok(Client::open(Bytes::of(path)?, DecodeOptions::default(), u64::MAX)?)
}

/// Opens an MT file and reads all of it.
pub fn open_mt(path: &Path) -> Result<Opened> {
    let session = Bytes::of(path).and_then(read_mt).with_context(|| path.display().to_string())?;
    let bytes = session.progress().bytes;
    Ok(Opened { session, bytes, read: bytes, traffic: None })
}

fn read_mt(source: Bytes) -> Result<Session> {
    let mut session = Session::new();
    source.read_all(|bytes| {
        session.feed(bytes)?;
        Ok(())
    })?;
    session.finish()?;
    Ok(session)
}

/// Copies an MT file as it is; returns how many bytes that are.
pub fn copy_mt(from: &Path, to: &Path) -> Result<u64> {
    let source = Bytes::of(from).with_context(|| from.display().to_string())?;
    write_file(to, |out| {
        let copied = source.read_all(|bytes| Ok(out.write_all(bytes)?));
        copied.with_context(|| from.display().to_string())
    })
}
