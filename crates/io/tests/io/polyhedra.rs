//! Promise: polyhedra become tetrahedra that fill them and fit those of their neighbours, in every format; what is no cell is refused by
//! its number.

use crate::files::*;
use std::collections::HashMap;
use tetralod::mesh::{self, TetMesh};
use tetralod_io as io;
use tetralod_io::{CellData, ReadError, ReadOptions, ReadReason};

/// A cell: the faces of a polyhedron, or a hexahedron by the faces of its bottom and top.
#[derive(Clone, Debug)]
enum Cell {
    Faces(Vec<Vec<u32>>),
    Hexahedron([u32; 8]),
}

/// A change of the faces of a cell, and of all points.
type Change<'a> = &'a dyn Fn(&mut Vec<Vec<u32>>, &mut Vec<[f64; 3]>);

/// Cells over points.
#[derive(Clone, Debug, Default)]
pub struct Cells {
    points: Vec<[f64; 3]>,
    known: HashMap<[i64; 3], u32>,
    cells: Vec<Cell>,
}

/// Which layout a `.vtu` has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// `faces` and `faceoffsets`.
    Old,
    /// The four arrays since VTK 9.4.
    New,
}

const QUADS: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// The corners of a box from its first corner on, in steps of a quarter.
fn corners([x, y, z]: [i64; 3], size: i64) -> [[i64; 3]; 8] {
    let (a, b, c) = (x + size, y + size, z + size);
    [[x, y, z], [a, y, z], [a, b, z], [x, b, z], [x, y, c], [a, y, c], [a, b, c], [x, b, c]]
}

impl Cells {
    fn at(&mut self, place: [i64; 3]) -> u32 {
        let next = self.points.len() as u32;
        *self.known.entry(place).or_insert_with(|| {
            self.points.push(place.map(|x| x as f64 * 0.25));
            next
        })
    }

    fn hexahedron(&mut self, first: [i64; 3], size: i64) {
        let points = corners(first, size).map(|corner| self.at(corner));
        self.cells.push(Cell::Hexahedron(points));
    }

    /// A box as a polyhedron, of which every face has the points that others put in the middle of its edges and of itself.
    fn polyhedron(&mut self, first: [i64; 3], size: i64) {
        let corners = corners(first, size);
        let mut faces = Vec::new();
        for quad in QUADS.map(|quad| quad.map(|corner| corners[corner])) {
            let between = |a: [i64; 3], b: [i64; 3]| [0, 1, 2].map(|i| (a[i] + b[i]) / 2);
            let middles: Vec<[i64; 3]> = (0..4).map(|i| between(quad[i], quad[(i + 1) % 4])).collect();
            let center = between(quad[0], quad[2]);
            let is_there = |place: &[i64; 3]| size > 1 && self.known.contains_key(place);
            if is_there(&center) {
                for i in 0..4 {
                    faces.push(vec![quad[i], middles[i], center, middles[(i + 3) % 4]]);
                }
            } else {
                let with_middle = |i: usize| {
                    let middle = is_there(&middles[i]).then_some(middles[i]);
                    std::iter::once(quad[i]).chain(middle)
                };
                faces.push((0..4).flat_map(with_middle).collect());
            }
        }
        let faces = faces.into_iter().map(|face| face.into_iter().map(|place| self.at(place)).collect());
        let faces = faces.collect();
        self.cells.push(Cell::Faces(faces));
    }

    fn fields(&self) -> [Vec<f64>; 2] {
        let at_points = self.points.iter().map(|[x, y, z]| 1.0 + 2.0 * x - 4.0 * y + 0.5 * z).collect();
        [at_points, (0..self.cells.len()).map(|cell| cell as f64).collect()]
    }

    /// The points of a cell as VTK lists them.
    fn points_of(cell: &Cell) -> Vec<f64> {
        let mut points = match cell {
            Cell::Hexahedron(points) => return points.iter().map(|p| f64::from(*p)).collect(),
            Cell::Faces(faces) => faces.concat(),
        };
        points.sort_unstable();
        points.dedup();
        points.into_iter().map(f64::from).collect()
    }

