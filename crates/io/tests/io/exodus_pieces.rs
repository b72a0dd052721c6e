//! Promise: a mesh of Exodus in several files is the mesh that was parted.

use crate::exodus::{Values, Variable, decomposed};
use crate::pieces::Folder;
use crate::ranges::{joined, pieces};
use std::path::PathBuf;
use tetralod::mesh::{TetMesh, repair};
use tetralod_io::{self as io, CellData, FilesInMemory, ReadOptions};

fn everything(step: usize) -> ReadOptions {
    ReadOptions { cells: CellData::Values, step, ..ReadOptions::default() }
}

/// A folder with the pieces of the mesh, which are called `a.e`, and the mesh.
fn parted(name: &str, count: usize, change: &dyn Fn(usize, &mut Vec<Variable>)) -> (Folder, TetMesh) {
    let folder = Folder::new(name);
    let (whole, pieces) = decomposed(count, change);
    let width = count.to_string().len();
    for (number, piece) in pieces.iter().enumerate() {
        folder.write(&format!("a.e.{count}.{number:0width$}"), piece);
    }
    (folder, io::read_bytes_with("whole.e", &whole, &everything(1)).unwrap())
}

/// Each tetrahedron with the place and the value of each corner, and its own values and number, in ascending order.
fn described(mesh: &TetMesh) -> Vec<String> {
    let corner = |v: u32| {
        let values = mesh.fields.iter().map(|field| field.values[v as usize]);
        (mesh.positions[v as usize], values.collect::<Vec<_>>())
    };
    let described = (0..).zip(&mesh.tets).map(|(number, tet)| {
        let at_cells = mesh.cell_fields.iter().map(|field| (&field.name, field.values[number as usize]));
        format!("{:?}", (tet.map(corner), at_cells.collect::<Vec<_>>(), mesh.input.cells.cell_of(number)))
    });
    let mut all: Vec<String> = described.collect();
    all.sort_unstable();
    all
}

fn without(name: &'static str) -> impl Fn(usize, &mut Vec<Variable>) {
    move |piece, variables| {
        if piece == 2 {
            variables.retain(|variable| variable.name != name);
        }
    }
}

fn replaced(name: &'static str, values: Values) -> impl Fn(usize, &mut Vec<Variable>) {
    move |piece, variables| {
        for variable in variables.iter_mut().filter(|variable| piece == 2 && variable.name == name) {
            variable.values = values.clone();
        }
    }
}

#[test]
fn any_name_stands_for_all_pieces() {
    // Eight layers are in ten pieces, of which two are empty.
    for (count, last) in [(4, "a.e.4.3"), (10, "a.e.10.09")] {
        let (folder, whole) = parted("exodus", count, &|_, _| ());
        let expected = described(&whole);
        for name in ["a.e", last] {
            let path = folder.0.join(name);
            assert_eq!(io::steps(&path).unwrap().len(), 2, "{name}");
            let mesh = io::read_with(&path, &everything(1)).unwrap();
            assert_eq!(
                (mesh.positions.len(), described(&mesh)),
                (whole.positions.len(), expected.clone()),
                "{name}"
            );
            assert_eq!(mesh.input.label_names, whole.input.label_names);
            assert!(mesh.input.files.0.iter().filter(|file| file.is_file()).count() >= count, "{name}");
            let (_, report) = repair(mesh).unwrap();
            assert_eq!(report.to_string(), "", "{name}");
        }
    }
}

#[test]
fn pieces_that_come_one_by_one_are_the_whole() {
    let (folder, _) = parted("exodus-ranges", 4, &|_, _| ());
    let path = folder.0.join("a.e");
    let whole =
        io::read_with(&path, &ReadOptions { cells: CellData::Names, ..ReadOptions::default() }).unwrap();
    let all = pieces(&path, 1).unwrap().unwrap();
    assert_eq!(all.len(), 4);
    let found = joined(&all);
    assert_eq!((&found.positions, &found.tets), (&whole.positions, &whole.tets));
    assert_eq!((&found.fields, &found.cell_fields), (&whole.fields, &whole.cell_fields));
    assert_eq!(all[2].mesh.input.files.0, [folder.0.join("a.e.4.2")]);
}

