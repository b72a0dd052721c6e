//! What is left of a part of the domain, and the updates that were made of the rest: what steps hand to each other.
//!
//! What is left travels with all of its reference vertices ([`super::points_frame`]), the buckets they are in, the errors and the numbers of the updates that made each
//! tetrahedron, and the boundary of the reference mesh: so a node that joins eight of them goes on as if nothing had happened, errors stay exact
//! and monotone, and one part alone gives the bytes of a whole.

use super::PartsError;
use super::plan::{Node, Plan};
use super::points_frame::{self, PointsInBuckets};
use super::wire::{read_frame, read_magic, read_numbers, skip_frame, write_frame, write_magic};
use crate::error::points::PointId;
use crate::lattice::sides::Sides;
use crate::scratch::Scratch;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::io::{Read, Seek, SeekFrom, Write};
use tetralod::geom::orient3d;
use tetralod::mesh::NONE;

/// A part of the domain with what is left of its mesh; [`super`] tells what it is for.
pub struct Part<'s> {
    pub(super) head: Head,
    pub(super) piece: Piece,
    /// The points in buckets, once it has been built; none where [assembling](super::assemble) reads it.
    pub(super) in_buckets: Option<PointsInBuckets<'s>>,
}

/// The updates that were made of a part, in the order of the MT.
#[derive(Clone, Debug, PartialEq)]
pub struct PartUpdates {
    pub(super) head: Head,
    pub(super) rows: UpdateRows,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Head {
    pub plan: Plan,
    pub node: Node,
    /// Whether it has been built: updates follow then, before what is left.
    pub built: bool,
}

/// An update of a node: the node, and its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct Made {
    pub node: Node,
    pub update: u32,
}

/// A mesh, what its vertices were, and where they are now. Points and tetrahedra are numbers of this piece unless it says otherwise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Piece {
    /// The reference vertex of the whole for each point that has a number: those of the mesh that the piece was before it was built,
    /// ascending, then others on the boundary of the reference mesh.
    pub points: Vec<u32>,
    /// On the lattice of the whole.
    pub positions: Vec<[i32; 3]>,
    /// Point by point and field by field.
    pub values: Vec<f64>,
    pub tets: Vec<[u32; 4]>,
    /// For each tetrahedron what made it, as a place in `earlier`; [`NONE`] for those of the reference mesh. Empty if all are.
    pub makers: Vec<u32>,
    /// Which of its faces were inside then: see `Collapses::inner`.
    pub inner: Vec<u8>,
    /// The updates that are the inverses of what made tetrahedra.
    pub earlier: Vec<Made>,
    /// The region of each tetrahedron, if regions are kept apart; else empty.
    pub regions: Vec<u32>,
    /// Where fields jump between regions.
    pub sided: Sided,
    /// How many points those of the mesh are. All others, with what they have, are in a frame of their own.
    #[serde(skip)]
    pub vertices: usize,
    /// In a frame of its own.
    #[serde(skip)]
    pub carried: Carried,
}

/// What assembling needs of a piece, as it is written: read as a [`Piece`].
#[derive(Serialize)]
struct MeshFrame<'a> {
    points: &'a [u32],
    positions: &'a [[i32; 3]],
    values: &'a [f64],
    tets: &'a [[u32; 4]],
    makers: &'a [u32],
    inner: &'a [u8],
    earlier: &'a [Made],
    regions: &'a [u32],
    sided: SidedFrame<'a>,
}

/// [`Sided`], as it is written.
#[derive(Serialize)]
struct SidedFrame<'a> {
    first: &'a [u32],
    further: &'a [(u32, u32)],
    values: &'a [f64],
}

/// The points of a piece that are not of its mesh, as they are written: read as [`OtherPoints`].
type OtherPointsFrame<'a> = (&'a [u32], &'a [[i32; 3]], &'a [f64], SidedFrame<'a>);
type OtherPoints = (Vec<u32>, Vec<[i32; 3]>, Vec<f64>, Sided);

