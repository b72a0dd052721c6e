//! What goes to stdout: one JSON object for programs, lines for people.

use anyhow::{Context, Result};
use serde::Serialize;
use std::io;
use std::io::Write;

/// How much a command that writes a file says about it.
#[derive(clap::Args)]
pub struct Verbosity {
    /// No progress bar and no summary.
    #[arg(short, long)]
    pub quiet: bool,
    /// Print the summary as a JSON object, also with --quiet.
    #[arg(long)]
    json: bool,
}

impl Verbosity {
    /// Prints the summary, if it is wanted.
    pub fn print(&self, report: &impl Serialize, rows: &[(&str, String)]) -> Result<()> {
        if self.quiet && !self.json { Ok(()) } else { result(self.json, report, rows) }
    }
}

/// Prints a result: `report` as one JSON object, or `rows` for people.
pub fn result<N: AsRef<str>>(as_json: bool, report: &impl Serialize, rows: &[(N, String)]) -> Result<()> {
    if as_json { json(report) } else { table(rows) }
}

/// Prints `value` as one JSON object.
pub fn json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).context("the result could not be put into JSON")?;
    print(&text)
}

/// Prints lines of `name  value`, the values below one another.
fn table<N: AsRef<str>>(rows: &[(N, String)]) -> Result<()> {
    let width = rows.iter().map(|(name, _)| name.as_ref().len()).max().unwrap_or(0);
    let line = |(name, value): &(N, String)| format!("{:<width$}  {value}", name.as_ref());
    let lines: Vec<String> = rows.iter().map(line).collect();
    print(&lines.join("\n"))
}

/// Prints a text and a line end.
pub fn print(text: &str) -> Result<()> {
    match writeln!(io::stdout(), "{text}") {
        // Whoever reads has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        done => done.context("stdout could not be written"),
    }
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
pub fn mesh(vertices: u32, tetrahedra: u32) -> String {
    format!("{} vertices, {} tetrahedra", count(vertices), count(tetrahedra))
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
    // Through text, so that the digits dropped leave no trace.
    let short: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    let plain = short == 0.0 || (1e-4..1e7).contains(&short.abs());
    if plain { short.to_string() } else { format!("{short:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_get_short_numbers() {
        let numbers = [0.0, -0.1234567, 1234567.8, 9.173761674e-23, -2.5e9, f64::NAN].map(number);
        assert_eq!(numbers, ["0", "-0.123457", "1234570", "9.17376e-23", "-2.5e9", "NaN"]);
        assert_eq!([0_u32, 999, 1000, 1_234_567].map(count), ["0", "999", "1 000", "1 234 567"]);
        assert_eq!([0, 1023, 1536].map(bytes), ["0 bytes", "1023 bytes", "1.5 KiB (1 536 bytes)"]);
        assert_eq!(percent(0.001), "0.1000 %");
    }
}
