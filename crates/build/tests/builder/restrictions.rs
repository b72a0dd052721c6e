//! Promises of a build that must keep something: cells no thinner than a bound, regions, points.

use crate::support::meshes::blocks;
use crate::support::random::Random;
use glam::DVec3;
use std::collections::BTreeMap;
use tetralod::geom::{nearest_on_triangle, orient3d};
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::{CurrentMesh, Mt, MtInfo, MtKind, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod_build::measure::CellAngles;
use tetralod_build::verify::{self, Reference};
use tetralod_build::{BuildConfig, BuildCriterion, BuildError, Construction, Method, build};

const ERRORS: [f64; 6] = [0.0, 0.01, 0.05, 0.2, 1.0, f64::INFINITY];
const N: u32 = 8;

fn made(mesh: &TetMesh, config: &BuildConfig) -> Mt {
    build(mesh, config).expect("a mesh to build on").mt
}

fn refused(mesh: &TetMesh, config: &BuildConfig) -> BuildError {
    build(mesh, config).expect_err("it must be refused")
}

/// Calls `look` with the mesh at each error.
fn at_all_errors(mt: &Mt, mut look: impl FnMut(&CurrentMesh, f64)) {
    for error in ERRORS {
        let mut front = Front::new(mt).expect("a valid base mesh");
        let request = Request::within(error);
        let criterion = LodCriterion::new(mt.info(), &request);
        front.satisfy(mt, &criterion, request.budget).expect("a valid MT");
        look(front.mesh(), error);
    }
}

fn of(kind: MtKind, method: Method, criterion: BuildCriterion) -> BuildConfig {
    let construction = Construction::new(kind, method, criterion).expect("they go together");
    BuildConfig { construction, ..BuildConfig::of(kind) }
}

/// A cube of `N`³ blocks whose field varies smoothly, with a little noise.
fn cube(seed: u64) -> TetMesh {
    let mut mesh = blocks([N; 3], &[|p| (6.0 * p[0]).sin() + p[1] * p[2]], |_| true);
    let mut random = Random::new(seed);
    mesh.fields[0].values.iter_mut().for_each(|x| *x += 0.01 * random.fraction());
    mesh
}

/// The same with points inside that are not where the grid had them, so that cells have all kinds of angles.
fn shaken(seed: u64) -> TetMesh {
    let mut mesh = cube(seed);
    let mut random = Random::new(seed + 1);
    for p in &mut mesh.positions {
        if p.iter().all(|x| *x > 0.0 && *x < 1.0) {
            p.iter_mut().for_each(|x| *x += 0.3 / f64::from(N) * (random.fraction() - 0.5));
        }
    }
    mesh.grid = None;
    mesh
}

fn angles(info: &MtInfo, mesh: &CurrentMesh) -> CellAngles {
    CellAngles::of(
        mesh.tets().iter().map(|tet| tet.map(|v| info.lattice.point(mesh.positions()[v as usize]))),
    )
}

#[test]
fn no_cell_is_thinner_than_the_bound_or_than_the_input() {
    for config in [
        BuildConfig::default(),
        BuildConfig::of(MtKind::Edge),
        of(MtKind::Vertex, Method::Decimate, BuildCriterion::Delaunay),
    ] {
        for degrees in [8.0, 20.0] {
            let mesh = shaken(5);
            let free = made(&mesh, &config);
            let bound = made(&mesh, &BuildConfig { min_dihedral: Some(degrees), ..config.clone() });
            let mut of_input = f64::INFINITY;
            at_all_errors(&bound, |mesh, error| {
                let least = angles(bound.info(), mesh).least.expect("there are cells");
                // The first error is 0: that is the input.
                of_input = of_input.min(if error == 0.0 { least } else { f64::INFINITY });
                assert!(least >= degrees.min(of_input) - 1e-6, "{least} at error {error}, {config:?}");
            });
            let mut thinnest = f64::INFINITY;
            at_all_errors(&free, |mesh, _| {
                thinnest = thinnest.min(angles(free.info(), mesh).least.expect("there are cells"));
            });
            assert!(thinnest < degrees.min(of_input), "the bound binds: {thinnest} degrees without it");
            let (base, all) = (bound.base().tets.len(), mesh.tets.len());
            println!("{degrees} degrees leave {base} of {all} tetrahedra, {config:?}");
            assert!(base < all, "it leaves room to decimate: {base} of {all} are left");
        }
    }
}

/// The block that a point of the unit cube is in.
fn block(p: [f64; 3]) -> [u32; 3] {
    p.map(|x| (x * f64::from(N)) as u32)
}

fn centre(corners: [[f64; 3]; 4]) -> [f64; 3] {
    [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0)
}

type Regions = fn([u32; 3]) -> i64;

/// The cube with a label at cells.
fn labelled(regions: Regions) -> TetMesh {
    let mut mesh = cube(9);
    let corners = |tet: &[u32; 4]| tet.map(|v| mesh.positions[v as usize]);
    let labels = mesh.tets.iter().map(|tet| regions(block(centre(corners(tet)))) as f64).collect();
    mesh.cell_fields = vec![Field::new("material", labels)];
    mesh
}

/// Six times the volume of each region in steps of the lattice, exactly. Each cell must be in one region as a whole, that which the mesh
/// says where it has regions.
fn volumes(mt: &Mt, mesh: &CurrentMesh, region_of: impl Fn([f64; 3]) -> i64) -> BTreeMap<i64, i128> {
    let (info, mut volumes) = (mt.info(), BTreeMap::new());
    assert_eq!(mt.regions().is_some(), info.kind == MtKind::HalfEdge, "these are stored");
    for (t, tet) in mesh.tets().iter().enumerate() {
        let lattice = tet.map(|v| mesh.positions()[v as usize]);
        let corners = lattice.map(|q| info.lattice.point(q));
        let middle = centre(corners);
        let region = region_of(middle);
        if let Some(regions) = mt.regions() {
            assert_eq!(regions.all[usize::from(mesh.regions()[t])].labels, [region], "{corners:?}");
        }
        // All over the cell, but not on the interfaces that it touches.
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            for part in [0.3, 0.6, 0.99] {
                let p = [0, 1, 2].map(|k| {
                    let far = 0.5 * (corners[i][k] + corners[j][k]);
                    middle[k] + part * (far - middle[k])
                });
                assert_eq!(region_of(p), region, "{corners:?}");
            }
        }
        let [a, b, c, d] = lattice;
        assert!(orient3d(a, b, c, d) > 0);
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| i128::from(p[k]) - i128::from(a[k])));
        let minor = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
        *volumes.entry(region).or_insert(0) += minor(1, 2) * w[0] + minor(2, 0) * w[1] + minor(0, 1) * w[2];
    }
    volumes
}