    /// How many faces a polyhedron has, and of each how many points, and these.
    fn stream(cell: &Cell) -> Vec<f64> {
        let Cell::Faces(faces) = cell else { return Vec::new() };
        let of_face = |face: &Vec<u32>| {
            std::iter::once(face.len() as f64).chain(face.iter().map(|p| f64::from(*p))).collect::<Vec<_>>()
        };
        std::iter::once(faces.len() as f64).chain(faces.iter().flat_map(of_face)).collect()
    }

    fn kinds(&self) -> Vec<f64> {
        self.cells.iter().map(|cell| if matches!(cell, Cell::Faces(_)) { 42.0 } else { 12.0 }).collect()
    }

    fn vtu(&self, style: Style, layout: Layout) -> Vec<u8> {
        let lists: Vec<Vec<f64>> = self.cells.iter().map(Self::points_of).collect();
        let streams: Vec<Vec<f64>> = self.cells.iter().map(Self::stream).collect();
        let [at_points, at_cells] = self.fields();
        let mut arrays = vec![
            Array::new("PointData", "p", "Float64", 1, &at_points),
            Array::new("CellData", "m", "Float64", 1, &at_cells),
            Array::new("Points", "Points", "Float64", 3, self.points.as_flattened()),
            Array::new("Cells", "connectivity", "Int32", 1, &lists.concat()),
            Array::new("Cells", "offsets", "Int64", 1, &ends(lists.iter().map(Vec::len))),
            Array::new("Cells", "types", "UInt8", 1, &self.kinds()),
        ];
        let faces = self
            .cells
            .iter()
            .flat_map(|cell| if let Cell::Faces(faces) = cell { faces.clone() } else { Vec::new() });
        let faces: Vec<Vec<u32>> = faces.collect();
        if layout == Layout::Old {
            let mut of_cells = ends(streams.iter().map(Vec::len));
            of_cells
                .iter_mut()
                .zip(&streams)
                .filter(|(_, stream)| stream.is_empty())
                .for_each(|(end, _)| *end = -1.0);
            arrays.push(Array::new("Cells", "faces", "Int64", 1, &streams.concat()));
            arrays.push(Array::new("Cells", "faceoffsets", "Int64", 1, &of_cells));
        } else {
            let points: Vec<f64> = faces.concat().into_iter().map(f64::from).collect();
            let numbers: Vec<f64> = (0..faces.len()).map(|face| face as f64).collect();
            let counts = streams.iter().map(|stream| stream.first().map_or(0, |count| *count as usize));
            arrays.push(Array::new("Cells", "face_connectivity", "Int64", 1, &points));
            arrays.push(Array::new("Cells", "face_offsets", "Int32", 1, &ends(faces.iter().map(Vec::len))));
            arrays.push(Array::new("Cells", "polyhedron_to_faces", "Int64", 1, &numbers));
            arrays.push(Array::new("Cells", "polyhedron_offsets", "Int64", 1, &ends(counts)));
        }
        let counts =
            format!("NumberOfPoints=\"{}\" NumberOfCells=\"{}\"", self.points.len(), self.cells.len());
        xml(style, "UnstructuredGrid", "", &[(counts, arrays)])
    }

    fn vtk(&self, version: &str, binary: bool) -> Vec<u8> {
        let lists: Vec<Vec<f64>> = self
            .cells
            .iter()
            .map(
                |cell| {
                    if matches!(cell, Cell::Faces(_)) { Self::stream(cell) } else { Self::points_of(cell) }
                },
            )
            .collect();
        let [at_points, at_cells] = self.fields();
        legacy_vtk(version, binary, &self.points, &lists, &self.kinds(), &at_points, &at_cells)
    }

    fn read(&self) -> Result<TetMesh, ReadError> {
        io::read_bytes_with("a.vtu", &self.vtu(Style::PLAIN, Layout::New), &everything())
    }
}

