//! Verification of what a session shows: its arrays, probes, sections and isosurfaces, against the mesh on its lattices.
//!
//! The exact mesh is that of integer positions and levels. It is computed with here relative to the origins of its lattices, by plain
//! formulas for one tetrahedron at a time; so nothing is lost where coordinates or values are large beside the size of the model or the
//! range of the field. What a session gives may differ by the rounding of double precision where it is: see [`Rounding`].

use super::Reference;
use super::history::Numbers;
use super::report::{VerifyReport, note};
use glam::DVec3;
use tetralod::geom::{Bounds, PointGrid};
use tetralod::mesh::{FACES, Side, TetMesh};
use tetralod::mt::{CurrentMesh, FieldInfo, MtInfo};
use tetralod::refine::{Need, Part, Request};
use tetralod::session::{Session, SessionError};
use tetralod::view::{Place, Plane, Probe};

/// Places that are probed for each mesh and field, and vertices of the input that are.
const PROBES: usize = 300;
/// The errors of the meshes.
const ERRORS: [f64; 2] = [0.02, 0.001];
/// Parts of a field's range at which there are isosurfaces.
const VALUES: [f64; 3] = [0.13, 0.5, 0.81];
/// The normals of sections.
const NORMALS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.62, -0.41, 0.67]];

/// Checks what `session` shows of some meshes, in every field, against those meshes and against `input`, what the MT was built from:
/// - **Arrays**: positions and values are those of the lattices.
/// - **Probes** find every point of the domain and give the value of the exact mesh; at vertices of the input that are inside they are
///   within [`MtInfo::field_bound`] of the input's value.
/// - **Sections and isosurfaces**: every vertex lies on the exact one, with its value, and the area is that of the exact one.
///
/// Labels have no isosurfaces; their values at other places are those of the nearest corner.
///
/// All must have arrived.
pub fn run_shown(session: &mut Session, input: &TetMesh, reference: Reference) -> VerifyReport {
    VerifyReport::of(|report| check(session, input, reference, report))
}

fn check(
    session: &mut Session,
    input: &TetMesh,
    reference: Reference,
    report: &mut VerifyReport,
) -> Result<(), String> {
    let failed = |error: SessionError| format!("what is shown: {error}");
    let info = session.info().ok_or("what is shown: nothing has arrived")?.clone();
    let whole = Bounds::of(&input.positions);
    let middle = (DVec3::from(whole.min) + DVec3::from(whole.max)) / 2.0;
    let corner = Bounds { max: middle.to_array(), ..whole };
    let [coarse, fine] = ERRORS.map(|error| (Request::within(error), format!("within {error}")));
    let part = (Need::within(0.0).inside(corner).into(), "exact in a corner".to_owned());
    let mut numbers = Numbers(0x2545_F491_4F6C_DD1D);
    for (round, (request, name)) in [coarse, fine, part].into_iter().enumerate() {
        let stats = session.refine(&request).map_err(failed)?;
        report.queries += 1;
        for (f, field) in info.fields.iter().enumerate() {
            session.set_field(f).map_err(failed)?;
            let Some(mesh) = session.mesh() else { return Err(failed(SessionError::NotReady)) };
            let exact = Exact::new(&info, f, mesh);
            let mut check = |what: &str, found: Result<(), String>| {
                if let Err(failure) = found {
                    note(report, &format!("{what} of {}, {name}", field.name), &failure);
                }
            };
            check("the arrays", exact.check_arrays(session));
            check("probes", exact.check_probes(session, &mut numbers).map_err(failed)?);
            let known = input.fields.iter().find(|known| field.is_of(known));
            if let Some(known) = known.filter(|_| matches!(request.needs[0].part, Part::Everywhere)) {
                let bound = info.field_bound(f, stats.error_bound);
                let sides = if known.sides.is_empty() { &[][..] } else { &input.sides };
                let (positions, values) = (&input.positions[..], &known.values[..]);
                let vertices = Vertices { positions, values, sides, reference };
                check(
                    "probes at the input's vertices",
                    exact.check_vertices(session, vertices, bound, &mut numbers),
                );
            }
            // All of them in turn.
            let (normal, part) = (NORMALS[(f + round) % NORMALS.len()], VALUES[(f + round) % VALUES.len()]);
            check("a section", exact.check_section(session, normal, &mut numbers).map_err(failed)?);
            // A label has none.
            if !field.is_label {
                check("an isosurface", exact.check_isosurface(session, part).map_err(failed)?);
            }
        }
    }
    Ok(())
}

