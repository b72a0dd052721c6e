//! A stream of bytes, the MT it becomes, and the current mesh, as one state machine without I/O.
//!
//! Bytes go in with [`Session::feed`], requests with [`Session::refine`]; the mesh comes out as slices with
//! [`Session::view`] or as a surface with [`Session::isosurface`]. Everything works while the file is still
//! arriving: a request is then met as far as the updates that are there allow, and made again when more are.
//!
//! ```text
//!            request ──▶ Session ──▶ wanted: ranges of bytes, by importance
//!   mesh, stats ◀── step    ▲
//!                           │ take: ranges that are complete
//!                         Loader ◀── responses, pieces of bytes, failures ── fetch, sockets
//!                           └─────▶ what to fetch, cancel, read from a cache, or wait for
//! ```
//!
//! Whoever has the bytes only moves them: a [`Client`] from any source; a page, or Node, from `fetch`, whose pieces of bytes go to a
//! [`Loader`](crate::stream::Loader), which joins ranges, tries again and notices other versions of the file, and from there to the
//! session without another copy outside ([`Session::supply`]).
//!
//! Of a file elsewhere a session plans which blocks to fetch: those that the mesh asks for, or for uniform requests those with errors beyond
//! what is allowed, the largest excess of error per byte first, as far as memory allows (`blocks`). When memory is short, blocks that the
//! request does not need are evicted, those first that have not been needed for the longest time. A block with an applied update stays.

mod behind;
mod block_state;
mod blocks;
mod client;
mod deformation;
mod depths;
mod first_picture;
mod quantity;
mod reading;
mod region_stats;
mod shown_tets;

#[doc(hidden)]
pub use blocks::{BlockProgress, BlockState, MappedBlock};
pub use client::{Client, ClientError};
#[doc(hidden)]
pub use deformation::{Deformation, UnknownVector};
#[doc(hidden)]
pub use quantity::TetQuantity;
#[doc(hidden)]
pub use reading::Reading;
#[doc(hidden)]
pub use region_stats::RegionStats;
#[doc(hidden)]
pub use shown_tets::Within;

use crate::format::{DecodeOptions, Decoder, ExactStatus, FormatError};
use crate::geom::Bounds;
use crate::mt::{CurrentMesh, ErrorCode, Exact, MeshChanges, Mt, MtInfo, MultiTessellation, Regions};
use crate::refine::{
    Criterion, Front, LodCriterion, Need, Outcome, Part, RefineStats, Request, RequestError,
};
use crate::view::{FieldView, IsoSurface, MeshView, MeshWithin, NormalKind, Plane, Slice, SurfaceChanges};
use behind::Behind;
use block_state::Blocks;
use depths::Depths;
use shown_tets::ShownTets;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use thiserror::Error;

pub use crate::format::Progress;
#[doc(hidden)]
pub use crate::refine::GoOn;

/// Why a session cannot do what it was asked for. The current mesh is valid all the same.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The base mesh has not arrived yet.
    #[error("the base mesh has not arrived yet; feed more of the file first")]
    NotReady,
    /// The request makes no sense for this MT.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// The isovalue is not a finite number.
    #[error("the isovalue must be a finite number")]
    Isovalue,
    /// An isosurface of a label.
    #[error(
        "'{name}' is a label: between two labels there is no value, so there is no isosurface; take its boundary, a section or a threshold"
    )]
    Label {
        /// Its name.
        name: String,
    },
    /// The file keeps exact values, and they are not here.
    #[error(
        "the file keeps exact values behind its blocks, and they are not here: it is cut off, or has not arrived to its end"
    )]
    ExactMissing,
    /// The MT turned out to be damaged when an update was applied.
    #[error(transparent)]
    Format(#[from] FormatError),
}

