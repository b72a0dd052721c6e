//! Promise: every point of the domain is found, and no other; a line is followed through every tetrahedron, with gaps
//! where it is outside; streamlines follow their field; what is said of a field over a mesh is exact.

use crate::scenes::Scene;
use crate::support::meshes::{bent, blocks, cube, hilly, linear};
use crate::support::random::Random;
use crate::walk::{KINDS, Walk};
use std::f64::consts::PI;
use tetralod::mesh::TetMesh;
use tetralod::view::{FieldStats, Histogram, MeshView, Place, Probe, Span, StreamEnd, TraceOptions, Tracer};

fn scene(mesh: &TetMesh) -> Scene {
    let positions = mesh.positions.clone();
    let field = mesh.fields[0].values.clone();
    Scene::new(positions, field, mesh.tets.clone())
}

/// A cube without its middle and without a bar from the middle to one side: a pocket.
fn pocket() -> Scene {
    scene(&blocks([6, 6, 6], &[linear], |[x, y, z]| {
        !((2..4).contains(&x) && (2..4).contains(&y) && (2..6).contains(&z))
    }))
}

fn in_pocket([x, y, z]: [f64; 3]) -> bool {
    let inner = |c: f64| 2.0 / 6.0 < c && c < 4.0 / 6.0;
    inner(x) && inner(y) && 2.0 / 6.0 < z
}

/// In the cube from -0.1 to 1.1.
fn random_point(random: &mut Random) -> [f64; 3] {
    [(); 3].map(|()| 1.2 * random.fraction() - 0.1)
}

/// A point of a grid, on which many tetrahedra meet.
fn random_corner(random: &mut Random, cells: f64) -> [f64; 3] {
    random_point(random).map(|x| (x * 2.0 * cells).round() / (2.0 * cells))
}

