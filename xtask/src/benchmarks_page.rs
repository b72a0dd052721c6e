//! `docs/benchmarks.md`: one page, whose parts are measured by commands of their own.

use std::fs;

use anyhow::{Context, Result};

const PAGE: &str = "docs/benchmarks.md";

/// A part of the page, in its order.
#[derive(Clone, Copy, Debug)]
pub enum Part {
    /// What comes before the first title of another part.
    Files,
    Network,
    Builds,
    InParts,
    AgainstVtk,
    FirstVisit,
    Pictures,
}

/// How the parts begin, but for the first one.
const TITLES: [&str; 6] = [
    "\n## Over a network\n",
    "\n## Builds\n",
    "\n## Builds in parts\n",
    "\n## Beside VTK's decimation\n",
    "\n## The first visit of the page\n",
    "\n## Pictures\n",
];

/// What the page says in a part, without its title; empty if nothing.
pub fn read(part: Part) -> String {
    let parts = split(&fs::read_to_string(PAGE).unwrap_or_default());
    parts.into_iter().nth(part as usize).unwrap_or_default()
}

/// Puts `text`, which begins below the title, in place of what the page says in a part.
pub fn write(part: Part, text: &str) -> Result<()> {
    let page = fs::read_to_string(PAGE).unwrap_or_default();
    fs::write(PAGE, replaced(&page, part, text)).with_context(|| PAGE.to_owned())?;
    println!("wrote {PAGE}");
    Ok(())
}

fn replaced(page: &str, part: Part, text: &str) -> String {
    let mut parts = split(page);
    parts[part as usize] = format!("{}\n", text.trim_end());
    let titles = [""].into_iter().chain(TITLES);
    titles
        .zip(&parts)
        .filter(|(_, part)| !part.is_empty())
        .map(|(title, part)| format!("{title}{part}"))
        .collect()
}

fn split(page: &str) -> [String; TITLES.len() + 1] {
    let mut parts = [const { String::new() }; TITLES.len() + 1];
    let mut rest = page;
    // From the end, for parts that are not there are empty.
    for (title, part) in TITLES.iter().zip(&mut parts[1..]).rev() {
        if let Some((before, own)) = rest.split_once(title) {
            *part = own.to_owned();
            rest = before;
        }
    }
    parts[0] = rest.to_owned();
    parts
}

#[cfg(test)]
mod tests {
    use super::{Part, replaced};

    #[test]
    fn a_part_takes_the_place_of_its_predecessor_and_the_others_stay() {
        let files = replaced("", Part::Files, "# Benchmarks\n\n## Bytes\n");
        let pictures = replaced(&files, Part::Pictures, "\nfast\n\n");
        assert_eq!(pictures, "# Benchmarks\n\n## Bytes\n\n## Pictures\n\nfast\n");
        let builds = replaced(&pictures, Part::Builds, "\nslow");
        assert_eq!(builds, "# Benchmarks\n\n## Bytes\n\n## Builds\n\nslow\n\n## Pictures\n\nfast\n");
        let again = replaced(&builds, Part::Files, "# Benchmarks\n");
        assert_eq!(again, "# Benchmarks\n\n## Builds\n\nslow\n\n## Pictures\n\nfast\n");
        let at_last = replaced(&again, Part::Pictures, "\nfaster\n");
        assert_eq!(at_last, "# Benchmarks\n\n## Builds\n\nslow\n\n## Pictures\n\nfaster\n");
    }
}
