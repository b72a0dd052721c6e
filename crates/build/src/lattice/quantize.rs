//! The input on integer lattices: positions and field levels.

use crate::error::points::{as_vec, clamped};
use crate::lattice::field_lattice;
use crate::lattice::field_selection;
use crate::lattice::location;
use crate::lattice::location::Location;
use crate::lattice::places::Places;
use crate::lattice::position_lattice;
use crate::lattice::position_lattice::Placed;
use crate::lattice::sides::{self, Sides};
use crate::restrict::region_labels;
use crate::{BuildConfig, BuildError};
use glam::DVec3;
use std::sync::Arc;
use tetralod::geom::{Lattice, ON_LATTICE, WIDE_BITS, lattice_box};
use tetralod::mesh::{EDGES, Field, TetMesh};
use tetralod::mt::{FieldInfo, MtInfo, MtKind};

/// The reference mesh on its lattices.
pub(crate) struct Quantized {
    pub lattice: Lattice,
    pub fields: Vec<FieldInfo>,
    pub positions: Arc<[[i32; 3]]>,
    /// `levels[point * fields + f]`; those of sides behind those of vertices. Where no field jumps, points that are not in the mesh need none.
    pub levels: Vec<i32>,
    /// The input's values in units of levels, not rounded; errors are measured against these.
    pub exact: Vec<f64>,
    /// Whether `exact` has the values as they come instead: where they are passed on, both would take twice the memory.
    pub is_plain: bool,
    /// Where fields jump at interfaces.
    pub sides: Sides,
    /// The input's points in steps of the lattice, not rounded; the field is compared there.
    pub places: Places,
    /// The locations of the points that the lattice has moved; empty without cells.
    pub locations: Vec<Location>,
    /// How far the lattice moves a point at most: see [`MtInfo::quantization`](tetralod::mt::MtInfo::quantization).
    pub quantization: f64,
}

impl Quantized {
    fn new(
        mesh: &TetMesh,
        Placed { lattice, positions }: Placed,
        fields: Vec<FieldInfo>,
        (levels, exact): (Vec<i32>, Vec<f64>),
        sides: Sides,
    ) -> Self {
        let (origin, step) = (DVec3::from(lattice.origin), DVec3::from(lattice.step));
        let place = |(v, (p, &q)): (u32, (&[f64; 3], &[i32; 3]))| {
            let (place, rounded) = ((DVec3::from(*p) - origin) / step, as_vec(q));
            // Beside where the lattice has put a vertex of an interface there may be another region.
            if place.distance(rounded) < ON_LATTICE || sides.has_several(v) { rounded } else { place }
        };
        let rounded = Arc::<[[i32; 3]]>::from(&positions[..]);
        let places =
            Places::new(rounded.clone(), (0..).zip(mesh.positions.iter().zip(&positions)).map(place));
        let places = places.with_sides(sides.vertices());
        let quantization = position_lattice::largest_move(mesh, &lattice, &positions);
        let positions = rounded;
        let (is_plain, locations) = (false, Vec::new());
        Self { lattice, fields, positions, levels, exact, is_plain, sides, places, locations, quantization }
    }

    /// What is known of the MT of a mesh of so many tetrahedra; not how many updates it has. `displacement_per_error`: model units of
    /// displacement that count as an error of 1.
    pub fn info(&self, tetrahedra: u64, displacement_per_error: f64) -> MtInfo {
        MtInfo {
            kind: MtKind::Vertex,
            lattice: self.lattice,
            fields: self.fields.clone(),
            vertices: self.positions.len() as u32,
            tetrahedra,
            updates: 0,
            displacement_per_error,
            quantization: self.quantization,
            bounds: lattice_box(self.positions.iter().copied()),
        }
    }

    /// Where the lattice has put a point, in its steps.
    pub fn rounded(&self, point: u32) -> DVec3 {
        as_vec(self.positions[point as usize])
    }

