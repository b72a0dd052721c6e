//! What is known of the input that a mesh was read from: for messages in its own numbers, and for what was left out.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use crate::mesh::Field;
use crate::mesh::Middles;

/// What is known of the input that a mesh was read from. A mesh that was made otherwise has none of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshInput {
    /// Which cells the tetrahedra are of.
    pub cells: CellNumbers,
    /// What was left out or changed, in the order in which it was found.
    pub notes: Vec<Note>,
    /// Fields at points that nobody asked for, without values.
    pub other_fields: Vec<Field>,
    /// Fields at cells that nobody asked for, without values.
    pub other_cell_fields: Vec<Field>,
    /// What the input calls the whole numbers of a field at cells, by the name of that field: materials, physical groups, blocks.
    pub label_names: BTreeMap<String, BTreeMap<i64, String>>,
    /// The files that it was read from.
    pub files: SourceFiles,
    /// The middles of its cells, until the mesh is passed on.
    #[doc(hidden)]
    pub middles: Middles,
}

/// The files that a mesh was read from: the one that was given, and those that it names. They are no part of what the mesh is: all are
/// equal.
#[derive(Clone, Debug, Default)]
pub struct SourceFiles(pub Vec<PathBuf>);

impl PartialEq for SourceFiles {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Longer names of labels are cut off: formats that have names allow 127 bytes at most.
const MOST_CHARACTERS: usize = 256;

impl MeshInput {
    /// Notes that so many things were left out; nothing if there are none.
    pub fn leave_out(&mut self, count: u64, one: &str, many: &str) {
        let known = self.notes.iter_mut().find_map(|note| match note {
            Note::LeftOut { count, one: known, .. } if known == one => Some(count),
            _ => None,
        });
        match known {
            Some(known) => *known += count,
            None if count > 0 => {
                self.notes.push(Note::LeftOut { count, one: one.to_owned(), many: many.to_owned() });
            }
            None => {}
        }
    }

    /// Notes that so many points were added in cells, of which this is the first.
    fn add_points(&mut self, count: u64, cell: u32) {
        let known = self.notes.iter_mut().find_map(|note| match note {
            Note::Added { points, .. } => Some(points),
            _ => None,
        });
        match known {
            Some(known) => *known += count,
            None => self.notes.push(Note::Added { points: count, cell }),
        }
    }

    /// Notes what a number of a field at cells is called; empty names say nothing, and of long ones the beginning is enough.
    pub fn name_label(&mut self, field: &str, label: i64, name: &str) {
        let name: String = name.trim().chars().take(MOST_CHARACTERS).collect();
        if !name.is_empty() {
            self.label_names.entry(field.to_owned()).or_default().insert(label, name);
        }
    }

    /// Notes something, once.
    pub fn say(&mut self, text: impl Into<String>) {
        let note = Note::Text(text.into());
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// Takes over what is known of another part of the input, whose tetrahedra follow those of this one.
    pub fn append(&mut self, part: Self) {
        let before = self.cells.cells;
        self.cells.append(part.cells);
        self.files.0.extend(part.files.0);
        self.middles.append(part.middles);
        for note in part.notes {
            match note {
                Note::LeftOut { count, one, many } => self.leave_out(count, &one, &many),
                Note::Text(text) => self.say(text),
                Note::Added { points, cell } => self.add_points(points, before.saturating_add(cell)),
            }
        }
    }

    /// What was left out and changed, a line each.
    pub fn lines(&self) -> Vec<String> {
        let left_out: Vec<String> = self.notes.iter().filter_map(Note::counted).collect();
        let left_out = (!left_out.is_empty()).then(|| format!("left out: {}", left_out.join(", ")));
        let texts = self.notes.iter().filter_map(|note| match note {
            Note::Text(text) => Some(text.clone()),
            Note::LeftOut { .. } => None,
            Note::Added { points, cell } => {
                let cell = self.cells.cell(*cell);
                Some(if *points == 1 {
                    format!("added: 1 point in cell {cell}, with the mean of the values at its corners")
                } else {
                    format!(
                        "added: {points} points in the middle of cells and faces, with the mean of the values at their corners (first: \
                         cell {cell})"
                    )
                })
            }
        });
        left_out.into_iter().chain(texts).collect()
    }
}

/// Something of the input that was left out or changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Note {
    /// So many things that were left out, and what one and several of them are called.
    LeftOut {
        /// How many.
        count: u64,
        /// What one is called.
        one: String,
        /// And several.
        many: String,
    },
    /// Points in the middle of cells and of their faces, where these cannot be split into tetrahedra between their corners.
    Added {
        /// How many.
        points: u64,
        /// The number of the first of these cells, numbered on over all parts of the input.
        cell: u32,
    },
    /// In words.
    Text(String),
}

impl Note {
    fn counted(&self) -> Option<String> {
        match self {
            Self::LeftOut { count, one, many } => {
                Some(format!("{count} {}", if *count == 1 { one } else { many }))
            }
            Self::Text(_) | Self::Added { .. } => None,
        }
    }
}

/// Which cells of the input the tetrahedra of a mesh are of.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CellNumbers {
    /// How many tetrahedra there are.
    tets: usize,
    /// How many cells there are in all parts.
    cells: u32,
    numbers: Numbers,
    /// The first cell of each run of cells of one type, and what that is called.
    kinds: Vec<(u32, &'static str)>,
    /// The first cell of each part of an input that has several, and what the part is called.
    parts: Vec<(u32, String)>,
    /// What the input numbers each cell with, if that is not its place in a part; empty if it is.
    own: Vec<u32>,
}

/// The cell of each tetrahedron; parts are numbered on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum Numbers {
    /// Each tetrahedron is a cell.
    #[default]
    Same,
    /// Each cell is so many tetrahedra.
    Equal(u32),
    Each(Vec<u32>),
}

