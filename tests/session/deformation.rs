//! Promise: a vector is found by its name in any file that has it, its automatic factor depends on the file alone, and the bound of displaced
//! places holds.

use crate::support::files::small_info;
use crate::support::meshes::{built, cube};
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Bounds;
use tetralod::mesh::VectorPart;
use tetralod::mt::{FieldInfo, Mt, MtInfo, MtKind};
use tetralod::refine::{Budget, Need, Request};
use tetralod::session::{Deformation, Session};
use tetralod::view::Probe;

const UNIT: Bounds = Bounds { min: [0.0; 3], max: [1.0; 3] };

fn field(
    name: &str,
    vector: Option<(&str, Option<u8>)>,
    time: Option<f64>,
    [min, max]: [f64; 2],
) -> FieldInfo {
    let vector = vector.map(|(name, component)| VectorPart { name: name.to_owned(), component });
    FieldInfo { name: name.to_owned(), vector, time, min, max, bits: 8, ..FieldInfo::default() }
}

fn info(fields: Vec<FieldInfo>) -> MtInfo {
    small_info(MtKind::Edge, 8, fields, [4, 1, 0])
}

#[test]
fn vectors_are_found_by_what_the_file_says_and_by_their_names() {
    let part = |name: &str, i: u8, time| field(name, Some(("u", Some(i))), time, [-1.0, 1.0]);
    let mut fields =
        vec![field("heat", None, Some(1.0), [0.0, 1.0]), field("u", Some(("u", None)), None, [0.0, 2.0])];
    for time in [0.0, 1.0] {
        // In any order, with any names.
        fields.extend([
            part("second", 1, Some(time)),
            part("third", 2, Some(time)),
            part("first", 0, Some(time)),
        ]);
    }
    fields.extend(["w_x", "w_y", "w_z"].map(|name| field(name, None, None, [0.0, 2.0])));
    // Neither a tensor nor a vector in a plane displaces.
    fields.extend((0..6).map(|i| field(&format!("S_{i}"), Some(("S", Some(i))), None, [0.0, 1.0])));
    fields.extend((0..2).map(|i| field(&format!("p_{i}"), Some(("p", Some(i))), None, [0.0, 1.0])));
    let info = info(fields);
    let found = |name: &str, shown| {
        Deformation::new((&info, shown, &UNIT), name, None, None).map(|found| found.fields)
    };
    assert_eq!(found("u", 0), Ok([7, 5, 6]), "of the time of the field that is shown");
    assert_eq!(found("u", 2), Ok([4, 2, 3]));
    assert_eq!(found("u", 8), Ok([4, 2, 3]), "without that time the first");
    assert_eq!(found("w", 0), Ok([8, 9, 10]));
    assert_eq!(found("w_z,heat,first", 0), Ok([10, 0, 7]), "any three fields");
    assert_eq!(found("w_z,heat,first", 2), Ok([10, 0, 4]));
    for name in ["S", "p", "heat", "", "v", "w_x,w_y", "w_x,w_y,v", "w_x,w_y,w_z,heat"] {
        let unknown = found(name, 0).expect_err("it is no vector in space");
        assert_eq!(unknown.vectors, ["u"]);
        assert!(unknown.to_string().contains(&format!("{name:?}")), "{unknown}");
    }
}

#[test]
fn the_automatic_factor_moves_a_tenth_of_the_diagonal() {
    let parts = |ranges: [[f64; 2]; 3]| {
        let parts = (0..3).map(|i: u8| field("", Some(("u", Some(i))), None, ranges[usize::from(i)]));
        info(
            parts
                .zip(["x", "y", "z"])
                .map(|(field, name)| FieldInfo { name: name.to_owned(), ..field })
                .collect(),
        )
    };
    let bounds = Bounds { min: [0.0; 3], max: [2.0, 3.0, 6.0] };
    let found =
        |info: &MtInfo, factor| Deformation::new((info, 0, &bounds), "u", factor, None).expect("it is there");
    let small = parts([[-3e-6, 1e-6], [0.0, 4e-6], [0.0, 0.0]]);
    let automatic = found(&small, None);
    assert!((automatic.factor - 0.7 / 5e-6).abs() < 1e-6 * automatic.factor, "{automatic:?}");
    assert!((automatic.reach() - 0.7).abs() < 1e-12);
    assert_eq!(found(&small, Some(-20.0)).factor, -20.0);
    // What does not move at all has a factor, too.
    let still = found(&parts([[0.0; 2]; 3]), None);
    assert!(still.factor.is_finite() && still.reach().is_finite());
    // The box has room for all of it: on the side that it goes to, or on both.
    let by = found(&small, Some(1e6));
    let near = |a: Bounds, min: [f64; 3], max: [f64; 3]| {
        a.min.iter().chain(&a.max).zip(min.iter().chain(&max)).all(|(a, b)| (a - b).abs() < 1e-9)
    };
    assert!(near(by.bounds(&small, false, &bounds), [-3.0, 0.0, 0.0], [3.0, 7.0, 6.0]));
    assert!(near(by.bounds(&small, true, &bounds), [-3.0, -4.0, 0.0], [5.0, 7.0, 6.0]));
    let back = found(&small, Some(-1e6));
    assert!(near(back.bounds(&small, false, &bounds), [-1.0, -4.0, 0.0], [5.0, 3.0, 6.0]));
}

#[test]
fn displaced_places_are_within_the_bound() {
    let x: fn([f64; 3]) -> f64 = |[_, y, z]| (2.0 * y).sin() * z;
    let mut mesh = cube(8, &[x, |[x, _, z]| (3.0 * x * z).cos(), |[x, y, z]| x * y + z * z]);
    for (field, name) in mesh.fields.iter_mut().zip(["u_x", "u_y", "u_z"]) {
        field.name = name.to_owned();
    }
    let mt = Mt::from(built(&mesh).mt);
    let mut session = Session::new();
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    // One that is about one component alone says nothing of the others.
    let one = Request { needs: vec![Need::within(0.02).of_field(2)], budget: Budget::default() };
    for request in [Request::within(0.2), one, Request::within(0.05), Request::within(0.0)] {
        session.refine(&request).expect("a good request");
        let bounds = session.bounds().expect("it is there");
        let info = session.info().expect("it is there").clone();
        let by = Deformation::new((&info, 0, &bounds), "u", Some(1.7), Some(0.1)).expect("it is there");
        let errors = by.fields.map(|field| session.error_in(field).expect("it is there"));
        let bound = by.bound(&info, errors);
        let values = by.fields.map(|field| session.values(field));
        let view = session.view();
        let moved = by.moved(view.positions, [0, 1, 2].map(|i| values[i].as_slice()));
        let mut probe = Probe::new(view);
        let mut largest: f64 = 0.0;
        for (p, point) in mesh.positions.iter().enumerate() {
            let place = probe.locate(*point).expect("a cube has all of its points");
            let shown = place.position(&tetralod::view::MeshView { positions: &moved, ..view });
            let known = [0, 1, 2].map(|i| point[i] + 1.7 * by.part * mesh.fields[i].values[p]);
            let off = (0..3).map(|i| (shown[i] - known[i]).powi(2)).sum::<f64>().sqrt();
            largest = largest.max(off);
        }
        assert!(largest <= bound * (1.0 + 1e-9) + 1e-12, "{errors:?}: {largest} of {bound}");
        assert!(largest > 0.01 * bound, "{errors:?}: the bound says something: {largest} of {bound}");
    }
}