/// The place of a point by asking all tetrahedra in turn, inexactly.
fn holds(mesh: &MeshView<'_>, place: &Place, p: [f64; 3]) -> bool {
    let tet = mesh.tets[place.tet as usize];
    let at =
        [0, 1, 2].map(|i| (0..4).map(|k| place.weights[k] * mesh.positions[tet[k] as usize][i]).sum::<f64>());
    place.weights.iter().all(|w| *w >= 0.0)
        && (place.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12
        && (0..3).all(|i| (at[i] - p[i]).abs() < 1e-9)
}

#[test]
fn a_label_is_that_of_the_nearest_corner() {
    let mesh = bent(5);
    let field: Vec<f64> = (0..mesh.positions.len()).map(|v| [2.0, 7.0, -3.0][v * v % 3]).collect();
    let scene = Scene::new(mesh.positions, field, mesh.tets);
    let view = MeshView { is_label: true, ..scene.view() };
    let (mut probe, mut random) = (Probe::new(view), Random::new(5));
    let mut seen = 0;
    for _ in 0..4000 {
        let p = random_point(&mut random);
        let Some(place) = probe.locate(p) else { continue };
        let corners = view.tets[place.tet as usize].map(|v| v as usize);
        // The barycentric coordinate of a corner is the share of the tetrahedron opposite of it.
        let share = |corner: usize| {
            let mut ends = corners.map(|v| view.positions[v]);
            ends[corner] = p;
            let [u, v, w] = [1, 2, 3].map(|k| [0, 1, 2].map(|i| ends[k][i] - ends[0][i]));
            let cross = |i: usize| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
            (0..3).map(|i| cross(i) * w[i]).sum::<f64>()
        };
        let nearest = (0..4).max_by(|&a, &b| share(a).total_cmp(&share(b))).expect("four corners");
        let close = (0..4).filter(|&k| k != nearest && share(nearest) - share(k) < 1e-9).count();
        if close == 0 {
            assert_eq!(place.value(&view), view.field[corners[nearest]], "{p:?}");
            seen += 1;
        }
    }
    assert!(seen > 1000, "{seen}");
    // Between corners that are as near it is the smaller label.
    let middle = Place { tet: 0, weights: [0.25; 4] };
    let labels = view.tets[0].map(|v| view.field[v as usize]);
    assert_eq!(middle.value(&view), labels.into_iter().fold(f64::INFINITY, f64::min));
}

#[test]
fn points_are_found_inside_and_not_outside() {
    let mut random = Random::new(1);
    for (scene, has_pocket) in [(scene(&cube(6, &[linear])), false), (pocket(), true)] {
        let view = scene.view();
        let (mut walking, mut boxed) = (Probe::new(view), Probe::new(view));
        boxed.make_grid();
        for i in 0..4000 {
            let p = if i % 2 == 0 { random_point(&mut random) } else { random_corner(&mut random, 6.0) };
            let near_face =
                p.iter().any(|x| [0.0, 2.0, 4.0, 6.0].iter().any(|face| (x - face / 6.0).abs() < 1e-6));
            let inside = p.iter().all(|x| (0.0..=1.0).contains(x)) && !(has_pocket && in_pocket(p));
            let places = [walking.locate(p), boxed.locate(p)];
            assert_eq!(places[0], places[1], "{p:?}");
            // Faces at thirds are rounded to single precision.
            assert!(places[0].is_some() == inside || near_face, "{p:?}: {places:?}");
            if let Some(place) = places[0] {
                assert!(holds(&view, &place, p), "{p:?}: {place:?}");
                assert!((place.value(&view) - linear(p)).abs() < 1e-5);
            }
        }
        let corners: Vec<[f64; 3]> = scene.positions.iter().map(|p| p.map(f64::from)).collect();
        let places = Probe::new(view).locate_all(&corners);
        for (corner, place) in corners.iter().zip(&places) {
            let place = place.expect("a point of the mesh");
            assert_eq!(walking.locate(*corner), Some(place));
            assert_eq!(place.weights.iter().filter(|w| **w == 0.0).count(), 3, "{place:?}");
        }
        assert!(walking.locate([f64::NAN, 0.5, 0.5]).is_none());
        assert!(walking.locate([0.5, f64::INFINITY, 0.5]).is_none());
    }
    assert!(Probe::new(Scene::default().view()).locate([0.0; 3]).is_none());
}

#[test]
fn where_tetrahedra_meet_the_same_one_is_found_whatever_their_numbers_are() {
    let mesh = bent(4);
    let mut backwards = mesh.clone();
    backwards.tets.reverse();
    let scenes = [mesh, backwards].map(|mesh| scene(&mesh));
    let mut random = Random::new(11);
    for _ in 0..400 {
        let of = scenes[0].view().tets[random.below(scenes[0].view().tets.len())];
        let corners = of.map(|v| scenes[0].view().positions[v as usize]);
        // A corner, and the middles of an edge and of two such points.
        let middle = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|i| 0.5 * (a[i] + b[i]));
        for p in
            [corners[0], middle(corners[0], corners[1]), middle(middle(corners[0], corners[1]), corners[2])]
        {
            let found = scenes.each_ref().map(|scene| {
                let view = scene.view();
                // From anywhere, with the grid and without.
                let mut probe = Probe::new(view);
                if random.fraction() < 0.5 {
                    probe.make_grid();
                }
                probe.locate(random_point(&mut random));
                view.tets[probe.locate(p).expect("it is in the mesh").tet as usize]
            });
            assert_eq!(found[0], found[1]);
            let line = |i: usize| Probe::new(scenes[i].view()).line(corners[0], corners[3]);
            let tets = [0, 1].map(|i| -> Vec<_> {
                line(i).iter().map(|span| scenes[i].view().tets[span.entry.tet as usize]).collect()
            });
            assert_eq!(tets[0], tets[1]);
        }
    }
}

#[test]
fn points_are_found_in_every_current_mesh() {
    for kind in KINDS {
        let mut walk = Walk::new(&cube(7, &[hilly]), kind);
        for _ in 0..4 {
            walk.change(150, true);
            let points: Vec<[f64; 3]> =
                (0..200).map(|_| [(); 3].map(|()| walk.random.below(1001) as f64 / 1000.0)).collect();
            let view = walk.view();
            let mut probe = Probe::new(view);
            for p in points {
                // Coarse meshes have cut-off corners: some points are outside.
                let place = probe.locate(p);
                let deepest =
                    view.tets.iter().map(|tet| depth(&view, *tet, p)).fold(f64::NEG_INFINITY, f64::max);
                assert!(place.is_some() == (deepest >= 0.0) || deepest.abs() < 1e-12, "{p:?}: {deepest}");
                assert!(place.is_none_or(|place| holds(&view, &place, p)));
            }
        }
    }
}

