//! Polyhedra: cells that list their faces, and how they become tetrahedra that fit those of their neighbours.
//!
//! In a list of cells, the numbers of a polyhedron are how many faces it has and, for each face, how many points and these: VTK's
//! face stream, which legacy files have as it is. Faces may be listed in any order and direction.
//!
//! 1. A *face* is cut into triangles by itself, so that both of its cells see the same: from its point of the lowest number, as faces of other
//!    cells are (see `cell_shapes`), unless a triangle is then turned, or thin or tilted and less than half as round as the worst one can be.
//!    So it is where a face is concave, has points on straight edges, or is bent there.
//! 2. The faces must be one closed surface without a hole through it. They are turned outward.
//! 3. The *cell* is the tetrahedra that join a point to all of these triangles: the first corner, by number, from which all of them are
//!    seen from inside; else a point that is added, at the mean of the corners or, where that does not see all, at a weighted one.
//! 4. Where no point does, because faces are bent, or where a face can be cut in no way, its faces get a point in the middle, too, from
//!    which they are cut. Their other cells are then split anew. Not so faces that another piece may have, which cannot know of it.
//!
//! Values at points that are added are the same means as their places, so a linear field stays exact. What cannot be split is refused, by
//! the number of the cell. Where there are polyhedra, ordinary cells are split in the same way if a face of theirs is cut otherwise than
//! they would be, or if they fold.

use std::collections::HashMap;

use glam::DVec3;

use crate::MemoryLimit;
use crate::cell_shapes::Recipe;
use crate::cell_types::POLYHEDRON;
use crate::error::ReadReason;
use crate::numbering::Numbering;
use tetralod::mesh::Field;

/// The least part of a cell that a tetrahedron of it may be where there is another way to split it.
const SMALL: f64 = 1e-6;
/// How round a triangle of a face must be where there is another way to cut it: its area by the square of its longest edge, twice.
const SLIVER: f64 = 1e-3;
/// What of a product of lengths may be rounding.
const ROUNDING: f64 = 1e-14;
/// How often a point that sees all faces is improved.
const ROUNDS: usize = 1 << 9;
/// How often faces may get points in their middle: each time, cells beside them are split anew.
const PASSES: usize = 1 << 4;
/// How many corners are tried: a cell with very many must not take the square of their number.
const MOST_CORNERS: usize = 1 << 8;
/// The most points of a face that is cut otherwise than from its first point.
const MOST_POINTS: usize = 1 << 7;

/// The faces of a polyhedron in a list, as far as it goes.
pub(super) fn faces_of(listed: &[i64]) -> impl Iterator<Item = &[i64]> {
    let mut rest = listed.get(1..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (&count, after) = rest.split_first()?;
        let (face, after) = after.split_at_checked(usize::try_from(count).ok()?)?;
        rest = after;
        Some(face)
    })
}

/// The points of a cell in a list, where polyhedra have more than points.
pub(super) fn points_of(kind: i64, listed: &[i64]) -> impl Iterator<Item = i64> {
    let (points, faces) = if kind == POLYHEDRON { (&[][..], listed) } else { (listed, &[][..]) };
    points.iter().chain(faces_of(faces).flatten()).copied()
}

/// The tetrahedra at most that polyhedra become, from where the lists of their points end: a closed surface of `n` points is `2 n - 4`
/// triangles.
pub(super) fn most_tets(types: &[i64], ends: &[i64]) -> u64 {
    let starts = std::iter::once(&0).chain(ends);
    let of_cell = |((kind, start), end): ((&i64, &i64), &i64)| {
        let points = end.saturating_sub(*start).max(4) as u64;
        if *kind == POLYHEDRON { points.saturating_mul(2) - 4 } else { 0 }
    };
    types.iter().zip(starts).zip(ends).map(of_cell).fold(0, u64::saturating_add)
}

/// The triangles that the faces of a polyhedron with this list become, and so the tetrahedra at most.
pub(super) fn triangles(listed: &[i64]) -> u64 {
    // Each face has a number and three points at least.
    let faces = listed.first().map_or(0, |faces| faces.clamp(&0, &(listed.len() as i64 / 4)).unsigned_abs());
    (listed.len() as u64).saturating_sub(1 + 3 * faces)
}

