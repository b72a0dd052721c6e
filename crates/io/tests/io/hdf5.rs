//! Promise: VTKHDF and Exodus are read in all layouts and time steps, and a damaged file is refused or harmless.
//!
//! `tests/data/hdf5.py` made the files in HDF5; those in classic netCDF are written here.

use std::path::PathBuf;

use crate::exodus::{Values, Variable, netcdf};
use tetralod::mesh::{Field, TetMesh};
use tetralod_io::{self as io, CellData, FieldSelection, ReadError, ReadOptions, ReadReason};

const PIECES: (&str, &[u8]) = ("pieces.vtkhdf", include_bytes!("../data/pieces.vtkhdf"));
const POLYHEDRA: (&str, &[u8]) = ("polyhedra.vtkhdf", include_bytes!("../data/polyhedra.vtkhdf"));
const STEPS: (&str, &[u8]) = ("steps.vtkhdf", include_bytes!("../data/steps.vtkhdf"));
const IMAGE: (&str, &[u8]) = ("image.vtkhdf", include_bytes!("../data/image.vtkhdf"));
const DENSE: (&str, &[u8]) = ("dense.vtkhdf", include_bytes!("../data/dense.vtkhdf"));
const NETCDF4: (&str, &[u8]) = ("netcdf4.exo", include_bytes!("../data/netcdf4.exo"));

fn everything(step: usize) -> ReadOptions {
    ReadOptions { cells: CellData::Values, step, ..ReadOptions::default() }
}

fn read_step((name, bytes): (&str, &[u8]), step: usize) -> Result<TetMesh, ReadError> {
    io::read_bytes_with(name, bytes, &everything(step))
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn field<'a>(fields: &'a [Field], name: &str) -> &'a Field {
    fields.iter().find(|field| field.name == name).unwrap_or_else(|| panic!("{name}"))
}

fn volume(mesh: &TetMesh) -> f64 {
    let of = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| mesh.positions[v as usize]);
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
        let cross = [v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0]];
        (0..3).map(|i| u[i] * cross[i]).sum::<f64>() / 6.0
    };
    mesh.tets.iter().map(of).sum()
}

#[test]
fn pieces_meet_and_what_has_no_volume_is_left_out() {
    let mesh = read_step(PIECES, 0).unwrap();
    assert_eq!((mesh.positions.len(), mesh.tets.len(), volume(&mesh)), (12, 12, 2.0));
    for (point, sum) in mesh.positions.iter().zip(&field(&mesh.fields, "sum").values) {
        assert_eq!(point.iter().sum::<f64>(), *sum);
    }
    assert_eq!(field(&mesh.fields, "v_y").values[2], 2.0);
    let material = field(&mesh.cell_fields, "material");
    assert!(material.integer && material.values.iter().all(|value| [3.0, 5.0].contains(value)));
    assert_eq!(io::read_with(&path(PIECES.0), &everything(0)).unwrap(), mesh);
    let survey = io::survey(PIECES.0, PIECES.1).unwrap();
    assert_eq!((survey.format, survey.points, survey.cells), ("vtkhdf", 12, 12));
}

#[test]
fn polyhedra_of_pieces_at_each_time() {
    for (step, height) in [(0, 1.0), (1, 2.0)] {
        let mesh = read_step(POLYHEDRA, step).unwrap();
        assert_eq!((mesh.positions.len(), volume(&mesh)), (12, 2.0 * height));
        assert!(mesh.positions.iter().zip(&mesh.fields[0].values).all(|(p, z)| p[2] == *z), "{step}");
        let found = tetralod::mesh::findings(&mesh, 0.0).unwrap();
        assert_eq!((found.components, found.open_seam_faces), (1, 0));
        assert_eq!(io::read_with(&path(POLYHEDRA.0), &everything(step)).unwrap(), mesh);
    }
}

