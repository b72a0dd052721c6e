//! Promise: tetrahedra, wires and points lie where the mesh is and have the colours of their values.

use crate::cutaway::Cutaway;
use crate::scenes::Scene;
use crate::twin::{self, AROUND, Lights, Triangle, UNIT};
use glam::{DVec2, DVec3};
use tetralod::geom::{Camera, Projection};
use tetralod::mesh::FACES;
use tetralod::view::{ClipPlane, ColourScale, VIRIDIS};
use tetralod_render::draw::{CellShape, CellStyle, Colouring, Look, Style};
use tetralod_render::gpu::Renderer;

const SIZE: [u32; 2] = [160, 120];

/// Solid tetrahedra without edges, coloured by their values.
fn solid(shrunk: f32) -> CellStyle {
    let scale = ColourScale::new(VIRIDIS, [-0.8, 1.0]).unwrap();
    let style = Style { colouring: Colouring::Scale(scale), edges: None, ..CellStyle::default().style };
    CellStyle { style, shape: CellShape::Solid(shrunk), ..CellStyle::default() }
}

fn cameras() -> [Camera; 2] {
    let mut perspective = Camera::home(&UNIT, twin::aspect(SIZE));
    perspective.fit_around(&UNIT, twin::aspect(SIZE));
    perspective.zoom(0.8);
    let mut parallel = perspective;
    parallel.orbit(1.1, -0.3);
    parallel.set_projection(Projection::Orthographic);
    [perspective, parallel]
}

fn picture(renderer: &mut Renderer, scene: &Scene, style: &CellStyle, camera: &Camera) -> Vec<[f64; 3]> {
    renderer.set_cells(Some(style));
    renderer.update_mesh(&scene.view(), None).unwrap();
    twin::picture(renderer, camera, &twin::plain())
}

/// The faces of all tetrahedra, shrunk, with the values of their points or, if given, of the tetrahedra.
fn faces(scene: &Scene, shrunk: f64, own: Option<&[f64]>) -> Vec<Triangle> {
    let of = |(t, tet): (usize, &[u32; 4])| {
        let corners = tet.map(|p| twin::vec(scene.positions[p as usize]));
        let centroid = corners.iter().sum::<DVec3>() / 4.0;
        let values = tet.map(|p| own.map_or(scene.field[p as usize], |own| own[t]));
        FACES.map(|face| {
            let at = face.map(|i| corners[i].lerp(centroid, shrunk));
            Triangle::new(at, [DVec3::ZERO; 3], face.map(|i| values[i]))
        })
    };
    scene.tets.iter().enumerate().flat_map(of).collect()
}

/// What the nearest of the triangles look like where all of a pixel shows the same of them.
fn expected(triangles: &[Triangle], style: &Style, camera: &Camera) -> Vec<Option<DVec3>> {
    let lights = Lights::of(camera);
    let at = |pixel: usize| {
        let met = |beside| {
            twin::cast(triangles, &camera.ray(twin::screen(SIZE, pixel, beside), twin::aspect(SIZE)))
        };
        let middle = met([0.0; 2]);
        let triangle = middle.as_ref().map(|hit| hit.triangle);
        let is_steady = AROUND.iter().all(|beside| met(*beside).map(|hit| hit.triangle) == triangle);
        let background = twin::background(&twin::plain(), SIZE, pixel);
        is_steady.then(|| middle.map_or(background, |hit| lights.colour(style, &hit)))
    };
    (0..SIZE[0] as usize * SIZE[1] as usize).map(at).collect()
}

fn is_background(pixel: &[f64; 3]) -> bool {
    [0.2, 0.3, 0.4].iter().zip(pixel).all(|(a, b)| (a - b).abs() < 1.5 / 255.0)
}

fn coloured(pixels: &[[f64; 3]]) -> usize {
    pixels.iter().filter(|pixel| !is_background(pixel)).count()
}