    /// A vertex on the lattice in model units, from its origin.
    pub fn scaled(&self, vertex: u32) -> DVec3 {
        as_vec(self.positions[vertex as usize]) * DVec3::from_array(self.lattice.step)
    }

    /// For each point the square of the shortest edge there, in model units; infinite without any.
    pub fn shortest_edges(&self, tets: &[[u32; 4]]) -> Vec<f64> {
        let mut shortest = vec![f64::INFINITY; self.positions.len()];
        for tet in tets {
            let places = tet.map(|v| self.scaled(v));
            for [a, b] in EDGES {
                let squared = places[a].distance_squared(places[b]);
                for v in [tet[a], tet[b]].map(|v| v as usize) {
                    shortest[v] = shortest[v].min(squared);
                }
            }
        }
        shortest
    }

    /// Whether the lattice has moved a point.
    pub fn is_moved(&self, point: u32) -> bool {
        self.places.is_moved(point)
    }

    /// By how much the reference mesh, on the lattices, differs from the input's values at the input's points, as a fraction of the
    /// range of each field, where the lattice of the positions has moved them.
    pub fn losses(&self, tets: &[[u32; 4]]) -> Vec<f64> {
        let mut losses = vec![0.0; self.fields.len()];
        for locate in &self.locations {
            let tet = tets[locate.tet as usize];
            self.deviation(
                locate.point,
                clamped(locate.lambda),
                |f| self.levels_of(tet, self.region(locate.point), f),
                &mut losses,
            );
        }
        // A label is not interpolated: each of the input's points is still nearest to its own vertex.
        losses
            .iter_mut()
            .zip(&self.fields)
            .filter(|(_, field)| field.is_label)
            .for_each(|(loss, _)| *loss = 0.0);
        losses
    }

    /// The level of field `f` at point `v`.
    pub fn level(&self, v: u32, f: usize) -> i32 {
        self.levels[v as usize * self.fields.len() + f]
    }

    /// The levels of field `f` at the corners of a tetrahedron that is in a region, if it is known.
    pub fn levels_of(&self, tet: [u32; 4], region: Option<u32>, f: usize) -> [i32; 4] {
        tet.map(|v| self.level(region.map_or(v, |region| self.sides.point(v, region)), f))
    }

    /// The region of a point, where fields jump.
    #[inline]
    pub fn region(&self, point: u32) -> Option<u32> {
        (!self.sides.is_empty()).then(|| self.sides.region(point))
    }

    /// The vertex that a point is one of.
    pub fn vertex(&self, point: u32) -> u32 {
        self.places.vertex(point)
    }

