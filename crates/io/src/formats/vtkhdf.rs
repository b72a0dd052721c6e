//! VTK's data sets in HDF5 (`.vtkhdf`, `.hdf`): unstructured grids, in pieces or not, and image data, with or without time steps.
//!
//! Pieces meet as those of a `.pvtu`.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

use hdf5_reader::{Dataset, Hdf5File};

use crate::cell_types;
use crate::cells::{self, CellList, Indices};
use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::fields::{Collector, check_finite, check_finite_cells, set_time};
use crate::formats::hdf5_values::{
    all_integers, attribute_values, checked_times, floats, integers, number_kind, reason, row_length, rows,
};
use crate::ghosts::{GHOST_TYPE, HIDDEN_POINT};
use crate::grid::{self, Extent, Ghosts, GridValues, Placement};
use crate::grid_parts::cubes_of;
use crate::number::points_from;
use crate::numbering::Numbering;
use crate::polyhedra::{FaceLists, SharedFaces};
use crate::pvtu::{Identity, Whole};
use crate::vtu::{NumberPoints, first_number};
use crate::{CellData, ReadOptions};
use tetralod::mesh::{Field, MeshInput, TetMesh};

/// The group that makes a file of this format.
pub(super) const ROOT: &str = "VTKHDF";
/// The version that this was written for; later ones of the same major version add to it.
const MAJOR_VERSIONS: [f64; 2] = [1.0, 2.0];

/// How many faces, points of faces, and faces of polyhedra a piece has, since version 2.3; and where those of a step begin.
const FACE_COUNTS: [&str; 3] =
    ["NumberOfFaces", "NumberOfFaceConnectivityIds", "NumberOfPolyhedronToFaceIds"];
const FACE_BEGINNINGS: [&str; 3] =
    ["FaceOffsetsOffsets", "FaceConnectivityOffsets", "PolyhedronToFaceIdOffsets"];

/// The type of data sets with cells.
pub(super) const UNSTRUCTURED: &str = "UnstructuredGrid";

/// A file, and which of its steps is read.
pub(super) struct Reader<'a> {
    pub file: &'a Hdf5File,
    options: &'a ReadOptions,
    /// None without steps.
    step: Option<u64>,
    /// How many axes its arrays have before those of components.
    axes: usize,
    /// The names of the arrays in groups that were looked into: each array of each piece is looked for.
    known: RefCell<HashMap<String, HashSet<String>>>,
}

/// The times of the steps; none if there are no steps.
pub(super) fn times(file: &Hdf5File) -> Result<Vec<f64>, ReadError> {
    let options = &ReadOptions::default();
    Reader { file, options, step: None, axes: 1, known: RefCell::default() }
        .times()
        .at(|| format!("{ROOT}/Steps"))
}

/// Reads a mesh or grid.
pub(super) fn read(file: &Hdf5File, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let (mut reader, kind, time) = Reader::of(file, options)?;
    let mut mesh = match kind.as_str() {
        UNSTRUCTURED => reader.unstructured()?,
        "ImageData" => {
            reader.axes = 3 + usize::from(reader.step.is_some());
            reader.image()?
        }
        other => {
            let what = format!("a data set of type {other}");
            let remedy = "give an UnstructuredGrid or ImageData";
            return Err(ReadReason::unsupported(what, remedy)).at(|| ROOT.to_owned());
        }
    };
    set_time(&mut mesh, time);
    Ok(mesh)
}

/// Reads what is wanted of an array of so many components.
pub(super) type ReadValues<'a> = &'a dyn Fn(&Dataset, usize) -> Result<Vec<f64>, ReadReason>;

/// Where a piece begins in the arrays, and how much of each is its own.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub points: Range<u64>,
    pub cells: Range<u64>,
    /// In the list of the points of cells.
    pub ids: Range<u64>,
    /// In the list of where cells begin and end.
    pub offsets: Range<u64>,
    /// In the lists of where faces end, of their points, and of the faces of polyhedra.
    faces: [Range<u64>; 3],
    /// The first of its rows in arrays at points and at cells, where they have no beginnings of their own.
    first: [u64; 2],
    /// How many points and cells come before it in its step.
    before: [u64; 2],
}