fn ends(lengths: impl Iterator<Item = usize>) -> Vec<f64> {
    let mut end = 0;
    lengths
        .map(|length| {
            end += length;
            end as f64
        })
        .collect()
}

fn everything() -> ReadOptions {
    ReadOptions { cells: CellData::Values, ..ReadOptions::default() }
}

/// Boxes of two sizes: polyhedra with points in the middle of edges and faces, and hexahedra.
fn octree() -> Cells {
    let mut cells = Cells::default();
    for (x, y, z) in [(8, 0, 0), (8, 2, 0), (8, 0, 2), (10, 0, 0), (10, 2, 0), (10, 0, 2), (10, 2, 2)] {
        cells.hexahedron([x, y, z], 2);
    }
    cells.polyhedron([8, 2, 2], 2);
    cells.polyhedron([4, 0, 0], 4);
    cells.polyhedron([4, 0, 4], 4);
    cells.hexahedron([0, 0, 0], 4);
    cells.polyhedron([8, 0, 4], 4);
    cells
}

/// Files of each format, and what they hold.
pub fn files() -> Vec<(String, Vec<u8>, TetMesh)> {
    let mut cells = octree();
    cells.cells.drain(..5);
    cells.cells.truncate(4);
    // No beginning of the last type is one that goes with the points of the last cell.
    cells.cells.rotate_left(2);
    let whole = io::read_bytes("a.vtu", &cells.vtu(Style::PLAIN, Layout::New)).unwrap();
    let packed = Style { format: Format::AppendedRaw, compressor: "ZLib", ..Style::PLAIN };
    vec![
        ("old polyhedra.vtu".into(), cells.vtu(Style::PLAIN, Layout::Old), whole.clone()),
        ("new polyhedra.vtu".into(), cells.vtu(packed, Layout::New), whole.clone()),
        ("polyhedra 3.0.vtk".into(), cells.vtk("3.0", true), whole.clone()),
        ("polyhedra 5.1.vtk".into(), cells.vtk("5.1", false), whole),
    ]
}

/// The volume of each tetrahedron.
fn volumes(mesh: &TetMesh) -> Vec<f64> {
    let of = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| mesh.positions[v as usize]);
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
        let cross = [v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0]];
        (0..3).map(|i| u[i] * cross[i]).sum::<f64>() / 6.0
    };
    mesh.tets.iter().map(of).collect()
}

/// The volume of each cell, by its number in the field at cells.
fn cell_volumes(mesh: &TetMesh) -> Vec<f64> {
    let mut sums = Vec::new();
    for (&cell, volume) in mesh.cell_fields[0].values.iter().zip(volumes(mesh)) {
        sums.resize(sums.len().max(cell as usize + 1), 0.0);
        sums[cell as usize] += volume;
    }
    sums
}

fn assert_near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
}

/// Asserts that a mesh is valid as it is, in one part, and without seams where neighbours were cut in different ways.
fn assert_conforming(mesh: TetMesh, what: &str) -> TetMesh {
    assert!(volumes(&mesh).iter().all(|volume| *volume > 0.0), "{what}");
    let (mesh, report) = mesh::repair(mesh).unwrap_or_else(|e| panic!("{what}: {e}"));
    assert_eq!(report.to_string(), "", "{what}");
    let found = mesh::findings(&mesh, 0.0).unwrap();
    assert_eq!((found.components, found.open_seam_faces), (1, 0), "{what}");
    mesh
}

#[test]
fn polyhedra_are_split_alike_in_every_format() {
    let cells = octree();
    let mesh = cells.read().unwrap();
    let [at_points, _] = cells.fields();
    assert_eq!(mesh.fields[0].values[..at_points.len()], at_points);
    let layouts = [Layout::Old, Layout::New].into_iter();
    let files = layouts.flat_map(|layout| Style::all().into_iter().map(move |style| (style, layout)));
    for (style, layout) in files {
        let found = io::read_bytes_with("a.vtu", &cells.vtu(style, layout), &everything()).unwrap();
        assert_eq!(found, mesh, "{style:?} {layout:?}");
    }
    for (version, binary) in [("3.0", true), ("4.2", false), ("5.1", true), ("5.1", false)] {
        let found = io::read_bytes_with("a.vtk", &cells.vtk(version, binary), &everything()).unwrap();
        assert_eq!(found, mesh, "{version} {binary}");
    }
}

