//! Promise: what a request selects is refined, and nothing is that it does not select and nothing selected depends on: by plain geometry at
//! points of each tetrahedron, not by the criterion's own functions.

use crate::guarantees::view;
use crate::support::conformance::{DELAUNAY, EDGE, HALF_EDGE, How, INSERTED, PAGED, Subject, inputs};
use glam::{DMat4, DVec3};
use tetralod::geom::Bounds;
use tetralod::mt::{ApplyUpdates, MtInfo, MultiTessellation, UpdateId, VertexId};
use tetralod::refine::{Front, LodCriterion, Need, Region, Request, View};

const KINDS: [How; 5] = [EDGE, HALF_EDGE, DELAUNAY, INSERTED, PAGED];

/// Points of a tetrahedron lie on a lattice with so many steps to an edge: none is further from one of these than an edge divided by it.
const STEPS: u32 = 4;

fn points([a, b, c, d]: [DVec3; 4]) -> impl Iterator<Item = DVec3> {
    let n = f64::from(STEPS);
    (0..=STEPS).flat_map(move |i| {
        (0..=STEPS - i).flat_map(move |j| {
            (0..=STEPS - i - j).map(move |k| {
                let l = STEPS - i - j - k;
                let [i, j, k, l] = [i, j, k, l].map(|x| f64::from(x) / n);
                a * i + b * j + c * k + d * l
            })
        })
    })
}

fn longest_edge(corners: [DVec3; 4]) -> f64 {
    corners.iter().flat_map(|p| corners.map(|q| p.distance(q))).fold(0.0, f64::max)
}

/// How far a place is outside of a region: at most as far as from its nearest point, and not positive inside.
fn beyond(region: &Region, p: DVec3) -> f64 {
    let plane = |normal: [f64; 3], offset: f64| {
        let normal = DVec3::from(normal);
        normal.dot(p) / normal.length() - offset / normal.length()
    };
    match region {
        Region::Box(Bounds { min, max }) => {
            let p = p.to_array();
            (0..3).map(|i| (min[i] - p[i]).max(p[i] - max[i])).fold(f64::NEG_INFINITY, f64::max)
        }
        Region::OrientedBox { centre, halves } => {
            let along = |half: DVec3| (p - DVec3::from(*centre)).dot(half.normalize()).abs() - half.length();
            halves.iter().map(|&half| along(half.into())).fold(f64::NEG_INFINITY, f64::max)
        }
        Region::Sphere { centre, radius } => p.distance((*centre).into()) - radius,
        Region::HalfSpace { normal, offset } => plane(*normal, *offset),
        Region::Slab { normal, offset, thickness } => plane(*normal, *offset).abs() - thickness / 2.0,
        Region::Convex(planes) => {
            planes.iter().map(|&[x, y, z, d]| plane([x, y, z], d)).fold(f64::NEG_INFINITY, f64::max)
        }
    }
}

fn regions(whole: &Bounds) -> Vec<Region> {
    let at = |part: [f64; 3]| [0, 1, 2].map(|i| whole.min[i] + part[i] * whole.extent()[i]);
    let size = whole.diagonal();
    let through = |normal: [f64; 3], p: [f64; 3]| (0..3).map(|i| normal[i] * p[i]).sum::<f64>();
    let slanted = [1.0, 2.0, -0.5];
    let middle = at([0.55, 0.45, 0.6]);
    let ways = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 1.0, 0.0), DVec3::Z].map(DVec3::normalize);
    let halves = [ways[0] * 0.02 * size, ways[1] * 0.2 * size, ways[2] * 0.05 * size];
    let towards = |[x, y, z]: [f64; 3], part| [x, y, z, through([x, y, z], at(part))];
    vec![
        Region::Box(Bounds { min: at([0.6, 0.1, 0.55]), max: at([0.8, 0.2, 0.7]) }),
        Region::OrientedBox { centre: middle, halves: halves.map(|half| half.to_array()) },
        Region::Sphere { centre: at([0.7, 0.6, 0.5]), radius: 0.04 * size },
        Region::HalfSpace { normal: slanted, offset: through(slanted, at([0.2, 0.2, 0.5])) },
        Region::Slab { normal: slanted, offset: through(slanted, middle), thickness: 0.03 * size },
        Region::Convex(vec![
            towards([-1.0, 0.0, 0.2], [0.5, 0.5, 0.5]),
            towards([1.0, 1.0, 1.0], [0.7, 0.6, 0.5]),
            towards([0.0, -1.0, 0.0], [0.5, 0.4, 0.5]),
        ]),
    ]
}

