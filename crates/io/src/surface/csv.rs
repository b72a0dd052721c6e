//! Tables as comma-separated values.

use std::io;
use std::io::Write;

use crate::surface::unfit;

/// Writes a table (`.csv`): a line of names, then a line for each row; what is not a number is left empty. Numbers
/// are written so that they read back exactly.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the columns are not equally long, and if `out` fails.
pub fn write_csv(columns: &[(String, Vec<f64>)], out: &mut impl Write) -> io::Result<()> {
    let rows = columns.first().map_or(0, |(_, values)| values.len());
    if let Some((name, values)) = columns.iter().find(|(_, values)| values.len() != rows) {
        return Err(unfit(format!("column \"{name}\" has {} values for {rows} rows", values.len())));
    }
    let names: Vec<String> = columns.iter().map(|(name, _)| quoted(name)).collect();
    writeln!(out, "{}", names.join(","))?;
    for row in 0..rows {
        for (i, (_, values)) in columns.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            let value = values[row];
            if value.is_nan() { write!(out, "{comma}")? } else { write!(out, "{comma}{value:?}")? }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// A name with a comma or the like goes between quotes.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
