//! Promise: files in memory are read as those on a disk are, to the last bit, whatever their format and however many there are.

use crate::damaged;
use crate::files::*;
use crate::meshers::{MEDIT, META, NRRD, TETGEN};
use crate::pieces::{Folder, cubes, extent, list, slab};
use crate::polyhedra;
use crate::survey::assert_agrees;
use std::path::Path;
use tetralod_io::{
    self as io, CellData, FilesInMemory, MemoryLimit, ReadError, ReadOptions, ReadReason, StepInMemory,
};

/// What a mesh is in: files by their names, of which the first one names the others.
type Files = Vec<(String, Vec<u8>)>;

const GMSH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"steel\"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n\
    2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n2\n1 2 2 1 1 1 2 3\n2 4 2 7 3 1 2 3 4\n$EndElements\n";
const NETGEN: &str =
    "mesh3d\ndimension\n3\nvolumeelements\n1\n7 4 1 3 2 4\npoints\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nendmesh\n";

/// A view of Gmsh at a time.
fn view(step: usize, time: f64, values: [f64; 4]) -> String {
    let rows: String = (1..).zip(values).map(|(node, value)| format!("{node} {value}\n")).collect();
    format!("$NodeData\n1\n\"heat\"\n1\n{time}\n3\n{step}\n1\n4\n{rows}$EndNodeData\n")
}

fn named(files: &[(&str, &[u8])]) -> Files {
    files.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.to_vec())).collect()
}

fn texts(files: &[(&str, &str)]) -> Files {
    named(&files.iter().map(|(name, text)| (*name, text.as_bytes())).collect::<Vec<_>>())
}

fn pvtu() -> Files {
    let [left, right] = [[0., 0., 0.], [1., 0., 0.]].map(|place| cubes(&[place], place[0] as usize));
    let list = list(&["parts/0.vtu", "./parts/1.vtu"]);
    named(&[("a.pvtu", list.as_bytes()), ("parts/0.vtu", &left), ("parts/1.vtu", &right)])
}

fn grid_in_pieces(kind: &str, ending: &str, dims: [usize; 3], first: [i64; 3]) -> Files {
    let whole = if kind == "ImageData" { grid_sample() } else { uneven_sample() };
    let (mut pieces, mut files) = (String::new(), Files::new());
    for (number, ends) in [[1, dims[0] - 1], [0, 1]].into_iter().enumerate() {
        let name = format!("parts/{number}.{ending}");
        pieces += &format!("<Piece Extent=\"{}\" Source=\"{name}\"/>", extent(dims, first, ends));
        files.push((name, slab(&whole, kind, dims, first, ends)));
    }
    let extent = extent(dims, first, [0, dims[0] - 1]);
    let list = format!(
        "<VTKFile type=\"P{kind}\"><P{kind} WholeExtent=\"{extent}\" Origin=\"0 2 -2.75\" Spacing=\"0.5 1 0.25\">{pieces}</P{kind}>\
         </VTKFile>"
    );
    files.insert(0, (format!("a.p{ending}"), list.into_bytes()));
    files
}

/// A list of time steps with these files.
fn pvd(files: &[&str]) -> Vec<u8> {
    let entry = |(time, file): (usize, &&str)| format!("<DataSet timestep=\"{time}\" file=\"{file}\"/>");
    let entries: String = files.iter().enumerate().map(entry).collect();
    format!("<VTKFile type=\"Collection\"><Collection>{entries}</Collection></VTKFile>").into_bytes()
}

