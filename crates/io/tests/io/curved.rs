//! Promise: cells of the second order that are valid but fold as straight tetrahedra are read, conforming, with what was moved said.

use std::collections::BTreeMap;

use crate::data::real_data;
use glam::DVec3;
use tetralod::mesh;
use tetralod::mesh::TetMesh;
use tetralod_io as io;

/// Where the points of a cell are: in a straight cell, in units of half a side.
pub type Cell = (u8, &'static [[u8; 3]]);

pub const HEXAHEDRON: Cell = (
    25,
    &[
        [0, 0, 0],
        [2, 0, 0],
        [2, 2, 0],
        [0, 2, 0],
        [0, 0, 2],
        [2, 0, 2],
        [2, 2, 2],
        [0, 2, 2],
        [1, 0, 0],
        [2, 1, 0],
        [1, 2, 0],
        [0, 1, 0],
        [1, 0, 2],
        [2, 1, 2],
        [1, 2, 2],
        [0, 1, 2],
        [0, 0, 1],
        [2, 0, 1],
        [2, 2, 1],
        [0, 2, 1],
    ],
);

/// The type of other cells, corners in a wall, and edges.
type Corners = (u8, &'static [[f64; 3]], &'static [[usize; 2]]);

/// VTK's Jacobians of these are positive at every thickness; a chord between two sides of the triangle passes under the third.
const WEDGE: Corners = (
    26,
    &[[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.5, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.5, 1.0]],
    &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
);
const PYRAMID: Corners = (
    27,
    &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 1.0]],
    &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
);
const TETRAHEDRON: Corners = (
    24,
    &[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.3, 0.3]],
    &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
);

/// A place in the wall of a pipe of radius 1: how far through it, along its turn, and along the pipe.
fn bent([through, around, along]: [f64; 3], thickness: f64, turn: f64) -> [f64; 3] {
    let (radius, angle) = (1.0 + thickness * through, turn * around);
    [radius * angle.cos(), radius * angle.sin(), along]
}

/// A part of a pipe in hexahedra of 20 points: so many through the wall and around.
struct Pipe {
    points: Vec<[f64; 3]>,
    cells: Vec<Vec<usize>>,
}

fn pipe(walls: &[f64], around: usize, turn: f64) -> Pipe {
    let mut numbers = BTreeMap::new();
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    for (i, j) in (0..walls.len() - 1).flat_map(|i| (0..around).map(move |j| (i, j))) {
        let mut cell = Vec::new();
        for [x, y, z] in HEXAHEDRON.1.iter().map(|at| at.map(usize::from)) {
            let at = [2 * i + x, 2 * j + y, z];
            let (low, high) = (walls[i], walls[i + 1]);
            let place =
                bent([low + (high - low) * x as f64 / 2.0, at[1] as f64 / 2.0, z as f64 / 2.0], 1.0, turn);
            cell.push(*numbers.entry(at).or_insert_with(|| {
                points.push(place);
                points.len() - 1
            }));
        }
        cells.push(cell);
    }
    Pipe { points, cells }
}

fn list<T: ToString>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|value| value.to_string()).collect::<Vec<_>>().join(" ")
}

/// A piece of an unstructured grid, with the number of each point as a field `n`.
fn piece(points: &[[f64; 3]], cells: &[(u8, &[usize])]) -> String {
    let mut end = 0;
    let ends = cells.iter().map(|(_, points)| {
        end += points.len();
        end
    });
    let array = |name: &str, kind: &str, components: usize, values: &str| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">{values}</DataArray>"
        )
    };
    format!(
        "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\"><PointData>{}</PointData><Points>{}</Points><Cells>{}{}{}</Cells></Piece>",
        points.len(),
        cells.len(),
        array("n", "Float64", 1, &list(0..points.len())),
        array("Points", "Float64", 3, &list(points.iter().flatten())),
        array("connectivity", "Int64", 1, &list(cells.iter().flat_map(|(_, points)| points.iter()))),
        array("offsets", "Int64", 1, &list(ends)),
        array("types", "UInt8", 1, &list(cells.iter().map(|(kind, _)| kind))),
    )
}

fn read(pieces: &str) -> TetMesh {
    let kind = "UnstructuredGrid";
    let file = format!(
        "<VTKFile type=\"{kind}\" version=\"2.2\" byte_order=\"LittleEndian\"><{kind}>{pieces}</{kind}></VTKFile>"
    );
    io::read_bytes("a.vtu", file.as_bytes()).unwrap_or_else(|error| panic!("{error}"))
}

fn read_pipe(pipe: &Pipe) -> TetMesh {
    let cells: Vec<(u8, &[usize])> = pipe.cells.iter().map(|cell| (25, cell.as_slice())).collect();
    read(&piece(&pipe.points, &cells))
}