    /// How far the value of field `f` at a vertex, given its points, exceeds the range of those at the points around it, as a fraction of the
    /// field's range. Added to inherited errors it makes the selection by isovalue monotone.
    pub fn overshoot<'a>(&self, own: &[u32], around: impl IntoIterator<Item = &'a u32>, f: usize) -> f64 {
        let field = &self.fields[f];
        let levels = around.into_iter().map(|&w| self.level(w, f));
        let (low, high) = levels.fold((i32::MAX, i32::MIN), |(low, high), x| (low.min(x), high.max(x)));
        let beyond = own.iter().map(|&v| self.level(v, f)).map(|own| (own - high).max(low - own));
        let beyond = beyond.fold(0, i32::max);
        f64::from(beyond) * field.step / field.range() * (1.0 + 1e-9)
    }

    /// Raises the error of each field to the deviation, as a fraction of its range, of the value that is interpolated at a
    /// point from the true one; returns the largest of these deviations. `lambda` has the point's barycentric coordinates
    /// but for the first one, `corners` gives the levels of a field.
    pub fn deviation(
        &self,
        point: u32,
        lambda: DVec3,
        corners: impl Fn(usize) -> [i32; 4],
        errors: &mut [f64],
    ) -> f64 {
        self.deviation_from(self.values(point), lambda, corners, errors)
    }

    /// The values of a point, as they are in `exact`.
    pub fn values(&self, point: u32) -> impl Iterator<Item = f64> {
        let fields = self.fields.len();
        self.exact[point as usize * fields..][..fields].iter().copied()
    }

    /// [`Quantized::deviation`] from the values of a point, as they are in `exact`.
    pub fn deviation_from(
        &self,
        exact: impl Iterator<Item = f64>,
        lambda: DVec3,
        corners: impl Fn(usize) -> [i32; 4],
        errors: &mut [f64],
    ) -> f64 {
        let own = 1.0 - lambda.element_sum();
        let mut largest = 0.0_f64;
        for (f, ((field, exact), most)) in self.fields.iter().zip(exact).zip(errors).enumerate() {
            let [w, x, y, z] = corners(f).map(f64::from);
            let value = own * w + lambda.x * x + lambda.y * y + lambda.z * z;
            let exact = if self.is_plain { (exact - field.origin) / field.step } else { exact };
            let error = (value - exact).abs() * field.step / field.range();
            *most = most.max(error);
            largest = largest.max(error);
        }
        largest
    }

    /// The average gradient of each field at each point, in levels per lattice step: averages of the tetrahedra's
    /// gradients, weighted by volume.
    pub fn gradients(&self, tets: &[[u32; 4]]) -> Vec<DVec3> {
        let (vertices, fields) = (self.positions.len(), self.fields.len());
        let mut sums = vec![DVec3::ZERO; vertices * fields];
        let mut volumes = vec![0.0; vertices];
        for tet in tets {
            let [a, b, c, d] = tet.map(|v| DVec3::from_array(self.positions[v as usize].map(f64::from)));
            let (u, v, w) = (b - a, c - a, d - a);
            let volume = u.cross(v).dot(w);
            for f in 0..fields {
                let [l0, l1, l2, l3] = tet.map(|v| f64::from(self.levels[v as usize * fields + f]));
                // Six times the volume times the gradient; the volume cancels in the weighted average.
                let weighted = v.cross(w) * (l1 - l0) + w.cross(u) * (l2 - l0) + u.cross(v) * (l3 - l0);
                tet.iter().for_each(|&v| sums[v as usize * fields + f] += weighted);
            }
            tet.iter().for_each(|&v| volumes[v as usize] += volume);
        }
        sums.iter()
            .enumerate()
            .map(|(i, sum)| *sum / f64::max(volumes[i / fields], f64::MIN_POSITIVE))
            .collect()
    }
}

/// Puts the points on a lattice that keeps the cells positive or, where there are none, the points apart.
pub(crate) fn quantize(mesh: &TetMesh, config: &BuildConfig) -> Result<Quantized, BuildError> {
    if config.position_bits.is_some_and(|bits| !(1..=WIDE_BITS).contains(&bits)) {
        return Err(BuildError::Option { name: "position-bits", expected: "1 to 30" });
    }
    let chosen = field_selection::fields(mesh, config)?;
    check_finite(mesh, &chosen)?;
    let placed = position_lattice::place(mesh, config)?;
    position_lattice::check_scale(&placed.lattice)?;
    let mut fields = field_lattice::field_lattices(&chosen, config)?;
    let sides = || mesh.sides.iter().map(|side| mesh.positions[side.point as usize]);
    field_lattice::set_extremes(&mut fields, &chosen, || mesh.positions.iter().copied().chain(sides()));
    let sides = match chosen.iter().any(|field| sides::jumps(field)) {
        true => Sides::of(mesh, &chosen, &region_labels::numbers(config, mesh)?.0),
        false => Sides::default(),
    };
    Ok(on_lattices(mesh, placed, &chosen, fields, sides))
}

