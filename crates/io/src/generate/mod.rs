//! Volumes made by formula, of any size and the same on every platform: what the demo, the docs and the tests use.
//!
//! Grids are made layer by layer ([`LayeredGrid`]), so that those that fit no memory can be written to files.

mod abc_flow;
mod bucky;
mod error;
mod helix;
mod hydrogen;
mod marschner_lobb;
mod sphere_flow;
mod turbine;

pub use error::GenerateError;
#[doc(hidden)]
pub use error::VOLUMES;
#[doc(hidden)]
pub use hydrogen::Orbital;

use tetralod::mesh::{LayeredGrid, TetMesh};

/// Smallest and largest size of a grid.
const GRID_SIZES: [u32; 2] = [2, 4096];

/// What can be chosen of a volume beside its size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[doc(hidden)]
pub struct Options {
    /// Which orbital `hydrogen` is.
    pub orbital: Orbital,
    /// The part of its period that `abc-flow` has drifted.
    pub phase: f64,
}

/// What was generated.
#[derive(Debug)]
pub enum Volume {
    /// Values on a grid, not yet made.
    Grid(LayeredGrid),
    /// Tetrahedra.
    Mesh(Box<TetMesh>),
}

impl Volume {
    /// The volume as tetrahedra, in memory.
    ///
    /// # Errors
    /// If a grid has more points than a mesh can number.
    pub fn into_mesh(self) -> Result<TetMesh, GenerateError> {
        match self {
            Self::Mesh(mesh) => Ok(*mesh),
            Self::Grid(grid) if u32::try_from(grid.points()).is_ok() => Ok(grid.to_mesh()),
            Self::Grid(grid) => Err(GenerateError::Points { points: grid.points() }),
        }
    }
}

/// Generates the volume called `name` (see [`VOLUMES`]) with `size` points along an edge; of a box that is no cube, its shortest.
///
/// # Errors
/// If nothing has this name, or it cannot have this size.
pub fn volume(name: &str, size: u32, options: &Options) -> Result<Volume, GenerateError> {
    let Some((name, _)) = VOLUMES.into_iter().find(|(known, _)| *known == name) else {
        return Err(GenerateError::UnknownName(name.to_owned()));
    };
    if name == "sphere-flow" {
        return sphere_flow(size).map(|mesh| Volume::Mesh(Box::new(mesh)));
    }
    if name == "turbine" {
        return turbine(size).map(|mesh| Volume::Mesh(Box::new(mesh)));
    }
    check_size(name, size, GRID_SIZES)?;
    Ok(Volume::Grid(match name {
        "bucky" => bucky::layers(size),
        "marschner-lobb" => marschner_lobb::layers(size),
        "hydrogen" => hydrogen::layers(size, options.orbital),
        "abc-flow" => abc_flow::layers(size, options.phase),
        _ => helix::layers(size),
    }))
}

/// Generates the volume called `name` (see [`VOLUMES`]) as a mesh.
///
/// # Errors
/// If nothing has this name, it cannot have this size, or has too many points.
#[doc(hidden)]
pub fn by_name(name: &str, size: u32) -> Result<TetMesh, GenerateError> {
    volume(name, size, &Options::default())?.into_mesh()
}

/// A bucky ball: `density` on a grid of `size`³ points over the unit cube.
///
/// The density is the sum of exp(−d²/2σ²), σ = 0.055, over the 60 vertices of a truncated icosahedron of radius
/// 0.35 around the cube's centre, where d is the distance to the vertex.
///
/// # Errors
/// If `size` is less than 2, or there are too many points.
#[doc(hidden)]
pub fn bucky(size: u32) -> Result<TetMesh, GenerateError> {
    by_name("bucky", size)
}

/// Potential flow past a sphere of radius 1 in a stream of speed 1 along x: `pressure` (the pressure coefficient
/// 1 − speed²) and `speed`.
///
/// The mesh fills the box from (−4, −4, −4) to (6, 4, 4) without the sphere, so it is not convex and its boundary
/// has two parts. Six blocks, one a side of the box, meet without seams; layers get thicker outward. There are
/// `size` points along an edge of the box and as many layers of points from sphere to box.
///
/// # Errors
/// If `size` is less than 3, or there are too many points.
#[doc(hidden)]
pub fn sphere_flow(size: u32) -> Result<TetMesh, GenerateError> {
    check_size("sphere-flow", size, sphere_flow::SIZES)?;
    Ok(sphere_flow::mesh(size))
}