/// The volume of a mesh in one part that is valid as it is, and how many faces its boundary has.
fn checked(mesh: &TetMesh) -> (f64, usize) {
    let (mended, report) = mesh::repair(mesh.clone()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.to_string(), "");
    let topology = mesh::topology(mended.positions.len(), &mended.tets).unwrap();
    assert_eq!(topology.components, 1);
    (volume(&mended), topology.boundary_faces)
}

fn volume(mesh: &TetMesh) -> f64 {
    let volume = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| DVec3::from_array(mesh.positions[v as usize]));
        (b - a).cross(c - a).dot(d - a) / 6.0
    };
    mesh.tets.iter().map(volume).sum()
}

/// The place of parameters from -1 to 1 in a curved hexahedron of 20 points.
fn curved(points: &[[f64; 3]], cell: &[usize], at: [f64; 3]) -> DVec3 {
    let weight = |corner: &[u8; 3]| {
        let to = corner.map(|x| f64::from(x) - 1.0);
        let sides: f64 =
            (0..3).map(|i| if to[i] == 0.0 { 1.0 - at[i] * at[i] } else { 1.0 + at[i] * to[i] }).product();
        let is_corner = !to.contains(&0.0);
        if is_corner { sides / 8.0 * ((0..3).map(|i| at[i] * to[i]).sum::<f64>() - 2.0) } else { sides / 4.0 }
    };
    HEXAHEDRON.1.iter().zip(cell).map(|(corner, &p)| weight(corner) * DVec3::from_array(points[p])).sum()
}

/// The volume of curved hexahedra, by sums over 12 steps each way. Every Jacobian must be positive.
fn volume_of_curved(pipe: &Pipe) -> f64 {
    const STEPS: usize = 12;
    let mut volume = 0.0;
    for (cell, i) in pipe.cells.iter().flat_map(|cell| (0..STEPS * STEPS * STEPS).map(move |i| (cell, i))) {
        let at = [i % STEPS, i / STEPS % STEPS, i / STEPS / STEPS]
            .map(|i| (2 * i + 1) as f64 / STEPS as f64 - 1.0);
        // Along one parameter the map is a parabola, of which such a difference is the slope.
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let moved = |by: f64| {
                let mut at = at;
                at[axis] += by;
                curved(&pipe.points, cell, at)
            };
            (moved(0.5) - moved(-0.5)) * 2.0 / STEPS as f64
        });
        let part = x.cross(y).dot(z);
        assert!(part > 0.0, "{at:?}");
        volume += part;
    }
    volume
}

