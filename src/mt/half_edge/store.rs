//! The compact half-edge Multi-Tessellation: vertex insertions whose inverse collapses a vertex onto a neighbour. The paper has such
//! collapses as a criterion of vertex-based MTs [§2.2], not this structure.
//!
//! Update `k` inserts vertex `b + k`, where `b` is the number of base vertices. Its *near vertex* is the one that the
//! inverse collapses it onto. All tetrahedra that `u+` removes (T_u, [§5]) have the near vertex, so the insertion moves
//! them to the new vertex and fills the gap along the edge between both:
//!
//! ```text
//!      a--------c            a--------c        T_u: tetrahedra (w, f) with f on the far side of Π_u.
//!      |\  T_u  |     u+     |\      /|        They become (v, f). Along each face of T_u at w that stays
//!      | \      |    ---->   | \-v--/ |        there is a new tetrahedron, here (w, v, a) and (w, v, c).
//!      |  w-----c    <----   |  w-----c
//!      | /      |     u-     | /      |
//! ```
//!
//! Nothing of T_u is stored with `u`. An update stores for each tetrahedron that it creates which later update removes it, and
//! which of its faces are removed with it. So T_u is what is reached from any of its tetrahedra through such faces, and what is in
//! the way of `u` is whatever else lies behind one. This needs no update but those applied: a file can be read in pages
//! of updates, in any order, without the pages that these depend on.
//!
//! The updates whose near vertex is `v` are the *children* of `v` in the vertex forest. They are stored with `v`, with
//! the offset from `v` to the vertex that each inserts. Which of them removes a tetrahedron, and which faces, is coded as
//! residuals against predictions from the star of the new vertex: see `mt/half_edge/star_code.rs`. That star is the same in every
//! consistent set.

use crate::mesh::NONE;
use crate::mt::error::Result;
use crate::mt::facts::MtFacts;
use crate::mt::mesh::paged_array::PagedArray;
use crate::mt::pages::{Page, Pages, Rows};
use crate::mt::regions::{RegionInfo, RegionSums, Regions, further_regions};
use crate::mt::update_errors::Errors;
use crate::mt::{
    BaseMesh, ErrorCode, MtInfo, MtKind, MultiTessellation, PageError, UpdateError, UpdateId, VertexId,
};

/// An update whose near vertex is the one that this is stored with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ForestChild {
    /// The update.
    pub update: u32,
    /// From the near vertex to the inserted one, in lattice steps.
    pub offset: [i32; 3],
}

/// Which update removes a base tetrahedron, and which of its faces that removes, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BaseMark {
    /// The update; [`u32::MAX`] if none does.
    pub remover: u32,
    /// Bit `i` is 1 if the face opposite corner `i` goes with the tetrahedron.
    pub inner: u8,
}

/// One update of a half-edge MT, as it is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfEdgeUpdate<'a> {
    /// The updates whose near vertex is the one that this inserts, ascending.
    pub children: &'a [ForestChild],
    /// Field by field, what is to be added to the level predicted from Π_u.
    pub level_residuals: &'a [i32],
    /// Where fields jump and the vertex is in several regions: for each of these but the first, ascending, and field by field, what is to be
    /// added to the level predicted in that region; nothing if it has the same levels in all of them.
    pub side_residuals: &'a [i32],
    /// What removes the tetrahedra of the star, coded: see `mt/half_edge/star_code.rs`.
    pub star: &'a [u8],
    /// Field by field, what bounds the error of every tetrahedron that the update removes, and of all updates that depend on
    /// this one.
    pub errors: &'a [ErrorCode],
}

/// A compact half-edge MT.
///
/// It grows by [`push`](Self::push), coarse to fine, or comes and goes in pages by [`insert_page`](Self::insert_page) and
/// [`remove_page`](crate::mt::UpdatePages::remove_page), in any order. An update can be applied once it and all that it depends on are here.
#[derive(Clone, Debug)]
pub struct HalfEdgeMt {
    pub(in crate::mt) info: MtInfo,
    base: BaseMesh,
    base_marks: Vec<BaseMark>,
    base_children: Rows<ForestChild>,
    pub(super) pages: Pages<HalfEdgePage>,
    /// The near vertex of each update, as far as the page that has it as a child is here.
    near: PagedArray<u32>,
    /// Page by page and field by field, what bounds the errors of a page that is not here, in groups of `2^group_bits` pages; in a group of
    /// which less is known, field by field.
    bounds: Vec<Vec<ErrorCode>>,
    group_bits: u32,
    /// One for each field.
    pub(super) zeros: Vec<ErrorCode>,
    pub(super) facts: Option<Box<MtFacts>>,
    regions: Option<Box<Regions>>,
}

