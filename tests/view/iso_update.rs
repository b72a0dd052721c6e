//! Promise: a surface that follows a changing mesh is the one that is extracted from scratch, bit for bit, whatever
//! the changes, and what it says of its own changes is all there is.

use crate::scenes::{Scene, distance_to_centre};
use crate::support::random::Random;
use std::ops::Range;
use tetralod::mesh::NONE;
use tetralod::view::{IsoSurface, MeshView, NormalKind, SurfaceChanges};

/// A vertex of a surface, as bits: value, position, normal.
type Vertex = [u64; 7];

fn vertex(surface: &IsoSurface, v: u32) -> Vertex {
    let (p, n) = (surface.positions[v as usize], surface.normals[v as usize].map(f64::from));
    [surface.values[v as usize], p[0], p[1], p[2], n[0], n[1], n[2]].map(f64::to_bits)
}

/// The triangles, each from its least vertex on, in order.
fn triangles(surface: &IsoSurface) -> Vec<[Vertex; 3]> {
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| vertex(surface, v));
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().expect("three")
    };
    let mut all: Vec<_> = surface.indices.iter().map(turned).collect();
    all.sort_unstable();
    all
}

fn assert_same(found: &IsoSurface, mesh: &MeshView<'_>, values: &[f64], kind: NormalKind) {
    let mut wanted = IsoSurface::new();
    wanted.set_normal_kind(kind);
    wanted.extract_all(mesh, values);
    assert_eq!(found.indices.len(), wanted.indices.len());
    assert_eq!(found.positions.len(), wanted.positions.len());
    assert_eq!((found.normals.len(), found.values.len()), (wanted.positions.len(), wanted.positions.len()));
    assert!(triangles(found) == triangles(&wanted), "the same triangles");
    assert!(found.indices.iter().flatten().all(|v| (*v as usize) < found.positions.len()));
    let mut used = vec![false; found.positions.len()];
    found.indices.iter().flatten().for_each(|v| used[*v as usize] = true);
    assert!(used.iter().all(|used| *used), "every vertex belongs to a triangle");
}

/// A copy that knows only what it is told.
#[derive(Default)]
struct Copied {
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl Copied {
    fn follow(&mut self, surface: &mut IsoSurface) {
        let changes = surface.take_changes();
        self.vertices.resize(surface.positions.len(), [0; 7]);
        self.triangles.resize(surface.indices.len(), [0; 3]);
        for v in changes.vertices.into_iter().flatten() {
            self.vertices[v as usize] = vertex(surface, v);
        }
        for t in changes.triangles.into_iter().flatten() {
            self.triangles[t as usize] = surface.indices[t as usize];
        }
        assert!(self.triangles == surface.indices);
        assert!((0..).zip(&self.vertices).all(|(v, copy)| *copy == vertex(surface, v)));
    }
}

/// A mesh that is damaged and mended in every way, and tells the changed blocks as a current mesh does.
struct Walk {
    scene: Scene,
    all: Vec<[u32; 4]>,
    vertices: Vec<u32>,
    tets: Vec<u32>,
}

impl Walk {
    fn new(scene: Scene) -> Self {
        let all = scene.tets.clone();
        Self { scene, all, vertices: Vec::new(), tets: Vec::new() }
    }