/// A decoder, its MT and the current mesh.
#[derive(Debug, Default)]
pub struct Session {
    decoder: Decoder,
    /// There from the moment the base mesh is.
    front: Option<Front>,
    blocks: Blocks,
    failed: Option<FormatError>,
    /// What was asked for last.
    request: Request,
    /// Which field is shown.
    field: usize,
    shown: Shown,
    surface: IsoSurface,
    /// What has changed in what is shown since the surface was last asked for.
    behind: Behind,
    /// What has changed in it since [`Session::take_changes`] was last called.
    taken: Behind,
    slice: Slice,
    /// The plane of the slice, and what has changed since that was last asked for.
    sliced: (Option<Plane>, Behind),
    /// How deep the updates are that tetrahedra were asked for.
    depths: Depths,
}

/// The current mesh in model units, kept up with the mesh at the cost of what changed.
#[derive(Debug, Default)]
struct Shown {
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
    /// Whether these are labels.
    is_label: bool,
    /// Another field is to be shown: all values are to be set.
    stale: bool,
    tets: ShownTets,
    /// Where tetrahedra are cut: what is left of them, with the values of the field.
    cut: Option<(MeshWithin, Vec<f64>)>,
}

impl Session {
    /// A session that waits for the first byte of a file.
    pub fn new() -> Self {
        Self::default()
    }

    /// [`Session::new`] with other options than the default ones.
    pub fn with_options(options: DecodeOptions) -> Self {
        Self { decoder: Decoder::new(options), ..Self::default() }
    }

