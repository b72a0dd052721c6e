//! Promise: a boundary that touches itself, at vertices, edges or between faces that lie on each other, is built like any other: every mesh
//! conforms and has the input's topology.

use crate::support::meshes::hilly;
use crate::support::random::Random;
use std::collections::BTreeSet;
use tetralod::mesh::{Field, Grid, TetMesh, repair, topology};
use tetralod::mt::{Mt, MtKind, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod_build::verify::{self, Reference, Sample};
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};

/// How the cells of a grid fit together.
#[derive(Clone, Copy, Debug)]
enum Diagonals {
    /// Cells have the same diagonals on their common faces.
    Glued,
    /// Each cell has diagonals of its own: on a face where they differ the mesh has two boundaries, of four triangles together.
    Own,
}

/// The tetrahedra of a cube with corners 0 to 7, one bit for each axis, around the diagonal from `from` to the opposite corner.
fn cube_tets(from: u32) -> [[u32; 4]; 6] {
    let paths = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let mut tets = paths.map(|[a, b, _]| [from, from ^ 1 << a, from ^ 1 << a ^ 1 << b, from ^ 7]);
    for (i, tet) in tets.iter_mut().enumerate() {
        if (i < 3) == (from.count_ones() % 2 == 1) {
            tet.swap(2, 3);
        }
    }
    tets
}

fn six_volumes(mesh: &TetMesh, tet: [u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|v| mesh.positions[v as usize]);
    let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

/// Steps of a lattice, all of whose points the builders can hold, to a cell: where a mesh overlaps itself, a point that they move may come
/// to lie in another part of it.
const STEPS: i32 = 1024;

/// Cells of a grid whose points are moved a little, one in `holes` of them missing, and one in `shards` tetrahedra. The most cells along an
/// axis are a power of two.
fn torn(random: &mut Random, cells: [u32; 3], diagonals: Diagonals, [holes, shards]: [usize; 2]) -> TetMesh {
    let dims = cells.map(|n| n + 1);
    let place = |i: u32, n: [u32; 3]| [i % n[0], i / n[0] % n[1], i / n[0] / n[1]];
    let point = |[x, y, z]: [u32; 3]| x + dims[0] * (y + dims[1] * z);
    let mut mesh = TetMesh::default();
    let mut values = Vec::new();
    for at in (0..dims.iter().product::<u32>()).map(|i| place(i, dims)) {
        let p = [0, 1, 2].map(|k| {
            let is_end = at[k] == 0 || at[k] == cells[k];
            f64::from(STEPS * at[k] as i32 + if is_end { 0 } else { random.between(-STEPS / 4, STEPS / 4) })
        });
        values.push(hilly([0, 1, 2].map(|k| p[k] / f64::from(STEPS * cells[k] as i32))));
        mesh.positions.push(p);
    }
    for at in (0..cells.iter().product::<u32>()).map(|i| place(i, cells)) {
        let from = match diagonals {
            Diagonals::Glued => (at[0] % 2) | ((at[1] % 2) << 1) | ((at[2] % 2) << 2),
            Diagonals::Own => random.below(8) as u32,
        };
        if random.once_in(holes) {
            continue;
        }
        for tet in cube_tets(from) {
            let tet = tet.map(|c| point([at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)]));
            if six_volumes(&mesh, tet) > 0.002 * f64::from(STEPS).powi(3) && !random.once_in(shards) {
                mesh.tets.push(tet);
            }
        }
    }
    mesh.fields.push(Field::new("f", values));
    repair(mesh).expect("positive cells").0
}

/// What is to stay: components, boundaries by their Euler number, and the places that are no manifold.
#[derive(Debug, PartialEq)]
struct Shape {
    components: usize,
    euler: i64,
    pinched: BTreeSet<[i32; 3]>,
}

fn shape(positions: &[[i32; 3]], tets: &[[u32; 4]]) -> Shape {
    let found = topology(positions.len(), tets).expect("no face is shared by three");
    let sets = |size: u32| {
        let of = |tet: &[u32; 4]| {
            let mut tet = *tet;
            tet.sort_unstable();
            let some = (0..16_u32).filter(|bits| bits.count_ones() == size).collect::<Vec<_>>();
            some.into_iter()
                .map(move |bits| (0..4).filter(|i| bits >> i & 1 == 1).map(|i| tet[i]).collect::<Vec<_>>())
        };
        tets.iter().flat_map(of).collect::<BTreeSet<Vec<u32>>>().len() as i64
    };
    let pinched = (0..positions.len()).filter(|&v| found.non_manifold[v]).map(|v| positions[v]);
    Shape {
        components: found.components,
        euler: sets(1) - sets(2) + sets(3) - tets.len() as i64,
        pinched: pinched.collect(),
    }
}

