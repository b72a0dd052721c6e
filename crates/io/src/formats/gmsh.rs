//! Gmsh's meshes (`.msh`): versions 2, 4.0 and 4.1, ASCII and binary in either byte order; elements of the first and second
//! order; views at nodes, elements and nodes of elements, with their time steps. Elements without a volume are left out, as are
//! partitions and periodicity. By <https://gmsh.info/doc/texinfo/gmsh.html#Gmsh-file-formats>.
//!
//! The numbers of geometric entities become the field `entity` at cells, those of physical groups `physical`, with their names.

use std::collections::HashMap;

use crate::beside::FilesOf;
use crate::error::{At, ReadError, ReadReason, shown};
use crate::fields::set_time;
use crate::formats::gmsh_layout::{Layout, Numbers, Version};
use crate::formats::gmsh_mesh::Mesh;
use crate::formats::gmsh_sections::{read_elements, read_entities, read_nodes, read_partitions};
use crate::formats::gmsh_views::{self, At as ViewAt, Head, SECTIONS, Steps, View};
use crate::number::NumberType;
use crate::scanner::Scanner;
use crate::{CellData, ReadOptions};
use tetralod::mesh::TetMesh;

/// How files begin, the last one those of version 1.
const FIRST: [&str; 3] = ["$MeshFormat", "$Comments", "$NOD"];

/// Reads a file.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let mut file = Scanner::new(bytes);
    let mut mesh = Mesh::new(options);
    let of_elements = b"$ElementNodeData";
    if bytes.windows(of_elements.len()).any(|window| window == of_elements) {
        mesh.element_nodes = Some(HashMap::new());
    }
    let mut section = String::new();
    let done = loop {
        match file.next_word() {
            Ok(None) => break Ok(()),
            Ok(Some(word)) => word.clone_into(&mut section),
            Err(reason) => break Err(reason),
        }
        if let Err(reason) = mesh.section(&mut file, &section) {
            break Err(reason);
        }
    };
    let in_binary = mesh.layout.is_some_and(|layout| layout.binary);
    done.at(|| {
        let place = if in_binary { file.byte_number() } else { file.line_number() };
        format!("{}, {place}", shown(&section))
    })?;
    mesh.finish()
}

/// The times of the steps in the given file; none if it is of another format. That it cannot be read is for the reader to say.
pub(super) fn times(files: &FilesOf<'_>) -> Vec<f64> {
    if !is_first(&files.head(64)) {
        return Vec::new();
    }
    files.load_given().map_or_else(|_| Vec::new(), |bytes| gmsh_views::times(&bytes))
}

/// Whether a file of this format begins with these bytes.
pub(super) fn is_first(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    FIRST.iter().any(|first| start.starts_with(first.as_bytes()))
}

/// Sections that change neither places nor values.
const HARMLESS: [&str; 6] = [
    "$Comments",
    "$Periodic",
    "$Parametrizations",
    "$GhostElements",
    "$PartitionedEntities",
    "$InterpolationScheme",
];