#[test]
fn members_in_heaps_and_chunks_are_found_in_every_way() {
    let mesh = read_step(DENSE, 0).unwrap();
    for name in ["growing", "fixed", "one", "more0", "more7"] {
        assert_eq!(field(&mesh.fields, name).values, [0.0, 1.0, 2.0, 3.0], "{name}");
    }
    assert_eq!(field(&mesh.fields, "wide_y").values, [1.0, 3.0, 5.0, 7.0]);
}

#[test]
fn groups_that_lead_to_one_another_are_refused() {
    let own_root = include_bytes!("../data/own_root.exo").as_slice();
    let many_ways = include_bytes!("../data/many_ways.exo").as_slice();
    for (bytes, group) in [(own_root, "again"), (many_ways, "\"a\"")] {
        let error = io::read_bytes("x.exo", bytes).expect_err("it is no Exodus");
        assert!(matches!(error.reason, ReadReason::Unsupported { .. }), "{error}");
        assert!(error.to_string().contains(group), "{error}");
        assert!(io::survey("x.exo", bytes).is_err());
    }
}

#[test]
fn image_data_is_a_grid() {
    let mesh = read_step(IMAGE, 0).unwrap();
    let grid = mesh.grid.unwrap();
    assert_eq!((grid.dims, grid.origin, grid.spacing), ([3, 2, 2], [0.5, 0.0, 0.0], [0.5, 1.0, 2.0]));
    assert_eq!(mesh.fields[0].values, (0..12).map(f64::from).collect::<Vec<_>>());
    assert_eq!(mesh.cell_fields[0].values, [[4.0; 6], [6.0; 6]].concat());
    assert_eq!(mesh.fields[0].time, None);
}

#[test]
fn each_time_step_is_found() {
    let exodus = exodus(2);
    for (file, name, times, first) in [
        (STEPS, "p", &[0.0, 0.5, 2.0][..], [0.0, 4.0, 8.0]),
        (NETCDF4, "heat", &[0.0, 1.5][..], [0.0, 4.0, 0.0]),
        (("a.exo", &exodus[..]), "T", &[0.25, 1.0][..], [10.0, 20.0, 0.0]),
    ] {
        for (step, time) in times.iter().enumerate() {
            let mesh = read_step(file, step).unwrap();
            let found = field(&mesh.fields, name);
            assert_eq!((found.time, found.values[0]), (Some(*time), first[step]), "{} {step}", file.0);
        }
        let error = read_step(file, times.len()).unwrap_err();
        assert!(error.to_string().contains("time step"), "{error}");
    }
    let steps = io::steps(&path(STEPS.0)).unwrap();
    let found: Vec<_> = steps.iter().map(|step| (step.time, step.number)).collect();
    assert_eq!(found, [(Some(0.0), 0), (Some(0.5), 1), (Some(2.0), 2)]);
    assert_eq!(io::steps(&path(PIECES.0)).unwrap()[0].time, None);
    let named: Vec<_> = steps.iter().map(|step| (step.path.display().to_string(), step.time)).collect();
    let wanted = FieldSelection { names: &[], all: true, labels: &[], cells: CellData::LeaveOut };
    let series = io::read_time_steps(&named, &wanted, &mut |number, options| {
        io::read_with(&steps[number].path, &ReadOptions { step: number, ..options.clone() })
    });
    let series = series.unwrap();
    let values: Vec<_> = series.fields.iter().map(|field| (field.time, field.values[3])).collect();
    assert_eq!(values, [(Some(0.0), 3.0), (Some(0.5), 7.0), (Some(2.0), 11.0)]);
}

