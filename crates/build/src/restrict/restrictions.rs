//! What a configuration forbids beside what would make a mesh wrong: cells that are thin, regions that change, points that go.

use crate::change::hole::{Filling, Hole};
use crate::change::work_mesh::WorkMesh;
use crate::geometry::dihedral::LeastAngle;
use crate::geometry::flat::Feature;
use crate::lattice::quantize::Quantized;
use crate::restrict::preserve::{Regions, kept_points};
use crate::{BuildConfig, BuildCriterion, BuildError, Method};
use tetralod::mesh::TetMesh;
use tetralod::mt;

/// The restrictions of a build; none by default, and then nothing is looked at.
#[derive(Default)]
pub(crate) struct Restrictions {
    pub feature: Feature,
    angle: Option<LeastAngle>,
    regions: Option<Regions>,
    /// The points that stay; empty if all may go.
    kept: Vec<bool>,
}

impl Restrictions {
    /// What `config` restricts in the removal of vertices of `mesh`.
    pub fn of(
        config: &BuildConfig,
        mesh: &TetMesh,
        quantized: &Quantized,
        criterion: BuildCriterion,
    ) -> Result<Self, BuildError> {
        if criterion == BuildCriterion::Delaunay && !config.preserve.is_empty() {
            return Err(cannot_preserve(format!("criterion {}", criterion.name())));
        }
        Ok(Self {
            feature: Feature::of(config)?,
            angle: LeastAngle::of(config, quantized)?,
            regions: Regions::of(config, mesh, quantized)?,
            kept: kept_points(config, mesh)?,
        })
    }

    /// The angles that `config` restricts, and no more.
    pub fn of_angles(config: &BuildConfig, quantized: &Quantized) -> Result<Self, BuildError> {
        let (feature, angle) = (Feature::of(config)?, LeastAngle::of(config, quantized)?);
        Ok(Self { feature, angle, ..Self::default() })
    }

    /// The restrictions with the region of each tetrahedron, and with points that stay; none of these if there are none.
    pub fn with(self, regions: Vec<u32>, kept: Vec<bool>) -> Self {
        Self { regions: Regions::known(regions), kept, ..self }
    }

    /// The region of each tetrahedron; nothing if none are kept apart.
    pub fn regions(&self) -> &[u32] {
        self.regions.as_ref().map_or(&[], Regions::all)
    }

    /// What is known of the regions; nothing if none are kept apart.
    pub fn region_table(&self) -> Option<&mt::Regions> {
        self.regions.as_ref().map(Regions::table)
    }

    /// What is known of the regions, with that of each tetrahedron that is left, those that begin with [`NONE`](tetralod::mesh::NONE) being gone;
    /// none if none are kept apart.
    pub fn take_regions(&mut self, tets: &[[u32; 4]]) -> Option<mt::Regions> {
        Some(self.regions.take()?.finish(tets))
    }

    /// Whether what they allow depends on more than a hole and what fills it.
    pub fn look_beyond_holes(&self) -> bool {
        self.regions.is_some()
    }

    /// Whether a point must stay where it is.
    pub fn keeps(&self, v: u32) -> bool {
        self.kept.get(v as usize).is_some_and(|kept| *kept)
    }

    /// Whether a hole may be filled by moving its vertex to `b`.
    pub fn allow_contraction(
        &self,
        (hole, b): (&Hole, u32),
        filling: &Filling,
        mesh: &WorkMesh,
        positions: &[[i32; 3]],
    ) -> bool {
        self.regions.as_ref().is_none_or(|regions| regions.stay(hole, b, mesh, positions))
            && self.allow_filling(hole, filling, positions)
    }

    /// Whether the cells of a filling are good enough for the hole.
    pub fn allow_filling(&self, hole: &Hole, filling: &Filling, positions: &[[i32; 3]]) -> bool {
        let Some(angle) = &self.angle else { return true };
        let at = |tet: [u32; 4]| tet.map(|v| positions[v as usize]);
        let old = hole.faces.iter().map(|&([x, y, z], _)| at([x, y, z, hole.a]));
        angle.allows(old, filling.tets.iter().copied().map(at))
    }

    /// A hole has been filled by moving its vertex to `end`; `slots` are the numbers of the tetrahedra that fill it.
    pub fn contracted(&mut self, hole: &Hole, end: u32, slots: &[u32], positions: &[[i32; 3]]) {
        if let Some(regions) = &mut self.regions {
            regions.contracted(hole, end, slots, positions);
        }
    }

    /// Tetrahedra have new numbers: their places in this list of the old ones, which ascend.
    pub fn renumber(&mut self, live: &[u32]) {
        if let Some(regions) = &mut self.regions {
            regions.renumber(live);
        }
    }

    /// Whether interfaces between regions may move.
    pub fn may_move_interfaces(&self) -> bool {
        self.regions.as_ref().is_some_and(Regions::may_change)
    }

    /// How far interfaces between regions have moved, in model units.
    pub fn interface_deviation(&self) -> f64 {
        self.regions.as_ref().map_or(0.0, Regions::deviation)
    }
}

/// Only moving a vertex to a neighbour says which region each new tetrahedron is of.
pub(crate) fn cannot_preserve(other: String) -> BuildError {
    BuildError::Combination {
        which: ["keeping regions".to_owned(), other],
        instead: "regions are kept by method decimate with criterion half-edge, which is the default",
    }
}

/// Refuses restrictions of insertion, which makes other cells than those of the input.
pub(crate) fn check(config: &BuildConfig) -> Result<(), BuildError> {
    let BuildConfig { min_dihedral, feature_angle, preserve, keep_points, .. } = config;
    let given = [
        (min_dihedral.is_some(), "a least dihedral angle"),
        (feature_angle.is_some(), "an angle of features"),
        (!preserve.is_empty(), "keeping regions"),
        (!keep_points.is_empty(), "keeping points"),
    ];
    match given.iter().find(|(is_given, _)| *is_given) {
        Some((_, what)) if config.construction.method() == Method::Insert => Err(BuildError::Combination {
            which: [(*what).to_owned(), format!("method {}", Method::Insert.name())],
            instead: "it goes with methods decimate and collapse",
        }),
        _ => Ok(()),
    }
}