#[test]
fn solid_tetrahedra_are_those_of_the_twin() {
    let mut renderer = twin::renderer(SIZE);
    for (mesh, scene) in [("ball", Scene::ball(3)), ("hollow", twin::hollow())] {
        let own: Vec<f64> = (0..scene.tets.len()).map(|t| (t * 37 % 101) as f64 / 55.0 - 0.8).collect();
        renderer.set_cell_values(&own).unwrap();
        for camera in cameras() {
            let mut covered = usize::MAX;
            for (shrunk, own_values) in [(0.0, false), (0.0, true), (0.25, false), (0.5, true)] {
                let style = CellStyle { own_values, ..solid(shrunk) };
                let pixels = picture(&mut renderer, &scene, &style, &camera);
                let name = format!("cells-{mesh}-{:?}-{shrunk}-{own_values}", camera.projection());
                twin::save(&name, SIZE, &pixels);
                let triangles = faces(&scene, f64::from(shrunk), own_values.then_some(&own));
                let expected = expected(&triangles, &style.style, &camera);
                let difference = twin::compare(&pixels, |pixel| expected[pixel]);
                let worst = 255.0 * difference.worst;
                println!("{name}: {worst:.2} of 255, {} pixels", difference.compared);
                assert!(worst <= 2.5, "{name}: {worst} at {}", difference.at);
                assert!(5 * difference.compared > 2 * pixels.len(), "{name}: {}", difference.compared);
                if shrunk > 0.0 {
                    assert!(coloured(&pixels) < covered, "{name}: shrunk ones cover less");
                }
                covered = coloured(&pixels);
            }
        }
    }
    // Values of another number of tetrahedra show nothing.
    renderer.set_cell_values(&[0.5; 7]).unwrap();
    let style = CellStyle { own_values: true, ..solid(0.0) };
    assert_eq!(coloured(&picture(&mut renderer, &Scene::ball(3), &style, &cameras()[0])), 0);
}

#[test]
fn cut_tetrahedra_are_those_of_the_cutaway() {
    let mut renderer = twin::renderer(SIZE);
    let scene = Scene::ball(4);
    for (number, cut) in [
        ClipPlane::NOTHING,
        ClipPlane { normal: [1.0, 0.4, 0.0], offset: 0.71 },
        ClipPlane { normal: [0.3, -0.5, 0.8], offset: 0.31 },
        ClipPlane { normal: [0.0, 0.0, 1.0], offset: -1.0 },
    ]
    .into_iter()
    .enumerate()
    {
        let mut cutaway = Cutaway::new();
        cutaway.cut(&scene.view(), &cut);
        let corners = cutaway.positions.chunks_exact(3).zip(cutaway.values.chunks_exact(3));
        let triangles: Vec<_> = corners
            .map(|(p, v)| {
                let corners = [0, 1, 2].map(|i| twin::vec(p[i]));
                Triangle::new(corners, [DVec3::ZERO; 3], [0, 1, 2].map(|i| v[i]))
            })
            .collect();
        let style = CellStyle { cut, ..solid(0.0) };
        for camera in cameras() {
            let pixels = picture(&mut renderer, &scene, &style, &camera);
            twin::save(&format!("cut-{number}-{:?}", camera.projection()), SIZE, &pixels);
            let expected = expected(&triangles, &style.style, &camera);
            let difference = twin::compare(&pixels, |pixel| expected[pixel]);
            assert!(255.0 * difference.worst <= 2.5, "cut {number}: {difference:?}");
            assert!(2 * difference.compared > pixels.len(), "cut {number}: {difference:?}");
            assert_eq!(coloured(&pixels) > 0, cutaway.kept > 0);
        }
    }
}

/// Where a point is in the picture, in pixels.
fn place(camera: &Camera, p: DVec3) -> DVec2 {
    let at = camera.project(p, twin::aspect(SIZE)).expect("it is in front");
    let size = DVec2::from(SIZE.map(f64::from));
    DVec2::new(at.x + 1.0, 1.0 - at.y) / 2.0 * size
}

/// The distance of a place from a side between two others.
fn away(p: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
    p.distance(a.lerp(b, t))
}

fn middles() -> impl Iterator<Item = (usize, DVec2)> {
    let width = SIZE[0] as usize;
    (0..width * SIZE[1] as usize)
        .map(move |i| (i, DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5)))
}

