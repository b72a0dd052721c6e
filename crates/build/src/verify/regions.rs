//! Checks that regions are those of the input, and that their interfaces stay in all meshes.

use super::mesh_checks::{PlainMesh, PlainReference};
use crate::restrict::region_labels::labels;
use std::collections::BTreeMap;
use tetralod::mesh::{FACES, NONE, TetMesh};
use tetralod::mt::Regions;

/// What the interfaces between regions must be like in every mesh.
pub struct KeptRegions<'a> {
    regions: &'a Regions,
    interfaces: Interfaces,
}

/// For each two regions that touch, what depends on nothing but which points their interface has, exactly: six times the signed volume between
/// it and the origin, and twice its area as a vector, in steps of the lattice.
type Interfaces = BTreeMap<[u16; 2], [i128; 4]>;

impl<'a> KeptRegions<'a> {
    /// Of regions in the base mesh.
    pub fn of(regions: &'a Regions, base: &PlainMesh<'_>) -> Result<Self, String> {
        Ok(Self { regions, interfaces: interfaces(regions, base)? })
    }

    /// Checks the reference mesh: each of its tetrahedra has the labels that it has in the input, which is on the lattice as `expected`.
    pub fn check_reference(
        &self,
        reference: &PlainMesh<'_>,
        (expected, input): (&PlainReference<'_>, &TetMesh),
    ) -> Result<(), String> {
        self.check(reference)?;
        let of = reference.mesh.regions();
        let known = |region: &u16| &self.regions.all[usize::from(*region)];
        let stated = self.regions.all.iter().map(|region| (&region.labels, region.tetrahedra));
        if count(of.iter().map(|region| &known(region).labels)) != stated.collect() {
            return Err("regions do not have as many tetrahedra as the file says".to_owned());
        }
        let labels = labels_of(input, &self.regions.arrays)?;
        let found = of.iter().map(|region| &known(region).labels[..]);
        let found = placed(reference.positions, reference.tets, found);
        let expected = placed(expected.positions, expected.tets, labels.iter().map(|labels| &labels[..]));
        if found == expected { Ok(()) } else { Err("the regions are not those of the input".to_owned()) }
    }

    /// Checks a mesh: each tetrahedron has a region, and each interface is the same set of points, unless they may move.
    pub fn check(&self, mesh: &PlainMesh<'_>) -> Result<(), String> {
        let found = interfaces(self.regions, mesh)?;
        if self.regions.deviation > 0.0 || found == self.interfaces {
            return Ok(());
        }
        let mut pairs = self.interfaces.keys().chain(found.keys());
        let other = pairs.find(|pair| found.get(*pair) != self.interfaces.get(*pair)).copied();
        let [a, b] = other.unwrap_or_default().map(|region| &self.regions.all[usize::from(region)].name);
        Err(format!("the interface between regions {a} and {b} has changed"))
    }
}

/// The labels of each tetrahedron of the input.
pub(super) fn labels_of(input: &TetMesh, arrays: &[String]) -> Result<Vec<Vec<i64>>, String> {
    let arrays = arrays.iter().map(|name| labels(input, name)).collect::<Result<Vec<_>, _>>();
    let arrays = arrays.map_err(|error| format!("the input: {error}"))?;
    Ok((0..input.tets.len()).map(|t| arrays.iter().map(|array| array[t]).collect()).collect())
}

fn count<T: Ord>(all: impl Iterator<Item = T>) -> BTreeMap<T, u64> {
    let mut counts = BTreeMap::new();
    all.for_each(|one| *counts.entry(one).or_insert(0) += 1);
    counts
}

/// Tetrahedra by the places of their corners, each with its labels; in an order that does not depend on that of the list.
fn placed<'l>(
    positions: &[[i32; 3]],
    tets: &[[u32; 4]],
    labels: impl Iterator<Item = &'l [i64]>,
) -> Vec<([[i32; 3]; 4], &'l [i64])> {
    let corners = |tet: &[u32; 4]| {
        let mut corners = tet.map(|v| positions[v as usize]);
        corners.sort_unstable();
        corners
    };
    let mut all: Vec<_> = tets.iter().map(corners).zip(labels).collect();
    all.sort_unstable();
    all
}

fn interfaces(regions: &Regions, mesh: &PlainMesh<'_>) -> Result<Interfaces, String> {
    let of = mesh.mesh.regions();
    if of.len() != mesh.tets.len() {
        return Err(format!("{} of {} tetrahedra have a region", of.len(), mesh.tets.len()));
    }
    if let Some(region) = of.iter().find(|region| usize::from(**region) >= regions.all.len()) {
        return Err(format!("there is no region {region}"));
    }
    let mut interfaces = Interfaces::new();
    for (t, (tet, around)) in mesh.tets.iter().zip(mesh.neighbors).enumerate() {
        for (face, &n) in FACES.iter().zip(around).filter(|(_, n)| **n != NONE) {
            let pair = [of[t], of[n as usize]];
            // Once, seen from the region with the smaller number.
            if pair[0] < pair[1] {
                let [a, b, c] = face.map(|k| mesh.positions[tet[k] as usize].map(i128::from));
                let minor = |p: [i128; 3], q: [i128; 3], k: usize| {
                    let [i, j] = [(k + 1) % 3, (k + 2) % 3];
                    p[i] * q[j] - p[j] * q[i]
                };
                let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
                let sums = interfaces.entry(pair).or_default();
                (0..3).for_each(|k| {
                    sums[k] += minor(u, v, k);
                    sums[3] += a[k] * minor(b, c, k);
                });
            }
        }
    }
    // Faces that lie on each other from both sides cancel.
    interfaces.retain(|_, sums| *sums != [0; 4]);
    Ok(interfaces)
}
