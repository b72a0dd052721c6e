//! The compact half-edge Multi-Tessellation: vertex insertions whose inverse collapses a vertex onto a neighbour.
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
//! Nothing of T_u is stored with `u`. When an update creates a tetrahedron, it tells which later update removes that, and
//! which of its faces go with it. So T_u is what is reached from any of its tetrahedra through such faces, and what is in
//! the way of `u` is whatever else lies behind one. This needs no update but those applied: a file can be read in pages
//! of updates, in any order, without the pages that these depend on.
//!
//! The updates whose near vertex is `v` are the *children* of `v` in the vertex forest. They are stored with `v`, with
//! the offset from `v` to the vertex that each inserts. Which of them removes a tetrahedron, and which faces, is coded as
//! residuals against predictions from the star of the new vertex: see `half_edge_star`. That star is the same in every
//! consistent set.

use crate::mesh::NONE;
use crate::mt::mesh::paged_array::PagedArray;
use crate::mt::update_errors::Errors;
use crate::mt::{BaseMesh, ErrorCode, MtInfo, MtKind, PageError, UpdateError, UpdateId, VertexId};
use std::ops::Range;

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
    /// What removes the tetrahedra of the star, coded: see `half_edge_star`.
    pub star: &'a [u8],
    /// Field by field, what bounds the error of every tetrahedron that the update removes, and of all updates that depend on
    /// this one.
    pub errors: &'a [ErrorCode],
}

/// A compact half-edge MT.
///
/// It grows by [`push`](Self::push), coarse to fine, or comes and goes in pages by [`insert_page`](Self::insert_page) and
/// [`remove_page`](Self::remove_page), in any order. An update can be applied once it and all that it depends on are here.
#[derive(Clone, Debug)]
pub struct HalfEdgeMt {
    info: MtInfo,
    base: BaseMesh,
    base_marks: Vec<BaseMark>,
    base_children: Rows<ForestChild>,
    /// The last one is here.
    pages: Vec<Option<Page>>,
    /// log2 of the updates of a page.
    page_bits: u32,
    /// The near vertex of each update, as far as the page that tells it is here.
    near: PagedArray<u32>,
    /// The end of the last page that is here.
    updates: u32,
    present: u32,
    /// Bytes of the pages that are here.
    page_bytes: u64,
    to_come: ErrorCode,
    /// Page by page and field by field, what bounds the errors of a page that is not here.
    bounds: Vec<ErrorCode>,
    /// One for each field.
    zeros: Vec<ErrorCode>,
}

/// Two MTs are equal if they have the same updates, whatever their pages.
impl PartialEq for HalfEdgeMt {
    fn eq(&self, other: &Self) -> bool {
        let same = |u: u32| self.update(UpdateId(u)) == other.update(UpdateId(u));
        self.info == other.info
            && self.base == other.base
            && self.base_marks == other.base_marks
            && self.base_children == other.base_children
            && self.updates == other.updates
            && (0..self.updates).all(same)
    }
}

