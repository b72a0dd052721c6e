//! The parts of a mesh that comes in pieces: of the whole no more is in memory than a piece or a part at a time, and what is known of the
//! points at which pieces meet.
//!
//! The parts are those that [`part`](super::part) makes of the whole, byte for byte. What several passes need lies in a [`Scratch`].

use super::PartsError;
use super::cut::{Places, shift};
use super::fragments::{Band, Fragments, PieceParts};
use super::partition::{between, shared_faces};
use super::piece::Part;
use super::plan::{Plan, purpose};
use super::prepared::{Prepared, Stored, Whole, places};
use crate::lattice::field_lattice;
use crate::lattice::field_selection;
use crate::lattice::position_lattice;
use crate::lattice::quantize::{self, Quantized};
use crate::restrict::restrictions::Restrictions;
use crate::scratch::Scratch;
use crate::{BuildConfig, BuildError, Purpose};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::{BTreeMap, BTreeSet};
use tetralod::geom::{Bounds, Lattice, WIDE_BITS, bits_of};
use tetralod::mesh::{BitSet, Extremes, FACES, Field, MOST_LABELS, MeshInput, MeshPiece, TetMesh};
use tetralod::mt::MAX_VERTICES;

/// A mesh that is parted piece by piece.
pub struct Piecewise<'a> {
    config: &'a BuildConfig,
    purpose: Purpose,
    parts: u32,
    scratch: &'a dyn Scratch,
    pieces: u32,
    sums: Sums,
}

/// What is known of all pieces so far.
struct Sums {
    bounds: Bounds,
    points: u32,
    tets: u64,
    /// The fields with their least and largest values alone.
    fields: Vec<Field>,
    /// The same values with their places.
    extremes: Vec<Option<Extremes>>,
    cell_fields: Vec<Field>,
    /// Fields that nobody asked for, as the first piece has them.
    input: MeshInput,
    /// Points that tetrahedra use, and those that tetrahedra of several pieces use.
    used: BitSet,
    shared: BitSet,
    /// Of positions, tetrahedra, and each field.
    hashers: [crc32fast::Hasher; 2],
    of_fields: Vec<crc32fast::Hasher>,
    /// The values of each field that is a label.
    labels: Vec<BTreeSet<u64>>,
}

/// So many points of several pieces are never too many.
const MANY_SHARED: usize = 1 << 20;

/// Why pieces have to be put together first.
fn whole<T>(why: &'static str) -> Result<T, PartsError> {
    Err(PartsError::NeedsWhole { why })
}

impl<'a> Piecewise<'a> {
    /// Begins.
    ///
    /// # Errors
    /// If `config` is not of half-edge MTs, or there is no such number of parts; [`PartsError::NeedsWhole`] if it asks for what only a whole
    /// mesh tells.
    pub fn new(config: &'a BuildConfig, parts: u32, scratch: &'a dyn Scratch) -> Result<Self, PartsError> {
        let purpose = purpose(config, parts)?;
        if !config.preserve.is_empty() || !config.keep_points.is_empty() {
            return whole("regions and single points are kept");
        }
        if config.position_tolerance.is_some() || field_lattice::has_tolerance(config) {
            return whole("a tolerance is given");
        }
        let sums = Sums {
            bounds: Bounds::of(&[]),
            points: 0,
            tets: 0,
            fields: Vec::new(),
            extremes: Vec::new(),
            cell_fields: Vec::new(),
            input: MeshInput::default(),
            used: BitSet::default(),
            shared: BitSet::default(),
            hashers: Default::default(),
            of_fields: Vec::new(),
            labels: Vec::new(),
        };
        Ok(Self { config, purpose, parts, scratch, pieces: 0, sums })
    }

