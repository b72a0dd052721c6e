//! Gmsh's meshes (`.msh`): versions 1, 2, 4.0 and 4.1, ASCII and binary in either byte order; elements of the first and second
//! order; views at nodes and elements. Elements without a volume are left out, as are partitions and periodicity.
//!
//! The numbers of geometric entities become the field `entity` at cells, those of physical groups `physical`.

use std::collections::HashMap;

use crate::io::ReadOptions;
use crate::io::error::{At, ReadError, ReadReason};
use crate::io::formats::draft::Draft;
use crate::io::formats::gmsh_sections::{read_elements, read_entities, read_nodes};
use crate::io::formats::scanner::Scanner;
use crate::io::number::NumberType;
use crate::mesh::TetMesh;

/// How files begin.
pub(super) const FIRST: [&str; 3] = ["$MeshFormat", "$NOD", "$Comments"];

/// Which of the layouts a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Version {
    One,
    Two,
    Four,
    FourOne,
}

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub version: Version,
    pub binary: bool,
    pub big: bool,
    /// Of version 4.1: the type of counts and tags.
    pub wide: NumberType,
}

/// Reads a file.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let mut file = Scanner::new(bytes);
    let mut mesh = Mesh::new(options);
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
        format!("{}, {place}", section.chars().take(24).collect::<String>())
    })?;
    mesh.finish()
}

/// What was read so far.
pub(super) struct Mesh<'a> {
    layout: Option<Layout>,
    pub draft: Draft<'a>,
    /// The index of each node, by its tag.
    pub nodes: HashMap<i64, usize>,
    /// The tags of the cells that are kept.
    pub cell_tags: Vec<i64>,
    pub entities: Vec<f64>,
    pub physical: Vec<f64>,
    /// The physical group of each volume, by its tag, if it has one; none if no volume has one.
    pub groups: HashMap<i64, Option<i64>>,
    views: Vec<View>,
}

/// Values at nodes or elements.
struct View {
    name: String,
    at_nodes: bool,
    components: usize,
    /// Of each node or element, by its tag.
    rows: HashMap<i64, Vec<f64>>,
}

impl<'a> Mesh<'a> {
    fn new(options: &'a ReadOptions) -> Self {
        Self {
            layout: None,
            draft: Draft::new(options),
            nodes: HashMap::new(),
            cell_tags: Vec::new(),
            entities: Vec::new(),
            physical: Vec::new(),
            groups: HashMap::new(),
            views: Vec::new(),
        }
    }

    fn section(&mut self, file: &mut Scanner<'_>, name: &str) -> Result<(), ReadReason> {
        let missing = || ReadReason::Missing("section $MeshFormat".into());
        match name {
            "$MeshFormat" => self.layout = Some(read_format(file)?),
            "$NOD" | "$ELM" => {
                let wide = NumberType::U64;
                let layout = Layout { version: Version::One, binary: false, big: false, wide };
                self.layout = Some(layout);
                if name == "$NOD" {
                    read_nodes(self, file, layout)?
                } else {
                    read_elements(self, file, layout)?
                }
            }
            "$Entities" => read_entities(self, file, self.layout.ok_or_else(missing)?)?,
            "$Nodes" => read_nodes(self, file, self.layout.ok_or_else(missing)?)?,
            "$Elements" => read_elements(self, file, self.layout.ok_or_else(missing)?)?,
            "$NodeData" | "$ElementData" => {
                let view = read_view(file, self.layout.ok_or_else(missing)?, name == "$NodeData")?;
                self.views.push(view);
            }
            _ if name.starts_with('$') => return skip_section(file, name),
            other => {
                let shown: String = other.chars().take(24).collect();
                return Err(ReadReason::Syntax(format!("\"{shown}\" instead of a section")));
            }
        }
        let end = file.word()?;
        let expected = format!("$End{}", name.trim_start_matches('$'));
        if end.eq_ignore_ascii_case(&expected) {
            return Ok(());
        }
        let shown: String = end.chars().take(24).collect();
        Err(ReadReason::Syntax(format!("\"{shown}\" instead of {expected}")))
    }

