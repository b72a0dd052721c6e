//! Promise: a ray meets what is in its way first, and nothing that is cut away; in a volume, where half of
//! the light is lost.

use crate::scenes::Scene;
use crate::support::meshes::{cube, linear};
use crate::support::random::Random;
use glam::DVec3;
use tetralod::geom::Ray;
use tetralod::view::{
    BoundarySurface, ClipPlane, IsoSurface, Medium, Probe, Triangles, first_hit, first_hit_in,
};

fn scene(n: u32, field: fn([f64; 3]) -> f64) -> Scene {
    let mesh = cube(n, &[field]);
    let positions = mesh.positions.clone();
    Scene::new(positions, mesh.fields[0].values.clone(), mesh.tets.clone())
}

fn direction(random: &mut Random) -> DVec3 {
    loop {
        let d = DVec3::from([(); 3].map(|()| 2.0 * random.fraction() - 1.0));
        if d.length() > 0.1 && d.length() < 1.0 {
            return d;
        }
    }
}

const RADIUS: f64 = 0.4;

fn from_middle(p: [f64; 3]) -> f64 {
    DVec3::from(p).distance(DVec3::splat(0.5))
}

#[test]
fn rays_meet_a_sphere_where_it_is() {
    let scene = scene(24, from_middle);
    let mut surface = IsoSurface::new();
    surface.extract(&scene.view(), RADIUS);
    let triangles = Triangles::from(&surface);
    let mut random = Random::new(2);
    for _ in 0..500 {
        let way = direction(&mut random);
        let target = DVec3::splat(0.5) + direction(&mut random) * 0.9;
        let origin = target - way.normalize() * 3.0;
        let ray = Ray { origin, direction: way };
        let to = DVec3::splat(0.5) - origin;
        let along = to.dot(way.normalize());
        let beside = to.length_squared() - along * along;
        match first_hit(&triangles, &ray, &[]) {
            Some(hit) => {
                let on = DVec3::from(hit.position);
                assert!((on.distance(DVec3::splat(0.5)) - RADIUS).abs() < 0.005);
                assert!((on.distance(origin) - hit.distance).abs() < 1e-9);
                assert!(beside < (RADIUS + 0.005).powi(2) && hit.distance <= along + 0.05, "the near side");
                assert!((hit.value - RADIUS).abs() < 1e-6);
            }
            None => assert!(beside > (RADIUS - 0.005).powi(2)),
        }
        let inner = Ray { origin: DVec3::splat(0.5), direction: way };
        let hit = first_hit(&triangles, &inner, &[]).expect("closed: every ray from inside meets it");
        assert!((hit.distance - RADIUS).abs() < 0.005);
    }
}

#[test]
fn rays_through_corners_and_edges_do_not_slip_through() {
    let scene = scene(4, linear);
    let mut surface = BoundarySurface::new();
    surface.extract(&scene.view());
    let triangles = Triangles::from(&surface);
    for (i, p) in surface.positions.iter().enumerate() {
        for q in &surface.positions[..i] {
            let middle = DVec3::from(p.map(f64::from)).midpoint(DVec3::from(q.map(f64::from)));
            let origin = DVec3::new(0.47, 0.55, 0.61);
            let ray = Ray { origin, direction: middle - origin };
            let hit = first_hit(&triangles, &ray, &[]).expect("the surface is closed");
            assert!((hit.value - linear(hit.position)).abs() < 1e-5);
            let on = hit.position.iter().any(|x| x.abs() < 1e-9 || (x - 1.0).abs() < 1e-9);
            assert!(on, "{:?}", hit.position);
        }
    }
}

