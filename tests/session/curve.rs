//! Promise: the bytes that the index states for a mesh of some error are those that a session fetches for it, in files that come
//! by blocks; those of the whole file in files that come from front to back.

use tetralod::format::{DecodeOptions, Decoder, EncodeOptions, ErrorBytes, encode};
use tetralod::mesh::Field;
use tetralod::mt::MtKind;
use tetralod::refine::{Need, Request};
use tetralod::session::Session;
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate;

const BLOCK_BITS: u32 = 6;

fn file(kind: MtKind, size: u32) -> Vec<u8> {
    let mut mesh = generate::sphere_flow(size).expect("a size that is allowed");
    let height = mesh.positions.iter().map(|p| p[2] * p[2] * p[0]).collect();
    mesh.fields.push(Field::new("height", height));
    let config = BuildConfig { block_bits: BLOCK_BITS, all_fields: true, ..BuildConfig::of(kind) };
    let built = build(&mesh, &config).expect("a valid mesh");
    let options = EncodeOptions { histograms: true, ..EncodeOptions::default() };
    encode(&built.mt, &options).expect("a sound MT")
}

/// A new session with some of the fields, and what it has fetched.
fn opened(file: &[u8], fields: &[String]) -> (Session, u64) {
    let options = DecodeOptions { fields: fields.to_vec(), ..DecodeOptions::default() };
    let mut session = Session::in_parts(options, u64::MAX);
    let mut fetched = 0;
    while session.mesh().is_none() {
        fetched += fetch(&mut session, file);
    }
    (session, fetched)
}

/// Fetches what is wanted first, and returns how many bytes that were.
fn fetch(session: &mut Session, file: &[u8]) -> u64 {
    let Some(wanted) = session.wanted().into_iter().next() else { return 0 };
    let [start, end] = [wanted.range.start, wanted.range.end].map(|at| at.min(file.len() as u64));
    session.take(&wanted.range, &file[start as usize..end as usize]).expect("a sound file");
    end - start
}

fn within(error: f64, field: usize) -> Request {
    Request::from(Need::within(error).of_field(field))
}

/// What a new session fetches in all for a mesh of this error.
fn fetched_for(file: &[u8], fields: &[String], field: usize, error: f64) -> u64 {
    let (mut session, mut fetched) = opened(file, fields);
    session.request(&within(error, field)).expect("a sensible request");
    loop {
        let stats = session.step(&mut |_| true).expect("a sound file");
        match fetch(&mut session, file) {
            0 if stats.done => {
                assert!(stats.satisfied, "{fields:?}, field {field}, {error}");
                return fetched;
            }
            more => fetched += more,
        }
    }
}

/// What the curve says for an error: the first entry that is not above it.
fn stated(curve: &[ErrorBytes], error: f64) -> u64 {
    curve.iter().find(|point| point.error <= error).expect("the last error is 0").bytes
}

fn check_order(curve: &[ErrorBytes]) {
    assert!(curve.windows(2).all(|pair| pair[0].error > pair[1].error && pair[0].bytes < pair[1].bytes));
    assert_eq!(curve.last().map(|point| point.error), Some(0.0));
}

/// A few of the errors of a curve, and such that lie between two.
fn errors_of(curve: &[ErrorBytes]) -> Vec<f64> {
    let step = (curve.len() / 4).max(1);
    let some = curve.iter().step_by(step).map(|point| point.error.min(2.0));
    some.flat_map(|error| [error, error * 1.03]).chain([0.0, 1e-9]).collect()
}

#[test]
fn a_session_fetches_what_the_index_states() {
    {
        let file = file(MtKind::HalfEdge, 14);
        let mut decoder = Decoder::default();
        decoder.feed(&file).expect("a sound file");
        let names: Vec<String> =
            decoder.info().expect("a description").fields.iter().map(|f| f.name.clone()).collect();
        assert!(names.len() > 2, "several fields");
        for (fields, field) in [(&[][..], 1), (&names[1..2], 0), (&names[..2], 1)] {
            let curve = opened(&file, fields).0.bytes_by_error(field);
            check_order(&curve);
            assert!(curve.len() > 12, "{curve:?}");
            for error in errors_of(&curve) {
                assert_eq!(stated(&curve, error), fetched_for(&file, fields, field, error), "{error}");
            }
        }
        let all = opened(&file, &[]).0.bytes_by_error(0);
        let some = opened(&file, &names[..1]).0.bytes_by_error(0);
        let [all, some] = [all, some].map(|curve| curve.last().map_or(0, |point| point.bytes));
        assert!(some < all, "fields that are not wanted are not fetched: {some}, {all}");
    }
}

#[test]
fn files_that_come_in_order_state_their_whole_length() {
    for kind in [MtKind::Edge, MtKind::Vertex] {
        let file = file(kind, 9);
        let mut decoder = Decoder::default();
        decoder.feed(&file[..file.len() / 2]).expect("a sound file");
        let whole = ErrorBytes { error: 0.0, bytes: file.len() as u64 };
        assert_eq!(decoder.bytes_by_error(0, 0), [whole], "{kind:?}");
    }
}

#[test]
fn histograms_are_those_of_the_volume() {
    for kind in MtKind::ALL {
        let file = file(kind, 9);
        let mut decoder = Decoder::default();
        // In front of the base mesh.
        let index = file.windows(4).position(|bytes| bytes == b"MODL").expect("tables");
        decoder.feed(&file[..index]).expect("a sound file");
        assert!(decoder.mt().is_none());
        for (place, field) in decoder.info().expect("a description").fields.iter().enumerate() {
            let shares = decoder.histogram(place).expect("the file has it");
            assert_eq!(shares.len(), 64);
            assert!(
                (shares.iter().sum::<f64>() - 1.0).abs() < 1e-9 && shares.iter().all(|share| *share >= 0.0)
            );
            let mut session = Session::new();
            session.feed(&file).expect("a sound file");
            session.refine(&within(0.0, place)).expect("a sensible request");
            session.set_field(place).expect("a field");
            let mut expected = tetralod::mesh::Histogram::new(field.min, field.max, 64);
            expected.add_mesh(&session.view());
            let volumes = expected.volumes();
            let volume: f64 = volumes.iter().sum();
            // Views have single precision: a value may be in the bin beside its own.
            for (bin, share) in shares.iter().enumerate() {
                let sum = |up: &[f64]| up.iter().sum::<f64>();
                let difference = sum(&shares[..=bin]) - sum(&volumes[..=bin]) / volume;
                assert!(
                    difference.abs() < 2e-4,
                    "{kind:?}, {}, bin {bin}: {share}, {difference}",
                    field.name
                );
            }
        }
        assert_eq!(decoder.histogram(255), None);
    }
}