#[test]
fn blocks_vectors_and_variables_of_exodus() {
    for version in [1, 2, 5] {
        let mesh = read_step(("a.exo", &exodus(version)), 1).unwrap();
        assert_eq!(
            (mesh.positions.len(), mesh.tets.len(), volume(&mesh)),
            (9, 8, 1.0 + 1.0 / 3.0),
            "{version}"
        );
        let names: Vec<_> = mesh.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["T", "U_x", "U_y", "U_z", "U_magnitude"]);
        assert_eq!(field(&mesh.fields, "U_y").values, vec![102.0; 9]);
        let ids = &field(&mesh.cell_fields, "block").values;
        assert_eq!(ids[..], [[70.0; 6].to_vec(), vec![30.0; 2]].concat());
        // The second block does not have the variable.
        assert_eq!(field(&mesh.cell_fields, "s").values, [[5.0; 6].to_vec(), vec![0.0; 2]].concat());
    }
    let named = ReadOptions { fields: Some(vec!["U".into()]), ..everything(0) };
    let mesh = io::read_bytes_with("a.exo", &exodus(1), &named).unwrap();
    assert_eq!((mesh.fields.len(), mesh.cell_fields.len()), (3, 0));
    assert_eq!(io::survey("a.exo", &exodus(1)).unwrap().format, "exodus");
}

#[test]
fn what_is_not_read_is_named() {
    let refused = |from: &[u8], to: &[u8]| {
        let mut file = exodus(1);
        let at = file.windows(from.len()).position(|window| window == from).unwrap();
        file[at..at + from.len()].copy_from_slice(to);
        read_step(("a.exo", &file), 0).unwrap_err().to_string()
    };
    assert!(refused(b"SHELL4", b"SUPER4").contains("\"SUPER4\" of 4 points"));
    assert!(refused(b"num_dim", b"sum_dim").contains("neither VTKHDF nor Exodus"));
    assert!(refused(b"coordz", b"coordw").contains("variable \"coordz\" is missing"));
    assert!(refused(b"CDF\x01", b"CDF\x03").contains("not a format that is known"));
    let text = |from: &str, to: &str| {
        let at = PIECES.1.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        let mut file = PIECES.1.to_vec();
        file[at..at + to.len()].copy_from_slice(to.as_bytes());
        read_step(("a.vtkhdf", &file), 0).unwrap_err()
    };
    assert!(
        text("UnstructuredGrid", "OverlappingGrids")
            .to_string()
            .contains("a data set of type OverlappingGrids")
    );
    let missing = text("Connectivity", "Konnectivity");
    assert!(matches!(missing.reason, ReadReason::Missing(_)), "{missing}");
}

/// Checks what came of a file that is not what it was.
fn assert_harmless(name: &str, result: Result<TetMesh, ReadError>) -> bool {
    let Ok(mesh) = result else { return false };
    let points = mesh.positions.len();
    assert!(mesh.tets.iter().flatten().all(|v| (*v as usize) < points), "{name}");
    for (fields, length) in [(&mesh.fields, points), (&mesh.cell_fields, mesh.tets.len())] {
        for field in fields {
            assert_eq!(field.values.len(), length, "{name}");
            assert!(field.values.iter().all(|value| value.is_finite()), "{name}");
        }
    }
    true
}

pub fn files() -> Vec<(&'static str, Vec<u8>)> {
    let fixed = [PIECES, STEPS, IMAGE, NETCDF4].map(|(name, bytes)| (name, bytes.to_vec()));
    fixed.into_iter().chain([("1.exo", exodus(1)), ("5.exo", exodus(5))]).collect()
}

#[test]
fn truncated_files_are_refused_or_harmless() {
    for (name, file) in files() {
        let whole = read_step((name, &file), 0).unwrap();
        for length in (0..file.len()).step_by(7) {
            let result = read_step((name, &file[..length]), 0);
            // Behind the data there may be room that is not used.
            assert!(result.as_ref().map_or(true, |mesh| *mesh == whole), "{name} cut to {length}");
            assert_harmless(name, result);
        }
    }
}