/// A mesh on a lattice with these fields on theirs.
pub(crate) fn on_lattices(
    mesh: &TetMesh,
    placed: Placed,
    chosen: &[&Field],
    fields: Vec<FieldInfo>,
    sides: Sides,
) -> Quantized {
    let per_point =
        |i: usize| chosen.iter().zip(&fields).map(move |(field, info)| (sides::value(mesh, field, i), info));
    let points = 0..mesh.positions.len() + sides.len();
    let levels = points.clone().flat_map(|i| per_point(i).map(|(value, info)| info.nearest(value))).collect();
    let exact = points.flat_map(|i| per_point(i).map(|(x, info)| (x - info.origin) / info.step)).collect();
    Quantized::new(mesh, placed, fields, (levels, exact), sides)
}

/// The lattices, without points.
pub(crate) fn lattices_alone(lattice: Lattice, fields: Vec<FieldInfo>, quantization: f64) -> Quantized {
    let positions: Arc<[[i32; 3]]> = [].into();
    Quantized {
        lattice,
        fields,
        places: Places::new(positions.clone(), std::iter::empty()),
        positions,
        levels: Vec::new(),
        exact: Vec::new(),
        is_plain: false,
        sides: Sides::default(),
        locations: Vec::new(),
        quantization,
    }
}

/// Quantizes a mesh whose cells are kept: errors are then measured at the input's own points.
pub(crate) fn quantize_cells(mesh: &TetMesh, config: &BuildConfig) -> Result<Quantized, BuildError> {
    let mut quantized = quantize(mesh, config)?;
    quantized.locations = location::locations(&mesh.tets, &quantized.positions, &quantized.places)?;
    let mut losses = quantized.losses(&mesh.tets);
    // Where cells are thin for what varies across them, a finer lattice is what keeps the reference mesh near the input.
    let is_free = config.position_bits.is_none() && config.position_tolerance.is_none();
    while is_free && is_large(&losses, &quantized.fields) {
        let bits = quantized.lattice.bits + FINER_BITS;
        if bits > WIDE_BITS {
            break;
        }
        let finer = BuildConfig { position_bits: Some(bits), ..config.clone() };
        let Ok(placed) = position_lattice::place(mesh, &finer) else { break };
        position_lattice::check_scale(&placed.lattice)?;
        let Quantized { fields, levels, exact, sides, .. } = quantized;
        quantized = Quantized::new(mesh, placed, fields, (levels, exact), sides);
        quantized.locations = location::locations(&mesh.tets, &quantized.positions, &quantized.places)?;
        losses = quantized.losses(&mesh.tets);
    }
    for (field, loss) in quantized.fields.iter_mut().zip(losses) {
        field.quantization = field.quantization.max(loss * field.range());
    }
    Ok(quantized)
}

/// Whether a mesh loses more of its fields by the lattice of the positions than is wanted.
pub(crate) fn is_large(losses: &[f64], fields: &[FieldInfo]) -> bool {
    let own = fields.iter().map(|field| field.quantization / field.range());
    losses.iter().zip(own).any(|(&loss, own)| loss > own + LARGEST_LOSS)
}

/// By default the position lattice is so fine that the reference mesh has the input's values at the input's points up
/// to this fraction of the range, besides the rounding of the field lattices.
const LARGEST_LOSS: f64 = 0.001;
/// Bits by which it becomes finer at a time.
pub(crate) const FINER_BITS: u32 = 2;

/// The error that is left at full resolution, of whichever field has the largest.
pub(crate) fn floors(info: &MtInfo) -> Vec<f64> {
    (0..info.fields.len()).map(|f| info.floor(f)).collect()
}

fn check_finite(mesh: &TetMesh, fields: &[&Field]) -> Result<(), BuildError> {
    let sound = |i: usize| {
        mesh.positions[i].iter().all(|x| x.is_finite())
            && fields.iter().all(|field| field.values.get(i).is_some_and(|x| x.is_finite()))
    };
    if let Some(side) = fields.iter().find_map(|field| field.sides.iter().position(|x| !x.is_finite())) {
        return Err(BuildError::NotFinite { point: mesh.sides[side].point });
    }
    match (0..mesh.positions.len()).find(|&i| !sound(i)) {
        Some(point) => Err(BuildError::NotFinite { point: point as u32 }),
        None => Ok(()),
    }
}