/// Two MTs are equal if they have the same updates, whatever their pages.
impl PartialEq for HalfEdgeMt {
    fn eq(&self, other: &Self) -> bool {
        let same = |u: u32| self.update(UpdateId(u)) == other.update(UpdateId(u));
        self.info == other.info
            && self.base == other.base
            && self.base_marks == other.base_marks
            && self.base_children == other.base_children
            && self.regions == other.regions
            && self.updates() == other.updates()
            && (0..self.updates()).all(same)
    }
}

/// Updates that come and go together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HalfEdgePage {
    pub(super) children: Rows<ForestChild>,
    stars: Rows<u8>,
    level_residuals: Vec<i32>,
    /// None where no field jumps.
    side_residuals: Option<Rows<i32>>,
    errors: Errors,
}

impl HalfEdgePage {
    fn new(fields: usize, has_sides: bool) -> Self {
        Self {
            children: Rows::new(),
            stars: Rows::new(),
            level_residuals: Vec::new(),
            side_residuals: has_sides.then(Rows::new),
            errors: Errors::new(fields),
        }
    }

    /// Adds the next update, which has been checked.
    fn push(&mut self, update: &HalfEdgeUpdate<'_>) {
        self.children.push(update.children);
        self.stars.push(update.star);
        self.level_residuals.extend_from_slice(update.level_residuals);
        if let Some(rows) = &mut self.side_residuals {
            rows.push(update.side_residuals);
        }
        let complete = self.errors.push(update.errors);
        assert!(complete, "each field has an error: that is checked");
    }
}

impl Page for HalfEdgePage {
    fn errors(&self) -> &Errors {
        &self.errors
    }

    fn bytes(&self) -> usize {
        let sides = self.side_residuals.as_ref().map_or(0, Rows::bytes);
        let levels = size_of_val(&self.level_residuals[..]) + sides;
        self.children.bytes() + self.stars.bytes() + levels + self.errors.bytes()
    }
}

impl HalfEdgeMt {
    /// An MT without updates, whose pages will have `2^page_bits` updates, at most 2^16. `base` must fit `info`: see
    /// [`BaseMesh::check`]. `marks` has an entry for each base tetrahedron, `children` a list for each base vertex.
    ///
    /// # Errors
    /// If marks or children are not as many as tetrahedra and vertices, or name an update that `info` does not know.
    pub fn new(
        info: MtInfo,
        base: BaseMesh,
        marks: Vec<BaseMark>,
        children: &[Vec<ForestChild>],
        page_bits: u32,
    ) -> Result<Self> {
        let known = |mark: &BaseMark| mark.remover < info.updates || mark.remover == NONE;
        let fits = marks.len() == base.tets.len() && children.len() == base.positions.len();
        if !fits || !marks.iter().all(known) {
            return Err(UpdateError::Cavity { update: 0 });
        }
        let fields = info.fields.len();
        let mut mt = Self {
            pages: Pages::new(info.updates, page_bits),
            info: MtInfo { kind: MtKind::HalfEdge, ..info },
            base,
            base_marks: marks,
            base_children: Rows::new(),
            near: PagedArray::new(NONE),
            bounds: vec![vec![ErrorCode::MAX; fields]],
            group_bits: 31,
            zeros: vec![ErrorCode::ZERO; fields],
            facts: None,
            regions: None,
        };
        for (v, row) in (0..).zip(children) {
            mt.check_children(0, None, row)?;
            mt.base_children.push(row);
            mt.note_children(v, row)?;
        }
        Ok(mt)
    }

