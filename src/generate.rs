//! Meshes made by formula, the same on every platform: what the demo, the docs and the tests use.

use crate::mesh::{Field, Grid, TetMesh};
use std::f64::consts::FRAC_PI_4;
use thiserror::Error;

/// The names that [`by_name`] knows.
pub const NAMES: [&str; 2] = ["bucky", "sphere-flow"];

/// Smallest and largest size of `bucky`: points along an edge of the grid.
const BUCKY_SIZES: [u32; 2] = [2, 512];
/// Smallest and largest size of `sphere-flow`; the largest has some 36 million tetrahedra.
const SPHERE_SIZES: [u32; 2] = [3, 101];

/// Why nothing was generated.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum GenerateError {
    /// No generator has this name.
    #[error("nothing named \"{0}\" can be generated; choose one of: {names}", names = NAMES.join(", "))]
    UnknownName(String),
    /// The size is too small or too large.
    #[error("{name} cannot have size {size}; choose one from {} to {}", .limits[0], .limits[1])]
    Size {
        /// The generator.
        name: &'static str,
        /// What was asked for.
        size: u32,
        /// Smallest and largest size.
        limits: [u32; 2],
    },
}

/// Generates the mesh called `name` (see [`NAMES`]) with `size` points along an edge.
///
/// # Errors
/// If nothing has this name, or it cannot have this size.
pub fn by_name(name: &str, size: u32) -> Result<TetMesh, GenerateError> {
    match name {
        "bucky" => bucky(size),
        "sphere-flow" => sphere_flow(size),
        _ => Err(GenerateError::UnknownName(name.to_owned())),
    }
}

fn check_size(name: &'static str, size: u32, limits: [u32; 2]) -> Result<(), GenerateError> {
    if (limits[0]..=limits[1]).contains(&size) {
        Ok(())
    } else {
        Err(GenerateError::Size { name, size, limits })
    }
}

/// A bucky ball: `density` on a grid of `size`³ points over the unit cube.
///
/// The density is the sum of exp(−d²/2σ²), σ = 0.055, over the 60 vertices of a truncated icosahedron of radius
/// 0.35 around the cube's centre, where d is the distance to the vertex.
///
/// # Errors
/// If `size` is not within 2 to 512.
pub fn bucky(size: u32) -> Result<TetMesh, GenerateError> {
    const SIGMA: f64 = 0.055;
    check_size("bucky", size, BUCKY_SIZES)?;
    let spacing = 1.0 / f64::from(size - 1);
    let grid = Grid { dims: [size; 3], origin: [0.0; 3], spacing: [spacing; 3] };
    // The exponential of a sum of squares is a product of one factor an axis: 3 · 60 · size of them do.
    let factors = truncated_icosahedron().map(|atom| {
        atom.map(|c| {
            let factor = |i| {
                let d = spacing * f64::from(i) - c;
                libm::exp(-d * d / (2.0 * SIGMA * SIGMA))
            };
            (0..size).map(factor).collect::<Vec<f64>>()
        })
    });
    let n = size as usize;
    let mut values = vec![0.0; n * n * n];
    for (row, values) in values.chunks_exact_mut(n).enumerate() {
        let (y, z) = (row % n, row / n);
        for [fx, fy, fz] in &factors {
            let factor = fy[y] * fz[z];
            values.iter_mut().zip(fx).for_each(|(value, fx)| *value += factor * fx);
        }
    }
    Ok(TetMesh::from_grid(grid, vec![Field::new("density", values)]))
}

/// The vertices of a truncated icosahedron of radius 0.35 around (0.5, 0.5, 0.5): the cyclic permutations of
/// (0, ±1, ±3φ), (±1, ±(2+φ), ±2φ) and (±φ, ±2, ±(2φ+1)), scaled.
fn truncated_icosahedron() -> [[f64; 3]; 60] {
    const RADIUS: f64 = 0.35;
    let phi = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let kinds = [[0.0, 1.0, 3.0 * phi], [1.0, 2.0 + phi, 2.0 * phi], [phi, 2.0, 2.0 * phi + 1.0]];
    let mut vertices = [[0.0; 3]; 60];
    let mut slots = vertices.iter_mut();
    for kind in kinds {
        let length = kind.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A zero has one sign.
        for signs in (0..8).filter(|signs| kind[0] != 0.0 || signs & 1 == 0) {
            let signed = [0, 1, 2].map(|i| if signs >> i & 1 == 0 { kind[i] } else { -kind[i] });
            for turn in 0..3 {
                if let Some(slot) = slots.next() {
                    *slot = [0, 1, 2].map(|i| 0.5 + RADIUS / length * signed[(i + turn) % 3]);
                }
            }
        }
    }
    vertices
}