impl<'a> Reader<'a> {
    /// A reader of the step that is asked for, the type of the data set, and its time.
    pub fn of(
        file: &'a Hdf5File,
        options: &'a ReadOptions,
    ) -> Result<(Self, String, Option<f64>), ReadError> {
        let place = || ROOT.to_owned();
        let times = times(file)?;
        let step = (!times.is_empty()).then_some(options.step as u64);
        let reader = Self { file, options, step, axes: 1, known: RefCell::default() };
        options.expect_step(times.len()).at(place)?;
        let version = reader.attribute("Version").at(place)?;
        if !version.first().is_some_and(|major| MAJOR_VERSIONS.contains(major)) {
            let what = format!("version {version:?} of VTKHDF");
            return Err(ReadReason::unsupported(what, "write it as version 2, or as .vtu")).at(place);
        }
        let root = file.group(ROOT).map_err(reason).at(place)?;
        let kind = root.attribute("Type").and_then(|kind| kind.read_string()).map_err(reason).at(place)?;
        Ok((reader, kind.trim_end_matches('\0').to_owned(), times.get(options.step).copied()))
    }
}

impl Reader<'_> {
    pub fn dataset(&self, path: &str) -> Result<Dataset, ReadReason> {
        self.file.dataset(&format!("{ROOT}/{path}")).map_err(reason)
    }

    /// A dataset that need not be there.
    pub fn dataset_if(&self, path: &str) -> Result<Option<Dataset>, ReadReason> {
        let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
        if !self.has_member(folder, name)? {
            return Ok(None);
        }
        self.dataset(path).map(Some)
    }

    /// Whether an array of this name is in a group.
    fn has_member(&self, group: &str, name: &str) -> Result<bool, ReadReason> {
        let mut known = self.known.borrow_mut();
        if let Some(members) = known.get(group) {
            return Ok(members.contains(name));
        }
        let members: HashSet<String> = self.members(group)?.into_iter().collect();
        let is_there = members.contains(name);
        known.insert(group.to_owned(), members);
        Ok(is_there)
    }

    /// The names of the arrays in a group; none if there is no such group.
    fn members(&self, group: &str) -> Result<Vec<String>, ReadReason> {
        let mut at = self.file.group(ROOT).map_err(reason)?;
        for name in group.split('/').filter(|name| !name.is_empty()) {
            if !at.member_names().map_err(reason)?.0.iter().any(|member| member == name) {
                return Ok(Vec::new());
            }
            at = at.group(name).map_err(reason)?;
        }
        Ok(at.member_names().map_err(reason)?.1)
    }

    fn attribute(&self, name: &str) -> Result<Vec<f64>, ReadReason> {
        let root = self.file.group(ROOT).map_err(reason)?;
        attribute_values(&root.attribute(name).map_err(reason)?)
    }

    fn times(&self) -> Result<Vec<f64>, ReadReason> {
        let Some(values) = self.dataset_if("Steps/Values")? else { return Ok(Vec::new()) };
        checked_times(floats(&values, 0..rows(&values))?)
    }

    /// The entry of this step in an array of beginnings; none without steps or without the array.
    fn beginning(&self, path: &str) -> Result<Option<u64>, ReadReason> {
        let Some(step) = self.step else { return Ok(None) };
        let Some(dataset) = self.dataset_if(&format!("Steps/{path}"))? else { return Ok(None) };
        let row = integers(&dataset, step..step.saturating_add(1))?;
        row.first().map(|&first| count(first)).transpose()
    }

    fn unstructured(&self) -> Result<TetMesh, ReadError> {
        let pieces = self.pieces().at(|| ROOT.to_owned())?;
        if let [piece] = pieces.as_slice() {
            return self.piece(piece, 0, &mut |points| {
                Ok(Numbering::From { first: first_number(0, points.len())?, points: points.len() })
            });
        }
        let mut whole = Whole::default();
        for (number, piece) in pieces.iter().enumerate() {
            let place = || format!("piece {number}, {ROOT}/PointData");
            whole.add(Identity::Places, &mut |numbers| self.piece(piece, number, numbers), &place)?;
        }
        Ok(whole.mesh)
    }

    /// The pieces of this step.
    pub fn pieces(&self) -> Result<Vec<Piece>, ReadReason> {
        let list = |name: &str| -> Result<Vec<u64>, ReadReason> {
            all_integers(&self.dataset(name)?)?.into_iter().map(count).collect()
        };
        let [points, cells, ids] =
            [list("NumberOfPoints")?, list("NumberOfCells")?, list("NumberOfConnectivityIds")?];
        if [cells.len(), ids.len()] != [points.len(); 2] {
            let [expected, found] = [points.len() as u64, cells.len().min(ids.len()) as u64];
            return Err(ReadReason::Count { what: "pieces".into(), expected, found });
        }
        let mut of_faces = FACE_COUNTS.map(|_| Vec::new());
        for (list_of, name) in of_faces.iter_mut().zip(FACE_COUNTS) {
            if self.dataset_if(name)?.is_some() {
                *list_of = list(name)?;
            }
        }
        let first_part = self.beginning("PartOffsets")?.unwrap_or(0);
        let parts = self.part_count(first_part, points.len() as u64)?;
        let mut next = Piece {
            points: 0..self.beginning("PointOffsets")?.unwrap_or(0),
            cells: 0..self.beginning("CellOffsets")?.unwrap_or(0),
            ids: 0..self.beginning("ConnectivityIdOffsets")?.unwrap_or(0),
            offsets: 0..0,
            faces: [0..0, 0..0, 0..0],
            first: [0; 2],
            before: [0; 2],
        };
        next.first = [next.points.end, next.cells.end];
        next.offsets.end = next.cells.end.saturating_add(first_part);
        for (range, name) in next.faces.iter_mut().zip(FACE_BEGINNINGS) {
            range.end = self.beginning(name)?.unwrap_or(0);
        }
        // VTK counts faces there, not where they end, of which each part has one more.
        next.faces[0].end = next.faces[0].end.saturating_add(first_part);
        let mut pieces = Vec::new();
        for part in first_part..first_part.saturating_add(parts) {
            let size = |sizes: &[u64]| usize::try_from(part).ok().and_then(|part| sizes.get(part).copied());
            let (Some(points), Some(cells), Some(ids)) = (size(&points), size(&cells), size(&ids)) else {
                return Err(ReadReason::Missing(format!("piece {part}")));
            };
            let after = |last: &Range<u64>, size: u64| last.end..last.end.saturating_add(size);
            // Where faces end is a list as that of cells.
            let [faces, points_of_faces, of_cells] =
                of_faces.each_ref().map(|sizes| size(sizes).unwrap_or(0));
            let [last_faces, last_points, last_of_cells] = &next.faces;
            let piece = Piece {
                points: after(&next.points, points),
                cells: after(&next.cells, cells),
                ids: after(&next.ids, ids),
                offsets: after(&next.offsets, cells.saturating_add(1)),
                faces: [
                    after(last_faces, faces.saturating_add(1)),
                    after(last_points, points_of_faces),
                    after(last_of_cells, of_cells),
                ],
                ..next.clone()
            };
            let [a, b] = piece.before;
            next = Piece { before: [a.saturating_add(points), b.saturating_add(cells)], ..piece.clone() };
            pieces.push(piece);
        }
        Ok(pieces)
    }

    /// How many pieces this step has, whose first one is `first` of all.
    fn part_count(&self, first: u64, all: u64) -> Result<u64, ReadReason> {
        let Some(step) = self.step else { return Ok(all) };
        if let Some(parts) = self.beginning("NumberOfParts")? {
            return Ok(parts);
        }
        let Some(firsts) = self.dataset_if("Steps/PartOffsets")? else { return Ok(all) };
        let later = integers(&firsts, step.saturating_add(1).min(rows(&firsts))..rows(&firsts))?;
        // Steps that share their pieces begin at the same one.
        let end = later.into_iter().map(count).find(|end| *end != Ok(first)).unwrap_or(Ok(all))?;
        Ok(end.saturating_sub(first))
    }

    /// Reads a piece. Its points are numbered as `numbers` says.
    pub fn piece(
        &self,
        piece: &Piece,
        number: usize,
        numbers: NumberPoints<'_>,
    ) -> Result<TetMesh, ReadError> {
        let place = |array: &str| format!("piece {number}, {ROOT}/{array}");
        let mut listed = self.cells(piece).at(|| place("Types, Offsets and Connectivity"))?;
        if let Some(listed) = &mut listed {
            self.leave_out_ghosts(listed, piece).at(|| place(GHOST_TYPE))?;
        }
        let mut positions = self.positions(piece).at(|| place("Points"))?;
        let [mut fields, other_fields] = self.fields("PointData", piece, &[])?;
        let used = || listed.as_ref().map(|listed| listed.used(positions.len()));
        check_finite(&positions, &fields, &used).at(|| place("PointData"))?;
        let [mut cell_fields, other_cell_fields] = match &listed {
            None => Default::default(),
            Some(_) => self.fields("CellData", piece, &fields)?,
        };
        let is_there = |cell: usize| {
            listed
                .as_ref()
                .and_then(|listed| listed.types.get(cell))
                .is_some_and(|kind| !cell_types::is_flat(*kind))
        };
        check_finite_cells(&cell_fields, is_there).at(|| place("CellData"))?;
        let numbering = numbers(&positions).at(|| place("Points"))?;
        let memory = &self.options.memory;
        let split =
            listed.map(|listed| listed.split(&numbering, &mut positions, &mut fields, memory)).transpose();
        let split = split.at(|| place("Connectivity"))?.unwrap_or_default();
        split.spread(&mut cell_fields);
        let input = MeshInput { other_fields, other_cell_fields, ..split.input };
        Ok(TetMesh { positions, fields, tets: split.tets, cell_fields, input, ..TetMesh::default() })
    }

    pub fn positions(&self, piece: &Piece) -> Result<Vec<[f64; 3]>, ReadReason> {
        let points = self.dataset("Points")?;
        expect_count("components of the points", 3_u64, row_length(&points)?)?;
        let count = piece.points.end.saturating_sub(piece.points.start);
        self.options.memory.take(count.saturating_mul(24))?;
        Ok(points_from(&floats(&points, piece.points.clone())?))
    }

    /// The cells of a piece; none if it has points alone.
    fn cells(&self, piece: &Piece) -> Result<Option<CellList<'static>>, ReadReason> {
        if piece.cells.is_empty() {
            return Ok(Some(CellList::default()));
        }
        let mut types = integers(&self.dataset("Types")?, piece.cells.clone())?;
        if cells::are_points(&types) {
            return Ok(None);
        }
        cells::most_tets(&types)?;
        let mut ends = integers(&self.dataset("Offsets")?, piece.offsets.clone())?;
        if ends.first() != Some(&0) {
            return Err(ReadReason::Syntax("the first cell of a piece does not begin at 0".into()));
        }
        ends.remove(0);
        cells::resolve_orders(&mut types, &ends);
        cells::most_tets(&types)?;
        let found = cells::checked_ends(&types, &ends)?;
        expect_count("points of cells", piece.ids.end - piece.ids.start, found)?;
        let connectivity = Indices::Listed(integers(&self.dataset("Connectivity")?, piece.ids.clone())?);
        let has_faces = types.contains(&cell_types::POLYHEDRON);
        let list = CellList { types, ends, connectivity };
        Ok(Some(if has_faces { list.with_faces(&self.faces(piece)?)? } else { list }))
    }

    /// The faces of the polyhedra of a piece.
    fn faces(&self, piece: &Piece) -> Result<FaceLists, ReadReason> {
        let ends = |name: &str, rows: &Range<u64>| {
            let mut ends = integers(&self.dataset(name)?, rows.clone())?;
            if ends.first() != Some(&0) {
                return Err(ReadReason::Syntax(format!("{name} of a piece does not begin at 0")));
            }
            ends.remove(0);
            Ok(ends)
        };
        let [offsets, connectivity, of_cells] = &piece.faces;
        let faces = SharedFaces {
            connectivity: integers(&self.dataset("FaceConnectivity")?, connectivity.clone())?,
            ends: ends("FaceOffsets", offsets)?,
            of_cells: integers(&self.dataset("PolyhedronToFaces")?, of_cells.clone())?,
            cell_ends: ends("PolyhedronOffsets", &piece.offsets)?,
        };
        faces.lists()
    }

    /// Leaves out the cells that VTK's flags mark as another piece's or as hidden.
    fn leave_out_ghosts(&self, listed: &mut CellList<'_>, piece: &Piece) -> Result<(), ReadReason> {
        if let Some(ghosts) = self.dataset_if(&format!("CellData/{GHOST_TYPE}"))? {
            listed.leave_out(&integers(&ghosts, self.rows_of("CellData", GHOST_TYPE, piece)?)?);
        }
        if let Some(ghosts) = self.dataset_if(&format!("PointData/{GHOST_TYPE}"))? {
            let flags = integers(&ghosts, self.rows_of("PointData", GHOST_TYPE, piece)?)?;
            listed.hide(&flags.iter().map(|flags| flags & HIDDEN_POINT != 0).collect::<Vec<_>>());
        }
        Ok(())
    }

    /// The rows of an array that are a piece's.
    pub fn rows_of(&self, group: &str, name: &str, piece: &Piece) -> Result<Range<u64>, ReadReason> {
        let (of, own) = if group == "PointData" { (0, &piece.points) } else { (1, &piece.cells) };
        let first = self.beginning(&format!("{group}Offsets/{name}"))?.unwrap_or(piece.first[of]);
        let start = first.saturating_add(piece.before[of]);
        Ok(start..start.saturating_add(own.end - own.start))
    }

    /// The fields in a group, beside these at points, and those that nobody asked for.
    fn fields(&self, group: &str, piece: &Piece, at_points: &[Field]) -> Result<[Vec<Field>; 2], ReadError> {
        self.collect(group, at_points, &|dataset, components| {
            let what = format!("components of \"{}\"", dataset.name());
            expect_count(what, components, row_length(dataset)?)?;
            let name = dataset.name().rsplit('/').next().unwrap_or_default();
            floats(dataset, self.rows_of(group, name, piece)?)
        })
    }

    /// The fields in a group, whose values `values` reads, given how many components there are, and those that nobody asked for.
    pub fn collect(
        &self,
        group: &str,
        at_points: &[Field],
        values: ReadValues<'_>,
    ) -> Result<[Vec<Field>; 2], ReadError> {
        let at_cells = group == "CellData";
        let cells = self.options.cells;
        let mut collector = match (at_cells, cells) {
            (false, _) => Collector::new(self.options),
            (true, CellData::Values) => Collector::at_cells(self.options, at_points),
            (true, CellData::Names) => Collector::of_names(),
            (true, CellData::LeaveOut) => return Ok(Default::default()),
        };
        for name in self.members(group).at(|| format!("{ROOT}/{group}"))? {
            let place = || format!("{ROOT}/{group}/{name}");
            if name == GHOST_TYPE {
                continue;
            }
            let dataset = self.dataset(&format!("{group}/{name}")).at(place)?;
            let Some(integer) = number_kind(&dataset) else { continue };
            let components = self.components(&dataset);
            let Some(claim) = collector.claim(&name, components).at(place)? else { continue };
            if at_cells && cells == CellData::Names {
                collector.keep_names(claim, "");
                continue;
            }
            let values = values(&dataset, components).at(place)?;
            collector.fill(claim, values, integer, "").at(place)?;
        }
        Ok([collector.fields, collector.others])
    }

    /// How many components an array has: what follows behind rows, or behind the axes of a grid.
    fn components(&self, dataset: &Dataset) -> usize {
        let components = dataset.shape().get(self.axes);
        components.map_or(1, |components| usize::try_from(*components).unwrap_or(usize::MAX))
    }

    fn image(&self) -> Result<TetMesh, ReadError> {
        let place = || ROOT.to_owned();
        let (placement, whole) = self.placement().at(place)?;
        let inner = cubes_of(whole);
        let [fields, others] = self.samples("PointData", whole, &[])?;
        let [cubes, other_cubes] = self.samples("CellData", inner, &fields)?;
        if fields.is_empty() && cubes.iter().all(|field| field.values.is_empty()) {
            self.expect_values(whole)?;
        }
        let ghosts = Ghosts {
            points: self.grid_ghosts("PointData", whole)?,
            cubes: self.grid_ghosts("CellData", inner)?,
        };
        placement
            .mesh(GridValues { fields, cubes, ghosts, others: [others, other_cubes] }, &self.options.memory)
            .at(place)
    }

    /// The grid and its extent, as those of a `.vti`.
    fn placement(&self) -> Result<(Placement, Extent), ReadReason> {
        let whole: [f64; 6] = fixed(&self.attribute("WholeExtent")?, "WholeExtent")?;
        let whole: Extent = whole.map(|index| index as i64);
        let origin = fixed(&self.attribute("Origin")?, "Origin")?;
        let spacing = fixed(&self.attribute("Spacing")?, "Spacing")?;
        let root = self.file.group(ROOT).map_err(reason)?;
        let direction = match root.attribute("Direction") {
            Ok(direction) => fixed(&attribute_values(&direction)?, "Direction")?,
            Err(_) => grid::ALONG_THE_AXES,
        };
        grid::placed(whole, origin, spacing, direction)
    }

    /// Checks that there is an array with a value for each point or cube: without, a few words claim any size.
    fn expect_values(&self, whole: Extent) -> Result<(), ReadError> {
        let expected = |extent: Extent| -> Result<u64, ReadReason> {
            Ok(grid::dims_in(extent, extent)?.iter().product())
        };
        for (group, extent) in [("PointData", whole), ("CellData", cubes_of(whole))] {
            let count = expected(extent).at(|| ROOT.to_owned())?;
            for name in self.members(group).at(|| format!("{ROOT}/{group}"))? {
                let dataset =
                    self.dataset(&format!("{group}/{name}")).at(|| format!("{ROOT}/{group}/{name}"))?;
                if self
                    .grid_values(group, extent, &dataset, self.components(&dataset))
                    .is_ok_and(|v| v.len() as u64 >= count)
                {
                    return Ok(());
                }
            }
        }
        Err(ReadReason::Missing("an array with a value for every point or cell".into()))
            .at(|| ROOT.to_owned())
    }

    /// VTK's flags in a group, for each place in `extent`.
    fn grid_ghosts(&self, group: &str, extent: Extent) -> Result<Option<Vec<i64>>, ReadError> {
        let place = || format!("{ROOT}/{group}/{GHOST_TYPE}");
        let Some(ghosts) = self.dataset_if(&format!("{group}/{GHOST_TYPE}")).at(place)? else {
            return Ok(None);
        };
        let flags = self.grid_values(group, extent, &ghosts, 1).at(place)?;
        Ok(Some(flags.into_iter().map(|flags| flags as i64).collect()))
    }

    /// The fields with a value for each place in `extent`, beside these at points, and those that nobody asked for.
    fn samples(
        &self,
        group: &str,
        extent: Extent,
        at_points: &[Field],
    ) -> Result<[Vec<Field>; 2], ReadError> {
        self.collect(group, at_points, &|dataset, components| {
            self.grid_values(group, extent, dataset, components)
        })
    }

    /// The values of an array for each place in `extent`.
    fn grid_values(
        &self,
        group: &str,
        extent: Extent,
        dataset: &Dataset,
        components: usize,
    ) -> Result<Vec<f64>, ReadReason> {
        let dims = grid::dims_in(extent, extent)?;
        let steps = self.step.map(|_| rows(dataset));
        let expected: Vec<u64> = steps.into_iter().chain(dims.into_iter().rev()).collect();
        let shape = dataset.shape();
        if shape.get(..expected.len()) != Some(&expected) || shape.len() > expected.len() + 1 {
            let what = format!("an array of shape {shape:?} where it begins with {expected:?}");
            return Err(ReadReason::Syntax(what));
        }
        let name = dataset.name().rsplit('/').next().unwrap_or_default();
        let values = match self.step {
            None => floats(dataset, 0..rows(dataset)),
            Some(step) => {
                let first = self.beginning(&format!("{group}Offsets/{name}"))?.unwrap_or(step);
                floats(dataset, first..first.saturating_add(1))
            }
        }?;
        let expected = dims.iter().product::<u64>() * components as u64;
        expect_count(format!("values of \"{name}\""), expected, values.len())?;
        Ok(values)
    }
}

/// A number of things, as the file has it.
fn count(number: i64) -> Result<u64, ReadReason> {
    u64::try_from(number).map_err(|_| ReadReason::Syntax(format!("{number} is not a count")))
}

/// As many numbers as there must be.
fn fixed<const N: usize>(list: &[f64], name: &str) -> Result<[f64; N], ReadReason> {
    expect_count(format!("numbers of attribute {name}"), N, list.len())?;
    Ok(std::array::from_fn(|i| list[i]))
}
