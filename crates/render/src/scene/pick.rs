//! The point of a scene under the pointer.

use super::objects::Objects;
use super::styles::{medium, other_clips, scale};
use super::{CellState, SceneState};
use crate::draw::Look;
use glam::DVec3;
use tetralod::geom::{Bounds, Ray};
use tetralod::session::Session;
use tetralod::view::{
    ClipPlane, MediumHit, MeshView, Probe, Triangles, first_hit, first_hit_in, first_hit_in_displaced,
    first_kept_hit,
};

impl Objects {
    /// The nearest point along a ray of what is shown, as a point of the model that is not displaced.
    pub(super) fn pick(
        &self,
        session: &mut Session,
        state: &SceneState,
        look: &Look,
        ray: &Ray,
        bounds: &Bounds,
    ) -> Option<[f64; 3]> {
        let clips = look.clips.as_slice();
        let cut_by = |is_clipped: bool| if is_clipped { clips } else { &[] };
        let isosurfaces = self.isosurfaces.iter().map(|own| (own.triangles(), clips));
        let tubes = state.streamlines.as_ref().map(|_| (self.tubes.triangles(), clips));
        let arrows = state.arrows.as_ref().map(|_| (self.arrows.triangles(), clips));
        let boundary = state.boundary.as_ref();
        let groups = self.groups.iter().filter(|group| group.opacity > 0.0).map(|group| &group.boundary);
        let whole = self.groups.is_empty().then_some(&self.boundary);
        let boundary = boundary.into_iter().flat_map(|shown| {
            let parts = groups.clone().chain(whole);
            parts.map(move |part| (part.triangles(), cut_by(shown.clipped)))
        });
        let surfaces = isosurfaces.chain(tubes).chain(arrows).chain(boundary);
        let hits = surfaces.filter_map(|(triangles, clips)| hit(&triangles, look.moved, ray, clips));
        let mut found: Vec<(f64, [f64; 3])> = hits.collect();
        let shown = session.field();
        let own = session.info()?.range_at_all_times(shown);
        let rest = session.view();
        let moved = self.moved_points(&rest, look.moved);
        let mut probe =
            Probe::new(MeshView { positions: moved.as_deref().unwrap_or(rest.positions), ..rest });
        if moved.is_some() {
            found.extend(self.first_section(state, look, ray));
        } else {
            found.extend(first_planes(state, clips, &mut probe, ray));
        }
        let cells = state.cells.as_ref();
        found.extend(cells.and_then(|cells| first_cell(&probe, &rest, cells, clips, ray, bounds)));
        if let (Some(volume), Ok(scale)) = (&state.volume, scale(&state.colours, state.colours.range, own)) {
            let medium = medium(volume, &scale, bounds.diagonal());
            let clips = cut_by(volume.clipped);
            let hit = match moved {
                Some(_) => first_hit_in_displaced(&medium, &probe, &rest, ray, clips),
                None => first_hit_in(&medium, &probe, ray, clips),
            };
            let position =
                |hit: &MediumHit| if moved.is_some() { hit.place.position(&rest) } else { hit.position };
            found.extend(hit.map(|hit| (hit.distance, position(&hit))));
        }
        found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, position)| position)
    }

    /// The points of the mesh where they are displaced to; none if they are not.
    pub(super) fn moved_points(&self, mesh: &MeshView<'_>, times: f64) -> Option<Vec<[f64; 3]>> {
        let moves = self.moves.as_slice();
        let is_moved = times != 0.0 && moves.len() == mesh.positions.len();
        let points = Triangles { positions: mesh.positions, moves, ..Triangles::default() };
        is_moved.then(|| points.moved_positions(times))
    }

    /// The nearest point of the sections where they are displaced to.
    fn first_section(&self, state: &SceneState, look: &Look, ray: &Ray) -> Option<(f64, [f64; 3])> {
        let is_closed = state.boundary.as_ref().is_some_and(|boundary| boundary.clipped);
        // For each opacity of regions there is a section with each plane.
        let caps = self.caps.iter().zip(look.clips.iter().cycle()).filter(|_| is_closed);
        let caps = caps.map(|(cap, clip)| (cap, *clip, true));
        let slices = self.slices.iter().zip(&state.slices);
        let slices = slices.map(|(own, slice)| (own, slice.plane().clip(), slice.clipped));
        let hits = slices.chain(caps).filter_map(|(own, section, is_clipped)| {
            let cutting = if is_clipped { cutting(&look.clips, &section) } else { Vec::new() };
            hit(&own.triangles(), look.moved, ray, &cutting)
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// The clip planes that cut a section.
fn cutting(clips: &[ClipPlane], section: &ClipPlane) -> Vec<ClipPlane> {
    let others = other_clips(clips, section);
    clips.iter().enumerate().filter(|(i, _)| others & 1 << i != 0).map(|(_, clip)| *clip).collect()
}

/// How far along a ray a surface is that is displaced so many times, and which point of the model that is.
fn hit(triangles: &Triangles<'_>, times: f64, ray: &Ray, clips: &[ClipPlane]) -> Option<(f64, [f64; 3])> {
    if triangles.moves.is_empty() || times == 0.0 {
        return first_hit(triangles, ray, clips).map(|hit| (hit.distance, hit.position));
    }
    let positions = &triangles.moved_positions(times);
    let rest = |triangle: &[u32; 3], weights: [f64; 3]| {
        let corners = triangle.map(|v| DVec3::from(triangles.positions[v as usize]));
        (0..3).map(|k| weights[k] * corners[k]).sum::<DVec3>().to_array()
    };
    let keeps = |triangle: &[u32; 3], weights| {
        let place = rest(triangle, weights);
        clips.iter().all(|clip| clip.keeps_point(place))
    };
    let hit = first_kept_hit(&Triangles { positions, ..*triangles }, ray, keeps)?;
    Some((hit.distance, rest(&triangles.indices[hit.triangle as usize], hit.weights)))
}

/// The points along a ray where sections are, of planes and of what clip planes cut open.
fn first_planes(
    state: &SceneState,
    clips: &[ClipPlane],
    probe: &mut Probe<'_>,
    ray: &Ray,
) -> Vec<(f64, [f64; 3])> {
    let mut found = Vec::new();
    // What clip planes cut open is closed by sections with them.
    let is_closed = state.boundary.as_ref().is_some_and(|boundary| boundary.clipped);
    let caps = clips.iter().filter(|_| is_closed).map(|clip| (*clip, true));
    let sections = state.slices.iter().map(|slice| (slice.plane().clip(), slice.clipped));
    for (section, is_clipped) in sections.chain(caps) {
        let normal = DVec3::from(section.normal);
        let distance = (section.offset - ray.origin.dot(normal)) / ray.direction.dot(normal);
        let place = ray.at(distance);
        let cutting = if is_clipped { cutting(clips, &section) } else { Vec::new() };
        let is_kept = cutting.iter().all(|clip| clip.keeps_point(place.into()));
        if distance > 0.0 && is_kept && probe.locate(place.into()).is_some() {
            found.push((distance, place.into()));
        }
    }
    found
}

/// Where a ray enters the first tetrahedron that is drawn, how far away that is, and which point of the model at `rest` it is. Tetrahedra
/// count as if they were not shrunk.
fn first_cell(
    probe: &Probe<'_>,
    rest: &MeshView<'_>,
    cells: &CellState,
    clips: &[ClipPlane],
    ray: &Ray,
    bounds: &Bounds,
) -> Option<(f64, [f64; 3])> {
    let reach = ray.origin.distance(bounds.min.into()) + bounds.diagonal();
    let cut = cells.cut.map_or(ClipPlane::NOTHING, |cut| cut.clip());
    let is_displaced = !std::ptr::eq(probe.mesh().positions, rest.positions);
    let spans = probe.line(ray.origin.into(), ray.at(reach).into());
    // A little inside, so that the point is in this tetrahedron and not in the one before.
    let found = spans.into_iter().map(|span| {
        let part = 1e-6;
        let distance = (span.from + part * (span.to - span.from)) * reach;
        let [entry, exit] = [span.entry, span.exit].map(|place| DVec3::from(place.position(rest)));
        let own = if is_displaced { entry.lerp(exit, part) } else { ray.at(distance) };
        (span.entry.tet, distance, own.to_array())
    });
    let is_drawn = |tet: u32, place: [f64; 3]| {
        let corners = rest.tets[tet as usize].map(|p| rest.positions[p as usize]);
        cut.keeps(corners) && clips.iter().all(|clip| clip.keeps_point(place))
    };
    let mut found = found.filter(|(tet, _, place)| is_drawn(*tet, *place));
    found.next().map(|(_, distance, place)| (distance, place))
}
