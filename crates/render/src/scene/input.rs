//! What the objects of a scene are computed from: a session's mesh as it is now, or one that was kept.

use super::error::Result;
use super::state::ColourState;
use super::styles::{quantity, scale};
use super::{SceneError, SceneState};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::iter;
use tetralod::geom::{Bounds, SingleValues};
use tetralod::mesh::NONE;
use tetralod::mt::{MeshChanges, MtInfo, Regions, numbers_of};
use tetralod::session::{Session, TetQuantity};
use tetralod::view::{ColourScale, Difference, MeshView, region_scale};

/// What was computed last of a session's mesh before any object.
#[derive(Debug, Default)]
pub(super) struct Current {
    changes: MeshChanges,
    /// A number for each tetrahedron, if they are coloured by one.
    tet_values: Vec<f64>,
    /// The field of the mesh without that of the one that was kept, if that is shown.
    difference: Option<Difference>,
    /// Where some points have no difference: how many, the tetrahedra of the others, and their neighbours.
    compared: Option<(usize, [Vec<[u32; 4]>; 2])>,
}

impl Current {
    /// Brings it up to date but for the difference; whether there is anything new.
    pub fn take(&mut self, session: &mut Session, state: &SceneState, is_stale: bool) -> Result<bool> {
        self.changes = session.take_changes();
        let is_new = is_stale || !self.changes.vertices.is_empty() || !self.changes.tets.is_empty();
        if let (true, Some(quantity)) = (is_new, state.cells.as_ref().map_or(Ok(None), quantity)?) {
            quantity_into(session, quantity, &mut self.tet_values)?;
        }
        Ok(is_new)
    }

    /// Takes the field of `other` from that of the mesh, at points that are not farther outside of it than so much. Tetrahedra with another
    /// point are not shown.
    pub fn compare(&mut self, mesh: &MeshView<'_>, other: Option<(MeshView<'_>, f64)>) {
        let had_one = self.difference.take().is_some();
        self.difference = other.and_then(|(other, reach)| Difference::within(mesh, other, reach));
        if had_one || self.difference.is_some() {
            // Each point has another value.
            self.changes.vertices = MeshChanges::of_all_vertices(mesh.positions.len()).vertices;
        }
        let had_some = self.compared.take().is_some();
        self.compared = self.difference.as_ref().and_then(|found| {
            let is_apart = |point: &u32| *point != NONE && found.values[*point as usize].is_nan();
            // Points that no tetrahedron has do not count.
            let apart: BTreeSet<u32> = mesh.tets.as_flattened().iter().copied().filter(is_apart).collect();
            if apart.is_empty() {
                return None;
            }
            let has = |tet: &[u32; 4]| tet[0] != NONE && !tet.iter().any(is_apart);
            let neighbor = |n: u32| if n != NONE && has(&mesh.tets[n as usize]) { n } else { NONE };
            let each = mesh.tets.iter().zip(mesh.neighbors);
            let both = each.map(
                |(tet, beside)| {
                    if has(tet) { (*tet, beside.map(neighbor)) } else { ([NONE; 4], [NONE; 4]) }
                },
            );
            let (tets, neighbors) = both.unzip();
            Some((apart.len(), [tets, neighbors]))
        });
        if had_some || self.compared.is_some() {
            self.changes.tets = iter::once(0..mesh.tets.len() as u32).collect();
        }
    }

    pub fn input<'a>(
        &'a self,
        session: &'a Session,
        info: &'a MtInfo,
        (state, opacities): (&'a SceneState, Vec<f64>),
        bounds: Bounds,
    ) -> Input<'a> {
        let mesh = session.last_view();
        let difference = self.difference.as_ref();
        let coloured = difference.map_or(mesh.field, |difference| &difference.values);
        let [tets, neighbors] = match &self.compared {
            Some((_, [tets, neighbors])) => [&tets[..], &neighbors[..]],
            None => [mesh.tets, mesh.neighbors],
        };
        Input {
            mesh: MeshView {
                field: coloured,
                is_label: mesh.is_label && difference.is_none(),
                tets,
                neighbors,
                ..mesh
            },
            field: mesh.field,
            largest_difference: difference.map(|difference| difference.largest),
            apart: self.compared.as_ref().map_or(0, |(apart, _)| *apart),
            fields: Box::new(move |field| session.values(field).into()),
            tet_values: &self.tet_values,
            regions: session.shown_regions(),
            colors: session.regions().map_or_else(Vec::new, Regions::colors),
            opacities,
            info,
            shown: session.field(),
            isovalue: session.first_isovalue(session.field()),
            state,
            bounds,
            changes: &self.changes,
        }
    }
}

/// A number for each tetrahedron; for regions the values of their colours on [`region_scale`](tetralod::view::region_scale).
pub(super) fn quantity_into(
    session: &mut Session,
    quantity: TetQuantity,
    values: &mut Vec<f64>,
) -> Result<()> {
    session.tet_quantity_into(quantity, values)?;
    if let (TetQuantity::Region, Some(colors)) = (quantity, session.regions().map(Regions::colors)) {
        values.iter_mut().for_each(|value| *value = f64::from(colors[*value as usize]) + 0.5);
    }
    Ok(())
}