impl Mesh<'_> {
    fn section(&mut self, file: &mut Scanner<'_>, name: &str) -> Result<(), ReadReason> {
        let missing = || ReadReason::Missing("section $MeshFormat".into());
        let numbers = self.layout.map(|layout| Numbers { file: &mut *file, layout });
        match name {
            "$MeshFormat" => self.layout = Some(read_format(file)?),
            // These sections are of version 1 alone.
            "$NOD" | "$ELM" => return Err(unsupported("1")),
            "$PhysicalNames" => self.read_names(file)?,
            "$Entities" => read_entities(self, &mut numbers.ok_or_else(missing)?)?,
            "$Nodes" => read_nodes(self, &mut numbers.ok_or_else(missing)?)?,
            "$Elements" => read_elements(self, &mut numbers.ok_or_else(missing)?)?,
            "$PartitionedEntities"
                if self.layout.is_some_and(|layout| layout.version == Version::FourOne) =>
            {
                read_partitions(self, &mut numbers.ok_or_else(missing)?)?;
            }
            _ if name.starts_with('$') => {
                let Some((_, at)) = SECTIONS.iter().find(|(known, _)| *known == name) else {
                    return self.skip(file, name);
                };
                return self.view(&mut numbers.ok_or_else(missing)?, *at, name);
            }
            other => return Err(ReadReason::Syntax(format!("\"{}\" instead of a section", shown(other)))),
        }
        expect_end(file, name)
    }

    /// Reads the names of physical groups up to the end of their section, which is text in binary files, too: those of volumes are kept.
    fn read_names(&mut self, file: &mut Scanner<'_>) -> Result<(), ReadReason> {
        for _ in 0..file.number::<u64>()? {
            let [dimension, group] = file.numbers::<i64, 2>()?;
            let line = String::from_utf8_lossy(file.line().trim_ascii()).into_owned();
            if dimension == 3 {
                self.names.push((group, line.trim_matches('"').to_owned()));
            }
        }
        Ok(())
    }

    /// Steps over a section, and notes that it is left out if its content is of use.
    fn skip(&mut self, file: &mut Scanner<'_>, name: &str) -> Result<(), ReadReason> {
        let is_known = HARMLESS.contains(&name) || self.skipped.iter().any(|known| known == name);
        if !is_known && self.skipped.len() < 16 {
            self.skipped.push(name.chars().take(48).collect());
        }
        skip_section(file, name)
    }

    /// Reads a view, if it is wanted.
    fn view(&mut self, numbers: &mut Numbers<'_, '_>, at: ViewAt, section: &str) -> Result<(), ReadReason> {
        let head = gmsh_views::read_head(numbers.file, at)?;
        self.heads.push(head.clone());
        let is_at_cells = at == ViewAt::Elements;
        if is_at_cells && self.draft.options.cells != CellData::Values && !numbers.layout.binary {
            self.views.push(View { head, rows: HashMap::new() });
            return skip_section(numbers.file, section);
        }
        self.views.push(gmsh_views::read_rows(numbers, head)?);
        expect_end(numbers.file, section)
    }

    fn finish(mut self) -> Result<TetMesh, ReadError> {
        if self.nodes.is_empty() {
            return Err(ReadReason::Missing("section $Nodes".into())).at(String::new);
        }
        let steps = Steps::of(&self.heads);
        self.draft.options.expect_step(steps.times.len()).at(String::new)?;
        let step = self.draft.options.step;
        let of_step = std::mem::take(&mut self.views).into_iter().filter(|view| steps.has(&view.head, step));
        for view in gmsh_views::merge(of_step.collect()).at(String::new)? {
            let place = || format!("view \"{}\"", view.head.name);
            self.add_view(&view).at(place)?;
        }
        for (name, values) in
            [("physical", std::mem::take(&mut self.physical)), ("entity", std::mem::take(&mut self.entities))]
        {
            if !values.is_empty() {
                self.draft.at_cells(name, 1, true, || Ok(values)).at(String::new)?;
            }
        }
        let skipped = self.skipped.into_iter().map(|name| format!("section {name} is left out"));
        self.draft.notes.extend(skipped);
        let mut mesh = self.draft.finish().at(|| "$Elements".into())?;
        self.names.iter().for_each(|(group, name)| mesh.input.name_label("physical", *group, name));
        set_time(&mut mesh, steps.times.get(step).copied());
        Ok(mesh)
    }

    /// Makes fields of a view.
    fn add_view(&mut self, view: &View) -> Result<(), ReadReason> {
        let Head { name, components, at, has_scheme, .. } = &view.head;
        match at {
            ViewAt::Nodes => {
                let Some(claim) = self.draft.fields.claim(name, *components)? else { return Ok(()) };
                let values = self.at_nodes(&view.rows, *components)?;
                self.draft.fields.fill(claim, values, false, "")
            }
            ViewAt::Elements => {
                let cells = &self.cell_tags;
                let values =
                    || rows_of(cells.iter().map(|tag| (*tag, true)), &view.rows, *components, "element");
                self.draft.at_cells(name, *components, false, values)
            }
            ViewAt::ElementNodes if *has_scheme => {
                self.draft
                    .notes
                    .push(format!("view \"{name}\" is left out: its values are of an interpolation scheme"));
                Ok(())
            }
            ViewAt::ElementNodes => self.at_nodes_of_elements(view),
        }
    }

    /// Makes a field at nodes of values that each element has at its own.
    fn at_nodes_of_elements(&mut self, view: &View) -> Result<(), ReadReason> {
        let Head { name, components, .. } = &view.head;
        let means = gmsh_views::means(view, self.element_nodes.as_ref().unwrap_or(&HashMap::new()));
        let Ok(values) = self.at_nodes(&means.rows, *components) else {
            self.draft
                .notes
                .push(format!("view \"{name}\" is left out: not all nodes of elements have values"));
            return Ok(());
        };
        if means.differing > 0 {
            let (count, largest) = (means.differing, means.largest);
            self.draft.notes.push(format!(
                "view \"{name}\": elements have different values at {count} nodes (by up to {largest}); their mean is taken"
            ));
        }
        self.draft.at_points(name, *components, false, || Ok(values))
    }

    /// The values at nodes in their order. Nodes that no element with a volume uses need none; theirs are 0.
    fn at_nodes(&self, rows: &HashMap<i64, Vec<f64>>, components: usize) -> Result<Vec<f64>, ReadReason> {
        let mut tags = vec![(0, false); self.nodes.len()];
        self.nodes.iter().for_each(|(tag, index)| tags[*index].0 = *tag);
        let is_used = self.draft.used(tags.len());
        tags.iter_mut().zip(is_used).for_each(|(tag, is_used)| tag.1 = is_used);
        rows_of(tags.into_iter(), rows, components, "node")
    }
}

