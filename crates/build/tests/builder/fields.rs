//! Promises of the fields of an MT: which are chosen, how finely they and the positions are kept, what is told of that,
//! and that exact values are exact.

use crate::support::meshes::{bent, cube, hilly, linear};
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::{Field, TetMesh, VectorPart};
use tetralod::mt::{
    ApplyUpdates, CurrentMesh, ExactValues, Mt, MtKind, MultiTessellation, UpdateId, UpdatePages, VertexId,
};
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod_build::verify::{Reference, Sample};
use tetralod_build::{
    BuildConfig, BuildCriterion, BuildError, BuildResult, Construction, FieldPrecision, Method, Remedy,
    build, mark_labels,
};

/// Every kind with every way to build it.
const WAYS: [(MtKind, Method, BuildCriterion); 4] = [
    (MtKind::Edge, Method::Collapse, BuildCriterion::HalfEdge),
    (MtKind::Vertex, Method::Decimate, BuildCriterion::HalfEdge),
    (MtKind::Vertex, Method::Decimate, BuildCriterion::Delaunay),
    (MtKind::Vertex, Method::Insert, BuildCriterion::Delaunay),
];

fn try_build(mesh: &TetMesh, config: &BuildConfig) -> Result<BuildResult, BuildError> {
    build(mesh, config)
}

fn made(mesh: &TetMesh, config: &BuildConfig) -> BuildResult {
    try_build(mesh, config).unwrap_or_else(|error| panic!("{error}"))
}

/// All updates applied.
fn reference(mt: &Mt) -> CurrentMesh {
    let mut mesh = mt.start().expect("a valid base mesh");
    mt.updates_arrived(&mut mesh, 0);
    for u in (0..mt.updates()).map(UpdateId) {
        mt.refine(&mut mesh, u).expect("an update of this MT");
    }
    mesh
}

/// Values that test every rule of floating-point numbers, one a point.
fn odd_values(points: usize, single: bool) -> Vec<f64> {
    let odd = [0.0, -0.0, 1.0 / 3.0, -7.5e-3, 1e30, f64::MIN_POSITIVE, f64::from_bits(3), -f64::from_bits(1)];
    let single_odd = [0.0, -0.0, 0.1, f64::from(f32::from_bits(1)), f64::from(f32::MIN_POSITIVE), -2.5];
    let value = |i: usize| {
        if single {
            f64::from((single_odd[i % single_odd.len()] + (i / 7) as f64) as f32)
                * if i.is_multiple_of(3) { -1.0 } else { 1.0 }
        } else {
            odd[i % odd.len()] * (1.0 + (i / 11) as f64)
        }
    };
    (0..points).map(value).collect()
}