    /// Takes in the next bytes of the file, however they were cut.
    ///
    /// # Errors
    /// As [`Decoder::feed`], and when the base mesh is not a valid mesh.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<Progress, FormatError> {
        if let Some(error) = &self.failed {
            return Err(error.clone());
        }
        let fed = self.decoder.feed(bytes);
        // The base mesh may have arrived in front of an error.
        if let (None, Some(mt)) = (&self.front, self.decoder.mt()) {
            match Front::new(mt) {
                Ok(front) => {
                    self.front = Some(front);
                    self.field = mt.info().first_field();
                }
                Err(error) => {
                    let error = FormatError::Base(error);
                    self.failed = Some(error.clone());
                    return Err(error);
                }
            }
        }
        fed
    }

    /// Ends the file: no more bytes come.
    ///
    /// # Errors
    /// As [`Decoder::finish`]; what has arrived stays usable.
    pub fn finish(&mut self) -> Result<(), FormatError> {
        match &self.failed {
            Some(error) => Err(error.clone()),
            None => self.decoder.finish(),
        }
    }

    /// What is known of the MT; none until the base mesh is there.
    pub fn info(&self) -> Option<&MtInfo> {
        self.mt().map(Mt::info)
    }

    /// The box around the reference mesh in model units, which all meshes are in; none until the base mesh is there. See
    /// [`Decoder::bounds`].
    pub fn bounds(&self) -> Option<Bounds> {
        self.decoder.bounds()
    }

    /// The MT as far as it has arrived; none until the base mesh is there.
    pub fn mt(&self) -> Option<&Mt> {
        self.front.as_ref().and(self.decoder.mt())
    }

    /// The decoder: the description of the file and its blocks.
    pub fn decoder(&self) -> &Decoder {
        &self.decoder
    }

    /// The file's free keys and values.
    pub fn metadata(&self) -> &[(String, String)] {
        self.decoder.metadata()
    }

    /// How far the file has come.
    pub fn progress(&self) -> Progress {
        let progress = self.decoder.progress();
        Progress {
            ready: self.front.is_some(),
            complete: progress.complete && self.failed.is_none(),
            ..progress
        }
    }

    /// Changes the current mesh to the coarsest one that satisfies `request`, as far as the data has arrived.
    ///
    /// # Errors
    /// If the request makes no sense for this MT, or the MT turns out to be damaged.
    pub fn refine(&mut self, request: &Request) -> Result<RefineStats, SessionError> {
        self.request(request)?;
        self.step(&mut |_| true)
    }

    /// Sets the request, for [`Session::step`] to make its mesh.
    ///
    /// # Errors
    /// If the request makes no sense for this MT; the request before it then remains.
    pub fn request(&mut self, request: &Request) -> Result<(), SessionError> {
        self.request_with(request, &[])
    }

    /// [`Session::request`] with criteria of the caller's own beside the needs of `request`: see
    /// [`Custom`](crate::refine::Custom).
    ///
    /// # Errors
    /// As [`Session::request`].
    pub fn request_with(
        &mut self,
        request: &Request,
        custom: &[Arc<dyn Criterion>],
    ) -> Result<(), SessionError> {
        let (Some(front), Some(mt)) = (&mut self.front, self.decoder.mt()) else {
            return Err(SessionError::NotReady);
        };
        request.check(mt.info())?;
        request.check_regions(mt.regions().map_or(0, |regions| regions.all.len()))?;
        let own = LodCriterion::new(mt.info(), request);
        let criterion = custom.iter().fold(own, |all, one| all.and(Arc::clone(one)));
        let criterion: Arc<dyn Criterion> = Arc::new(criterion);
        front.request(mt, Arc::clone(&criterion), request.budget);
        self.request.clone_from(request);
        self.new_request(criterion, request.budget);
        Ok(())
    }

    /// Goes on towards the mesh of the request, until it is there or `go_on` returns false, which is called after
    /// every update. The mesh is valid then and within the budget, whether it is done or not. It is not done where blocks came or
    /// went with this step, for there may be more to do with the others. Data is missing only if it is to come.
    ///
    /// # Errors
    /// If nothing has arrived yet, or the MT turns out to be damaged.
    pub fn step(&mut self, go_on: GoOn<'_>) -> Result<RefineStats, SessionError> {
        let before = self.block_progress();
        let (Some(front), Some(mt)) = (&mut self.front, self.decoder.mt()) else {
            return Err(SessionError::NotReady);
        };
        let outcome = front.step(mt, go_on).map_err(FormatError::from)?;
        self.after_step()?;
        let done = outcome.done && self.block_progress() == before;
        let (Some(front), Some(mt)) = (&self.front, self.decoder.mt()) else {
            return Err(SessionError::NotReady);
        };
        let bounds = if outcome.done { bounds(front, mt, &self.request, &outcome) } else { Vec::new() };
        Ok(RefineStats {
            vertices: front.mesh().vertex_count() as u32,
            tetrahedra: front.mesh().tet_count() as u32,
            applied: front.applied_count(),
            refined: outcome.refined,
            coarsened: outcome.coarsened,
            forced: outcome.forced,
            judged: outcome.judged,
            error_bound: outcome.error.error().max(floor(mt.info(), &self.request)),
            excess: outcome.excess,
            bounds,
            satisfied: outcome.satisfied,
            missing: outcome.missing && self.is_waiting(),
            done,
        })
    }

    /// Chooses the field that [`Session::view`] and [`Session::isosurface`] show.
    ///
    /// # Errors
    /// If there is no such field, or the fields are not known yet.
    pub fn set_field(&mut self, index: usize) -> Result<(), SessionError> {
        let fields = self.info().ok_or(SessionError::NotReady)?.fields.len();
        if index >= fields {
            return Err(SessionError::Request(RequestError::Field { index, fields }));
        }
        self.shown.stale |= self.field != index;
        self.field = index;
        Ok(())
    }

    /// Chooses the regions that [`Session::view`], isosurfaces and sections show; all if there is no list. A region that the MT does not have
    /// is none. What a request needs is its own matter: see [`Need::in_regions`].
    pub fn show_regions(&mut self, regions: Option<&[u16]>) {
        self.shown.tets.choose_regions(regions);
    }

    /// Chooses a range of a field: what [`Session::view`], isosurfaces and sections show is within it. All is if there is none, or no such field.
    /// What a request needs is its own matter, as with [`Session::show_regions`].
    pub fn show_within(&mut self, within: Option<Within>) {
        self.shown.tets.choose_within(within);
    }

    /// The region of each tetrahedron of [`Session::view`], as the last call that brought it up to date left it; empty without regions.
    pub fn shown_regions(&self) -> Cow<'_, [u16]> {
        let all = self.mesh().map_or(&[][..], CurrentMesh::regions);
        match &self.shown.cut {
            Some((cut, _)) if !all.is_empty() => cut.of_tets(all).into(),
            _ => all.into(),
        }
    }

    /// The regions of the volume; none if it is not parted, or the base mesh is not there.
    pub fn regions(&self) -> Option<&Regions> {
        self.mt()?.regions()
    }

    /// The largest error that the mesh has in a field anywhere, whatever was asked for, as a fraction of the field's range; at vertices of the
    /// reference mesh, as [`MtInfo::field_bound`] and [`MtInfo::boundary_bound`] take it. None until the base mesh is there.
    ///
    /// # Panics
    /// If there is no such field.
    pub fn error_in(&self, field: usize) -> Option<f64> {
        let (front, mt) = (self.front.as_ref()?, self.decoder.mt()?);
        Some(front.largest_left(mt, Some(field), ErrorCode::MAX).error())
    }

    /// The current mesh in model units; empty until the base mesh is there. Tetrahedra that are not shown
    /// ([`Session::show_regions`], [`Session::show_within`]) have no vertices there, but [`NONE`](crate::mesh::NONE) in their places, and are
    /// no neighbours. Where tetrahedra are cut, the points and the pieces that are new come behind those of the mesh.
    pub fn view(&mut self) -> MeshView<'_> {
        self.catch_up();
        view(self.front.as_ref(), &self.shown)
    }

    /// The mesh as the last call that brought it up to date left it, for readers that share the session.
    #[doc(hidden)]
    pub fn last_view(&self) -> MeshView<'_> {
        view(self.front.as_ref(), &self.shown)
    }

    /// Which entries of [`Session::view`] have changed since the last call: ranges of points and of tetrahedra in ascending
    /// order, with some entries among them that have not. What lies beyond the ends of the arrays is gone. The first call
    /// gives everything. Points change too when another field is shown.
    pub fn take_changes(&mut self) -> MeshChanges {
        self.catch_up();
        let MeshView { positions, tets, .. } = view(self.front.as_ref(), &self.shown);
        self.taken.take(positions.len(), tets.len())
    }

    /// The isosurface of the current mesh, at a value in units of the field.
    ///
    /// # Errors
    /// If the value is not a finite number, the field is a label, or nothing has arrived yet.
    pub fn isosurface(&mut self, value: f64) -> Result<&IsoSurface, SessionError> {
        self.isosurfaces(&[value])
    }

    /// The isosurfaces of the current mesh at several values, in units of the field, as one. When it is asked for
    /// again it costs what has changed; see [`IsoSurface::update`].
    ///
    /// # Errors
    /// If a value is not a finite number, the field is a label, or nothing has arrived yet.
    pub fn isosurfaces(&mut self, values: &[f64]) -> Result<&IsoSurface, SessionError> {
        if self.front.is_none() {
            return Err(SessionError::NotReady);
        }
        if !values.iter().all(|value| value.is_finite()) {
            return Err(SessionError::Isovalue);
        }
        if let Some(label) = self.info().and_then(|info| info.fields.get(self.field)).filter(|f| f.is_label) {
            return Err(SessionError::Label { name: label.name.clone() });
        }
        self.catch_up();
        let mesh = view(self.front.as_ref(), &self.shown);
        let MeshChanges { vertices, tets } = self.behind.take(mesh.positions.len(), mesh.tets.len());
        self.surface.set_regions(self.front.as_ref().is_some_and(|front| !front.mesh().regions().is_empty()));
        self.surface.update(&mesh, values, &vertices, &tets);
        Ok(&self.surface)
    }

    /// The section of the current mesh with a plane. When it is asked for again with the same plane it costs what has changed;
    /// see [`Slice::update`].
    ///
    /// # Errors
    /// If nothing has arrived yet.
    pub fn slice(&mut self, plane: &Plane) -> Result<&Slice, SessionError> {
        if self.front.is_none() {
            return Err(SessionError::NotReady);
        }
        self.catch_up();
        let mesh = view(self.front.as_ref(), &self.shown);
        let (before, behind) = &mut self.sliced;
        let MeshChanges { vertices, tets } = behind.take(mesh.positions.len(), mesh.tets.len());
        if before.replace(*plane) == Some(*plane) {
            self.slice.update(&mesh, &vertices, &tets);
        } else {
            self.slice.extract(&mesh, plane);
        }
        Ok(&self.slice)
    }

    /// The isosurfaces and the section as they were last asked for.
    #[doc(hidden)]
    pub fn last_surfaces(&self) -> (&IsoSurface, &Slice) {
        (&self.surface, &self.slice)
    }

    /// One of the fields at the points of [`Session::view`], as the last call that brought it up to date left it, in field units; empty if there
    /// is no such field.
    pub fn values(&self, field: usize) -> Vec<f64> {
        let values = self.values_of_mesh(field);
        match (&self.shown.cut, self.shown.tets.cut()) {
            (Some((cut, _)), Some(by)) if by.field == field => cut.values().to_vec(),
            (Some((cut, _)), _) if !values.is_empty() => {
                let is_label = self.info().is_some_and(|info| info.fields[field].is_label);
                cut.interpolate(FieldView { values: &values, is_label })
            }
            _ => values,
        }
    }

    /// One of the fields at the vertices of the current mesh.
    fn values_of_mesh(&self, field: usize) -> Vec<f64> {
        let (Some(mesh), Some(info)) = (self.mesh(), self.info().and_then(|info| info.fields.get(field)))
        else {
            return Vec::new();
        };
        (0..mesh.positions().len() as u32).map(|slot| info.value(mesh.levels(slot)[field])).collect()
    }

    /// One of the fields at the vertices of the current mesh in double precision: exact at vertices of the reference mesh if
    /// the file keeps exact values, else the values of the levels; empty if there is no such field. Exact values come last in
    /// a file: a session in parts has them after [`Session::take_exact`], and a file that is cut off has lost them. Which of these
    /// it is tells [`Decoder::exact_status`].
    pub fn exact_values(&self, field: usize) -> Vec<f64> {
        let (Some(mesh), Some(info)) = (self.mesh(), self.info().and_then(|info| info.fields.get(field)))
        else {
            return Vec::new();
        };
        let corrections = self.decoder.exact(field);
        let value = |slot: u32| {
            let of_level = info.value(mesh.levels(slot)[field]);
            let exact = corrections.and_then(|all| all.value(mesh.vertex(slot), of_level));
            exact.unwrap_or(of_level)
        };
        (0..mesh.positions().len() as u32).map(value).collect()
    }

    /// The bytes of the file that hold its exact values, for [`Session::take_exact`]; none if there are none, or they are here.
    pub fn exact_range(&self) -> Option<Range<u64>> {
        let is_missing = self.decoder.exact_status() == ExactStatus::Missing;
        self.decoder.exact_range().filter(|_| is_missing && self.decoder.takes_blocks())
    }

    /// Takes in the bytes of [`Session::exact_range`], in sessions in parts.
    ///
    /// # Errors
    /// As [`Decoder::take_exact`].
    pub fn take_exact(&mut self, bytes: &[u8]) -> Result<(), FormatError> {
        if let Some(range) = self.exact_range() {
            self.blocks.arrive(range.start, bytes.len());
        }
        self.decoder.take_exact(bytes)
    }

    /// The exact values of all vertices of the reference mesh that the file keeps, as tables to [write](crate::format::encode).
    /// Changes the current mesh to the reference mesh if there are any.
    ///
    /// # Errors
    /// As [`Session::refine`]; [`SessionError::ExactMissing`] if the file keeps exact values that are not here.
    pub fn exact_tables(&mut self) -> Result<Vec<Exact>, SessionError> {
        let count = self.info().ok_or(SessionError::NotReady)?.fields.len();
        if self.decoder.exact_status() == ExactStatus::Missing {
            return Err(SessionError::ExactMissing);
        }
        let fields: Vec<usize> = (0..count).filter(|&f| self.decoder.exact(f).is_some()).collect();
        if !fields.is_empty() {
            self.refine(&Request::within(0.0))?;
        }
        let Some(mesh) = self.mesh() else { return Err(SessionError::NotReady) };
        let table = |field: usize| {
            let values = self.exact_values(field).into_iter().zip(0..);
            // A vertex may have several slots: fields that jump have no exact values, others have the same in all of them.
            let of_vertex = |(value, slot): (f64, u32)| {
                let vertex = mesh.vertex(slot);
                (mesh.slot(vertex) == Some(slot)).then_some((vertex, value))
            };
            Exact::new(field, values.filter_map(of_vertex).collect())
        };
        Ok(fields.into_iter().map(table).collect())
    }

    /// The field that is shown.
    pub fn field(&self) -> usize {
        self.field
    }

    /// Chooses what the normals of isosurfaces are made of.
    pub fn set_normal_kind(&mut self, kind: NormalKind) {
        self.surface.set_normal_kind(kind);
    }

    /// What was written in the arrays of the isosurface since the last call; see [`IsoSurface::take_changes`].
    pub fn take_surface_changes(&mut self) -> SurfaceChanges {
        self.surface.take_changes()
    }

    /// The current mesh on the lattices; none until the base mesh is there.
    pub fn mesh(&self) -> Option<&CurrentMesh> {
        self.front.as_ref().map(Front::mesh)
    }

    /// Bytes that the current mesh takes with its adjacency, its form in model units, and the queues of refinement.
    pub fn mesh_bytes(&self) -> u64 {
        let shown = 24 * self.shown.positions.len() + 8 * self.shown.values.len() + self.shown.tets.bytes();
        let shown = shown + self.shown.cut.as_ref().map_or(0, |(cut, values)| cut.bytes() + 8 * values.len());
        self.front.as_ref().map_or(0, |front| front.mesh().bytes() + front.queue_bytes()) + shown as u64
    }

    /// A hash of the current mesh that depends on nothing but the mesh; 0 until the base mesh is there.
    pub fn hash(&self) -> u64 {
        self.mesh().map_or(0, CurrentMesh::hash)
    }

    /// Brings `shown` up to date.
    fn catch_up(&mut self) {
        let (Some(front), Some(mt)) = (&mut self.front, self.decoder.mt()) else { return };
        let mut changes = front.mesh_mut().take_changes();
        self.shown.tets.update(front.mesh(), &mt.info().fields, &mut changes.tets);
        let (mesh, shown) = (front.mesh(), &mut self.shown);
        let (lattice, field) = (&mt.info().lattice, &mt.info().fields[self.field]);
        let slots = mesh.positions().len();
        shown.positions.resize(slots, [0.0; 3]);
        shown.values.resize(slots, 0.0);
        shown.is_label = field.is_label;
        let value_at = |slot: usize| field.value(mesh.levels(slot as u32)[self.field]);
        let is_same = changes.vertices.is_empty() && changes.tets.is_empty() && !shown.stale;
        self.behind.add(&changes, shown.stale);
        self.taken.add(&changes, shown.stale);
        self.sliced.1.add(&changes, shown.stale);
        for slot in changes.vertices.into_iter().flatten().map(|slot| slot as usize) {
            shown.positions[slot] = lattice.point(mesh.positions()[slot]);
            shown.values[slot] = value_at(slot);
        }
        if std::mem::take(&mut shown.stale) {
            shown.values.iter_mut().enumerate().for_each(|(slot, value)| *value = value_at(slot));
        }
        if !is_same {
            self.cut();
        }
    }

    /// Cuts what is shown, if it is to be cut.
    fn cut(&mut self) {
        self.shown.cut = None;
        let Some(Within { field, range, .. }) = self.shown.tets.cut() else { return };
        let by = self.values_of_mesh(field);
        let whole = view(self.front.as_ref(), &self.shown);
        if by.len() < whole.positions.len() {
            return;
        }
        let cut = MeshWithin::of(&whole, &by, range);
        let values =
            if field == self.field { cut.values().to_vec() } else { cut.interpolate(whole.own_field()) };
        let MeshView { positions, tets, .. } = cut.view(&values);
        let tets = std::iter::once(0..tets.len() as u32).collect();
        let all = MeshChanges { tets, ..MeshChanges::of_all_vertices(positions.len()) };
        let behind = [&mut self.behind, &mut self.taken, &mut self.sliced.1];
        behind.into_iter().for_each(|behind| behind.add(&all, false));
        self.shown.cut = Some((cut, values));
    }
}