    /// Children come after the update that they are stored with, in ascending order.
    fn check_children(&self, update: u32, after: Option<u32>, row: &[ForestChild]) -> Result<()> {
        let rising = row.windows(2).all(|pair| pair[0].update < pair[1].update);
        let first = row.first().is_none_or(|child| after.is_none_or(|after| child.update > after));
        let known = row.last().is_none_or(|child| child.update < self.info.updates);
        if !rising || !first || !known {
            return Err(UpdateError::Error { update });
        }
        let most = 1_u32 << self.info.lattice.bits;
        let fits = |child: &ForestChild| child.offset.iter().all(|d| d.unsigned_abs() <= most);
        if row.iter().all(fits) { Ok(()) } else { Err(UpdateError::OffLattice { update }) }
    }

    /// Checks what does not need the mesh.
    fn check(&self, update: u32, new: &HalfEdgeUpdate<'_>) -> Result<()> {
        self.check_children(update, Some(update), new.children)?;
        let fields = &self.info.fields;
        let fits = |(residual, bits): (&i32, u32)| residual.unsigned_abs() < 1 << (bits + 1);
        let levels = new.level_residuals.iter().zip(fields.iter().map(|field| field.bits));
        if new.level_residuals.len() != fields.len() || !levels.into_iter().all(fits) {
            return Err(UpdateError::OffLattice { update });
        }
        let sides = new.side_residuals;
        let fits_field =
            |(i, residual): (usize, &i32)| residual.unsigned_abs() < 1 << (fields[i % fields.len()].bits + 1);
        let is_allowed = sides.is_empty() || (self.has_sides() && sides.len().is_multiple_of(fields.len()));
        if !is_allowed || !sides.iter().enumerate().all(fits_field) {
            return Err(UpdateError::OffLattice { update });
        }
        if new.errors.len() == fields.len() { Ok(()) } else { Err(UpdateError::Error { update }) }
    }

    /// Whether vertices may have values for several regions.
    pub fn has_sides(&self) -> bool {
        self.jumps().is_some()
    }

    /// For each field whether its values depend on the region; none if those of no field do.
    pub(crate) fn jumps(&self) -> Option<&[bool]> {
        self.regions.as_ref().map(|regions| &regions.sides.jumps[..]).filter(|jumps| !jumps.is_empty())
    }

    /// Adds the next update, behind all that are here.
    ///
    /// # Errors
    /// Children must come later, be on the lattice and of no other vertex, and each field has a level and an error. What needs
    /// the mesh is checked when the update is applied; that errors do not grow along the partial order is the caller's to see to.
    pub fn push(&mut self, new: &HalfEdgeUpdate<'_>) -> Result<UpdateId> {
        let update = self.updates();
        if update >= self.info.updates {
            return Err(UpdateError::Error { update });
        }
        self.check(update, new)?;
        self.facts = None;
        self.note_children(self.vertex(UpdateId(update)).0, new.children)?;
        let (fields, has_sides) = (self.info.fields.len(), self.has_sides());
        self.pages.push(|_| HalfEdgePage::new(fields, has_sides), |page| page.push(new));
        Ok(UpdateId(update))
    }

    /// The MT, complete, in pages of another size.
    ///
    /// # Errors
    /// If an update is not here.
    pub fn in_pages(&self, page_bits: u32) -> Result<Self> {
        let vertices = (0..self.base.positions.len() as u32).map(VertexId);
        let children: Vec<Vec<ForestChild>> = vertices.map(|v| self.children_of(v).to_vec()).collect();
        let (info, base) = (self.info.clone(), self.base.clone());
        let mut mt = Self::new(info, base, self.base_marks.clone(), &children, page_bits)?;
        mt.regions.clone_from(&self.regions);
        for update in 0..self.updates() {
            mt.push(&self.update(UpdateId(update)).ok_or(UpdateError::Missing { update })?)?;
        }
        Ok(mt)
    }

    /// Notes the near vertex of these updates, none of which has another one. As before if one has.
    fn note_children(&mut self, vertex: u32, children: &[ForestChild]) -> Result<()> {
        if let Some(child) = children.iter().find(|child| self.near.get(child.update) != NONE) {
            return Err(UpdateError::Vertex { update: child.update, vertex });
        }
        children.iter().for_each(|child| self.near.set(child.update, vertex));
        Ok(())
    }

