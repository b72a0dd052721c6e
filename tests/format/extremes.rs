//! Promise: a file states the smallest and the largest value of each field and where the input has them, and what averaging fields at
//! cells has done, in front of its updates; whoever rewrites the file keeps it. What cannot be so is refused.

use crate::reader;
use crate::support::files::{assemble, decode, in_blocks, sections};
use crate::support::meshes::{bent, blocks, hilly};
use tetralod::format::{DecodeOptions, Decoder, EncodeOptions, FormatError, encode};
use tetralod::mesh::{Extreme, Extremes, Field, TetMesh};
use tetralod::mt::{FieldInfo, Mt, MtKind, MultiTessellation};
use tetralod_build::{BuildConfig, build};

/// A mesh with a field at points, two time steps of another, and one that was averaged from cells.
fn mesh() -> TetMesh {
    let mut mesh = blocks([5, 4, 3], &[hilly], |c| c[0] > 1 || c[1] < 2);
    mesh.input.cells = tetralod::mesh::CellNumbers::same(mesh.tets.len());
    let at_points = |scale: f64| mesh.positions.iter().map(|[x, y, z]| scale * (x * y - z * z)).collect();
    for (time, scale) in [(0.0, 1.0), (0.5, -3.0)] {
        mesh.fields.push(Field { time: Some(time), ..Field::new("steps", at_points(scale)) });
    }
    // One cell stands out, so that its peak is lower at points.
    let mut cells: Vec<f64> = (0..mesh.tets.len()).map(|t| (t % 7) as f64).collect();
    cells[40] = 1000.0;
    mesh.cell_fields = vec![Field::new("stress", cells)];
    mesh.cells_to_points();
    mesh
}

fn built(mesh: &TetMesh, kind: MtKind) -> Mt {
    build(mesh, &BuildConfig { all_fields: true, ..BuildConfig::of(kind) }).expect("a valid mesh").mt
}

fn written(mt: &Mt) -> Vec<u8> {
    let options = EncodeOptions { histograms: true, ..EncodeOptions::default() };
    encode(&in_blocks(mt, 5), &options).expect("a complete MT")
}

/// By looking at all values.
fn expected(mesh: &TetMesh, field: &Field) -> [(f64, [f64; 3]); 2] {
    let at = |i: usize| (field.values[i], mesh.positions[i]);
    let mut order: Vec<usize> = (0..field.values.len()).collect();
    // Stable: of equal values the first point comes first.
    order.sort_by(|&a, &b| field.values[a].total_cmp(&field.values[b]));
    let largest = field.values[order[order.len() - 1]];
    let first = order.iter().copied().find(|&i| field.values[i] == largest).expect("a point");
    [at(order[0]), at(first)]
}

fn found(extremes: &Extremes) -> [(f64, [f64; 3]); 2] {
    extremes.both().map(|Extreme { value, place, .. }| (*value, *place))
}

#[test]
fn they_are_those_of_the_input_for_all_kinds() {
    let mesh = mesh();
    for kind in MtKind::ALL {
        let mt = built(&mesh, kind);
        let bytes = written(&mt);
        let read = decode(&bytes).expect("a good file");
        assert_eq!(read.info().fields, mt.info().fields, "{}", kind.name());
        for (info, field) in read.info().fields.iter().zip(&mesh.fields) {
            assert!(info.is_of(field), "{}", info.name);
            let extremes = info.extremes.as_ref().expect("they are known");
            assert_eq!(found(extremes), expected(&mesh, field), "{} of {}", info.name, kind.name());
            assert_eq!(info.averaged, field.averaged, "{}", info.name);
        }
        let [stress] = &read.info().averaged_fields()[..] else { panic!("one field is at cells") };
        assert_eq!(
            (&*stress.name, stress.input.max.value, stress.input.max.cell),
            ("stress", 1000.0, Some(40))
        );
        assert!(stress.points.max.value < 1000.0 && stress.difference.largest > stress.difference.rms);
        // Another reader finds the same numbers.
        let (file, _) = reader::open(&bytes);
        for (ours, theirs) in file.info.fields.iter().zip(&read.info().fields) {
            let ours = ours.extremes.as_ref().expect("they are stated");
            let theirs = found(theirs.extremes.as_ref().expect("they are known"));
            assert_eq!(ours.each_ref().map(|extreme| (extreme.value, extreme.place)), theirs);
        }
    }
}

#[test]
fn whoever_rewrites_a_file_keeps_them() {
    let mt = built(&mesh(), MtKind::HalfEdge);
    let of_file = decode(&written(&mt)).expect("a good file");
    let other = of_file.convert(MtKind::Vertex).expect("both are of vertex insertions");
    let again = decode(&written(&other)).expect("a good file");
    assert_eq!(again.info().fields, mt.info().fields);
    let back = again.convert(MtKind::HalfEdge).expect("both are of vertex insertions");
    assert_eq!(back.info().fields, mt.info().fields);
}