#[test]
fn planes_cut_hits_away() {
    let square = |z: f64| [[-1.0, -1.0, z], [3.0, -1.0, z], [-1.0, 3.0, z]];
    let positions: Vec<[f64; 3]> = [1.0, 2.0, 3.0].into_iter().flat_map(square).collect();
    let indices = [[0, 1, 2], [3, 4, 5], [6, 8, 7]];
    let surface =
        Triangles { positions: &positions, values: &[1.0; 9], indices: &indices, ..Triangles::default() };
    let ray = Ray { origin: DVec3::ZERO, direction: DVec3::Z };
    let first =
        |planes: &[ClipPlane]| first_hit(&surface, &ray, planes).map(|hit| (hit.triangle, hit.distance));
    assert_eq!(first(&[]), Some((0, 1.0)));
    assert_eq!(first(&[ClipPlane::NOTHING]), Some((0, 1.0)));
    let front = ClipPlane { normal: [0.0, 0.0, -2.0], offset: -3.0 };
    assert_eq!(first(&[front]), Some((1, 2.0)));
    let behind = |offset| ClipPlane { normal: [0.0, 0.0, 1.0], offset };
    assert_eq!(first(&[front, behind(2.0)]), Some((1, 2.0)), "a point of the plane is kept");
    assert_eq!(first(&[front, behind(1.9)]), None);
    assert_eq!(first(&[ClipPlane { normal: [1.0, 0.0, 0.0], offset: -0.5 }]), None);
    let back = Ray { origin: DVec3::ZERO, direction: -DVec3::Z };
    assert!(first_hit(&surface, &back, &[]).is_none(), "all is behind");
}

#[test]
fn bad_rays_and_surfaces_are_not_hit() {
    let positions = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [f64::NAN; 3], [0.0, 1.0, 1.0]];
    let indices = [[0, 1, 9], [0, 1, 2], [0, 0, 1], [0, 1, 3]];
    let surface =
        Triangles { positions: &positions, values: &[1.0], indices: &indices, ..Triangles::default() };
    let ray = Ray { origin: DVec3::new(0.2, 0.2, 0.0), direction: DVec3::Z };
    let hit = first_hit(&surface, &ray, &[]).expect("the last one is sound");
    assert!(hit.triangle == 3 && hit.value.is_nan(), "too few values");
    assert!(first_hit(&Triangles::default(), &ray, &[]).is_none());
    let scene = scene(2, linear);
    let medium = Medium::new(&[(0.0, [1.0; 4])], 1.0);
    for (origin, direction) in [
        (DVec3::NAN, DVec3::Z),
        (DVec3::ZERO, DVec3::ZERO),
        (DVec3::ZERO, DVec3::NAN),
        (DVec3::INFINITY, DVec3::X),
    ] {
        let ray = Ray { origin, direction };
        assert!(first_hit(&surface, &ray, &[]).is_none());
        assert!(first_hit_in(&medium, &Probe::new(scene.view()), &ray, &[]).is_none());
    }
    assert!(first_hit_in(&medium, &Probe::new(Scene::default().view()), &ray, &[]).is_none());
}

#[test]
fn half_of_the_light_is_lost_where_the_formula_says() {
    let scene = scene(5, linear);
    let mut probe = Probe::new(scene.view());
    probe.make_grid();
    let mut random = Random::new(5);
    for opacity in [0.6, 0.9, 0.99] {
        let unit = 0.5;
        let medium = Medium::new(&[(0.0, [1.0, 1.0, 1.0, opacity])], unit);
        let half = unit * 0.5_f64.ln() / (1.0 - opacity).ln();
        for _ in 0..50 {
            let [y, z] = [(); 2].map(|()| 0.01 + 0.98 * random.fraction());
            let ray = Ray { origin: DVec3::new(-2.0, y, z), direction: DVec3::X * 3.0 };
            let hit = first_hit_in(&medium, &probe, &ray, &[]).expect("it is dense enough");
            assert!((hit.distance - 2.0 - half).abs() < 1e-9, "{} {half}", hit.distance);
            assert!((hit.position[0] - half).abs() < 1e-9);
            assert!((hit.value - linear(hit.position)).abs() < 1e-5);
            let cut = ClipPlane { normal: [-1.0, 0.0, 0.0], offset: -0.25 };
            let later = first_hit_in(&medium, &probe, &ray, &[cut]).map(|hit| hit.position[0]);
            assert_eq!(later.is_some(), 0.25 + half <= 1.0);
            assert!(later.is_none_or(|x| (x - 0.25 - half).abs() < 1e-9));
        }
    }
    let thin = Medium::new(&[(0.0, [1.0, 1.0, 1.0, 0.3])], 1.0);
    let ray = Ray { origin: DVec3::new(-2.0, 0.4, 0.3), direction: DVec3::X };
    assert!(first_hit_in(&thin, &probe, &ray, &[]).is_none());
}