/// Meshes that are in several files, all of which are needed.
fn in_several_files() -> Vec<Files> {
    let samples = numbers("UInt8", &grid_sample().fields[0].values, false);
    let sidecar = sample_sidecar("uint8", "little");
    let with_name = sidecar.replacen('{', "{\"file\": \"b.dat\", ", 1);
    let turned = [pvtu(), vec![("b.pvtu".into(), list(&["parts/1.vtu", "parts/0.vtu"]).into_bytes())]];
    let mut steps = turned.concat();
    steps.insert(0, ("all.pvd".into(), pvd(&["b.pvtu", "a.pvtu"])));
    vec![
        texts(&TETGEN),
        texts(&META),
        texts(&NRRD),
        texts(&[
            ("a.nhdr", &NRRD[0].1.replace("a.raw", "parts/%d.raw 0 1 1")),
            ("parts/0.raw", "ABCD"),
            ("parts/1.raw", "EFGH"),
        ]),
        texts(&[
            ("a.mhd", &META[0].1.replace("a.zraw", "LIST\n0.img\n1.img")),
            ("0.img", "ABCD"),
            ("1.img", "EFGH"),
        ]),
        named(&[("a.raw", &samples), ("a.json", sidecar.as_bytes())]),
        named(&[("a.json", with_name.as_bytes()), ("b.dat", &samples)]),
        pvtu(),
        grid_in_pieces("ImageData", "vti", [4, 3, 2], [2, 0, -1]),
        grid_in_pieces("RectilinearGrid", "vtr", [3, 2, 3], [0, 5, 0]),
        grid_in_pieces("StructuredGrid", "vts", [3, 2, 3], [0, 5, 0]),
        named(&[
            ("a.pvd", &pvd(&["0.vtu", "1.vtu"])),
            ("0.vtu", &sample_vtu(Style::PLAIN)),
            ("1.vtu", &sample_vtu(Style::PLAIN)),
        ]),
        steps,
    ]
}

fn all() -> Vec<Files> {
    let mut all = in_several_files();
    let single = damaged::files().into_iter().chain(polyhedra::files());
    all.extend(single.map(|(name, bytes, _)| vec![(name, bytes)]));
    #[cfg(feature = "hdf5")]
    all.extend(crate::hdf5::files().into_iter().map(|(name, bytes)| named(&[(name, &bytes)])));
    let steps = format!("{GMSH}{}{}", view(0, 0.5, [1., 2., 3., 4.]), view(1, 1.5, [5., 6., 7., 8.]));
    all.push(texts(&[("one.msh", GMSH)]));
    all.push(texts(&[("steps.msh", &steps)]));
    all.push(texts(&MEDIT));
    all.push(texts(&MEDIT[..1]));
    all.push(texts(&[("a.vol", NETGEN)]));
    all.push(named(&[("a.vtu.gz", &gzip(&sample_vtu(Style::PLAIN)))]));
    all.push(named(&[("a.msh.gz", &gzip(GMSH.as_bytes()))]));
    let packed = pvtu().into_iter().map(|(name, bytes)| {
        if name == "a.pvtu" { ("a.pvtu.gz".into(), gzip(&bytes)) } else { (name, bytes) }
    });
    all.push(packed.collect());
    all
}

fn in_memory(files: &[(String, Vec<u8>)]) -> FilesInMemory {
    let mut found = FilesInMemory::default();
    files.iter().for_each(|(name, bytes)| found.add(name, bytes));
    found
}

fn everything(step: usize) -> ReadOptions {
    ReadOptions { cells: CellData::Values, step, ..ReadOptions::default() }
}

fn steps_of(files: &FilesInMemory) -> Vec<StepInMemory> {
    files.steps().unwrap_or_else(|error| panic!("{error}"))
}

/// The first error in reading all that files hold.
fn refused(files: &FilesInMemory) -> ReadError {
    let read = |steps: Vec<StepInMemory>| {
        steps.iter().try_for_each(|step| files.read(step, &everything(0)).map(drop))
    };
    files.steps().and_then(read).unwrap_err()
}

