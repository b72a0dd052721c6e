//! The input with a point for each region that meets at a point, where fields jump: what the mesh at error 0 must be.

use super::regions::labels_of;
use std::borrow::Cow;
use tetralod::mesh::TetMesh;
use tetralod::mt::Regions;

/// The input as the meshes of an MT have it.
pub struct Split<'a> {
    pub mesh: Cow<'a, TetMesh>,
    /// Its tetrahedra with one vertex for all regions that meet there: the first of these points.
    pub joined: Cow<'a, [[u32; 4]]>,
    /// The region of each point, and whether others meet there; empty where no field jumps.
    pub regions: Vec<(u16, bool)>,
    /// Whether interfaces may have moved: then a point may be in another region.
    pub may_move: bool,
}

/// Splits the points of an input at which regions of an MT meet, if any of its fields jumps there.
pub fn split<'a>(input: &'a TetMesh, regions: Option<&Regions>) -> Result<Split<'a>, String> {
    let Some(regions) = regions.filter(|regions| regions.has_sides()) else {
        let (mesh, joined) = (Cow::Borrowed(input), Cow::Borrowed(&input.tets[..]));
        return Ok(Split { mesh, joined, regions: Vec::new(), may_move: false });
    };
    if input.sides.is_empty() {
        return Err("the input has no values for each region: average its fields at cells so".to_owned());
    }
    let labels = labels_of(input, &regions.arrays)?;
    let number = |labels: &Vec<i64>| {
        let found = regions.all.iter().position(|region| region.labels == *labels);
        found.map(|region| region as u16).ok_or_else(|| format!("the MT has no region {labels:?}"))
    };
    let of_tets = labels.iter().map(number).collect::<Result<Vec<u16>, _>>()?;
    let mut mesh = input.clone();
    let points = input.positions.len();
    let mut of_points: Vec<(u16, bool)> = vec![(u16::MAX, false); points];
    for (tet, &region) in input.tets.iter().zip(&of_tets) {
        tet.iter().for_each(|&v| of_points[v as usize].0 = region.min(of_points[v as usize].0));
    }
    for side in &input.sides {
        mesh.positions.push(input.positions[side.point as usize]);
        of_points[side.point as usize].1 = true;
        of_points.push((of_tets[side.tet as usize], true));
    }
    for field in &mut mesh.fields {
        let further = std::mem::take(&mut field.sides);
        let values = &mut field.values;
        match further.is_empty() {
            true => input.sides.iter().for_each(|side| values.push(values[side.point as usize])),
            false => values.extend(further),
        }
    }
    // Sides are in the order of their points.
    for (tet, &region) in mesh.tets.iter_mut().zip(&of_tets) {
        for v in tet {
            let first = input.sides.partition_point(|side| side.point < *v);
            let own = input.sides[first..].iter().take_while(|side| side.point == *v);
            if let Some(place) = own.map(|side| of_tets[side.tet as usize]).position(|of| of == region) {
                *v = (points + first + place) as u32;
            }
        }
    }
    mesh.sides = Vec::new();
    let (mesh, joined, may_move) =
        (Cow::Owned(mesh), Cow::Borrowed(&input.tets[..]), regions.deviation > 0.0);
    Ok(Split { mesh, joined, regions: of_points, may_move })
}