#[test]
fn they_are_there_before_the_base_mesh_and_for_chosen_fields() {
    let mesh = mesh();
    let mt = built(&mesh, MtKind::HalfEdge);
    let bytes = written(&mt);
    let options = DecodeOptions { fields: vec!["stress".to_owned()], ..DecodeOptions::default() };
    let mut decoder = Decoder::new(options);
    let mut at = 0;
    let known = |decoder: &Decoder| -> Option<Vec<FieldInfo>> {
        Some(decoder.info()?.fields.clone())
            .filter(|fields| fields.iter().any(|field| field.extremes.is_some()))
    };
    while known(&decoder).is_none() {
        assert!(decoder.mt().is_none());
        decoder.feed(&bytes[at..=at]).expect("a good file");
        at += 1;
    }
    let stress = mt.info().fields.iter().filter(|field| field.name == "stress").cloned();
    let stress: Vec<FieldInfo> = stress.collect();
    decoder.feed(&bytes[at..]).expect("a good file");
    assert_eq!(decoder.mt().map(|mt| mt.info().fields.clone()), Some(stress));
}

#[test]
fn files_without_them_are_read() {
    // Without an index nothing counts its bytes.
    let edge = built(&bent(4), MtKind::Edge);
    let mut of_edge = sections(&written(&edge));
    let before = of_edge.len();
    of_edge.retain(|(kind, _)| kind != b"extr");
    assert_eq!(of_edge.len() + 1, before);
    let read = decode(&assemble(&of_edge, edge.updates())).expect("a good file");
    assert!(read.info().fields.iter().all(|field| field.extremes.is_none() && field.averaged.is_none()));
    assert!(sections(&written(&read)).iter().all(|(kind, _)| kind != b"extr"), "nothing is known of them");
}

#[test]
fn what_cannot_be_so_is_refused() {
    let mt = built(&mesh(), MtKind::Edge);
    let good = sections(&written(&mt));
    let at = good.iter().position(|(kind, _)| kind == b"extr").expect("the section");
    let refused = |payload: Vec<u8>| {
        let mut parts = good.clone();
        parts[at].1 = payload;
        match decode(&assemble(&parts, mt.updates())) {
            Ok(_) => false,
            Err(FormatError::Corrupt { .. } | FormatError::Base(_)) => true,
            Err(error) => panic!("{error:?}"),
        }
    };
    let payload = &good[at].1;
    assert!(!refused(payload.clone()));
    assert!(refused(Vec::new()), "empty");
    assert!(refused(payload[..payload.len() - 1].to_vec()), "too short");
    assert!(refused([payload.as_slice(), &[0]].concat()), "too long");
    assert!(refused(vec![0; mt.info().fields.len()]), "nothing is known");
    let changed = |place: usize, bytes: &[u8]| {
        let mut payload = payload.clone();
        payload[place..place + bytes.len()].copy_from_slice(bytes);
        payload
    };
    assert!(refused(changed(0, &[5])), "a flag that nobody knows");
    assert!(refused(changed(1, &f64::NAN.to_le_bytes())), "no value");
    assert!(refused(changed(9, &f64::INFINITY.to_le_bytes())), "no place");
    assert!(refused(changed(1, &1e300_f64.to_le_bytes())), "the smallest is not the smallest");
    assert!(refused(changed(payload.len() - 8, &(-1.0_f64).to_le_bytes())), "a negative difference");
    for place in (0..=good.len()).filter(|place| !(at..=at + 1).contains(place)) {
        let mut parts = good.clone();
        let section = parts.remove(at);
        parts.insert(place.min(parts.len()), section);
        assert!(decode(&assemble(&parts, mt.updates())).is_err(), "at {place}");
    }
    let mut twice = good.clone();
    twice.insert(at, good[at].clone());
    assert!(decode(&assemble(&twice, mt.updates())).is_err());
}

#[test]
fn labels_are_told_from_other_fields_and_stay_whole_numbers() {
    let mut mesh = mesh();
    let numbers = (0..mesh.tets.len()).map(|t| [3.0, -4.0, 5.0][t % 3]).collect();
    mesh.cell_fields = vec![Field { is_label: true, ..Field::new("cluster", numbers) }];
    mesh.cells_to_points();
    for kind in [MtKind::HalfEdge, MtKind::Vertex] {
        let mt = built(&mesh, kind);
        let bytes = written(&mt);
        let read = decode(&bytes).expect("a good file");
        let labels: Vec<_> = read.info().fields.iter().map(|field| field.is_label).collect();
        assert_eq!(labels.iter().filter(|is_label| **is_label).count(), 1);
        let (file, _) = reader::open(&bytes);
        assert!(file.info.fields.iter().map(|field| field.is_label).eq(labels.iter().copied()));
        let cluster = read.info().fields.last().expect("fields");
        assert_eq!((&*cluster.name, cluster.min, cluster.max), ("cluster", -4.0, 5.0));
        assert!(cluster.is_label && read.info().averaged_fields()[1].is_label);
        assert_eq!((cluster.step, cluster.origin, cluster.quantization), (1.0, -4.0, 0.0));
        // Somewhere between whole numbers there can be none.
        let sections = sections(&bytes);
        assert!(decode(&assemble(&sections, mt.updates())).is_ok());
        let name = sections[0].1.windows(7).position(|bytes| bytes == b"cluster").expect("its name");
        for (place, value) in [(7 + 16, -3.5_f64), (7 + 24, 0.5)] {
            let mut damaged = sections.clone();
            damaged[0].1[name + place..][..8].copy_from_slice(&value.to_le_bytes());
            let refused = decode(&assemble(&damaged, mt.updates())).map(|_| "read");
            assert!(matches!(refused, Err(FormatError::Corrupt { .. })), "{value}: {refused:?}");
        }
    }
}