/// Lists of different lengths, one after the other.
#[derive(Clone, Debug, PartialEq)]
struct Rows<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy> Rows<T> {
    fn new() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }

    fn push(&mut self, row: &[T]) {
        self.items.extend_from_slice(row);
        self.starts.push(self.items.len() as u32);
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    #[inline]
    fn row(&self, i: usize) -> &[T] {
        &self.items[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + size_of_val(&self.items[..])
    }
}

/// Updates that come and go together.
#[derive(Clone, Debug, PartialEq)]
struct Page {
    children: Rows<ForestChild>,
    stars: Rows<u8>,
    level_residuals: Vec<i32>,
    errors: Errors,
}

impl Page {
    fn new(fields: usize) -> Self {
        Self {
            children: Rows::new(),
            stars: Rows::new(),
            level_residuals: Vec::new(),
            errors: Errors::new(fields),
        }
    }

    fn len(&self) -> u32 {
        self.children.len() as u32
    }

    fn push(&mut self, update: &HalfEdgeUpdate<'_>) -> bool {
        self.children.push(update.children);
        self.stars.push(update.star);
        self.level_residuals.extend_from_slice(update.level_residuals);
        self.errors.push(update.errors)
    }

    fn bytes(&self) -> usize {
        let levels = size_of_val(&self.level_residuals[..]);
        self.children.bytes() + self.stars.bytes() + levels + self.errors.bytes()
    }
}

/// Pages have at most 2 to this power of updates.
const MAX_PAGE_BITS: u32 = 16;

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
    ) -> Result<Self, UpdateError> {
        let known = |mark: &BaseMark| mark.remover < info.updates || mark.remover == NONE;
        let fits = marks.len() == base.tets.len() && children.len() == base.positions.len();
        if !fits || !marks.iter().all(known) {
            return Err(UpdateError::Cavity { update: 0 });
        }
        let mut mt = Self {
            info: MtInfo { kind: MtKind::HalfEdge, ..info },
            base,
            base_marks: marks,
            base_children: Rows::new(),
            pages: Vec::new(),
            page_bits: page_bits.min(MAX_PAGE_BITS),
            near: PagedArray::new(NONE),
            updates: 0,
            present: 0,
            page_bytes: 0,
            to_come: ErrorCode::MAX,
            bounds: Vec::new(),
            zeros: Vec::new(),
        };
        mt.zeros = vec![ErrorCode::ZERO; mt.info.fields.len()];
        mt.bounds = vec![ErrorCode::MAX; mt.info.fields.len()];
        for (v, row) in (0..).zip(children) {
            mt.check_children(0, None, row)?;
            mt.base_children.push(row);
            mt.note_children(v, row)?;
        }
        Ok(mt)
    }

    /// Children come after the update that they are stored with, in ascending order.
    fn check_children(
        &self,
        update: u32,
        after: Option<u32>,
        row: &[ForestChild],
    ) -> Result<(), UpdateError> {
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

    /// What can be told of an update by itself.
    fn check(&self, update: u32, new: &HalfEdgeUpdate<'_>) -> Result<(), UpdateError> {
        self.check_children(update, Some(update), new.children)?;
        let fields = &self.info.fields;
        let fits = |(residual, bits): (&i32, u32)| residual.unsigned_abs() < 1 << (bits + 1);
        let levels = new.level_residuals.iter().zip(fields.iter().map(|field| field.bits));
        if new.level_residuals.len() != fields.len() || !levels.into_iter().all(fits) {
            return Err(UpdateError::OffLattice { update });
        }
        if new.errors.len() == fields.len() { Ok(()) } else { Err(UpdateError::Error { update }) }
    }

    /// Adds the next update, behind all that are here.
    ///
    /// # Errors
    /// Children must come later, be on the lattice and of no other vertex, and each field has a level and an error. What needs
    /// the mesh is checked when the update is applied; that errors do not grow along the partial order is the caller's to see to.
    pub fn push(&mut self, new: &HalfEdgeUpdate<'_>) -> Result<UpdateId, UpdateError> {
        let update = self.updates;
        if update >= self.info.updates {
            return Err(UpdateError::Error { update });
        }
        self.check(update, new)?;
        self.note_children(self.vertex(UpdateId(update)).0, new.children)?;
        if update as usize >> self.page_bits == self.pages.len() {
            let page = Page::new(self.info.fields.len());
            self.page_bytes += page.bytes() as u64;
            self.pages.push(Some(page));
        }
        // The last page is here, and has an error for each field.
        self.change_last(|page| {
            page.push(new);
        });
        self.updates += 1;
        self.present += 1;
        Ok(UpdateId(update))
    }

    /// The same MT, complete, in pages of another size.
    ///
    /// # Errors
    /// If an update is not here.
    pub fn in_pages(&self, page_bits: u32) -> Result<Self, UpdateError> {
        let vertices = (0..self.base.positions.len() as u32).map(VertexId);
        let children: Vec<Vec<ForestChild>> = vertices.map(|v| self.children_of(v).to_vec()).collect();
        let (info, base) = (self.info.clone(), self.base.clone());
        let mut mt = Self::new(info, base, self.base_marks.clone(), &children, page_bits)?;
        for update in 0..self.updates {
            mt.push(&self.update(UpdateId(update)).ok_or(UpdateError::Missing { update })?)?;
        }
        Ok(mt)
    }

    /// Notes the near vertex of these updates, none of which has another one. As before if one has.
    fn note_children(&mut self, vertex: u32, children: &[ForestChild]) -> Result<(), UpdateError> {
        if let Some(child) = children.iter().find(|child| self.near.get(child.update) != NONE) {
            return Err(UpdateError::Vertex { update: child.update, vertex });
        }
        children.iter().for_each(|child| self.near.set(child.update, vertex));
        Ok(())
    }

    fn forget_children(&mut self, children: &[ForestChild]) {
        children.iter().for_each(|child| self.near.set(child.update, NONE));
    }

    /// Replaces the star code of the last update.
    pub(in crate::mt) fn set_last_star(&mut self, star: &[u8], level_residuals: &[i32]) {
        self.change_last(|page| {
            let first = page.stars.starts[page.stars.len() - 1] as usize;
            page.stars.items.truncate(first);
            page.stars.items.extend_from_slice(star);
            page.stars.starts.pop();
            page.stars.starts.push(page.stars.items.len() as u32);
            let kept = page.level_residuals.len() - level_residuals.len();
            page.level_residuals[kept..].copy_from_slice(level_residuals);
        });
    }

    fn change_last(&mut self, change: impl FnOnce(&mut Page)) {
        let Some(Some(page)) = self.pages.last_mut() else { return };
        self.page_bytes -= page.bytes() as u64;
        change(page);
        self.page_bytes += page.bytes() as u64;
    }

    /// Adds all updates of a page. Pages on which it depends need not be here.
    ///
    /// # Errors
    /// If the page is not a whole one of this MT, is here already, or has an update that [`Self::push`] would refuse; if two
    /// vertices have the same update as a child. The MT is as it was then.
    pub fn insert_page(&mut self, page: u32, updates: &[HalfEdgeUpdate<'_>]) -> Result<(), PageError> {
        let range = self.page_updates(page);
        if range.is_empty() {
            return Err(PageError::Beyond { page });
        }
        if self.has_page(page) {
            return Err(PageError::Present { page });
        }
        if updates.len() != range.len() {
            return Err(PageError::Length { page, expected: range.len() as u32 });
        }
        let mut new = Page::new(self.info.fields.len());
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
        if page as usize >= self.pages.len() {
            self.pages.resize_with(page as usize + 1, || None);
        }
        self.page_bytes += new.bytes() as u64;
        self.pages[page as usize] = Some(new);
        self.present += range.len() as u32;
        self.updates = self.updates.max(range.end);
        Ok(())
    }

    /// Takes the updates of a page away, none of which may be applied to a mesh that is still in use; that mesh must have
    /// been told before, by [`Front::prepare_eviction`](crate::refine::Front::prepare_eviction).
    ///
    /// # Errors
    /// If the page is not here.
    pub fn remove_page(&mut self, page: u32) -> Result<(), PageError> {
        let gone = self.pages.get_mut(page as usize).and_then(Option::take);
        let Some(gone) = gone else { return Err(PageError::Absent { page }) };
        self.forget_children(&gone.children.items);
        self.page_bytes -= gone.bytes() as u64;
        self.present -= gone.len();
        while self.pages.last().is_some_and(Option::is_none) {
            self.pages.pop();
        }
        self.updates = match self.pages.last() {
            Some(Some(last)) => (((self.pages.len() - 1) << self.page_bits) as u32) + last.len(),
            _ => 0,
        };
        Ok(())
    }

    /// Whether the page is here.
    pub fn has_page(&self, page: u32) -> bool {
        self.pages.get(page as usize).is_some_and(Option::is_some)
    }

    /// log2 of the updates of a page.
    pub fn page_bits(&self) -> u32 {
        self.page_bits
    }

    /// The updates of page `page`; none if there is no such page.
    pub fn page_updates(&self, page: u32) -> Range<u32> {
        let first = u64::from(page) << self.page_bits;
        let end = u64::from(self.info.updates);
        first.min(end) as u32..(first + (1 << self.page_bits)).min(end) as u32
    }

    /// Whether update `u` is here.
    #[inline]
    pub fn has(&self, u: UpdateId) -> bool {
        u.0 < self.updates && self.page_of(u.0).is_some()
    }

    /// How many updates are here.
    pub fn present(&self) -> u32 {
        self.present
    }

    /// Number of updates so far, those between them that are not here included.
    pub fn updates(&self) -> u32 {
        self.updates
    }

    /// Tells that no update which is not here has a larger error than this; until then, any may have. Means nothing once
    /// all are here.
    pub fn set_to_come(&mut self, bound: ErrorCode) {
        self.to_come = if self.present == self.info.updates { ErrorCode::MAX } else { bound };
    }

    /// No update that is not here has a larger error.
    pub fn to_come(&self) -> ErrorCode {
        if self.present >= self.info.updates { ErrorCode::ZERO } else { self.to_come }
    }

    /// Tells what bounds the errors of the updates of each page, page by page and field by field, for as long as a page is not
    /// here.
    pub fn set_page_bounds(&mut self, bounds: Vec<ErrorCode>) {
        self.bounds = bounds;
    }

    /// What bounds the errors of update `u`, field by field, which is not here.
    #[inline]
    pub(in crate::mt) fn bounds_of(&self, u: UpdateId) -> &[ErrorCode] {
        let fields = self.zeros.len();
        let at = (u.0 >> self.page_bits) as usize * fields;
        // Nothing is known of a page without bounds: the first entries stand for all then.
        self.bounds.get(at..at + fields).or_else(|| self.bounds.get(..fields)).unwrap_or(&self.zeros)
    }

    pub(in crate::mt) fn no_errors(&self) -> &[ErrorCode] {
        &self.zeros
    }

    /// Bytes that an update takes in memory, as a rule.
    pub fn usual_update_bytes(info: &MtInfo) -> u64 {
        40 + 6 * info.fields.len() as u64
    }

    /// What is known of the MT as a whole.
    pub fn info(&self) -> &MtInfo {
        &self.info
    }

    /// The base mesh.
    pub fn base(&self) -> &BaseMesh {
        &self.base
    }

    /// For each base tetrahedron, what removes it.
    pub fn base_marks(&self) -> &[BaseMark] {
        &self.base_marks
    }

    /// Bytes of the updates that are here.
    pub fn page_bytes(&self) -> u64 {
        self.page_bytes
    }

    /// Bytes of a page that is here.
    pub fn bytes_of_page(&self, page: u32) -> Option<u64> {
        self.pages.get(page as usize)?.as_ref().map(|page| page.bytes() as u64)
    }

    /// Bytes of everything that the MT holds, base mesh and errors included.
    pub fn bytes(&self) -> u64 {
        let base = size_of_val(&self.base.positions[..])
            + size_of_val(&self.base.values[..])
            + size_of_val(&self.base.tets[..])
            + size_of_val(&self.base_marks[..])
            + self.base_children.bytes()
            + size_of_val(&self.pages[..])
            + self.near.bytes();
        base as u64 + self.page_bytes()
    }

    #[inline]
    fn page_of(&self, u: u32) -> Option<&Page> {
        self.pages.get((u >> self.page_bits) as usize)?.as_ref()
    }

    #[inline]
    fn place(&self, u: u32) -> usize {
        (u & ((1 << self.page_bits) - 1)) as usize
    }

    /// The error of update `u`, the largest one of all fields; [`ErrorCode::ZERO`] if it is not here.
    #[inline]
    pub fn error_of(&self, u: UpdateId) -> ErrorCode {
        self.page_of(u.0).map_or(ErrorCode::ZERO, |page| page.errors.largest(self.place(u.0)))
    }

    /// The error of update `u` in each field; nothing if it is not here.
    #[inline]
    pub fn errors_of(&self, u: UpdateId) -> &[ErrorCode] {
        self.page_of(u.0).map_or(&[], |page| page.errors.of(self.place(u.0)))
    }

    /// Update `u` as it is stored; none if it is not here.
    pub fn update(&self, u: UpdateId) -> Option<HalfEdgeUpdate<'_>> {
        let (page, place, fields) = (self.page_of(u.0)?, self.place(u.0), self.info.fields.len());
        Some(HalfEdgeUpdate {
            children: page.children.row(place),
            level_residuals: &page.level_residuals[place * fields..][..fields],
            star: page.stars.row(place),
            errors: page.errors.of(place),
        })
    }

    /// The updates whose near vertex is `v`, ascending; none if what inserts `v` is not here.
    #[inline]
    pub fn children_of(&self, v: VertexId) -> &[ForestChild] {
        match self.inserted_by(v) {
            None => self.base_children.row(v.0 as usize),
            Some(u) => self.page_of(u.0).map_or(&[], |page| page.children.row(self.place(u.0))),
        }
    }

    /// The near vertex of update `u`; none if the page that tells it is not here.
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
