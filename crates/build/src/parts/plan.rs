//! What all steps know of the whole.

use super::PartsError;
use crate::{BuildConfig, Construction, Purpose};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use tetralod::geom::Lattice;
use tetralod::mesh::{Averaged, Difference, Extreme, Extremes, VectorPart};
use tetralod::mt::{FieldInfo, MtInfo, MtKind, RegionInfo, Regions};

/// Most parts of a plan.
pub const MOST_PARTS: u32 = 4096;

/// So many are joined at a time, halves along each of three axes: but the last so many in two steps. What a join has in memory is what is left at
/// planes between nodes. For the last eight these are three across the whole, two of which are joined first, in each half, and then one.
const JOINED: u32 = 8;

/// What an MT is built for in so many parts, if it is.
pub(super) fn purpose(config: &BuildConfig, parts: u32) -> Result<Purpose, PartsError> {
    let Construction::HalfEdge { purpose } = config.construction else { return Err(PartsError::Kind) };
    if parts.is_power_of_two() && parts <= MOST_PARTS {
        Ok(purpose)
    } else {
        Err(PartsError::Count { parts })
    }
}

/// What is made by one step: at level 0 the parts, numbered so that those that are joined follow one another; above them what those
/// of the level below become ([`Plan::children`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Node {
    /// The level, 0 for the parts.
    pub level: u32,
    /// The number in its level, from 0.
    pub index: u32,
}

/// How many nodes each level has of so many parts.
pub(crate) fn levels(parts: u32) -> Vec<u32> {
    let above = |&nodes: &u32| match nodes {
        0 | 1 => None,
        2 => Some(1),
        3..=JOINED => Some(2),
        _ => Some((nodes / JOINED).max(JOINED)),
    };
    std::iter::successors(Some(parts), above).collect()
}

/// How a volume is parted, and all that the steps have to know of the whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    pub(super) parts: u32,
    /// The checksum of the input, so that parts of different inputs are told apart.
    pub(super) input: u32,
    pub(super) lattice: ([f64; 3], [f64; 3], u32),
    /// The sides of the domain, in its steps.
    pub(super) sides: [i32; 3],
    pub(super) fields: Vec<PlanField>,
    /// Reference vertices and tetrahedra of the whole.
    pub(super) counts: (u32, u64),
    pub(super) displacement_per_error: f64,
    pub(super) displacement_edges: f64,
    pub(super) quantization: f64,
    /// The least dihedral angle and the angle of features, in degrees.
    pub(super) angles: [Option<f64>; 2],
    /// The regions that are kept apart.
    pub(super) regions: Option<PlanRegions>,
    pub(super) for_regions: bool,
    pub(super) block_bits: u32,
    pub(super) metadata: BTreeMap<String, String>,
}

/// A field of the whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlanField {
    name: String,
    range: [f64; 2],
    lattice: (f64, f64, u32),
    unit: String,
    vector: Option<(String, Option<u8>)>,
    is_label: bool,
    time: Option<f64>,
    quantization: f64,
    extremes: Option<PlanExtremes>,
    /// Those of the input at cells, and by how much averaging them differs.
    averaged: Option<(PlanExtremes, [f64; 2])>,
    /// Whether its exact values are kept.
    pub lossless: bool,
    /// Whether it has a value for each region.
    pub jumps: bool,
}

/// The smallest and the largest value: each with its place, and the number and the part of its cell.
type PlanExtremes = [(f64, [f64; 3], Option<u32>, Option<String>); 2];

fn of_extremes(extremes: &Extremes) -> PlanExtremes {
    extremes.both().map(|Extreme { value, place, cell, part }| (*value, *place, *cell, part.clone()))
}

fn extremes_of(stored: &PlanExtremes) -> Extremes {
    let [min, max] = stored.each_ref().map(|(value, place, cell, part)| Extreme {
        value: *value,
        place: *place,
        cell: *cell,
        part: part.clone(),
    });
    Extremes { min, max }
}