#[test]
fn no_bit_flip_panics_and_no_mesh_is_inconsistent() {
    for (name, mut file) in files() {
        let mut refused = 0;
        for (number, byte) in
            (0..file.len()).filter(|&at| file[at] != 0).collect::<Vec<_>>().into_iter().enumerate()
        {
            for bit in [number % 8, 7 - number % 4] {
                file[byte] ^= 1 << bit;
                refused += usize::from(!assert_harmless(name, read_step((name, &file), 0)));
                file[byte] ^= 1 << bit;
            }
        }
        assert!(refused > 100, "{name}: {refused}");
    }
}

/// Puts numbers that are too large into every field of a header that may be a count.
#[test]
fn counts_that_lie_do_not_size_anything() {
    for (name, file) in files() {
        for at in (0..file.len() - 8).step_by(4) {
            for lie in [0x7fff_ffff_u32, 0x8000_0000, 0x0100_0000] {
                let mut changed = file.clone();
                changed[at..at + 4].copy_from_slice(&lie.to_be_bytes());
                assert_harmless(name, read_step((name, &changed), 0));
                changed[at..at + 4].copy_from_slice(&lie.to_le_bytes());
                assert_harmless(name, read_step((name, &changed), 0));
            }
        }
    }
}

/// A cube and a pyramid on it at two times, with a shell beside them, in netCDF of version 1 (classic), 2 or 5.
fn exodus(version: u8) -> Vec<u8> {
    let points = [
        [0., 0., 0.],
        [1., 0., 0.],
        [1., 1., 0.],
        [0., 1., 0.],
        [0., 0., 1.],
        [1., 0., 1.],
        [1., 1., 1.],
        [0., 1., 1.],
        [0.5, 0.5, 2.],
    ];
    let dimensions = [
        ("time_step", 0),
        ("num_dim", 3),
        ("num_nodes", 9),
        ("num_el_blk", 3),
        ("len_name", 5),
        ("num_nod_var", 4),
        ("num_elem_var", 1),
        ("e1", 1),
        ("p1", 8),
        ("p2", 4),
        ("p3", 5),
    ];
    let variable = |name: &str, dimensions: &[&'static str], kind, values| Variable {
        name: name.into(),
        dimensions: dimensions.to_vec(),
        kind,
        values,
    };
    let integers = |list: &[i32]| Values::Integers(list.to_vec());
    let mut variables = vec![
        variable("eb_prop1", &["num_el_blk"], "", integers(&[70, 80, 30])),
        variable("connect1", &["e1", "p1"], "HEX8", integers(&[1, 2, 3, 4, 5, 6, 7, 8])),
        variable("connect2", &["e1", "p2"], "SHELL4", integers(&[1, 2, 3, 4])),
        variable("connect3", &["e1", "p3"], "PYRAMID5", integers(&[5, 6, 7, 8, 9])),
        variable(
            "name_nod_var",
            &["num_nod_var", "len_name"],
            "",
            Values::Text(b"T\0\0\0\0U_x\0\0U_y\0\0U_z\0\0".into()),
        ),
        variable("name_elem_var", &["num_elem_var", "len_name"], "", Values::Text(b"s    ".into())),
    ];
    for (axis, name) in ["coordx", "coordy", "coordz"].into_iter().enumerate() {
        let values = points.iter().map(|point| point[axis]).collect();
        variables.push(variable(name, &["num_nodes"], "", Values::Floats(vec![values])));
    }
    variables.push(variable("time_whole", &["time_step"], "", Values::Floats(vec![vec![0.25], vec![1.0]])));
    for (i, (first, second)) in
        [(10.0, 20.0), (1.0, 101.0), (2.0, 102.0), (3.0, 103.0)].into_iter().enumerate()
    {
        let values = Values::Floats(vec![vec![first; 9], vec![second; 9]]);
        variables.push(variable(&format!("vals_nod_var{}", i + 1), &["time_step", "num_nodes"], "", values));
    }
    let values = Values::Floats(vec![vec![4.0], vec![5.0]]);
    variables.push(variable("vals_elem_var1eb1", &["time_step", "e1"], "", values));
    netcdf(version, &dimensions, &variables, 2)
}

