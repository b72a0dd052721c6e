//! Meshes made by code, small enough to be built and verified in a test.

use super::builder::Stored;
use std::ops::ControlFlow;
use tetralod::mesh::{Field, Grid, TetMesh, repair};
use tetralod::mt::{EdgeMt, ErrorCode, MtKind, MultiTessellation, UpdateId};
use tetralod_build::{BuildConfig, BuildResult, edge_mt};

/// A field with hills, edges and a plateau.
pub fn hilly([x, y, z]: [f64; 3]) -> f64 {
    let hill = |a: f64, b: f64, c: f64| (-((x - a).powi(2) + (y - b).powi(2) + (z - c).powi(2)) * 9.0).exp();
    let edge = if x + y > 1.1 { 0.4 } else { 0.0 };
    (hill(0.3, 0.4, 0.6) + 0.7 * hill(0.8, 0.2, 0.1) + edge).max(0.15)
}

/// A field that is linear.
pub fn linear([x, y, z]: [f64; 3]) -> f64 {
    x + 2.0 * y - 3.0 * z
}

/// Cells of a grid that spans the unit cube, six tetrahedra each; the fields are named `f0`, `f1`, ...
pub fn blocks(cells: [u32; 3], fields: &[fn([f64; 3]) -> f64], inside: impl Fn([u32; 3]) -> bool) -> TetMesh {
    let grid =
        Grid { dims: cells.map(|n| n + 1), origin: [0.0; 3], spacing: cells.map(|n| 1.0 / f64::from(n)) };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let whole = (0..cells.iter().product::<u32>()).all(|i| inside(cell(i, cells)));
    let mut index = 0;
    mesh.tets.retain(|_| {
        index += 1;
        inside(cell((index - 1) / 6, cells))
    });
    mesh.grid = mesh.grid.filter(|_| whole);
    for (i, field) in fields.iter().enumerate() {
        let values = mesh.positions.iter().map(|p| field(*p)).collect();
        mesh.fields.push(Field::new(format!("f{i}"), values));
    }
    repair(mesh).expect("cells of a grid").0
}

fn cell(index: u32, cells: [u32; 3]) -> [u32; 3] {
    [index % cells[0], index / cells[0] % cells[1], index / cells[0] / cells[1]]
}

/// The unit cube.
pub fn cube(n: u32, fields: &[fn([f64; 3]) -> f64]) -> TetMesh {
    blocks([n; 3], fields, |_| true)
}

/// The unit cube with fields `hilly` and `linear`, and labels `part` of its cells: two halves along x, 0 and 1, and a core that reaches into
/// both, 5, from a third to two thirds along each axis. `n` is a multiple of 6.
pub fn parted(n: u32) -> TetMesh {
    let mut mesh = cube(n, &[hilly, linear]);
    let middle = |tet: &[u32; 4]| {
        let corners = tet.map(|v| mesh.positions[v as usize]);
        [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0)
    };
    let label = |[x, y, z]: [f64; 3]| match [x, y, z].iter().all(|c| (c - 0.5).abs() < 1.0 / 6.0) {
        true => 5.0,
        false => f64::from(u8::from(x > 0.5)),
    };
    let labels = mesh.tets.iter().map(|tet| label(middle(tet))).collect();
    mesh.cell_fields = vec![Field::new("part", labels)];
    mesh
}

/// A shell between two spheres, cut at the planes of the axes: curved boundaries and sharp edges.
pub fn bent(n: u32) -> TetMesh {
    let mut mesh = cube(n, &[hilly]);
    mesh.grid = None;
    for p in &mut mesh.positions {
        let [u, v, w] = *p;
        let (radius, turn, height) = (1.0 + w, 1.5 * u, 0.7 * v);
        *p = [radius * turn.cos() * height.cos(), radius * turn.sin() * height.cos(), radius * height.sin()];
    }
    repair(mesh).expect("a bent cube").0
}

/// A sheet around half of a cylinder of radius 1: a chord of it soon leaves it.
pub fn sheet(thickness: f64) -> TetMesh {
    let mut mesh = blocks([48, 16, 2], &[linear], |_| true);
    mesh.grid = None;
    for p in &mut mesh.positions {
        let [u, v, w] = *p;
        let (radius, turn) = (1.0 + thickness * w, std::f64::consts::PI * u);
        *p = [radius * turn.cos(), radius * turn.sin(), v];
    }
    repair(mesh).expect("a bent sheet").0
}

/// Builds with all fields.
pub fn built(mesh: &TetMesh) -> BuildResult<EdgeMt> {
    let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
    let config = BuildConfig { fields, ..BuildConfig::of(MtKind::Edge) };
    edge_mt(mesh, &config, &mut |_| ControlFlow::Continue(())).expect("a valid mesh")
}

/// The same MT with other updates: `change` sees each and its number. Errors of other fields change along with that of the first.
pub fn tampered(mt: &EdgeMt, mut change: impl FnMut(u32, &mut Stored)) -> EdgeMt {
    let mut other = EdgeMt::new(mt.info().clone(), mt.base().clone());
    for (u, before) in (0..).zip(Stored::all(mt)) {
        let mut update = before.clone();
        change(u, &mut update);
        let shift = i32::from(update.errors[0].0) - i32::from(before.errors[0].0);
        let shifted = |code: &ErrorCode| ErrorCode((i32::from(code.0) + shift).clamp(0, 65_535) as u16);
        update.errors = before.errors.iter().map(shifted).collect();
        other.push(&update.as_update()).expect("the change keeps what can be seen without a mesh");
    }
    other
}

/// The first updates of an MT, as they are there while the rest is still on its way.
pub fn prefix(mt: &EdgeMt, updates: u32) -> EdgeMt {
    let mut part = EdgeMt::new(mt.info().clone(), mt.base().clone());
    (0..updates).for_each(|u| {
        part.push(&mt.update(UpdateId(u))).expect("the same updates");
    });
    part
}