/// Vertices of the input and their values.
struct Vertices<'a> {
    positions: &'a [[f64; 3]],
    values: &'a [f64],
    /// Those with several values.
    sides: &'a [Side],
    reference: Reference,
}

/// By how much numbers may differ that are the same but for the rounding of double precision: some units in the last place of the
/// largest absolute numbers, and what computing with relative ones rounds off.
#[derive(Clone, Copy)]
struct Rounding {
    /// In model units.
    place: f64,
    /// In units of the field.
    value: f64,
}

/// Units in the last place.
const UNITS: f64 = 16.0;
/// Rounding errors of computations, as a part of the model's size and of the field's range.
const RELATIVE: f64 = 1e-12;

/// A mesh relative to the origins of its lattices.
struct Exact<'a> {
    info: &'a MtInfo,
    field: &'a FieldInfo,
    origin: DVec3,
    positions: Vec<DVec3>,
    values: Vec<f64>,
    tets: Vec<[u32; 4]>,
    rounding: Rounding,
}

/// A place that a session shows, and the value that it has there; both relative.
struct Claim {
    place: DVec3,
    value: f64,
}

/// A linear function in a tetrahedron.
struct Linear {
    corners: [DVec3; 4],
    values: [f64; 4],
    gradient: DVec3,
}

impl<'a> Exact<'a> {
    fn new(info: &'a MtInfo, index: usize, mesh: &CurrentMesh) -> Self {
        let (lattice, field) = (&info.lattice, &info.fields[index]);
        let step = DVec3::from(lattice.step);
        let positions = mesh.positions().iter().map(|q| step * DVec3::from(q.map(f64::from))).collect();
        let level = |slot: u32| field.step * f64::from(mesh.levels(slot)[index]);
        let values = (0..mesh.positions().len() as u32).map(level).collect();
        let size = step * f64::from(1_u32 << lattice.bits);
        let largest = DVec3::from(lattice.origin).abs() + size;
        let most = field.origin.abs().max(field.max.abs()).max(field.min.abs());
        let rounding = Rounding {
            place: UNITS * f64::EPSILON * largest.max_element() + RELATIVE * size.max_element(),
            value: UNITS * f64::EPSILON * most + RELATIVE * field.range(),
        };
        let origin = DVec3::from(lattice.origin);
        Self { info, field, origin, positions, values, tets: mesh.tets().to_vec(), rounding }
    }

    fn linear(&self, tet: [u32; 4]) -> Linear {
        let corners @ [a, b, c, d] = tet.map(|v| self.positions[v as usize]);
        let values @ [p, q, r, s] = tet.map(|v| self.values[v as usize]);
        let [u, v, w] = [b - a, c - a, d - a];
        let six = u.cross(v).dot(w);
        let gradient = (v.cross(w) * (q - p) + w.cross(u) * (r - p) + u.cross(v) * (s - p)) / six;
        Linear { corners, values, gradient }
    }

    /// A point that a session gives.
    fn relative(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from(p) - self.origin
    }

    fn claim(&self, p: [f64; 3], value: f64) -> Claim {
        Claim { place: self.relative(p), value: value - self.field.origin }
    }

    fn check_arrays(&self, session: &mut Session) -> Result<(), String> {
        let view = session.view();
        if view.tets != self.tets || view.positions.len() != self.positions.len() {
            return Err("the tetrahedra are not those of the mesh".to_owned());
        }
        let all = view.positions.iter().zip(view.field).zip(self.positions.iter().zip(&self.values));
        for ((&p, &value), (place, level)) in all {
            let claim = self.claim(p, value);
            let moved = claim.place.distance(*place);
            if moved > self.rounding.place {
                return Err(format!("the point {p:?} is {moved} beside its place"));
            }
            let off = (claim.value - level).abs();
            if off > self.rounding.value {
                return Err(format!("the value {value} at {p:?} is {off} beside its own"));
            }
        }
        Ok(())
    }