    /// Takes the next piece.
    ///
    /// # Errors
    /// [`PartsError::NeedsWhole`] if it needs repair, or more than fits together; if it cannot be kept.
    pub fn add(&mut self, piece: MeshPiece) -> Result<(), PartsError> {
        let MeshPiece { points, mesh } = piece;
        if !mesh.tets.is_empty() && tetralod::mesh::check(&mesh).is_err() {
            return whole("its cells need repair");
        }
        let sums = &mut self.sums;
        let first = sums.points;
        if first == 0 {
            sums.fields = mesh.fields.iter().map(Field::without_values).collect();
            sums.cell_fields = mesh.cell_fields.iter().map(Field::without_values).collect();
            sums.input.other_fields.clone_from(&mesh.input.other_fields);
            sums.input.other_cell_fields.clone_from(&mesh.input.other_cell_fields);
            sums.extremes = vec![None; mesh.fields.len()];
            sums.of_fields = mesh.fields.iter().map(|_| crc32fast::Hasher::new()).collect();
            sums.labels = vec![BTreeSet::new(); mesh.fields.len()];
        }
        let is_new = |i: &usize| points[*i] >= first;
        let new: Vec<usize> = (0..points.len()).filter(is_new).collect();
        if new.iter().any(|&i| mesh.positions[i].iter().any(|x| !x.is_finite())) {
            return whole("positions are not finite");
        }
        for &i in &new {
            sums.bounds = sums.bounds.with(mesh.positions[i]);
            mesh.positions[i].iter().for_each(|x| sums.hashers[0].update(&x.to_le_bytes()));
        }
        mesh.tets.iter().flatten().for_each(|&v| sums.hashers[1].update(&points[v as usize].to_le_bytes()));
        for (known, field) in sums.extremes.iter_mut().zip(&mesh.fields) {
            let before = known.iter().flat_map(Extremes::both).map(|at| (at.value, at.place));
            let here = new.iter().map(|&i| (field.values[i], mesh.positions[i]));
            *known = Extremes::of(before.chain(here));
        }
        for ((sum, field), hasher) in sums.fields.iter_mut().zip(&mesh.fields).zip(&mut sums.of_fields) {
            let values = || new.iter().map(|&i| field.values[i]);
            if !values().all(f64::is_finite) {
                return whole("values are not finite");
            }
            values().for_each(|x| hasher.update(&x.to_le_bytes()));
            let ends = sum.values.iter().copied().chain(values());
            let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            sum.integer &= field.integer && values().all(|x| field_lattice::is_exact_integer(&x));
            if low <= high {
                sum.values = vec![low, high];
            }
            sum.is_label &= field.is_label;
        }
        for (labels, field) in sums.labels.iter_mut().zip(&mesh.fields).filter(|(_, field)| field.is_label) {
            labels.extend(new.iter().map(|&i| bits_of(field.values[i])));
            if labels.len() > MOST_LABELS {
                return whole("a label has many values");
            }
        }
        let end = u64::from(first) + new.len() as u64;
        sums.tets += mesh.tets.len() as u64;
        if end > u64::from(MAX_VERTICES) {
            return Err(BuildError::Points { points: end }.into());
        }
        sums.points = end as u32;
        if mesh.tets.is_empty() {
            return Ok(());
        }
        let stored = Stored::of(points, mesh);
        for &number in &stored.points {
            if !sums.used.insert(number) {
                sums.shared.insert(number);
            }
        }
        let index = self.pieces;
        self.pieces += 1;
        self.keep(&format!("piece-{index}"), &stored)
    }

