//! The point of a scene under the pointer.

use super::objects::Objects;
use super::styles::{medium, other_clips, scale};
use super::{CellState, SceneState};
use glam::DVec3;
use tetralod::geom::{Bounds, Ray};
use tetralod::session::Session;
use tetralod::view::{ClipPlane, Probe, Triangles, first_hit, first_hit_in};

impl Objects {
    /// The nearest point along a ray of what is shown.
    pub(super) fn pick(
        &self,
        session: &mut Session,
        state: &SceneState,
        clips: &[ClipPlane],
        ray: &Ray,
        bounds: &Bounds,
    ) -> Option<[f64; 3]> {
        let cut_by = |is_clipped: bool| if is_clipped { clips } else { &[] };
        let isosurfaces = self.isosurfaces.iter().map(|own| (Triangles::from(&own.surface), clips));
        let tubes = state.streamlines.as_ref().map(|_| (Triangles::from(&self.tubes), clips));
        let arrows = state.arrows.as_ref().map(|_| (Triangles::from(&self.arrows), clips));
        let boundary = state.boundary.as_ref();
        let boundary = boundary.map(|shown| (Triangles::from(&self.boundary), cut_by(shown.clipped)));
        let surfaces = isosurfaces.chain(tubes).chain(arrows).chain(boundary);
        let hits = surfaces.filter_map(|(triangles, clips)| first_hit(&triangles, ray, clips));
        let mut found: Vec<(f64, [f64; 3])> = hits.map(|hit| (hit.distance, hit.position)).collect();
        let shown = session.field();
        let own = session.info()?.range_at_all_times(shown);
        let mut probe = Probe::new(session.view());
        // What clip planes cut open is closed by sections with them.
        let is_closed = state.boundary.as_ref().is_some_and(|boundary| boundary.clipped);
        let caps = clips.iter().filter(|_| is_closed).map(|clip| (*clip, true));
        let sections = state.slices.iter().map(|slice| (slice.plane().clip(), slice.clipped));
        for (section, is_clipped) in sections.chain(caps) {
            let normal = DVec3::from(section.normal);
            let distance = (section.offset - ray.origin.dot(normal)) / ray.direction.dot(normal);
            let place = ray.at(distance);
            let others = if is_clipped { other_clips(clips, &section) } else { 0 };
            let cutting = clips.iter().enumerate().filter(|(i, _)| others & 1 << i != 0);
            let is_kept = cutting.into_iter().all(|(_, clip)| clip.keeps_point(place.into()));
            if distance > 0.0 && is_kept && probe.locate(place.into()).is_some() {
                found.push((distance, place.into()));
            }
        }
        found.extend(state.cells.as_ref().and_then(|cells| first_cell(&probe, cells, clips, ray, bounds)));
        if let (Some(volume), Ok(scale)) = (&state.volume, scale(&state.colours, state.colours.range, own)) {
            let medium = medium(volume, &scale, bounds.diagonal());
            let hit = first_hit_in(&medium, &probe, ray, cut_by(volume.clipped));
            found.extend(hit.map(|hit| (hit.distance, hit.position)));
        }
        found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, position)| position)
    }
}

/// Where a ray enters the first tetrahedron that is drawn, and how far away that is. Tetrahedra count as if they were not shrunk.
fn first_cell(
    probe: &Probe<'_>,
    cells: &CellState,
    clips: &[ClipPlane],
    ray: &Ray,
    bounds: &Bounds,
) -> Option<(f64, [f64; 3])> {
    let reach = ray.origin.distance(bounds.min.into()) + bounds.diagonal();
    let cut = cells.cut.map_or(ClipPlane::NOTHING, |cut| cut.clip());
    let mesh = probe.mesh();
    let spans = probe.line(ray.origin.into(), ray.at(reach).into());
    // A little inside, so that the point is in this tetrahedron and not in the one before.
    let places =
        spans.iter().map(|span| (span.entry.tet, (span.from + 1e-6 * (span.to - span.from)) * reach));
    let is_drawn = |tet: u32, distance: f64| {
        let corners = mesh.tets[tet as usize].map(|p| mesh.positions[p as usize]);
        cut.keeps(corners) && clips.iter().all(|clip| clip.keeps_point(ray.at(distance).into()))
    };
    let (_, distance) = places.into_iter().find(|(tet, distance)| is_drawn(*tet, *distance))?;
    Some((distance, ray.at(distance).into()))
}