/// Puts the faces of polyhedra into a list of cells, in the place of their points; returns where cells end then.
///
/// # Errors
/// If there are not the faces that must be there.
pub(super) fn listed(
    types: &[i64],
    ends: &[i64],
    points: &[i64],
    faces: &FaceLists,
) -> Result<(Vec<i64>, Vec<i64>), ReadReason> {
    let mut list = Vec::with_capacity(points.len() + faces.numbers.len());
    let mut new_ends = Vec::with_capacity(ends.len());
    let mut start = 0;
    let mut first = 0;
    for (cell, (&kind, &end)) in types.iter().zip(ends).enumerate() {
        let end = usize::try_from(end).unwrap_or(usize::MAX);
        let of_faces = faces.ends.get(cell).copied().unwrap_or(first);
        let numbers = if kind == POLYHEDRON {
            let range = usize::try_from(first).ok().zip(usize::try_from(of_faces).ok());
            range.and_then(|(first, end)| faces.numbers.get(first..end))
        } else {
            points.get(start..end)
        };
        list.extend_from_slice(numbers.ok_or_else(|| ReadReason::Missing(format!("a part of cell {cell}")))?);
        new_ends.push(list.len() as i64);
        start = end;
        // Cells without faces have -1 there.
        first = first.max(of_faces);
    }
    Ok((list, new_ends))
}

/// The faces of the polyhedra among some cells.
#[derive(Debug, Default)]
pub(super) struct FaceLists {
    /// As in a list of cells.
    pub numbers: Vec<i64>,
    /// Where those of each cell end. Of cells that are none, it may be any number that is not larger.
    pub ends: Vec<i64>,
}

/// Faces that several cells may share: VTK's arrays of this name since version 9.4.
#[derive(Debug, Default)]
pub(super) struct SharedFaces {
    /// The points of all faces, one after the other.
    pub connectivity: Vec<i64>,
    /// Where each face ends there.
    pub ends: Vec<i64>,
    /// The faces of all cells, one after the other.
    pub of_cells: Vec<i64>,
    /// Where each cell ends there.
    pub cell_ends: Vec<i64>,
}

impl SharedFaces {
    /// The faces of each cell.
    ///
    /// # Errors
    /// If a face is not there, or more than two cells have it: otherwise few numbers could stand for very many.
    pub fn lists(&self) -> Result<FaceLists, ReadReason> {
        let mut lists = FaceLists::default();
        let mut uses = vec![0_u8; self.ends.len()];
        let mut start = 0;
        for (cell, &end) in self.cell_ends.iter().enumerate() {
            let faces = part(&self.of_cells, start, end);
            let faces = faces.ok_or_else(|| ReadReason::Missing(format!("a face of cell {cell}")))?;
            start = start.max(end);
            if !faces.is_empty() {
                lists.numbers.push(faces.len() as i64);
            }
            for &face in faces {
                let missing = || ReadReason::Missing(format!("face {face} of cell {cell}"));
                let at = usize::try_from(face).ok().filter(|at| *at < uses.len()).ok_or_else(missing)?;
                uses[at] += 1;
                if uses[at] > 2 {
                    let what =
                        format!("face {face} is one of more than two cells, the last of them cell {cell}");
                    return Err(ReadReason::Syntax(what));
                }
                let first = at.checked_sub(1).map_or(0, |last| self.ends[last]);
                let points = part(&self.connectivity, first, self.ends[at]).ok_or_else(missing)?;
                lists.numbers.push(points.len() as i64);
                lists.numbers.extend_from_slice(points);
            }
            lists.ends.push(lists.numbers.len() as i64);
        }
        Ok(lists)
    }
}

/// A part of a list.
fn part(list: &[i64], start: i64, end: i64) -> Option<&[i64]> {
    list.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
}

/// A corner of a cell.
#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Its number in the mesh, by which corners are sorted.
    number: u32,
    /// And in the part of the file.
    index: u32,
    place: DVec3,
}