fn refined(subject: &Subject, request: &Request) -> Front {
    let mut front = Front::new(&subject.mt).expect("a valid base mesh");
    let criterion = LodCriterion::new(subject.mt.info(), request);
    let outcome = front.satisfy(&subject.mt, &criterion, request.budget).expect("a valid MT");
    assert!(outcome.satisfied);
    front
}

/// The tetrahedra of the mesh with what removes each, if anything does.
fn tets(subject: &Subject, front: &Front) -> Vec<([DVec3; 4], Option<UpdateId>)> {
    let (mesh, lattice) = (front.mesh(), &subject.mt.info().lattice);
    let corners = |tet: [u32; 4]| tet.map(|v| lattice.point(mesh.positions()[v as usize]).into());
    (0..).zip(mesh.tets()).map(|(t, &tet)| (corners(tet), subject.mt.remover(mesh, t))).collect()
}

/// The tetrahedra that an update removes.
fn removed(subject: &Subject, u: UpdateId) -> impl Iterator<Item = [DVec3; 4]> + '_ {
    let (explicit, lattice) = (&subject.explicit, &subject.mt.info().lattice);
    let corners =
        |t: u32| explicit.tets()[t as usize].map(|v| lattice.point(explicit.position(VertexId(v))).into());
    explicit.removed(u).iter().map(move |&t| corners(t))
}

/// How far the error of an update may have displaced what it removes.
fn displaced(info: &MtInfo, subject: &Subject, u: UpdateId) -> f64 {
    subject.mt.error(u).error() * info.displacement_per_error
}

#[test]
fn regions_are_refined_as_far_as_they_may_have_been_displaced_and_no_further() {
    for how in KINDS {
        let mut beside = 0;
        for input in inputs() {
            let Some(subject) = Subject::new(how, input) else { continue };
            let info = subject.mt.info();
            let whole = Bounds::of(&subject.input.mesh.positions);
            let doubt = 1e-9 * whole.diagonal();
            for region in regions(&whole) {
                let tolerance = 0.004;
                let front = refined(&subject, &Need::within(tolerance).inside(region.clone()).into());
                let least =
                    |corners| points(corners).map(|p| beyond(&region, p)).fold(f64::INFINITY, f64::min);
                for (corners, remover) in tets(&subject, &front) {
                    let Some(u) = remover.filter(|&u| subject.mt.error(u).error() > tolerance) else {
                        continue;
                    };
                    let margin = displaced(info, &subject, u);
                    let least = least(corners);
                    assert!(least > margin - doubt, "{how:?}: {least} from {region:?} is an error of {u:?}");
                    beside += usize::from(least < 2.0 * margin);
                }
                let may_ask = |u: UpdateId| {
                    let near = |corners| {
                        least(corners) - longest_edge(corners) / f64::from(STEPS)
                            <= displaced(info, &subject, u) + doubt
                    };
                    subject.mt.error(u).error() > tolerance && removed(&subject, u).any(near)
                };
                is_minimal(&subject, &front, may_ask);
            }
        }
        assert!(beside > 0, "{how:?}: nothing is just beside a region");
    }
}

/// Each update of a front may be asked for, or is one that such updates depend on.
fn is_minimal(subject: &Subject, front: &Front, may_ask: impl Fn(UpdateId) -> bool) {
    let mut wanted = vec![false; subject.explicit.updates() as usize];
    // Children have larger numbers.
    for u in (0..subject.explicit.updates()).rev().map(UpdateId).filter(|&u| front.contains(u)) {
        assert!(wanted[u.0 as usize] || may_ask(u), "nothing needs {u:?}");
        subject.explicit.parents(u).iter().for_each(|&p| wanted[p as usize] = true);
    }
}

