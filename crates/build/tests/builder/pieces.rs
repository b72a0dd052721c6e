//! Promise: a mesh in several files is parted piece by piece into the parts that the whole has, byte for byte.

use crate::parts::{parted, written};
use crate::support::meshes::{bent, blocks, hilly, linear};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tetralod::mesh::{Field, MeshPiece, RepairLevel, TetMesh, repair_at};
use tetralod_build::parts::{InMemory, Part, PartsError, Piecewise, Plan};
use tetralod_build::{BuildConfig, FieldPrecision, mark_labels};
use tetralod_io as io;
use tetralod_io::{CellData, Pieces, ReadOptions};

/// A folder that is gone with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("tetralod-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("a new folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Writes a mesh in several files: the piece of each tetrahedron is `piece_of` its number and its least corner.
fn write(
    folder: &Folder,
    mesh: &TetMesh,
    count: usize,
    piece_of: impl Fn(usize, [f64; 3]) -> usize,
) -> PathBuf {
    let least = |tet: &[u32; 4]| {
        [0, 1, 2].map(|k| tet.iter().map(|&v| mesh.positions[v as usize][k]).fold(f64::INFINITY, f64::min))
    };
    let mut list = String::new();
    for piece in 0..count {
        let own: Vec<[u32; 4]> = mesh
            .tets
            .iter()
            .enumerate()
            .filter(|(t, tet)| piece_of(*t, least(tet)) % count == piece)
            .map(|(_, tet)| *tet)
            .collect();
        // From the last point to the first, so that pieces number in another order than the mesh.
        let mut points: Vec<u32> = own.iter().flatten().copied().collect();
        points.sort_unstable_by_key(|&v| std::cmp::Reverse(v));
        points.dedup();
        let number = |v: u32| points.iter().position(|&other| other == v).expect("it is there") as u32;
        // What a piece says of points of earlier ones does not count.
        let off = |field: &Field| if field.name == CLUSTER { piece as f64 } else { 1e-7 * piece as f64 };
        let values = |field: &Field| points.iter().map(|&v| field.values[v as usize] + off(field)).collect();
        let part = TetMesh {
            positions: points.iter().map(|&v| mesh.positions[v as usize]).collect(),
            fields: mesh
                .fields
                .iter()
                .map(|field| Field { values: values(field), ..field.clone() })
                .collect(),
            tets: own.iter().map(|tet| tet.map(number)).collect(),
            ..TetMesh::default()
        };
        let mut bytes = Vec::new();
        io::write_vtu(&part, &mut bytes).expect("bytes");
        fs::write(folder.0.join(format!("{piece}.vtu")), bytes).expect("a file");
        list += &format!("<Piece Source=\"{piece}.vtu\"/>");
    }
    let path = folder.0.join("mesh.pvtu");
    let list = format!(
        "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid GhostLevel=\"0\">{list}</PUnstructuredGrid></VTKFile>"
    );
    fs::write(&path, list).expect("a file");
    path
}

fn pieces(path: &Path) -> Vec<MeshPiece> {
    let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
    all_of(&Pieces::open(path, &options).expect("a list").expect("of pieces"))
}

fn all_of(pieces: &Pieces) -> Vec<MeshPiece> {
    let mut all = Vec::new();
    pieces
        .for_each::<io::ReadError>(&mut |piece| {
            all.push(piece);
            Ok(())
        })
        .expect("sound pieces");
    all
}

/// The pieces as one mesh.
fn joined(pieces: &[MeshPiece]) -> TetMesh {
    let mut whole = TetMesh::default();
    for MeshPiece { points, mesh } in pieces {
        if whole.fields.is_empty() {
            whole.fields =
                mesh.fields.iter().map(|field| Field { values: Vec::new(), ..field.clone() }).collect();
        }
        for (i, &number) in points.iter().enumerate() {
            let number = number as usize;
            if number < whole.positions.len() {
                assert_eq!(whole.positions[number], mesh.positions[i], "point {number}");
                for (all, own) in whole.fields.iter().zip(&mesh.fields) {
                    assert_eq!(all.values[number], own.values[i], "point {number}");
                }
                continue;
            }
            assert_eq!(number, whole.positions.len(), "new points follow those before them");
            whole.positions.push(mesh.positions[i]);
            whole.fields.iter_mut().zip(&mesh.fields).for_each(|(all, own)| all.values.push(own.values[i]));
        }
        whole.tets.extend(mesh.tets.iter().map(|tet| tet.map(|v| points[v as usize])));
    }
    whole
}