#[test]
fn regions_keep_their_volumes_and_no_cell_is_in_two() {
    let all: [(&str, Regions, usize); 5] = [
        ("halves", |c| i64::from(c[0] < 3), 10),
        ("a box inside", |c| i64::from(c.iter().all(|x| (2..6).contains(x))), 10),
        ("four, one of them alone", |c| i64::from(c[0] < 4) + 2 * i64::from(c[1] < 5 && c[2] > 2), 10),
        ("stairs", |c| i64::from(c[0] + c[1] < 8) - 7, 4),
        // Blocks that meet at edges and corners alone: nothing can go.
        ("checks", |c| i64::from((c[0] + c[1] + c[2]) % 2), 1),
    ];
    for (name, regions, less) in all {
        let mesh = labelled(regions);
        for config in [BuildConfig::default(), of(MtKind::Vertex, Method::Decimate, BuildCriterion::HalfEdge)]
        {
            let mt = made(&mesh, &BuildConfig { preserve: vec!["material".into()], ..config });
            let mut whole = None;
            at_all_errors(&mt, |mesh, error| {
                let found = volumes(&mt, mesh, |p| regions(block(p)));
                assert_eq!(*whole.get_or_insert(found.clone()), found, "{name} at error {error}");
            });
            let base = mt.base().tets.len();
            assert!(
                base * less <= mesh.tets.len(),
                "{name}: {base} tetrahedra of {} are left",
                mesh.tets.len()
            );
        }
    }
}

/// How far an interface in the middle of the cube is raised over a column of points, in blocks.
///
/// ```text
///  y │    ╱╲   B            along x; at the side x = 0 it is straight in z, and
///  4 ├───╱  ╲────╱╲──       what bends it is next to that line.
///    │  A        ╱  ╲
///    └──────────────── x
/// ```
fn raised([x, z]: [u32; 2]) -> f64 {
    if x > 0 && (5 * x + 3 * z) % 7 < 3 { 0.25 } else { 0.0 }
}

/// The region of a point beside that interface, which is straight on the triangles of the grid.
fn beside_raised(p: [f64; 3]) -> i64 {
    let [x, y, z] = p.map(|x| x * f64::from(N));
    let [i, k] = [x, z].map(|x| (x as u32).min(N - 1));
    let [f, g] = [x - f64::from(i), z - f64::from(k)];
    let [near, far] = [raised([i, k]), raised([i + 1, k + 1])];
    let at = if f > g { raised([i + 1, k]) } else { raised([i, k + 1]) };
    let height = near + (at - near) * f.max(g) + (far - at) * f.min(g);
    i64::from(y < 4.0 + height)
}

