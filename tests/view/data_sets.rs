//! Promise: pictures of volumes are those of the twin on real data, too: slivers, steps, holes, parts that touch.
//!
//! On the data sets in the folder that the environment variable `TETRALOD_DATA` names.
//!
//! All pixels are compared, also those whose rays graze an edge. They may differ only where parts of a mesh overlap: there the light is that of
//! both parts in one picture, and of one of them in the other.

use crate::scenes::Scene;
use crate::support::data::real_data;
use crate::twin;
use glam::{DVec2, DVec3};
use std::path::{Path, PathBuf};
use tetralod::geom::{Bounds, Camera, Ray};
use tetralod::mesh::{Field, Grid, TetMesh, boundary_faces, neighbors, repair};
use tetralod::view::Medium;
use tetralod_io::{CellData, ReadOptions, read_with};
use tetralod_render::gpu::Renderer;

const SIZE: [u32; 2] = [64, 48];
/// Two levels: what rounding and the noise of the background make is less.
const MOST: f64 = 2.0;
/// Pixels of a picture in which parts may overlap.
const MOST_OVERLAPS: usize = 3;
/// Cells of a grid along an axis, of which larger ones are thinned out: the twin is slow.
const MOST_CELLS: u32 = 36;

/// The mesh as the builder gets it, with its first field; none with a reason.
fn read(path: &Path) -> Result<TetMesh, String> {
    let options = ReadOptions { cells: CellData::Values, ..ReadOptions::default() };
    let mesh = read_with(path, &options).map_err(|error| error.to_string())?;
    let mut mesh = repair(thinned(mesh)).map_err(|error| error.to_string())?.0;
    mesh.cells_to_points();
    mesh.fields.truncate(1);
    let Some(field) = mesh.fields.first() else { return Err("no field".to_owned()) };
    if mesh.tets.is_empty() || !field.values.iter().all(|value| value.is_finite()) {
        return Err("no tetrahedra, or values that are no numbers".to_owned());
    }
    Ok(mesh)
}

/// A grid with every n-th point.
fn thinned(mesh: TetMesh) -> TetMesh {
    let Some(grid) = mesh.grid else { return mesh };
    let step = grid.dims.iter().map(|n| (n - 1).div_ceil(MOST_CELLS)).max().unwrap_or(1).max(1);
    let dims = grid.dims.map(|n| (n - 1) / step + 1);
    let fields = mesh.fields.iter().map(|field| {
        let places = (0..dims.iter().product::<u32>()).map(|i| {
            let at = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]].map(|x| (x * step) as usize);
            field.values[at[0] + grid.dims[0] as usize * (at[1] + grid.dims[1] as usize * at[2])]
        });
        Field::new(field.name.clone(), places.collect())
    });
    let spacing = grid.spacing.map(|x| x * f64::from(step));
    TetMesh::from_grid(Grid { dims, spacing, ..grid }, fields.collect())
}

/// Fog, and two shells, over the values of a field.
fn media([low, high]: [f64; 2], diagonal: f64) -> [(&'static str, Medium); 2] {
    let at = |part: f64, colour: [f64; 4]| (low + part * (high - low), colour);
    let fog = [at(0.0, [0.1, 0.3, 0.9, 0.05]), at(1.0, [1.0, 0.6, 0.2, 0.7])];
    let shells = [
        at(0.1, [0.2, 0.4, 1.0, 0.0]),
        at(0.3, [0.2, 0.8, 0.6, 0.6]),
        at(0.45, [0.9, 0.9, 0.2, 0.0]),
        at(0.6, [1.0, 0.5, 0.1, 0.0]),
        at(0.7, [1.0, 0.2, 0.1, 0.9]),
        at(0.8, [1.0, 0.2, 0.1, 0.0]),
    ];
    [("fog", Medium::new(&fog, 0.25 * diagonal)), ("shells", Medium::new(&shells, 0.1 * diagonal))]
}

/// The largest difference of a channel, in levels.
fn difference(renderer: &mut Renderer, scene: &Scene, medium: &Medium, camera: &Camera) -> f64 {
    let view = scene.view();
    renderer.set_volume(Some((medium, u32::MAX))).unwrap();
    renderer.update_mesh(&view, None).unwrap();
    let found = twin::picture(renderer, camera, &twin::plain());
    let expected = medium.picture(view, camera, SIZE);
    let difference = twin::compare(&found, |pixel| {
        let colour = DVec3::from(expected[pixel].on([0.2, 0.3, 0.4]));
        let off = 255.0 * (DVec3::from(found[pixel]) - colour).abs().max_element();
        (off <= MOST || !overlap(scene, &ray(camera, pixel))).then_some(colour)
    });
    assert!(difference.compared + MOST_OVERLAPS >= found.len(), "{} pixels", difference.compared);
    255.0 * difference.worst
}

/// The ray through the middle of a pixel.
fn ray(camera: &Camera, pixel: usize) -> Ray {
    let [width, height] = SIZE.map(f64::from);
    let [column, row] = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]].map(f64::from);
    let [x, y] = [(column, width), (row, height)].map(|(place, count)| 2.0 * (place + 0.5) / count - 1.0);
    camera.rays(twin::aspect(SIZE)).at(DVec2::new(x, -y))
}

