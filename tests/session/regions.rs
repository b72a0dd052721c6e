//! Promise: what is said of each region is what closed forms say of it, and adds up to what is said of the whole; its error is that of its
//! tetrahedra, so that a finer one can be asked for in some regions than in others.

use crate::support::meshes::parted;
use tetralod::format::{EncodeOptions, encode};
use tetralod::refine::{Need, Request};
use tetralod::session::{RegionStats, Session, TetQuantity, Within};
use tetralod::view::FieldStats;
use tetralod_build::{BuildConfig, build};

const LINEAR: usize = 1;

fn opened() -> Session {
    let config = BuildConfig { preserve: vec!["part".into()], all_fields: true, ..BuildConfig::default() };
    let mt = build(&parted(12), &config).expect("a valid mesh").mt;
    let mut session = Session::new();
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session
}

fn near(a: f64, b: f64) -> bool {
    // Positions and values are rounded to 16 bits.
    (a - b).abs() <= 2e-4
}

#[test]
fn a_linear_field_has_the_statistics_of_closed_forms_in_each_region() {
    let mut session = opened();
    session.set_field(LINEAR).expect("there are two");
    // x + 2 y - 3 z in boxes: the whole, its half, the core and the half of that.
    let core = 1.0 / 27.0;
    let half = 0.5 - 0.5 * core;
    let mean = (-0.25 * 0.5 + 0.5 * core / 12.0) / half;
    let variance = |[x, y, z]: [f64; 3]| (x * x + 4.0 * y * y + 9.0 * z * z) / 12.0;
    // Second moments about 0 are those about the mean, and its square.
    let second = 0.5 * (variance([0.5, 1.0, 1.0]) + 0.25 * 0.25);
    let of_core = 0.5 * core * (variance([0.5 / 3.0, 1.0 / 3.0, 1.0 / 3.0]) + 1.0 / 144.0);
    let deviation = ((second - of_core) / half - mean * mean).sqrt();
    let in_core = variance([1.0 / 3.0; 3]).sqrt();
    let expected = [
        (half, mean, deviation, [-3.0, 2.5]),
        (half, -mean, deviation, [-2.5, 3.0]),
        (core, 0.0, in_core, [-1.0, 1.0]),
    ];
    for error in [0.0, 0.2] {
        session.refine(&Request::within(error)).expect("a good request");
        let found = session.region_stats();
        assert_eq!(found.iter().map(|one| one.region).collect::<Vec<_>>(), [0, 1, 2]);
        for (RegionStats { field, .. }, (volume, mean, deviation, range)) in found.iter().zip(&expected) {
            assert!(near(field.volume(), *volume), "{} {volume}", field.volume());
            assert!(near(field.mean(), *mean), "{} {mean}", field.mean());
            assert!(near(field.deviation(), *deviation), "{} {deviation}", field.deviation());
            assert!(
                field.range().iter().zip(range).all(|(a, b)| near(*a, *b)),
                "{:?} {range:?}",
                field.range()
            );
        }
    }
}

#[test]
fn regions_add_up_to_the_whole_and_hidden_ones_are_left_out() {
    let mut session = opened();
    for error in [0.3, 0.02, 0.0] {
        session.refine(&Request::within(error)).expect("a good request");
        // As they are, and where each is cut into pieces.
        for is_cut in [false, true] {
            session.show_regions(None);
            session.show_within(is_cut.then_some(Within { field: LINEAR, range: [-0.7, 0.4], is_cut }));
            let (whole, parts) = (FieldStats::of(&session.view()), session.region_stats());
            let sum = |of: fn(&FieldStats) -> f64| parts.iter().map(|part| of(&part.field)).sum::<f64>();
            assert!((sum(FieldStats::volume) - whole.volume()).abs() < 1e-12);
            assert!((sum(FieldStats::integral) - whole.integral()).abs() < 1e-12);
            assert_eq!(parts.iter().map(|part| part.field.tetrahedra()).sum::<u32>(), whole.tetrahedra());
            let ends = |end: usize| parts.iter().map(move |part| part.field.range()[end]);
            let range = [ends(0).fold(f64::INFINITY, f64::min), ends(1).fold(f64::NEG_INFINITY, f64::max)];
            assert_eq!(range, whole.range());
            // Second moments add up, too.
            let moment =
                |field: &FieldStats| field.volume() * (field.deviation().powi(2) + field.mean().powi(2));
            assert!((sum(moment) - moment(&whole)).abs() < 1e-12);
            session.show_regions(Some(&[1]));
            let [one] = &session.region_stats()[..] else { panic!("one region is shown") };
            assert_eq!((one.region, one.field.volume()), (1, parts[1].field.volume()));
            assert_eq!(FieldStats::of(&session.view()).volume(), one.field.volume());
        }
    }
}

#[test]
fn the_error_of_a_region_is_that_of_its_tetrahedra_and_can_be_asked_for() {
    let mut session = opened();
    let fine = Need::within(0.01).in_regions(vec![1]);
    let coarse = Need::within(0.2);
    let mut sizes = Vec::new();
    let least = (0..2).map(|f| session.info().expect("it is open").floor(f)).fold(0.0, f64::max);
    for request in [Request::from(coarse.clone()), Request::from(coarse).and(fine), Request::within(0.01)] {
        let stats = session.refine(&request).expect("a good request");
        assert!(stats.satisfied);
        // Those of the largest error of all fields; of one field they are no larger.
        let largest = session.tet_quantity(TetQuantity::Error).expect("it is open");
        let regions = session.mesh().expect("it is open").regions().to_vec();
        let parts = session.region_stats();
        for RegionStats { region, error, .. } in &parts {
            let own = largest.iter().zip(&regions).filter(|(_, of)| *of == region);
            assert!(*error <= own.map(|(error, _)| *error).fold(least, f64::max), "region {region}");
        }
        sizes.push((stats.tetrahedra, parts[0].error, parts[1].error));
    }
    let [coarse, both, fine] = sizes[..] else { unreachable!() };
    assert!(coarse.0 < both.0 && both.0 < fine.0, "{sizes:?}");
    assert!(coarse.2 > 0.01 && both.2 <= 0.01 && both.1 > 0.01 && both.1 <= 0.2, "{sizes:?}");
}