impl CellNumbers {
    /// Each of so many tetrahedra is a cell.
    pub fn same(tets: usize) -> Self {
        Self { tets, cells: tets as u32, ..Self::default() }
    }

    /// Each of so many cells of one kind is as many tetrahedra.
    pub fn equal(cells: usize, each: u32, kind: &'static str) -> Self {
        let (tets, numbers) = (cells * each as usize, Numbers::Equal(each));
        Self { tets, cells: cells as u32, numbers, kinds: vec![(0, kind)], ..Self::default() }
    }

    /// The cell of each tetrahedron, of so many cells; `kinds` are the first cell of each run of one type, with its name.
    pub fn each(numbers: Vec<u32>, cells: usize, kinds: Vec<(u32, &'static str)>) -> Self {
        let (tets, numbers) = (numbers.len(), Numbers::Each(numbers));
        Self { tets, cells: cells as u32, numbers, kinds, ..Self::default() }
    }

    /// Says what the part of the input is called that all cells so far are of.
    pub fn name_part(&mut self, name: impl Into<String>) {
        self.parts = vec![(0, name.into())];
    }

    /// Says what the input numbers each of its cells with.
    pub fn number_cells(&mut self, own: Vec<u32>) {
        self.own = own;
    }

    /// The cell that a tetrahedron is of.
    pub fn cell_of(&self, tet: u32) -> InputCell {
        self.cell(self.number(tet))
    }

    /// The cell with a number that is numbered on over all parts.
    fn cell(&self, cell: u32) -> InputCell {
        let first = |at: Option<usize>| at.and_then(|at| at.checked_sub(1));
        let kind = first(Some(self.kinds.partition_point(|(first, _)| *first <= cell)));
        let part = first(Some(self.parts.partition_point(|(first, _)| *first <= cell)));
        let part = part.and_then(|at| self.parts.get(at));
        InputCell {
            number: self.own_number(cell),
            kind: kind.and_then(|at| self.kinds.get(at)).map(|(_, kind)| *kind),
            part: part.map(|(_, name)| name.clone()),
        }
    }

    /// What the input numbers a cell with: else its place in its part.
    fn own_number(&self, cell: u32) -> u32 {
        let part = self.parts.partition_point(|(first, _)| *first <= cell).checked_sub(1);
        let first = part.and_then(|at| self.parts.get(at)).map_or(0, |(first, _)| *first);
        self.own.get(cell as usize).copied().unwrap_or(cell - first)
    }

    /// The number of a tetrahedron's cell, numbered on over all parts. Those that nothing is known of are their own.
    pub(super) fn number(&self, tet: u32) -> u32 {
        match &self.numbers {
            Numbers::Same => tet,
            Numbers::Equal(each) => tet / each.max(&1),
            Numbers::Each(numbers) => numbers.get(tet as usize).copied().unwrap_or(tet),
        }
    }

    /// Leaves these tetrahedra, of which `kept` are the numbers in ascending order.
    pub fn keep(&mut self, kept: &[u32]) {
        if self.numbers == Numbers::Same && kept.iter().zip(0..).all(|(kept, number)| *kept == number) {
            self.tets = kept.len();
            return;
        }
        let numbers = kept.iter().map(|&tet| self.number(tet)).collect();
        (self.tets, self.numbers) = (kept.len(), Numbers::Each(numbers));
    }

    fn append(&mut self, part: Self) {
        let (first, tets) = (self.cells, self.tets + part.tets);
        if !self.own.is_empty() || !part.own.is_empty() {
            self.own = (0..first).map(|cell| self.own_number(cell)).collect();
            self.own.extend((0..part.cells).map(|cell| part.own_number(cell)));
        }
        let go_on = |number: u32| first.saturating_add(number);
        let is_same = self.tets == first as usize
            && [&self.numbers, &part.numbers].into_iter().all(|numbers| *numbers == Numbers::Same);
        if !is_same {
            let mut numbers = match std::mem::take(&mut self.numbers) {
                Numbers::Each(numbers) => numbers,
                other => {
                    self.numbers = other;
                    (0..self.tets as u32).map(|tet| self.number(tet)).collect()
                }
            };
            numbers.extend((0..part.tets as u32).map(|tet| go_on(part.number(tet))));
            self.numbers = Numbers::Each(numbers);
        }
        if part.kinds.is_empty() && !self.kinds.is_empty() {
            self.kinds.push((first, TETRAHEDRON));
        } else if self.kinds.is_empty() && !part.kinds.is_empty() && first > 0 {
            self.kinds.push((0, TETRAHEDRON));
        }
        self.kinds.extend(part.kinds.into_iter().map(|(cell, kind)| (go_on(cell), kind)));
        self.parts.extend(part.parts.into_iter().map(|(cell, name)| (go_on(cell), name)));
        (self.tets, self.cells) = (tets, go_on(part.cells));
    }
}

/// What cells are called of which nothing else is said.
const TETRAHEDRON: &str = "tetrahedron";

/// A cell as the input has it.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct InputCell {
    /// The part of the input that it is in, if there are several.
    pub part: Option<String>,
    /// The number of the cell there, from 0, or by which the input knows it.
    pub number: u32,
    /// What cells of its type are called, where not all are tetrahedra.
    pub kind: Option<&'static str>,
}

