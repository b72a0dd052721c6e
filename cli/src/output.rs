//! What goes to stdout: one JSON object for programs, lines for people.

use crate::parse::named;
use anyhow::{Context, Result};
use serde::Serialize;
use std::borrow::Cow;
use std::io;
use std::io::Write;
use std::process::ExitStatus;

/// The exit code where something failed.
pub const FAILED: u8 = 1;

/// How much a command that writes a file says about it.
#[derive(Default, clap::Args)]
pub struct Verbosity {
    /// No progress bar and no summary.
    #[arg(short, long)]
    pub quiet: bool,
    /// Print the summary as a JSON object, also with --quiet.
    #[arg(long)]
    pub json: bool,
    /// How stderr shows the progress: as a bar, on a terminal alone, or as json, for programs: now and then a line
    /// {"stage": "remove", "done": 1200, "total": 4800}, in which total may grow [default: bar].
    #[arg(long, value_name = "HOW", value_parser = |text: &str| named(text, &[("bar", Progress::Bar), ("json", Progress::Json)]))]
    pub progress: Option<Progress>,
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    Bar,
    Json,
}

impl Verbosity {
    /// Prints the summary, if it is wanted.
    pub fn print(&self, report: &impl Serialize, rows: &[(&str, String)]) -> Result<()> {
        if self.quiet && !self.json { Ok(()) } else { result(self.json, report, rows) }
    }
}

/// Prints a result: `report` as one JSON object, or `rows` for people.
pub fn result<N: AsRef<str>>(as_json: bool, report: &impl Serialize, rows: &[(N, String)]) -> Result<()> {
    if as_json { json(report) } else { print(&lines(rows)) }
}

/// Prints `value` as one JSON object.
pub fn json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).context("the result could not be put into JSON")?;
    print(&text)
}

