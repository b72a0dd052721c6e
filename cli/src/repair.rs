//! Options of repair, and what was done and found, as programs get it.

use super::parse::{named, number};
use anyhow::Result;
use serde::Serialize;
use tetralod::mesh::{MeshFindings, RepairLevel, RepairReport, TetMesh, findings};

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
    number(text, |x| (0.0..f64::INFINITY).contains(&x), "a number that is not negative")
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
    #[serde(flatten)]
    done: RepairReport,
    /// What was found and kept, in words.
    pub kept: String,
    #[serde(flatten)]
    found: MeshFindings,
}

impl Repair {
    /// Of a mesh that was mended; none of points without cells.
    pub fn of(mesh: &TetMesh, level: RepairLevel, done: &RepairReport) -> Result<Option<Self>> {
        if mesh.tets.is_empty() {
            return Ok(None);
        }
        let found = findings(mesh, level.weld_distance())?;
        let (level, weld_distance) = (level.name(), level.weld_distance());
        Ok(Some(Self { level, weld_distance, done: *done, kept: found.to_string(), found }))
    }
}