/// What a piece needs to be simplified further, and assembling does not.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Carried {
    /// For each point the square of the shortest edge of the reference mesh there; see `Quantized::shortest_edges`.
    pub shortest: Vec<f64>,
    /// Points that the lattice has moved, and where they were, in its steps.
    pub moved: Vec<(u32, [f64; 3])>,
    /// Points that belong to other parts, too, and the first and the last part that has them.
    pub shared: Vec<(u32, u32, u32)>,
    /// Faces to other parts, their corners ascending, and the part behind each.
    pub interface: Vec<([u32; 3], u32)>,
    /// The errors of [`Piece::earlier`], field by field.
    pub earlier_errors: Vec<u16>,
    /// Points that are in buckets before the part is built, and of which tetrahedron: see `error::cost`.
    pub inside: Vec<(u32, u32)>,
    /// Those of these that are outside of their tetrahedra.
    pub outside: Vec<u32>,
    pub border: Vec<(u32, u32)>,
    /// Points outside of their tetrahedra by their names, and others that contain them.
    pub foreign: Vec<(PointId, u32)>,
    /// The boundary of the reference mesh, once the part has been built.
    pub boundary: Vec<[u32; 3]>,
    /// Points that stay where they are, ascending.
    pub kept: Vec<u32>,
    /// How far the removal of each vertex reaches, once the part has been built: see `order::reach`.
    pub reaches: Vec<(u32, [[i32; 3]; 2])>,
}

/// The values of points in further regions: see `lattice::sides`. All is empty where no field jumps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sided {
    /// The first region of each point in the whole.
    pub first: Vec<u32>,
    /// The point and the region of each side, ascending: all that the points have in the whole. As numbers they follow those of the points.
    pub further: Vec<(u32, u32)>,
    /// Side by side and field by field.
    pub values: Vec<f64>,
}

/// What is wrong where points have no values.
const LACKS_VALUES: &str = "its points lack values";

/// Updates in their order, and what removes the tetrahedra of their stars.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct UpdateRows {
    /// The reference vertex that each inserts.
    pub vertices: Vec<u32>,
    /// The reference vertex near to it, and how far from there it is.
    pub near: Vec<u32>,
    pub offsets: Vec<[i32; 3]>,
    /// Field by field.
    pub errors: Vec<u16>,
    /// How many tetrahedra each inserts.
    pub stars: Vec<u8>,
    /// For each of these what removes it.
    pub removers: Vec<RemoverCode>,
    /// Which of its faces go with it: see `Collapses::inner`.
    pub inner: Vec<u8>,
    pub earlier: Vec<Made>,
}

/// What removes a tetrahedron that an update inserts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Remover {
    /// Nothing: it is one of the reference mesh.
    Nothing,
    /// An update of these rows, by its number.
    Own(u32),
    /// An update of an earlier step, by its place in [`UpdateRows::earlier`].
    Earlier(u32),
}

/// A [`Remover`] as one number, as it is kept and written: 0 for nothing, `2 u + 1` for [`Remover::Own`], `2 i + 2` for
/// [`Remover::Earlier`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct RemoverCode(pub u32);

impl From<Remover> for RemoverCode {
    fn from(remover: Remover) -> Self {
        Self(match remover {
            Remover::Nothing => 0,
            Remover::Own(update) => 2 * update + 1,
            Remover::Earlier(place) => 2 * place + 2,
        })
    }
}

impl From<RemoverCode> for Remover {
    fn from(RemoverCode(code): RemoverCode) -> Self {
        match code.checked_sub(1) {
            None => Self::Nothing,
            Some(code) if code % 2 == 0 => Self::Own(code / 2),
            Some(code) => Self::Earlier(code / 2),
        }
    }
}