#[test]
fn interfaces_that_bend_beside_straight_lines_stay() {
    let mut mesh = cube(9);
    for p in &mut mesh.positions {
        let [i, j, k] = p.map(|x| (x * f64::from(N)).round() as u32);
        let weight =
            [(4, 1.0), (3, 0.5), (5, 0.5)].iter().find(|(row, _)| *row == j).map_or(0.0, |(_, w)| *w);
        p[1] += weight * raised([i, k]) / f64::from(N);
    }
    mesh.grid = None;
    let corners = |tet: &[u32; 4]| tet.map(|v| mesh.positions[v as usize]);
    let labels = mesh.tets.iter().map(|tet| beside_raised(centre(corners(tet))) as f64).collect();
    mesh.cell_fields = vec![Field::new("material", labels)];
    for config in [BuildConfig::default(), of(MtKind::Vertex, Method::Decimate, BuildCriterion::HalfEdge)] {
        let mt = made(&mesh, &BuildConfig { preserve: vec!["material".into()], ..config });
        let mut whole = None;
        at_all_errors(&mt, |mesh, error| {
            let found = volumes(&mt, mesh, beside_raised);
            assert_eq!(*whole.get_or_insert(found.clone()), found, "at error {error}");
        });
    }
}

#[test]
fn parts_keep_regions_and_points() {
    use crate::parts::{bytes, in_parts};
    let all: [(&str, Regions); 3] = [
        ("halves", |c| i64::from(c[0] < 3)),
        ("a box inside", |c| i64::from(c.iter().all(|x| (2..6).contains(x)))),
        ("stairs", |c| i64::from(c[0] + c[1] < 8) - 7),
    ];
    for (name, regions) in all {
        let mesh = labelled(regions);
        let keep_points = vec![mesh.positions[100], mesh.positions[365], mesh.positions[400]];
        let config = BuildConfig { preserve: vec!["material".into()], keep_points, ..BuildConfig::default() };
        let whole = build(&mesh, &config).expect("a mesh to build on");
        assert!(bytes(&in_parts(&mesh, &config, 1)) == bytes(&whole), "{name}: one part is the whole");
        for parts in [2, 8, 16] {
            let mt = in_parts(&mesh, &config, parts).mt;
            let report = verify::run(&mt, &mesh, Reference::Mesh, &mut |_, _| {});
            assert!(report.valid, "{name}, {parts}: {:#?}", report.failures);
            let said = |mt: &Mt| mt.regions().map(|regions| regions.all.clone());
            assert_eq!(said(&mt), said(&whole.mt), "{name}, {parts}");
            let mut first = None;
            at_all_errors(&mt, |mesh, error| {
                let found = volumes(&mt, mesh, |p| regions(block(p)));
                assert_eq!(*first.get_or_insert(found.clone()), found, "{name}, {parts} at error {error}");
                for place in &config.keep_points {
                    let q = mt.info().lattice.nearest(*place);
                    assert!(mesh.positions().contains(&q), "{place:?} is gone at error {error}: {parts}");
                }
            });
            let (base, whole_base) = (mt.base().tets.len(), whole.summary.base_tetrahedra as usize);
            assert!(
                base <= 2 * whole_base + 40,
                "{name}, {parts}: {base} are left, of the whole {whole_base}"
            );
        }
    }
}

#[test]
fn labels_at_points_part_cells_by_the_least_one() {
    let regions: Regions = |c| i64::from(c[0] >= 4);
    let mut mesh = labelled(regions);
    mesh.cell_fields.clear();
    let label = |p: &[f64; 3]| f64::from(u8::from(p[0] >= 0.5));
    mesh.fields.push(Field::new("material", mesh.positions.iter().map(label).collect()));
    let mt = made(&mesh, &BuildConfig { preserve: vec!["material".into()], ..BuildConfig::default() });
    let mut whole = None;
    at_all_errors(&mt, |mesh, error| {
        let found = volumes(&mt, mesh, |p| regions(block(p)));
        assert_eq!(found.len(), 2);
        assert_eq!(*whole.get_or_insert(found.clone()), found, "at error {error}");
    });
}

/// Parts of the sides of [`rounded`] from the middle to the interface.
const INTERFACE: f64 = 0.25;