impl PlanField {
    pub fn new(field: &FieldInfo, lossless: bool, jumps: bool) -> Self {
        Self {
            name: field.name.clone(),
            range: [field.min, field.max],
            lattice: (field.origin, field.step, field.bits),
            unit: field.unit.clone(),
            vector: field.vector.as_ref().map(|vector| (vector.name.clone(), vector.component)),
            is_label: field.is_label,
            time: field.time,
            quantization: field.quantization,
            extremes: field.extremes.as_ref().map(of_extremes),
            averaged: field.averaged.as_ref().map(|Averaged { input, difference }| {
                (of_extremes(input), [difference.rms, difference.largest])
            }),
            lossless,
            jumps,
        }
    }

    fn info(&self) -> FieldInfo {
        let vector = self.vector.as_ref();
        let (origin, step, bits) = self.lattice;
        FieldInfo {
            name: self.name.clone(),
            min: self.range[0],
            max: self.range[1],
            origin,
            step,
            bits,
            unit: self.unit.clone(),
            vector: vector.map(|(name, component)| VectorPart { name: name.clone(), component: *component }),
            is_label: self.is_label,
            time: self.time,
            quantization: self.quantization,
            extremes: self.extremes.as_ref().map(extremes_of),
            averaged: self.averaged.as_ref().map(|(input, [rms, largest])| Averaged {
                input: extremes_of(input),
                difference: Difference { rms: *rms, largest: *largest },
            }),
        }
    }
}

/// Regions of the whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlanRegions {
    arrays: Vec<String>,
    /// The name, the labels and the tetrahedra of each.
    all: Vec<(String, Vec<i64>, u64)>,
}

impl PlanRegions {
    pub fn new(regions: &Regions) -> Self {
        let region = |region: &RegionInfo| (region.name.clone(), region.labels.clone(), region.tetrahedra);
        Self { arrays: regions.arrays.clone(), all: regions.all.iter().map(region).collect() }
    }

    /// The regions, with those of the tetrahedra that are left; none if there are not so many.
    pub fn of_base(&self, left: &[u32]) -> Option<Regions> {
        let region = |(name, labels, tetrahedra): &(String, Vec<i64>, u64)| RegionInfo {
            name: name.clone(),
            labels: labels.clone(),
            tetrahedra: *tetrahedra,
            ..RegionInfo::default()
        };
        let number =
            |&region: &u32| u16::try_from(region).ok().filter(|&region| usize::from(region) < self.all.len());
        let of_base = left.iter().map(number).collect::<Option<_>>()?;
        // Parts keep interfaces as they are.
        let (arrays, all, deviation) = (self.arrays.clone(), self.all.iter().map(region).collect(), 0.0);
        Some(Regions { arrays, all, of_base, deviation, ..Regions::default() })
    }
}

impl Plan {
    pub(super) fn new(
        info: &MtInfo,
        config: &BuildConfig,
        purpose: Purpose,
        (parts, input, sides): (u32, u32, [i32; 3]),
        (regions, jumps): (Option<PlanRegions>, &[bool]),
        metadata: BTreeMap<String, String>,
    ) -> Self {
        let is_lossless = |field: &FieldInfo| {
            let of_vector = |name: &String| field.vector.as_ref().is_some_and(|vector| vector.name == *name);
            config.all_lossless || config.lossless.iter().any(|name| field.name == *name || of_vector(name))
        };
        let field = |(f, field): (usize, &FieldInfo)| {
            PlanField::new(field, is_lossless(field), jumps.get(f).is_some_and(|jumps| *jumps))
        };
        let Lattice { origin, step, bits } = info.lattice;
        Self {
            parts,
            input,
            lattice: (origin, step, bits),
            sides,
            fields: info.fields.iter().enumerate().map(field).collect(),
            counts: (info.vertices, info.tetrahedra),
            displacement_per_error: info.displacement_per_error,
            displacement_edges: config.displacement_edges,
            quantization: info.quantization,
            angles: [config.min_dihedral, config.feature_angle],
            regions,
            for_regions: purpose == Purpose::Regions,
            block_bits: config.block_bits.clamp(4, 16),
            metadata,
        }
    }

