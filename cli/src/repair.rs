//! Options of repair, and what was done and found, as programs get it.

use super::build::named;
use anyhow::{Context, Result};
use serde::Serialize;
use tetralod::mesh::{RepairLevel, RepairReport, TetMesh, findings};

/// How the input is mended.
#[derive(clap::Args)]
pub struct RepairOptions {
    /// What is repaired: none (a mesh that needs repair is refused), safe (what has only one sensible repair) or weld (also points
    /// that lie on each other, where that closes open seams or joins blocks that touch) [default: safe].
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    repair: Option<RepairLevel>,
    /// How far apart points may be that weld makes one, in model units; less than the shortest edge [default: 0].
    #[arg(long, value_name = "X", value_parser = distance)]
    weld_distance: Option<f64>,
}

fn level(text: &str) -> Result<RepairLevel> {
    named(text, &RepairLevel::ALL.map(|level| (level.name(), level)))
}

fn distance(text: &str) -> Result<f64> {
    let number = text.trim().parse().ok().filter(|x: &f64| *x >= 0.0 && x.is_finite());
    number.context("it must be a number that is not negative")
}

impl RepairOptions {
    /// The level. Ends the program if the options contradict each other.
    pub fn level(&self) -> RepairLevel {
        match (self.repair.unwrap_or_default(), self.weld_distance) {
            (level, None) => level,
            (RepairLevel::Weld { .. }, Some(distance)) => RepairLevel::Weld { distance },
            _ => super::refuse_usage("--weld-distance goes with --repair weld"),
        }
    }
}

/// What was done to the mesh, and what of it is kept though it is unusual.
#[derive(Serialize)]
pub struct Repair {
    level: &'static str,
    weld_distance: f64,
    merged_points: usize,
    welded_points: usize,
    differing_values: usize,
    collapsed_tetrahedra: usize,
    duplicate_tetrahedra: usize,
    turned_tetrahedra: usize,
    flat_tetrahedra: usize,
    unused_points: usize,
    /// What was found and kept, in words.
    pub kept: String,
    components: usize,
    non_manifold_edges: usize,
    non_manifold_vertices: usize,
    open_seam_faces: usize,
    weldable_faces: usize,
}

impl Repair {
    /// Of a mesh that was mended; none of points without cells.
    pub fn of(mesh: &TetMesh, level: RepairLevel, done: &RepairReport) -> Result<Option<Self>> {
        if mesh.tets.is_empty() {
            return Ok(None);
        }
        let found = findings(mesh, level.weld_distance())?;
        Ok(Some(Self {
            level: level.name(),
            weld_distance: level.weld_distance(),
            merged_points: done.merged_points,
            welded_points: done.welded_points,
            differing_values: done.differing_values,
            collapsed_tetrahedra: done.collapsed_tets,
            duplicate_tetrahedra: done.duplicate_tets,
            turned_tetrahedra: done.turned_tets,
            flat_tetrahedra: done.flat_tets,
            unused_points: done.unused_points,
            kept: found.to_string(),
            components: found.components,
            non_manifold_edges: found.non_manifold_edges,
            non_manifold_vertices: found.non_manifold_vertices,
            open_seam_faces: found.open_seam_faces,
            weldable_faces: found.weldable_faces,
        }))
    }
}
