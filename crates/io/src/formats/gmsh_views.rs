//! The views of Gmsh's meshes: values at nodes, elements, and nodes of elements, and their time steps.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::error::ReadReason;
use crate::formats::gmsh_layout::Numbers;
use crate::scanner::Scanner;
use tetralod::geom::bits_of;

/// What the values of a view are at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum At {
    Nodes,
    Elements,
    /// Each element has values of its own at its nodes.
    ElementNodes,
}

/// The sections of views.
pub(super) const SECTIONS: [(&str, At); 3] =
    [("$NodeData", At::Nodes), ("$ElementData", At::Elements), ("$ElementNodeData", At::ElementNodes)];

/// What is before the rows of a section.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Head {
    pub name: String,
    pub at: At,
    /// Whether values are coefficients of a scheme of interpolation.
    pub has_scheme: bool,
    time: Option<f64>,
    step: i64,
    pub components: usize,
    count: usize,
}

impl Head {
    /// The bits of the time, to look it up.
    fn time_bits(&self) -> Option<u64> {
        self.time.map(bits_of)
    }
}

/// The rows of a view at one time.
pub(super) struct View {
    pub head: Head,
    /// Of each node or element, by its tag.
    pub rows: HashMap<i64, Vec<f64>>,
}

/// Reads what is before the rows: names, times, and sizes.
pub(super) fn read_head(file: &mut Scanner<'_>, at: At) -> Result<Head, ReadReason> {
    let mut name = String::new();
    let strings: usize = file.number()?;
    file.skip_line();
    for i in 0..strings {
        if file.rest().is_empty() {
            return Err(ReadReason::Truncated { needed: strings as u64, found: i as u64 });
        }
        let line = String::from_utf8_lossy(file.line().trim_ascii()).trim_matches('"').to_owned();
        if i == 0 {
            name = line;
        }
    }
    let mut time = None;
    for _ in 0..file.number::<usize>()? {
        let real = file.number::<f64>()?;
        time = time.or(Some(real));
    }
    let mut sizes = Vec::new();
    for _ in 0..file.number::<usize>()? {
        sizes.push(file.number::<i64>()?);
    }
    // The step, the components, the rows, and a partition.
    let size = |i: usize| sizes.get(i).and_then(|size| usize::try_from(*size).ok());
    let (Some(components), Some(count)) = (size(1), size(2)) else {
        return Err(ReadReason::Missing("the size of a view".into()));
    };
    if components == 0 || components > 1 << 10 {
        return Err(ReadReason::TooLarge { what: "components".into(), limit: 1 << 10 });
    }
    let step = sizes.first().copied().unwrap_or(0);
    let time = time.filter(|time| time.is_finite());
    Ok(Head { name, at, has_scheme: strings > 1, time, step, components, count })
}

/// Reads the rows of a view.
pub(super) fn read_rows(numbers: &mut Numbers<'_, '_>, head: Head) -> Result<View, ReadReason> {
    numbers.end_line();
    let mut rows = HashMap::new();
    for _ in 0..head.count {
        let tag = numbers.int()?;
        let nodes = if head.at == At::ElementNodes { numbers.int()? } else { 1 };
        let nodes = usize::try_from(nodes).map_err(|_| ReadReason::Syntax(format!("{nodes} nodes")))?;
        rows.insert(tag, numbers.floats(nodes.saturating_mul(head.components))?);
    }
    Ok(View { head, rows })
}

/// The times of the steps in a file; fewer than two if its views have no steps. Nothing but the heads of views is read.
pub(super) fn times(bytes: &[u8]) -> Vec<f64> {
    let mut heads = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.iter().position(|c| *c == b'$') {
        rest = &rest[at..];
        let line = &rest[..rest.len().min(24)];
        let section = SECTIONS.iter().find(|(name, _)| {
            line.strip_prefix(name.as_bytes())
                .is_some_and(|after| after.starts_with(b"\n") || after.starts_with(b"\r\n"))
        });
        if let Some((name, at)) = section {
            // What only looks like a section is refused or passed over when the file is read.
            heads.extend(read_head(&mut Scanner::new(&rest[name.len()..]), *at));
        }
        rest = &rest[1..];
    }
    Steps::of(&heads).times
}

/// The time steps of the views in a file.
pub(super) struct Steps {
    pub times: Vec<f64>,
    /// Whether the number of a step stands for its time.
    by_number: bool,
    /// How many steps each view has.
    counts: BTreeMap<(At, String), usize>,
}