/// Points meet by their numbers where there are some, and by their places where there are none.
#[test]
fn nodes_meet_by_number_or_place() {
    // As if the program had rounded otherwise.
    let moved = |piece: usize, variables: &mut Vec<Variable>| {
        for variable in
            variables.iter_mut().filter(|variable| piece == 2 && variable.name.starts_with("coord"))
        {
            let Values::Floats(rows) = &mut variable.values else { panic!() };
            rows[0].iter_mut().for_each(|x| *x += 1e-12);
        }
    };
    let nameless = |piece: usize, variables: &mut Vec<Variable>| {
        variables.retain(|variable| variable.name != "node_num_map");
        moved(piece, variables);
    };
    for (count, change) in [(108, &moved as &dyn Fn(usize, &mut Vec<Variable>)), (132, &nameless)] {
        let (folder, _) = parted(&format!("exodus-nodes-{count}"), 4, change);
        assert_eq!(io::read(&folder.0.join("a.e")).unwrap().positions.len(), count);
        assert_eq!(joined(&pieces(&folder.0.join("a.e"), 1).unwrap().unwrap()).positions.len(), count);
    }
    let (folder, whole) = parted("exodus-places", 4, &|_, variables| {
        variables.retain(|variable| variable.name != "node_num_map");
    });
    let mesh = io::read_with(&folder.0.join("a.e"), &everything(1)).unwrap();
    assert_eq!(described(&mesh), described(&whole));
}

#[test]
fn a_block_of_one_name_is_one() {
    let other = replaced("eb_prop1", Values::Integers(vec![70, 80]));
    let (folder, whole) = parted("exodus-blocks", 4, &other);
    let mesh = io::read_with(&folder.0.join("a.e"), &everything(1)).unwrap();
    assert_eq!(described(&mesh), described(&whole));
    let (folder, _) = parted("exodus-names", 4, &replaced("eb_names", Values::Text(b"low\0\0wide\0".into())));
    let error = io::read(&folder.0.join("a.e")).unwrap_err().to_string();
    assert!(
        error.contains("a.e.4.2: eb_prop1: block 20 is called \"wide\", but \"high\" in an earlier piece"),
        "{error}"
    );
}

#[test]
fn pieces_that_do_not_belong_together_are_named() {
    let times = |times: &[f64]| Values::Floats(times.iter().map(|time| vec![*time]).collect());
    let refused = |change: &dyn Fn(usize, &mut Vec<Variable>)| {
        let (folder, _) = parted("exodus-bad", 4, change);
        let path = folder.0.join("a.e");
        let error = io::read_with(&path, &everything(0)).unwrap_err();
        // One by one they are refused for the same reason.
        assert_eq!(pieces(&path, 1).unwrap_err(), error);
        assert!(error.file.ends_with("a.e.4.2"), "{error}");
        error.to_string()
    };
    let word = |text: &str, error: String| assert!(error.contains(text), "{error}");
    word("a.e.4.0\" has at nodes (\"T\")", refused(&without("name_nod_var")));
    word("a.e.4.0\" has at elements (\"s\")", refused(&without("name_elem_var")));
    word(
        "at nodes (\"p\") in ",
        refused(&replaced("name_nod_var", Values::Text(b"p\0\0\0\0".into())))
            .replace("has at nodes (\"T\")", "at nodes (\"p\") in "),
    );
    word("time step 1 is at 2, but at 1 in ", refused(&replaced("time_whole", times(&[0.25, 2.0]))));
    word("node_num_map", refused(&without("node_num_map")));
    word("coordz", refused(&without("coordz")));
    let far = |piece: usize, variables: &mut Vec<Variable>| {
        let moved = variables.iter_mut().filter(|variable| piece == 2 && variable.name == "coordy");
        moved.for_each(|variable| {
            let Values::Floats(rows) = &mut variable.values else { panic!() };
            rows[0].iter_mut().for_each(|y| *y += 0.1);
        });
    };
    word("in an earlier piece at", refused(&far));
    let twice = |piece: usize, variables: &mut Vec<Variable>| {
        let maps = variables.iter_mut().filter(|variable| piece == 2 && variable.name == "node_num_map");
        maps.for_each(|variable| {
            let Values::Integers(list) = &mut variable.values else { panic!() };
            list[1] = list[0];
        });
    };
    word("is there twice", refused(&twice));
    // Elements are called as users know them.
    let beyond = |piece: usize, variables: &mut Vec<Variable>| {
        let connect = variables.iter_mut().filter(|variable| piece == 2 && variable.name == "connect2");
        connect.for_each(|variable| {
            let Values::Integers(list) = &mut variable.values else { panic!() };
            list[4] = 99;
        });
    };
    word("element blocks, numbered by elem_num_map: cell 26 refers to point 98", refused(&beyond));
}