#[test]
fn thin_bent_hexahedra_are_read_on_their_chords() {
    let turn = 40_f64.to_radians();
    // On chords the cross-section has the sine of the angle where it had the angle.
    let lost = turn.sin() / turn;
    for around in [1, 2, 8] {
        let pipe = pipe(&[0.0, 0.01], around, turn);
        let found = read_pipe(&pipe);
        let (volume, faces) = checked(&found);
        let curved = volume_of_curved(&pipe);
        assert!((volume / curved - lost).abs() < 0.002, "{around}: {volume} {curved}");
        // No face inside is open: a face of 8 points has 6 triangles.
        assert_eq!(faces, 6 * (4 * around + 2), "{around}");
        assert_eq!(found.fields[0].values, (0..pipe.points.len()).map(|n| n as f64).collect::<Vec<_>>());
        let cells = if around == 1 { "1 cell".into() } else { format!("{around} cells") };
        let [note] = found.notes.as_slice() else { panic!("{:?}", found.notes) };
        assert!(note.contains(&cells) && note.contains(&format!("{} points", 4 * around)), "{note}");
        let farthest: f64 =
            note.split("at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        let sagitta = 1.01 * (1.0 - (turn / 2.0).cos());
        assert!((1.0..1.011).contains(&(farthest / sagitta)), "{note}");
        assert!(note.ends_with("(quadratic hexahedron))"), "{note}");
    }
}

#[test]
fn cells_that_do_not_fold_stay_curved() {
    let turn = 40_f64.to_radians();
    let thick = pipe(&[0.0, 0.5], 2, turn);
    let found = read_pipe(&thick);
    assert!(found.notes.is_empty() && found.positions == thick.points);
    // Inside, a thin wall; the thick one beside it keeps its other side.
    let both = pipe(&[0.0, 0.01, 0.5], 2, turn);
    let found = read_pipe(&both);
    let (volume, faces) = checked(&found);
    assert!(found.notes[0].starts_with("2 cells "), "{:?}", found.notes);
    let is_outer = |place: &[f64; 3]| place[0].hypot(place[1]) > 1.499;
    let outer = |places: &[[f64; 3]]| places.iter().copied().filter(is_outer).collect::<Vec<_>>();
    assert_eq!(outer(&found.positions), outer(&both.points));
    assert_eq!(faces, 6 * 2 * (2 + 2 * 2 + 2));
    let chords = turn.sin() / turn;
    let curved = volume_of_curved(&both);
    assert!(volume / curved > chords && volume / curved < 1.2, "{volume} {curved}");
}

#[test]
fn pieces_with_points_of_their_own_still_meet() {
    // The thin cell and the thick one in two pieces: level `weld` closes the seam only where both have the same points.
    let turn = 40_f64.to_radians();
    let pieces: String = [[0.0, 0.01], [0.01, 0.5]]
        .iter()
        .map(|walls| {
            let part = pipe(walls, 2, turn);
            let cells: Vec<(u8, &[usize])> = part.cells.iter().map(|cell| (25, cell.as_slice())).collect();
            piece(&part.points, &cells)
        })
        .collect();
    let apart = read(&pieces);
    let whole = read_pipe(&pipe(&[0.0, 0.01, 0.5], 2, turn));
    let sorted = |mesh: &TetMesh| {
        let mut places = mesh.positions.iter().map(|place| place.map(f64::to_bits)).collect::<Vec<_>>();
        places.sort_unstable();
        places.dedup();
        places
    };
    assert_eq!(sorted(&apart), sorted(&whole));
}

/// One cell of a type in a thin wall.
fn in_wall((kind, corners, edges): Corners, thickness: f64, turn: f64) -> TetMesh {
    let middles = edges.iter().map(|[a, b]| [0, 1, 2].map(|i| (corners[*a][i] + corners[*b][i]) / 2.0));
    let points: Vec<[f64; 3]> =
        corners.iter().copied().chain(middles).map(|place| bent(place, thickness, turn)).collect();
    let all: Vec<usize> = (0..points.len()).collect();
    read(&piece(&points, &[(kind, &all)]))
}

#[test]
fn cells_of_every_type_of_the_second_order_are_straightened() {
    for (cell, name, part) in [
        (WEDGE, "quadratic wedge", 0.5),
        (PYRAMID, "quadratic pyramid", 1.0 / 3.0),
        (TETRAHEDRON, "quadratic tetrahedron", 1.0 / 6.0),
    ] {
        let (thickness, turn) = (0.004, 0.6_f64);
        let found = in_wall(cell, thickness, turn);
        let (volume, _) = checked(&found);
        let [note] = found.notes.as_slice() else { panic!("{name}: {:?}", found.notes) };
        assert!(note.starts_with("1 cell ") && note.contains(name), "{note}");
        // The cell in a flat wall: on chords the turn is a little shorter, and a corner above the middle further up.
        let flat = part * thickness * turn;
        assert!(volume > 0.9 * flat, "{name}: {volume} {flat}");
        assert!(in_wall(cell, 0.5, turn).notes.is_empty(), "{name}");
    }
}

#[test]
fn cells_that_are_folded_on_their_chords_too_are_refused_by_number_and_type() {
    let mut pipe = pipe(&[0.0, 0.01], 3, 40_f64.to_radians());
    // The inner corner of the cells 1 and 2 beyond the outer one.
    pipe.points[pipe.cells[1][3]] = bent([0.5, 2.0, 0.0], 1.0, 40_f64.to_radians());
    let found = read_pipe(&pipe);
    let error = mesh::repair(found).unwrap_err().to_string();
    assert!(
        error.contains("1 (quadratic hexahedron)") || error.contains("2 (quadratic hexahedron)"),
        "{error}"
    );
}

#[test]
fn cells_with_points_in_another_order_are_refused() {
    // Across the wall, and the upright edges before those of the second side, as other programs have them.
    let turn = 40_f64.to_radians();
    let swaps: [&[[usize; 2]]; 3] = [&[[9, 11]], &[[18, 19]], &[[12, 16], [13, 17], [14, 18], [15, 19]]];
    for (swaps, thickness) in swaps.iter().flat_map(|swaps| [0.01, 0.5].map(|thickness| (swaps, thickness))) {
        let mut pipe = pipe(&[0.0, thickness], 1, turn);
        swaps.iter().for_each(|[a, b]| pipe.cells[0].swap(*a, *b));
        let error = mesh::repair(read_pipe(&pipe)).unwrap_err().to_string();
        assert!(error.contains("cell 0 (quadratic hexahedron) is folded"), "{swaps:?}: {error}");
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn a_pipe_of_real_use_is_read() {
    let data = real_data();
    let found = io::read(&data.join("field/hex20_pipe.vtu")).unwrap();
    let (mended, _) = mesh::repair(found.clone()).unwrap_or_else(|error| panic!("{error}"));
    let volume = volume(&mended);
    // The curved cells, of 60 degrees each, have 0.0061426 by Gauss's rule with VTK's Jacobians; on chords an angle becomes its sine.
    let angle = 60_f64.to_radians();
    assert!((volume / 0.006_142_6 - angle.sin() / angle).abs() < 0.003, "{volume}");
    assert!(found.notes[0].contains("of the second order"), "{:?}", found.notes);
}