#[test]
fn exact_values_come_back_at_every_point_of_every_kind() {
    let mut mesh = cube(4, &[hilly]);
    let points = mesh.positions.len();
    mesh.fields.push(Field::new("double", odd_values(points, false)));
    mesh.fields.push(Field::new("single", odd_values(points, true)));
    for (kind, method, criterion) in WAYS {
        let config = BuildConfig {
            construction: Construction::new(kind, method, criterion).expect("they go together"),
            all_fields: true,
            all_lossless: true,
            ..BuildConfig::of(MtKind::Edge)
        };
        let BuildResult { mt, vertices, exact, .. } = made(&mesh, &config);
        let what = format!("{kind:?} {method:?} {criterion:?}");
        let full = reference(&mt);
        assert_eq!((vertices.len(), full.vertex_count()), (points, points), "{what}");
        assert_eq!(exact.iter().map(|table| table.field).collect::<Vec<_>>(), [0, 1, 2], "{what}");
        assert!(matches!(exact[1].values, ExactValues::F64(_)), "{what}");
        assert!(matches!(exact[2].values, ExactValues::F32(_)), "{what}");
        for (point, &vertex) in vertices.iter().enumerate() {
            let slot = full.slot(vertex).unwrap_or_else(|| panic!("{what}: {vertex:?} is not in the mesh"));
            let info = mt.info();
            let at = full.positions()[slot as usize];
            assert_eq!(at, info.lattice.nearest(mesh.positions[point]), "{what}");
            for (table, field) in exact.iter().zip(&mesh.fields) {
                let value = field.values[point];
                assert_eq!(table.get(vertex).map(f64::to_bits), Some(value.to_bits()), "{what} {value:e}");
                let info = &info.fields[table.field];
                assert_eq!(full.levels(slot)[table.field], info.nearest(value), "{what}");
            }
        }
        let ids: Vec<VertexId> = (0..full.positions().len() as u32).map(|slot| full.vertex(slot)).collect();
        for table in &exact {
            assert!(table.vertices.is_sorted() && table.vertices.len() == points, "{what}");
            assert!(ids.iter().all(|&id| full.slot(id).is_none() || table.get(id).is_some()), "{what}");
        }
        // And they come back from a file.
        let file = encode(&mt, &EncodeOptions { exact, ..EncodeOptions::default() }).expect("a sound MT");
        let mut session = Session::new();
        session.feed(&file).expect("a sound file");
        session.refine(&Request::within(0.0)).expect("a sensible request");
        let read: Vec<Vec<f64>> = (0..3).map(|field| session.exact_values(field)).collect();
        let mesh_read = session.mesh().expect("it is complete");
        for (point, &vertex) in vertices.iter().enumerate() {
            let slot =
                mesh_read.slot(vertex).unwrap_or_else(|| panic!("{what}: {vertex:?} is not in the mesh"));
            for (values, field) in read.iter().zip(&mesh.fields) {
                assert_eq!(values[slot as usize].to_bits(), field.values[point].to_bits(), "{what}");
            }
        }
    }
}

#[test]
fn only_what_is_asked_for_is_exact_and_nan_is_refused() {
    let mut mesh = cube(3, &[hilly, linear]);
    let lossless = vec!["f1".to_owned()];
    let config = BuildConfig { all_fields: true, lossless, ..BuildConfig::of(MtKind::Edge) };
    assert_eq!(made(&mesh, &config).exact.iter().map(|table| table.field).collect::<Vec<_>>(), [1]);
    let unknown = BuildConfig { lossless: vec!["f1".to_owned()], ..BuildConfig::of(MtKind::Edge) };
    assert!(matches!(try_build(&mesh, &unknown), Err(BuildError::UnknownField { .. })));
    mesh.fields[1].values[5] = f64::NAN;
    assert!(matches!(try_build(&mesh, &config), Err(BuildError::NotFinite { point: 5 })));
}