fn view<'a>(front: Option<&'a Front>, shown: &'a Shown) -> MeshView<'a> {
    if let Some((cut, values)) = &shown.cut {
        return cut.view(FieldView { values, is_label: shown.is_label });
    }
    let all = front.map_or([&[][..]; 2], |front| [front.mesh().tets(), front.mesh().neighbors()]);
    let [tets, neighbors] = shown.tets.tets().unwrap_or(all);
    let Shown { positions, values: field, is_label, .. } = shown;
    MeshView { positions, field, is_label: *is_label, tets, neighbors }
}

/// A pixel and a colour of which an excess is a meaningful multiple.
const LEAST_MULTIPLIED: f64 = 1.0 / (1 << 20) as f64;

/// What the lattices round off of the fields that `request` asks for: no mesh is closer to the input.
fn floor(info: &MtInfo, request: &Request) -> f64 {
    request.needs.iter().fold(0.0, |most, need| most.max(need_floor(info, need)))
}

/// What the lattices round off of the field of one need. Views and transfer functions ask for other things than an error of a field.
fn need_floor(info: &MtInfo, need: &Need) -> f64 {
    if matches!(need.part, Part::View(_) | Part::Transfer(_)) {
        return 0.0;
    }
    let fields = need.measured_field().map_or(0..info.fields.len(), |field| field..field + 1);
    fields.fold(0.0, |most, field| most.max(info.floor(field)))
}

