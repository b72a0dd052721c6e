//! Exodus II (`.exo`, `.ex2`, `.e`): blocks of elements with variables at nodes and elements, in netCDF of any version.
//!
//! The faces of polyhedra (`NFACED`) are in blocks of their own. The numbers of blocks become the field `block` at cells. Variables
//! whose names differ in a last letter x, y or z are a vector; six with xx, yy, zz, xy, yz, zx a symmetric tensor, nine any.

use std::collections::{BTreeMap, HashMap};

use netcdf_reader::{NcFile, NcGroup, NcSliceInfo, NcSliceInfoElem, NcVariable};

use crate::ReadOptions;
use crate::cell_types::POLYHEDRON;
use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::fields::{Collector, component_name, set_time};
use crate::formats::draft::Draft;
use crate::formats::exodus_cells::{Element, element};
use crate::formats::hdf5_values::{checked_times, netcdf_reason};
use crate::numbering::Numbering;
use crate::polyhedra::SharedFaces;
use crate::vtu::NumberPoints;
use tetralod::mesh::TetMesh;

/// A file.
pub(super) struct Reader<'a> {
    file: &'a NcFile,
    root: &'a NcGroup,
    /// The variables of the root, by their names: there may be one for each variable of each block.
    variables: HashMap<&'a str, &'a NcVariable>,
    pub times: Vec<f64>,
    options: &'a ReadOptions,
}

/// A block of elements that have a volume.
struct Block {
    /// From 1, in the names of arrays.
    number: usize,
    elements: usize,
    /// How many elements the blocks before it have.
    before: usize,
}

/// What blocks are called, by their numbers.
pub(super) type BlockNames = BTreeMap<i64, String>;

/// The times of the steps; none if there are no steps.
pub(super) fn times(file: &NcFile) -> Result<Vec<f64>, ReadError> {
    Ok(Reader::new(file, &ReadOptions::default())?.times)
}

/// Reads a mesh.
pub(super) fn read(file: &NcFile, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let numbers: NumberPoints<'_> = &mut |points| Ok(Numbering::From { first: 0, points: points.len() });
    Reader::new(file, options)?.mesh(numbers, &mut BlockNames::new())
}

impl<'a> Reader<'a> {
    pub fn new(file: &'a NcFile, options: &'a ReadOptions) -> Result<Self, ReadError> {
        let root = file.root_group().map_err(netcdf_reason).at(String::new)?;
        // The first one of a name counts.
        let variables = root.variables.iter().rev().map(|variable| (variable.name(), variable)).collect();
        let mut reader = Self { file, root, variables, times: Vec::new(), options };
        let times = reader.values_if("time_whole").and_then(|times| checked_times(times.unwrap_or_default()));
        reader.times = times.at(|| "time_whole".into())?;
        Ok(reader)
    }