#[test]
fn what_lattices_round_off_is_measured_and_a_floor_of_every_error() {
    for (kind, method, criterion) in WAYS.into_iter().filter(|way| way.1.keeps_the_mesh()) {
        for precision in [FieldPrecision::Bits(4), FieldPrecision::Bits(20)] {
            let mesh = bent(4);
            let config = BuildConfig {
                construction: Construction::new(kind, method, criterion).expect("they go together"),
                field_precision: precision,
                ..BuildConfig::of(MtKind::Edge)
            };
            let BuildResult { mt, vertices, .. } = made(&mesh, &config);
            let (info, full) = (mt.info(), reference(&mt));
            let (mut moved, mut lost) = (0.0_f64, 0.0_f64);
            for (point, &vertex) in vertices.iter().enumerate() {
                let slot = full.slot(vertex).expect("a vertex of the reference mesh");
                let (p, q) = (mesh.positions[point], info.lattice.point(full.positions()[slot as usize]));
                moved = moved.max((0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt());
                let value = info.fields[0].value(full.levels(slot)[0]);
                lost = lost.max((value - mesh.fields[0].values[point]).abs());
            }
            assert!(moved > 0.0 && lost > 0.0);
            let (told, at_most) = (info.quantization, moved * (1.0 + 1e-9));
            assert!(moved <= told && told <= at_most, "{told} for {moved}");
            // Beside the vertices, where the input has them, a little more may be lost: far less than the lattice moves them by, as a
            // part of a cell.
            let (told, at_most) =
                (info.fields[0].quantization, lost * (1.0 + 1e-9) + 1e-3 * info.fields[0].range());
            assert!(lost <= told && told <= at_most, "{told} for {lost}");
            let floor = info.floor(0);
            assert!(floor >= lost / info.fields[0].range() && floor >= moved / info.displacement_per_error);
            assert!((0..mt.updates()).all(|u| mt.error(UpdateId(u)).error() >= floor), "{kind:?} {method:?}");
        }
    }
}

#[test]
fn integers_are_exact_by_themselves() {
    let mut mesh = cube(3, &[]);
    let count = mesh.positions.len();
    let integer = |name: &str, step: f64| Field {
        integer: true,
        ..Field::new(name, (0..count).map(|i| i as f64 * step - 9.0).collect())
    };
    mesh.fields = vec![integer("narrow", 1.0), integer("wide", 200_000.0), integer("too wide", 1e9)];
    let precision_of = vec![];
    let config = BuildConfig { all_fields: true, precision_of, ..BuildConfig::of(MtKind::Edge) };
    let mt = made(&mesh, &config).mt;
    let told: Vec<_> = mt.info().fields.iter().map(|f| (f.step, f.bits, f.quantization == 0.0)).collect();
    assert_eq!(told[0], (1.0, 6, true));
    assert_eq!(told[1], (1.0, 24, true));
    assert_eq!((told[2].1, told[2].2), (16, false));
    // A grid falls on its lattice, so nothing is lost at all.
    assert_eq!((mt.info().quantization, mt.info().floor(0)), (0.0, 0.0));
    let precision_of = vec![("narrow".to_owned(), FieldPrecision::Bits(3))];
    let mt = made(&mesh, &BuildConfig { precision_of, ..config }).mt;
    assert_eq!(mt.info().fields[0].bits, 3);
}

#[test]
fn labels_are_exact_or_refused() {
    let mut mesh = cube(3, &[]);
    let points = mesh.positions.len();
    let of = |name: &str, integer: bool, value: fn(usize) -> f64| Field {
        integer,
        ..Field::new(name, (0..points).map(value).collect())
    };
    let third = |i: usize| (i % 3) as f64;
    mesh.fields = vec![
        of("density", true, third),
        of("material", true, third),
        of("group", false, third),
        of("wide_id", true, |i| if i == 0 { 2e7 } else { 0.0 }),
        of("tag", false, |i| 0.5 * i as f64),
    ];
    let config = BuildConfig { all_fields: true, ..BuildConfig::default() };
    let marked = |given: &[(&str, bool)], config: &BuildConfig| {
        let given: Vec<_> = given.iter().map(|&(name, is)| (name.to_owned(), is)).collect();
        let mut mesh = mesh.clone();
        mark_labels(&mut mesh, &given, config)?;
        let mt = try_build(&mesh, config)?.mt;
        let labels = mt.info().fields.iter().filter(|field| field.is_label);
        Ok(labels.map(|field| field.name.clone()).collect::<Vec<_>>().join(" "))
    };
    assert_eq!(marked(&[], &config), Ok("material".to_owned()));
    assert_eq!(marked(&[("material", false)], &config), Ok(String::new()));
    // By value, whatever the type and the name.
    assert_eq!(
        marked(&[("group", true), ("density", true)], &config),
        Ok("density material group".to_owned())
    );
    let precise = |name: &str| {
        let precision_of = vec![(name.to_owned(), FieldPrecision::Bits(8))];
        BuildConfig { precision_of, ..config.clone() }
    };
    assert_eq!(marked(&[], &precise("material")), Ok(String::new()));
    let edge = BuildConfig { all_fields: true, ..BuildConfig::of(MtKind::Edge) };
    assert_eq!(marked(&[], &edge), Ok(String::new()));
    let group = || "group".to_owned();
    assert_eq!(marked(&[("group", true)], &edge), Err(BuildError::LabelOfEdges { name: group() }));
    assert_eq!(
        marked(&[("group", true)], &precise("group")),
        Err(BuildError::LabelPrecision { name: group() })
    );
    let name = "wide_id".to_owned();
    assert_eq!(marked(&[("wide_id", true)], &config), Err(BuildError::LabelRange { name }));
    let name = "tag".to_owned();
    assert_eq!(marked(&[("tag", true)], &config), Err(BuildError::Label { name, at: 1, value: 0.5 }));
    let unknown = marked(&[("nothing", true)], &config);
    assert!(matches!(unknown, Err(BuildError::UnknownLabel { name, .. }) if name == "nothing"));
}

#[test]
fn tolerances_are_kept_with_the_fewest_bits() {
    let mesh = bent(5);
    for tolerance in [1e-1, 1e-3, 1e-5] {
        let wanted = |position_tolerance| BuildConfig {
            position_tolerance: Some(position_tolerance),
            field_precision: FieldPrecision::Fraction(tolerance),
            ..BuildConfig::of(MtKind::Edge)
        };
        let mt = made(&mesh, &wanted(tolerance)).mt;
        let info = mt.info();
        let field = &info.fields[0];
        assert!(info.quantization <= tolerance && 0.5 * field.step <= tolerance * field.range());
        let fewer = BuildConfig {
            position_bits: Some(info.lattice.bits - 1),
            field_precision: FieldPrecision::Bits(field.bits - 1),
            ..BuildConfig::of(MtKind::Edge)
        };
        match try_build(&mesh, &fewer) {
            Ok(coarser) => {
                let info = coarser.mt.info();
                assert!(info.quantization > tolerance);
                assert!(info.fields[0].quantization > tolerance * info.fields[0].range());
            }
            Err(error) => assert!(matches!(error, BuildError::TooThin { enough: Some(_), .. }), "{error}"),
        }
    }
    let units =
        BuildConfig { field_precision: FieldPrecision::Units(1e-12), ..BuildConfig::of(MtKind::Edge) };
    assert!(matches!(try_build(&mesh, &units), Err(BuildError::Tolerance { field: Some(_), .. })));
    let positions = BuildConfig { position_tolerance: Some(0.0), ..BuildConfig::of(MtKind::Edge) };
    assert!(matches!(try_build(&mesh, &positions), Err(BuildError::Tolerance { field: None, .. })));
    let nan = BuildConfig { position_tolerance: Some(f64::NAN), ..BuildConfig::of(MtKind::Edge) };
    assert!(matches!(try_build(&mesh, &nan), Err(BuildError::Option { .. })));
}

#[test]
fn too_few_bits_are_refused_with_those_that_do() {
    let mesh = bent(6);
    let with = |bits| BuildConfig { position_bits: Some(bits), ..BuildConfig::of(MtKind::Edge) };
    let Err(BuildError::TooThin { bits: 2, enough: Some(enough), .. }) = try_build(&mesh, &with(2)) else {
        panic!("two bits must not do");
    };
    made(&mesh, &with(enough));
    assert!(matches!(try_build(&mesh, &with(enough - 1)), Err(BuildError::TooThin { .. })));
    // A tolerance that so few bits would keep gets the bits that the cells need.
    let loose = BuildConfig { position_tolerance: Some(1e3), ..BuildConfig::of(MtKind::Edge) };
    assert!(made(&mesh, &loose).mt.info().lattice.bits >= enough.min(3));
}

/// A vector, its length, and a scalar at two times.
fn several() -> TetMesh {
    let mut mesh = cube(3, &[hilly, linear, hilly]);
    for (field, component) in mesh.fields.iter_mut().zip([Some(0), Some(1), None]) {
        field.vector = Some(VectorPart { name: "U".into(), component });
        field.unit = "m/s".into();
    }
    for time in [0.5, 2.0] {
        let values = mesh.positions.iter().map(|p| linear(*p) * time).collect();
        mesh.fields.push(Field { time: Some(time), ..Field::new("p", values) });
    }
    mesh
}

#[test]
fn a_vector_brings_its_components_and_a_field_its_time_steps() {
    let names = |config: BuildConfig| -> Vec<String> {
        made(&several(), &config).mt.info().fields.iter().map(|field| field.name.clone()).collect()
    };
    let named = |fields: &[&str]| BuildConfig {
        fields: fields.iter().map(|&name| name.to_owned()).collect(),
        ..BuildConfig::of(MtKind::Edge)
    };
    // Of a vector, its length.
    assert_eq!(names(named(&[])), ["f2"]);
    assert_eq!(names(named(&["p", "U"])), ["p", "p", "f0", "f1"]);
    assert_eq!(names(named(&["f1", "U", "f2"])), ["f1", "f0", "f2"]);
    assert_eq!(names(BuildConfig { all_fields: true, ..named(&["p"]) }), ["p", "p", "f0", "f1"]);
    let info = made(&several(), &named(&["p", "U"])).mt.info().clone();
    let steps = &info.fields[..2];
    assert_eq!(steps.iter().map(|step| step.time).collect::<Vec<_>>(), [Some(0.5), Some(2.0)]);
    // One range and one lattice, so that a colour means the same at all times.
    assert_eq!((steps[0].min, steps[0].max, steps[0].step), (steps[1].min, steps[1].max, steps[1].step));
    assert_eq!(info.fields[3].vector, Some(VectorPart { name: "U".into(), component: Some(1) }));
    assert_eq!(info.fields[3].unit, "m/s");
}

#[test]
fn fields_at_cells_are_refused_with_the_remedy_and_built_once_they_are_at_points() {
    let mut mesh = cube(3, &[hilly]);
    mesh.cell_fields = vec![Field::new("rho", (0..mesh.tets.len()).map(|i| i as f64).collect())];
    let config = BuildConfig { fields: vec!["rho".into()], ..BuildConfig::of(MtKind::Edge) };
    let error = try_build(&mesh, &config).expect_err("a field at cells");
    assert!(error.to_string().contains("field at cells"), "{error}");
    assert_eq!(error.remedy(), Some(Remedy::CellsToPoints));
    mesh.cells_to_points();
    let mt = made(&mesh, &config).mt;
    assert_eq!(mt.info().fields[0].name, "rho");
    assert!(0.0 <= mt.info().fields[0].min && mt.info().fields[0].max <= mesh.tets.len() as f64 - 1.0);
    let bare = TetMesh { fields: Vec::new(), cell_fields: vec![Field::new("rho", Vec::new())], ..mesh };
    assert!(matches!(try_build(&bare, &BuildConfig::of(MtKind::Edge)), Err(BuildError::CellField { .. })));
}

/// The limits on both sides, in coordinates and in values, for all ways to build.
#[test]
fn what_double_precision_cannot_compute_with_is_refused() {
    let scaled = |position: f64, value: f64| {
        let mut mesh = cube(3, &[hilly]);
        mesh.grid = None;
        mesh.positions.iter_mut().flatten().for_each(|x| *x *= position);
        mesh.fields[0].values.iter_mut().for_each(|x| *x *= value);
        mesh
    };
    for (kind, method, criterion) in WAYS {
        let config = BuildConfig {
            construction: Construction::new(kind, method, criterion).expect("they go together"),
            ..BuildConfig::of(kind)
        };
        for size in [1e-45, 1e-30, 1e30, 1e50] {
            for (position, value) in [(size, 1.0), (1.0, size), (size, size)] {
                let mesh = scaled(position, value);
                let mt = made(&mesh, &config).mt;
                let report = tetralod_build::verify::run_sample(
                    &mt,
                    &mesh,
                    if method.keeps_the_mesh() { Reference::Mesh } else { Reference::Points },
                    Sample { requests: 3, ..Sample::default() },
                    &mut |_, _| {},
                );
                assert!(report.valid, "{kind:?}, {position:e}, {value:e}: {:#?}", report.failures);
            }
        }
        for size in [1e-320, 1e-200, 1e-56, 1e52, 1e200, 1e307] {
            let refused = try_build(&scaled(size, 1.0), &config).map(|_| "built");
            assert!(
                matches!(refused, Err(BuildError::Scale { field: None, .. })),
                "{kind:?}, {size:e}: {refused:?}"
            );
            let message = refused.expect_err("refused").to_string();
            assert!(message.contains("the coordinates") && message.contains("scale them"), "{message}");
            let refused = try_build(&scaled(1.0, size), &config).map(|_| "built");
            let named = matches!(&refused, Err(BuildError::Scale { field: Some(name), .. }) if name == "f0");
            assert!(named, "{kind:?}, {size:e}: {refused:?}");
        }
    }
}
