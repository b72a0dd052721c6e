//! Tubes around streamlines.
//!
//! A tube has a ring of vertices at each point of its line. The rings are turned from point to point the
//! shortest way (parallel transport; Bishop, *There is more than one way to frame a curve*, 1975), so the
//! tube does not twist. Where the line turns a little, a ring lies in the plane between both pieces and is
//! widened across, so that each piece is a prism of the whole radius. Where it turns sharply, several rings
//! around the point make a joint, every vertex of which is at the radius from the point. Either way the tube
//! is nowhere pinched.

use crate::view::solids::{Frame, MOST_SIDES, cos_sin};
use crate::view::{Place, Solids, StreamPoint, Streamline};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// The cosine of the largest turn without a joint, 30 degrees.
const LEAST_COSINE: f64 = 0.866_025_403_784_438_6;

/// The most often that the turn of a joint is halved: to less than 30 degrees.
const MOST_HALVINGS: u32 = 3;

/// How a tube ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TubeEnd {
    /// A disk.
    #[default]
    Flat,
    /// Half a ball, which reaches beyond the end of the line by the radius.
    Round,
}

/// What tubes look like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeOptions {
    /// From the line to the vertices, in model units; positive.
    pub radius: f64,
    /// How tubes end.
    pub ends: TubeEnd,
}

impl Default for TubeOptions {
    fn default() -> Self {
        Self { radius: 0.01, ends: TubeEnd::Flat }
    }
}

/// A point of a line.
#[derive(Clone, Copy, Debug)]
struct Bead {
    at: DVec3,
    /// Its value, and where in the mesh it is.
    of: (f64, Place),
}

/// A ring of vertices.
#[derive(Clone, Copy, Debug)]
struct Ring {
    bead: Bead,
    frame: Frame,
    /// By how much it is longer across the plane between two pieces, and where to; zero if it is round.
    widening: DVec3,
}

impl Solids {
    /// Replaces the triangles by tubes around streamlines, coloured by speed.
    ///
    /// Lines of less than two different points have none. Points that are not finite are left out, and so
    /// is everything if the radius is not positive and finite.
    ///
    /// ```
    /// use tetralod::view::{Place, Solids, StreamEnd, StreamPoint, Streamline, TubeOptions};
    ///
    /// let place = Place { tet: 0, weights: [0.25; 4] };
    /// let at = |x: f64| StreamPoint { position: [x, 0.0, 0.0], time: x, vector: [1.0, 0.0, 0.0], place };
    /// let line = Streamline { points: vec![at(0.0), at(1.0)], end: StreamEnd::Boundary };
    /// let mut solids = Solids::with_sides(6);
    /// solids.set_tubes(&[line], &TubeOptions { radius: 0.1, ..TubeOptions::default() });
    /// assert_eq!(solids.indices.len(), 2 * 6 + 2 * 4); // six sides, two ends
    /// ```
    pub fn set_tubes(&mut self, lines: &[Streamline], options: &TubeOptions) {
        self.set_tubes_with(lines, options, |point| DVec3::from(point.vector).length());
    }

    /// [`Solids::set_tubes`], coloured by something else at each point: a field is
    /// `point.place.interpolate(mesh, field)`.
    pub fn set_tubes_with(
        &mut self,
        lines: &[Streamline],
        options: &TubeOptions,
        mut value: impl FnMut(&StreamPoint) -> f64,
    ) {
        self.clear();
        if !(options.radius > 0.0 && options.radius.is_finite()) {
            return;
        }
        let mut rings = Vec::new();
        for line in lines {
            let beads = beads(&line.points, &mut value);
            rings.clear();
            push_rings(&beads, &mut rings);
            if self.has_room_for((rings.len() + 2 * MOST_SIDES as usize) * MOST_SIDES as usize) {
                self.tube(&rings, options);
            }
        }
    }

    fn tube(&mut self, rings: &[Ring], options: &TubeOptions) {
        let [Some(first), Some(last)] = [rings.first(), rings.last()] else { return };
        let radius = options.radius;
        let begin = self.positions.len() as u32;
        let mut end = begin;
        for (i, ring) in rings.iter().enumerate() {
            let next = self.ring(ring.bead.of, |p| ring.place(p, radius));
            if i > 0 {
                self.band(end, next);
            }
            end = next;
        }
        for (ring, from, is_ahead) in [(first, begin, false), (last, end, true)] {
            match options.ends {
                TubeEnd::Flat => self.flat(ring, radius, is_ahead),
                TubeEnd::Round => self.round(ring, from, radius, is_ahead),
            }
        }
    }