impl Sided {
    /// Those that these points have; `values` are the values of a point of the whole, or of one of its sides.
    pub fn of<V: Iterator<Item = f64>>(points: &[u32], sides: &Sides, values: impl Fn(u32) -> V) -> Self {
        if sides.is_empty() {
            return Self::default();
        }
        let of = |(i, &v): (u32, &u32)| sides.further(v).map(move |(side, region)| (side, (i, region)));
        let (own, further): (Vec<u32>, Vec<(u32, u32)>) = (0..).zip(points).flat_map(of).unzip();
        let first = points.iter().map(|&v| sides.region(v)).collect();
        Self { first, further, values: own.into_iter().flat_map(values).collect() }
    }

    /// Those of several pieces as those of one, of so many points; `numbers` has for each piece where its points are there, [`NONE`] for those
    /// that are not.
    pub fn joined(pieces: &[Piece], points: usize, fields: usize, numbers: &[Vec<u32>]) -> Self {
        let own = |(piece, numbers): (&Piece, &Vec<u32>)| -> Vec<(u32, u32)> {
            piece.sided.further.iter().map(|&(v, region)| (numbers[v as usize], region)).collect()
        };
        let of_pieces: Vec<Vec<(u32, u32)>> = pieces.iter().zip(numbers).map(own).collect();
        let mut further = of_pieces.concat();
        further.retain(|(v, _)| *v != NONE);
        further.sort_unstable();
        further.dedup();
        let jumps = pieces.iter().any(|piece| !piece.sided.first.is_empty());
        let mut first = vec![0; if jumps { points } else { 0 }];
        let mut values = vec![0.0; further.len() * fields];
        for ((Piece { sided, .. }, own), numbers) in pieces.iter().zip(of_pieces).zip(numbers) {
            let known = |v: u32| v != NONE;
            for (&region, &v) in sided.first.iter().zip(numbers).filter(|(_, v)| known(**v)) {
                first[v as usize] = region;
            }
            for (side, of_side) in
                own.iter().zip(sided.values.chunks(fields)).filter(|(side, _)| known(side.0))
            {
                let at = further.partition_point(|other| other < side);
                values[at * fields..][..fields].copy_from_slice(of_side);
            }
        }
        Self { first, further, values }
    }
}

/// What some have of each, of so many, and what the others have; nothing if there is nothing.
fn parted<T>(all: &[T], some: usize, of: usize) -> (&[T], &[T]) {
    all.split_at(all.len() / of.max(1) * some)
}

impl Piece {
    /// As it is written.
    fn frames(&self) -> (MeshFrame<'_>, OtherPointsFrame<'_>) {
        let (vertices, all) = (self.vertices, self.points.len());
        let (points, other_points) = self.points.split_at(vertices);
        let (positions, other_positions) = self.positions.split_at(vertices);
        let (values, other_values) = parted(&self.values, vertices, all);
        let Sided { first, further, values: of_sides } = &self.sided;
        let (first, other_first) = parted(first, vertices, all);
        let sides = further.partition_point(|(v, _)| (*v as usize) < vertices);
        let (of_sides, other_of_sides) = parted(of_sides, sides, further.len());
        let (further, other_further) = further.split_at(sides);
        let sided = SidedFrame { first, further, values: of_sides };
        let others = SidedFrame { first: other_first, further: other_further, values: other_of_sides };
        let Self { tets, makers, inner, earlier, regions, .. } = self;
        let mesh = MeshFrame { points, positions, values, tets, makers, inner, earlier, regions, sided };
        (mesh, (other_points, other_positions, other_values, others))
    }

    /// Adds the other points.
    fn extend(&mut self, (points, positions, values, sided): OtherPoints) {
        self.points.extend(points);
        self.positions.extend(positions);
        self.values.extend(values);
        self.sided.first.extend(sided.first);
        self.sided.further.extend(sided.further);
        self.sided.values.extend(sided.values);
    }