/// How far a point of a cube around 0 is from its middle, along the axis where that is most.
fn depth(p: &[f64; 3]) -> f64 {
    p.iter().fold(0.0, |most, x| x.abs().max(most))
}

/// A cube around 0 of `n`³ blocks, and in it a body with curved sides of another label; and for each point whether it is inside of the
/// body (-1), on the interface (0) or outside.
fn rounded(n: u32) -> (TetMesh, Vec<i32>) {
    let mut mesh = blocks([n; 3], &[|p| p[0] + 0.3 * p[1]], |_| true);
    mesh.positions.iter_mut().for_each(|p| *p = p.map(|x| x - 0.5));
    let side = |p: &[f64; 3]| ((depth(p) - INTERFACE) / 1e-9).clamp(-1.0, 1.0).round() as i32;
    let sides: Vec<i32> = mesh.positions.iter().map(side).collect();
    let inside = |tet: &[u32; 4]| tet.iter().all(|&v| sides[v as usize] <= 0);
    let labels = mesh.tets.iter().map(|tet| f64::from(u8::from(inside(tet)))).collect();
    for p in &mut mesh.positions {
        // The nearer to the interface, the more a cube becomes a ball.
        let (depth, length) = (depth(p), p.iter().map(|x| x * x).sum::<f64>().sqrt());
        let part = 0.6 * (1.0 - (depth - INTERFACE).abs() / INTERFACE);
        let scale = if length > 0.0 { 1.0 + part * (depth / length - 1.0) } else { 1.0 };
        *p = p.map(|x| scale * x);
    }
    mesh.grid = None;
    mesh.cell_fields = vec![Field::new("material", labels)];
    (mesh, sides)
}

/// What is known of the body in a mesh. A cell whose corners are all on the interface may be on either side of it.
#[derive(Default)]
struct Body {
    /// The volume of the cells that are inside for sure, and of those that may be.
    volumes: [f64; 2],
    /// Triangles among which those of the interface are.
    triangles: Vec<[[f64; 3]; 3]>,
    /// The vertices on the interface.
    vertices: usize,
}

impl Body {
    fn of(mt: &Mt, mesh: &CurrentMesh, side: impl Fn([i32; 3]) -> i32) -> Self {
        let info = mt.info();
        let mut body = Self::default();
        let mut faces: BTreeMap<[[i32; 3]; 3], Vec<i32>> = BTreeMap::new();
        for (t, tet) in mesh.tets().iter().enumerate() {
            let corners = tet.map(|v| mesh.positions()[v as usize]);
            let sides = corners.map(&side);
            assert!(!(sides.contains(&-1) && sides.contains(&1)), "a cell is in both regions: {corners:?}");
            let own: i32 = sides.iter().sum::<i32>().signum();
            let [a, b, c, d] = corners.map(|q| DVec3::from_array(info.lattice.point(q)));
            if let (false, Some(regions)) = (own == 0, mt.regions()) {
                // Inside the label is 1.
                assert_eq!(regions.all[usize::from(mesh.regions()[t])].labels, [i64::from(own < 0)]);
            }
            if own <= 0 {
                body.volumes[usize::from(own == 0)] += (b - a).cross(c - a).dot(d - a) / 6.0;
            }
            for i in (0..4).filter(|&i| (0..4).all(|k| k == i || sides[k] == 0)) {
                let mut face = [(i + 1) % 4, (i + 2) % 4, (i + 3) % 4].map(|k| corners[k]);
                face.sort_unstable();
                faces.entry(face).or_default().push(own);
            }
        }
        let may_be = faces.into_iter().filter(|(_, sides)| sides[..] != [-1, -1] && sides[..] != [1, 1]);
        body.triangles = may_be.map(|(face, _)| face.map(|q| info.lattice.point(q))).collect();
        body.vertices = mesh.positions().iter().filter(|q| side(**q) == 0).count();
        body
    }
}