    /// Parts what was added, as [`part`](super::part).
    ///
    /// # Errors
    /// As [`part`](super::part), and [`PartsError::NeedsWhole`] if pieces do not fit each other.
    pub fn part(
        mut self,
        metadata: BTreeMap<String, String>,
        put: &mut dyn FnMut(Part<'static>) -> Result<(), PartsError>,
    ) -> Result<Plan, PartsError> {
        if self.sums.tets == 0 {
            return Err(BuildError::Empty.into());
        }
        let shared = self.shared()?;
        let mock = TetMesh {
            fields: self.sums.fields.clone(),
            cell_fields: self.sums.cell_fields.clone(),
            input: self.sums.input.clone(),
            ..TetMesh::default()
        };
        let fields = field_selection::fields(&mock, self.config)?;
        let number = |field: &&Field| mock.fields.iter().position(|known| std::ptr::eq(known, *field));
        let chosen: Vec<usize> = fields.iter().filter_map(number).collect();
        let mut infos = field_lattice::field_lattices(&fields, self.config)?;
        for (info, &number) in infos.iter_mut().zip(&chosen) {
            info.extremes.clone_from(&self.sums.extremes[number]);
        }
        let lattice = self.lattice()?;
        let mut whole = Whole { lattice, chosen, fields: infos, shared, cuts: Vec::new() };
        self.check_interfaces(&whole)?;
        let (band, quantization) = self.refined(&mut whole)?;
        self.cut(&mut whole)?;
        let plan = self.plan(&whole, quantization, metadata)?;
        let fragments = self.fragments(&whole, band)?;
        for index in 0..self.parts {
            let piece = fragments.piece(index, |name| self.kept(name))?;
            for name in fragments.names(index) {
                self.scratch.remove(&name)?;
            }
            put(Part::of(&plan, index, piece))?;
        }
        for index in 0..self.pieces {
            self.scratch.remove(&format!("piece-{index}"))?;
        }
        Ok(plan)
    }

    fn keep<T: Serialize>(&mut self, name: &str, value: &T) -> Result<(), PartsError> {
        let bytes =
            postcard::to_stdvec(value).map_err(|_| PartsError::Damaged { what: "it cannot be written" })?;
        Ok(self.scratch.write(name, &bytes)?)
    }

    fn kept<T: DeserializeOwned>(&self, name: &str) -> Result<T, PartsError> {
        let bytes = self.scratch.read(name)?;
        postcard::from_bytes(&bytes).map_err(|_| PartsError::Damaged { what: "its content is another one" })
    }

    fn stored(&self, index: u32) -> Result<Stored, PartsError> {
        self.kept(&format!("piece-{index}"))
    }

    /// The points of several pieces, ascending. Each point must be used.
    fn shared(&mut self) -> Result<Vec<u32>, PartsError> {
        let Sums { shared, used, points, .. } = &mut self.sums;
        let (shared, used) = (std::mem::take(shared), std::mem::take(used));
        if used.words().iter().map(|word| word.count_ones()).sum::<u32>() < *points {
            return whole("some points belong to no cell");
        }
        let shared: Vec<u32> = (0..*points).filter(|&number| shared.has(number)).collect();
        // What is known of each such point takes more than the whole takes for a point.
        if shared.len() > MANY_SHARED && shared.len() > *points as usize / 2 {
            return whole("its pieces have most points in common");
        }
        Ok(shared)
    }

    /// Where pieces meet, a face must have at most two tetrahedra, one on each side.
    fn check_interfaces(&self, of: &Whole) -> Result<(), PartsError> {
        let mut faces: Vec<([u32; 3], bool)> = Vec::new();
        for index in 0..self.pieces {
            let Stored { points, tets, .. } = self.stored(index)?;
            let is_shared = of.are_shared(&points);
            for tet in tets.iter().filter(|tet| tet.iter().filter(|&&v| is_shared[v as usize]).count() > 2) {
                for corners in FACES.map(|face| face.map(|k| tet[k])) {
                    if corners.iter().all(|&v| is_shared[v as usize]) {
                        let [a, b, c] = corners.map(|v| points[v as usize]);
                        let mut face = [a, b, c];
                        face.sort_unstable();
                        faces.push((face, (a > b) ^ (b > c) ^ (a > c)));
                    }
                }
            }
        }
        faces.sort_unstable();
        let fits = |group: &[([u32; 3], bool)]| match group {
            [_] => true,
            [a, b] => a.1 != b.1,
            _ => false,
        };
        if faces.chunk_by(|a, b| a.0 == b.0).all(fits) { Ok(()) } else { whole("its pieces overlap") }
    }

    /// The lattice over all pieces, as of the whole.
    fn lattice(&self) -> Result<Lattice, PartsError> {
        let of = |bits: u32| position_lattice::over(&self.sums.bounds, bits);
        if position_lattice::check_scale(&of(WIDE_BITS)).is_err() {
            return whole("its coordinates are too small or too large");
        }
        if let Some(bits) = self.config.position_bits {
            let is_known = (1..=WIDE_BITS).contains(&bits);
            return if is_known && self.fits(&of(bits))? {
                Ok(of(bits))
            } else {
                whole("its lattice is refused")
            };
        }
        let mut bits = position_lattice::FEWEST_BITS;
        while !self.fits(&of(bits))? {
            bits += 1;
            if bits > WIDE_BITS {
                return whole("its cells are too thin");
            }
        }
        let finer = bits + position_lattice::SPARE_BITS;
        if bits == position_lattice::FEWEST_BITS || finer > WIDE_BITS || !self.fits(&of(finer))? {
            return Ok(of(bits));
        }
        Ok(of(finer))
    }

    /// Whether all cells are positive on a lattice.
    fn fits(&self, lattice: &Lattice) -> Result<bool, PartsError> {
        for index in 0..self.pieces {
            let Stored { positions, tets, .. } = self.stored(index)?;
            let placed: Vec<[i32; 3]> = positions.iter().map(|&p| lattice.nearest(p)).collect();
            if position_lattice::first_flat(&tets, &placed).is_some() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Makes the lattice finer where cells are thin for what varies across them, and notes what it rounds off; returns what has to be
    /// located beyond pieces, and how far the lattice moves a point at most.
    fn refined(&self, of: &mut Whole) -> Result<(Band, f64), PartsError> {
        let mut rounded = vec![0.0_f64; of.fields.len()];
        for index in 0..self.pieces {
            let stored = self.stored(index)?;
            for ((&number, info), most) in of.chosen.iter().zip(&of.fields).zip(&mut rounded) {
                let losses = stored.values[number].iter().map(|&value| field_lattice::loss(info, value));
                *most = losses.fold(*most, f64::max);
            }
        }
        of.fields.iter_mut().zip(rounded).for_each(|(field, loss)| field.quantization = loss);
        let is_free = self.config.position_bits.is_none();
        let (mut band, mut quantization, mut losses) = self.measured(of)?;
        while is_free && quantize::is_large(&losses, &of.fields) {
            let finer = position_lattice::over(&self.sums.bounds, of.lattice.bits + quantize::FINER_BITS);
            if finer.bits > WIDE_BITS || !self.fits(&finer)? {
                break;
            }
            of.lattice = finer;
            (band, quantization, losses) = self.measured(of)?;
        }
        for (field, loss) in of.fields.iter_mut().zip(losses) {
            field.quantization = field.quantization.max(loss * field.range());
        }
        Ok((band, quantization))
    }

    /// What the lattice loses.
    fn measured(&self, of: &Whole) -> Result<(Band, f64, Vec<f64>), PartsError> {
        let (mut losses, mut quantization) = (vec![0.0_f64; of.fields.len()], 0.0_f64);
        let mut add = |quantized: &Quantized, tets: &[[u32; 4]]| {
            quantization = quantization.max(quantized.quantization);
            losses.iter_mut().zip(quantized.losses(tets)).for_each(|(most, loss)| *most = most.max(loss));
        };
        let mut beyond = Vec::new();
        for index in 0..self.pieces {
            let stored = self.stored(index)?;
            let prepared = Prepared::of(of, stored)?;
            add(&prepared.quantized, &prepared.mesh.tets);
            let positions = &prepared.quantized.positions;
            beyond.extend(
                prepared.beyond.iter().map(|&v| (prepared.points[v as usize], positions[v as usize])),
            );
        }
        beyond.sort_unstable();
        beyond.dedup();
        let mut band = Band::new(beyond);
        let mut first = 0;
        for index in 0..self.pieces {
            if band.is_empty() {
                break;
            }
            let stored = self.stored(index)?;
            let count = stored.tets.len() as u64;
            band.add(&stored, &of.lattice, first);
            first += count;
        }
        band.locate(of)?;
        if let Some(quantized) = &band.quantized {
            add(quantized, &band.mesh.tets);
        }
        Ok((band, quantization, losses))
    }

    /// Cuts the pieces as the whole is cut.
    fn cut(&mut self, of: &mut Whole) -> Result<(), PartsError> {
        let shift = shift(of.lattice.bits);
        for index in 0..self.pieces {
            let Stored { positions, tets, .. } = self.stored(index)?;
            let places: Vec<[u16; 3]> = places(&positions, &tets, &of.lattice, shift);
            self.keep(&format!("places-{index}"), &places)?;
        }
        for level in 0..self.parts.ilog2() {
            let mut all = Places::of(1 << level);
            for index in 0..self.pieces {
                let places: Vec<[u16; 3]> = self.kept(&format!("places-{index}"))?;
                places.into_iter().for_each(|place| all.add(of.part_of(place), place.map(usize::from)));
            }
            let too_many = PartsError::TooMany { parts: self.parts, tetrahedra: self.sums.tets };
            of.cuts.push(all.cuts(of.lattice.step).ok_or(too_many)?);
        }
        for index in 0..self.pieces {
            self.scratch.remove(&format!("places-{index}"))?;
        }
        Ok(())
    }

    fn plan(
        &self,
        of: &Whole,
        quantization: f64,
        metadata: BTreeMap<String, String>,
    ) -> Result<Plan, PartsError> {
        let Sums { bounds, points, tets, hashers: [positions, cells], of_fields, .. } = &self.sums;
        let alone = quantize::lattices_alone(of.lattice, of.fields.clone(), quantization);
        Restrictions::of_angles(self.config, &alone)?;
        let mut info = alone.info(*tets, self.config.displacement * bounds.diagonal());
        info.vertices = *points;
        let mut checksum = positions.clone();
        checksum.combine(cells);
        of_fields.iter().for_each(|hasher| checksum.combine(hasher));
        // The lattice begins at the least corner.
        let [low, high] = [bounds.min, bounds.max].map(|p| of.lattice.nearest(p));
        let sides = [0, 1, 2].map(|k| high[k] - low[k]);
        let whole = (self.parts, checksum.finalize(), sides);
        Ok(Plan::new(&info, self.config, self.purpose, whole, (None, &[]), metadata))
    }

    /// Sorts all pieces into the parts.
    fn fragments(&mut self, of: &Whole, mut band: Band) -> Result<Fragments, PartsError> {
        // What several pieces tell of the points that they share.
        let mut ends = vec![[u16::MAX, 0]; of.shared.len()];
        let mut shortest = vec![f64::INFINITY; of.shared.len()];
        let mut faces = Vec::new();
        for index in 0..self.pieces {
            let parts = PieceParts::of(of, self.stored(index)?)?;
            for (v, number) in parts.prepared.points.iter().enumerate() {
                if let Ok(at) = of.shared.binary_search(number) {
                    let [first, last] = parts.ends[v];
                    ends[at] = [ends[at][0].min(first), ends[at][1].max(last)];
                    shortest[at] = shortest[at].min(parts.shortest[v]);
                }
            }
        }
        let mut fragments = Fragments::new(self.parts, of.fields.len());
        for index in 0..self.pieces {
            let mut parts = PieceParts::of(of, self.stored(index)?)?;
            for (v, number) in parts.prepared.points.iter().enumerate() {
                if let Ok(at) = of.shared.binary_search(number) {
                    (parts.ends[v], parts.shortest[v]) = (ends[at], shortest[at]);
                }
            }
            let points = &parts.prepared.points;
            let global: Vec<[u32; 4]> =
                parts.prepared.mesh.tets.iter().map(|tet| tet.map(|v| points[v as usize])).collect();
            let is_between = |i: usize, k: usize| {
                let [first, last] = parts.ends[parts.prepared.mesh.tets[i][k] as usize];
                first != last
            };
            shared_faces(&global, &parts.part_of, is_between, &mut faces);
            fragments.sort_in(index, &parts, &mut band, &mut |name, fragment| self.keep(name, fragment))?;
        }
        fragments.interface = between(faces)?;
        fragments.add_band(of, &band);
        Ok(fragments)
    }
}
