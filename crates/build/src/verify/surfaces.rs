//! How far is the boundary of an extracted mesh from that of the input, and that of the input from it?

use super::parts::Ask;
use super::report::{Failures, Measured};
use foldhash::{HashMap, HashSet};
use glam::DVec3;
use tetralod::geom::{TriangleGrid, nearest_on_triangle};
use tetralod::mt::MtInfo;

/// A boundary.
pub struct Surface {
    /// The faces of the boundary, in model units.
    pub triangles: TriangleGrid,
    /// The faces on the lattice, corners ascending, and the number of each: faces that two boundaries share need not be compared.
    faces: Vec<Face>,
    numbers: HashMap<Face, u32>,
}

type Face = [[i32; 3]; 3];

/// A place in sixths of a step of the lattice: exact, so that all faces around an edge agree about its middle.
type Sixths = [i64; 3];

impl Surface {
    pub fn new(info: &MtInfo, faces: impl Iterator<Item = Face>) -> Self {
        let mut faces: Vec<Face> = faces.collect();
        let at = |q: [i32; 3]| DVec3::from(info.lattice.point(q));
        let triangles = TriangleGrid::new(faces.iter().map(|face| face.map(at)).collect());
        faces.iter_mut().for_each(|face| face.sort_unstable());
        Self { triangles, numbers: faces.iter().copied().zip(0..).collect(), faces }
    }

    fn distance(&self, p: DVec3, triangle: u32) -> f64 {
        p.distance(nearest_on_triangle(p, self.triangles.corners[triangle as usize]))
    }
}

/// Parts of the corners, in sixths, of each place where the face of a boundary is compared with another boundary.
const PLACES: [(&str, [i64; 3]); 7] = [
    ("vertex", [6, 0, 0]),
    ("vertex", [0, 6, 0]),
    ("vertex", [0, 0, 6]),
    ("middle", [3, 3, 0]),
    ("middle", [0, 3, 3]),
    ("middle", [3, 0, 3]),
    ("middle", [2, 2, 2]),
];

/// These places of a face.
fn places(face: &Face) -> [(&'static str, Sixths); 7] {
    let mean = |parts: [i64; 3], i: usize| (0..3).map(|k| parts[k] * i64::from(face[k][i])).sum();
    PLACES.map(|(sort, parts)| (sort, [0, 1, 2].map(|i| mean(parts, i))))
}

/// What was found out with earlier meshes. Most of the next mesh's boundary is like that of one of them.
#[derive(Default)]
pub struct Distances {
    /// Of places on extracted boundaries, from the input's.
    from_input: HashMap<Sixths, f64>,
    /// For places on the input's boundary, a face of an extracted one that was near.
    near: HashMap<Sixths, Face>,
}

/// The comparison of the boundaries of an extracted mesh and of the input.
pub struct Comparison<'a> {
    pub info: &'a MtInfo,
    pub asks: &'a [Ask<'a>],
    /// One in so many faces is looked at.
    pub stride: usize,
    /// Rounding errors of distances.
    pub slack: f64,
}

impl Comparison<'_> {
    /// Whether each is as near the other as is asked for, at the [`PLACES`] of its faces.
    pub fn both_ways(
        &self,
        extracted: &Surface,
        input: &Surface,
        known: &mut Distances,
        found: &mut Measured,
    ) {
        let Distances { from_input, near } = known;
        let to_input = |place: Sixths, p: DVec3, _| {
            let nearest = || input.triangles.nearest(p).map_or(f64::INFINITY, |(_, q)| p.distance(q));
            *from_input.entry(place).or_insert_with(nearest)
        };
        self.one_way([extracted, input], "the extracted boundary", to_input, found);
        // The next place is likely near the same triangle.
        let mut last = 0;
        let to_extracted = |place: Sixths, p: DVec3, enough: f64| {
            let before = near.get(&place).and_then(|face| extracted.numbers.get(face).copied());
            let distance = before.map_or(f64::INFINITY, |i| extracted.distance(p, i));
            if distance <= enough {
                return distance;
            }
            let within = extracted.triangles.any_within(p, enough, last);
            let Some(i) = within.or_else(|| extracted.triangles.nearest(p).map(|(i, _)| i)) else {
                return f64::INFINITY;
            };
            last = i;
            near.insert(place, extracted.faces[i as usize]);
            extracted.distance(p, i)
        };
        self.one_way([input, extracted], "the input's boundary", to_extracted, found);
    }

    /// Compares one boundary with the other. `distance` gives how far a place is from the other one, or if that is less than a given
    /// number, anything from there to that number.
    fn one_way(
        &self,
        [one, other]: [&Surface; 2],
        what: &str,
        mut distance: impl FnMut(Sixths, DVec3, f64) -> f64,
        found: &mut Measured,
    ) {
        let mut failures = Failures::default();
        let [origin, step] = [self.info.lattice.origin, self.info.lattice.step].map(DVec3::from);
        // Faces around an edge or a vertex have it in common.
        let mut seen = HashSet::default();
        for face in one.faces.iter().step_by(self.stride).filter(|face| !other.numbers.contains_key(*face)) {
            // The place that is furthest away.
            let mut worst = (0.0, String::new());
            for (sort, sixths) in places(face) {
                if !seen.insert(sixths) {
                    continue;
                }
                let p = origin + step * DVec3::from(sixths.map(|q| q as f64 / 6.0));
                let binding = self.asks.iter().filter(|ask| ask.binds_boundary_at(p.to_array()));
                let bound = binding.map(|ask| ask.bound).fold(f64::INFINITY, f64::min);
                if bound == f64::INFINITY {
                    continue;
                }
                let allowed = bound * self.info.displacement_per_error + self.slack;
                // Where that is no more than elsewhere, it need not be known how near the nearest triangle is.
                let enough = if bound > 0.0 { allowed * found.worst_ratio.min(1.0) } else { allowed };
                let away = distance(sixths, p, enough);
                if bound > 0.0 && away > enough {
                    found.worst_ratio = found.worst_ratio.max(away / allowed);
                }
                if away > allowed && away > worst.0 {
                    let at = p.to_array();
                    let failure =
                        format!("{sort} of {what} at {at:?} is {away} from the other, more than {allowed}");
                    worst = (away, failure);
                }
            }
            if worst.0 > 0.0 {
                failures.add(|| worst.1);
            }
        }
        failures.end(&format!("faces of {what}"), found);
    }
}