fn part_pieces(
    pieces: &[MeshPiece],
    config: &BuildConfig,
    parts: u32,
) -> Result<(Plan, Vec<Part<'static>>), PartsError> {
    let scratch = InMemory::default();
    let mut parting = Piecewise::new(config, parts, &scratch)?;
    for piece in pieces {
        parting.add(piece.clone())?;
    }
    let mut all = Vec::new();
    let plan = parting.part(BTreeMap::new(), &mut |part| {
        all.push(part);
        Ok(())
    })?;
    assert!(scratch.names().is_empty(), "what is left in the scratch: {:?}", scratch.names());
    Ok((plan, all))
}

/// A field that is a label by its name.
const CLUSTER: &str = "cluster_id";

/// A shell whose cells are about as thick as the steps of the coarsest lattice, so that points leave their cells.
fn thin(n: u32) -> TetMesh {
    let mut mesh = blocks([n; 3], &[hilly], |_| true);
    mesh.grid = None;
    for p in &mut mesh.positions {
        let [u, v, w] = *p;
        let (radius, turn) = (1.0 + 2e-4 * w, 1.5 * u);
        *p = [radius * turn.cos(), radius * turn.sin(), v];
    }
    mesh
}

/// Meshes whose boundaries are flat and curved, of one field and of two, on lattices that move their points a little or by a cell.
fn meshes() -> Vec<(&'static str, TetMesh)> {
    let mut shaken = blocks([7, 6, 5], &[hilly, linear], |[x, y, _]| x < 4 || y < 3);
    shaken.grid = None;
    shaken.positions.iter_mut().for_each(|p| p[0] += 0.01 * (7.0 * p[1]).sin());
    let mut whole_numbers = blocks([6; 3], &[|p| (40.0 * p[0]).round()], |_| true);
    whole_numbers.grid = None;
    whole_numbers.fields[0].integer = true;
    let mut labels = whole_numbers.clone();
    labels.fields[0].name = CLUSTER.to_owned();
    vec![
        ("shaken", shaken),
        ("bent", bent(7)),
        ("thin", thin(6)),
        ("whole numbers", whole_numbers),
        ("labels", labels),
    ]
}

#[test]
fn pieces_have_the_parts_of_their_whole() {
    let folder = Folder::new("piecewise");
    for (name, mesh) in meshes() {
        let slabs = |_: usize, p: [f64; 3]| ((p[0] + 1.0) * 4.7) as usize;
        let mixed = |t: usize, _: [f64; 3]| t / 7;
        for (how, count) in [("one", 1), ("slabs", 5), ("mixed", 3)] {
            let path = match how {
                "mixed" => write(&folder, &mesh, count, mixed),
                _ => write(&folder, &mesh, count, slabs),
            };
            let mut whole = io::read(&path).expect("a mesh");
            mark_labels(&mut whole, &[], &BuildConfig::default()).expect("no names");
            let (repaired, report) = repair_at(whole.clone(), RepairLevel::Safe).expect("a sound mesh");
            assert!(report.is_empty() && repaired == whole, "{name}, {how}: {report}");
            let mut pieces = pieces(&path);
            assert_eq!(pieces.len(), count);
            for piece in &mut pieces {
                mark_labels(&mut piece.mesh, &[], &BuildConfig::default()).expect("no names");
            }
            assert_eq!(whole.fields[0].is_label, name == "labels");
            let together = joined(&pieces);
            assert_eq!(
                (&together.positions, &together.tets),
                (&whole.positions, &whole.tets),
                "{name}, {how}"
            );
            for (a, b) in together.fields.iter().zip(&whole.fields) {
                assert_eq!((&a.name, &a.values), (&b.name, &b.values), "{name}, {how}");
            }
            for (all_fields, position_bits) in [(true, None), (false, Some(18))] {
                let config = BuildConfig { all_fields, position_bits, ..BuildConfig::default() };
                for parts in [1, 4, 16] {
                    let expected = parted(&whole, &config, parts);
                    let found = part_pieces(&pieces, &config, parts)
                        .unwrap_or_else(|error| panic!("{name}, {how}, {parts}: {error}"));
                    assert_eq!(found.0, expected.0, "{name}, {how}, {parts}");
                    for (found, expected) in found.1.iter().zip(&expected.1) {
                        assert!(
                            written(found) == written(expected),
                            "{name}, {how}, {parts}: {:?} differs",
                            found.node()
                        );
                    }
                    assert_eq!(found.1.len(), parts as usize);
                }
            }
        }
    }
}

