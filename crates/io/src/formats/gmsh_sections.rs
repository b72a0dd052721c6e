//! The nodes and elements of Gmsh's meshes, in the layouts of each version.

use crate::error::ReadReason;
use crate::formats::gmsh_cells::{Element, element};
use crate::formats::gmsh_layout::{Numbers, Version};
use crate::formats::gmsh_mesh::Mesh;

impl Numbers<'_, '_> {
    /// The rest of an entity behind its tag: its place of so many numbers, its physical group, which is returned, and its boundary.
    fn rest_of_entity(&mut self, dimension: usize, place: usize) -> Result<Option<i64>, ReadReason> {
        for _ in 0..place {
            self.float()?;
        }
        let group = self.first_tag()?;
        if dimension > 0 {
            self.first_tag()?;
        }
        Ok(group)
    }

    /// The first tag of a list, if it has one. Where the sign says how an entity is turned, it is left out.
    fn first_tag(&mut self) -> Result<Option<i64>, ReadReason> {
        let mut first = None;
        for _ in 0..self.count()? {
            let tag = self.int()?;
            first = first.or(Some(tag.saturating_abs()));
        }
        Ok(first)
    }
}

/// Reads `$Entities` of versions 4.0 and 4.1 up to its end: the physical groups of volumes, the first one of each.
pub(super) fn read_entities(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<(), ReadReason> {
    numbers.end_line();
    for (dimension, count) in numbers.entities()?.into_iter().enumerate() {
        // A point has a place, all others, and the points of version 4.0, a box.
        let floats = if dimension == 0 && numbers.layout.version == Version::FourOne { 3 } else { 6 };
        for _ in 0..count {
            let tag = numbers.int()?;
            let group = numbers.rest_of_entity(dimension, floats)?;
            if dimension == 3 {
                mesh.groups.insert(tag, group);
            }
        }
    }
    if mesh.groups.values().all(Option::is_none) {
        mesh.groups.clear();
    }
    Ok(())
}

/// Reads `$PartitionedEntities` of version 4.1 up to its end: of which volume each partition is, and its physical group.
pub(super) fn read_partitions(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<(), ReadReason> {
    numbers.end_line();
    numbers.count()?;
    for _ in 0..numbers.count()? {
        // A ghost entity and its partition.
        numbers.int()?;
        numbers.int()?;
    }
    for (dimension, count) in numbers.entities()?.into_iter().enumerate() {
        for _ in 0..count {
            let (tag, parent_dimension, parent) = (numbers.int()?, numbers.int()?, numbers.int()?);
            numbers.first_tag()?;
            let group = numbers.rest_of_entity(dimension, if dimension == 0 { 3 } else { 6 })?;
            if dimension == 3 && parent_dimension == 3 {
                mesh.partitions.insert(tag, (parent, group));
            }
        }
    }
    Ok(())
}

/// Reads `$Nodes` up to its end.
pub(super) fn read_nodes(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<(), ReadReason> {
    if numbers.layout.version != Version::Two {
        numbers.end_line();
        return read_node_blocks(mesh, numbers);
    }
    let count = numbers.count()?;
    numbers.end_line();
    for _ in 0..count {
        let tag = numbers.tag()?;
        add_node(mesh, numbers, tag, 0)?;
    }
    Ok(())
}

fn read_node_blocks(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<(), ReadReason> {
    let is_newest = numbers.layout.version == Version::FourOne;
    let blocks = numbers.count()?;
    for _ in 0..if is_newest { 3 } else { 1 } {
        numbers.wide()?;
    }
    for _ in 0..blocks {
        let (dimension, _) = numbers.entity()?;
        let parametric = numbers.int()? != 0;
        let count = numbers.count()?;
        // Version 4.0 always writes three parameters.
        let parameters = match (parametric, is_newest) {
            (false, _) => 0,
            (true, true) => dimension.clamp(0, 3),
            (true, false) => 3,
        };
        if is_newest {
            // All tags come first.
            let mut tags = Vec::with_capacity(numbers.file.capacity(count));
            for _ in 0..count {
                tags.push(numbers.wide()?);
            }
            for tag in tags {
                add_node(mesh, numbers, tag, parameters)?;
            }
            continue;
        }
        for _ in 0..count {
            let tag = numbers.tag()?;
            add_node(mesh, numbers, tag, parameters)?;
        }
    }
    Ok(())
}

/// Adds a node, whose coordinates come next.
fn add_node(
    mesh: &mut Mesh<'_>,
    numbers: &mut Numbers<'_, '_>,
    tag: i64,
    parameters: i64,
) -> Result<(), ReadReason> {
    for _ in 0..3 {
        mesh.draft.coordinates.push(numbers.float()?);
    }
    for _ in 0..parameters {
        numbers.float()?;
    }
    if mesh.nodes.insert(tag, mesh.nodes.len()).is_some() {
        return Err(ReadReason::Syntax(format!("node {tag} twice")));
    }
    Ok(())
}

/// Reads `$Elements` up to its end.
pub(super) fn read_elements(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<(), ReadReason> {
    match numbers.layout.version {
        Version::Two if numbers.layout.binary => {
            let count = numbers.count()?;
            numbers.end_line();
            let mut done = 0;
            while done < count {
                done += read_binary_block(mesh, numbers)?;
            }
        }
        Version::Two => {
            for _ in 0..numbers.count()? {
                read_element(mesh, numbers)?;
            }
        }
        Version::Four | Version::FourOne => {
            numbers.end_line();
            read_element_blocks(mesh, numbers)?;
        }
    }
    Ok(())
}

/// Elements of version 2 in binary that are of one type and have as many tags; returns how many.
fn read_binary_block(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<usize, ReadReason> {
    let element = known(numbers.int()?)?;
    let count = numbers.int()?;
    let tags = numbers.int()?;
    let positive = usize::try_from(count).ok().filter(|count| *count > 0);
    let count = positive.ok_or_else(|| ReadReason::Syntax(format!("{count} elements in a block")))?;
    for _ in 0..count {
        let tag = numbers.int()?;
        let groups = read_groups(numbers, tags)?;
        add_element(mesh, numbers, element, tag, groups)?;
    }
    Ok(count)
}

/// An element of version 2 as text.
fn read_element(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<(), ReadReason> {
    let tag = numbers.int()?;
    let element = known(numbers.int()?)?;
    let tags = numbers.int()?;
    let groups = read_groups(numbers, tags)?;
    add_element(mesh, numbers, element, tag, groups)
}

/// The physical group and the geometric entity, and other tags.
fn read_groups(numbers: &mut Numbers<'_, '_>, count: i64) -> Result<[Option<i64>; 2], ReadReason> {
    let mut groups = [None; 2];
    for i in 0..count {
        let tag = numbers.int()?;
        if let Some(group) = usize::try_from(i).ok().and_then(|i| groups.get_mut(i)) {
            *group = Some(tag);
        }
    }
    Ok(groups)
}

fn read_element_blocks(mesh: &mut Mesh<'_>, numbers: &mut Numbers<'_, '_>) -> Result<(), ReadReason> {
    let blocks = numbers.count()?;
    for _ in 0..if numbers.layout.version == Version::FourOne { 3 } else { 1 } {
        numbers.wide()?;
    }
    for _ in 0..blocks {
        let (_, entity) = numbers.entity()?;
        let (entity, of_partition) = mesh.partitions.get(&entity).copied().unwrap_or((entity, None));
        // What is in no group is in group 0, as version 2 has it.
        let group = mesh.groups.get(&entity).map(|group| group.unwrap_or(0));
        let group = of_partition.or(group);
        let element = known(numbers.int()?)?;
        for _ in 0..numbers.count()? {
            let tag = numbers.tag()?;
            add_element(mesh, numbers, element, tag, [group, Some(entity)])?;
        }
    }
    Ok(())
}

fn known(kind: i64) -> Result<Element, ReadReason> {
    element(kind).ok_or_else(|| {
        ReadReason::unsupported(
            format!("elements of type {kind}"),
            "save the mesh with elements of the first or second order",
        )
    })
}

/// Adds an element, whose points come next, if it has a volume.
fn add_element(
    mesh: &mut Mesh<'_>,
    numbers: &mut Numbers<'_, '_>,
    element: Element,
    tag: i64,
    [physical, entity]: [Option<i64>; 2],
) -> Result<(), ReadReason> {
    let mut points = Vec::with_capacity(element.points);
    for _ in 0..element.points {
        points.push(numbers.tag()?);
    }
    let Some((kind, order)) = element.cell else {
        mesh.draft.add_flat(element.flat, 1);
        return Ok(());
    };
    if let Some(element_nodes) = &mut mesh.element_nodes {
        element_nodes.insert(tag, points.clone());
    }
    for point in &mut points {
        let index = mesh.nodes.get(point);
        *point = *index.ok_or_else(|| ReadReason::Missing(format!("node {point}")))? as i64;
    }
    mesh.draft.add_cell(kind, order.iter().map(|&p| points[p]));
    mesh.cell_tags.push(tag);
    mesh.entities.extend(entity.map(|entity| entity as f64));
    mesh.physical.extend(physical.map(|group| group as f64));
    // Where some elements have no such number, none is kept.
    let cells = mesh.draft.cells();
    if mesh.entities.len() < cells {
        mesh.entities.clear();
    }
    if mesh.physical.len() < cells {
        mesh.physical.clear();
    }
    Ok(())
}