#[test]
fn curved_interfaces_move_within_their_tolerance() {
    let (mesh, sides) = rounded(16);
    let on_interface: Vec<DVec3> = mesh
        .positions
        .iter()
        .zip(&sides)
        .filter(|(_, side)| **side == 0)
        .map(|(p, _)| DVec3::from(*p))
        .collect();
    let mut left = Vec::new();
    for within in [0.0, 0.002, 0.01] {
        let config = BuildConfig {
            preserve: vec!["material".into()],
            preserve_within: within,
            ..BuildConfig::default()
        };
        let result = build(&mesh, &config).expect("a mesh to build on");
        let info = result.mt.info();
        let side_of: BTreeMap<[i32; 3], i32> =
            mesh.positions.iter().zip(&sides).map(|(p, side)| (info.lattice.nearest(*p), *side)).collect();
        let moved = result.summary.interface_deviation;
        assert!(moved <= within && (moved > 0.0) == (within > 0.0), "{moved} of {within}");
        assert_eq!(result.mt.regions().map(|regions| regions.deviation), Some(moved));
        let step = info.lattice.step.iter().fold(0.0, |most: f64, step| step.max(most));
        let (mut whole, mut vertices) = (None, 0);
        at_all_errors(&result.mt, |current, error| {
            let body = Body::of(&result.mt, current, |q| side_of[&q]);
            let [sure, perhaps] = body.volumes;
            let whole = *whole.get_or_insert(sure + perhaps);
            // The body's surface is less than that of a cube of side 0.5.
            let slack = 1.5 * within + 1e-9;
            assert!(sure - slack <= whole && whole <= sure + perhaps + slack, "{whole}: {sure} + {perhaps}");
            for p in on_interface.iter().step_by(5) {
                let square = |face: &[[f64; 3]; 3]| {
                    p.distance_squared(nearest_on_triangle(*p, face.map(DVec3::from_array)))
                };
                let distance = body.triangles.iter().map(square).fold(f64::INFINITY, f64::min).sqrt();
                assert!(distance <= within + 2.0 * step, "{distance} of {within} at error {error}");
            }
            vertices = body.vertices;
        });
        left.push(vertices);
    }
    let all = on_interface.len();
    println!("of {all} vertices of the interface {left:?} are left");
    assert!(left[0] * 20 >= all * 19, "without a tolerance they stay: {left:?} of {all}");
    assert!(left[1] * 4 < all * 3 && left[2] * 2 < all, "{left:?} of {all}");
    let config = BuildConfig { preserve_within: f64::NAN, ..BuildConfig::default() };
    assert!(matches!(refused(&mesh, &config), BuildError::Option { name: "preserve-within", .. }));
}

#[test]
fn points_that_are_named_stay() {
    let mesh = cube(3);
    let keep_points = vec![mesh.positions[100], mesh.positions[333], mesh.positions[400]];
    for kind in [MtKind::HalfEdge, MtKind::Edge, MtKind::Vertex] {
        let config = BuildConfig { keep_points: keep_points.clone(), ..BuildConfig::of(kind) };
        let mt = made(&mesh, &config);
        at_all_errors(&mt, |mesh, error| {
            for place in &keep_points {
                let q = mt.info().lattice.nearest(*place);
                assert!(mesh.positions().contains(&q), "{place:?} is gone at error {error}, {}", kind.name());
            }
        });
    }
    let config = BuildConfig { keep_points: vec![[0.3, 0.2, 0.1]], ..BuildConfig::default() };
    assert_eq!(refused(&mesh, &config), BuildError::NoPoint { place: [0.3, 0.2, 0.1] });
}

#[test]
fn what_cannot_be_kept_is_refused() {
    let mesh = labelled(|c| i64::from(c[0] < 3));
    let with_label = |name: &str, config: BuildConfig| BuildConfig { preserve: vec![name.into()], ..config };
    let insertion = of(MtKind::Vertex, Method::Insert, BuildCriterion::Delaunay);
    for config in [
        with_label("material", BuildConfig::of(MtKind::Edge)),
        with_label("material", of(MtKind::Vertex, Method::Decimate, BuildCriterion::Delaunay)),
        with_label("material", insertion.clone()),
        BuildConfig { min_dihedral: Some(5.0), ..insertion.clone() },
        BuildConfig { feature_angle: Some(30.0), ..insertion.clone() },
        BuildConfig { keep_points: vec![[0.0; 3]], ..insertion },
    ] {
        assert!(matches!(refused(&mesh, &config), BuildError::Combination { .. }));
    }
    for kind in [MtKind::HalfEdge, MtKind::Edge] {
        let thin = BuildConfig { min_dihedral: Some(71.0), ..BuildConfig::of(kind) };
        let feature = BuildConfig { feature_angle: Some(f64::NAN), ..BuildConfig::of(kind) };
        assert!(matches!(refused(&mesh, &thin), BuildError::Option { name: "min-dihedral", .. }));
        assert!(matches!(refused(&mesh, &feature), BuildError::Option { name: "feature-angle", .. }));
    }
    let unknown = refused(&mesh, &with_label("colour", BuildConfig::default())).to_string();
    assert_eq!(unknown, "there is no label 'colour' at cells or points; the mesh has: material, f0");
    assert!(matches!(refused(&mesh, &with_label("f0", BuildConfig::default())), BuildError::Label { .. }));
}