/// Whether a ray enters a part of the volume before it has left another: at faces of the boundary, which look outwards.
fn overlap(scene: &Scene, ray: &Ray) -> bool {
    let mut crossed = Vec::new();
    for (_, face) in boundary_faces(&scene.tets, &scene.neighbors) {
        let [a, b, c] = face.map(|point| DVec3::from(scene.positions[point as usize]));
        let normal = (b - a).cross(c - a);
        let slope = ray.direction.dot(normal);
        let distance = (a - ray.origin).dot(normal) / slope;
        let place = ray.at(distance);
        let is_inside = |(p, q): &(DVec3, DVec3)| (*q - *p).cross(place - *p).dot(normal) >= 0.0;
        if slope != 0.0 && [(a, b), (b, c), (c, a)].iter().all(is_inside) {
            crossed.push((distance, slope < 0.0));
        }
    }
    crossed.sort_by(|a, b| a.0.total_cmp(&b.0));
    crossed.windows(2).any(|pair| pair[0].1 && pair[1].1)
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn gpu_matches_cpu_on_data_sets() {
    let data = real_data();
    let mut renderer = twin::renderer(SIZE);
    let mut paths: Vec<PathBuf> = [data.clone(), data.join("robust"), data.join("native")]
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flat_map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())))
        .filter(|path| path.extension().is_some_and(|end| end == "vtu" || end == "vti"))
        .collect();
    paths.sort();
    let (mut sets, mut wrong) = (0, Vec::new());
    for path in paths {
        let name = path.strip_prefix(&data).unwrap_or(&path).display().to_string();
        let mesh = match read(&path) {
            Ok(mesh) => mesh,
            Err(why) => {
                println!("{name}: left out, {why}");
                continue;
            }
        };
        let positions: Vec<[f64; 3]> = mesh.positions.clone();
        let field: Vec<f64> = mesh.fields[0].values.clone();
        let range = field.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(*value), high.max(*value)]
        });
        let bounds = positions.iter().fold(Bounds::EMPTY, |b, p| b.with(p.map(f64::from)));
        let around = neighbors(&mesh.tets).expect("a repaired mesh");
        let scene = Scene { positions, field, tets: mesh.tets, neighbors: around };
        let mut camera = Camera::home(&bounds, twin::aspect(SIZE));
        camera.orbit(0.35, 0.1);
        for (medium_name, medium) in &media(range, bounds.diagonal()) {
            let worst = difference(&mut renderer, &scene, medium, &camera);
            println!("{name}, {} tetrahedra, {medium_name}: {worst:.2} of 255", scene.tets.len());
            if worst > MOST {
                wrong.push(format!("{name}, {medium_name}: {worst:.2} of 255"));
            }
        }
        sets += 1;
    }
    println!("{sets} sets");
    assert!(sets > 10, "{sets} sets in {}", data.display());
    assert!(wrong.is_empty(), "{wrong:#?}");
}