    fn flat(&mut self, ring: &Ring, radius: f64, is_ahead: bool) {
        let normal = if is_ahead { ring.frame.along } else { -ring.frame.along };
        let disk = self.ring(ring.bead.of, |p| (ring.place(p, radius).0, normal));
        self.disk(disk, is_ahead);
    }

    /// Half a ball beyond a ring whose vertices are there.
    fn round(&mut self, ring: &Ring, from: u32, radius: f64, is_ahead: bool) {
        let Ring { bead: Bead { at, of }, frame, .. } = *ring;
        let beyond = if is_ahead { frame.along } else { -frame.along };
        let steps = (self.sides() / 4).max(1);
        let mut before = from;
        for step in 1..steps {
            let [across, along] = cos_sin(FRAC_PI_2 * f64::from(step) / f64::from(steps));
            let next = self.ring(of, |p| {
                let normal = frame.towards(p) * across + beyond * along;
                (at + normal * radius, normal)
            });
            let [low, high] = if is_ahead { [before, next] } else { [next, before] };
            self.band(low, high);
            before = next;
        }
        let tip = self.vertex(at + beyond * radius, beyond, of);
        self.tip(before, tip, is_ahead);
    }
}

impl Ring {
    fn place(&self, p: [f64; 2], radius: f64) -> (DVec3, DVec3) {
        let normal = self.frame.towards(p);
        let squared = self.widening.length_squared();
        let part = if squared > 0.0 { normal.dot(self.widening) / squared.sqrt() } else { 0.0 };
        let wide = self.widening * part;
        (self.bead.at + (normal + wide) * radius, normal)
    }
}

/// The points of a line that are finite and differ from the ones before.
fn beads(points: &[StreamPoint], value: &mut impl FnMut(&StreamPoint) -> f64) -> Vec<Bead> {
    let mut beads: Vec<Bead> = Vec::with_capacity(points.len());
    for point in points {
        let at = DVec3::from(point.position);
        let differs = beads.last().is_none_or(|last| direction(last.at, at).is_some());
        if at.is_finite() && differs {
            beads.push(Bead { at, of: (value(point), point.place) });
        }
    }
    beads
}

/// The unit vector from one point to another; none if they are the same, or too far apart for numbers.
fn direction(from: DVec3, to: DVec3) -> Option<DVec3> {
    let d = to - from;
    let length = d.length();
    (length > 0.0 && length.is_finite()).then(|| d / length)
}

/// The rings of a line, in order.
fn push_rings(beads: &[Bead], rings: &mut Vec<Ring>) {
    let mut frame: Option<Frame> = None;
    for (i, pair) in beads.windows(2).enumerate() {
        let Some(along) = direction(pair[0].at, pair[1].at) else { continue };
        frame = Some(match frame {
            None => {
                let first = Frame::around(along);
                rings.push(Ring { bead: beads[i], frame: first, widening: DVec3::ZERO });
                first
            }
            Some(before) => turn(beads[i], before, along, rings),
        });
    }
    if let (Some(frame), Some(last)) = (frame, beads.last()) {
        rings.push(Ring { bead: *last, frame, widening: DVec3::ZERO });
    }
}

/// The rings where a line turns; gives the frame behind.
fn turn(bead: Bead, before: Frame, along: DVec3, rings: &mut Vec<Ring>) -> Frame {
    let cosine = before.along.dot(along);
    if cosine < LEAST_COSINE {
        rings.push(Ring { bead, frame: before, widening: DVec3::ZERO });
        return joint(bead, before, along, MOST_HALVINGS, rings);
    }
    let sum = before.along + along;
    let between = before.turned_to(sum / sum.length());
    // Half the turn has this cosine; the pieces are wider by its inverse in the plane between them.
    let half = (0.5 * (1.0 + cosine)).max(0.0).sqrt();
    let widening = (along - before.along).normalize_or_zero() * (1.0 / half - 1.0).max(0.0);
    rings.push(Ring { bead, frame: between, widening });
    between.turned_to(along)
}

/// Rings around a point from one direction to another, without the first one.
fn joint(bead: Bead, before: Frame, along: DVec3, halvings: u32, rings: &mut Vec<Ring>) -> Frame {
    if halvings == 0 || before.along.dot(along) >= LEAST_COSINE {
        let frame = before.turned_to(along);
        rings.push(Ring { bead, frame, widening: DVec3::ZERO });
        return frame;
    }
    let sum = before.along + along;
    // Back the way it came, any side is as good.
    let middle = if sum.length() > 1e-9 { sum / sum.length() } else { before.across[0] };
    let between = joint(bead, before, middle, halvings - 1, rings);
    joint(bead, between, along, halvings - 1, rings)
}