    /// Leaves the points of the mesh alone, as if no others had been read.
    pub fn keep_mesh(&mut self, fields: usize) {
        let vertices = self.vertices;
        self.points.truncate(vertices);
        self.positions.truncate(vertices);
        self.values.truncate(vertices * fields);
        self.sided.first.truncate(vertices);
        let sides = self.sided.further.partition_point(|(v, _)| (*v as usize) < vertices);
        self.sided.further.truncate(sides);
        self.sided.values.truncate(sides * fields);
        self.carried = Carried::default();
    }

    /// The points of several pieces, each once, which are to be [put](Self::put) there.
    pub fn over<'p>(pieces: impl Iterator<Item = &'p Vec<u32>>, fields: usize) -> Self {
        let mut points: Vec<u32> = pieces.flatten().copied().collect();
        points.sort_unstable();
        points.dedup();
        let count = points.len();
        let (positions, values, shortest) =
            (vec![[0; 3]; count], vec![0.0; count * fields], vec![0.0; count]);
        let carried = Carried { shortest, ..Carried::default() };
        Self { points, positions, values, carried, ..Self::default() }
    }

    /// Where these points are here, where they ascend; these mostly do.
    pub fn places(&self, points: &[u32]) -> Vec<u32> {
        let mut at = 0;
        let place = |&point: &u32| {
            if self.points.get(at).is_some_and(|&last| point < last) {
                at = 0;
            }
            at += self.points[at..].partition_point(|&other| other < point);
            at as u32
        };
        points.iter().map(place).collect()
    }

    /// Puts what a piece has of points to where they are here, unless that is [`NONE`].
    pub fn put(&mut self, places: &[u32], positions: &[[i32; 3]], values: &[f64], shortest: &[f64]) {
        let fields = values.len() / places.len().max(1);
        for (i, &at) in places.iter().enumerate().filter(|(_, at)| **at != NONE) {
            let at = at as usize;
            self.positions[at] = positions[i];
            self.carried.shortest[at] = shortest[i];
            self.values[at * fields..][..fields].copy_from_slice(&values[i * fields..][..fields]);
        }
    }
}

impl UpdateRows {
    /// The first so many updates, and the others.
    pub fn split(mut self, count: usize, fields: usize) -> (Self, Self) {
        let star = self.stars[..count].iter().map(|&star| usize::from(star)).sum();
        let rest = Self {
            vertices: self.vertices.split_off(count),
            near: self.near.split_off(count),
            offsets: self.offsets.split_off(count),
            errors: self.errors.split_off(count * fields),
            stars: self.stars.split_off(count),
            removers: self.removers.split_off(star),
            inner: self.inner.split_off(star),
            earlier: self.earlier.clone(),
        };
        (self, rest)
    }
}

impl Plan {
    /// Reads the plan that a part belongs to, and no more of it.
    ///
    /// # Errors
    /// If `input` fails, or holds no part.
    pub fn read(input: &mut dyn Read) -> Result<Self, PartsError> {
        read_magic(input)?;
        let head: Head = read_frame(input)?;
        Ok(head.plan)
    }
}

impl fmt::Debug for Part<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Part").field("head", &self.head).field("piece", &self.piece).finish_non_exhaustive()
    }
}

impl<'s> Part<'s> {
    /// A part of the reference mesh.
    pub(super) fn of(plan: &Plan, index: u32, mut piece: Piece) -> Self {
        piece.vertices = piece.points.len();
        let head = Head { plan: plan.clone(), node: Node { level: 0, index }, built: false };
        Self { head, piece, in_buckets: None }
    }

    /// Which part it is.
    pub fn node(&self) -> Node {
        self.head.node
    }

    /// Tetrahedra that are left.
    pub fn tetrahedra(&self) -> usize {
        self.piece.tets.len()
    }

    /// Writes a part that has not been built.
    ///
    /// # Errors
    /// If `out` fails.
    pub fn write(&self, out: &mut dyn Write) -> Result<(), PartsError> {
        write_magic(out)?;
        write_frame(out, &self.head)?;
        self.write_piece(out)
    }