/// For each need the error that is guaranteed where it counts.
fn bounds(front: &Front, mt: &Mt, request: &Request, outcome: &Outcome) -> Vec<f64> {
    let error = outcome.error.error();
    let bound = |need: &Need| {
        if outcome.satisfied {
            let of_field = !matches!(need.part, Part::View(_) | Part::Transfer(_));
            let left = need
                .measured_field()
                .filter(|_| of_field && mt.info().fields.len() > 1)
                .map(|field| front.largest_left(mt, Some(field), ErrorCode::at_least(need.error)).error());
            let bound = if of_field { need.error.min(left.unwrap_or(error)) } else { return need.error };
            return bound.max(need_floor(mt.info(), need));
        }
        let measured = matches!(need.part, Part::View(_) | Part::Transfer(_));
        // No multiple of 0 says how large an error is.
        let asked = if measured { need.error.max(LEAST_MULTIPLIED) } else { need.error };
        let alone = Need { error: asked, ..need.clone() };
        let (error, excess) = front.largest_violation(mt, &LodCriterion::new(mt.info(), &alone.into()));
        if measured { asked * excess } else { error.error().max(need_floor(mt.info(), need)) }
    };
    request.needs.iter().map(bound).collect()
}

impl crate::Coded for SessionError {
    fn code(&self) -> &'static str {
        match self {
            Self::NotReady | Self::ExactMissing => "not-ready",
            Self::Request(_) | Self::Isovalue | Self::Label { .. } => "bad-option",
            Self::Format(error) => error.code(),
        }
    }
}