#[test]
fn neighbours_meet_and_every_cell_is_filled() {
    let cells = octree();
    let mesh = cells.read().unwrap();
    let eighth = 0.125;
    let expected = [vec![eighth; 8], vec![1.0; 4]].concat();
    assert_near(&cell_volumes(&mesh), &expected);
    let added = mesh.positions.len() - cells.points.len();
    assert_eq!(
        mesh.notes,
        [format!(
            "added: {added} points in the middle of cells and faces, with the mean of the values at their corners (first: cell 8 (polyhedron))"
        )]
    );
    // A linear field stays what it is.
    for ([x, y, z], value) in mesh.positions.iter().zip(&mesh.fields[0].values) {
        assert!((1.0 + 2.0 * x - 4.0 * y + 0.5 * z - value).abs() < 1e-14);
    }
    assert_conforming(mesh, "boxes");
}

#[test]
fn a_point_that_is_added_has_the_value_of_its_cell() {
    let mut mesh = octree().read().unwrap();
    let points = octree().points.len();
    mesh.cells_to_points();
    let means = &mesh.fields[1].values;
    // Points are added in the polyhedra of the larger size, in their order.
    assert!(means[points..].iter().all(|mean| [8.0, 9.0, 11.0].contains(mean)), "{:?}", &means[points..]);
    // The corner at the origin is one of cell 10 alone.
    let origin = mesh.positions.iter().position(|p| *p == [0.0; 3]).unwrap();
    assert_eq!(means[origin], 10.0);
}

#[test]
fn faces_may_be_listed_in_any_order_and_direction() {
    let straight = octree().read().unwrap();
    for turn in 0..4 {
        let mut cells = octree();
        let mut seed = turn;
        for cell in &mut cells.cells {
            let Cell::Faces(faces) = cell else { continue };
            faces.rotate_left(turn + 1);
            for face in faces {
                seed = (seed * 5 + 3) % 16;
                face.rotate_left(seed % 4);
                if seed % 3 == 0 {
                    face.reverse();
                }
            }
        }
        let mesh = cells.read().unwrap();
        assert_near(&cell_volumes(&mesh), &cell_volumes(&straight));
        assert_conforming(mesh, &format!("turned {turn}"));
    }
}

/// A grid of cells whose inner points are moved by up to `by` of the distance between them; every second one is a polyhedron.
fn bent(n: i64, by: f64, seed: u64) -> Cells {
    let mut cells = Cells::default();
    let mut number = 0;
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                number += 1;
                let first = [4 * x, 4 * y, 4 * z];
                if number % 3 == 0 { cells.hexahedron(first, 4) } else { cells.polyhedron(first, 4) }
            }
        }
    }
    let mut state = seed;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    };
    for point in &mut cells.points {
        if point.iter().all(|x| *x > 0.0 && *x < n as f64) {
            *point = point.map(|x| x + 2.0 * by * random());
        }
    }
    cells
}

