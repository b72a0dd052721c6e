//! The mesh that an MT makes of points, as if it had been the input.

use super::fronts::{fresh, satisfy};
use super::mesh_checks::PlainMesh;
use super::queries::Query;
use super::same::volume;
use tetralod::mesh::TetMesh;
use tetralod::mt::ApplyUpdates;
use tetralod::refine::Request;

/// The points and fields of `input` with the tetrahedra of the mesh at error 0, which must have just these points.
/// If the input has tetrahedra, the two must have the same volume.
pub fn triangulated(mt: &impl ApplyUpdates, input: &TetMesh) -> Result<TetMesh, String> {
    let mut front = fresh(mt)?;
    satisfy(mt, &mut front, &Query::new("full refinement", Request::within(0.0)))?;
    let mesh = PlainMesh::of(front.mesh());
    let info = mt.info();
    let places: Vec<[i32; 3]> = input.positions.iter().map(|p| info.lattice.nearest(*p)).collect();
    let mut levels: Vec<Vec<i32>> = vec![Vec::new(); places.len()];
    for field in &info.fields {
        let found = input.fields.iter().find(|f| field.is_of(f) && f.values.len() == places.len());
        let values = &found.ok_or_else(|| format!("the input has no field '{}'", field.name))?.values;
        levels.iter_mut().zip(values).for_each(|(levels, &value)| levels.push(field.nearest(value)));
    }
    let theirs = sorted(&places, |v| &levels[v as usize]);
    let ours = sorted(mesh.positions, |v| front.mesh().levels(v));
    let place = |&v: &u32| (places[v as usize], &levels[v as usize][..]);
    let slot = |&v: &u32| (mesh.positions[v as usize], front.mesh().levels(v));
    if ours.len() != theirs.len() || !ours.iter().map(slot).eq(theirs.iter().map(place)) {
        let (ours, theirs) = (ours.len(), theirs.len());
        return Err(format!("full refinement: the {ours} vertices are not the {theirs} points of the input"));
    }
    let mut point = vec![0; ours.len()];
    ours.iter().zip(&theirs).for_each(|(&v, &p)| point[v as usize] = p);
    let volumes = [volume(mesh.positions, mesh.tets), volume(&places, &input.tets)];
    if !input.tets.is_empty() && volumes[0] != volumes[1] {
        let [ours, theirs] = volumes;
        return Err(format!("full refinement: the volume times six is {ours}, that of the input {theirs}"));
    }
    let tets = mesh.tets.iter().map(|tet| tet.map(|v| point[v as usize])).collect();
    // Insertion measures errors on the lattice.
    let positions = places.iter().map(|&q| info.lattice.point(q)).collect();
    Ok(TetMesh { positions, tets, ..input.clone() })
}

/// The vertices in the order of their positions, then of their levels.
fn sorted<'l>(positions: &[[i32; 3]], levels: impl Fn(u32) -> &'l [i32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (positions[v as usize], levels(v), v));
    order
}
