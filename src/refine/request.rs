//! Requests: needs, and a budget.

use super::MAX_PLANES;
use crate::geom::Bounds;
use crate::mt::MtInfo;
use glam::DVec3;
use thiserror::Error;

/// A request for the coarsest mesh that meets every need, as far as the budget allows.
///
/// ```
/// use tetralod::geom::Bounds;
/// use tetralod::refine::{Need, Region, Request};
/// let roi = Region::from(Bounds { min: [0.0; 3], max: [1.0, 1.0, 2.0] });
/// // Within 5 % of the field's range everywhere, within 0.1 % in a box; with 100,000 tetrahedra at most.
/// let request = Request::within(0.05).and(Need::within(0.001).inside(roi)).at_most(100_000);
/// assert_eq!(request.needs.len(), 2);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    /// The needs, all of which the mesh meets. Without any, it is the base mesh.
    pub needs: Vec<Need>,
    /// The largest size of the mesh.
    pub budget: Budget,
}

/// A part of the volume and the error that the mesh may have there.
#[derive(Clone, Debug, PartialEq)]
pub struct Need {
    /// The largest allowed error, in the unit of `part`; 0 is the reference mesh, infinity allows any error. Not
    /// negative, not NaN.
    pub error: f64,
    /// The field whose error counts. By default it is the field that `part` names, or else the largest error of all
    /// fields. A transfer function always measures its own field.
    pub field: Option<usize>,
    /// Where the error counts, and how it is measured.
    pub part: Part,
    /// The regions of the MT ([`Regions`](crate::mt::Regions)) in which it counts, as indices into its list; all if there is no list. Others
    /// stay as coarse as the rest of the mesh lets them.
    pub regions: Option<Vec<u16>>,
}

/// Where a need counts, and how it measures the error.
///
/// In all but the last two the error is that of a field: a fraction of its range (0.01 is 1 %). The need
/// ([`Need::of_field`]) or the part names the field; if neither does, the error counts for all fields of the MT, each
/// relative to its own range.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// The whole volume.
    Everywhere,
    /// The inside of a region.
    Region(Region),
    /// Where a field takes values of a range; an isovalue is a range of one value.
    Values(Values),
    /// Where a field takes values of a range inside a region. The one combination that is not monotone, see
    /// [`crate::refine`].
    Both(Region, Values),
    /// What a camera sees; the error is in pixels: the displacement that the field's error counts as
    /// ([`MtInfo::displacement_per_error`](crate::mt::MtInfo::displacement_per_error)), at its largest size on the
    /// screen.
    View(View),
    /// What a transfer function makes visible; the error is one of colour and opacity, 0 to 1, see [`Transfer`].
    Transfer(Transfer),
}

/// Values of a field that matter.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// Which field: an index into [`MtInfo::fields`](crate::mt::MtInfo::fields).
    pub field: usize,
    /// Ranges in field units, the smaller value first; both ends count.
    pub ranges: Vec<[f64; 2]>,
}

/// A convex region of space, in model units; its boundary belongs to it.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// A box along the axes.
    Box(Bounds),
    /// A box of any orientation: its centre and, in three directions at right angles, the way from there to a face.
    OrientedBox {
        /// The middle.
        centre: [f64; 3],
        /// From the centre to the middles of three faces. None of length 0.
        halves: [[f64; 3]; 3],
    },
    /// A ball.
    Sphere {
        /// The centre of the ball.
        centre: [f64; 3],
        /// The radius of the ball; not negative.
        radius: f64,
    },
    /// All points with `normal · p <= offset`.
    HalfSpace {
        /// Points out of the half-space; of any length but 0.
        normal: [f64; 3],
        /// In units of the length of `normal`.
        offset: f64,
    },
    /// All points close to a plane: those with `|normal · p - offset| <= thickness / 2 · |normal|`.
    Slab {
        /// At a right angle to the plane; of any length but 0.
        normal: [f64; 3],
        /// In units of the length of `normal`.
        offset: f64,
        /// In model units; 0 is the plane itself.
        thickness: f64,
    },
    /// The intersection of the half-spaces of some planes `[nx, ny, nz, d]`: all points with `n · p <= d`. At most
    /// [`MAX_PLANES`](crate::refine::MAX_PLANES).
    Convex(Vec<[f64; 4]>),
}

impl From<Bounds> for Region {
    fn from(bounds: Bounds) -> Self {
        Self::Box(bounds)
    }
}