    /// Writes a part that has been built, with its updates.
    ///
    /// # Errors
    /// If `out` fails.
    pub fn write_built(&self, updates: &PartUpdates, out: &mut dyn Write) -> Result<(), PartsError> {
        let Some((in_buckets, _)) = &self.in_buckets else {
            return Err(PartsError::Damaged { what: "it has not been built" });
        };
        write_magic(out)?;
        write_frame(out, &self.head)?;
        write_frame(out, &updates.rows)?;
        self.write_piece(out)?;
        points_frame::write(out, in_buckets)
    }

    fn write_piece(&self, out: &mut dyn Write) -> Result<(), PartsError> {
        let (mesh, others) = self.piece.frames();
        write_frame(out, &mesh)?;
        write_frame(out, &others)?;
        write_frame(out, &self.piece.carried)
    }

    /// Reads a part, built or not; `scratch` has those of its points that are not kept in memory.
    ///
    /// # Errors
    /// If `input` or `scratch` fails, or `input` holds no whole and sound part.
    pub fn read<R: Read + Seek>(input: &mut R, scratch: &'s dyn Scratch) -> Result<Self, PartsError> {
        let mut part = Self::read_first(input)?;
        part.piece.extend(read_numbers(input)?);
        part.piece.carried = read_numbers(input)?;
        part.check().and_then(|()| part.check_carried()).map_err(|what| PartsError::Damaged { what })?;
        let Head { plan, node, built } = &part.head;
        if *built {
            let name = format!("points-{}-{}", node.level, node.index);
            let tets = part.piece.tets.len();
            part.in_buckets = Some(points_frame::read(input, plan, tets, (scratch, name))?);
        }
        Ok(part)
    }

    /// Reads what assembling needs of a part, and no more of it: it cannot be joined.
    ///
    /// # Errors
    /// As [`Part::read`], but for what is not read.
    pub fn read_mesh<R: Read + Seek>(input: &mut R) -> Result<Self, PartsError> {
        let part = Self::read_first(input)?;
        part.check().map_err(|what| PartsError::Damaged { what })?;
        Ok(part)
    }

    /// Reads up to the points of the mesh.
    fn read_first<R: Read + Seek>(input: &mut R) -> Result<Self, PartsError> {
        read_magic(input)?;
        let head: Head = read_frame(input)?;
        if head.built {
            skip_frame(input)?;
        }
        let mut piece: Piece = read_numbers(input)?;
        piece.vertices = piece.points.len();
        Ok(Self { head, piece, in_buckets: None })
    }

    /// Reads what a part that has been built is of, and checks that it is as long as it says; the rest of it is not read.
    ///
    /// # Errors
    /// If `input` fails, or holds no part that has been built, or not the whole of one.
    pub fn survey<R: Read + Seek>(input: &mut R) -> Result<(Plan, Node), PartsError> {
        read_magic(input)?;
        let Head { plan, node, built } = read_frame(input)?;
        if !built {
            return Err(PartsError::Damaged { what: "it has not been built" });
        }
        (0..5).try_for_each(|_| skip_frame(input))?;
        let end = input.stream_position()?;
        if input.seek(SeekFrom::End(0))? == end {
            Ok((plan, node))
        } else {
            Err(PartsError::Damaged { what: "its length is another one" })
        }
    }