/// Potential flow past a sphere of radius 1 in a stream of speed 1 along x: `pressure` (the pressure coefficient
/// 1 − speed²) and `speed`.
///
/// The mesh fills the box from (−4, −4, −4) to (6, 4, 4) without the sphere, so it is not convex and its boundary
/// has two parts. Six blocks, one a side of the box, meet without seams; layers get thicker outward. There are
/// `size` points along an edge of the box and as many layers of points from sphere to box.
///
/// # Errors
/// If `size` is not within 3 to 101.
pub fn sphere_flow(size: u32) -> Result<TetMesh, GenerateError> {
    check_size("sphere-flow", size, SPHERE_SIZES)?;
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
    Ok(TetMesh { positions, fields, tets, ..TetMesh::default() })
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
        let index = |[x, y, z]: [u32; 3]| (x + size * (y + size * z)) as usize;
        let mut numbers = vec![u32::MAX; (size * size * size) as usize];
        let mut points = Vec::new();
        for z in 0..size {
            for y in 0..size {
                for x in (0..size).filter(|x| [*x, y, z].iter().any(|i| *i == 0 || *i == last)) {
                    numbers[index([x, y, z])] = points.len() as u32;
                    points.push([at(x), at(y), at(z)]);
                }
            }
        }
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for (end, outward) in [(0, false), (last, true)] {
                for (u, v) in (0..last).flat_map(|v| (0..last).map(move |u| (u, v))) {
                    let corner = |du: u32, dv: u32| {
                        let mut at = [end; 3];
                        at[(axis + 1) % 3] = u + du;
                        at[(axis + 2) % 3] = v + dv;
                        numbers[index(at)]
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
    use super::*;
    use crate::mesh::{check, topology};

    fn volume(mesh: &TetMesh) -> f64 {
        let volumes = mesh.tets.iter().map(|tet| {
            let p = tet.map(|v| mesh.positions[v as usize]);
            let [u, v, w] = [1, 2, 3].map(|k| [0, 1, 2].map(|i| p[k][i] - p[0][i]));
            ((u[1] * v[2] - u[2] * v[1]) * w[0]
                + (u[2] * v[0] - u[0] * v[2]) * w[1]
                + (u[0] * v[1] - u[1] * v[0]) * w[2])
                / 6.0
        });
        volumes.sum()
    }

    fn plain_density(p: [f64; 3]) -> f64 {
        let terms = truncated_icosahedron().map(|a| {
            let d2: f64 = (0..3).map(|i| (p[i] - a[i]) * (p[i] - a[i])).sum();
            (-d2 / (2.0 * 0.055 * 0.055)).exp()
        });
        terms.iter().sum()
    }

    #[test]
    fn the_icosahedron_is_truncated_and_regular() {
        let atoms = truncated_icosahedron();
        for (i, a) in atoms.iter().enumerate() {
            let mut distances: Vec<f64> = atoms
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, b)| (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt())
                .collect();
            distances.sort_by(f64::total_cmp);
            // Three bonds of one length (circumradius / 2.478), then the next are longer.
            let bond = 0.35 / 2.478_018_66;
            assert!(distances[..3].iter().all(|d| (d - bond).abs() < 1e-8), "{i}: {:?}", &distances[..4]);
            assert!(distances[3] > 1.5 * bond);
            let radius = (0..3).map(|k| (a[k] - 0.5) * (a[k] - 0.5)).sum::<f64>().sqrt();
            assert!((radius - 0.35).abs() < 1e-15);
        }
    }

    #[test]
    fn bucky_follows_its_definition() {
        for size in [2, 3, 9, 16] {
            let mesh = bucky(size).unwrap();
            check(&mesh).unwrap();
            assert_eq!(mesh.tets.len() as u32, 6 * (size - 1).pow(3));
            assert_eq!(mesh.positions.len() as u32, size.pow(3));
            assert!((volume(&mesh) - 1.0).abs() < 1e-12);
            assert_eq!(mesh.fields[0].name, "density");
            for (p, value) in mesh.positions.iter().zip(&mesh.fields[0].values) {
                let expected = plain_density(*p);
                assert!((value - expected).abs() <= 1e-13 * expected + 1e-300, "{p:?}: {value} {expected}");
            }
        }
    }

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
            let hole = 640.0 - volume(&mesh);
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

    #[test]
    fn names_and_sizes_are_checked() {
        assert_eq!(by_name("bucky", 3).unwrap().tets.len(), 48);
        assert_eq!(by_name("sphere-flow", 3).unwrap().tets.len(), 288);
        let unknown = by_name("buck", 3).unwrap_err().to_string();
        assert!(NAMES.iter().all(|n| unknown.contains(n)), "{unknown}");
        for (name, size) in
            [("bucky", 0), ("bucky", 1), ("bucky", 513), ("sphere-flow", 2), ("sphere-flow", 102)]
        {
            let error = by_name(name, size).unwrap_err().to_string();
            assert!(error.contains("choose one from"), "{error}");
        }
    }
}