/// Points that were added, each in a cell.
#[derive(Debug, Default)]
pub(super) struct AddedPoints {
    positions: Vec<[f64; 3]>,
    /// The corners of each one's cell, by their index, and how much each counts; one after the other.
    shares: Vec<(u32, f64)>,
    ends: Vec<usize>,
    /// The first cell that got one, in itself or in a face.
    pub first: Option<u32>,
}

impl AddedPoints {
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    fn add(&mut self, cell: usize, place: DVec3, shares: impl IntoIterator<Item = (u32, f64)>) {
        self.first = self.first.or(u32::try_from(cell).ok());
        self.positions.push(place.to_array());
        self.shares.extend(shares);
        self.ends.push(self.shares.len());
    }

    /// Appends the points, with their values.
    pub fn append_to(
        self,
        positions: &mut Vec<[f64; 3]>,
        fields: &mut [Field],
        memory: &MemoryLimit,
    ) -> Result<(), ReadReason> {
        let bytes = 24 + 8 * fields.len() as u64;
        memory.take(bytes.saturating_mul(self.len() as u64))?;
        positions.extend(&self.positions);
        for field in fields {
            let mut start = 0;
            for &end in &self.ends {
                let of_corners = &self.shares[start..end];
                start = end;
                let value =
                    mean(of_corners.iter().map(|&(index, share)| (field.values[index as usize], share)));
                field.integer &= value.fract() == 0.0;
                field.values.push(value);
            }
        }
        Ok(())
    }
}

/// A mean with these weights. A constant stays what it is, and nothing overflows.
fn mean(values: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let (mut mean, mut sum) = (0.0, 0.0);
    for (value, weight) in values {
        sum += weight;
        let part = weight / sum;
        mean = if part == 1.0 { value } else { mean + (value * part - mean * part) };
    }
    mean
}

/// Splits polyhedra, one after the other, and all of them again as long as faces get points in their middle.
pub(super) struct Splitter<'a> {
    numbering: &'a Numbering,
    /// Of all points in the part of the file.
    positions: &'a [[f64; 3]],
    pub added: AddedPoints,
    /// Faces that get a point in their middle, by their numbers in order.
    middles: HashMap<Vec<u32>, Middle>,
    passes: usize,
    /// Whether there are more of them than when the cells were split.
    has_more: bool,
    /// The corners of a cell by their numbers, and the middles of its faces behind them.
    points: Vec<Corner>,
    corners: usize,
    /// Faces, by the places of their corners.
    faces: Vec<Vec<u32>>,
    /// The triangles of the whole surface, in positive order seen from outside.
    surface: Vec<[u32; 3]>,
}

/// Takes the number of a cell and the list of its faces.
pub(super) type TakeFaces<'a> = &'a mut dyn FnMut(usize, &[i64]) -> Result<(), ReadReason>;

/// A face that gets a point in its middle.
#[derive(Debug, Default)]
struct Middle {
    /// How many cells in this part of the file have the face.
    cells: u32,
    /// The number of the point, once a cell got it.
    point: Option<u32>,
}

impl<'a> Splitter<'a> {
    pub fn new(numbering: &'a Numbering, positions: &'a [[f64; 3]]) -> Self {
        Self {
            numbering,
            positions,
            added: AddedPoints::default(),
            middles: HashMap::new(),
            passes: 0,
            has_more: false,
            points: Vec::new(),
            corners: 0,
            faces: Vec::new(),
            surface: Vec::new(),
        }
    }