impl From<u32> for InputCell {
    fn from(number: u32) -> Self {
        Self { number, ..Self::default() }
    }
}

impl fmt::Display for InputCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.number)?;
        let part = self.part.as_ref().map(|part| format!("of {part}"));
        match (part, self.kind) {
            (None, None) => Ok(()),
            (Some(part), None) => write!(f, " {part}"),
            (None, Some(kind)) => write!(f, " ({kind})"),
            (Some(part), Some(kind)) => write!(f, " {part} ({kind})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(cells: &CellNumbers) -> Vec<String> {
        (0..cells.tets as u32).map(|tet| cells.cell_of(tet).to_string()).collect()
    }

    #[test]
    fn points_that_were_added_count_over_all_parts() {
        let part = |name: &str, points: u64, cell: u32| {
            let mut cells = CellNumbers::each(vec![0, 1, 1], 2, vec![(0, "polyhedron")]);
            cells.name_part(name);
            let notes = (points > 0).then_some(Note::Added { points, cell }).into_iter().collect();
            MeshInput { cells, notes, ..MeshInput::default() }
        };
        let mut all = part("piece 0", 0, 0);
        all.append(part("piece 1", 1, 1));
        let one =
            "added: 1 point in cell 1 of piece 1 (polyhedron), with the mean of the values at its corners";
        assert_eq!(all.lines(), [one]);
        all.append(part("piece 2", 3, 0));
        let several = "added: 4 points in the middle of cells and faces, with the mean of the values at their corners (first: \
                       cell 1 of piece 1 (polyhedron))";
        assert_eq!(all.lines(), [several]);
    }

    #[test]
    fn cells_have_the_numbers_of_their_part() {
        let mut all = CellNumbers::same(2);
        all.name_part("piece 0");
        let mut mixed =
            CellNumbers::each(vec![1, 1, 3], 4, vec![(0, "triangle"), (1, "pyramid"), (2, "tetrahedron")]);
        mixed.name_part("piece 1");
        all.append(mixed);
        assert_eq!(
            shown(&all),
            [
                "0 of piece 0 (tetrahedron)",
                "1 of piece 0 (tetrahedron)",
                "1 of piece 1 (pyramid)",
                "1 of piece 1 (pyramid)",
                "3 of piece 1 (tetrahedron)"
            ]
        );
        all.keep(&[1, 4]);
        assert_eq!(shown(&all), ["1 of piece 0 (tetrahedron)", "3 of piece 1 (tetrahedron)"]);
        let mut tets = CellNumbers::same(3);
        tets.append(CellNumbers::same(2));
        assert_eq!(tets, CellNumbers::same(5));
        tets.keep(&[0, 4]);
        assert_eq!(shown(&tets), ["0", "4"]);
        assert_eq!(CellNumbers::equal(2, 6, "cube").cell_of(11).to_string(), "1 (cube)");
    }

    #[test]
    fn what_is_left_out_is_counted_over_all_parts() {
        let mut input = MeshInput::default();
        input.leave_out(0, "line", "lines");
        input.leave_out(1, "hidden cell", "hidden cells");
        input.say("b");
        let mut part = input.clone();
        part.leave_out(2, "line", "lines");
        input.append(part);
        assert_eq!(input.lines(), ["left out: 2 hidden cells, 2 lines", "b"]);
    }
}