/// The shapes of the meshes within some errors.
fn shapes(mt: &Mt) -> Vec<Shape> {
    let mut front = Front::new(mt).expect("a valid base mesh");
    let mut shape_within = |error: f64| {
        let request = Request::within(error);
        front.satisfy(mt, &LodCriterion::new(mt.info(), &request), request.budget).expect("a valid MT");
        let mesh = front.mesh();
        let tets: Vec<[u32; 4]> = (0..mesh.tet_slots() as u32).filter_map(|t| mesh.tet(t)).collect();
        shape(mesh.positions(), &tets)
    };
    [0.0, 0.003, 0.02, 0.1, f64::INFINITY].into_iter().map(&mut shape_within).collect()
}

fn configs() -> Vec<(&'static str, BuildConfig)> {
    let by = |kind, method, criterion| {
        let construction = Construction::new(kind, method, criterion).expect("they go together");
        BuildConfig { construction, ..BuildConfig::of(kind) }
    };
    vec![
        ("half-edge", BuildConfig::default()),
        ("edge", BuildConfig::of(MtKind::Edge)),
        ("vertex", BuildConfig::of(MtKind::Vertex)),
        ("delaunay", by(MtKind::Vertex, Method::Decimate, BuildCriterion::Delaunay)),
    ]
}

fn keeps_its_shape(name: &str, mesh: &TetMesh, mt: &Mt) {
    let shapes = shapes(mt);
    assert!(shapes.iter().all(|shape| *shape == shapes[0]), "{name}: {shapes:?}");
    let input: Vec<[i32; 3]> = mesh.positions.iter().map(|&p| mt.info().lattice.nearest(p)).collect();
    assert_eq!(shape(&input, &mesh.tets), shapes[0], "{name}");
    let sample = Sample { requests: 6, ..Sample::default() };
    let report = verify::run_sample(mt, mesh, Reference::Mesh, sample, &mut |_, _| {});
    assert!(report.valid, "{name}: {:#?}", report.failures);
}

fn is_built_by_all(name: &str, mesh: &TetMesh) {
    for (how, config) in configs() {
        let name = format!("{name}, {how}");
        let built = build(mesh, &config);
        let mt = built.unwrap_or_else(|error| panic!("{name}: {error}")).mt;
        keeps_its_shape(&name, mesh, &mt);
    }
    for parts in [2, 8] {
        let mt = crate::parts::in_parts(mesh, &BuildConfig::default(), parts).mt;
        keeps_its_shape(&format!("{name}, {parts} parts"), mesh, &mt);
    }
}

#[test]
fn torn_grids() {
    let mut random = Random::new(41);
    for turn in 0..24 {
        let cells = [4, 2 + random.below(3) as u32, 2 + random.below(3) as u32];
        let diagonals = if turn % 3 == 0 { Diagonals::Glued } else { Diagonals::Own };
        let missing = [[usize::MAX; 2], [4, usize::MAX], [usize::MAX, 9], [6, 20]][turn % 4];
        let mesh = torn(&mut random, cells, diagonals, missing);
        is_built_by_all(&format!("{turn}: {cells:?}, {diagonals:?}, {missing:?}"), &mesh);
    }
}

#[test]
fn a_torn_grid_that_is_fine_enough_for_its_inside_to_go() {
    let mut random = Random::new(43);
    for missing in [[usize::MAX; 2], [7, 30]] {
        let mesh = torn(&mut random, [8, 5, 5], Diagonals::Own, missing);
        is_built_by_all(&format!("{missing:?}"), &mesh);
    }
}