    /// Appends the tetrahedra of a polyhedron.
    ///
    /// # Errors
    /// If the list is damaged, or cannot be a cell, or one that is split here.
    pub fn split(&mut self, cell: usize, listed: &[i64], tets: &mut Vec<[u32; 4]>) -> Result<(), ReadReason> {
        let faces = faces_of(listed).count() as i64;
        let used = 1 + faces_of(listed).map(|face| 1 + face.len()).sum::<usize>();
        if listed.first() != Some(&faces) || used != listed.len() {
            return Err(ReadReason::Syntax(format!(
                "cell {cell}, a polyhedron, has {} numbers that are not its {} faces",
                listed.len(),
                listed.first().unwrap_or(&0)
            )));
        }
        self.take(cell, listed)?;
        let refused = |fault: String| ReadReason::Polyhedron { cell: cell as u64, fault };
        if !self.close(cell)? {
            return Ok(());
        }
        let Some(point) = self.point() else {
            let may_get = |face: &Vec<u32>| face.len() > 3;
            let faces: Vec<Vec<u32>> =
                self.faces.iter().filter(|face| may_get(face)).map(|face| self.key(face)).collect();
            return if self.want_middles(faces) { Ok(()) } else { Err(refused(CONCAVE.into())) };
        };
        let at = |point: &u32| self.points[*point as usize].number;
        let of = |apex: u32, [a, b, c]: &[u32; 3]| [apex, at(a), at(b), at(c)];
        match point {
            Point::Corner(apex) => {
                let others = self.surface.iter().filter(|triangle| !triangle.contains(&apex));
                tets.extend(others.map(|triangle| of(at(&apex), triangle)));
            }
            Point::Added(place, weights) => {
                let apex = self.numbering.added(self.added.len())?;
                tets.extend(self.surface.iter().map(|triangle| of(apex, triangle)));
                self.added.add(cell, place, self.points.iter().map(|corner| corner.index).zip(weights));
            }
        }
        Ok(())
    }

    /// Appends the tetrahedra of a cell of another type with these vertices, beside polyhedra: not if it is to be split as ever.
    ///
    /// # Errors
    /// If a face of it gets a point in its middle, and it cannot be split so.
    pub fn split_beside(
        &mut self,
        cell: usize,
        recipe: &Recipe,
        listed: &[i64],
        vertices: &[u32],
        tets: &mut Vec<[u32; 4]>,
    ) -> Result<bool, ReadReason> {
        let Some(faces) = recipe.faces(listed) else { return Ok(false) };
        self.take(cell, &faces)?;
        let is_cut_alike = |face: &Vec<u32>| {
            self.cut(&in_order(face).0).is_none_or(|(_, is_fan)| is_fan) && !self.has_middle(&self.key(face))
        };
        if self.faces.iter().all(is_cut_alike) {
            let first = tets.len();
            recipe.split(vertices, tets);
            if self.are_on_one_side(&tets[first..]) {
                return Ok(true);
            }
            tets.truncate(first);
        }
        let split = self.split(cell, &faces, tets);
        let has_middles = self.faces.iter().any(|face| self.has_middle(&self.key(face)));
        if has_middles { split.map(|()| true) } else { Ok(split.is_ok()) }
    }

    /// Whether tetrahedra between corners of the cell are all positive, or all inside out, as in files whose order of points is another.
    fn are_on_one_side(&self, tets: &[[u32; 4]]) -> bool {
        let corners = &self.points[..self.corners];
        let place = |number: u32| corners[corners.partition_point(|corner| corner.number < number)].place;
        let side = |&[a, b, c, d]: &[u32; 4]| {
            let [u, v, w] = [b, c, d].map(|point| place(point) - place(a));
            let (volume, rounding) = (u.cross(v).dot(w), ROUNDING * u.length() * v.length() * w.length());
            if volume.abs() <= rounding { 0 } else { volume.signum() as i32 }
        };
        let mut sides = tets.iter().map(side);
        let first = sides.next().unwrap_or(0);
        first != 0 && sides.all(|side| side == first)
    }