    fn step(&mut self, random: &mut Random) {
        let Scene { positions, field, tets, .. } = &mut self.scene;
        let point = random.below(positions.len());
        match random.below(10) {
            0..=2 => {
                let special = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, f64::MAX];
                field[point] = match random.below(12) {
                    i if i < 5 => special[i],
                    i => i as f64 / 8.0 - 0.8,
                };
                self.vertices.push(point as u32);
            }
            3..=4 => {
                positions[point][random.below(3)] += random.between(-9, 9) as f64 / 400.0;
                self.vertices.push(point as u32);
            }
            5 => {
                let other = random.below(positions.len());
                positions.swap(point, other);
                field.swap(point, other);
                self.vertices.extend([point as u32, other as u32]);
                for tet in &mut self.all {
                    *tet = tet.map(|p| swapped(p, point as u32, other as u32));
                }
                for (t, tet) in (0..).zip(tets) {
                    if tet.iter().any(|p| [point as u32, other as u32].contains(p)) {
                        *tet = tet.map(|p| swapped(p, point as u32, other as u32));
                        self.tets.push(t);
                    }
                }
            }
            6 => {
                let [a, b] = [random.below(tets.len()), random.below(tets.len())];
                tets.swap(a, b);
                self.tets.extend([a as u32, b as u32]);
            }
            7..=8 if tets.len() > 20 => {
                let t = random.below(tets.len());
                tets.swap_remove(t);
                self.tets.push(t as u32);
            }
            _ => {
                let missing = self.all.iter().find(|tet| !tets.contains(tet));
                tets.extend(missing);
                self.tets.push(tets.len() as u32 - 1);
            }
        }
    }

    /// The mesh, and the blocks of 64 that have changed.
    fn take(&mut self) -> (MeshView<'_>, Vec<Range<u32>>, Vec<Range<u32>>) {
        let Scene { positions, field, tets, .. } = std::mem::take(&mut self.scene);
        let vertices = blocks(&mut self.vertices, positions.len());
        let changed = blocks(&mut self.tets, tets.len());
        self.scene = Scene::new(positions, field, tets);
        (self.scene.view(), vertices, changed)
    }
}

fn swapped(p: u32, a: u32, b: u32) -> u32 {
    if p == a {
        b
    } else if p == b {
        a
    } else {
        p
    }
}

fn blocks(entries: &mut Vec<u32>, len: usize) -> Vec<Range<u32>> {
    let mut blocks: Vec<_> = entries.drain(..).map(|i| i / 64).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let range = |block: u32| block * 64..((block + 1) * 64).min(len as u32);
    blocks.into_iter().map(range).filter(|range| range.start < range.end).collect()
}

/// Follows a mesh for many steps.
fn wander(scene: Scene, seed: u64, kind: NormalKind, change_values: bool) {
    let mut random = Random::new(seed);
    let mut walk = Walk::new(scene);
    let mut surface = IsoSurface::new();
    surface.set_normal_kind(kind);
    let mut copied = Copied::default();
    let mut values = vec![0.2, -0.1];
    for step in 0..120 {
        let (mesh, vertices, tets) = walk.take();
        surface.update(&mesh, &values, &vertices, &tets);
        assert_same(&surface, &mesh, &values, kind);
        if step % 3 != 0 {
            copied.follow(&mut surface);
        }
        for _ in 0..random.below(9) {
            walk.step(&mut random);
        }
        if change_values && random.once_in(5) {
            values = (0..random.below(4)).map(|_| random.between(-4, 4) as f64 / 8.0).collect();
        }
    }
}

fn wavy(p: [f64; 3]) -> f64 {
    (p[0] * 9.0).sin() * 0.6 + (p[1] * 7.0).cos() * (p[2] * 5.0).sin()
}

#[test]
fn whatever_changes_the_surface_is_the_one_from_scratch() {
    for seed in 0..5 {
        wander(Scene::cube(5, wavy), seed, NormalKind::Gradient, false);
        wander(Scene::ball(5), seed, NormalKind::Smooth, false);
    }
}

#[test]
fn so_it_is_with_ties_and_with_other_isovalues() {
    for seed in 0..5 {
        let eighths = |p: [f64; 3]| (wavy(p) * 8.0).round() / 8.0;
        wander(Scene::cube(5, eighths), seed, NormalKind::Gradient, true);
        wander(Scene::cube(4, eighths), seed, NormalKind::Smooth, true);
    }
}

#[test]
fn another_kind_of_normals_takes_effect_without_a_change() {
    let scene = Scene::ball(7);
    let mut surface = IsoSurface::new();
    for kind in [NormalKind::Gradient, NormalKind::Smooth, NormalKind::Gradient, NormalKind::Gradient] {
        surface.set_normal_kind(kind);
        surface.update(&scene.view(), &[0.25], &[], &[]);
        assert_same(&surface, &scene.view(), &[0.25], kind);
    }
}