    /// Checks the values at points of random tetrahedra.
    fn check_probes(
        &self,
        session: &mut Session,
        numbers: &mut Numbers,
    ) -> Result<Result<(), String>, SessionError> {
        let point = |_| {
            let tet = self.tets[numbers.next() as usize % self.tets.len()];
            let weights = [0; 4].map(|_| -numbers.part().max(f64::MIN_POSITIVE).ln());
            let sum: f64 = weights.iter().sum();
            let sums =
                tet.iter().zip(weights).map(|(&v, weight)| self.positions[v as usize] * (weight / sum));
            (self.origin + sums.sum::<DVec3>()).to_array()
        };
        let points: Vec<[f64; 3]> = (0..PROBES).map(point).collect();
        let index = session.field();
        // Readings one by one, and many at once.
        let mut found = Vec::new();
        for &p in &points[..PROBES / 20] {
            found.push((p, session.reading(p)?.map(|reading| reading.values[index])));
        }
        let mesh = session.view();
        let places = Probe::new(mesh).locate_all(&points);
        let value = |(&p, place): (&[f64; 3], Option<Place>)| (p, place.map(|place| place.value(&mesh)));
        found.extend(points.iter().zip(places).map(value));
        // A point that rounding may have moved out of the domain is found or not.
        if let Some((p, _)) = found.iter().find(|(p, value)| value.is_none() && self.is_inside(*p)) {
            return Ok(Err(format!("the point {p:?} is inside, but not found")));
        }
        let claims: Vec<Claim> = found.iter().filter_map(|&(p, value)| Some(self.claim(p, value?))).collect();
        Ok(self.check_claims(&claims))
    }

    /// Whether a point is inside of the domain, and not by rounding alone.
    fn is_inside(&self, p: [f64; 3]) -> bool {
        let p = self.relative(p);
        self.tets.iter().any(|&tet| depth(&tet.map(|v| self.positions[v as usize]), p) > self.rounding.place)
    }

    /// Checks the values at some of the input's vertices, where they are inside, against those of the input.
    fn check_vertices(
        &self,
        session: &mut Session,
        vertices: Vertices<'_>,
        bound: f64,
        numbers: &mut Numbers,
    ) -> Result<(), String> {
        let Vertices { positions, values, sides, reference } = vertices;
        let mut chosen: Vec<usize> = (0..PROBES).map(|_| numbers.next() as usize % positions.len()).collect();
        // A probe says the value in one of the regions that meet at a point.
        chosen.retain(|v| sides.binary_search_by_key(v, |side| side.point as usize).is_err());
        let lattice = &self.info.lattice;
        let place = |p: [f64; 3]| match reference {
            Reference::Mesh => p,
            // Insertion measures errors on the lattice.
            Reference::Points => lattice.point(lattice.nearest(p)),
        };
        let points: Vec<[f64; 3]> = chosen.iter().map(|&v| place(positions[v])).collect();
        let mesh = session.view();
        for (&v, place) in chosen.iter().zip(Probe::new(mesh).locate_all(&points)) {
            // The error of a label is that of what is linear between its corners, too.
            let linear = |place: Place| place.interpolate(&mesh, mesh.field);
            let off = place.map_or(0.0, |place| (linear(place) - values[v]).abs());
            if off > bound + 2.0 * self.rounding.value {
                return Err(format!("vertex {v} at {:?} is {off} off, more than {bound}", positions[v]));
            }
        }
        Ok(())
    }