    /// Whether all cells have to be split again. `each` must then call what it is given for the faces of each of them.
    pub fn again(
        &mut self,
        each: impl FnOnce(TakeFaces<'_>) -> Result<(), ReadReason>,
    ) -> Result<bool, ReadReason> {
        if !std::mem::take(&mut self.has_more) {
            return Ok(false);
        }
        self.passes += 1;
        self.added = AddedPoints::default();
        self.middles.values_mut().for_each(|middle| *middle = Middle::default());
        // Which cells have a face matters where other pieces may have it.
        if self.numbering.is_whole() {
            return Ok(true);
        }
        each(&mut |cell, listed| {
            self.take(cell, listed)?;
            for number in 0..self.faces.len() {
                let key = self.key(&self.faces[number]);
                self.middles.entry(key).and_modify(|middle| middle.cells += 1);
            }
            Ok(())
        })?;
        Ok(true)
    }

    /// The numbers of a face in order.
    fn key(&self, face: &[u32]) -> Vec<u32> {
        let mut key: Vec<u32> = face.iter().map(|&corner| self.points[corner as usize].number).collect();
        key.sort_unstable();
        key
    }

    /// Whether a face gets a point in its middle. Where other pieces may have it, both of its cells must be here.
    fn has_middle(&self, key: &[u32]) -> bool {
        !self.middles.is_empty()
            && self.middles.get(key).is_some_and(|middle| self.numbering.is_whole() || middle.cells > 1)
    }

    /// Notes that faces are to get a point in their middle; whether there is a new one.
    fn want_middles(&mut self, faces: Vec<Vec<u32>>) -> bool {
        let before = self.middles.len();
        if self.passes < PASSES {
            self.middles.extend(faces.into_iter().map(|face| (face, Middle::default())));
        }
        let is_new = self.middles.len() > before;
        self.has_more |= is_new;
        is_new
    }

    /// Takes over the faces of a cell.
    fn take(&mut self, cell: usize, listed: &[i64]) -> Result<(), ReadReason> {
        let Self { numbering, positions, points, faces, .. } = self;
        points.clear();
        faces.clear();
        for &point in faces_of(listed).flatten() {
            let number = numbering.of(cell, point)?;
            // It is one of the points.
            let place = positions.get(point as usize).copied().unwrap_or_default();
            points.push(Corner { number, index: point as u32, place: DVec3::from_array(place) });
        }
        points.sort_unstable_by_key(|corner| corner.number);
        points.dedup_by_key(|corner| corner.number);
        for face in faces_of(listed) {
            let mut places = Vec::with_capacity(face.len());
            for &point in face {
                let number = numbering.of(cell, point)?;
                places.push(points.partition_point(|corner| corner.number < number) as u32);
            }
            faces.push(places);
        }
        self.corners = self.points.len();
        Ok(())
    }

    /// Makes the surface of the faces; not if a face has to get a point in its middle first.
    fn close(&mut self, cell: usize) -> Result<bool, ReadReason> {
        let refused = |fault: String| ReadReason::Polyhedron { cell: cell as u64, fault };
        self.check_faces().map_err(refused)?;
        let turned = self.turned().map_err(refused)?;
        self.surface.clear();
        for (number, turned) in turned.into_iter().enumerate() {
            let (face, reversed) = in_order(&self.faces[number]);
            let key = self.key(&face);
            let triangles = if self.has_middle(&key) {
                self.around_middle(cell, &face, key)?
            } else if let Some((triangles, _)) = self.cut(&face) {
                triangles
            } else if self.has_area(&face) && self.want_middles(vec![key]) {
                return Ok(false);
            } else {
                let what = "has no area, or its edges cross, or two of its points are at the same place";
                return Err(refused(format!("its face {number} {what}")));
            };
            let flip = |[a, b, c]: [u32; 3]| if turned == reversed { [a, b, c] } else { [a, c, b] };
            self.surface.extend(triangles.into_iter().map(flip));
        }
        let (volume, rounding) = self.volume(self.place(0));
        if volume.abs() <= rounding {
            return Err(refused("it has no volume".into()));
        }
        if volume < 0.0 {
            self.surface.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        Ok(true)
    }

    /// Refuses cells with too few faces, and faces with too few points.
    fn check_faces(&self) -> Result<(), String> {
        if self.faces.len() < 4 {
            return Err(format!("it has {} faces, of which a cell has at least 4", self.faces.len()));
        }
        for (number, face) in self.faces.iter().enumerate() {
            if face.len() < 3 {
                let points = face.len();
                return Err(format!("its face {number} has {points} points, of which a face has at least 3"));
            }
            let mut sorted = face.clone();
            sorted.sort_unstable();
            if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
                let point = self.points[pair[0] as usize].index;
                return Err(format!("its face {number} has point {point} twice"));
            }
        }
        Ok(())
    }

    /// The triangles of a face around a point in its middle.
    fn around_middle(
        &mut self,
        cell: usize,
        face: &[u32],
        key: Vec<u32>,
    ) -> Result<Vec<[u32; 3]>, ReadReason> {
        let place = |axis: usize| mean(face.iter().map(|&corner| (self.place(corner)[axis], 1.0)));
        let place = DVec3::new(place(0), place(1), place(2));
        let middle = self.points.len() as u32;
        let index = |&corner: &u32| (self.points[corner as usize].index, 1.0);
        let number = match self.middles.get(&key).and_then(|middle| middle.point) {
            Some(number) => number,
            None => {
                let number = self.numbering.added(self.added.len())?;
                let shares: Vec<(u32, f64)> = face.iter().map(index).collect();
                self.added.add(cell, place, shares);
                self.middles.entry(key).or_default().point = Some(number);
                number
            }
        };
        self.points.push(Corner { number, index: u32::MAX, place });
        let next = face.iter().cycle().skip(1);
        Ok(face.iter().zip(next).map(|(&a, &b)| [middle, a, b]).collect())
    }

    /// Which faces must be turned so that all of them are seen in the same order.
    fn turned(&self) -> Result<Vec<bool>, String> {
        let mut edges = Vec::new();
        for (number, face) in (0_u32..).zip(&self.faces) {
            let next = face.iter().cycle().skip(1);
            edges.extend(face.iter().zip(next).map(|(&a, &b)| (a.min(b), a.max(b), number, a < b)));
        }
        edges.sort_unstable();
        // Of each face its neighbours, and whether both see the edge between them in the same order.
        let mut pairs = Vec::with_capacity(edges.len());
        for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let &[(_, _, one, along), (_, _, other, also)] = edge else {
                let [a, b] = [edge[0].0, edge[0].1].map(|corner| self.points[corner as usize].index);
                let faces = if edge.len() == 1 { "1 face".into() } else { format!("{} faces", edge.len()) };
                return Err(format!("its edge from point {a} to {b} is one of {faces}, not of two"));
            };
            pairs.extend([(one, other, along == also), (other, one, along == also)]);
        }
        pairs.sort_unstable();
        let mut turned = vec![None; self.faces.len()];
        turned[0] = Some(false);
        let mut waiting = vec![0_u32];
        while let Some(face) = waiting.pop() {
            let is_turned = turned[face as usize] == Some(true);
            let first = pairs.partition_point(|pair| pair.0 < face);
            for &(_, other, same) in pairs[first..].iter().take_while(|pair| pair.0 == face) {
                match turned[other as usize] {
                    None => {
                        turned[other as usize] = Some(is_turned ^ same);
                        waiting.push(other);
                    }
                    Some(known) if known != is_turned ^ same => {
                        return Err("its faces have no inside and outside".into());
                    }
                    Some(_) => {}
                }
            }
        }
        // Euler's formula: so many for a surface like that of a ball.
        let is_ball = self.corners + self.faces.len() == pairs.len() / 2 + 2;
        let turned: Option<Vec<bool>> = turned.into_iter().collect();
        turned.filter(|_| is_ball).ok_or_else(|| {
            "its faces are not one closed surface, or it touches itself or has a hole through it".into()
        })
    }

