//! Potential flow past a sphere: see [`super::sphere_flow`].

use std::f64::consts::FRAC_PI_4;
use tetralod::mesh::{Field, TetMesh};

/// Smallest and largest size; the largest has as many tetrahedra as a mesh can have.
pub(super) const SIZES: [u32; 2] = [3, 311];

pub(super) fn mesh(size: u32) -> TetMesh {
    let surface = CubeSurface::new(size);
    let steps = size - 1;
    let mut positions = Vec::with_capacity(surface.points.len() * size as usize);
    for layer in 0..size {
        let t = graded(f64::from(layer) / f64::from(steps));
        positions.extend(surface.points.iter().map(|c| between_sphere_and_box(*c, t)));
    }
    let layer_points = surface.points.len() as u32;
    let mut tets = Vec::with_capacity(surface.triangles.len() * steps as usize * 3);
    for layer in 0..steps {
        let (low, high) = (layer_points * layer, layer_points * (layer + 1));
        tets.extend(surface.triangles.iter().flat_map(|&t| prism(t, low, high)));
    }
    let speed: Vec<f64> = positions.iter().map(|p| flow_speed(*p)).collect();
    let pressure = speed.iter().map(|v| 1.0 - v * v).collect();
    let fields = vec![Field::new("pressure", pressure), Field::new("speed", speed)];
    TetMesh { positions, fields, tets, ..TetMesh::default() }
}

/// The three tetrahedra of the prism over the outward triangle `t`, between the layers that start at `low` and
/// `high`. Its sides are cut from their vertex of lowest number, so neighbouring prisms agree.
fn prism(t: [u32; 3], low: u32, high: u32) -> [[u32; 4]; 3] {
    let mut sorted = t;
    sorted.sort_unstable();
    let [a, b, c] = sorted;
    let turned = (t[0] > t[1]) ^ (t[0] > t[2]) ^ (t[1] > t[2]);
    let tets = [
        [low + a, low + b, low + c, high + c],
        [low + a, low + b, high + c, high + b],
        [low + a, high + b, high + c, high + a],
    ];
    tets.map(|[p, q, r, s]| if turned { [q, p, r, s] } else { [p, q, r, s] })
}

/// Where the fraction `t` of the layers lies between the sphere and the box: the first layer is thinnest, the
/// last about nine times as thick.
fn graded(t: f64) -> f64 {
    t * (0.2 + 0.8 * t)
}

/// The point at fraction `t` of the way from the sphere to the box, in the direction of `c` on the unit cube.
fn between_sphere_and_box(c: [f64; 3], t: f64) -> [f64; 3] {
    let length = c.iter().map(|x| x * x).sum::<f64>().sqrt();
    let outer = [if c[0] > 0.0 { 6.0 * c[0] } else { 4.0 * c[0] }, 4.0 * c[1], 4.0 * c[2]];
    [0, 1, 2].map(|i| (1.0 - t) * (c[i] / length) + t * outer[i])
}

/// Speed at `p`, outside or on the unit sphere: v = U (1 + 1/2r³) − n (3/2r³)(U · n), with U along x, n = p / r.
fn flow_speed(p: [f64; 3]) -> f64 {
    let r2: f64 = p.iter().map(|x| x * x).sum();
    let half_cube = 0.5 / (r2 * r2.sqrt());
    let radial = 3.0 * half_cube * p[0] / r2;
    let v = [1.0 + half_cube - radial * p[0], -radial * p[1], -radial * p[2]];
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The surface of the cube from −1 to 1, its sides cut into squares of about equal angle, and these into triangles.
struct CubeSurface {
    points: Vec<[f64; 3]>,
    /// Seen from outside, counter-clockwise.
    triangles: Vec<[u32; 3]>,
}

impl CubeSurface {
    fn new(size: u32) -> Self {
        let last = size - 1;
        let at = |i: u32| match i {
            0 => -1.0,
            i if i == last => 1.0,
            // Antisymmetric by construction: the mesh is as symmetric as the flow.
            i if 2 * i < last => -libm::tan(FRAC_PI_4 * f64::from(last - 2 * i) / f64::from(last)),
            i => libm::tan(FRAC_PI_4 * f64::from(2 * i - last) / f64::from(last)),
        };
        let mut points = Vec::new();
        for z in 0..size {
            for y in 0..size {
                let is_inside = |x: u32| [x, y, z].iter().all(|i| (1..last).contains(i));
                points.extend((0..size).filter(|x| !is_inside(*x)).map(|x| [at(x), at(y), at(z)]));
            }
        }
        // The number of a point of the surface: whole layers at both ends, between them rings.
        let ring = 4 * last;
        let number = |[x, y, z]: [u32; 3]| {
            let below = if z == 0 { 0 } else { size * size + (z - 1) * ring };
            let before = match y {
                _ if z == 0 || z == last => size * y + x,
                0 => x,
                y if y == last => size + 2 * (last - 1) + x,
                y => size + 2 * (y - 1) + u32::from(x == last),
            };
            below + before
        };
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for (end, outward) in [(0, false), (last, true)] {
                for (u, v) in (0..last).flat_map(|v| (0..last).map(move |u| (u, v))) {
                    let corner = |du: u32, dv: u32| {
                        let mut at = [end; 3];
                        at[(axis + 1) % 3] = u + du;
                        at[(axis + 2) % 3] = v + dv;
                        number(at)
                    };
                    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    let [b, d] = if outward { [b, d] } else { [d, b] };
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        Self { points, triangles }
    }
}

#[cfg(test)]
mod tests {
    use crate::generate::{space, sphere_flow};
    use tetralod::mesh::{check, topology};

    #[test]
    fn sphere_flow_fills_the_box_around_the_sphere() {
        for size in [3, 4, 5, 8, 13, 20] {
            let mesh = sphere_flow(size).unwrap();
            check(&mesh).unwrap();
            let n = size - 1;
            assert_eq!(mesh.positions.len() as u32, (6 * n * n + 2) * size);
            assert_eq!(mesh.tets.len() as u32, 36 * n * n * n);
            let t = topology(mesh.positions.len(), &mesh.tets).unwrap();
            assert_eq!((t.components, t.non_manifold_count()), (1, 0));
            assert_eq!(t.boundary_faces as u32, 2 * 12 * n * n);
            // The box less the polyhedron inside the sphere, which is smaller than the ball.
            let ball = 4.0 / 3.0 * std::f64::consts::PI;
            let hole = 640.0 - space(&mesh);
            assert!(hole < ball && hole > ball * (1.0 - 4.0 / f64::from(n * n)), "size {size}: hole {hole}");
        }
    }

    #[test]
    fn sphere_flow_has_the_known_speeds() {
        let mesh = sphere_flow(9).unwrap();
        let at = |p: [f64; 3]| {
            let i = mesh.positions.iter().position(|q| *q == p).unwrap();
            (mesh.fields[0].values[i], mesh.fields[1].values[i])
        };
        // Stagnation in front and behind, one and a half times the stream around the waist.
        assert_eq!(at([-1.0, 0.0, 0.0]), (1.0, 0.0));
        assert_eq!(at([1.0, 0.0, 0.0]), (1.0, 0.0));
        assert_eq!(at([0.0, 1.0, 0.0]), (-1.25, 1.5));
        assert_eq!(at([0.0, 0.0, -1.0]), (-1.25, 1.5));
        assert!((at([6.0, 0.0, 0.0]).1 - (1.0 - 1.0 / 216.0)).abs() < 1e-15);
    }
}