    /// The same with other options.
    pub fn with<'b>(&self, options: &'b ReadOptions) -> Reader<'b>
    where
        'a: 'b,
    {
        Reader { variables: self.variables.clone(), times: self.times.clone(), options, ..*self }
    }

    /// The mesh, whose points are numbered as `numbers` says. Blocks have the numbers that `known` has for their names, which learns new ones.
    pub fn mesh(&self, numbers: NumberPoints<'_>, known: &mut BlockNames) -> Result<TetMesh, ReadError> {
        let Self { options, times, .. } = self;
        options.expect_step(times.len()).at(String::new)?;
        let mut draft = Draft::new(options);
        draft.coordinates = self.coordinates().at(|| "coordinates".into())?;
        let blocks = self.blocks(&mut draft)?;
        if !times.is_empty() {
            self.variables_at_nodes(&mut draft)?;
            self.variables_at_elements(&blocks, &mut draft)?;
        }
        let of_blocks = self.numbers_of_blocks(&blocks, known).at(|| "eb_prop1".into())?;
        let of_blocks = || blocks.iter().zip(&of_blocks);
        let of_elements =
            of_blocks().flat_map(|(block, number)| std::iter::repeat_n(*number, block.elements));
        draft.at_cells("block", 1, true, || Ok(of_elements.collect())).at(|| "eb_prop1".into())?;
        let own = self.numbers_of_elements(&blocks);
        let finished = match &own {
            None => draft.finish_numbered(numbers).at(|| "element blocks".into()),
            Some(own) => draft
                .finish_numbered(numbers)
                .map_err(|reason| {
                    reason.with_cell(|cell| own.get(cell as usize).map_or(cell, |own| (*own).into()))
                })
                .at(|| "element blocks, numbered by elem_num_map".into()),
        };
        let mut mesh = finished?;
        mesh.input.cells.number_cells(own.unwrap_or_default());
        for (_, number) in of_blocks() {
            let name = known.get(&(*number as i64)).map_or("", String::as_str);
            mesh.input.name_label("block", *number as i64, name);
        }
        set_time(&mut mesh, times.get(options.step).copied());
        Ok(mesh)
    }

    /// How many points there are, and elements of each of VTK's types that have a volume; none of those if that takes more than their types.
    pub fn counts(&self) -> Result<(u64, Option<BTreeMap<i64, u64>>), ReadError> {
        let points = self.root.dimension("num_nodes").map_or(0, |dimension| dimension.size);
        let mut counts = BTreeMap::new();
        for number in self.numbers_behind("connect") {
            let name = format!("connect{number}");
            let (element, _) = self.element(&name).at(|| name.clone())?;
            if let Element::Solid(kind, _) = element {
                let elements = self.variable(&name).at(String::new)?.shape().first().copied().unwrap_or(0);
                *counts.entry(kind).or_insert(0_u64) += elements;
            }
        }
        Ok((points, Some(counts).filter(|_| self.numbers_behind("facconn").is_empty())))
    }

    /// How many fields at points the variables become that are wanted.
    pub fn count_fields(&self) -> Result<u64, ReadError> {
        let place = || "name_nod_var".to_owned();
        let names = if self.times.is_empty() { Vec::new() } else { self.names("name_nod_var").at(place)? };
        let mut collector = Collector::new(self.options);
        for (name, parts) in joined(&names) {
            if let Some(claim) = collector.claim(&name, parts.len()).at(place)? {
                collector.keep_names(claim, "");
            }
        }
        Ok(collector.fields.len() as u64)
    }

    /// The numbers of the nodes in the whole that this file is a piece of, if it says so.
    pub fn numbers_of_nodes(&self) -> Result<Option<Vec<i64>>, ReadReason> {
        let Some(numbers) = self.values_if("node_num_map")? else { return Ok(None) };
        let numbers: Vec<i64> = numbers.into_iter().map(|number| number as i64).collect();
        let mut sorted = numbers.clone();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(ReadReason::Syntax(format!("node {} is there twice", pair[0])));
        }
        Ok(Some(numbers))
    }

    /// What users number the elements of blocks with, if the file says so.
    fn numbers_of_elements(&self, blocks: &[Block]) -> Option<Vec<u32>> {
        // What cannot be read of them is no part of the mesh.
        let known = self.values_if("elem_num_map").ok()??;
        let of_block = |block: &Block| known.get(block.before..block.before + block.elements);
        let all = blocks.iter().map(of_block).collect::<Option<Vec<_>>>()?;
        let number = |x: &f64| Some(*x as u32).filter(|number| f64::from(*number) == *x);
        all.concat().iter().map(number).collect()
    }

    fn has(&self, name: &str) -> bool {
        self.variables.contains_key(name)
    }

    fn variable(&self, name: &str) -> Result<&NcVariable, ReadReason> {
        let variable = self.variables.get(name).copied();
        variable.ok_or_else(|| ReadReason::Missing(format!("variable \"{name}\"")))
    }

    fn size(&self, name: &str) -> Result<u64, ReadReason> {
        let dimension = self.root.dimension(name);
        let missing = || {
            ReadReason::unsupported(
                format!("a file in HDF5 or netCDF without \"{name}\", so neither VTKHDF nor Exodus,"),
                "give one of these, or save it as .vtu",
            )
        };
        dimension.map(|dimension| dimension.size).ok_or_else(missing)
    }

    /// All values of a variable with these first indices.
    fn values(&self, name: &str, first: &[u64]) -> Result<Vec<f64>, ReadReason> {
        let variable = self.variable(name)?;
        let mut selection = NcSliceInfo::all(variable.ndim());
        if first.len() > selection.selections.len() {
            return Err(ReadReason::Syntax(format!("variable \"{name}\" has too few dimensions")));
        }
        for (of, index) in selection.selections.iter_mut().zip(first) {
            *of = NcSliceInfoElem::Index(*index);
        }
        let values = self.file.read_variable_slice_as_f64(name, &selection).map_err(netcdf_reason)?;
        Ok(values.into_iter().collect())
    }

    fn values_if(&self, name: &str) -> Result<Option<Vec<f64>>, ReadReason> {
        self.has(name).then(|| self.values(name, &[])).transpose()
    }

    /// The coordinates of all points, of one point behind the other.
    pub fn coordinates(&self) -> Result<Vec<f64>, ReadReason> {
        let axes = self.size("num_dim")?;
        if axes != 3 {
            let what = format!("a mesh in {axes} dimensions");
            return Err(ReadReason::unsupported(what, "give a mesh of volumes"));
        }
        // Old files have one array.
        let mut along = Vec::new();
        for (axis, name) in (0..).zip(["coordx", "coordy", "coordz"]) {
            let is_old = self.has("coord");
            along.push(if is_old { self.values("coord", &[axis])? } else { self.values(name, &[])? });
        }
        let points = along[0].len();
        along.iter().try_for_each(|axis| expect_count("coordinates along an axis", points, axis.len()))?;
        Ok((0..points).flat_map(|i| along.iter().map(move |axis| axis[i])).collect())
    }

    /// Reads the blocks of elements. What has no volume is left out.
    fn blocks(&self, draft: &mut Draft<'_>) -> Result<Vec<Block>, ReadError> {
        let [ordinary, polyhedra] = ["connect", "facconn"].map(|start| self.numbers_behind(start));
        let mut faces = SharedFaces::default();
        if !polyhedra.is_empty() {
            faces = self.faces().at(|| "fbconn".into())?;
        }
        let ordinary = ordinary.into_iter().map(|number| (number, "connect"));
        let mut numbers: Vec<_> =
            ordinary.chain(polyhedra.into_iter().map(|number| (number, "facconn"))).collect();
        numbers.sort_unstable();
        let (mut blocks, mut before) = (Vec::new(), 0);
        for (number, start) in numbers {
            let name = format!("{start}{number}");
            let cells = draft.cells();
            let elements = if start == "connect" {
                self.block(&name, draft).at(|| name.clone())?
            } else {
                self.polyhedra(number, &mut faces, draft).at(|| name.clone())?
            };
            if draft.cells() > cells {
                blocks.push(Block { number, elements, before });
            }
            before += elements;
        }
        Ok(blocks)
    }

    /// The numbers of the variables whose names begin so.
    fn numbers_behind(&self, start: &str) -> Vec<usize> {
        let number = |name: &str| name.strip_prefix(start)?.parse::<usize>().ok();
        let mut numbers: Vec<usize> =
            self.root.variables.iter().filter_map(|variable| number(variable.name())).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    /// Numbers that count from 1, from 0 on.
    fn counted_from_zero(&self, name: &str) -> Result<Vec<i64>, ReadReason> {
        Ok(self.values(name, &[])?.into_iter().map(|number| (number as i64).saturating_sub(1)).collect())
    }

    /// Where each of some parts ends in a list, from how long they are, behind others.
    fn ends(&self, name: &str, before: i64) -> Result<Vec<i64>, ReadReason> {
        let mut end = before;
        let counts = self.values(name, &[])?.into_iter();
        Ok(counts
            .map(|count| {
                end = end.saturating_add(count as i64);
                end
            })
            .collect())
    }

    /// The faces of all blocks of them.
    fn faces(&self) -> Result<SharedFaces, ReadReason> {
        let mut faces = SharedFaces::default();
        for number in self.numbers_behind("fbconn") {
            faces.ends.extend(self.ends(&format!("fbepecnt{number}"), faces.connectivity.len() as i64)?);
            faces.connectivity.extend(self.counted_from_zero(&format!("fbconn{number}"))?);
        }
        Ok(faces)
    }

    /// Reads a block of polyhedra, which have some of these faces; returns how many.
    fn polyhedra(
        &self,
        number: usize,
        faces: &mut SharedFaces,
        draft: &mut Draft<'_>,
    ) -> Result<usize, ReadReason> {
        faces.of_cells = self.counted_from_zero(&format!("facconn{number}"))?;
        faces.cell_ends = self.ends(&format!("ebepecnt{number}"), 0)?;
        let lists = faces.lists()?;
        let mut start = 0;
        for &end in &lists.ends {
            let end = end as usize;
            draft.add_cell(POLYHEDRON, lists.numbers[start..end].iter().copied());
            start = end;
        }
        Ok(lists.ends.len())
    }

    /// What the elements of a block are, and how many points each has.
    fn element(&self, name: &str) -> Result<(Element, usize), ReadReason> {
        let variable = self.variable(name)?;
        let kind = variable.attribute("elem_type").and_then(|kind| kind.value.as_string());
        let kind = kind.ok_or_else(|| ReadReason::Missing("attribute elem_type".into()))?;
        let kind = kind.trim_end_matches('\0');
        let shape = variable.shape();
        let points = shape.get(1).map_or(1, |points| usize::try_from(*points).unwrap_or(usize::MAX));
        let unknown = || {
            ReadReason::unsupported(
                format!("a block of elements \"{kind}\" of {points} points"),
                "save the mesh with tetrahedra, hexahedra, wedges and pyramids of the first or second order",
            )
        };
        Ok((element(kind, points).ok_or_else(unknown)?, points))
    }

    /// Reads a block, if its elements have a volume; returns how many it has.
    fn block(&self, name: &str, draft: &mut Draft<'_>) -> Result<usize, ReadReason> {
        let (element, points) = self.element(name)?;
        let Element::Solid(cell, order) = element else {
            let elements = self.variable(name)?.shape().first().copied().unwrap_or(0);
            return Ok(usize::try_from(elements).unwrap_or(usize::MAX));
        };
        let list = self.values(name, &[])?;
        for of_element in list.chunks_exact(points) {
            // They are numbered from 1.
            draft.add_cell(cell, order.iter().map(|&p| (of_element[p] as i64).saturating_sub(1)));
        }
        Ok(list.len() / points)
    }

    /// The numbers of blocks, by which users know them. A block of another piece has its number there.
    fn numbers_of_blocks(&self, blocks: &[Block], known: &mut BlockNames) -> Result<Vec<f64>, ReadReason> {
        let stated = self.values_if("eb_prop1")?.unwrap_or_default();
        // What cannot be read of them is no part of the mesh.
        let names = self.names("eb_names").unwrap_or_default();
        let earlier = known.clone();
        let mut numbers = Vec::with_capacity(blocks.len());
        for block in blocks {
            let at = block.number.wrapping_sub(1);
            let mut number = stated.get(at).copied().unwrap_or(block.number as f64);
            if let Some(name) = names.get(at).filter(|name| !name.is_empty()) {
                let other = earlier.get(&(number as i64)).filter(|other| *other != name);
                match earlier.iter().find(|(_, earlier)| *earlier == name) {
                    Some((there, _)) if !earlier.contains_key(&(number as i64)) || other.is_some() => {
                        number = *there as f64;
                    }
                    None if let Some(other) = other => {
                        let what = format!(
                            "block {number} is called \"{name}\", but \"{other}\" in an earlier piece"
                        );
                        return Err(ReadReason::Syntax(what));
                    }
                    _ => drop(known.insert(number as i64, name.clone())),
                }
            }
            numbers.push(number);
        }
        Ok(numbers)
    }

    /// The names in an array of text.
    pub fn names(&self, name: &str) -> Result<Vec<String>, ReadReason> {
        if !self.has(name) {
            return Ok(Vec::new());
        }
        let names = self.file.read_variable_as_strings(name).map_err(netcdf_reason)?;
        let trimmed = |name: String| name.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_owned();
        Ok(names.into_iter().map(trimmed).collect())
    }

    fn variables_at_nodes(&self, draft: &mut Draft<'_>) -> Result<(), ReadError> {
        let names = self.names("name_nod_var").at(|| "name_nod_var".into())?;
        let points = draft.coordinates.len() / 3;
        for (name, parts) in joined(&names) {
            let place = || format!("variable \"{name}\" at nodes");
            let read = |part: usize| {
                // Old files have one array.
                let values = if self.has("vals_nod_var") {
                    self.values("vals_nod_var", &[self.options.step as u64, part as u64])?
                } else {
                    self.values(&format!("vals_nod_var{}", part + 1), &[self.options.step as u64])?
                };
                expect(points, values)
            };
            draft.at_points(&name, parts.len(), false, || interleaved(&parts, read)).at(place)?;
        }
        Ok(())
    }

    fn variables_at_elements(&self, blocks: &[Block], draft: &mut Draft<'_>) -> Result<(), ReadError> {
        let names = self.names("name_elem_var").at(|| "name_elem_var".into())?;
        for (name, parts) in joined(&names) {
            let place = || format!("variable \"{name}\" at elements");
            // Blocks need not have each variable; what they do not have is 0.
            let read = |part: usize| {
                let mut values = Vec::new();
                for block in blocks {
                    let array = format!("vals_elem_var{}eb{}", part + 1, block.number);
                    if self.has(&array) {
                        values.extend(expect(
                            block.elements,
                            self.values(&array, &[self.options.step as u64])?,
                        )?);
                    } else {
                        values.resize(values.len() + block.elements, 0.0);
                    }
                }
                Ok(values)
            };
            draft.at_cells(&name, parts.len(), false, || interleaved(&parts, read)).at(place)?;
        }
        Ok(())
    }
}