#[test]
fn nothing_changed_is_nothing_written() {
    let mut scene = Scene::ball(12);
    let mut surface = IsoSurface::new();
    let first = std::slice::from_ref(&(0..64));
    for _ in 0..3 {
        surface.update(&scene.view(), &[0.25], &[], first);
    }
    assert!(surface.take_changes() != SurfaceChanges::default());
    surface.update(&scene.view(), &[0.25], first, first);
    assert_eq!(surface.take_changes(), SurfaceChanges::default());
    // One point moves: what is written is next to it.
    let near = scene.field.iter().position(|value| (value - 0.25).abs() < 0.05).expect("there is one");
    scene.field[near] += 0.01;
    let block = near as u32 / 64 * 64;
    surface.update(&scene.view(), &[0.25], std::slice::from_ref(&(block..block + 64)), &[]);
    assert_same(&surface, &scene.view(), &[0.25], NormalKind::Gradient);
    let changes = surface.take_changes();
    let written: usize = changes.vertices.iter().map(|range| range.len()).sum();
    assert!(0 < written && written < surface.positions.len() / 2, "{written}");
}

#[test]
fn several_isovalues_are_the_union_of_single_ones() {
    let scene = Scene::cube(7, |p| (6.0 * wavy(p)).round() / 6.0);
    let values = [0.5, -0.2, 0.0, 0.5, f64::NAN, 7.0];
    for kind in [NormalKind::Gradient, NormalKind::Smooth] {
        let mut surface = IsoSurface::new();
        surface.set_normal_kind(kind);
        surface.extract_all(&scene.view(), &values);
        let mut singles = Vec::new();
        for value in [0.5, -0.2, 0.0] {
            let mut single = IsoSurface::new();
            single.set_normal_kind(kind);
            single.extract(&scene.view(), value);
            assert!(single.values.iter().all(|v| *v == value));
            singles.extend(triangles(&single));
        }
        singles.sort_unstable();
        assert!(!singles.is_empty());
        assert!(triangles(&surface) == singles);
        let one_value = |t: &[u32; 3]| t.map(|v| surface.values[v as usize].to_bits());
        assert!(surface.indices.iter().map(one_value).all(|[a, b, c]| a == b && b == c));
    }
}

#[test]
fn normals_of_both_kinds_agree_with_the_gradient() {
    // A field with the gradient 2 (p - c): gradients of linear pieces are off by what the gradient changes within a
    // cell, which is sqrt(3) / 20 at half a diagonal against a length of at least 0.6.
    let square = |p: [f64; 3]| distance_to_centre(p).powi(2);
    let scene = Scene::cube(20, square);
    for (kind, least) in [(NormalKind::Gradient, 0.999), (NormalKind::Smooth, 0.99)] {
        let mut surface = IsoSurface::new();
        surface.set_normal_kind(kind);
        surface.extract(&scene.view(), 0.121);
        assert!(surface.positions.len() > 1000);
        for (p, n) in surface.positions.iter().zip(&surface.normals) {
            let inwards = p.map(|x| 0.5 - x);
            let length = inwards.iter().map(|x| x * x).sum::<f64>().sqrt();
            let cosine = (0..3).map(|i| f64::from(n[i]) * inwards[i] / length).sum::<f64>();
            assert!(cosine > least, "{kind:?} at {p:?}: {n:?} has the cosine {cosine}");
        }
    }
}

#[test]
fn a_mesh_without_anything_has_no_surface() {
    let mut surface = IsoSurface::new();
    let ball = Scene::ball(4);
    for scene in [&Scene::default(), &ball, &Scene::default(), &ball, &ball] {
        surface.update(&scene.view(), &[0.3], &[], &[]);
        assert_same(&surface, &scene.view(), &[0.3], NormalKind::Gradient);
        surface.update(&scene.view(), &[], &[], &[]);
        assert!(surface.indices.is_empty() && surface.positions.is_empty());
    }
    assert!(ball.neighbors.iter().flatten().any(|n| *n == NONE), "it has a boundary");
}