#[test]
fn bent_faces_are_cut_alike_from_both_sides() {
    let mut in_faces = 0;
    for (seed, by) in (0..8).flat_map(|seed| [0.02, 0.2, 0.4, 0.6].map(|by| (seed, by))) {
        let cells = bent(4, by, seed);
        let what = format!("{seed} {by}");
        let mesh = match cells.read() {
            Ok(mesh) => mesh,
            // Not every cell can be split that is bent so much.
            Err(error) if by > 0.5 => {
                assert!(matches!(error.reason, ReadReason::Polyhedron { .. }), "{error}");
                continue;
            }
            Err(error) => panic!("{what}: {error}"),
        };
        assert!((volumes(&mesh).iter().sum::<f64>() - 64.0).abs() < 1e-11, "{what}");
        // The first cell of each point that was added, and whether it is one of another, too.
        let mut of_points = HashMap::new();
        for (tet, &cell) in mesh.tets.iter().zip(&mesh.cell_fields[0].values) {
            for point in tet.iter().filter(|point| **point as usize >= cells.points.len()) {
                let (first, is_shared) = of_points.entry(*point).or_insert((cell, false));
                *is_shared |= *first != cell;
            }
        }
        in_faces += of_points.values().filter(|(_, is_shared)| *is_shared).count();
        assert_conforming(mesh, &what);
    }
    assert!(in_faces > 0);
}

#[test]
fn concave_cells_are_filled() {
    // Over an L, over an arrow that is seen from one corner alone, and over a star.
    let star: Vec<[f64; 2]> = (0..10)
        .map(|i| {
            let (angle, radius) =
                (f64::from(i) * std::f64::consts::PI / 5.0, if i % 2 == 0 { 2.0 } else { 0.8 });
            [radius * angle.cos(), radius * angle.sin()]
        })
        .collect();
    let l = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let arrow = vec![[0.0, 0.0], [2.0, 2.0], [0.0, 1.0], [-2.0, 2.0]];
    for (name, outline) in [("L", l), ("arrow", arrow), ("star", star)] {
        let n = outline.len() as u32;
        let area: f64 = (0..n as usize)
            .map(|i| {
                let ([a, b], [c, d]) = (outline[i], outline[(i + 1) % n as usize]);
                0.5 * (a * d - b * c)
            })
            .sum();
        // The numbers of points must not matter.
        for first in 0..n {
            let number = |i: u32, top: bool| (i + first) % n + if top { n } else { 0 };
            let mut cells = Cells { points: vec![[0.0; 3]; 2 * n as usize], ..Cells::default() };
            for i in 0..n {
                let [x, y] = outline[i as usize];
                cells.points[number(i, false) as usize] = [x, y, 0.0];
                cells.points[number(i, true) as usize] = [x, y, 1.5];
            }
            let side =
                |i: u32| vec![number(i, false), number(i + 1, false), number(i + 1, true), number(i, true)];
            let mut faces: Vec<Vec<u32>> = (0..n).map(side).collect();
            faces.push((0..n).map(|i| number(i, false)).collect());
            faces.push((0..n).map(|i| number(i, true)).collect());
            cells.cells.push(Cell::Faces(faces));
            let mesh = cells.read().unwrap_or_else(|e| panic!("{name} {first}: {e}"));
            assert!((volumes(&mesh).iter().sum::<f64>() - 1.5 * area).abs() < 1e-12, "{name} {first}");
            assert_conforming(mesh, name);
        }
    }
}

#[test]
fn what_is_no_cell_is_refused_by_its_number() {
    let refused = |change: Change<'_>| {
        let mut cells = Cells::default();
        cells.hexahedron([0, 0, 0], 4);
        cells.polyhedron([4, 0, 0], 4);
        // No cell has these.
        cells.points.extend([[9.0, 9.0, 9.0]; 4]);
        let Cells { points, cells: list, .. } = &mut cells;
        let Cell::Faces(faces) = &mut list[1] else { unreachable!() };
        change(faces, points);
        let error = cells.read().unwrap_err();
        let code = tetralod::Coded::code(&error);
        let text = error.to_string();
        assert!(text.contains("cell 1"), "{text}");
        (code, text)
    };
    let bad = |change: Change<'_>, words: &str| {
        let (code, text) = refused(change);
        assert!(code == "bad-mesh" && text.contains(words), "{code}: {text}");
    };
    bad(&|faces, _| faces.truncate(3), "it has 3 faces");
    bad(&|faces, _| drop(faces.pop()), "is one of 1 face, not of two");
    bad(&|faces, _| faces.push(faces[0].clone()), "is one of 3 faces, not of two");
    bad(&|faces, _| faces[2].truncate(2), "its face 2 has 2 points");
    bad(&|faces, _| faces[2].clear(), "its face 2 has 0 points");
    bad(&|faces, _| faces[4][1] = faces[4][0], "its face 4 has point");
    bad(&|_, points| points.iter_mut().for_each(|p| p[2] = 0.0), "has no area");
    // Each face has an area, and the cell no inside.
    bad(
        &|_, points| points.iter_mut().for_each(|p| *p = [p[0] + 0.5 * p[2], p[1] + 0.25 * p[2], 0.0]),
        "no volume",
    );
    // A box beside it in the same cell, and one that it touches in a corner.
    let second = |points: [u32; 8]| QUADS.map(|quad| quad.map(|corner| points[corner]).to_vec());
    bad(
        &|faces, _| {
            *faces = [second([0, 3, 7, 4, 1, 2, 6, 5]), second([8, 9, 10, 11, 12, 13, 14, 15])].concat()
        },
        "not one closed surface",
    );
    let (code, text) = refused(&|faces, _| faces[3][2] = 99);
    assert!(code == "corrupt" && text.contains("refers to point 99"), "{text}");
}

