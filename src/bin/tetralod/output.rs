//! What goes to stdout: one JSON object for programs, lines for people.

use anyhow::Context;
use anyhow::Result;
use serde::Serialize;
use std::io;
use std::io::Write;

/// Prints `value` as one JSON object.
pub fn json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).context("the result could not be put into JSON")?;
    print(&text)
}

/// Prints lines of `name  value`, the values below one another.
pub fn table(rows: &[(&str, String)]) -> Result<()> {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let lines: Vec<String> = rows.iter().map(|(name, value)| format!("{name:<width$}  {value}")).collect();
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

/// A count with thin groups of three digits: `1 234 567`.
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