    /// Checks what building and assembling rely on.
    fn check(&self) -> Result<(), &'static str> {
        let Self { head: Head { plan, node, .. }, piece, .. } = self;
        let (points, fields) = (piece.points.len(), plan.fields.len());
        expect(plan.has(*node) && fields > 0, "it is not of its plan")?;
        let rise = |points: &[u32]| points.windows(2).all(|pair| pair[0] < pair[1]);
        let mut sorted = piece.points.clone();
        sorted.sort_unstable();
        let known = sorted.last().is_none_or(|&last| last < plan.counts.0);
        expect(known && rise(&sorted) && rise(&piece.points[..piece.vertices]), "its points are others")?;
        let side = plan.lattice_side();
        let is_on = |p: &[i32; 3]| p.iter().all(|x| (0..=side).contains(x));
        let are_finite = piece.values.iter().all(|x| x.is_finite());
        let lengths = [piece.positions.len(), piece.values.len() / fields];
        expect(lengths == [points; 2] && piece.values.len() == points * fields, LACKS_VALUES)?;
        expect(are_finite && piece.positions.iter().all(is_on), "its points are off the lattice")?;
        let at = |v: u32| piece.positions[..piece.vertices].get(v as usize);
        let is_positive = |&[a, b, c, d]: &[u32; 4]| {
            let all = at(a).zip(at(b)).zip(at(c).zip(at(d)));
            all.is_some_and(|((&a, &b), (&c, &d))| orient3d(a, b, c, d) > 0)
        };
        expect(
            !piece.tets.is_empty() && piece.tets.iter().all(is_positive),
            "a tetrahedron is not positive",
        )?;
        let regions = plan.region_count();
        let Sided { first, further, values } = &piece.sided;
        let of_regions = if plan.jumps().is_empty() { 0 } else { points };
        let is_side = |(v, region): &(u32, u32)| (*v as usize) < points && *region < regions;
        let are_sides = further.iter().all(is_side) && further.windows(2).all(|pair| pair[0] < pair[1]);
        let has_all = first.len() == of_regions && values.len() == further.len() * fields;
        expect(has_all && (of_regions > 0 || further.is_empty()), "its points lack values of regions")?;
        let are_known = first.iter().all(|region| *region < regions) && values.iter().all(|x| x.is_finite());
        expect(are_sides && are_known, "its points are of other regions")?;
        let (tets, earlier) = (piece.tets.len(), piece.earlier.len());
        let labelled = if plan.regions.is_some() { tets } else { 0 };
        expect(piece.regions.len() == labelled, "its tetrahedra lack regions")?;
        let made = |&maker: &u32| maker == NONE || (maker as usize) < earlier;
        let marks = [piece.makers.len(), piece.inner.len()];
        expect(marks == [0; 2] || marks == [tets; 2], "its tetrahedra lack marks")?;
        expect(piece.makers.iter().all(made), "its tetrahedra have other marks")?;
        expect(piece.earlier.iter().all(|made| plan.has(made.node)), "its updates are others")
    }

    /// Checks what building relies on besides.
    fn check_carried(&self) -> Result<(), &'static str> {
        let Self {
            head: Head { plan, .. }, piece: Piece { points, tets, earlier, sided, carried, .. }, ..
        } = self;
        let points = points.len();
        expect(carried.shortest.len() == points, LACKS_VALUES)?;
        expect(carried.earlier_errors.len() == earlier.len() * plan.fields.len(), "its updates lack errors")?;
        let is_point = |v: &u32| (*v as usize) < points;
        let is_any = |v: &u32| (*v as usize) < points + sided.further.len();
        let is_tet = |t: &u32| (*t as usize) < tets.len();
        let are_buckets = carried.inside.iter().all(|(v, t)| is_any(v) && is_tet(t))
            && carried.border.iter().all(|(v, t)| is_point(v) && is_tet(t))
            && carried.foreign.iter().all(|(_, t)| is_tet(t));
        expect(are_buckets, "its buckets are others")?;
        let refers = carried.outside.iter().all(is_any)
            && carried.moved.windows(2).all(|pair| pair[0].0 < pair[1].0)
            && carried.moved.iter().all(|(v, place)| is_point(v) && place.iter().all(|x| x.is_finite()))
            && carried.shared.iter().all(|(v, first, last)| is_point(v) && first <= last)
            && carried.reaches.iter().all(|(v, _)| is_point(v))
            && carried.kept.iter().all(is_point)
            && carried.interface.iter().all(|(face, _)| face.iter().all(is_point))
            && carried.boundary.iter().all(|face| face.iter().all(is_point));
        expect(refers, "it refers to other points")
    }
}