impl Steps {
    /// The steps of views with these heads. Where one has several steps without times that differ, their numbers are the times.
    pub fn of(heads: &[Head]) -> Self {
        // Of each view the numbers of its steps, with the bits of their times.
        type OfView = HashSet<(i64, Option<u64>)>;
        let mut steps: BTreeMap<(At, String), OfView> = BTreeMap::new();
        for head in heads {
            // Partitions of a view are of one step, as are other views of the same name.
            steps.entry((head.at, head.name.clone())).or_default().insert((head.step, head.time_bits()));
        }
        let same_time = |of_view: &OfView| {
            of_view.iter().map(|(_, time)| time).collect::<HashSet<_>>().len() < of_view.len()
        };
        let by_number = steps.values().any(same_time);
        let time = |(step, time): &(i64, Option<u64>)| {
            if by_number { *step as f64 } else { time.map_or(0.0, f64::from_bits) }
        };
        let of_several = steps.values().filter(|of_view| of_view.len() > 1);
        let mut times: Vec<f64> = of_several.flatten().map(time).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let counts = steps.into_iter().map(|(view, of_view)| (view, of_view.len())).collect();
        Self { times, by_number, counts }
    }

    /// Whether a view has values at this step. Those of a view with one step hold at all.
    pub fn has(&self, head: &Head, step: usize) -> bool {
        if self.counts.get(&(head.at, head.name.clone())).is_none_or(|count| *count < 2) {
            return true;
        }
        let time = if self.by_number { head.step as f64 } else { head.time.unwrap_or(0.0) };
        self.times.get(step) == Some(&time)
    }
}

/// The most views with one name at one step.
const MAX_ALIKE: usize = 1 << 10;

/// Puts together the parts of a view that are of one step: partitions have rows of different nodes or elements.
pub(super) fn merge(views: Vec<View>) -> Result<Vec<View>, ReadReason> {
    let mut merged: Vec<View> = Vec::new();
    let mut alike: HashMap<_, Vec<usize>> = HashMap::new();
    for view in views {
        let Head { at, name, components, step, .. } = &view.head;
        let places = alike.entry((*at, name.clone(), *components, *step, view.head.time_bits())).or_default();
        let is_apart = |&&place: &&usize| {
            let known: &View = &merged[place];
            !view.rows.keys().any(|tag| known.rows.contains_key(tag))
        };
        match places.iter().find(is_apart).copied() {
            Some(place) => merged[place].rows.extend(view.rows),
            None if places.len() == MAX_ALIKE => {
                let what = format!("views \"{name}\" at one time step");
                return Err(ReadReason::TooLarge { what, limit: MAX_ALIKE as u64 });
            }
            None => {
                places.push(merged.len());
                merged.push(view);
            }
        }
    }
    Ok(merged)
}

/// Values at nodes of elements as values at nodes.
pub(super) struct Means {
    /// The mean of each node's values; none where it has none.
    pub rows: HashMap<i64, Vec<f64>>,
    /// How many nodes have values that differ, and the largest difference.
    pub differing: usize,
    pub largest: f64,
}

/// The means of the values at each node; `nodes` has the tags of the nodes of each element.
pub(super) fn means(view: &View, nodes: &HashMap<i64, Vec<i64>>) -> Means {
    let components = view.head.components;
    // Sums, least and greatest values, and how many.
    type OfNode = (Vec<f64>, Vec<[f64; 2]>, usize);
    let mut sums: HashMap<i64, OfNode> = HashMap::new();
    // In the order of tags: sums must not depend on that of a table.
    let mut tags: Vec<&i64> = view.rows.keys().collect();
    tags.sort_unstable();
    for tag in tags {
        let (Some(of_element), Some(row)) = (nodes.get(tag), view.rows.get(tag)) else { continue };
        for (node, values) in of_element.iter().zip(row.chunks_exact(components)) {
            let entry = sums.entry(*node).or_insert_with(|| {
                (vec![0.0; components], values.iter().map(|value| [*value; 2]).collect(), 0)
            });
            for ((sum, [least, greatest]), value) in entry.0.iter_mut().zip(&mut entry.1).zip(values) {
                *sum += value;
                (*least, *greatest) = (least.min(*value), greatest.max(*value));
            }
            entry.2 += 1;
        }
    }
    let mut means = Means { rows: HashMap::new(), differing: 0, largest: 0.0 };
    for (node, (sum, ranges, count)) in sums {
        let difference = ranges.iter().map(|[least, greatest]| greatest - least).fold(0.0, f64::max);
        means.differing += usize::from(difference > 0.0);
        means.largest = means.largest.max(difference);
        // Equal values stay as they are, without rounding.
        let mean = |(sum, [least, greatest]): (f64, [f64; 2])| {
            if least == greatest { least } else { sum / count as f64 }
        };
        means.rows.insert(node, sum.into_iter().zip(ranges).map(mean).collect());
    }
    means
}