#[test]
fn lists_of_faces_that_lie_are_refused() {
    let file = |layout| String::from_utf8(octree().vtu(Style::PLAIN, layout)).unwrap();
    let array = |file: &str, name: &str, change: &dyn Fn(&mut Vec<i64>)| {
        let start = file.find(&format!("Name=\"{name}\"")).unwrap();
        let start = start + file[start..].find('>').unwrap() + 1;
        let end = start + file[start..].find('<').unwrap();
        let mut numbers: Vec<i64> = file[start..end].split_whitespace().map(|n| n.parse().unwrap()).collect();
        change(&mut numbers);
        let text: Vec<String> = numbers.iter().map(i64::to_string).collect();
        let changed = format!("{}{}{}", &file[..start], text.join(" "), &file[end..]);
        io::read_bytes("a.vtu", changed.as_bytes()).unwrap_err()
    };
    let [old, new] = [Layout::Old, Layout::New].map(file);
    for huge in [7, -1, i64::MAX, i64::MIN] {
        for (file, name, at) in [
            (&old, "faces", 0),
            (&old, "faces", 1),
            (&old, "faces", 2),
            (&old, "faceoffsets", 7),
            (&new, "face_connectivity", 0),
            (&new, "face_offsets", 0),
            (&new, "polyhedron_to_faces", 1),
            (&new, "polyhedron_offsets", 7),
        ] {
            // Where 7 is right, or harmless, another one is not.
            let number = if huge == 7 { 1_000_000 } else { huge };
            let error = array(file, name, &|numbers| numbers[at] = number);
            assert!(
                matches!(
                    error.reason,
                    ReadReason::Missing(_)
                        | ReadReason::Syntax(_)
                        | ReadReason::MissingPoint { .. }
                        | ReadReason::Polyhedron { .. }
                ),
                "{name} {number}: {error}"
            );
        }
    }
    // Few numbers must not stand for many.
    let error = array(&new, "polyhedron_to_faces", &|numbers| numbers.fill(0));
    assert!(error.to_string().contains("face 0 is one of more than two cells"), "{error}");
    let without = new.replace("polyhedron_to_faces", "polyhedra");
    let error = io::read_bytes("a.vtu", without.as_bytes()).unwrap_err();
    assert!(error.to_string().contains("array \"faces\" of <Cells> is missing"), "{error}");
}

#[test]
fn a_survey_knows_how_much_they_become() {
    let mesh = octree().read().unwrap();
    let old = octree().vtu(Style::PLAIN, Layout::Old);
    let files = [("a.vtu", old), ("a.vtk", octree().vtk("3.0", true)), ("a.vtk", octree().vtk("5.1", false))];
    for (name, file) in files {
        let survey = io::survey(name, &file).unwrap();
        let most = mesh.tets.len() as u64;
        assert!((most..2 * most).contains(&survey.cells), "{name}: {} of {most}", survey.cells);
        let limited = ReadOptions { memory: io::MemoryLimit::of(20 * survey.cells), ..everything() };
        assert!(matches!(
            io::read_bytes_with(name, &file, &limited),
            Err(ReadError { reason: ReadReason::Memory { .. }, .. })
        ));
    }
}