/// Where a place is in a picture, in pixels, if it is there.
fn seen(view: &View, p: DVec3) -> Option<[f64; 2]> {
    let clip = DMat4::from_cols_array(&view.matrix) * p.extend(1.0);
    let is_there = clip.w > 0.0 && clip.x.abs() <= clip.w && clip.y.abs() <= clip.w;
    is_there.then(|| [clip.x / clip.w * view.viewport[0] / 2.0, clip.y / clip.w * view.viewport[1] / 2.0])
}

/// No visible point of a tetrahedron that is left could be displaced by its error and be seen further away than is allowed.
#[test]
fn no_displacement_that_is_left_looks_larger_than_is_allowed() {
    for how in KINDS {
        let (mut looked_at, mut largest) = (0, 0.0_f64);
        for input in inputs() {
            let Some(subject) = Subject::new(how, input) else { continue };
            let info = subject.mt.info();
            let whole = Bounds::of(&subject.input.mesh.positions);
            let middle = (DVec3::from(whole.min) + DVec3::from(whole.max)) / 2.0;
            for way in [[1.0, 0.2, 0.1], [-0.3, 1.0, -0.2], [0.4, 0.5, 1.0]].map(DVec3::from) {
                let camera = view(middle - whole.diagonal() * way, way, [900.0, 600.0]);
                let pixels = 3.0;
                let front = refined(&subject, &Need::seen(camera, pixels).into());
                for (corners, remover) in tets(&subject, &front) {
                    let Some(u) = remover else { continue };
                    let length = displaced(info, &subject, u);
                    for (p, q) in points(corners).flat_map(|p| ways().map(move |way| (p, p + length * way))) {
                        let (Some(p), Some(q)) = (seen(&camera, p), seen(&camera, q)) else { continue };
                        let moved = (p[0] - q[0]).abs().max((p[1] - q[1]).abs());
                        looked_at += 1;
                        largest = largest.max(moved);
                        assert!(
                            moved <= pixels * (1.0 + 1e-9),
                            "{how:?}: {u:?} moves a point by {moved} pixels"
                        );
                    }
                }
            }
        }
        assert!(looked_at > 1000 && largest > 1.5, "{how:?}: {looked_at} places, at most {largest} pixels");
    }
}

/// Directions all around.
fn ways() -> impl Iterator<Item = DVec3> {
    let steps = || (-1..=1).map(f64::from);
    let all = steps().flat_map(move |x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z))));
    all.filter(|way| *way != DVec3::ZERO).map(DVec3::normalize)
}

/// A tetrahedron that is left has no value of a range, nor one that its error and the rounding to levels may hide.
#[test]
fn values_are_refined_where_they_may_be() {
    for how in KINDS {
        let mut beside = 0;
        for input in inputs() {
            let Some(subject) = Subject::new(how, input) else { continue };
            let field = &subject.mt.info().fields[0];
            for part in [0.1, 0.35, 0.8] {
                let value = field.min + part * field.range();
                let tolerance = 0.004;
                let front = refined(&subject, &Need::within(tolerance).around(0, &[value]).into());
                let mesh = front.mesh();
                for (t, tet) in (0..).zip(mesh.tets()) {
                    let Some(u) = subject.mt.remover(mesh, t) else { continue };
                    let error = subject.mt.errors(u)[0].error();
                    let values = tet.map(|v| field.value(mesh.levels(v)[0]));
                    let [low, high] =
                        [f64::min, f64::max].map(|of| values.into_iter().reduce(of).expect("four"));
                    let away = (low - value).max(value - high);
                    let hidden = error * field.range() + 0.5 * field.step;
                    assert!(
                        error <= tolerance || away > hidden * (1.0 - 1e-9),
                        "{how:?}: {u:?} is {away} from {value}"
                    );
                    beside += usize::from(error > tolerance && away < 2.0 * hidden);
                }
            }
        }
        assert!(beside > 0, "{how:?}: nothing is just beside a value");
    }
}