    pub(super) fn forget_children(&mut self, children: &[ForestChild]) {
        children.iter().for_each(|child| self.near.set(child.update, NONE));
    }

    /// Takes a page away while it is being built: near vertices are not needed then.
    pub(super) fn drop_page(&mut self, page: u32) {
        self.pages.remove(page);
        self.near.clear();
    }

    /// Keeps what is known from having applied all updates.
    pub(super) fn set_facts(&mut self, facts: MtFacts) {
        self.facts = Some(Box::new(facts));
    }

    /// States the regions of the volume.
    ///
    /// # Errors
    /// If not every base tetrahedron has one of them, base vertices do not have levels in theirs where fields jump, or updates are here that
    /// were made without.
    pub fn set_regions(&mut self, regions: Regions) -> Result<()> {
        let known = |&region: &u16| usize::from(region) < regions.all.len();
        if regions.of_base.len() != self.base.tets.len() || !regions.of_base.iter().all(known) {
            return Err(UpdateError::Cavity { update: 0 });
        }
        self.check_sides(&regions)?;
        self.regions = Some(Box::new(regions));
        Ok(())
    }

    /// Checks the levels of base vertices in their regions.
    fn check_sides(&self, Regions { sides, of_base, .. }: &Regions) -> Result<()> {
        let fields = self.info.fields.len();
        let vertices = self.base.positions.len();
        let rows = match sides.jumps.is_empty() {
            true => 0,
            false => further_regions(vertices, &self.base.tets, of_base).len(),
        };
        let is_sound = (sides.jumps.is_empty() || sides.jumps.len() == fields)
            && sides.levels.len() == rows * fields
            && sides.levels.chunks(fields).all(|levels| self.info.holds([0; 3], levels));
        // Updates that are here have values in regions if any field jumps.
        let fits = self.updates() == 0 || self.has_sides() != sides.jumps.is_empty();
        if is_sound && fits { Ok(()) } else { Err(UpdateError::OffLattice { update: 0 }) }
    }

    /// States what has been found of the regions in the reference mesh. None if one does not have the tetrahedra that are stated.
    pub(super) fn state_regions(&mut self, sums: RegionSums) -> Option<()> {
        let Some(regions) = &mut self.regions else { return Some(()) };
        for (region, found) in regions.all.iter_mut().zip(sums.finish(self.info.lattice.step)) {
            let RegionInfo { tetrahedra, volume, bounds, color, .. } = found;
            (region.volume, region.bounds, region.color) = (volume, bounds, color);
            (region.tetrahedra == tetrahedra).then_some(())?;
        }
        Some(())
    }

    /// What is known from having applied all updates: none of an MT that has changed since, or that was not made update by update.
    pub(crate) fn facts(&self) -> Option<&MtFacts> {
        self.facts.as_deref()
    }

