//! Promise: who copies only what a session says has changed has the current mesh, whatever was done in between.

use crate::support::meshes::{cube, hilly, linear};
use crate::support::requests::requests;
use std::ops::Range;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::NONE;
use tetralod::mt::{Mt, MtKind};
use tetralod::session::{Session, TetQuantity, Within};
use tetralod::view::{MeshView, MeshWithin, Probe};
use tetralod_build::{BuildConfig, build};

/// A copy of the mesh, kept up by change lists.
#[derive(Default)]
struct Copy {
    positions: Vec<[f64; 3]>,
    field: Vec<f64>,
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
}

/// Brings `to` to the length of `from`, and copies the ranges.
fn copy<T: Clone + Default>(to: &mut Vec<T>, from: &[T], ranges: &[Range<u32>]) {
    to.resize(from.len(), T::default());
    for range in ranges {
        let range = range.start as usize..range.end as usize;
        to[range.clone()].clone_from_slice(&from[range]);
    }
}

impl Copy {
    /// How many tetrahedra were copied.
    fn catch_up(&mut self, session: &mut Session) -> usize {
        let changes = session.take_changes();
        for ranges in [&changes.vertices, &changes.tets] {
            assert!(ranges.iter().all(|range| range.start < range.end));
            assert!(ranges.windows(2).all(|pair| pair[0].end < pair[1].start), "ascending and apart");
        }
        let view = session.view();
        copy(&mut self.positions, view.positions, &changes.vertices);
        copy(&mut self.field, view.field, &changes.vertices);
        copy(&mut self.tets, view.tets, &changes.tets);
        copy(&mut self.neighbors, view.neighbors, &changes.tets);
        assert_eq!(self.positions, view.positions);
        assert_eq!(self.field, view.field);
        assert_eq!(self.tets, view.tets);
        assert_eq!(self.neighbors, view.neighbors);
        changes.tets.iter().map(Range::len).sum()
    }
}

/// What is shown are the tetrahedra within a range, and they are neighbours of each other alone.
fn assert_shown(session: &mut Session, within: Option<Within>) {
    if let Some(within) = within.filter(|within| within.is_cut) {
        return assert_cut(session, within);
    }
    let values = within.map(|within| session.values(within.field)).unwrap_or_default();
    let mesh = session.mesh().expect("it is open");
    let is_within = |tet: &[u32; 4]| {
        within.is_none_or(|Within { range: [low, high], .. }| {
            tet.iter().all(|&v| (low..=high).contains(&values[v as usize]))
        })
    };
    let is_shown: Vec<bool> = mesh.tets().iter().map(|tet| tet[0] != NONE && is_within(tet)).collect();
    let (tets, neighbors) = (mesh.tets().to_vec(), mesh.neighbors().to_vec());
    let shown = |is_shown: bool, all: [u32; 4]| if is_shown { all } else { [NONE; 4] };
    let view = session.view();
    for (t, &is_here) in is_shown.iter().enumerate() {
        assert_eq!(view.tets[t], shown(is_here, tets[t]));
        let across = neighbors[t].map(|n| if n != NONE && is_shown[n as usize] { n } else { NONE });
        assert_eq!(view.neighbors[t], shown(is_here, across), "the neighbours of {t}");
    }
}

/// What is shown is the part of the mesh within a range, with all that is known of it.
fn assert_cut(session: &mut Session, Within { field, range, .. }: Within) {
    let shown = session.view();
    let (positions, bounds) = (shown.positions.to_vec(), shown.bounds());
    let fields = [0, 1].map(|field| session.exact_values(field));
    let mesh = session.mesh().expect("it is open");
    let positions = &positions[..mesh.positions().len()];
    let (tets, neighbors) = (mesh.tets(), mesh.neighbors());
    let whole = MeshView { positions, field: &fields[field], is_label: false, tets, neighbors };
    let expected = MeshWithin::of(&whole, &fields[field], range);
    let of_fields = fields.each_ref().map(|values| expected.interpolate(values));
    for (number, values) in of_fields.iter().enumerate() {
        let found = session.values(number);
        assert!(found.iter().zip(values).all(|(a, b)| (a - b).abs() < 1e-12) && found.len() == values.len());
    }
    for quantity in [TetQuantity::Size, TetQuantity::Depth] {
        assert_eq!(
            session.tet_quantity(quantity).expect("it is open").len(),
            expected.view(&[][..]).tets.len()
        );
    }
    let (own, shown) = (session.values(session.field()), session.view());
    let expected = expected.view(&own);
    assert_eq!((shown.positions, shown.field), (expected.positions, expected.field));
    assert_eq!((shown.tets, shown.neighbors), (expected.tets, expected.neighbors));
    // Probes find the values of all fields inside, and nothing outside.
    for i in 0..40_u32 {
        let at = [7, 11, 13].map(|step| f64::from(i * step % 37) / 37.0);
        let point = [0, 1, 2].map(|axis| bounds.min[axis] + at[axis] * (bounds.max[axis] - bounds.min[axis]));
        let Some(place) = Probe::new(session.view()).locate(point) else {
            assert_eq!(session.reading(point), Ok(None));
            continue;
        };
        let reading = session.reading(point).expect("it is open").expect("it is inside");
        assert!(reading.values[field] > range[0] - 1e-9 && reading.values[field] < range[1] + 1e-9);
        for (number, found) in reading.values.iter().enumerate() {
            let values = session.values(number);
            let expected = place.value(&MeshView { field: &values, ..session.view() });
            assert!((found - expected).abs() < 1e-9, "field {number}: {found} instead of {expected}");
        }
    }
}

fn opened(mt: &Mt) -> Session {
    let mut session = Session::new();
    session.feed(&encode(mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session
}

#[test]
fn copies_follow_a_walk_of_requests_and_steps() {
    let mesh = cube(6, &[hilly, linear]);
    for kind in MtKind::ALL {
        let config = BuildConfig { all_fields: true, ..BuildConfig::of(kind) };
        let built = build(&mesh, &config);
        let mut session = opened(&built.expect("a valid mesh").mt);
        let (mut copy, mut within) = (Copy::default(), None);
        for i in 0_usize..60 {
            let request = &requests()[i * i % 7];
            session.request(request).expect("a good request");
            // Some steps are handed out, some are not, and some requests are replaced on the way.
            for step in 1..12 {
                let mut updates = i + 3 * step;
                let stats = session.step(&mut |_| {
                    updates -= 1;
                    updates > 0
                });
                if i % 3 == 0 {
                    copy.catch_up(&mut session);
                }
                if stats.expect("a good MT").done {
                    break;
                }
            }
            if i % 4 == 1 {
                // Looks at the mesh too, and must not take the changes away.
                session.isosurface(0.3).expect("it is open");
            }
            if i % 7 == 2 {
                session.set_field(i % 2).expect("there are two");
            }
            if i % 12 == 3 || i % 12 == 9 {
                let range = Within { field: i / 12 % 2, range: [0.2, 0.6], is_cut: i / 24 % 2 == 0 };
                within = (i % 12 == 3).then_some(range);
                session.show_within(within);
            }
            if i % 5 < 3 {
                assert_shown(&mut session, within);
                copy.catch_up(&mut session);
            }
        }
        assert!(copy.catch_up(&mut session) <= copy.tets.len());
        assert_eq!(copy.catch_up(&mut session), 0, "nothing has changed since");
    }
}
