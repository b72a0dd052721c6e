//! Exodus in several files, each a piece of one mesh: `mesh.e.4.0` to `mesh.e.4.3`, as SEACAS's `nem_spread` and parallel programs write them.
//!
//! Any of these names stands for all, and so does `mesh.e` where there is no such file. Nodes of one number (`node_num_map`) are one point;
//! without numbers those at one place are, as of a `.pvtu`. The pieces of a block have its number (`eb_prop1`), or at least its name.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use netcdf_reader::NcFile;

use crate::beside::{FilesOf, Source};
use crate::cell_shapes::middles;
use crate::cells;
use crate::error::{At, ReadError, ReadReason, Stop, expect_count, in_file};
use crate::formats::exodus::{self, BlockNames, Reader};
use crate::formats::hdf5;
use crate::in_memory::Shared;
use crate::number::points_from;
use crate::pvtu::{Identity, Whole, bits, key_of};
use crate::ranges::{Each, InPieces};
use crate::shared_points::{SharedPoints, hash};
use crate::{PieceCounts, ReadOptions};
use hdf5_reader::BytesStorage;
use hdf5_reader::storage::DynStorage;
use tetralod::mesh::TetMesh;

/// The pieces of a mesh.
#[derive(Debug)]
pub(crate) struct Decomposition {
    files: Vec<File>,
}

#[derive(Debug)]
enum File {
    Disk(PathBuf),
    Memory(String, Shared),
}

/// More pieces are not looked for among files in memory.
const MOST_IN_MEMORY: u32 = 1 << 16;

/// The name of the whole and how many pieces it has, as it is written, from the name of one of them.
fn parsed(name: &str) -> Option<(&str, &str)> {
    let (rest, number) = name.rsplit_once('.')?;
    let (base, count) = rest.rsplit_once('.')?;
    let value = |digits: &str| {
        let is_number = digits.bytes().all(|digit| digit.is_ascii_digit());
        digits.parse::<u32>().ok().filter(|_| is_number)
    };
    let is_one = number.len() == count.len() && !count.starts_with('0') && value(number)? < value(count)?;
    Some((base, count)).filter(|_| is_one && !base.is_empty())
}

/// What the piece of this number is called.
fn name_of(base: &str, count: &str, number: u32) -> String {
    format!("{base}.{count}.{number:0width$}", width = count.len())
}

/// The names of the pieces beside the first one, if a file of this name is that.
pub(super) fn beside_first(name: &str) -> Option<Vec<String>> {
    let last = name.rsplit('/').next().unwrap_or(name);
    let (base, count) = parsed(last)?;
    // As many as files that are there can be.
    let pieces = count.parse::<u32>().ok().filter(|count| *count <= MOST_IN_MEMORY)?;
    (last == name_of(base, count, 0))
        .then(|| (1..pieces).map(|number| name_of(base, count, number)).collect())
}

/// Of how many pieces the whole at a path is where there is no such file; none if there are no pieces of it.
fn count_beside(path: &Path, base: &str) -> Result<Option<String>, ReadReason> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut counts = BTreeSet::new();
    // That there is no folder is for the reader to say.
    for entry in folder.read_dir().into_iter().flatten().flatten() {
        let name = entry.file_name();
        if let Some((_, count)) = name.to_str().and_then(parsed).filter(|(own, _)| *own == base)
            && hdf5::is_known_file(&entry.path())
        {
            counts.insert((count.len(), count.to_owned()));
        }
    }
    let counts: Vec<String> = counts.into_iter().map(|(_, count)| count).collect();
    if counts.len() > 1 {
        let what = format!("\"{base}\", of which there are files in {} pieces,", counts.join(" and in "));
        let first = name_of(base, &counts[0], 0);
        return Err(ReadReason::unsupported(what, format!("name a file of one of them, as {first}")));
    }
    Ok(counts.into_iter().next())
}

impl Decomposition {
    /// The pieces that the given file stands for; none if it is another one.
    pub fn of(files: &FilesOf<'_>) -> Result<Option<Self>, ReadError> {
        let Some(name) = files.given.file_name().and_then(|name| name.to_str()) else { return Ok(None) };
        let given = files.name();
        let found = match files.source {
            Source::Bytes(_) => None,
            Source::Disk if !files.given.exists() => {
                let count = count_beside(files.given, name).in_file(&given)?;
                count.map(|count| (name.to_owned(), count))
            }
            _ => parsed(name)
                .filter(|_| hdf5::is_exodus(files))
                .map(|(base, count)| (base.to_owned(), count.to_owned())),
        };
        let Some((base, count)) = found else { return Ok(None) };
        let mut all = Vec::new();
        for number in 0..count.parse().unwrap_or(0_u32) {
            let name = name_of(&base, &count, number);
            let file = match files.source {
                Source::Memory(in_memory, given) => in_memory
                    .find(given, &name)
                    .map(|found| File::Memory(in_memory.name(found).to_owned(), in_memory.shared(found))),
                _ => Some(files.given.with_file_name(&name)).filter(|path| path.is_file()).map(File::Disk).ok_or_else(
                    || {
                        ReadReason::Io(format!(
                            "its piece \"{name}\" is not there; put all {count} pieces of the mesh into one folder, or give a piece another \
                             name to read it alone"
                        ))
                    },
                ),
            };
            all.push(file.in_file(&given)?);
        }
        Ok(Some(Self { files: all }))
    }