    /// For each field whether it has a value for each region; empty if none does.
    pub(super) fn jumps(&self) -> Vec<bool> {
        let jumps: Vec<bool> = self.fields.iter().map(|field| field.jumps).collect();
        if jumps.contains(&true) { jumps } else { Vec::new() }
    }

    /// How many regions are kept apart.
    pub(super) fn region_count(&self) -> u32 {
        self.regions.as_ref().map_or(0, |regions| regions.all.len() as u32)
    }

    /// How many parts there are.
    pub fn parts(&self) -> u32 {
        self.parts
    }

    /// The points and tetrahedra of the whole.
    pub fn counts(&self) -> [u64; 2] {
        let (vertices, tetrahedra) = self.counts;
        [vertices.into(), tetrahedra]
    }

    /// What the file is to say of itself, as it was given to [`part`](super::part).
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// How many nodes each level has. The last ones have eight, two and one, as far as there are so many parts; below these, eight make one
    /// of the next level, or as few as leave eight.
    pub fn levels(&self) -> Vec<u32> {
        levels(self.parts)
    }

    /// All nodes, coarse to fine: the last one to be joined first.
    pub fn nodes(&self) -> Vec<Node> {
        let levels = self.levels();
        let of_level =
            |level: usize| (0..levels[level]).map(move |index| Node { level: level as u32, index });
        (0..levels.len()).rev().map(of_level).fold(Vec::new(), |mut all, nodes| {
            all.extend(nodes);
            all
        })
    }

    /// The nodes of the level below that make a node.
    ///
    /// # Errors
    /// If there is no such node; if it is of level 0.
    pub fn children(&self, node: Node) -> Result<Vec<Node>, PartsError> {
        let below = node.level.checked_sub(1).filter(|_| self.has(node));
        let level = below.ok_or(PartsError::NoNode { level: node.level, index: node.index })?;
        Ok(self.below(node, level).map(|index| Node { level, index }).collect())
    }

    /// The nodes of a level below of which a node consists.
    fn below(&self, node: Node, level: u32) -> Range<u32> {
        let levels = self.levels();
        let each = levels[level as usize] / levels[node.level as usize];
        node.index * each..(node.index + 1) * each
    }

    /// How many nodes there are of the level of a node; 0 if there is no such level.
    pub(super) fn beside(&self, node: Node) -> u32 {
        self.levels().get(node.level as usize).copied().unwrap_or(0)
    }

    pub(super) fn has(&self, node: Node) -> bool {
        node.index < self.beside(node)
    }

    /// Whether a node is the last one to be joined.
    pub(super) fn is_whole(&self, node: Node) -> bool {
        node.level as usize + 1 == self.levels().len()
    }

    /// The parts that a node consists of.
    pub(super) fn parts_of(&self, node: Node) -> Range<u32> {
        self.below(node, 0)
    }

    /// What is known of the MT; not how many updates it has.
    pub(super) fn info(&self) -> MtInfo {
        let (origin, step, bits) = self.lattice;
        MtInfo {
            kind: MtKind::HalfEdge,
            lattice: Lattice { origin, step, bits },
            fields: self.fields.iter().map(PlanField::info).collect(),
            vertices: self.counts.0,
            tetrahedra: self.counts.1,
            updates: 0,
            displacement_per_error: self.displacement_per_error,
            quantization: self.quantization,
            bounds: None,
        }
    }

    /// By which angles the mesh is restricted. Regions and points that stay come with the parts.
    pub(super) fn restricting(&self) -> BuildConfig {
        let [min_dihedral, feature_angle] = self.angles;
        BuildConfig { min_dihedral, feature_angle, ..BuildConfig::default() }
    }

    pub(super) fn purpose(&self) -> Purpose {
        if self.for_regions { Purpose::Regions } else { Purpose::Uniform }
    }
}