/// Two cubes with a face in common as polyhedra, and a pyramid on one of them.
fn exodus_polyhedra(change: impl Fn(&str, &mut Vec<i32>)) -> Vec<u8> {
    let dimensions = [
        ("time_step", 0),
        ("num_dim", 3),
        ("num_nodes", 13),
        ("num_el_blk", 2),
        ("quads", 11),
        ("quad_nodes", 44),
        ("cells", 2),
        ("cell_faces", 12),
        ("e2", 1),
        ("p2", 5),
    ];
    let base = |first: i32| [first, first + 1, first + 2, first + 3];
    let side = |first: i32, i: i32| {
        let next = (i + 1) % 4;
        [first + i, first + next, first + 4 + next, first + 4 + i]
    };
    // Three squares, and the four sides of each cube; the last ones turned inward.
    let mut quads = [1, 5, 9].map(base).to_vec();
    quads.extend((0..4).map(|i| side(1, i)));
    quads.extend((0..4).map(|i| side(5, 3 - i)).map(|[a, b, c, d]| [d, c, b, a]));
    let lists = [
        ("eb_prop1", "num_el_blk", "", vec![7, 9]),
        ("fbconn1", "quad_nodes", "nsided", quads.concat()),
        ("fbepecnt1", "quads", "", vec![4; 11]),
        ("facconn1", "cell_faces", "NFACED", vec![1, 2, 4, 5, 6, 7, 2, 3, 8, 9, 10, 11]),
        ("ebepecnt1", "cells", "", vec![6, 6]),
        ("connect2", "p2", "PYRAMID5", vec![9, 10, 11, 12, 13]),
    ];
    let mut variables = Vec::new();
    for (name, dimension, kind, mut list) in lists {
        change(name, &mut list);
        let dimensions = if name == "connect2" { vec!["e2", dimension] } else { vec![dimension] };
        variables.push(Variable { name: name.into(), dimensions, kind, values: Values::Integers(list) });
    }
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let layer = |z: f64| square.map(|[x, y]| [x, y, z]);
    let points = [&layer(0.0)[..], &layer(1.0), &layer(2.0), &[[0.5, 0.5, 5.0]]].concat();
    for (axis, name) in ["coordx", "coordy", "coordz"].into_iter().enumerate() {
        let values = Values::Floats(vec![points.iter().map(|point| point[axis]).collect()]);
        variables.push(Variable { name: name.into(), dimensions: vec!["num_nodes"], kind: "", values });
    }
    netcdf(1, &dimensions, &variables, 0)
}

#[test]
fn polyhedra_of_exodus_share_faces() {
    let mesh = io::read_bytes_with("a.exo", &exodus_polyhedra(|_, _| ()), &everything(0)).unwrap();
    assert_eq!((mesh.positions.len(), volume(&mesh)), (13, 3.0));
    let found = tetralod::mesh::findings(&mesh, 0.0).unwrap();
    assert_eq!((found.components, found.open_seam_faces), (1, 0));
    let block = &field(&mesh.cell_fields, "block").values;
    assert_eq!((block[0], block[block.len() - 1]), (7.0, 9.0));
    for (variable, wrong) in [
        ("fbconn1", 99),
        ("fbepecnt1", 5),
        ("fbepecnt1", -4),
        ("facconn1", 12),
        ("facconn1", 0),
        ("ebepecnt1", 7),
    ] {
        let change = |name: &str, list: &mut Vec<i32>| {
            if name == variable {
                list[0] = wrong;
            }
        };
        let error = io::read_bytes("a.exo", &exodus_polyhedra(change)).unwrap_err();
        assert!(!matches!(error.reason, ReadReason::Io(_)), "{variable} {wrong}: {error}");
    }
}