/// The opacity of the boundary of each region, where some have one of their own; else nothing.
pub(super) fn region_opacities(state: &SceneState, regions: Option<&Regions>) -> Result<Vec<f64>> {
    let Some(boundary) = state.boundary.as_ref().filter(|boundary| !boundary.region_opacities.is_empty())
    else {
        return Ok(Vec::new());
    };
    let names: Vec<String> = boundary.region_opacities.keys().cloned().collect();
    let error = |(_, problem)| SceneError::state("boundary.regionOpacities", problem);
    let numbers = numbers_of(regions, &names).map_err(error)?;
    let mut all = vec![boundary.opacity; regions.map_or(0, |regions| regions.all.len())];
    for (number, opacity) in numbers.into_iter().zip(boundary.region_opacities.values()) {
        all[usize::from(number)] = *opacity;
    }
    Ok(all)
}

/// The number of the field with a name, of the time step that is shown if it has that; that of the mesh without one. `what` asks for it.
pub(super) fn field_number(info: &MtInfo, shown: usize, what: &str, name: Option<&String>) -> Result<usize> {
    let Some(name) = name else { return Ok(shown) };
    info.step_of(name, shown).ok_or_else(|| {
        let names = info.fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>();
        let problem = format!("there is no field {name:?}; this volume has: {}", names.join(", "));
        SceneError::state(what, problem)
    })
}

/// What the objects are computed from.
pub(super) struct Input<'a> {
    /// The mesh whose field colours things: a field of its own, or the difference to another mesh.
    pub mesh: MeshView<'a>,
    /// The field of the mesh, which isosurfaces follow.
    pub field: &'a [f64],
    /// The largest absolute value of the difference, if that is shown.
    pub largest_difference: Option<f64>,
    /// Points without a difference, where that is shown.
    pub apart: usize,
    /// The values of a field, by its number.
    pub fields: Box<dyn Fn(usize) -> Cow<'a, [f64]> + 'a>,
    /// A number for each tetrahedron, if they are coloured by one.
    pub tet_values: &'a [f64],
    /// The region of each tetrahedron, and the colour of each region; nothing without regions.
    pub regions: Cow<'a, [u16]>,
    pub colors: Vec<u8>,
    /// The opacity of the boundary of each region; nothing where all have the same.
    pub opacities: Vec<f64>,
    pub info: &'a MtInfo,
    /// The number of the field.
    pub shown: usize,
    /// The value of the isosurface that has none of its own.
    pub isovalue: Option<f64>,
    pub state: &'a SceneState,
    pub bounds: Bounds,
    pub changes: &'a MeshChanges,
}

impl<'a> Input<'a> {
    /// The quantity that colours tetrahedra; none for the field, which it is, too, where regions are asked for and there are none.
    pub fn quantity(&self) -> Result<Option<TetQuantity>> {
        let found = self.state.cells.as_ref().map_or(Ok(None), quantity)?;
        Ok(found.filter(|found| *found != TetQuantity::Region || !self.colors.is_empty()))
    }

    /// As [`field_number`].
    pub fn field(&self, what: &str, name: Option<&String>) -> Result<usize> {
        field_number(self.info, self.shown, what, name)
    }

    /// The colours of a field; the range of the state is for the field that is shown. Labels have those of the palette, whatever the state says.
    pub fn scale(&self, field: usize) -> Result<ColourScale> {
        if let Some(largest) = self.largest_difference.filter(|_| field == self.shown) {
            let most = if largest > 0.0 { largest } else { 1.0 };
            return scale(&ColourState { log: false, ..self.state.colours.clone() }, None, [-most, most]);
        }
        if self.is_label(field) {
            return Ok(region_scale());
        }
        let own = self.info.range_at_all_times(field);
        scale(&self.state.colours, if field == self.shown { self.state.colours.range } else { None }, own)
    }

    /// How the values of a field, or the difference, are stored in single precision.
    pub fn single(&self, field: usize) -> SingleValues {
        match self.largest_difference.filter(|_| field == self.shown) {
            Some(largest) => SingleValues::of([-largest, largest], 0.0),
            // What is drawn of labels are their colours.
            None if self.is_label(field) => SingleValues::PLAIN,
            None => self.info.fields[field].single_values(),
        }
    }

    /// From 0 to the largest length that the components of a vector allow at any time: whatever is drawn of it has the same colours.
    pub fn lengths(&self, names: &[String; 3]) -> [f64; 2] {
        let largest = |name: &String| {
            let steps = self.info.fields.iter().filter(|step| step.name == *name);
            steps.fold(0.0_f64, |most, step| most.max(step.min.abs()).max(step.max.abs()))
        };
        [0.0, names.iter().map(largest).fold(0.0, f64::hypot)]
    }

    /// Whether what colours by a field are labels.
    pub fn is_label(&self, field: usize) -> bool {
        let is_difference = field == self.shown && self.largest_difference.is_some();
        self.info.fields[field].is_label && !is_difference
    }

    /// What colours by a field: its values, or the difference.
    pub fn values(&self, field: usize) -> Cow<'a, [f64]> {
        let is_difference = field == self.shown && self.largest_difference.is_some();
        if is_difference { self.mesh.field.into() } else { (self.fields)(field) }
    }

    pub fn vectors(&self, what: &str, names: &[String; 3]) -> Result<[Cow<'a, [f64]>; 3]> {
        let mut found = [0; 3];
        for (place, name) in found.iter_mut().zip(names) {
            *place = self.field(what, Some(name))?;
        }
        Ok(found.map(|field| (self.fields)(field)))
    }

    pub fn diagonal(&self) -> f64 {
        self.bounds.diagonal()
    }
}
