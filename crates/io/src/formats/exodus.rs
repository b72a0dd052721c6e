//! Exodus II (`.exo`, `.ex2`, `.e`): blocks of elements with variables at nodes and elements, in netCDF of any version.
//!
//! The faces of polyhedra (`NFACED`) are in blocks of their own. The numbers of blocks become the field `block` at cells. Variables
//! whose names differ in a last letter x, y or z are a vector; six with xx, yy, zz, xy, yz, zx a symmetric tensor, nine any.

use std::collections::HashMap;

use netcdf_reader::{NcFile, NcGroup, NcSliceInfo, NcSliceInfoElem, NcVariable};

use crate::ReadOptions;
use crate::cell_types::POLYHEDRON;
use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::fields::component_name;
use crate::formats::draft::Draft;
use crate::formats::exodus_cells::{Element, element};
use crate::formats::hdf5_values::{checked_times, netcdf_reason};
use crate::polyhedra::SharedFaces;
use tetralod::mesh::TetMesh;

/// A file.
struct Reader<'a> {
    file: &'a NcFile,
    root: &'a NcGroup,
    /// The variables of the root, by their names: there may be one for each variable of each block.
    variables: HashMap<&'a str, &'a NcVariable>,
    step: u64,
}

/// A block of elements that have a volume.
struct Block {
    /// From 1, in the names of arrays.
    number: usize,
    elements: usize,
}

/// The times of the steps; none if there are no steps.
pub(super) fn times(file: &NcFile) -> Result<Vec<f64>, ReadError> {
    let reader = Reader::new(file, 0).at(String::new)?;
    let times = reader.values_if("time_whole").and_then(|times| checked_times(times.unwrap_or_default()));
    times.at(|| "time_whole".into())
}

/// Reads a mesh.
pub(super) fn read(file: &NcFile, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let times = times(file)?;
    options.expect_step(times.len()).at(String::new)?;
    let reader = Reader::new(file, options.step as u64).at(String::new)?;
    let mut draft = Draft::new(options);
    draft.coordinates = reader.coordinates().at(|| "coordinates".into())?;
    let blocks = reader.blocks(&mut draft)?;
    if !times.is_empty() {
        reader.variables_at_nodes(&mut draft)?;
        reader.variables_at_elements(&blocks, &mut draft)?;
    }
    let numbers = reader.numbers_of_blocks(&blocks).at(|| "eb_prop1".into())?;
    let of_blocks = || blocks.iter().zip(&numbers);
    let of_elements = of_blocks().flat_map(|(block, number)| std::iter::repeat_n(*number, block.elements));
    draft.at_cells("block", 1, true, || Ok(of_elements.collect())).at(|| "eb_prop1".into())?;
    let mut mesh = draft.finish().at(|| "element blocks".into())?;
    // What cannot be read of them is no part of the mesh.
    let names = reader.names("eb_names").unwrap_or_default();
    for (block, number) in of_blocks() {
        let name = names.get(block.number.wrapping_sub(1)).map_or("", String::as_str);
        mesh.input.name_label("block", *number as i64, name);
    }
    let time = times.get(options.step).copied();
    mesh.fields.iter_mut().chain(&mut mesh.cell_fields).for_each(|field| field.time = time);
    Ok(mesh)
}

impl<'a> Reader<'a> {
    fn new(file: &'a NcFile, step: u64) -> Result<Self, ReadReason> {
        let root = file.root_group().map_err(netcdf_reason)?;
        // The first one of a name counts.
        let variables = root.variables.iter().rev().map(|variable| (variable.name(), variable)).collect();
        Ok(Self { file, root, variables, step })
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

    fn coordinates(&self) -> Result<Vec<f64>, ReadReason> {
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
        let mut blocks = Vec::new();
        for (number, start) in numbers {
            let name = format!("{start}{number}");
            let elements = if start == "connect" {
                self.block(&name, draft).at(|| name.clone())?
            } else {
                Some(self.polyhedra(number, &mut faces, draft).at(|| name.clone())?)
            };
            blocks.extend(elements.map(|elements| Block { number, elements }));
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

    /// Reads a block; returns how many elements it has, or none if they have no volume.
    fn block(&self, name: &str, draft: &mut Draft<'_>) -> Result<Option<usize>, ReadReason> {
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
        let Element::Solid(cell, order) = element(kind, points).ok_or_else(unknown)? else { return Ok(None) };
        let list = self.values(name, &[])?;
        for of_element in list.chunks_exact(points) {
            // They are numbered from 1.
            draft.add_cell(cell, order.iter().map(|&p| (of_element[p] as i64).saturating_sub(1)));
        }
        Ok(Some(list.len() / points))
    }

    /// The numbers of blocks, by which users know them.
    fn numbers_of_blocks(&self, blocks: &[Block]) -> Result<Vec<f64>, ReadReason> {
        let known = self.values_if("eb_prop1")?.unwrap_or_default();
        let number =
            |block: &Block| known.get(block.number.wrapping_sub(1)).copied().unwrap_or(block.number as f64);
        Ok(blocks.iter().map(number).collect())
    }

    /// The names in an array of text.
    fn names(&self, name: &str) -> Result<Vec<String>, ReadReason> {
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
                    self.values("vals_nod_var", &[self.step, part as u64])?
                } else {
                    self.values(&format!("vals_nod_var{}", part + 1), &[self.step])?
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
                        values.extend(expect(block.elements, self.values(&array, &[self.step])?)?);
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