    fn place(&self, corner: u32) -> DVec3 {
        self.points[corner as usize].place
    }

    /// Twice the area of a face as a vector at right angles to it.
    fn normal(&self, face: &[u32]) -> DVec3 {
        let from = self.place(face[0]);
        face[1..].windows(2).map(|pair| (self.place(pair[0]) - from).cross(self.place(pair[1]) - from)).sum()
    }

    fn has_area(&self, face: &[u32]) -> bool {
        let sides = |pair: &[u32]| self.place(pair[0]).distance_squared(self.place(pair[1]));
        self.normal(face).length() > ROUNDING * face.windows(2).map(sides).sum::<f64>()
    }

    /// How round a triangle of a face with this normal is, seen along that; 0 if it is turned, or may be.
    fn roundness(&self, [a, b, c]: [u32; 3], normal: DVec3) -> f64 {
        let [a, b, c] = [a, b, c].map(|corner| self.place(corner));
        let area = (b - a).cross(c - a).dot(normal) / normal.length();
        let longest = [a - b, b - c, c - a].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
        if area > ROUNDING * longest { area / longest } else { 0.0 }
    }

    /// The triangles of a face whose points are in their order, if there is a way to cut it, and whether they are those from its first point.
    fn cut(&self, face: &[u32]) -> Option<(Vec<[u32; 3]>, bool)> {
        if !self.has_area(face) {
            return None;
        }
        let normal = self.normal(face);
        let fan: Vec<[u32; 3]> = face[1..].windows(2).map(|pair| [face[0], pair[0], pair[1]]).collect();
        let worst =
            fan.iter().map(|&triangle| self.roundness(triangle, normal)).fold(f64::INFINITY, f64::min);
        let is_good = worst > SLIVER && fan.iter().all(|triangle| self.is_along(triangle, normal));
        if fan.len() > 1 && !is_good && face.len() <= MOST_POINTS {
            let (best, triangles) = self.roundest(face, normal);
            if worst < 0.5 * best {
                return Some((triangles, false));
            }
        }
        (worst > 0.0).then_some((fan, true))
    }