/// The tetrahedra of a grid, six in each cell along the same diagonal, whose middles are to be there, in cells; then `change` may move
/// corners of single ones.
fn carved(cells: [u32; 3], keeps: impl Fn([f64; 3]) -> bool, change: impl FnOnce(&mut TetMesh)) -> TetMesh {
    let grid = Grid { dims: cells.map(|n| n + 1), origin: [0.0; 3], spacing: [f64::from(STEPS); 3] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    mesh.grid = None;
    let positions = mesh.positions.clone();
    let middle = |tet: &[u32; 4]| {
        [0, 1, 2].map(|k| tet.iter().map(|&v| positions[v as usize][k]).sum::<f64>() / f64::from(4 * STEPS))
    };
    mesh.tets.retain(|tet| keeps(middle(tet)));
    change(&mut mesh);
    // Nowhere is the boundary flat: else it would stay for that alone.
    let mut random = Random::new(45);
    let mut wobble = |x: f64| x + f64::from(random.between(-STEPS / 10, STEPS / 10));
    mesh.positions.iter_mut().for_each(|p| *p = p.map(&mut wobble));
    let place = |p: &[f64; 3]| [0, 1, 2].map(|k| p[k] / f64::from(STEPS * cells[k] as i32));
    let values = mesh.positions.iter().map(|p| hilly(place(p))).collect();
    mesh.fields.push(Field::new("f", values));
    repair(mesh).expect("cells of a grid").0
}

/// Cuts a mesh through at so many cells along the first axis, but for one triangle.
fn open_all_but_one_triangle(mesh: &mut TetMesh, at: u32, cells: [u32; 3]) {
    let plane = f64::from(STEPS * at as i32);
    let middle = [1, 2].map(|k: usize| f64::from(STEPS * (cells[k] / 2) as i32));
    let is_kept = |p: &[f64; 3]| {
        let [y, z] = [p[1] - middle[0], p[2] - middle[1]].map(|d| d / f64::from(STEPS));
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]].contains(&[y, z])
    };
    let mut doubles = std::collections::BTreeMap::new();
    for t in 0..mesh.tets.len() {
        let is_behind =
            mesh.tets[t].iter().any(|&v| mesh.positions[v as usize][0] > plane + 0.5 * f64::from(STEPS));
        for corner in (0..4).filter(|_| is_behind) {
            let v = mesh.tets[t][corner];
            let [x, y, z] = mesh.positions[v as usize];
            if x == plane && !is_kept(&[x, y, z]) {
                let next = mesh.positions.len() as u32;
                mesh.tets[t][corner] = *doubles.entry(v).or_insert(next);
                if doubles[&v] == next {
                    mesh.positions.push([x + 0.25 * f64::from(STEPS), y, z]);
                }
            }
        }
    }
}

/// Whether a place is in the half of a cell, in the third and fourth place along two axes, that is a prism on a triangle.
fn in_prism([x, y, _]: [f64; 3], [i, j]: [f64; 2]) -> bool {
    x.floor() == i && y.floor() == j && x - i > y - j
}

#[test]
fn necks_of_one_triangle() {
    let cells = [6, 4, 4];
    is_built_by_all(
        "a triangle between two blocks",
        &carved(cells, |_| true, |mesh| open_all_but_one_triangle(mesh, 3, cells)),
    );
    let bar = |p: [f64; 3]| p[2] < 2.0 || p[2] > 5.0 || in_prism(p, [1.0, 1.0]);
    is_built_by_all("a bar between two blocks", &carved([3, 3, 7], bar, |_| ()));
}

#[test]
fn tunnels_of_three_edges() {
    let through = |p: [f64; 3]| !in_prism(p, [2.0, 1.0]);
    is_built_by_all("a tunnel through a block", &carved([5, 4, 4], through, |_| ()));
    let inside = |p: [f64; 3]| !in_prism(p, [2.0, 1.0]) || p[2] < 1.0 || p[2] > 4.0;
    is_built_by_all("a hollow inside of a block", &carved([5, 4, 5], inside, |_| ()));
}

#[test]
fn hollows_and_components_of_one_tetrahedron() {
    let cell = |p: [f64; 3]| p.map(f64::floor);
    let is_one = |p: [f64; 3]| {
        in_prism(p, [2.0, 1.0]) && cell(p)[2] == 2.0 && p[0] - 2.0 > p[2] - 2.0 && p[1] - 1.0 > p[2] - 2.0
    };
    is_built_by_all("one tetrahedron missing", &carved([5, 4, 5], |p| !is_one(p), |_| ()));
    // In the midst of a hollow, which it does not touch.
    let shell = |p: [f64; 3]| p.iter().any(|&x| !(1.0..=4.0).contains(&x)) || is_one(p);
    let apart = |mesh: &mut TetMesh| {
        let inside = |p: [f64; 3]| p.iter().all(|&x| (1.0..=4.0).contains(&(x / f64::from(STEPS))));
        let alone: Vec<usize> = (0..mesh.tets.len())
            .filter(|&t| mesh.tets[t].iter().all(|&v| inside(mesh.positions[v as usize])))
            .collect();
        for t in alone {
            let first = mesh.positions.len() as u32;
            let corners = mesh.tets[t].map(|v| mesh.positions[v as usize]);
            let centre = [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0);
            mesh.positions
                .extend(corners.map(|p| [0, 1, 2].map(|k| (0.75 * centre[k] + 0.25 * p[k]).round())));
            mesh.tets[t] = [0, 1, 2, 3].map(|i| first + i);
        }
    };
    is_built_by_all("a tetrahedron in a shell", &carved([5; 3], shell, apart));
}
