//! Files in and out: MT files are streamed in, outputs appear whole or not at all.

use super::build::METHOD;
use super::input;
use super::input::Wanted;
use anyhow::Context;
use anyhow::Result;
use std::fs;
use std::fs::File;
use std::io;
use std::io::BufWriter;
use std::io::Read;
use std::io::Write;
use std::path::Path;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::MutexGuard;
use std::sync::PoisonError;
use tetralod::build::Method;
use tetralod::io::CellData;
use tetralod::mesh::RepairReport;
use tetralod::mesh::TetMesh;
use tetralod::mt::Mt;
use tetralod::mt::MtInfo;
use tetralod::session::Session;
use tetralod::verify::Reference;

/// Bytes that are read at a time.
const CHUNK: usize = 1 << 20;

/// Exit code after Ctrl-C, as shells have it.
pub const INTERRUPTED: i32 = 130;

/// The unfinished output, if there is one. Whoever holds the lock decides what becomes of it.
static PARTIAL: Mutex<Option<PathBuf>> = Mutex::new(None);

fn partial() -> MutexGuard<'static, Option<PathBuf>> {
    // A path is whole even if a thread panicked while it held the lock.
    PARTIAL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes Ctrl-C (and SIGTERM) end the program without leaving a partial file.
pub fn remove_partial_output_on_interrupt() -> Result<()> {
    let interrupted = || {
        // Held to the end: no file can be created or put in place any more.
        let partial = partial();
        if let Some(path) = &*partial {
            let _ = fs::remove_file(path);
        }
        eprintln!("\ninterrupted");
        std::process::exit(INTERRUPTED);
    };
    ctrlc::set_handler(interrupted).context("the handler for Ctrl-C could not be set")
}

/// Writes the file at `path` with `write`; on any failure what was there before stays.
pub fn write_file<T>(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<T>) -> Result<T> {
    let failed = || format!("{} could not be written", path.display());
    // Pipes and devices cannot be replaced by a file.
    if fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        let mut out = BufWriter::new(File::create(path).with_context(failed)?);
        return write(&mut out).and_then(|done| Ok(out.flush().map(|()| done)?)).with_context(failed);
    }
    let partial_path = partial_path(path).with_context(failed)?;
    let file = {
        let mut partial = partial();
        let file = File::create(&partial_path).with_context(failed)?;
        *partial = Some(partial_path.clone());
        file
    };
    let mut out = BufWriter::new(file);
    let written = write(&mut out).and_then(|done| {
        out.flush()?;
        Ok(done)
    });
    drop(out);
    let mut partial = partial();
    *partial = None;
    let placed = written.and_then(|done| {
        fs::rename(&partial_path, path)?;
        Ok(done)
    });
    if placed.is_err() {
        let _ = fs::remove_file(&partial_path);
    }
    placed.with_context(failed)
}

/// Where the output grows: beside its place, so that it can be moved there at once.
fn partial_path(path: &Path) -> Result<PathBuf> {
    let name = path.file_name().context("this is no name for a file; give one after -o")?;
    let mut partial = std::ffi::OsString::from(".");
    partial.push(name);
    partial.push(format!(".{}.partial", std::process::id()));
    Ok(path.with_file_name(partial))
}

/// An MT file that was read as a whole.
pub struct Opened {
    pub session: Session,
    pub bytes: u64,
}

impl Opened {
    pub fn mt(&self) -> Result<&Mt> {
        self.session.mt().context("the MT has no base mesh")
    }

    pub fn info(&self) -> Result<&MtInfo> {
        self.session.info().context("the MT has no description")
    }

    /// What its reference mesh has in common with the input, by what the builder wrote into the file.
    pub fn reference(&self) -> Reference {
        let mut metadata = self.session.metadata().iter();
        let method = metadata.find(|(key, _)| key == METHOD).map(|(_, value)| value.as_str());
        let found = Method::ALL.into_iter().find(|m| Some(m.name()) == method);
        if found.is_none_or(Method::keeps_the_mesh) { Reference::Mesh } else { Reference::Points }
    }
}

/// Opens an MT file.
pub fn open_mt(path: &Path) -> Result<Opened> {
    let session = read_mt(path).with_context(|| path.display().to_string())?;
    let bytes = session.progress().bytes;
    Ok(Opened { session, bytes })
}

fn read_mt(path: &Path) -> Result<Session> {
    let mut file = File::open(path)?;
    let mut session = Session::new();
    let mut chunk = vec![0; CHUNK];
    loop {
        match file.read(&mut chunk) {
            Ok(0) => break,
            Ok(count) => session.feed(&chunk[..count]).map(drop)?,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error.into()),
        }
    }
    session.finish()?;
    Ok(session)
}

/// Reads a mesh and mends what can be mended.
pub fn read_mesh(path: &Path) -> Result<(TetMesh, RepairReport)> {
    let wanted = Wanted { names: &[], all: true, cells: CellData::LeaveOut };
    let (mesh, report) = input::read(&[path.to_owned()], &wanted)?;
    input::expect_cells(&mesh, path)?;
    Ok((mesh, report))
}

/// Reads what the MT was built from: time steps of a mesh or, where no more is needed, of points.
pub fn read_reference(paths: &[PathBuf], opened: &Opened) -> Result<TetMesh> {
    let names: Vec<String> = opened.info()?.fields.iter().map(|field| field.name.clone()).collect();
    let (mesh, _) = input::read(paths, &Wanted { names: &names, all: false, cells: CellData::Values })?;
    if let (Reference::Mesh, Some(path)) = (opened.reference(), paths.first()) {
        input::expect_cells(&mesh, path)?;
    }
    Ok(mesh)
}

/// The number of the field called `name`; the first field without a name.
pub fn field_index(info: &MtInfo, name: Option<&str>) -> Result<usize> {
    let Some(name) = name else { return Ok(0) };
    let known = || info.fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = info.fields.iter().position(|field| field.name == name);
    found.with_context(|| format!("there is no field '{name}'; the MT has: {}", known()))
}