    /// Adds all updates of a page. Pages on which it depends need not be here.
    ///
    /// # Errors
    /// If the page is not a whole one of this MT, is here already, or has an update that [`Self::push`] would refuse; if two
    /// vertices have the same update as a child. The MT is as it was then.
    pub fn insert_page(&mut self, page: u32, updates: &[HalfEdgeUpdate<'_>]) -> Result<(), PageError> {
        let range = self.pages.check_new(page, updates.len())?;
        let mut new = HalfEdgePage::new(self.info.fields.len(), self.has_sides());
        for (update, record) in range.clone().zip(updates) {
            self.check(update, record)?;
            new.push(record);
        }
        for (k, (update, record)) in range.clone().zip(updates).enumerate() {
            if let Err(error) = self.note_children(self.vertex(UpdateId(update)).0, record.children) {
                updates[..k].iter().for_each(|noted| self.forget_children(noted.children));
                return Err(error.into());
            }
        }
        self.pages.insert(page, new);
        self.facts = None;
        Ok(())
    }

    /// Tells that what bounds the errors of pages comes for groups of so many, by the base-2 logarithm.
    pub fn group_pages(&mut self, log2: u32) {
        (self.group_bits, self.bounds) = (log2.min(31), Vec::new());
    }

    /// Tells what bounds the errors of the updates of each page of a group, page by page and field by field, for as long as a page is not
    /// here; of the whole group, field by field, if no more is known. Groups come in order first.
    pub fn set_page_bounds(&mut self, group: u32, bounds: Vec<ErrorCode>) {
        match self.bounds.get_mut(group as usize) {
            Some(known) => *known = bounds,
            None => self.bounds.push(bounds),
        }
    }

    /// What bounds the errors of update `u`, field by field, which is not here.
    #[inline]
    pub(super) fn bounds_of(&self, u: UpdateId) -> &[ErrorCode] {
        let fields = self.zeros.len();
        let page = self.pages.page_of(u.0);
        let bounds = self.bounds.get((page >> self.group_bits) as usize).map_or(&[][..], Vec::as_slice);
        let at = (page & ((1 << self.group_bits) - 1)) as usize * fields;
        // A page without bounds has those of the first entries.
        bounds.get(at..at + fields).or_else(|| bounds.get(..fields)).unwrap_or(&self.zeros)
    }

    /// For each base tetrahedron, what removes it.
    pub fn base_marks(&self) -> &[BaseMark] {
        &self.base_marks
    }

    /// Update `u` as it is stored; none if it is not here.
    pub fn update(&self, u: UpdateId) -> Option<HalfEdgeUpdate<'_>> {
        let ((page, place), fields) = (self.pages.find(u.0)?, self.info.fields.len());
        Some(HalfEdgeUpdate {
            children: page.children.row(place),
            level_residuals: &page.level_residuals[place * fields..][..fields],
            side_residuals: page.side_residuals.as_ref().map_or(&[], |rows| rows.row(place)),
            star: page.stars.row(place),
            errors: page.errors.of(place),
        })
    }

    /// The updates whose near vertex is `v`, ascending; none if what inserts `v` is not here.
    #[inline]
    pub fn children_of(&self, v: VertexId) -> &[ForestChild] {
        match self.inserted_by(v) {
            None => self.base_children.row(v.0 as usize),
            Some(u) => self.pages.find(u.0).map_or(&[], |(page, place)| page.children.row(place)),
        }
    }

    /// The near vertex of update `u`; none if the page that has it as a child is not here.
    #[inline]
    pub fn near(&self, u: UpdateId) -> Option<VertexId> {
        Some(self.near.get(u.0)).filter(|&v| v != NONE).map(VertexId)
    }

    /// The vertex that update `u` inserts.
    #[inline]
    pub fn vertex(&self, u: UpdateId) -> VertexId {
        VertexId(self.base.positions.len() as u32 + u.0)
    }

    /// The update that inserts `v`; none for a vertex of the base mesh.
    #[inline]
    pub fn inserted_by(&self, v: VertexId) -> Option<UpdateId> {
        v.0.checked_sub(self.base.positions.len() as u32).map(UpdateId)
    }
}

impl MultiTessellation for HalfEdgeMt {
    fn info(&self) -> &MtInfo {
        &self.info
    }

    fn base(&self) -> &BaseMesh {
        &self.base
    }

    fn updates(&self) -> u32 {
        self.pages.updates()
    }

    #[inline]
    fn error(&self, u: UpdateId) -> ErrorCode {
        self.pages.error(u)
    }

    #[inline]
    fn errors(&self, u: UpdateId) -> &[ErrorCode] {
        self.pages.errors(u)
    }

    fn to_come(&self) -> ErrorCode {
        self.pages.to_come()
    }

    fn to_come_in(&self, field: usize) -> ErrorCode {
        self.pages.to_come_in(field)
    }

    fn regions(&self) -> Option<&Regions> {
        self.regions.as_deref()
    }

    /// Each fills at least one gap.
    fn always_grows(&self) -> bool {
        true
    }

    fn bytes(&self) -> u64 {
        let marks = size_of_val(&self.base_marks[..]) + self.base_children.bytes();
        let facts = self.facts.as_ref().map_or(0, |facts| facts.bytes());
        let regions = self.regions().map_or(0, Regions::bytes);
        regions + self.base.bytes() + (marks + self.near.bytes() + facts) as u64 + self.pages.all_bytes()
    }
}