    /// Whether a triangle of a face looks almost to where the face does.
    fn is_along(&self, triangle: &[u32; 3], normal: DVec3) -> bool {
        let own = self.normal(triangle);
        own.dot(normal) > 0.99 * own.length() * normal.length()
    }

    /// The triangles of a face of which the worst one is as round as can be, and how round that is.
    fn roundest(&self, face: &[u32], normal: DVec3) -> (f64, Vec<[u32; 3]>) {
        let n = face.len();
        // Of the part of a face from one point to another: how round its worst triangle is, and the third point of that at the edge between them.
        let mut best = vec![(f64::INFINITY, 0); n * n];
        for width in 2..n {
            for from in 0..n - width {
                let to = from + width;
                let of = |by: usize| {
                    let own = self.roundness([face[from], face[by], face[to]], normal);
                    own.min(best[from * n + by].0).min(best[by * n + to].0)
                };
                let first = (of(from + 1), from + 1);
                best[from * n + to] =
                    (from + 2..to).map(|by| (of(by), by)).fold(first, |a, b| if b.0 > a.0 { b } else { a });
            }
        }
        let (mut triangles, mut parts) = (Vec::with_capacity(n), vec![(0, n - 1)]);
        while let Some((from, to)) = parts.pop() {
            if to - from > 1 {
                let by = best[from * n + to].1;
                triangles.push([face[from], face[by], face[to]]);
                parts.extend([(from, by), (by, to)]);
            }
        }
        (best[n - 1].0, triangles)
    }

    /// Six times the volume between a point and the surface, and what of it may be rounding.
    fn volume(&self, point: DVec3) -> (f64, f64) {
        self.surface
            .iter()
            .map(|triangle| self.six_volumes(point, triangle))
            .fold((0.0, 0.0), |(sum, off), (volume, rounding)| (sum + volume, off + rounding))
    }

    /// Six times the volume between a point and a triangle, and what of it may be rounding.
    fn six_volumes(&self, point: DVec3, triangle: &[u32; 3]) -> (f64, f64) {
        let [a, b, c] = triangle.map(|corner| self.place(corner) - point);
        (a.cross(b).dot(c), ROUNDING * a.length() * b.length() * c.length())
    }

    /// The least part of the whole that a tetrahedron is, of those that join a point to the triangles that it is not on; 0 if one is
    /// turned, or may be.
    fn least(&self, point: DVec3, whole: f64, corner: Option<u32>) -> f64 {
        let mut least = f64::INFINITY;
        for triangle in
            self.surface.iter().filter(|triangle| corner.is_none_or(|corner| !triangle.contains(&corner)))
        {
            let (volume, rounding) = self.six_volumes(point, triangle);
            if volume <= rounding {
                return 0.0;
            }
            least = least.min(volume / whole);
        }
        least
    }