    /// What the files are called.
    pub fn names(&self) -> impl Iterator<Item = PathBuf> {
        self.files.iter().map(|file| match file {
            File::Disk(path) => path.clone(),
            File::Memory(name, _) => name.into(),
        })
    }

    /// The times of the steps of the first piece, which are those of all.
    pub fn times(&self) -> Result<Vec<f64>, ReadError> {
        let options = &ReadOptions::default();
        let Some((file, name)) = self.files.first().zip(self.names().next()) else { return Ok(Vec::new()) };
        let times = file.open(options).and_then(|file| exodus::times(&file));
        times.map_err(|error| in_file(error, &name.display().to_string()))
    }

    /// The mesh of all pieces.
    pub fn read(&self, options: &ReadOptions) -> Result<TetMesh, ReadError> {
        let (mut whole, mut blocks) = (Whole::default(), BlockNames::new());
        self.for_each(options, &mut |piece| {
            whole.add(piece.identity, &mut |numbers| piece.reader.mesh(numbers, &mut blocks), &piece_place)
        })?;
        for (number, name) in blocks {
            whole.mesh.input.name_label("block", number, &name);
        }
        Ok(whole.mesh)
    }

    /// Passes on all pieces that are not empty, which must have the same steps and variables.
    fn for_each(
        &self,
        options: &ReadOptions,
        each: &mut dyn FnMut(&OfFile<'_>) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        let mut first = None;
        for (file, name) in self.files.iter().zip(self.names()) {
            let name = name.display().to_string();
            let mut read = || {
                let opened = file.open(options)?;
                let reader = Reader::new(&opened, options)?;
                let (points, _) = reader.counts()?;
                if points == 0 {
                    return Ok(());
                }
                let numbers = reader.numbers_of_nodes().at(|| "node_num_map".into())?;
                let own = Common::of(&name, &reader, numbers.is_some())?;
                own.check(first.get_or_insert_with(|| own.clone()))?;
                if let Some(numbers) = &numbers {
                    expect_count("numbers of nodes", points, numbers.len()).at(|| "node_num_map".into())?;
                }
                let identity = numbers.as_deref().map_or(Identity::Places, Identity::Numbers);
                each(&OfFile { name: &name, reader, identity })
            };
            read().map_err(|error| in_file(error, &name))?;
        }
        Ok(())
    }
}

/// Where errors of fields are.
fn piece_place() -> String {
    "variables".to_owned()
}

/// A piece.
struct OfFile<'a> {
    name: &'a str,
    reader: Reader<'a>,
    identity: Identity<'a>,
}

/// What all pieces must have in common.
#[derive(Clone)]
struct Common {
    file: String,
    times: Vec<f64>,
    /// The variables at nodes and at elements.
    variables: [Vec<String>; 2],
    has_numbers: bool,
}

impl Common {
    fn of(name: &str, reader: &Reader<'_>, has_numbers: bool) -> Result<Self, ReadError> {
        let [at_nodes, at_elements] = ["name_nod_var", "name_elem_var"].map(|list| {
            let names = reader.names(list).at(|| list.into());
            names.map(|mut names| {
                names.sort_unstable();
                names
            })
        });
        let (times, variables) = (reader.times.clone(), [at_nodes?, at_elements?]);
        Ok(Self { file: name.to_owned(), times, variables, has_numbers })
    }

