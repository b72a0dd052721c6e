//! Lists of time steps: ParaView's collections (`.pvd`).

use std::io;
use std::io::Write;
use std::path::{Path, PathBuf};

use quick_xml::Reader;
use quick_xml::events::Event;

use crate::beside::{self, FilesOf};
use crate::error::{At, ReadError, ReadReason};
use crate::file_kind::{lower_extension, without_gz};
use crate::listed::expect_below;
use crate::write::escaped;
use crate::xml::Attributes;
use crate::{MemoryLimit, formats, packed};

/// Most bytes of a list, unpacked if it is in gzip: some hundred thousand time steps.
pub(super) const MOST_BYTES: u64 = 1 << 26;

/// A file that holds one time step.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The file.
    pub path: PathBuf,
    /// The time, if the list contains it; the file may, too.
    pub time: Option<f64>,
    /// Which of the steps in the file it is: for [`ReadOptions::step`](crate::ReadOptions::step).
    pub number: usize,
}

/// The time steps that the file at `path` stands for: those that it lists if it is a `.pvd`, in ascending order, those that it
/// has if it is VTKHDF, Exodus or Gmsh, else itself alone.
///
/// # Errors
/// If the list cannot be read, is damaged or empty, or has several files for one time.
pub fn steps(path: &Path) -> Result<Vec<Step>, ReadError> {
    let is_list = is_list(&path.to_string_lossy());
    let memory = if is_list { MemoryLimit::of(MOST_BYTES) } else { MemoryLimit::default() };
    let files = FilesOf::on_disk(path, &memory);
    steps_of(
        &files,
        |file| beside::place(path, file),
        |path, time, number| Step { path, time, number },
        path.to_owned(),
    )
}

/// Whether a file of this name lists time steps.
pub(super) fn is_list(name: &str) -> bool {
    lower_extension(Path::new(without_gz(name))) == "pvd"
}

/// The time steps that the given file stands for: each in a file that `place` finds if it is listed, else in the given one.
pub(super) fn steps_of<File: Clone, Step>(
    files: &FilesOf<'_>,
    place: impl Fn(&str) -> Result<File, ReadReason>,
    step: impl Fn(File, Option<f64>, usize) -> Step,
    given: File,
) -> Result<Vec<Step>, ReadError> {
    if !is_list(&files.name()) {
        let times = formats::times(files)?;
        // The reader of a file with one step knows its time.
        if times.len() < 2 {
            return Ok(vec![step(given, None, 0)]);
        }
        let numbered = times.into_iter().enumerate();
        return Ok(numbered.map(|(number, time)| step(given.clone(), Some(time), number)).collect());
    }
    let listed = listed(&files.load_given()?).in_file(&files.name())?;
    let steps: Result<_, _> =
        listed.into_iter().map(|(time, file)| Ok(step(place(&file)?, time, 0))).collect();
    steps.in_file(&files.name())
}

/// The times and files in a list with these bytes.
pub(super) fn listed(bytes: &[u8]) -> Result<Vec<(Option<f64>, String)>, ReadReason> {
    packed::unpacked(bytes, &MemoryLimit::of(MOST_BYTES)).and_then(|bytes| parse(&bytes))
}

/// Writes a list of time steps, whose files lie in the list's folder or below it; those without a time are numbered from 0.
///
/// # Errors
/// If `out` fails.
pub fn write_pvd(steps: &[Step], out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "<VTKFile type=\"Collection\" version=\"1.0\">\n  <Collection>")?;
    for (number, Step { path, time, .. }) in steps.iter().enumerate() {
        let (time, file) = (time.unwrap_or(number as f64), escaped(&path.to_string_lossy()));
        writeln!(out, "    <DataSet timestep=\"{time:?}\" file=\"{file}\"/>")?;
    }
    writeln!(out, "  </Collection>\n</VTKFile>")
}

/// Times and files, in ascending order; the time need not be stated where there is one file.
fn parse(bytes: &[u8]) -> Result<Vec<(Option<f64>, String)>, ReadReason> {
    let not_xml = |what: String| ReadReason::Syntax(format!("not well-formed XML: {what}"));
    let text = std::str::from_utf8(bytes).map_err(|_| ReadReason::Syntax("the text is not UTF-8".into()))?;
    let mut reader = Reader::from_str(text);
    let (mut depth, mut listed) = (0_u32, Vec::new());
    let mut is_list = false;
    loop {
        let event = reader.read_event().map_err(|error| not_xml(error.to_string()))?;
        match &event {
            Event::Start(element) | Event::Empty(element) => {
                let name = element.name().as_ref().to_owned();
                is_list |= depth == 1 && name == "Collection";
                if is_list && name == "DataSet" {
                    listed.push(entry(&Attributes::of(element)?)?);
                }
                depth += u32::from(matches!(event, Event::Start(_)));
            }
            Event::End(_) => depth = depth.saturating_sub(1),
            Event::Eof => break,
            _ => {}
        }
    }
    if depth > 0 {
        return Err(not_xml("an element does not end".into()));
    }
    if listed.is_empty() {
        return Err(ReadReason::Missing("an entry <DataSet>".into()));
    }
    if listed.len() > 1 && listed.iter().any(|(time, _)| time.is_none()) {
        let what = "a <DataSet> without a timestep among others, so a part of each time step,";
        let remedy = "give each file its timestep, or merge the parts of each time step into one file";
        return Err(ReadReason::unsupported(what, remedy));
    }
    listed.sort_by(|a, b| a.0.unwrap_or_default().total_cmp(&b.0.unwrap_or_default()));
    if let Some(pair) = listed.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        let what = format!("time {} with more than one file", pair[0].0.unwrap_or_default());
        return Err(ReadReason::unsupported(what, "merge the parts of each time step into one file"));
    }
    Ok(listed)
}