    /// Checks that the exact mesh has these values at these places.
    fn check_claims(&self, claims: &[Claim]) -> Result<(), String> {
        let lattice = &self.info.lattice;
        let grid = PointGrid::new(
            claims.iter().map(|claim| lattice.nearest((self.origin + claim.place).to_array())).collect(),
        );
        // For each the least error as a part of what rounding allows.
        let mut least = vec![f64::INFINITY; claims.len()];
        let steps = DVec3::from(lattice.step);
        for &tet in &self.tets {
            let corners =
                tet.map(|v| (self.positions[v as usize] / steps).to_array().map(|x| x.round() as i32));
            let mut linear = None;
            grid.near_tet(&corners, |i| {
                let claim = &claims[i as usize];
                let linear = linear.get_or_insert_with(|| self.linear(tet));
                if depth(&linear.corners, claim.place) >= -self.rounding.place {
                    let ratio = match self.field.is_label {
                        true if linear.has_label(claim, self.rounding.place) => 0.0,
                        true => f64::INFINITY,
                        false => (linear.at(claim.place) - claim.value).abs() / self.allowed(linear),
                    };
                    least[i as usize] = least[i as usize].min(ratio);
                }
            });
        }
        let worst = least.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        match worst {
            Some((i, &ratio)) if ratio > 1.0 => {
                let (p, value) = (self.origin + claims[i].place, self.field.origin + claims[i].value);
                let what = if ratio.is_finite() {
                    format!("{ratio:.1} times what rounding allows off")
                } else if self.field.is_label {
                    "not the label of the nearest corner, or outside".to_owned()
                } else {
                    "outside".to_owned()
                };
                Err(format!("the value {value} at {:?} is {what}", p.to_array()))
            }
            _ => Ok(()),
        }
    }

    /// By how much a value may differ where its place is rounded, too.
    fn allowed(&self, linear: &Linear) -> f64 {
        2.0 * self.rounding.value + 4.0 * self.rounding.place * linear.gradient.length()
    }

    /// Checks a section between two steps of the lattice, or across it.
    fn check_section(
        &self,
        session: &mut Session,
        normal: [f64; 3],
        numbers: &mut Numbers,
    ) -> Result<Result<(), String>, SessionError> {
        let corner = self.positions[numbers.next() as usize % self.positions.len()];
        let through = self.origin + corner + 0.5 * DVec3::from(self.info.lattice.step);
        let plane = Plane::through(through.to_array(), normal);
        let slice = session.slice(&plane)?;
        let n = DVec3::from(normal);
        let positions = slice.positions();
        let claims: Vec<Claim> =
            positions.iter().zip(slice.values()).map(|(&p, &value)| self.claim(p, value)).collect();
        // The offset of a plane is a sum of products of large numbers.
        let away = n.length() * self.rounding.place * UNITS;
        let base = corner + 0.5 * DVec3::from(self.info.lattice.step);
        if let Some(claim) = claims.iter().find(|claim| (claim.place - base).dot(n).abs() > away) {
            let height = (claim.place - base).dot(n) / n.length();
            return Ok(Err(format!("a vertex is {height} beside the plane")));
        }
        let exact = self
            .area_below(|tet| tet.map(|v| (self.positions[v as usize] - base).dot(n)), |_| away / n.length());
        Ok(compare_area("section", surface_area(positions, slice.indices()), exact)
            .and_then(|()| self.check_claims(&claims)))
    }

    /// Checks an isosurface between two levels.
    fn check_isosurface(&self, session: &mut Session, part: f64) -> Result<Result<(), String>, SessionError> {
        let level = (part * self.field.range() / self.field.step).floor()
            + ((self.field.min - self.field.origin) / self.field.step).floor()
            + 0.5;
        let value = self.field.origin + self.field.step * level;
        let surface = session.isosurface(value)?;
        let positions = &surface.positions;
        let claims: Vec<Claim> = positions.iter().map(|&p| self.claim(p, value)).collect();
        let own = value - self.field.origin;
        let shift = |tet: [u32; 4]| {
            let linear = self.linear(tet);
            self.rounding.place + 2.0 * self.rounding.value / linear.gradient.length().max(f64::MIN_POSITIVE)
        };
        let exact = self.area_below(|tet| tet.map(|v| self.values[v as usize] - own), shift);
        Ok(compare_area("isosurface", surface_area(positions, &surface.indices), exact)
            .and_then(|()| self.check_claims(&claims)))
    }