fn expect(expected: usize, values: Vec<f64>) -> Result<Vec<f64>, ReadReason> {
    expect_count("values", expected, values.len())?;
    Ok(values)
}

/// The values of the parts of a vector, of one tuple behind the other.
fn interleaved(
    parts: &[usize],
    read: impl Fn(usize) -> Result<Vec<f64>, ReadReason>,
) -> Result<Vec<f64>, ReadReason> {
    let arrays = parts.iter().map(|&part| read(part)).collect::<Result<Vec<_>, _>>()?;
    if let [_] = arrays.as_slice() {
        return Ok(arrays.into_iter().flatten().collect());
    }
    let tuples = arrays.iter().map(Vec::len).min().unwrap_or(0);
    Ok((0..tuples).flat_map(|i| arrays.iter().map(move |array| array[i])).collect())
}

/// The variables with the numbers of their arrays, those of a tensor or vector together, in the order of its components.
fn joined(names: &[String]) -> Vec<(String, Vec<usize>)> {
    let mut list = Vec::new();
    let mut at = 0;
    while let Some(name) = names.get(at) {
        let whole = [9, 6, 3].into_iter().find_map(|count| whole(names.get(at..at + count)?));
        let (name, parts) = whole.unwrap_or((name, vec![0]));
        list.push((name.to_owned(), parts.iter().map(|part| at + part).collect()));
        at += parts.len();
    }
    list
}