#[test]
fn what_is_missing_or_not_clear_is_said() {
    let (folder, _) = parted("exodus-missing", 4, &|_, _| ());
    let refused = |name: &str| io::read(&folder.0.join(name)).unwrap_err().to_string();
    std::fs::remove_file(folder.0.join("a.e.4.2")).unwrap();
    for name in ["a.e", "a.e.4.0"] {
        assert!(refused(name).contains("its piece \"a.e.4.2\" is not there; put all 4"), "{}", refused(name));
        assert!(io::steps(&folder.0.join(name)).is_err());
    }
    let (_, pieces) = decomposed(2, &|_, _| ());
    for (number, piece) in pieces.iter().enumerate() {
        folder.write(&format!("a.e.2.{number}"), piece);
    }
    let error = refused("a.e");
    assert!(error.contains("in 2 and in 4 pieces") && error.contains("as a.e.2.0"), "{error}");
    assert_eq!(io::read(&folder.0.join("a.e.2.1")).unwrap().positions.len(), 108);
    // A file of the name itself is that file, and one of another kind is no piece.
    folder.write("a.e", &decomposed(1, &|_, _| ()).0);
    assert_eq!(io::read(&folder.0.join("a.e")).unwrap().positions.len(), 108);
    folder.write("b.4.0", b"words");
    assert!(refused("b.4.0").contains("not a format"), "{}", refused("b.4.0"));
    assert!(refused("b").contains("b: "), "{}", refused("b"));
    folder.write("c.4.0", include_bytes!("../data/pieces.vtkhdf"));
    assert_eq!(io::read(&folder.0.join("c.4.0")).unwrap().positions.len(), 12);
}

#[test]
fn pieces_in_memory_are_the_whole() {
    let (whole, pieces) = decomposed(4, &|_, _| ());
    let whole = io::read_bytes_with("whole.e", &whole, &everything(1)).unwrap();
    let mut files = FilesInMemory::default();
    for (number, piece) in pieces.iter().enumerate().rev() {
        files.add(format!("a.e.4.{number}"), piece);
    }
    let steps = files.steps().unwrap();
    assert_eq!(steps.iter().map(|step| step.name.as_str()).collect::<Vec<_>>(), ["a.e.4.0", "a.e.4.0"]);
    assert_eq!(described(&files.read(&steps[1], &everything(0)).unwrap()), described(&whole));
    files.keep(&steps[1..]);
    assert_eq!(described(&files.read(&steps[1], &everything(0)).unwrap()), described(&whole));
    let mut files = FilesInMemory::default();
    files.add("a.e.4.1", &pieces[1]);
    let error = files.steps().unwrap_err().to_string();
    assert!(error.contains("it needs the file \"a.e.4.0\""), "{error}");
}

/// A folder with pieces of which one is cut off or has other bits gives an error or a mesh, and each way of reading the same.
#[test]
fn damaged_pieces_are_refused_or_harmless() {
    let (folder, _) = parted("exodus-damaged", 2, &|_, _| ());
    let path: PathBuf = folder.0.join("a.e.2.1");
    let bytes = std::fs::read(&path).unwrap();
    let check = |damaged: &[u8]| {
        folder.write("a.e.2.1", damaged);
        let read = io::read_with(&path, &everything(0));
        if let Ok(mesh) = &read {
            assert!(mesh.tets.iter().flatten().all(|v| (*v as usize) < mesh.positions.len()));
        }
        if let (Ok(Ok(all)), Ok(mesh)) = (pieces(&path, 1), &read) {
            assert_eq!(joined(&all).tets, mesh.tets);
        }
        read.is_err()
    };
    assert!((0..bytes.len()).step_by(41).filter(|&length| check(&bytes[..length])).count() > 100);
    for bit in (0..8 * bytes.len()).step_by(229) {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        check(&damaged);
    }
}