#[test]
fn wires_run_along_the_edges() {
    let mut renderer = twin::renderer(SIZE);
    let scene = Scene::ball(2);
    let style = CellStyle { shape: CellShape::Wire, ..CellStyle::default() };
    for camera in cameras() {
        let pixels = picture(&mut renderer, &scene, &style, &camera);
        twin::save(&format!("wires-{:?}", camera.projection()), SIZE, &pixels);
        let at: Vec<_> = scene.positions.iter().map(|p| place(&camera, twin::vec(*p))).collect();
        let pairs = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
        let edges: Vec<_> =
            scene.tets.iter().flat_map(|tet| pairs.map(|pair| pair.map(|i| at[tet[i] as usize]))).collect();
        let mut near = [0; 2];
        for (i, middle) in middles() {
            let nearest = edges.iter().map(|edge| away(middle, *edge)).fold(f64::INFINITY, f64::min);
            let is_drawn = !is_background(&pixels[i]);
            // A line is as wide as a pixel and a bit.
            assert!(!is_drawn || nearest < 1.4, "pixel {i} is {nearest} away from edges");
            if nearest < 0.25 {
                near[usize::from(is_drawn)] += 1;
            }
        }
        assert!(near[1] > 1000 && near[0] * 20 < near[1], "along edges drawn or not: {near:?}");
    }
}

#[test]
fn points_are_discs_at_the_points() {
    let mut renderer = twin::renderer(SIZE);
    let mut scene = Scene::ball(2);
    let count = scene.positions.len();
    // The place of one that is not there any more.
    scene.positions.push([0.3, 0.2, 0.7]);
    scene.field.push(0.0);
    let look = Look { pixel_ratio: 2.0, ..twin::plain() };
    let own: Vec<f64> = (0..scene.tets.len()).map(|t| (t % 17) as f64 / 10.0 - 0.75).collect();
    let first = |p: usize| scene.tets.iter().position(|tet| tet.contains(&(p as u32))).expect("it has some");
    for (camera, own_values) in cameras().into_iter().flat_map(|camera| [(camera, false), (camera, true)]) {
        let style = CellStyle { shape: CellShape::Points(4.0), own_values, ..solid(0.0) };
        let Colouring::Scale(scale) = style.style.colouring else { panic!("they have a scale") };
        renderer.set_cell_values(&own).unwrap();
        renderer.set_cells(Some(&style));
        renderer.update_mesh(&scene.view(), None).unwrap();
        let pixels = twin::picture(&mut renderer, &camera, &look);
        twin::save(&format!("points-{:?}", camera.projection()), SIZE, &pixels);
        let there = &scene.positions[..count];
        let at: Vec<_> = there.iter().map(|p| place(&camera, twin::vec(*p))).collect();
        for (i, middle) in middles() {
            // Four units of two pixels are the diameter.
            let nearest = at.iter().map(|p| p.distance(middle)).fold(f64::INFINITY, f64::min);
            assert!(nearest > 3.2 || !is_background(&pixels[i]), "pixel {i} is {nearest} from a point");
            assert!(nearest < 4.8 || is_background(&pixels[i]), "pixel {i} is {nearest} from all points");
        }
        // In the middle of a point that nothing hides there is its colour.
        let mut nearest = 0;
        for (p, middle) in at.iter().enumerate() {
            let size = DVec2::from(SIZE.map(f64::from));
            let is_inside = middle.cmpge(DVec2::ZERO).all() && middle.cmplt(size).all();
            let depth = |p: usize| camera.depth(twin::vec(scene.positions[p]));
            let hides = |other: usize| at[other].distance(*middle) < 8.5 && depth(other) < depth(p);
            if is_inside && !(0..at.len()).any(hides) {
                nearest += 1;
                let pixel = pixels[middle.y as usize * SIZE[0] as usize + middle.x as usize];
                let value = if own_values { own[first(p)] } else { scene.field[p] };
                let colour = twin::vec(scale.colour(value)).map(twin::decode);
                let bright = (1.2 * colour).map(twin::encode);
                assert!((DVec3::from(pixel) - bright).abs().max_element() < 0.06, "point {p}: {pixel:?}");
            }
        }
        assert!(nearest >= 5, "nothing hides {nearest} points");
    }
}