/// How far a point is inside a tetrahedron, by volumes; negative outside.
fn depth(mesh: &MeshView<'_>, tet: [u32; 4], p: [f64; 3]) -> f64 {
    let corners = tet.map(|v| mesh.positions[v as usize].map(f64::from));
    let volume = |[a, b, c, d]: [[f64; 3]; 4]| {
        let [u, v, w] = [b, c, d].map(|q| [0, 1, 2].map(|i| q[i] - a[i]));
        u[0] * (v[1] * w[2] - v[2] * w[1])
            + u[1] * (v[2] * w[0] - v[0] * w[2])
            + u[2] * (v[0] * w[1] - v[1] * w[0])
    };
    let parts = [0, 1, 2, 3].map(|k| {
        let mut part = corners;
        part[k] = p;
        volume(part)
    });
    parts.into_iter().fold(f64::INFINITY, f64::min)
}

fn at(from: [f64; 3], to: [f64; 3], s: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| from[i] + s * (to[i] - from[i]))
}

fn check_line(probe: &mut Probe<'_>, spans: &[Span], from: [f64; 3], to: [f64; 3]) {
    let mesh = *probe.mesh();
    let mut last = 0.0;
    for span in spans {
        assert!(span.from >= last && span.to > span.from && span.to <= 1.0);
        assert_eq!(span.entry.tet, span.exit.tet);
        assert!(holds(&mesh, &span.entry, at(from, to, span.from)), "{span:?}");
        assert!(holds(&mesh, &span.exit, at(from, to, span.to)), "{span:?}");
        last = span.to;
    }
    for pair in spans.windows(2).filter(|pair| pair[0].to == pair[1].from) {
        assert!(
            (pair[0].exit.value(&mesh) - pair[1].entry.value(&mesh)).abs() < 1e-6,
            "the field is continuous"
        );
    }
    // The profile is that of many points on the line.
    for i in 0..=300 {
        let s = f64::from(i) / 300.0;
        let place = probe.locate(at(from, to, s));
        let span = spans.iter().find(|span| span.from <= s && s <= span.to);
        let near_end = spans.iter().any(|span| (span.from - s).abs() < 1e-6 || (span.to - s).abs() < 1e-6);
        // Lines along faces are beside them by what rounding does.
        let in_face = place.is_some_and(|place| place.weights.iter().any(|w| *w < 1e-9)) || near_end;
        assert!(place.is_some() == span.is_some() || in_face, "{from:?} {to:?} at {s}: {place:?} {span:?}");
        if let (Some(place), Some(span)) = (place, span) {
            let part = (s - span.from) / (span.to - span.from);
            let [enter, leave] = [span.entry, span.exit].map(|place| place.value(&mesh));
            assert!((enter + part * (leave - enter) - place.value(&mesh)).abs() < 1e-5);
            assert!(place.tet == span.entry.tet || in_face);
        }
    }
}

#[test]
fn lines_pass_through_every_tetrahedron_on_their_way() {
    let mut random = Random::new(2);
    for scene in [scene(&cube(6, &[linear])), pocket(), scene(&bent(5))] {
        let mut scanning = Probe::new(scene.view());
        let mut boxed = Probe::new(scene.view());
        boxed.make_grid();
        for i in 0..60 {
            let [from, to] = [(); 2].map(|()| match i % 3 {
                0 => random_point(&mut random),
                1 => random_point(&mut random).map(|x| 4.0 * x - 1.5),
                _ => random_corner(&mut random, 6.0),
            });
            let without = Probe::new(scene.view()).line(from, to);
            let spans = boxed.line(from, to);
            assert_eq!(without, spans, "{from:?} {to:?}");
            check_line(&mut scanning, &spans, from, to);
        }
    }
}