    /// The point that is joined to the surface, if there is one that sees all of it.
    fn point(&self) -> Option<Point> {
        let corners = &self.points[..self.corners];
        let (whole, _) = self.volume(self.place(0));
        let mut best = (0.0, None);
        for corner in 0..self.corners.min(MOST_CORNERS) as u32 {
            let least = self.least(self.place(corner), whole, Some(corner));
            if least > SMALL {
                return Some(Point::Corner(corner));
            }
            if least > best.0 {
                best = (least, Some(Point::Corner(corner)));
            }
        }
        let equal = std::iter::once(vec![1.0; corners.len()]);
        for weights in equal.chain(std::iter::once_with(|| self.kernel()).flatten()) {
            let place = self.mean_of_corners(&weights);
            let least = self.least(place, whole, None);
            if least > SMALL {
                return Some(Point::Added(place, weights));
            }
            if least > best.0 {
                best = (least, Some(Point::Added(place, weights)));
            }
        }
        best.1
    }

    fn mean_of_corners(&self, weights: &[f64]) -> DVec3 {
        let corners = &self.points[..self.corners];
        let axis =
            |axis: usize| mean(corners.iter().map(|corner| corner.place[axis]).zip(weights.iter().copied()));
        DVec3::new(axis(0), axis(1), axis(2))
    }

    /// The weights of the corners at a point that sees all triangles well.
    ///
    /// Corners against triangles are a game, in which the distance of the corner from the plane of the triangle is won: each side plays
    /// what is best against all that the other one has played. The corners that were played are then the mix whose least distance is
    /// the largest.
    fn kernel(&self) -> Option<Vec<f64>> {
        let corners = &self.points[..self.corners];
        let planes: Vec<(DVec3, DVec3)> = self
            .surface
            .iter()
            .map(|&[a, b, c]| {
                let [a, b, c] = [a, b, c].map(|corner| self.place(corner));
                ((b - a).cross(c - a).normalize_or_zero(), a)
            })
            .collect();
        // Outward normals: inside is negative.
        let distance = |&(normal, at): &(DVec3, DVec3), corner: &Corner| normal.dot(at - corner.place);
        let mut plays = vec![1.0; corners.len()];
        let center = self.mean_of_corners(&plays);
        let all = corners.len() as f64;
        let mut of_planes: Vec<f64> =
            planes.iter().map(|(normal, at)| all * normal.dot(*at - center)).collect();
        let mut of_corners = vec![0.0; corners.len()];
        let mut best: Option<(f64, Vec<f64>)> = None;
        for round in 0..ROUNDS {
            let (worst, least) = of_planes.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
            let least = least / (corners.len() + round) as f64;
            if least > best.as_ref().map_or(0.0, |(least, _)| *least) {
                best = Some((least, plays.clone()));
            }
            for (sum, corner) in of_corners.iter_mut().zip(corners) {
                *sum += distance(&planes[worst], corner);
            }
            // Of equals the first.
            let next =
                (0..of_corners.len()).rev().max_by(|&a, &b| of_corners[a].total_cmp(&of_corners[b]))?;
            plays[next] += 1.0;
            for (sum, plane) in of_planes.iter_mut().zip(&planes) {
                *sum += distance(plane, &corners[next]);
            }
        }
        best.map(|(_, plays)| plays)
    }
}

/// Why a cell is refused that no point can be joined to all faces of.
const CONCAVE: &str = "it is concave or its faces are bent, and no point in it sees all of them";

/// The point that a cell's tetrahedra have in common.
enum Point {
    Corner(u32),
    /// With the weights of the corners.
    Added(DVec3, Vec<f64>),
}

/// A face from its first point on, by number, toward the lower one of the two beside it; and whether that is the other way round.
fn in_order(face: &[u32]) -> (Vec<u32>, bool) {
    let n = face.len();
    let first = (0..n).min_by_key(|&i| face[i]).unwrap_or(0);
    let reversed = n > 0 && face[(first + 1) % n] > face[(first + n - 1) % n];
    let step = if reversed { n - 1 } else { 1 };
    ((0..n).map(|i| face[(first + i * step) % n]).collect(), reversed)
}