    /// The area of the surface on which a linear function, given at the corners of each tetrahedron, is zero; and by how much it may be
    /// another one if its points move by `shift`.
    fn area_below(
        &self,
        heights: impl Fn([u32; 4]) -> [f64; 4],
        shift: impl Fn([u32; 4]) -> f64,
    ) -> [f64; 2] {
        let [mut area, mut slack] = [0.0; 2];
        for &tet in &self.tets {
            let heights = heights(tet);
            let corners = tet.map(|v| self.positions[v as usize]);
            let cut = section(&corners, &heights);
            let Some(&first) = cut.first() else { continue };
            let length = (0..cut.len()).map(|i| cut[i].distance(cut[(i + 1) % cut.len()])).sum::<f64>();
            let twice: DVec3 = cut.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first)).sum();
            area += 0.5 * twice.length();
            let far = corners.iter().map(|p| p.distance(corners[0])).fold(0.0, f64::max);
            slack += 2.0 * length * shift(tet).min(far);
        }
        [area, slack]
    }
}

impl Linear {
    fn at(&self, p: DVec3) -> f64 {
        self.values[0] + self.gradient.dot(p - self.corners[0])
    }

    /// Whether a corner with the label of a claim is as near as any other, but for what moving the place by `rounding` does.
    fn has_label(&self, claim: &Claim, rounding: f64) -> bool {
        // The barycentric coordinate of each corner, and by how much it may be another one.
        let shares = [0, 1, 2, 3].map(|i| {
            let [a, b, c] = FACES[i].map(|k| self.corners[k]);
            let normal = (c - a).cross(b - a);
            let whole = normal.dot(self.corners[i] - a);
            (normal.dot(claim.place - a) / whole, rounding * normal.length() / whole.abs())
        });
        let least = |(share, slack): &(f64, f64)| share - slack;
        let largest = shares.iter().map(least).fold(f64::NEG_INFINITY, f64::max);
        let has = |i: usize| (self.values[i] - claim.value).abs() < 0.5;
        (0..4).any(|i| has(i) && shares[i].0 + shares[i].1 >= largest)
    }
}

/// The corners of the polygon in which a tetrahedron is cut by the zero of a linear function, given at its corners; in order.
fn section(corners: &[DVec3; 4], heights: &[f64; 4]) -> Vec<DVec3> {
    // Most are not cut.
    if heights.iter().all(|h| *h < 0.0) || heights.iter().all(|h| *h >= 0.0) {
        return Vec::new();
    }
    let (below, above): (Vec<usize>, Vec<usize>) = (0..4).partition(|&i| heights[i] < 0.0);
    let cut = |i: usize, k: usize| {
        corners[i] + (corners[k] - corners[i]) * (heights[i] / (heights[i] - heights[k]))
    };
    match (&below[..], &above[..]) {
        (&[i], others) | (others, &[i]) => others.iter().map(|&k| cut(i, k)).collect(),
        (&[i, j], &[k, l]) => vec![cut(i, k), cut(i, l), cut(j, l), cut(j, k)],
        _ => Vec::new(),
    }
}

/// How far a point is from the nearest face of a tetrahedron that it is inside of, or, negative, behind the farthest one.
fn depth(corners: &[DVec3; 4], p: DVec3) -> f64 {
    let inwards = |face: [usize; 3]| {
        let [a, b, c] = face.map(|i| corners[i]);
        // Faces are counter-clockwise when seen from outside.
        let normal = (c - a).cross(b - a);
        normal.dot(p - a) / normal.length().max(f64::MIN_POSITIVE)
    };
    FACES.map(inwards).into_iter().fold(f64::INFINITY, f64::min)
}

fn surface_area(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let twice = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| DVec3::from(positions[v as usize]));
        (b - a).cross(c - a).length()
    };
    0.5 * triangles.iter().map(twice).sum::<f64>()
}

fn compare_area(what: &str, found: f64, [exact, slack]: [f64; 2]) -> Result<(), String> {
    if (found - exact).abs() <= slack + 1e-9 * exact {
        return Ok(());
    }
    Err(format!("the area of the {what} is {found}, that of the exact one {exact}"))
}