impl PartUpdates {
    /// Which part they were made of.
    pub fn node(&self) -> Node {
        self.head.node
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.rows.vertices.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.rows.vertices.is_empty()
    }

    /// Reads the updates of a part that has been built.
    ///
    /// # Errors
    /// If `input` fails, or holds no whole and sound part that has been built.
    pub fn read(input: &mut dyn Read) -> Result<Self, PartsError> {
        read_magic(input)?;
        let head: Head = read_frame(input)?;
        if !head.built {
            return Err(PartsError::Damaged { what: "it has not been built" });
        }
        let rows: UpdateRows = read_numbers(input)?;
        let updates = Self { head, rows };
        updates.check().map_err(|what| PartsError::Damaged { what })?;
        Ok(updates)
    }

    /// Checks what assembling relies on.
    fn check(&self) -> Result<(), &'static str> {
        let Self { head: Head { plan, node, .. }, rows } = self;
        let (count, fields) = (rows.vertices.len(), plan.fields.len());
        expect(plan.has(*node) && fields > 0, "it is not of its plan")?;
        let lengths = [rows.near.len(), rows.offsets.len(), rows.stars.len(), rows.errors.len() / fields];
        expect(lengths == [count; 4] && rows.errors.len() == count * fields, "its updates lack parts")?;
        let inserted: usize = rows.stars.iter().map(|&star| usize::from(star)).sum();
        expect([rows.removers.len(), rows.inner.len()] == [inserted; 2], "its updates lack tetrahedra")?;
        let known = |&v: &u32| v < plan.counts.0;
        expect(rows.vertices.iter().chain(&rows.near).all(known), "its updates have other points")?;
        let fits = |&code: &RemoverCode| match Remover::from(code) {
            Remover::Nothing => true,
            Remover::Own(update) => (update as usize) < count,
            Remover::Earlier(place) => (place as usize) < rows.earlier.len(),
        };
        let all_fit = rows.removers.iter().all(fits) && rows.earlier.iter().all(|made| plan.has(made.node));
        expect(all_fit, "its updates refer to others")
    }
}

