//! Promise: the surface of a session that goes from request to request is that of its mesh, whatever was before, for
//! MTs of every kind.

use crate::support::conformance::{DELAUNAY, EDGE, HALF_EDGE, INSERTED};
use crate::support::meshes::{bent, cube, hilly, linear};
use crate::support::random::Random;
use std::collections::BTreeMap;
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Bounds;
use tetralod::refine::{Budget, Need, Region, Request};
use tetralod::session::Session;
use tetralod::view::{IsoSurface, NormalKind};

type Corner = [u64; 6];

/// The triangles as bits of positions and normals, each from its least corner on, in order.
fn triangles(surface: &IsoSurface) -> Vec<[Corner; 3]> {
    let corner = |v: u32| {
        let ([x, y, z], [a, b, c]) = (surface.positions[v as usize], surface.normals[v as usize]);
        [x, y, z, a.into(), b.into(), c.into()].map(f64::to_bits)
    };
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().expect("three")
    };
    let mut all: Vec<_> = surface.indices.iter().map(turned).collect();
    all.sort_unstable();
    all
}

/// What the random requests ask for.
#[derive(Clone, Default)]
struct Wish {
    error: f64,
    isovalues: Vec<f64>,
    roi: Option<Bounds>,
    tets: Option<u32>,
}

impl Wish {
    fn request(&self) -> Request {
        let need = Need::within(self.error).limited(self.roi.map(Region::Box), 0, &self.isovalues);
        Request { needs: vec![need], budget: Budget { tets: self.tets, ..Budget::default() } }
    }
}

/// A request that is a little, or much, away from the one before.
fn next(wish: &Wish, random: &mut Random) -> Wish {
    let mut next = wish.clone();
    match random.below(6) {
        0 => next.error = [0.0, 0.002, 0.01, 0.05, f64::INFINITY][random.below(5)],
        1 => next.isovalues = (0..random.below(3)).map(|_| random.below(10) as f64 / 10.0).collect(),
        2 => next.tets = random.once_in(2).then(|| 50 + random.below(900) as u32),
        _ => {
            let low = [0; 3].map(|_| random.below(100) as f64 / 100.0);
            next.roi = Some(Bounds { min: low, max: low.map(|x| x + 0.4) });
        }
    }
    next
}

/// Every directed edge that is not at the border of the domain has as many opposite ones.
fn assert_closed(surface: &IsoSurface, inside: impl Fn([f64; 3]) -> bool) {
    let mut edges = BTreeMap::new();
    for [a, b, c] in &surface.indices {
        for edge in [[*a, *b], [*b, *c], [*c, *a]] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    for ([a, b], count) in &edges {
        let is_inside = [a, b].iter().any(|v| inside(surface.positions[**v as usize]));
        assert!(!is_inside || edges.get(&[*b, *a]) == Some(count), "edge {a}-{b}");
    }
}

#[test]
fn the_surface_follows_every_kind_of_mt_from_request_to_request() {
    let in_cube = |p: [f64; 3]| p.iter().all(|x| 0.001 < *x && *x < 0.999);
    for how in [EDGE, HALF_EDGE, DELAUNAY, INSERTED] {
        for (is_cube, mesh) in [(true, cube(7, &[hilly, linear])), (false, bent(6))] {
            if how == INSERTED && !is_cube {
                continue;
            }
            let bytes = encode(&how.build(&mesh, None), &EncodeOptions::default()).expect("a complete MT");
            let mut session = Session::new();
            session.feed(&bytes).expect("a good file");
            let mut random = Random::new(7);
            let mut wish = Wish::default();
            let mut values = vec![0.3];
            for step in 0..60 {
                session.refine(&wish.request()).expect("a good request");
                if is_cube && step % 17 == 16 {
                    session.set_field(step / 17 % 2).expect("it has two");
                }
                let found = session.isosurfaces(&values).expect("it is open").clone();
                let mut wanted = IsoSurface::new();
                wanted.extract_all(&session.view(), &values);
                assert!(
                    triangles(&found) == triangles(&wanted),
                    "{how:?}, step {step}: {:?}",
                    wish.request()
                );
                if is_cube {
                    assert_closed(&found, in_cube);
                }
                wish = next(&wish, &mut random);
                if random.once_in(6) {
                    values = (0..1 + random.below(3)).map(|_| random.below(10) as f64 / 10.0).collect();
                }
            }
        }
    }
}

#[test]
fn who_asks_for_smooth_normals_gets_them() {
    let bytes = encode(&EDGE.build(&cube(6, &[hilly]), None), &EncodeOptions::default()).expect("complete");
    let mut session = Session::new();
    session.feed(&bytes).expect("a good file");
    session.refine(&Request::within(0.0)).expect("a good request");
    let by_gradient = session.isosurface(0.3).expect("it is open").normals.clone();
    session.set_normal_kind(NormalKind::Smooth);
    let smooth = session.isosurface(0.3).expect("it is open").normals.clone();
    assert_eq!(by_gradient.len(), smooth.len());
    assert!(by_gradient != smooth);
    let changes = session.take_surface_changes();
    let all = 0..smooth.len() as u32;
    assert_eq!(changes.vertices, std::slice::from_ref(&all));
}