/// The time and the file of an entry, which must lie in the list's folder or below.
fn entry(attributes: &Attributes) -> Result<(Option<f64>, String), ReadReason> {
    let missing = |name: &str| ReadReason::Missing(format!("attribute {name} of <DataSet>"));
    let file = attributes.get("file").ok_or_else(|| missing("file"))?;
    let finite = |time: &str| time.parse().ok().filter(|time: &f64| time.is_finite());
    let not_a_time = || ReadReason::Syntax("a timestep is not a number".into());
    let time = attributes.get("timestep").filter(|time| !time.is_empty());
    let time = time.map(|time| finite(time).ok_or_else(not_a_time)).transpose()?;
    expect_below(file)?;
    // Zero has two signs, which would not sort as equal.
    Ok((time.map(|time| time + 0.0), file.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(entries: &str) -> Result<Vec<(Option<f64>, String)>, ReadReason> {
        parse(format!("<VTKFile type=\"Collection\"><Collection>{entries}</Collection></VTKFile>").as_bytes())
    }

    #[test]
    fn steps_come_in_order_of_time() {
        let entries = "<DataSet timestep=\"1.5\" part=\"0\" file=\"b/1.vtu\"/>\
                       <DataSet timestep=\"-0.5\" group=\"\" file=\"0.vtu\"></DataSet>";
        assert_eq!(list(entries).unwrap(), [(Some(-0.5), "0.vtu".into()), (Some(1.5), "b/1.vtu".into())]);
    }

    #[test]
    fn one_file_needs_no_time() {
        assert_eq!(list("<DataSet file=\"a.vtu\"/>").unwrap(), [(None, "a.vtu".into())]);
        let parts = "<DataSet part=\"0\" file=\"a.vtu\"/><DataSet part=\"1\" file=\"b.vtu\"/>";
        assert!(list(parts).unwrap_err().to_string().contains("merge the parts"));
    }

    #[test]
    fn what_is_written_is_read_again() {
        let step = |file: &str, time| Step { path: file.into(), time, number: 0 };
        let mut list = Vec::new();
        write_pvd(&[step("a & \"b\".vti", None), step("c/d.vti", Some(1.5))], &mut list).unwrap();
        let expected = [(Some(0.0), "a & \"b\".vti".to_owned()), (Some(1.5), "c/d.vti".to_owned())];
        assert_eq!(parse(&list).unwrap(), expected);
    }

    #[test]
    fn lists_that_do_not_say_what_is_needed_are_refused() {
        let refused = |entries: &str| list(entries).unwrap_err().to_string();
        assert!(refused("").contains("DataSet"));
        assert!(refused("<DataSet timestep=\"0\"/>").contains("file"));
        assert!(refused("<DataSet timestep=\"nan\" file=\"a.vtu\"/>").contains("timestep"));
        assert!(refused("<DataSet timestep=\"0\" file=\"../a.vtu\"/>").contains("beside"));
        assert!(refused("<DataSet timestep=\"0\" file=\"/a.vtu\"/>").contains("beside"));
        let twice = "<DataSet timestep=\"0\" file=\"a.vtu\"/><DataSet timestep=\"-0\" file=\"b.vtu\"/>";
        assert!(refused(twice).contains("merge"));
        assert!(refused("<DataSet").contains("XML"));
    }

    #[test]
    fn no_cut_and_no_bit_flip_panics() {
        let file = b"<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0.5\" file=\"a/b.vtu\"/>\
                     </Collection></VTKFile>";
        (0..file.len()).for_each(|length| drop(parse(&file[..length])));
        for bit in 0..8 * file.len() {
            let mut flipped = file.to_vec();
            flipped[bit / 8] ^= 1 << (bit % 8);
            for (time, path) in parse(&flipped).unwrap_or_default() {
                assert!(
                    time.is_none_or(f64::is_finite)
                        && !Path::new(&path).is_absolute()
                        && !path.contains("..")
                );
            }
        }
    }
}