/// A wheel with blades on a shaft, in a casing: `temperature` and `stress` at points, and at cells `part`, a number from 1 to 12 (shaft, hub,
/// eight blades, two halves of the casing). Its radius is 1, its axis is z; between blades, and around them, there is nothing.
///
/// There are `size` points along the axis, and eight times as many cells around it.
///
/// # Errors
/// If `size` is less than 3, or there are too many points.
#[doc(hidden)]
pub fn turbine(size: u32) -> Result<TetMesh, GenerateError> {
    check_size("turbine", size, turbine::SIZES)?;
    Ok(turbine::mesh(size))
}

fn check_size(name: &'static str, size: u32, limits: [u32; 2]) -> Result<(), GenerateError> {
    if (limits[0]..=limits[1]).contains(&size) {
        Ok(())
    } else {
        Err(GenerateError::Size { name, size, limits })
    }
}

/// The volume of a mesh, for tests.
#[cfg(test)]
fn space(mesh: &TetMesh) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use tetralod::mesh::check;

    #[test]
    fn all_volumes_are_valid_meshes_of_their_size() {
        for (name, _) in VOLUMES {
            for size in [3, 4, 7] {
                let mesh = by_name(name, size).unwrap();
                check(&mesh).unwrap();
                let all = |field: &tetralod::mesh::Field| field.values.iter().all(|v| v.is_finite());
                assert!(!mesh.fields.is_empty() && mesh.fields.iter().all(all), "{name}");
            }
        }
        assert_eq!(by_name("bucky", 3).unwrap().tets.len(), 48);
        assert_eq!(by_name("sphere-flow", 3).unwrap().tets.len(), 288);
    }

    #[test]
    fn the_turbine_has_twelve_parts_that_meet_in_faces() {
        let mesh = by_name("turbine", 13).unwrap();
        let topology = tetralod::mesh::topology(mesh.positions.len(), &mesh.tets).unwrap();
        let parts = &mesh.cell_fields[0].values;
        let counts = |part: u32| parts.iter().filter(|p| **p == f64::from(part)).count();
        assert!((1..=12).all(|part| counts(part) > 0) && (1..=12).map(counts).sum::<usize>() == parts.len());
        assert!((4..=10).all(|blade| counts(blade) == counts(3)), "blades are alike");
        let mut touching = std::collections::BTreeSet::new();
        for (t, around) in topology.neighbors.iter().enumerate() {
            let others = around.iter().filter(|n| **n != tetralod::mesh::NONE);
            touching.extend(others.map(|&n| [parts[t], parts[n as usize]].map(|part| part as u32)));
        }
        let mut expected = vec![[1, 2], [11, 12]];
        expected.extend((3..=10).map(|blade| [2, blade]));
        let found: Vec<[u32; 2]> = touching.into_iter().filter(|[a, b]| a < b).collect();
        expected.sort_unstable();
        assert_eq!(found, expected);
        // Within what facets cut off arcs.
        let casing = std::f64::consts::PI * (1.0 - 0.86 * 0.86) * 0.8;
        assert!(space(&mesh) > casing && space(&mesh) < std::f64::consts::PI * 0.8);
    }

    #[test]
    fn names_and_sizes_are_checked() {
        let unknown = by_name("buck", 3).unwrap_err().to_string();
        assert!(VOLUMES.iter().all(|(name, _)| unknown.contains(name)), "{unknown}");
        let wrong = [("bucky", 0), ("bucky", 1), ("helix", 4097), ("sphere-flow", 2), ("sphere-flow", 2000)];
        for (name, size) in wrong {
            let error = by_name(name, size).unwrap_err().to_string();
            assert!(error.contains("choose one from"), "{error}");
        }
        let points = 1626_u64.pow(3);
        assert_eq!(bucky(1626), Err(GenerateError::Points { points }));
    }
}
