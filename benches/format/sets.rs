//! The meshes that are measured.

use super::Result;
use super::mt_file::mt_file;
use std::fs;
use std::path::Path;
use tetralod::mesh::{TetMesh, repair};
use tetralod::mt::MtKind;
use tetralod_build::Purpose;
use tetralod_io as io;
use tetralod_io::generate;
use tetralod_io::{CellData, ReadOptions};

pub struct Set {
    pub name: String,
    /// Of the file that it came from, if there is one.
    pub bytes: Option<u64>,
    /// With one field.
    pub mesh: TetMesh,
}

/// Fewest points of a set worth a row.
const LEAST: usize = 1000;

/// What the arguments name: `bucky:N`, files, and folders with .vtu files.
pub fn all(inputs: &[&str]) -> Result<Vec<Set>> {
    let mut sets = Vec::new();
    for input in inputs {
        if let Some(size) = input.strip_prefix("bucky:") {
            let mesh = generate::bucky(size.parse()?)?;
            sets.push(Set { name: format!("bucky {size}³, generated"), bytes: None, mesh });
        } else if Path::new(input).is_dir() {
            let entries = fs::read_dir(input)?.collect::<std::io::Result<Vec<_>>>()?;
            let mut paths: Vec<_> = entries.iter().map(fs::DirEntry::path).collect();
            paths.retain(|path| path.extension().is_some_and(|extension| extension == "vtu"));
            paths.sort();
            sets.extend(paths.iter().filter_map(|path| read(path)));
        } else {
            sets.extend(read(input.as_ref()));
        }
    }
    Ok(sets)
}

/// A mesh with its first field; none if it has none, is small, or cannot be read.
fn read(path: &Path) -> Option<Set> {
    let name = path.file_name()?.to_str()?.to_owned();
    let read = || -> Result<Option<TetMesh>> {
        let mut mesh =
            io::read_with(path, &ReadOptions { cells: CellData::Values, ..ReadOptions::default() })?;
        if mesh.tets.is_empty() {
            return Ok(None);
        }
        mesh = repair(mesh)?.0;
        mesh.cells_to_points();
        mesh.fields.truncate(1);
        let is_whole = mesh.fields.iter().all(|field| field.values.iter().all(|value| value.is_finite()));
        Ok((mesh.positions.len() >= LEAST && !mesh.fields.is_empty() && is_whole).then_some(mesh))
    };
    match read() {
        Ok(Some(mesh)) => Some(Set { name, bytes: fs::metadata(path).ok().map(|found| found.len()), mesh }),
        Ok(None) => {
            eprintln!("{name}: left out, too small or without a field");
            None
        }
        Err(error) => {
            eprintln!("{name}: left out, {error}");
            None
        }
    }
}

/// Writes the MT file of a generated volume.
pub fn make(size: u32, kind: &str, file: &Path) -> Result<()> {
    let kind = MtKind::ALL.into_iter().find(|known| known.name() == kind).ok_or("no such kind")?;
    fs::write(file, mt_file(&generate::bucky(size)?, kind, Purpose::default())?)?;
    Ok(())
}