/// Lines of `name  value`, the values below one another.
pub fn lines<N: AsRef<str>>(rows: &[(N, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.as_ref().len()).max().unwrap_or(0);
    let line = |(name, value): &(N, String)| format!("{:<width$}  {value}", name.as_ref());
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Prints a text and a line end.
pub fn print(text: &str) -> Result<()> {
    match writeln!(io::stdout(), "{}", printable(text)) {
        // Whoever reads has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        done => done.context("stdout could not be written"),
    }
}

/// How the lines of an error begin, on stderr.
const ERROR: &str = "error: ";

/// Tells people why the command failed, on stderr.
pub fn note_error(error: &anyhow::Error) {
    note(&format!("{ERROR}{error:#}"));
}

/// Whether a line of stderr begins an error.
pub fn is_error(line: &str) -> bool {
    line.starts_with(ERROR)
}

/// Why a process of this command failed, by all that it has said on stderr.
pub fn failure(said: &str, status: ExitStatus) -> String {
    // Notes come before the error, whose words may go on.
    let lines: Vec<&str> = said.lines().skip_while(|line| !is_error(line)).collect();
    match lines.join("\n").strip_prefix(ERROR) {
        Some(error) => error.to_owned(),
        // The system ends what takes too much memory.
        None => format!("the process ended with {status}, perhaps for want of memory"),
    }
}

/// Tells people something beside the result, on stderr.
pub fn note(text: &str) {
    eprintln!("{}", printable(text));
}

/// A text in which characters that do something to a terminal, or to the order in which others are shown, are written as in JSON: names
/// come from files of others.
pub fn printable(text: &str) -> Cow<'_, str> {
    let acts = |c: char| {
        c.is_control() && c != '\n' || matches!(c, '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(acts) {
        return text.into();
    }
    text.chars()
        .fold(String::new(), |out, c| {
            if acts(c) { out + &format!("\\u{:04x}", u32::from(c)) } else { out + c.encode_utf8(&mut [0; 4]) }
        })
        .into()
}

/// A count in groups of three digits: `1 234 567`.
pub fn count(number: impl Into<u64>) -> String {
    let digits = number.into().to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// The size of a mesh, for people.
pub fn mesh(vertices: u32, tetrahedra: u64) -> String {
    format!("{} vertices, {} tetrahedra", count(vertices), count(tetrahedra))
}

/// The size of a file, for people, and in how many shards it is.
pub fn file_size(size: u64, shards: Option<u64>) -> String {
    match shards {
        None | Some(1) => bytes(size),
        Some(shards) => format!("{} in {} shards", bytes(size), count(shards)),
    }
}

/// A size in bytes, for people.
pub fn bytes(number: u64) -> String {
    let units = ["KiB", "MiB", "GiB", "TiB"];
    let mut size = number as f64;
    let mut unit = "bytes";
    for next in units {
        if size < 1024.0 {
            break;
        }
        size /= 1024.0;
        unit = next;
    }
    if unit == "bytes" {
        format!("{number} bytes")
    } else {
        format!("{size:.1} {unit} ({} bytes)", count(number))
    }
}

/// A fraction as a percentage, for people.
pub fn percent(fraction: f64) -> String {
    format!("{:.4} %", fraction * 100.0)
}

/// A number with six significant digits, for people.
pub fn number(x: f64) -> String {
    exact(rounded(x, 5))
}

/// The number with so many digits behind the first: through text, so that the digits dropped leave no trace.
fn rounded(x: f64, digits: usize) -> f64 {
    format!("{x:.digits$e}").parse().unwrap_or(x)
}

/// A number with all of its digits: it reads back as the same.
pub fn exact(x: f64) -> String {
    let plain = x == 0.0 || (1e-4..1e7).contains(&x.abs());
    if plain { x.to_string() } else { format!("{x:e}") }
}

/// A number with six significant digits, and more if these leave out a twentieth of `step`: values of a narrow range far from 0.
pub fn within(x: f64, step: f64) -> String {
    let is_near = |short: &f64| (short - x).abs() <= 0.05 * step || x.is_nan();
    exact((5..17).map(|digits| rounded(x, digits)).find(is_near).unwrap_or(x))
}

/// The ends of a range, with digits that tell them apart.
pub fn ends([low, high]: [f64; 2]) -> [String; 2] {
    [low, high].map(|end| within(end, 1e-4 * (high - low)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_get_short_numbers() {
        let numbers = [0.0, -0.1234567, 1234567.8, 9.173761674e-23, -2.5e9, f64::NAN].map(number);
        assert_eq!(numbers, ["0", "-0.123457", "1234570", "9.17376e-23", "-2.5e9", "NaN"]);
        assert_eq!(ends([0.123456789, 1.0]), ["0.123457", "1"]);
        assert_eq!(ends([1.7e9, 1.7e9 + 3.0]), ["1.7e9", "1.700000003e9"]);
        assert_eq!(within(101_325.000_043_2, 1e-6), "101325.0000432");
        assert_eq!(
            [exact(600_000.123_456), exact(5.8e6 + 0.3), exact(f64::NAN)],
            ["600000.123456", "5800000.3", "NaN"]
        );
        assert_eq!([0_u32, 999, 1000, 1_234_567].map(count), ["0", "999", "1 000", "1 234 567"]);
        assert_eq!([0, 1023, 1536].map(bytes), ["0 bytes", "1023 bytes", "1.5 KiB (1 536 bytes)"]);
        assert_eq!(percent(0.001), "0.1000 %");
    }

    #[test]
    fn nothing_acts_on_the_terminal() {
        assert_eq!(printable("a\nä = 1"), "a\nä = 1");
        assert_eq!(
            printable("\u{1b}[2J\r\u{9b}m\u{202e}x\u{7f}"),
            "\\u001b[2J\\u000d\\u009bm\\u202ex\\u007f"
        );
        let json = serde_json::to_string("\u{9b}\u{1b}\u{2066}").expect("JSON");
        let read: String = serde_json::from_str(&printable(&json)).expect("still JSON");
        assert_eq!(read, "\u{9b}\u{1b}\u{2066}");
    }
}