#[test]
fn every_format_is_read_as_from_a_disk() {
    let folder = Folder::new("in-memory");
    for files in all() {
        for (name, bytes) in &files {
            folder.write(name, bytes);
        }
        let first = &files[0].0;
        let on_disk = io::steps(&folder.0.join(first)).unwrap();
        // The order in which files come does not matter where one names the others.
        for files in [files.clone(), files.iter().rev().cloned().collect()] {
            let found = in_memory(&files);
            let steps = steps_of(&found);
            let times: Vec<_> = steps.iter().map(|step| step.time).collect();
            assert_eq!(times, on_disk.iter().map(|step| step.time).collect::<Vec<_>>(), "{first}");
            for (step, there) in steps.iter().zip(&on_disk) {
                let expected = io::read_with(&there.path, &everything(there.number)).unwrap();
                // Which step it is follows from the step alone.
                let mesh = found.read(step, &everything(7)).unwrap_or_else(|error| panic!("{error}"));
                assert_eq!(mesh, expected, "{first}");
                assert!(mesh.input.files.0.len() <= files.len());
            }
        }
        for (name, _) in &files {
            std::fs::remove_file(folder.0.join(name)).unwrap();
        }
    }
}

#[test]
fn a_survey_says_what_is_read() {
    for files in all() {
        let found = in_memory(&files);
        for step in steps_of(&found) {
            let (survey, bounds) = found.survey(&step, &MemoryLimit::default()).unwrap();
            let mesh = found.read(&step, &everything(0)).unwrap();
            // Another step may lie elsewhere.
            if files[0].0 != "steps.vtkhdf" {
                assert_agrees(&survey, &mesh, &step.name);
            }
            assert!(bounds.is_none_or(|bounds| {
                mesh.positions
                    .iter()
                    .all(|point| (0..3).all(|i| bounds.min[i] <= point[i] && point[i] <= bounds.max[i]))
            }));
        }
    }
    let nrrd = texts(&[("a.nhdr", &NRRD[0].1.replace("sizes", "sample units: \"HU\"\nsizes")), NRRD[1]]);
    let found = in_memory(&nrrd);
    let (survey, _) = found.survey(&steps_of(&found)[0], &MemoryLimit::default()).unwrap();
    assert_eq!((survey.format, survey.fields[0].unit.as_str()), ("nrrd", "HU"));
    let small = found.survey(&steps_of(&found)[0], &MemoryLimit::of(10));
    assert!(matches!(small, Err(ReadError { reason: ReadReason::Memory { .. }, .. })));
}

#[test]
fn folders_may_be_lost() {
    for files in in_several_files() {
        let expected = in_memory(&files);
        let last = |name: &str| Path::new(name).file_name().unwrap().to_str().unwrap().to_owned();
        let flat: Files = files.iter().map(|(name, bytes)| (last(name), bytes.clone())).collect();
        let deeper: Files =
            files.iter().map(|(name, bytes)| (format!("x/y/{name}"), bytes.clone())).collect();
        for files in [flat, deeper] {
            let found = in_memory(&files);
            for (step, expected_step) in steps_of(&found).iter().zip(steps_of(&expected)) {
                let read = |files: &FilesInMemory, step| {
                    files.read(step, &everything(0)).unwrap_or_else(|error| panic!("{error}"))
                };
                assert_eq!(read(&found, step), read(&expected, &expected_step), "{}", step.name);
            }
        }
    }
}

#[test]
fn what_is_not_given_is_named() {
    for files in in_several_files() {
        for missing in 1..files.len() {
            let mut rest = files.clone();
            let (name, _) = rest.remove(missing);
            let error = refused(&in_memory(&rest));
            let ReadReason::NotGiven(named) = &error.reason else { panic!("{error}") };
            assert!(named.ends_with(&name), "{error}");
            assert!(rest.iter().any(|(file, _)| *file == error.file), "{error}");
            assert!(error.to_string().contains("give them together"), "{error}");
        }
    }
    let mut rest = pvtu();
    rest.pop();
    let error = refused(&in_memory(&rest)).to_string();
    assert!(
        error.starts_with("a.pvtu: piece 1: it needs the file \"./parts/1.vtu\", which is not among"),
        "{error}"
    );
    let error = refused(&in_memory(&texts(&TETGEN[1..])));
    assert_eq!((error.file.as_str(), error.reason), ("a.1.ele", ReadReason::NotGiven("a.1.node".into())));
}

