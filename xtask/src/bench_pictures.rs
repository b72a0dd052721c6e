//! `cargo xtask bench --pictures`: how fast the renderer draws; writes its part of `docs/benchmarks.md`.

use anyhow::Result;

use crate::benchmarks_page::{self, Part};
use crate::shell;

const HEAD: &str = "
A headless renderer draws the generated volume at the smallest error that its number of tetrahedra allows, a picture at a
time, while the camera turns and isovalue or plane move. *compute*: what the session and the scene compute on one thread
of the CPU for a new isovalue, plane or set of tubes and arrows, with its upload; for volume, boundary and cells nothing but the
style changes. *draw*: until the device has finished the picture. *quick*: the same for pictures as a viewer draws them while something
moves, where others take too long: without shade in hollows and with one sample a pixel where all is opaque; then with half the pixels along
each side, as where those take too long, too. All are medians. *GPU* is the memory of the mesh and of
the lists of pixels, *bytes/tet* that of the mesh alone. The goal in software is 4 pictures a second in each mode, and 5 while something moves.
";

/// Measures with the options of the benchmark, and puts its table into the page, in place of the one of the same adapter
/// and size.
pub fn run(options: &[String]) -> Result<()> {
    let mut command = shell::cargo(["bench", "--package", "tetralod", "--bench", "pictures"]);
    let table = shell::output(command.args(["--", "run"]).args(options))?;
    println!("{table}");
    let old = benchmarks_page::read(Part::Pictures);
    benchmarks_page::write(Part::Pictures, &[HEAD, &tables(&old, &table)].concat())
}

/// The tables of a part, with `fresh` in place of the one of the same title.
fn tables(part: &str, fresh: &str) -> String {
    let title = |table: &str| table.lines().next().unwrap_or_default().to_owned();
    // The first piece is the text before the first table.
    let old = part.split("\n### ").skip(1).map(|table| format!("### {}", table.trim_end()));
    let mut all: Vec<String> = old.filter(|table| title(table) != title(fresh)).collect();
    all.push(fresh.trim_end().to_owned());
    all.iter().map(|table| format!("\n{table}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::{HEAD, tables};

    #[test]
    fn a_table_takes_the_place_of_its_predecessor() {
        let first = tables("", "### a\n\n| 1 |\n");
        assert_eq!(first, "\n### a\n\n| 1 |\n");
        let both = tables(&[HEAD, &first].concat(), "### b\n\n| 2 |\n");
        assert_eq!(both, "\n### a\n\n| 1 |\n\n### b\n\n| 2 |\n");
        assert_eq!(tables(&[HEAD, &both].concat(), "### a\n\n| 3 |"), "\n### b\n\n| 2 |\n\n### a\n\n| 3 |\n");
    }
}