/// The rows of these nodes or elements, one behind the other; those that are needed must have one.
fn rows_of(
    tags: impl Iterator<Item = (i64, bool)>,
    rows: &HashMap<i64, Vec<f64>>,
    components: usize,
    what: &str,
) -> Result<Vec<f64>, ReadReason> {
    let mut values = Vec::new();
    for (tag, is_needed) in tags {
        match rows.get(&tag) {
            Some(row) if is_needed || row.iter().all(|value| value.is_finite()) => {
                values.extend_from_slice(row)
            }
            None if is_needed => return Err(ReadReason::Missing(format!("the value of {what} {tag}"))),
            _ => values.resize(values.len() + components, 0.0),
        }
    }
    Ok(values)
}

/// Reads the word that ends a section.
fn expect_end(file: &mut Scanner<'_>, name: &str) -> Result<(), ReadReason> {
    let end = file.word()?;
    let expected = format!("$End{}", name.trim_start_matches('$'));
    if end.eq_ignore_ascii_case(&expected) {
        return Ok(());
    }
    Err(ReadReason::Syntax(format!("\"{}\" instead of {expected}", shown(end))))
}

fn read_format(file: &mut Scanner<'_>) -> Result<Layout, ReadReason> {
    let version = match file.word()? {
        "2" | "2.0" | "2.1" | "2.2" => Version::Two,
        "4" | "4.0" => Version::Four,
        "4.1" => Version::FourOne,
        other => return Err(unsupported(other)),
    };
    let binary = file.number::<i32>()? != 0;
    let wide = match file.number::<i32>()? {
        4 => NumberType::U32,
        8 => NumberType::U64,
        other => return Err(ReadReason::Syntax(format!("numbers of {other} bytes"))),
    };
    let mut big = false;
    if binary {
        file.skip_line();
        // A one, for its byte order.
        big = match file.take(Some(4))? {
            [1, 0, 0, 0] => false,
            [0, 0, 0, 1] => true,
            _ => return Err(ReadReason::Damaged("the mark of the byte order is not 1".into())),
        };
    }
    Ok(Layout { version, binary, big, wide })
}

fn unsupported(version: &str) -> ReadReason {
    let what = format!("version \"{}\" of Gmsh's format", shown(version));
    ReadReason::unsupported(what, "save it as version 2.2 or 4.1")
}