#[test]
fn hidden_and_ghost_cells_are_left_out() {
    let mut file = String::from_utf8(octree().vtu(Style::PLAIN, Layout::Old)).unwrap();
    let flags: Vec<&str> = (0..12).map(|cell| if cell == 8 { "32" } else { "0" }).collect();
    let array = format!(
        "<CellData><DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">{}</DataArray>",
        flags.join(" ")
    );
    file = file.replacen("<CellData>", &array, 1);
    let mesh = io::read_bytes_with("a.vtu", file.as_bytes(), &everything()).unwrap();
    assert!(!mesh.cell_fields[0].values.contains(&8.0));
    assert_eq!(mesh.notes[0], "left out: 1 hidden cell");
}

#[test]
#[cfg(not(target_arch = "wasm32"))]
fn pieces_with_polyhedra_meet() {
    let folder = std::env::temp_dir().join(format!("tetralod-polyhedra-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (cells, by) in [(octree(), 0.0), (bent(3, 0.2, 5), 0.2)] {
        // Each second cell is in another piece, so that pieces meet in faces of all kinds.
        for part in 0..2 {
            let kept = |(number, cell): (usize, &Cell)| (number % 2 == part).then(|| cell.clone());
            let own =
                Cells { cells: cells.cells.iter().enumerate().filter_map(kept).collect(), ..cells.clone() };
            std::fs::write(folder.join(format!("{part}.vtu")), own.vtu(Style::PLAIN, Layout::New)).unwrap();
        }
        let list = "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid GhostLevel=\"0\"><Piece Source=\"0.vtu\"/>\
                    <Piece Source=\"1.vtu\"/></PUnstructuredGrid></VTKFile>";
        let path = folder.join("a.pvtu");
        std::fs::write(&path, list).unwrap();
        let mesh = io::read_with(&path, &everything()).unwrap();
        let whole: f64 = volumes(&mesh).iter().sum();
        assert!((whole - if by == 0.0 { 5.0 } else { 27.0 }).abs() < 1e-12, "{whole}");
        // One piece at a time is the same.
        let pieces = io::Pieces::open(&path, &everything()).unwrap().unwrap();
        let (mut points, mut tets) = (0, Vec::new());
        pieces
            .for_each::<ReadError>(&mut |piece| {
                assert_eq!(piece.points.len(), piece.mesh.positions.len());
                points = piece.points.iter().max().map_or(points, |most| points.max(most + 1));
                tets.extend(piece.mesh.tets.iter().map(|tet| tet.map(|v| piece.points[v as usize])));
                Ok(())
            })
            .unwrap();
        assert_eq!((points as usize, &tets), (mesh.positions.len(), &mesh.tets), "{by}");
        assert_conforming(mesh, &format!("pieces {by}"));
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn whole_numbers_stay_whole_where_no_point_is_added() {
    let cells = bent(2, 0.0, 0);
    let file = String::from_utf8(cells.vtu(Style::PLAIN, Layout::New)).unwrap();
    let file = file.replace("type=\"Float64\" Name=\"p\"", "type=\"Int64\" Name=\"p\"");
    let values = file.find("Name=\"p\"").unwrap();
    let start = values + file[values..].find('>').unwrap() + 1;
    let end = start + file[start..].find('<').unwrap();
    let whole: Vec<String> = (0..cells.points.len()).map(|p| (p * p % 7).to_string()).collect();
    let mesh =
        io::read_bytes("a.vtu", format!("{}{}{}", &file[..start], whole.join(" "), &file[end..]).as_bytes())
            .unwrap();
    assert!(mesh.fields[0].integer && mesh.positions.len() == cells.points.len());
}