impl Region {
    /// Whether a point lies in the region.
    ///
    /// ```
    /// use tetralod::refine::Region;
    /// let slab = Region::Slab { normal: [0.0, 0.0, 2.0], offset: 6.0, thickness: 1.0 };
    /// assert!(slab.contains([7.0, -8.0, 3.5]) && !slab.contains([0.0, 0.0, 3.6]));
    /// let halves = [[1.0, 1.0, 0.0], [-2.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
    /// let turned = Region::OrientedBox { centre: [1.0; 3], halves };
    /// assert!(turned.contains([-0.9, 2.9, 3.9]) && !turned.contains([2.9, 2.9, 1.0]));
    /// ```
    pub fn contains(&self, p: [f64; 3]) -> bool {
        let p = DVec3::from(p);
        match self {
            Self::Box(bounds) => bounds.contains(p.to_array()),
            Self::OrientedBox { centre, halves } => halves.iter().all(|&half| {
                let half = DVec3::from(half);
                (p - DVec3::from(*centre)).dot(half).abs() <= half.length_squared()
            }),
            Self::Sphere { centre, radius } => p.distance(DVec3::from(*centre)) <= *radius,
            Self::HalfSpace { normal, offset } => p.dot(DVec3::from(*normal)) <= *offset,
            Self::Slab { normal, offset, thickness } => {
                let normal = DVec3::from(*normal);
                (p.dot(normal) - offset).abs() <= 0.5 * thickness * normal.length()
            }
            Self::Convex(planes) => planes.iter().all(|&[x, y, z, d]| p.dot(DVec3::new(x, y, z)) <= d),
        }
    }
}

/// A camera, as renderers have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// From model space to clip space, column by column as WebGPU and three.js store it: `clip = matrix · (x, y, z, 1)`,
    /// visible where `|clip.x| <= clip.w` and `|clip.y| <= clip.w`. Perspective or parallel; depth does not count.
    pub matrix: [f64; 16],
    /// Width and height of the picture in pixels.
    pub viewport: [f64; 2],
}

/// A transfer function: the colour and opacity of each value of a field, linear between its points and constant beyond.
///
/// An error `e` of the field can make the renderer show the colour of a value up to `e` away. What counts is how much
/// that changes the picture: the largest change of any of the four channels (colours weighted by opacity) that a value
/// in the tetrahedron can suffer. Along a ray through the whole model this accumulates to at most the need's error.
#[derive(Clone, Debug, PartialEq)]
pub struct Transfer {
    /// Which field: an index into [`MtInfo::fields`](crate::mt::MtInfo::fields).
    pub field: usize,
    /// Values in field units, ascending, each with its `[red, green, blue, opacity]` of 0 to 1; at least one.
    pub points: Vec<(f64, [f64; 4])>,
    /// The way through the model, as a fraction of its diagonal, along which the opacities apply; positive.
    pub unit_length: f64,
}

/// Limits of the mesh. It never gets smaller than the base mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Budget {
    /// At most so many tetrahedra.
    pub tets: Option<u32>,
    /// At most so many vertices.
    pub vertices: Option<u32>,
    /// At most so many bytes of output: 32 a tetrahedron (vertices and neighbours), 16 a vertex (position and value).
    pub bytes: Option<u64>,
}

impl Budget {
    /// Whether there is no limit.
    pub fn is_unlimited(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a mesh of this size is within all limits.
    #[inline]
    pub fn holds(&self, vertices: usize, tets: usize) -> bool {
        self.tets.is_none_or(|most| tets <= most as usize)
            && self.vertices.is_none_or(|most| vertices <= most as usize)
            && self.bytes.is_none_or(|most| 32 * tets as u64 + 16 * vertices as u64 <= most)
    }
}

impl Request {
    /// The field within `error` of the reference, as a fraction of its range, everywhere. 0 is the reference mesh.
    pub fn within(error: f64) -> Self {
        Need::within(error).into()
    }

    /// Adds a need.
    #[must_use]
    pub fn and(mut self, need: Need) -> Self {
        self.needs.push(need);
        self
    }

    /// At most so many tetrahedra.
    #[must_use]
    pub fn at_most(mut self, tets: u32) -> Self {
        self.budget.tets = Some(tets);
        self
    }
}

impl From<Need> for Request {
    fn from(need: Need) -> Self {
        Self { needs: vec![need], budget: Budget::default() }
    }
}

impl Need {
    /// The field within `error` of the reference, as a fraction of its range, everywhere.
    pub fn within(error: f64) -> Self {
        Self { error, field: None, part: Part::Everywhere, regions: None }
    }