#[test]
fn a_file_of_another_folder_is_not_taken() {
    let [list, left, right] = pvtu().try_into().unwrap();
    let elsewhere = |name: &str| (format!("other/{name}"), right.1.clone());
    let error = refused(&in_memory(&[list.clone(), left.clone(), elsewhere("parts/1.vtu")]));
    assert!(matches!(error.reason, ReadReason::NotGiven(_)), "{error}");
    let twice = refused(&in_memory(&[list.clone(), left.clone(), right.clone(), right.clone()]));
    assert!(twice.to_string().contains("\"./parts/1.vtu\", of which several were given"), "{twice}");
    let medit = texts(&[MEDIT[0], MEDIT[1], MEDIT[1]]);
    assert_eq!(refused(&in_memory(&medit)).reason, ReadReason::SeveralGiven("a.sol".into()));
    // The one that agrees in more of its name is meant.
    let flat = ("1.vtu".to_owned(), b"<VTKFile".to_vec());
    let found = in_memory(&[list, left, flat, right]);
    assert!(found.read(&steps_of(&found)[0], &everything(0)).is_ok());
    for name in ["../a.vtu", "/a.vtu", ""] {
        let list = ("a.pvtu".to_owned(), crate::pieces::list(&[name]).into_bytes());
        let error = refused(&in_memory(&[list, ("a.vtu".to_owned(), sample_vtu(Style::PLAIN))]));
        assert!(error.to_string().contains("another folder"), "{error}");
    }
}

#[test]
fn files_of_one_name_are_steps_and_bytes_are_dropped_behind_them() {
    let file = ("a.vtu".to_owned(), sample_vtu(Style::PLAIN));
    let mut found = in_memory(&[file.clone(), file.clone()]);
    let steps = steps_of(&found);
    assert_eq!((steps.len(), found.held_bytes()), (2, 2 * file.1.len() as u64));
    found.keep(&steps[1..]);
    assert_eq!(found.held_bytes(), file.1.len() as u64);
    assert_eq!(
        found.read(&steps[1], &everything(0)).unwrap(),
        io::read_bytes_with("a.vtu", &file.1, &everything(0)).unwrap()
    );
    found.keep(&[]);
    assert_eq!(found.held_bytes(), 0);
    // Two lists share their pieces.
    let files = in_several_files().pop().unwrap();
    let mut found = in_memory(&files);
    let steps = steps_of(&found);
    found.keep(&steps[1..]);
    assert!(found.read(&steps[1], &everything(0)).is_ok());
    assert!(FilesInMemory::default().steps().unwrap().is_empty());
}

#[test]
fn what_lies_in_a_folder_need_not_be_of_the_mesh() {
    let extra = |name: &str| (name.to_owned(), b"words".to_vec());
    let in_folder = |(name, bytes): (String, Vec<u8>)| (format!("case/{name}"), bytes);
    let mut files: Files = pvtu().into_iter().map(in_folder).collect();
    files.extend([extra("case/README.txt"), extra("case/logs/run.json")]);
    let found = in_memory(&files);
    let steps = steps_of(&found);
    assert_eq!((steps.len(), steps[0].name.as_str()), (1, "case/a.pvtu"));
    assert_eq!(found.left_out(), ["case/README.txt", "case/logs/run.json"]);
    // What was given by itself is meant.
    files.push(extra("README.txt"));
    assert_eq!(refused(&in_memory(&files)).reason, ReadReason::UnknownFormat);
    let alone = in_memory(&[extra("case/README.txt")]);
    assert_eq!((refused(&alone).reason, alone.left_out().len()), (ReadReason::UnknownFormat, 0));
}

#[test]
fn files_that_name_each_other_end() {
    let own = |name: &str, of: &str| (name.to_owned(), list(&[of]).into_bytes());
    for files in [vec![own("a.pvtu", "a.pvtu")], vec![own("a.pvtu", "b.pvtu"), own("b.pvtu", "a.pvtu")]] {
        assert!(refused(&in_memory(&files)).to_string().contains("a piece of type PUnstructuredGrid"));
    }
}