#[test]
fn ranges_of_cells_have_the_parts_of_their_whole() {
    let folder = Folder::new("piecewise-ranges");
    for (name, mesh) in meshes() {
        let mut bytes = Vec::new();
        io::write_vtu(&mesh, &mut bytes).expect("bytes");
        let path = folder.0.join("mesh.vtu");
        fs::write(&path, bytes).expect("a file");
        let mut whole = io::read(&path).expect("a mesh");
        mark_labels(&mut whole, &[], &BuildConfig::default()).expect("no names");
        for most in [whole.tets.len() as u64 / 7, 100] {
            let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
            let pieces = Pieces::open_ranges(&path, &options, Some(most)).expect("a file").expect("ranges");
            let mut pieces = all_of(&pieces);
            assert!(pieces.len() > 7);
            for piece in &mut pieces {
                mark_labels(&mut piece.mesh, &[], &BuildConfig::default()).expect("no names");
            }
            for (all_fields, parts) in [(true, 1), (true, 8), (false, 4)] {
                let config = BuildConfig { all_fields, ..BuildConfig::default() };
                let expected = parted(&whole, &config, parts);
                let found = part_pieces(&pieces, &config, parts)
                    .unwrap_or_else(|error| panic!("{name}, {most}, {parts}: {error}"));
                assert_eq!(found.0, expected.0, "{name}, {most}, {parts}");
                for (found, expected) in found.1.iter().zip(&expected.1) {
                    assert!(
                        written(found) == written(expected),
                        "{name}, {most}, {parts}: {:?} differs",
                        found.node()
                    );
                }
            }
        }
    }
}

#[test]
fn what_only_a_whole_tells_is_left_to_it() {
    let folder = Folder::new("piecewise-whole");
    let mesh = bent(3);
    let path = write(&folder, &mesh, 2, |t, _| t / 40);
    let good = pieces(&path);
    let needs_whole =
        |pieces: &[MeshPiece], config: &BuildConfig, why: &str| match part_pieces(pieces, config, 2) {
            Err(PartsError::NeedsWhole { why: found }) => assert_eq!(found, why),
            other => panic!("{why}: {:?}", other.map(|(plan, _)| plan)),
        };
    let config = BuildConfig::default();
    let mut turned = good.clone();
    turned[1].mesh.tets[3].swap(0, 1);
    needs_whole(&turned, &config, "its cells need repair");
    let mut unused = good.clone();
    let number = unused[1].points.iter().max().expect("points") + 1;
    unused[1].points.push(number);
    unused[1].mesh.positions.push([9.0; 3]);
    unused[1].mesh.fields[0].values.push(0.0);
    needs_whole(&unused, &config, "some points belong to no cell");
    let twice = [good[0].clone(), good[1].clone(), good[1].clone()];
    needs_whole(&twice, &config, "its pieces overlap");
    let tolerant = BuildConfig { field_precision: FieldPrecision::Units(0.1), ..BuildConfig::default() };
    needs_whole(&good, &tolerant, "a tolerance is given");
    let kept = BuildConfig { keep_points: vec![[0.0; 3]], ..BuildConfig::default() };
    needs_whole(&good, &kept, "regions and single points are kept");
    let mut many = pieces(&write(&Folder::new("piecewise-labels"), &bent(7), 2, |t, _| t / 1100));
    for piece in &mut many {
        piece.mesh.fields[0].is_label = true;
    }
    needs_whole(&many, &config, "a label has many values");
    assert!(matches!(part_pieces(&good, &config, 3), Err(PartsError::Count { parts: 3 })));
    assert!(matches!(part_pieces(&good, &config, 4096), Err(PartsError::TooMany { parts: 4096, .. })));
    // What a folder loses is an error, not a panic.
    let scratch = InMemory::default();
    let parting = Piecewise::new(&config, 2, &scratch).expect("a beginning");
    assert!(parting.part(BTreeMap::new(), &mut |_| Ok(())).is_err(), "without pieces");
}