    /// What a camera sees, within so many pixels.
    pub fn seen(view: View, pixels: f64) -> Self {
        Self { part: Part::View(view), ..Self::within(pixels) }
    }

    /// What a transfer function shows, within so much of colour and opacity.
    pub fn shown(transfer: Transfer, error: f64) -> Self {
        Self { part: Part::Transfer(transfer), ..Self::within(error) }
    }

    /// Only the error of field number `field` counts.
    #[must_use]
    pub fn of_field(mut self, field: usize) -> Self {
        self.field = Some(field);
        self
    }

    /// Only in these regions of the MT.
    #[must_use]
    pub fn in_regions(mut self, regions: Vec<u16>) -> Self {
        self.regions = Some(regions);
        self
    }

    /// The field whose error counts; the largest one of all fields if there is none.
    pub fn measured_field(&self) -> Option<usize> {
        match &self.part {
            Part::Transfer(transfer) => Some(transfer.field),
            Part::Values(values) | Part::Both(_, values) => self.field.or(Some(values.field)),
            Part::Everywhere | Part::Region(_) | Part::View(_) => self.field,
        }
    }

    /// Only inside `region`. In views and transfer functions this replaces the part.
    #[must_use]
    pub fn inside(mut self, region: impl Into<Region>) -> Self {
        let region = region.into();
        self.part = match self.part {
            Part::Values(values) | Part::Both(_, values) => Part::Both(region, values),
            _ => Part::Region(region),
        };
        self
    }

    /// Only where field number `field` passes one of these values. In views and transfer functions this replaces the part.
    #[must_use]
    pub fn around(self, field: usize, isovalues: &[f64]) -> Self {
        self.between(field, isovalues.iter().map(|&v| [v, v]).collect())
    }

    /// Only inside `region`, if there is one, and only around these values of a field, if there are any.
    #[must_use]
    pub fn limited(self, region: Option<Region>, field: usize, isovalues: &[f64]) -> Self {
        let inside = region.into_iter().fold(self, Self::inside);
        if isovalues.is_empty() { inside } else { inside.around(field, isovalues) }
    }

    /// Only where field number `field` takes a value of one of these ranges.
    #[must_use]
    pub fn between(mut self, field: usize, ranges: Vec<[f64; 2]>) -> Self {
        let values = Values { field, ranges };
        self.part = match self.part {
            Part::Region(region) | Part::Both(region, _) => Part::Both(region, values),
            _ => Part::Values(values),
        };
        self
    }
}

/// Why a request is invalid.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The MT has no field of this number.
    #[error("there is no field number {index}; the MT has {fields}, counted from 0")]
    Field {
        /// The number in the request.
        index: usize,
        /// How many fields there are.
        fields: usize,
    },
    /// The MT has no region of this number.
    #[error("there is no region number {index}; the MT has {regions}, counted from 0")]
    Region {
        /// The number in the request.
        index: u16,
        /// How many regions there are.
        regions: usize,
    },
    /// A need contains an invalid number.
    #[error("need number {need}: {problem}")]
    Need {
        /// Which need, counted from 0.
        need: usize,
        /// What must hold.
        problem: &'static str,
    },
}

impl Request {
    /// Checks a request for an MT.
    ///
    /// # Errors
    /// The first invalid need, and why.
    pub fn check(&self, info: &MtInfo) -> Result<(), RequestError> {
        for (i, need) in self.needs.iter().enumerate() {
            let named = match &need.part {
                Part::Values(values) | Part::Both(_, values) => Some(values.field),
                Part::Transfer(transfer) => Some(transfer.field),
                _ => None,
            };
            let fields = info.fields.len();
            if let Some(index) = named.max(need.field).filter(|&index| index >= fields) {
                return Err(RequestError::Field { index, fields });
            }
            need.check().map_err(|problem| RequestError::Need { need: i, problem })?;
        }
        Ok(())
    }
}

impl Request {
    /// Checks the regions of a request for an MT with so many.
    ///
    /// # Errors
    /// The first that there is not.
    pub fn check_regions(&self, regions: usize) -> Result<(), RequestError> {
        let mut all = self.needs.iter().flat_map(|need| need.regions.iter().flatten());
        match all.find(|&&index| usize::from(index) >= regions) {
            Some(&index) => Err(RequestError::Region { index, regions }),
            None => Ok(()),
        }
    }
}