    fn finish(mut self) -> Result<TetMesh, ReadError> {
        if self.nodes.is_empty() {
            return Err(ReadReason::Missing("section $Nodes".into())).at(String::new);
        }
        for view in std::mem::take(&mut self.views) {
            let place = || format!("view \"{}\"", view.name);
            let values = self.values(&view).at(place)?;
            let (name, components) = (&view.name, view.components);
            if view.at_nodes {
                self.draft.at_points(name, components, values, false).at(place)?;
            } else {
                self.draft.at_cells(name, components, values, false).at(place)?;
            }
        }
        for (name, values) in [("physical", self.physical), ("entity", self.entities)] {
            if !values.is_empty() {
                self.draft.at_cells(name, 1, values, true).at(String::new)?;
            }
        }
        self.draft.finish().at(|| "$Elements".into())
    }

    /// The values of a view in the order of nodes or cells, all of which must have some.
    fn values(&self, view: &View) -> Result<Vec<f64>, ReadReason> {
        let mut tags = vec![0; self.nodes.len()];
        self.nodes.iter().for_each(|(tag, index)| tags[*index] = *tag);
        let tags = if view.at_nodes { &tags } else { &self.cell_tags };
        let mut values = Vec::with_capacity(tags.len().saturating_mul(view.components).min(1 << 24));
        for tag in tags {
            let row = view.rows.get(tag).ok_or_else(|| {
                let what = if view.at_nodes { "node" } else { "element" };
                ReadReason::Missing(format!("the value of {what} {tag}"))
            })?;
            values.extend_from_slice(row);
        }
        Ok(values)
    }
}