fn expect(holds: bool, what: &'static str) -> Result<(), &'static str> {
    if holds { Ok(()) } else { Err(what) }
}

#[cfg(test)]
mod tests {
    use super::super::{build_part, part};
    use super::*;
    use crate::BuildConfig;
    use crate::scratch::InMemory;
    use std::collections::BTreeMap;
    use std::io::Cursor;
    use std::ops::ControlFlow;
    use tetralod::mesh::{Field, Grid, TetMesh};

    /// What is wrong, and how it gets so.
    type Change<'a, T> = (&'a str, &'a dyn Fn(&mut T));

    /// A part as it is written first, and when it has been built, and its updates.
    fn parts() -> ([Vec<u8>; 2], PartUpdates) {
        let grid = Grid { dims: [13; 3], origin: [0.0; 3], spacing: [1.0; 3] };
        let values = (0..13_u32.pow(3)).map(|i| f64::from(i * i % 997)).collect();
        let mesh = TetMesh::from_grid(grid, vec![Field::new("h", values)]);
        let mut first = None;
        let put = &mut |part| {
            first.get_or_insert(part);
            Ok(())
        };
        part(&mesh, &BuildConfig::default(), 2, BTreeMap::new(), put).expect("a mesh that can be parted");
        let (first, scratch) = (first.expect("a part"), InMemory::default());
        let (mut parted, mut bytes) = (Vec::new(), Vec::new());
        first.write(&mut parted).expect("bytes");
        let go_on = &mut |_| ControlFlow::Continue(());
        let (built, updates) = build_part(first, &scratch, go_on).expect("a part to build");
        built.write_built(&updates, &mut bytes).expect("bytes");
        ([parted, bytes], updates)
    }

    fn read<'s>(bytes: &[u8], scratch: &'s InMemory) -> Result<Part<'s>, PartsError> {
        Part::read(&mut Cursor::new(bytes), scratch)
    }

    #[test]
    fn a_part_is_surveyed_by_its_head_and_its_length() {
        let ([unbuilt, bytes], updates) = parts();
        let survey = |bytes: &[u8]| Part::survey(&mut Cursor::new(bytes));
        assert_eq!(survey(&bytes).expect("a whole part"), (updates.head.plan, updates.head.node));
        let longer = [&bytes[..], b"x"].concat();
        for other in [&bytes[..bytes.len() - 1], &bytes[..bytes.len() / 2], &longer, &unbuilt] {
            assert!(matches!(survey(other), Err(PartsError::Damaged { .. })), "{} bytes", other.len());
        }
        assert!(matches!(survey(b"something else"), Err(PartsError::Format)));
    }

    #[test]
    fn content_with_good_checksums_is_not_trusted() {
        let (written, updates) = parts();
        let scratch = InMemory::default();
        let beyond = read(&written[0], &scratch).expect("a part").piece.points.len() as u32;
        let changes: [Change<'_, Piece>; 12] = [
            ("a tetrahedron inside out", &|p| p.tets[0].swap(0, 1)),
            ("a flat tetrahedron", &|p| p.tets[0][1] = p.tets[0][0]),
            ("a corner that is no point", &|p| p.tets[0][3] = beyond),
            ("points out of order", &|p| p.points.swap(3, 4)),
            ("a point that the whole lacks", &|p| p.points[beyond as usize - 1] = u32::MAX),
            ("a point off the lattice", &|p| p.positions[0][1] = -1),
            ("no number", &|p| p.values[0] = f64::NAN),
            ("a value too few", &|p| p.values.truncate(1)),
            ("no tetrahedra", &|p| p.tets.clear()),
            ("a bucket of no tetrahedron", &|p| p.carried.inside.push((0, u32::MAX))),
            ("a mark of no update", &|p| p.makers = vec![p.earlier.len() as u32; p.tets.len()]),
            ("a kept point that is none", &|p| p.carried.kept.push(beyond)),
        ];
        for (what, change) in changes {
            for bytes in &written {
                let mut part = read(bytes, &scratch).expect("a part");
                change(&mut part.piece);
                let mut bytes = Vec::new();
                if part.head.built { part.write_built(&updates, &mut bytes) } else { part.write(&mut bytes) }
                    .expect("bytes");
                drop(part);
                assert!(matches!(read(&bytes, &scratch), Err(PartsError::Damaged { .. })), "{what}");
            }
        }
        let built = read(&written[1], &scratch).expect("a part");
        let changes: [Change<'_, UpdateRows>; 6] = [
            ("a vertex that the whole lacks", &|r| r.vertices[0] = u32::MAX),
            ("a near vertex that the whole lacks", &|r| r.near[0] = u32::MAX),
            ("an update without an error", &|r| r.errors.clear()),
            ("a tetrahedron too many", &|r| r.stars[0] += 1),
            ("a remover that is no update", &|r| r.removers[0] = RemoverCode(u32::MAX)),
            ("a remover that was none before", &|r| {
                r.removers[0] = Remover::Earlier(r.earlier.len() as u32).into()
            }),
        ];
        for (what, change) in changes {
            let mut updates = updates.clone();
            change(&mut updates.rows);
            let mut bytes = Vec::new();
            built.write_built(&updates, &mut bytes).expect("bytes");
            let read = PartUpdates::read(&mut Cursor::new(&bytes));
            assert!(matches!(read, Err(PartsError::Damaged { .. })), "{what}");
        }
    }
}