/// Steps over a section, which ends with its name behind `$End`.
fn skip_section(file: &mut Scanner<'_>, name: &str) -> Result<(), ReadReason> {
    let end = format!("$End{}", name.trim_start_matches('$'));
    loop {
        if file.rest().is_empty() {
            return Err(ReadReason::Missing(end));
        }
        if file.line().trim_ascii() == end.as_bytes() {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellData;

    fn everything() -> ReadOptions {
        ReadOptions { cells: CellData::Values, ..ReadOptions::default() }
    }

    /// A tetrahedron and a triangle, with tags that are not in order.
    pub(super) const TWO: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"a $b\"\n$EndPhysicalNames\n\
        $Nodes\n4\n7 0 0 0\n2 1 0 0\n9 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n2\n1 2 2 8 3 7 2 9\n5 4 3 6 2 0 7 2 9 4\n\
        $EndElements\n$NodeData\n1\n\"T (K)\"\n1\n0\n3\n0\n1\n4\n4 4\n7 1\n2 2\n9 3\n$EndNodeData\n\
        $ElementData\n1\n\"q\"\n1\n0\n3\n0\n1\n2\n5 0.5\n1 9\n$EndElementData\n";

    fn check(bytes: &[u8]) {
        let mesh = read(bytes, &everything()).unwrap();
        assert_eq!(mesh.positions, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]);
        assert_eq!(mesh.tets, [[0, 1, 2, 3]]);
        let fields: Vec<_> = mesh.fields.iter().map(|f| (f.name.as_str(), f.values.clone())).collect();
        assert_eq!(fields, [("T (K)", vec![1., 2., 3., 4.])]);
        let at_cells: Vec<_> = mesh.cell_fields.iter().map(|f| (f.name.as_str(), f.values[0])).collect();
        assert!(at_cells.contains(&("q", 0.5)) && at_cells.contains(&("entity", 2.0)), "{at_cells:?}");
    }

    fn data(binary: bool, big: bool) -> Vec<u8> {
        let head = "$NodeData\n1\n\"T (K)\"\n1\n0\n3\n0\n1\n4\n";
        let cells = "$EndNodeData\n$ElementData\n1\n\"q\"\n1\n0\n3\n0\n1\n1\n";
        let mut file = head.as_bytes().to_vec();
        for (tag, value) in [(4, 4.), (7, 1.), (2, 2.), (9, 3.)] {
            put_row(&mut file, tag, value, binary, big);
        }
        file.extend(cells.bytes());
        put_row(&mut file, 5, 0.5, binary, big);
        file.extend(b"$EndElementData\n");
        file
    }

    fn put_row(file: &mut Vec<u8>, tag: i32, value: f64, binary: bool, big: bool) {
        if binary {
            file.extend(of(tag.to_be_bytes(), big));
            file.extend(of(value.to_be_bytes(), big));
        } else {
            file.extend(format!("{tag} {value}\n").bytes());
        }
    }

    fn of<const N: usize>(mut bytes: [u8; N], big: bool) -> [u8; N] {
        if !big {
            bytes.reverse();
        }
        bytes
    }

    const NODES: [(i32, [f64; 3]); 4] =
        [(7, [0., 0., 0.]), (2, [1., 0., 0.]), (9, [0., 1., 0.]), (4, [0., 0., 1.])];

    fn binary(version: &str, big: bool) -> Vec<u8> {
        let int = |n: i32| of(n.to_be_bytes(), big).to_vec();
        let size = |n: u64| of(n.to_be_bytes(), big).to_vec();
        let float = |x: f64| of(x.to_be_bytes(), big).to_vec();
        let mut file = format!("$MeshFormat\n{version} 1 8\n").into_bytes();
        file.extend(int(1));
        file.extend(b"\n$EndMeshFormat\n$Nodes\n");
        match version {
            "2.2" => {
                file.extend(b"4\n");
                for (tag, place) in NODES {
                    file.extend(int(tag));
                    place.iter().for_each(|x| file.extend(float(*x)));
                }
                file.extend(b"\n$EndNodes\n$Elements\n2\n");
                for n in [2, 1, 2, 1, 8, 3, 7, 2, 9, 4, 1, 2, 5, 6, 2, 7, 2, 9, 4] {
                    file.extend(int(n));
                }
            }
            "4.0" => {
                [1, 4].iter().for_each(|n| file.extend(size(*n)));
                [2, 3, 1].iter().for_each(|n| file.extend(int(*n)));
                file.extend(size(4));
                for (tag, place) in NODES {
                    file.extend(int(tag));
                    place.iter().chain(&[0.5; 3]).for_each(|x| file.extend(float(*x)));
                }
                file.extend(b"\n$EndNodes\n$Elements\n");
                [2, 2].iter().for_each(|n| file.extend(size(*n)));
                [3, 2, 2].iter().for_each(|n| file.extend(int(*n)));
                file.extend(size(1));
                [1, 7, 2, 9].iter().for_each(|n| file.extend(int(*n)));
                [2, 3, 4].iter().for_each(|n| file.extend(int(*n)));
                file.extend(size(1));
                [5, 7, 2, 9, 4].iter().for_each(|n| file.extend(int(*n)));
            }
            _ => {
                [1, 4, 2, 9].iter().for_each(|n| file.extend(size(*n)));
                [3, 2, 1].iter().for_each(|n| file.extend(int(*n)));
                file.extend(size(4));
                NODES.iter().for_each(|(tag, _)| file.extend(size(*tag as u64)));
                for (_, place) in NODES {
                    place.iter().chain(&[0.5; 3]).for_each(|x| file.extend(float(*x)));
                }
                file.extend(b"\n$EndNodes\n$Elements\n");
                [2, 2, 1, 5].iter().for_each(|n| file.extend(size(*n)));
                [2, 3, 2].iter().for_each(|n| file.extend(int(*n)));
                [1, 1, 7, 2, 9].iter().for_each(|n| file.extend(size(*n)));
                [3, 2, 4].iter().for_each(|n| file.extend(int(*n)));
                [1, 5, 7, 2, 9, 4].iter().for_each(|n| file.extend(size(*n)));
            }
        }
        file.extend(b"\n$EndElements\n");
        file.extend(data(true, big));
        file
    }

    fn ascii() -> [String; 2] {
        let four_one = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n2 0 0 0 1 1 1 0 0\n$EndEntities\n\
            $Nodes\n1 4 2 9\n3 2 0 4\n7\n2\n9\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
            $Elements\n2 2 1 5\n2 3 2 1\n1 7 2 9\n3 2 4 1\n5 7 2 9 4\n$EndElements\n";
        let four = "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Nodes\n1 4\n2 3 1 4\n7 0 0 0 5 5 5\n2 1 0 0 5 5 5\n9 0 1 0 5 5 5\n\
            4 0 0 1 5 5 5\n$EndNodes\n$Elements\n2 2\n3 2 2 1\n1 7 2 9\n2 3 4 1\n5 7 2 9 4\n$EndElements\n";
        [four_one, four].map(str::to_owned)
    }

    #[test]
    fn one_mesh_in_every_version() {
        check(TWO.as_bytes());
        check(TWO.replace('\n', "\r\n").as_bytes());
        for text in ascii() {
            check(&[text.as_bytes(), &data(false, false)].concat());
        }
        for version in ["2.2", "4.0", "4.1"] {
            for big in [false, true] {
                check(&binary(version, big));
            }
        }
        let mesh = read(TWO.as_bytes(), &everything()).unwrap();
        assert!(mesh.cell_fields.iter().any(|f| f.name == "physical" && f.values == [6.0]));
        let named = TWO.replace("$PhysicalNames\n1\n3 1", "$PhysicalNames\n2\n2 6 \"wall\"\n3 6");
        let names = read(named.as_bytes(), &everything()).unwrap().input.label_names;
        assert_eq!(names["physical"], [(6, "a $b".to_owned())].into());
    }

    #[test]
    fn groups_of_volumes_in_version_4() {
        let [four_one, four] = ascii();
        let groups = |text: &str| {
            let mesh = read(text.as_bytes(), &everything()).unwrap();
            mesh.cell_fields.iter().find(|f| f.name == "physical").map(|f| f.values.clone())
        };
        assert_eq!(groups(&four_one), None);
        let in_group = four_one.replace(
            "0 0 0 1\n2 0 0 0 1 1 1 0 0",
            "1 1 0 2\n9 0 0 0 1 5\n\
            8 0 0 0 1 1 1 1 4 2 9 -9\n2 0 0 0 1 1 1 2 -6 3 1 8\n3 0 0 0 1 1 1 0 0",
        );
        assert_eq!(groups(&in_group), Some(vec![6.0]));
        // The volume of the elements is the one that is in no group.
        assert_eq!(groups(&in_group.replace("\n3 2 4 1\n", "\n3 3 4 1\n")), Some(vec![0.0]));
        let entities = "$Entities\n1 0 0 1\n9 0 0 0 1 1 1 0\n2 0 0 0 1 1 1 1 6 0\n$EndEntities\n$Nodes";
        assert_eq!(groups(&four.replacen("$Nodes", entities, 1)), Some(vec![6.0]));
    }

    /// A view's section with these rows.
    fn view(section: &str, name: &str, [time, step, components]: [&str; 3], rows: &[&str]) -> String {
        let count = rows.len();
        let rows = rows.join("\n");
        format!(
            "${section}\n1\n\"{name}\"\n1\n{time}\n3\n{step}\n{components}\n{count}\n{rows}\n$End{section}\n"
        )
    }

    const ROWS: [&str; 4] = ["7 1", "2 2", "9 3", "4 4"];

    #[test]
    fn steps_of_a_view_are_time_steps() {
        let later = |by: &str| ROWS.map(|row| format!("{row}{by}"));
        let rows = later("0");
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let two = [
            TWO,
            &view("NodeData", "T", ["0.5", "1", "1"], &rows),
            &view("NodeData", "T", ["0", "0", "1"], &ROWS),
        ]
        .concat();
        assert_eq!(gmsh_views::times(two.as_bytes()), [0.0, 0.5]);
        let read_step = |step: usize| read(two.as_bytes(), &ReadOptions { step, ..everything() });
        for (step, first, time) in [(0, 1.0, 0.0), (1, 10.0, 0.5)] {
            let mesh = read_step(step).unwrap();
            let names: Vec<&str> = mesh.fields.iter().map(|field| field.name.as_str()).collect();
            // The other view has one step, and holds at all.
            assert_eq!(names, ["T (K)", "T"]);
            assert_eq!((mesh.fields[1].values[0], mesh.fields[1].time), (first, Some(time)));
        }
        assert!(read_step(2).unwrap_err().to_string().contains("time step 2 of 2 is missing"));
        // Steps of one time, as of modes: their numbers are the times.
        let modes = two.replace("1\n0.5\n3", "1\n0\n3");
        assert_eq!(gmsh_views::times(modes.as_bytes()), [0.0, 1.0]);
        let one = read(TWO.as_bytes(), &everything()).unwrap();
        assert_eq!((gmsh_views::times(TWO.as_bytes()).len(), one.fields[0].time), (0, None));
    }

    #[test]
    fn partitions_of_a_view_come_together() {
        let parts = [
            TWO,
            &view("NodeData", "T", ["0", "0", "1"], &ROWS[..2]),
            &view("NodeData", "T", ["0", "0", "1"], &ROWS[2..]),
        ]
        .concat();
        let mesh = read(parts.as_bytes(), &everything()).unwrap();
        assert_eq!((mesh.fields.len(), &mesh.fields[1].values), (2, &vec![1.0, 2.0, 3.0, 4.0]));
        // What has the same nodes is another view of that name.
        let twice = [TWO, &view("NodeData", "T", ["0", "0", "1"], &ROWS).repeat(2)].concat();
        let names: Vec<_> =
            read(twice.as_bytes(), &everything()).unwrap().fields.into_iter().map(|f| f.name).collect();
        assert_eq!(names, ["T (K)", "T", "T_2"]);
    }

    #[test]
    fn values_at_nodes_of_elements() {
        let at = |rows: &[&str]| {
            let file = [TWO, &view("ElementNodeData", "s", ["0", "0", "1"], rows)].concat();
            read(file.as_bytes(), &everything()).unwrap()
        };
        let equal = at(&["5 4 1 2 3 4", "1 3 9 9 9"]);
        assert_eq!(
            (equal.fields[1].name.as_str(), &equal.fields[1].values),
            ("s", &vec![1.0, 2.0, 3.0, 4.0])
        );
        assert!(equal.notes.is_empty());
        let two = TWO.replace("$Elements\n2\n", "$Elements\n3\n6 4 2 6 2 2 7 9 4\n");
        let file =
            [two.as_str(), &view("ElementNodeData", "s", ["0", "0", "1"], &["5 4 1 2 3 4", "6 4 2 1 3 8"])]
                .concat();
        let differing = read(file.as_bytes(), &ReadOptions::default()).unwrap();
        assert_eq!(differing.fields[1].values, [1.0, 2.0, 3.0, 6.0]);
        assert_eq!(
            differing.notes,
            ["view \"s\": elements have different values at 1 nodes (by up to 4); their mean is taken"]
        );
        assert!(at(&["1 3 9 9 9"]).notes[0].contains("view \"s\" is left out"));
    }

    #[test]
    fn nodes_of_no_element_need_no_value() {
        let more = TWO.replace("$Nodes\n4\n", "$Nodes\n5\n11 5 5 5\n");
        let mesh = read(more.as_bytes(), &everything()).unwrap();
        assert_eq!(mesh.fields[0].values, [0.0, 1.0, 2.0, 3.0, 4.0]);
        let not_finite = more.replace("1\n4\n4 4\n", "1\n5\n11 nan\n4 4\n");
        assert_eq!(read(not_finite.as_bytes(), &everything()).unwrap().fields[0].values[0], 0.0);
    }

    #[test]
    fn sections_that_are_left_out_are_said() {
        let more = format!("{TWO}$Periodic\n0\n$EndPeriodic\n$Mine\n1 2\n$EndMine\n");
        assert_eq!(read(more.as_bytes(), &everything()).unwrap().notes, ["section $Mine is left out"]);
    }

    #[test]
    fn partitions_of_volumes_have_their_groups() {
        let [four_one, _] = ascii();
        let section = "$PartitionedEntities\n2\n0\n1 0 0 1\n1 0 9 1 1 0 0 0 1 7\n\
            5 3 2 1 1 0 0 0 1 1 1 1 6 0\n$EndPartitionedEntities\n$Nodes";
        let text = four_one.replacen("$Nodes", section, 1).replace("\n3 2 4 1\n", "\n3 5 4 1\n");
        let mesh = read(text.as_bytes(), &everything()).unwrap();
        let of = |name: &str| mesh.cell_fields.iter().find(|f| f.name == name).map(|f| f.values.clone());
        assert_eq!((of("physical"), of("entity")), (Some(vec![6.0]), Some(vec![2.0])));
    }

    #[test]
    fn no_cut_and_no_bit_flip_panics() {
        let mut files: Vec<Vec<u8>> = vec![TWO.into()];
        files.extend(ascii().map(String::into_bytes));
        files.extend(["2.2", "4.0", "4.1"].map(|version| binary(version, false)));
        for mut file in files {
            (0..file.len()).for_each(|length| drop(read(&file[..length], &everything())));
            for bit in 0..8 * file.len() {
                file[bit / 8] ^= 1 << (bit % 8);
                drop(read(&file, &everything()));
                file[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }

    #[test]
    fn errors_say_where_and_what() {
        let refused = |from: &str, to: &str| {
            assert!(TWO.contains(from));
            read(TWO.replacen(from, to, 1).as_bytes(), &everything()).unwrap_err().to_string()
        };
        assert!(refused("9 0 1 0", "9 0 x 0").contains("$Nodes, line 12: \"x\" is not a number"));
        assert!(
            refused("2.2 0 8", "3.0 0 8").contains("version \"3.0\" of Gmsh's format cannot be read here")
        );
        let first =
            "$NOD\n4\n7 0 0 0\n2 1 0 0\n9 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n1\n5 4 6 2 4 7 2 9 4\n$ENDELM\n";
        let error = read(first.as_bytes(), &everything()).unwrap_err();
        let version = "version \"1\" of Gmsh's format".to_owned();
        let remedy = "save it as version 2.2 or 4.1".into();
        assert_eq!(error.reason, ReadReason::Unsupported { what: version, remedy });
        assert!(refused("7 2 9 4\n", "7 2 9 5\n").contains("node 5 is missing"));
        assert!(refused("5 4 3 6", "5 99 3 6").contains("elements of type 99"));
        assert!(refused("$EndNodes", "$EndNode").contains("instead of $EndNodes"));
        assert!(refused("9 3\n", "8 3\n").contains("view \"T (K)\": the value of node 9 is missing"));
        assert!(refused("\n4\n7 0", "\n4000000000\n7 0").contains("is not a number"));
        assert!(refused("2 1 0 0", "7 1 0 0").contains("node 7 twice"));
    }
}