#[test]
fn lines_have_gaps_where_they_are_outside() {
    let scene = pocket();
    let probe = Probe::new(scene.view());
    let spans = probe.line([-1.0, 0.51, 0.52], [3.0, 0.51, 0.52]);
    let gaps: Vec<_> = spans.windows(2).filter(|pair| pair[0].to < pair[1].from).collect();
    assert_eq!(gaps.len(), 1);
    for (found, expected) in [spans[0].from, gaps[0][0].to, gaps[0][1].from, spans[spans.len() - 1].to]
        .into_iter()
        .zip([0.25, 0.25 + 1.0 / 12.0, 0.25 + 1.0 / 6.0, 0.5])
    {
        assert!((found - expected).abs() < 1e-7, "{found} {expected}");
    }
    // Along an edge of the domain, through points of the mesh, beside it, nowhere.
    let length = |from, to| probe.line(from, to).iter().map(|span| span.to - span.from).sum::<f64>();
    assert!((length([0.0; 3], [1.0, 0.0, 0.0]) - 1.0).abs() < 1e-9);
    assert!((length([0.0, 0.25, 0.0], [1.0, 0.25, 1.0]) - 1.0).abs() < 1e-9);
    assert!((length([0.0; 3], [0.25, 0.25, 0.25]) - 1.0).abs() < 1e-9);
    assert_eq!(length([0.0, -0.1, 0.0], [1.0, -0.1, 0.0]), 0.0);
    assert_eq!(length([0.5, 0.1, 0.1], [0.5, 0.1, 0.1]), 0.0);
}

/// The components of a vector field at the points.
fn vectors(scene: &Scene, f: impl Fn([f64; 3]) -> [f64; 3]) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|i| scene.positions.iter().map(|p| f(p.map(f64::from))[i]).collect())
}

#[test]
fn streamlines_of_a_rotation_stay_on_their_circles() {
    let scene = scene(&cube(8, &[linear]));
    let field = vectors(&scene, |[x, y, _]| [0.5 - y, x - 0.5, 0.0]);
    let mut tracer = Tracer::new(scene.view(), field.each_ref().map(Vec::as_slice));
    for radius in [0.05, 0.2, 0.45] {
        for backward in [false, true] {
            let turn = 2.0 * PI * radius;
            let options = TraceOptions { max_length: 3.0 * turn, backward, ..TraceOptions::default() };
            let line = tracer.trace([0.5 + radius, 0.5, 0.3], &options).expect("inside");
            assert_eq!(line.end, StreamEnd::Length);
            for point in &line.points {
                let [x, y, z] = point.position;
                let distance = ((x - 0.5).powi(2) + (y - 0.5).powi(2)).sqrt();
                assert!(
                    (distance - radius).abs() < 1e-3 * radius && (z - 0.3).abs() < 1e-9,
                    "{radius}: {distance}"
                );
                // One unit of time is one radian.
                let angle = (y - 0.5).atan2(x - 0.5);
                let off = ((point.time - angle) / (2.0 * PI)).fract().abs();
                assert!(off.min(1.0 - off) < 2e-3, "{angle} at {}", point.time);
                let speed = point.vector.iter().map(|v| v * v).sum::<f64>().sqrt();
                assert!((speed - radius).abs() < 1e-3);
            }
            let last = line.points[line.points.len() - 1];
            assert!((last.time.abs() - 6.0 * PI).abs() < 0.05 && (last.time < 0.0) == backward);
        }
    }
    // Outside the largest circle that fits, it leaves.
    let line = tracer.trace([0.97, 0.9, 0.3], &TraceOptions::default()).expect("inside");
    assert_eq!(line.end, StreamEnd::Boundary);
    let end = line.points[line.points.len() - 1].position;
    assert!(end.iter().any(|x| x.abs() < 1e-5 || (x - 1.0).abs() < 1e-5), "{end:?}");
    assert!(tracer.trace([1.5, 0.5, 0.5], &TraceOptions::default()).is_none());
    let centre = tracer.trace([0.5, 0.5, 0.5], &TraceOptions::default()).expect("inside");
    assert_eq!((centre.end, centre.points.len()), (StreamEnd::Stagnation, 1));
}

#[test]
fn streamlines_end_at_sinks_and_limits() {
    let scene = scene(&cube(5, &[linear]));
    let sink = vectors(&scene, |p| p.map(|x| 0.43 - x));
    let mut tracer = Tracer::new(scene.view(), sink.each_ref().map(Vec::as_slice));
    let options = TraceOptions { min_speed: 1e-3, ..TraceOptions::default() };
    let line = tracer.trace([0.9, 0.2, 0.7], &options).expect("inside");
    assert_eq!(line.end, StreamEnd::Stagnation);
    let end = line.points[line.points.len() - 1].position;
    assert!(end.iter().all(|x| (x - 0.43).abs() < 2e-3), "{end:?}");
    let options = TraceOptions { max_steps: 7, ..options };
    let line = tracer.trace([0.9, 0.2, 0.7], &options).expect("inside");
    assert_eq!((line.end, line.points.len()), (StreamEnd::Steps, 8));
    let nothing = vectors(&scene, |_| [0.0; 3]);
    let mut tracer = Tracer::new(scene.view(), nothing.each_ref().map(Vec::as_slice));
    assert_eq!(tracer.trace([0.3; 3], &options).expect("inside").end, StreamEnd::Stagnation);
}