/// The name of the tensor or vector whose components have these names, and which of them is which component.
fn whole(names: &[String]) -> Option<(&str, Vec<usize>)> {
    let letters = if names.len() == 3 { 1 } else { 2 };
    let parts: Option<Vec<_>> =
        names.iter().map(|name| name.split_at_checked(name.len().checked_sub(letters)?)).collect();
    let parts = parts?;
    let first = parts.first()?.0;
    let endings: Vec<_> = parts.iter().map(|(_, ending)| ending.to_ascii_lowercase()).collect();
    let place = |c: usize| {
        let wanted = component_name(names.len(), c);
        // Of a symmetric tensor either half is written.
        let mirrored: String = wanted.chars().rev().collect();
        endings.iter().position(|ending| *ending == wanted || names.len() == 6 && *ending == mirrored)
    };
    let order: Vec<usize> = (0..names.len()).map(place).collect::<Option<_>>()?;
    let stem = first.trim_end_matches(['_', '-', '.', ' ']);
    let is_one = parts.iter().all(|(start, _)| *start == first) && !stem.is_empty();
    is_one.then_some((stem, order))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &[&str]) -> Vec<(String, Vec<usize>)> {
        joined(&list.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn components_are_joined_and_nothing_else() {
        let of = |name: &str, parts: &[usize]| (name.to_owned(), parts.to_vec());
        assert_eq!(names(&["T", "DISPLX", "DISPLY", "DISPLZ"]), [of("T", &[0]), of("DISPL", &[1, 2, 3])]);
        assert_eq!(names(&["vel_x", "vel_y", "vel_z", "ü"]), [of("vel", &[0, 1, 2]), of("ü", &[3])]);
        assert_eq!(names(&["x", "y", "z"]), [of("x", &[0]), of("y", &[1]), of("z", &[2])]);
        let stress = ["Sxx", "Syy", "Szz", "Sxy", "Syz", "Szx"];
        assert_eq!(names(&stress), [of("S", &[0, 1, 2, 3, 4, 5])]);
        assert_eq!(names(&["S_XX", "S_YY", "S_ZZ", "S_XY", "S_YZ", "S_XZ", "p"]).len(), 2);
        assert_eq!(names(&stress[..5]).len(), 5);
        let by_rows = ["sxx", "sxy", "sxz", "syy", "syz", "szz"];
        assert_eq!(names(&by_rows), [of("s", &[0, 3, 5, 1, 4, 2])]);
        let nine = ["g_xx", "g_xy", "g_xz", "g_yx", "g_yy", "g_yz", "g_zx", "g_zy", "g_zz"];
        assert_eq!(names(&nine), [of("g", &[0, 1, 2, 3, 4, 5, 6, 7, 8])]);
        assert_eq!(names(&["vz", "vx", "vy"]), [of("v", &[1, 2, 0])]);
        assert_eq!(names(&["ax", "ay", "bz"]).len(), 3);
        assert_eq!(names(&["ax", "ay"]).len(), 2);
        assert_eq!(names(&["", "", ""]).len(), 3);
    }
}