fn read_format(file: &mut Scanner<'_>) -> Result<Layout, ReadReason> {
    let version = match file.word()? {
        "2" | "2.0" | "2.1" | "2.2" => Version::Two,
        "4" | "4.0" => Version::Four,
        "4.1" => Version::FourOne,
        other => {
            let what = format!("version \"{}\"", other.chars().take(24).collect::<String>());
            return Err(ReadReason::Unsupported { what, remedy: "save it as version 2.2 or 4.1".into() });
        }
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

/// A view: its name, time and size, then a row for each node or element.
fn read_view(file: &mut Scanner<'_>, layout: Layout, at_nodes: bool) -> Result<View, ReadReason> {
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
    let reals: usize = file.number()?;
    for _ in 0..reals {
        file.number::<f64>()?;
    }
    let integers: usize = file.number()?;
    let mut sizes = Vec::new();
    for _ in 0..integers {
        sizes.push(file.number::<usize>()?);
    }
    // The step, the components, the rows, and a partition.
    let (Some(&components), Some(&count)) = (sizes.get(1), sizes.get(2)) else {
        return Err(ReadReason::Missing("the size of a view".into()));
    };
    if components == 0 || components > 1 << 10 {
        return Err(ReadReason::TooLarge { what: "components".into(), limit: 1 << 10 });
    }
    if layout.binary {
        file.skip_line();
    }
    let mut rows = HashMap::new();
    for _ in 0..count {
        let row = if layout.binary {
            let tag = file.integers(1, NumberType::I32, layout.big)?[0];
            (tag, file.floats(components, NumberType::F64, layout.big)?)
        } else {
            let tag = file.number()?;
            let values: Result<Vec<f64>, _> = (0..components).map(|_| file.number()).collect();
            (tag, values?)
        };
        rows.insert(row.0, row.1);
    }
    Ok(View { name, at_nodes, components, rows })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::CellData;

    const EVERYTHING: ReadOptions =
        ReadOptions { fields: None, first: false, cells: CellData::Values, step: 0 };

    /// A tetrahedron and a triangle, with tags that are not in order.
    pub(super) const TWO: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"a $b\"\n$EndPhysicalNames\n\
        $Nodes\n4\n7 0 0 0\n2 1 0 0\n9 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n2\n1 2 2 8 3 7 2 9\n5 4 3 6 2 0 7 2 9 4\n\
        $EndElements\n$NodeData\n1\n\"T (K)\"\n1\n0\n3\n0\n1\n4\n4 4\n7 1\n2 2\n9 3\n$EndNodeData\n\
        $ElementData\n1\n\"q\"\n1\n0\n3\n0\n1\n2\n5 0.5\n1 9\n$EndElementData\n";

    fn check(bytes: &[u8]) {
        let mesh = read(bytes, &EVERYTHING).unwrap();
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

    fn ascii() -> [String; 3] {
        let four_one = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n2 0 0 0 1 1 1 0 0\n$EndEntities\n\
            $Nodes\n1 4 2 9\n3 2 0 4\n7\n2\n9\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
            $Elements\n2 2 1 5\n2 3 2 1\n1 7 2 9\n3 2 4 1\n5 7 2 9 4\n$EndElements\n";
        let four = "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Nodes\n1 4\n2 3 1 4\n7 0 0 0 5 5 5\n2 1 0 0 5 5 5\n9 0 1 0 5 5 5\n\
            4 0 0 1 5 5 5\n$EndNodes\n$Elements\n2 2\n3 2 2 1\n1 7 2 9\n2 3 4 1\n5 7 2 9 4\n$EndElements\n";
        let one = "$NOD\n4\n7 0 0 0\n2 1 0 0\n9 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n2\n1 2 8 3 3 7 2 9\n5 4 6 2 4 7 2 9 4\n$ENDELM\n";
        [four_one, four, one].map(str::to_owned)
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
        let mesh = read(TWO.as_bytes(), &EVERYTHING).unwrap();
        assert!(mesh.cell_fields.iter().any(|f| f.name == "physical" && f.values == [6.0]));
    }

    #[test]
    fn groups_of_volumes_in_version_4() {
        let [four_one, four, _] = ascii();
        let groups = |text: &str| {
            let mesh = read(text.as_bytes(), &EVERYTHING).unwrap();
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

    #[test]
    fn no_cut_and_no_bit_flip_panics() {
        let mut files: Vec<Vec<u8>> = vec![TWO.into()];
        files.extend(ascii().map(String::into_bytes));
        files.extend(["2.2", "4.0", "4.1"].map(|version| binary(version, false)));
        for mut file in files {
            (0..file.len()).for_each(|length| drop(read(&file[..length], &EVERYTHING)));
            for bit in 0..8 * file.len() {
                file[bit / 8] ^= 1 << (bit % 8);
                drop(read(&file, &EVERYTHING));
                file[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }

    #[test]
    fn errors_say_where_and_what() {
        let refused = |from: &str, to: &str| {
            assert!(TWO.contains(from));
            read(TWO.replacen(from, to, 1).as_bytes(), &EVERYTHING).unwrap_err().to_string()
        };
        assert!(refused("9 0 1 0", "9 0 x 0").contains("$Nodes, line 12: \"x\" is not a number"));
        assert!(refused("2.2 0 8", "3.0 0 8").contains("version \"3.0\" cannot be read here"));
        assert!(refused("7 2 9 4\n", "7 2 9 5\n").contains("node 5 is missing"));
        assert!(refused("5 4 3 6", "5 99 3 6").contains("elements of type 99"));
        assert!(refused("$EndNodes", "$EndNode").contains("instead of $EndNodes"));
        assert!(refused("9 3\n", "8 3\n").contains("view \"T (K)\": the value of node 9 is missing"));
        assert!(refused("\n4\n7 0", "\n4000000000\n7 0").contains("is not a number"));
        assert!(refused("2 1 0 0", "7 1 0 0").contains("node 7 twice"));
    }
}