#[test]
fn histograms_hold_the_whole_volume_where_it_belongs() {
    for mesh in [cube(6, &[linear]), cube(7, &[hilly]), bent(5)] {
        let scene = scene(&mesh);
        let stats = FieldStats::of(&scene.view());
        let [min, max] = stats.range();
        for bins in [1, 7, 100, 1000] {
            let mut histogram = Histogram::new(min, max, bins);
            histogram.add_mesh(&scene.view());
            let volumes = histogram.volumes();
            assert!(volumes.iter().all(|v| *v >= -1e-12));
            assert!((volumes.iter().sum::<f64>() - stats.volume()).abs() < 1e-12 * stats.volume());
            assert_eq!(histogram.outside(), [0.0; 2]);
            // Narrower: what falls out is counted aside.
            let mut narrow = Histogram::new(min + 0.2 * (max - min), min + 0.6 * (max - min), bins);
            narrow.add_mesh(&scene.view());
            let [below, above] = narrow.outside();
            let inside: f64 = narrow.volumes().iter().sum();
            assert!(below > 0.0 && above > 0.0 && inside > 0.0);
            assert!((below + inside + above - stats.volume()).abs() < 1e-12 * stats.volume());
        }
    }
}

#[test]
fn histograms_are_exact() {
    // The linear field x: every bin has the same share; in the ball's distance it would not.
    let x_of = scene(&cube(6, &[|[x, _, _]| x]));
    let mut histogram = Histogram::new(0.0, 1.0, 10);
    histogram.add_mesh(&x_of.view());
    assert!(histogram.volumes().iter().all(|v| (v - 0.1).abs() < 1e-7), "{:?}", histogram.volumes());
    // x + y + z: the distribution of Irwin and Hall.
    let sum_of = scene(&cube(4, &[|[x, y, z]| x + y + z]));
    let mut histogram = Histogram::new(0.0, 3.0, 30);
    histogram.add_mesh(&sum_of.view());
    let mut below = 0.0;
    for (b, volume) in histogram.volumes().into_iter().enumerate() {
        below += volume;
        let x = histogram.edge(b + 1);
        let cube_of = |y: f64| y.max(0.0).powi(3);
        let expected = (cube_of(x) - 3.0 * cube_of(x - 1.0) + 3.0 * cube_of(x - 2.0)) / 6.0;
        assert!((below - expected).abs() < 1e-7, "{x}: {below} {expected}");
    }
    // A constant is in one bin, also at the ends.
    for (value, bin) in [(0.0, 0), (0.25, 1), (0.3, 1), (1.0, 3)] {
        let mut flat = x_of.clone();
        flat.field.fill(value);
        let mut histogram = Histogram::new(0.0, 1.0, 4);
        histogram.add_mesh(&flat.view());
        assert!((histogram.volumes()[bin] - 1.0).abs() < 1e-7, "{value}: {:?}", histogram.volumes());
    }
}

#[test]
fn integrals_are_exact() {
    let stats = FieldStats::of(&scene(&cube(6, &[linear])).view());
    // x + 2 y - 3 z over the unit cube: mean 0, variance (1 + 4 + 9) / 12.
    assert!(
        (stats.volume() - 1.0).abs() < 1e-6 && stats.integral().abs() < 1e-6 && stats.mean().abs() < 1e-6
    );
    assert!((stats.deviation() - (14.0_f64 / 12.0).sqrt()).abs() < 1e-6);
    assert_eq!(stats.range(), [-3.0, 3.0]);
    let nothing = FieldStats::of(&Scene::default().view());
    assert_eq!((nothing.volume(), nothing.mean(), nothing.deviation()), (0.0, 0.0, 0.0));
}