fn hold(condition: bool, problem: &'static str) -> Result<(), &'static str> {
    if condition { Ok(()) } else { Err(problem) }
}

fn are_finite<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> bool {
    numbers.into_iter().all(|x| x.is_finite())
}

impl Need {
    fn check(&self) -> Result<(), &'static str> {
        // Written so that NaN is refused.
        hold(self.error >= 0.0, "the error must be 0 or a positive number")?;
        match &self.part {
            Part::Everywhere => Ok(()),
            Part::Region(region) => region.check(),
            Part::Values(values) => values.check(),
            Part::Both(region, values) => region.check().and_then(|()| values.check()),
            Part::View(view) => view.check(),
            Part::Transfer(transfer) => transfer.check(),
        }
    }
}

impl Values {
    fn check(&self) -> Result<(), &'static str> {
        let is_range = |r: &[f64; 2]| r[0] <= r[1] && r[0] < f64::INFINITY && r[1] > f64::NEG_INFINITY;
        hold(
            self.ranges.iter().all(is_range),
            "isovalues must be numbers, and ranges have the smaller one first",
        )
    }
}

impl View {
    fn check(&self) -> Result<(), &'static str> {
        hold(are_finite(&self.matrix), "the matrix of the camera must be of finite numbers")?;
        let row = |i: usize| [0, 1, 2].map(|column| self.matrix[4 * column + i]);
        let is_zero = |row: [f64; 3]| row.iter().all(|&x| x == 0.0);
        let degenerate = is_zero(row(0)) || is_zero(row(1)) || is_zero(row(3)) && self.matrix[15] == 0.0;
        hold(!degenerate, "the matrix of the camera must map space to a picture")?;
        let sized = self.viewport.iter().all(|&x| x > 0.0 && x.is_finite());
        hold(sized, "the width and height of the picture must be positive")
    }
}

impl Transfer {
    fn check(&self) -> Result<(), &'static str> {
        hold(!self.points.is_empty(), "a transfer function has at least one point")?;
        let ascending = self.points.windows(2).all(|pair| pair[0].0 <= pair[1].0);
        hold(
            ascending && self.points.iter().all(|point| point.0.is_finite()),
            "the values of a transfer function must be finite and ascend",
        )?;
        let colours = self.points.iter().flat_map(|point| point.1);
        hold(
            colours.into_iter().all(|x| (0.0..=1.0).contains(&x)),
            "the colours and opacities of a transfer function must lie between 0 and 1",
        )?;
        hold(self.unit_length > 0.0 && self.unit_length.is_finite(), "the unit length must be positive")
    }
}

impl Region {
    /// Whether its numbers make sense.
    ///
    /// # Errors
    /// What must hold.
    pub fn check(&self) -> Result<(), &'static str> {
        let has_length = |v: &[f64; 3]| are_finite(v) && v.iter().any(|&x| x != 0.0);
        match self {
            // Infinite sides are as good as any.
            Self::Box(b) => hold(
                (0..3).all(|i| b.min[i] <= b.max[i]),
                "every side of the box must be a number, the smaller one first",
            ),
            Self::OrientedBox { centre, halves } => hold(
                are_finite(centre) && halves.iter().all(has_length),
                "an oriented box has a finite centre and three vectors of some length",
            ),
            Self::Sphere { centre, radius } => hold(
                are_finite(centre) && *radius >= 0.0,
                "a sphere has a finite centre and a radius that is not negative",
            ),
            Self::HalfSpace { normal, offset } => hold(
                has_length(normal) && !offset.is_nan(),
                "a half-space has a normal of some length and an offset",
            ),
            Self::Slab { normal, offset, thickness } => hold(
                has_length(normal) && offset.is_finite() && *thickness >= 0.0,
                "a slab has a normal of some length, a finite offset and a thickness that is not negative",
            ),
            Self::Convex(planes) => {
                hold(planes.len() <= MAX_PLANES, "a region of planes has at most 16 of them")?;
                let is_plane = |p: &[f64; 4]| has_length(&[p[0], p[1], p[2]]) && !p[3].is_nan();
                hold(planes.iter().all(is_plane), "each plane has a normal of some length and an offset")
            }
        }
    }
}