    /// Checks that a piece has what the first one has.
    fn check(&self, first: &Self) -> Result<(), ReadError> {
        let file = &first.file;
        let missing = |what: String| Err(ReadReason::Missing(what)).at(String::new);
        expect_count(
            format!("time steps, of which \"{file}\" has as many as expected"),
            first.times.len(),
            self.times.len(),
        )
        .at(|| "time_whole".into())?;
        if let Some(step) = (0..self.times.len()).find(|&step| self.times[step] != first.times[step]) {
            let [own, other] = [self, first].map(|common| common.times[step]);
            let what = format!("time step {step} is at {own}, but at {other} in \"{file}\"");
            return Err(ReadReason::Syntax(what)).at(|| "time_whole".into());
        }
        for (at, (own, others)) in
            ["nodes", "elements"].iter().zip(self.variables.iter().zip(&first.variables))
        {
            let absent = |from: &[String], of: &[String]| -> Vec<String> {
                let absent = of.iter().filter(|name| !from.contains(name));
                absent.map(|name| format!("\"{name}\"")).collect()
            };
            let (here, there) = (absent(own, others), absent(others, own));
            if !here.is_empty() {
                return missing(format!("what \"{file}\" has at {at} ({})", here.join(", ")));
            }
            if !there.is_empty() {
                return missing(format!("what is here at {at} ({}) in \"{file}\"", there.join(", ")));
            }
        }
        if self.has_numbers != first.has_numbers {
            let without = if self.has_numbers { format!(" in \"{file}\"") } else { String::new() };
            return missing(format!("variable \"node_num_map\", which other pieces have,{without}"));
        }
        Ok(())
    }
}

impl File {
    fn open(&self, options: &ReadOptions) -> Result<NcFile, ReadError> {
        let storage: DynStorage = match self {
            Self::Disk(path) => {
                hdf5::open_on_disk(path).map_err(|error| ReadReason::Io(error.to_string())).at(String::new)?
            }
            Self::Memory(_, bytes) => Arc::new(BytesStorage::from_owner(bytes.clone())),
        };
        hdf5::exodus_in(storage, options)
    }
}

/// Pieces on a disk that are read one at a time.
#[derive(Debug)]
pub(crate) struct ExodusPieces {
    decomposition: Decomposition,
    counts: PieceCounts,
}

impl ExodusPieces {
    /// Opens the pieces that the file at a path stands for; none if it is another one, or all is in one piece.
    pub fn open(path: &Path, options: &ReadOptions) -> Result<Option<Self>, Stop> {
        let Some(decomposition) = Decomposition::of(&FilesOf::on_disk(path, &options.memory))? else {
            return Ok(None);
        };
        let (mut counts, mut why) = (PieceCounts::default(), None);
        decomposition.for_each(options, &mut |piece| {
            let (points, elements) = piece.reader.counts()?;
            let elements = elements.unwrap_or_else(|| {
                why = Some("it has polyhedra");
                Default::default()
            });
            // Where such cells fold, points move, by a measure of the whole.
            if elements.keys().any(|kind| !middles(*kind).is_empty()) {
                why = Some("it has cells of the second order");
            }
            let tets = cells::most_tets_of(elements).at(String::new)?;
            counts.points = counts.points.saturating_add(points);
            counts.tetrahedra = counts.tetrahedra.saturating_add(tets);
            counts.largest = counts.largest.max(tets);
            counts.fields = piece.reader.count_fields()?;
            counts.pieces += 1;
            Ok(())
        })?;
        match why {
            Some(why) => Err(Stop::Whole(why)),
            None => Ok((counts.pieces > 1).then(|| Self { decomposition, counts: counts.in_boxes() })),
        }
    }
}

impl InPieces for ExodusPieces {
    fn counts(&self) -> PieceCounts {
        self.counts
    }

    fn for_each(&self, options: &ReadOptions, each: Each<'_>) -> Result<(), Stop> {
        let mut hashes = Vec::new();
        self.decomposition.for_each(options, &mut |piece| {
            match piece.identity {
                Identity::Numbers(numbers) => {
                    hashes.extend(numbers.iter().map(|&number| hash(key_of(number))))
                }
                Identity::Places => {
                    let points = piece.reader.coordinates().at(|| "coordinates".into())?;
                    hashes.extend(points_from(&points).into_iter().map(bits).map(hash));
                }
            }
            Ok(())
        })?;
        let (mut shared, mut blocks) = (SharedPoints::of(hashes), BlockNames::new());
        Ok(self.decomposition.for_each(options, &mut |of_file| {
            // What is passed on is no longer here.
            let options = &ReadOptions { memory: options.memory.afresh(), ..options.clone() };
            let reader = of_file.reader.with(options);
            let read = &mut |numbers: crate::vtu::NumberPoints<'_>| reader.mesh(numbers, &mut blocks);
            let mut piece = shared.read(of_file.identity, read, &piece_place)?;
            piece.mesh.input.files.0.push(of_file.name.into());
            each(piece)
        })?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_pieces_say_how_many_there_are() {
        assert_eq!(parsed("a.b.e.16.03"), Some(("a.b.e", "16")));
        assert_eq!(parsed("a.1.0"), Some(("a", "1")));
        for other in [
            "a.e",
            "a.e.4",
            "a.e.4.4",
            "a.e.16.3",
            "a.e.04.01",
            "a.e.4.x",
            "a.+4.+1",
            ".4.0",
            "4.0",
            "a.99999999999.00000000000",
        ] {
            assert_eq!(parsed(other), None, "{other}");
        }
    }
}
