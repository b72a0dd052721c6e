//! Vertex split and edge collapse on the current mesh [§4]: the updates of the compact edge-based MT.
//!
//! ```text
//!        x                x            The star of v is parted by a fan of triangles (v, x, y). A split turns each
//!       /|\              /|\           fan triangle into a tetrahedron (v', v'', x, y); the tetrahedra of side 0
//!      / | \     u+     / | \          keep v's slot, which becomes v', those of side 1 get a new slot for v''.
//!     0  v  1    ->    0 v'-v'' 1      A collapse is the exact inverse.
//!      \ | /     <-     \ | /
//!       \|/      u−      \|/
//!        y                y
//! ```

use super::BaseMesh;
use super::CurrentMesh;
use super::EdgeMt;
use super::ErrorCode;
use super::LookAtTet;
use super::MAX_LINK;
use super::MAX_STAR;
use super::MtInfo;
use super::MultiTessellation;
use super::UpdateError;
use super::UpdateId;
use super::VertexId;
use super::current::Gather;
use super::current::Labels;
use super::current::Star;
use crate::geom::orient3d;
use crate::mesh::NONE;

/// What came of the wish to apply an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Applied {
    /// The update is applied.
    Done,
    /// Nothing changed: this other update has to be applied (`u+`), or undone (`u−`), first.
    Blocked(UpdateId),
}

/// One triangle of the fan that parts a star, by indices into the star.
#[derive(Clone, Copy, Default)]
struct FanTriangle {
    /// The tetrahedron of side 0.
    near: u8,
    /// Its face that is the fan triangle.
    face: u8,
    /// The tetrahedron of side 1.
    far: u8,
}

/// The fan of a split: its triangles, and which of them meet in the edges from the centre.
struct Fan {
    len: usize,
    triangles: [FanTriangle; MAX_LINK],
    /// For both link vertices of each triangle, `(c, face) -> REST` order: the triangle on the other side of the
    /// edge to that vertex, or `NO_PARTNER`.
    partner: [[u8; 2]; MAX_LINK],
}

const NO_PARTNER: u8 = u8::MAX;

/// `REST[i][j]`: the two corners other than `i` and `j`, ascending.
const REST: [[[u8; 2]; 4]; 4] = [
    [[0, 0], [2, 3], [1, 3], [1, 2]],
    [[2, 3], [0, 0], [0, 3], [0, 2]],
    [[1, 3], [0, 3], [0, 0], [0, 1]],
    [[1, 2], [0, 2], [0, 1], [0, 0]],
];

/// The two vertices that a split makes: positions and side by side the levels.
struct Halves {
    positions: [[i32; 3]; 2],
}

impl EdgeMt {
    /// Applies update `u` (`u+`, a vertex split) to `mesh`, which must not contain it yet.
    ///
    /// # Errors
    /// If the update does not fit the mesh, which only happens to a damaged MT; the mesh is unchanged then.
    pub(super) fn apply_split(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        let (update, split) = (u.0, self.split(u));
        let Some(p) = mesh.slot(split.vertex) else {
            let vertex = split.vertex.0;
            let parent = self.created_by(split.vertex).ok_or(UpdateError::Vertex { update, vertex })?;
            return Ok(Applied::Blocked(parent));
        };
        let mut star = Star::default();
        mesh.gather_star(p, &mut star, |_, _| None::<()>).map_err(|_| UpdateError::Star { update })?;
        if let Some(first) = smallest_split(mesh, &star, update) {
            return Ok(Applied::Blocked(UpdateId(first)));
        }
        if star.len > MAX_STAR || mesh.is_pinched(p) {
            return Err(UpdateError::Star { update });
        }
        let sides = sides_in_canonical_order(mesh, &star, split.mask).ok_or(UpdateError::Mask { update })?;
        let fan = Fan::of(mesh, &star, sides).ok_or(UpdateError::Mask { update })?;
        let halves = Halves { positions: self.halve(mesh, u, p)? };
        if !mesh.is_proven(update) {
            self.prove(mesh, u, &star, sides, &fan, &halves)?;
            mesh.set_proven(update);
        }
        self.perform_split(mesh, u, p, &star, sides, &fan, &halves);
        Ok(Applied::Done)
    }

    /// Positions of `v'` and `v''`, checked against the lattices like the levels.
    fn halve(&self, mesh: &CurrentMesh, u: UpdateId, p: u32) -> Result<[[i32; 3]; 2], UpdateError> {
        let split = self.split(u);
        let off = UpdateError::OffLattice { update: u.0 };
        let largest = 1_i64 << self.info().lattice.bits;
        let mut positions = [[0; 3]; 2];
        let coordinates = mesh.positions[p as usize].into_iter().zip(split.offset);
        for (axis, (coordinate, offset)) in coordinates.enumerate() {
            let halves = half(coordinate, offset, largest);
            [positions[0][axis], positions[1][axis]] = halves.ok_or(off.clone())?;
        }
        let fields = self.info().fields.iter().zip(mesh.levels(p)).zip(split.field_offsets);
        for ((field, &level), &offset) in fields {
            half(level, offset, (1 << field.bits) - 1).ok_or(off.clone())?;
        }
        Ok(positions)
    }

    /// Checks what only damaged MTs violate: orientation, and errors that grow towards the base.
    fn prove(
        &self,
        mesh: &CurrentMesh,
        u: UpdateId,
        star: &Star,
        sides: u64,
        fan: &Fan,
        halves: &Halves,
    ) -> Result<(), UpdateError> {
        let error = self.split(u).error;
        for i in 0..star.len {
            let tet = mesh.tets[star.tets[i] as usize];
            let mut corners = tet.map(|v| mesh.positions[v as usize]);
            corners[star.corner[i] as usize] = halves.positions[(sides >> i & 1) as usize];
            let [a, b, c, d] = corners;
            if orient3d(a, b, c, d) <= 0 {
                return Err(UpdateError::Inverted { update: u.0 });
            }
            let parent = tet.iter().filter_map(|&v| self.created_by(mesh.vertex(v))).max();
            if parent.is_some_and(|p| self.split(p).error < error) {
                return Err(UpdateError::Error { update: u.0 });
            }
        }
        for triangle in &fan.triangles[..fan.len] {
            let (tet, c, j) = triangle.corners(mesh, star);
            let mut corners = tet.map(|v| mesh.positions[v as usize]);
            (corners[j], corners[c]) = (halves.positions[0], halves.positions[1]);
            let [a, b, c, d] = corners;
            if orient3d(a, b, c, d) <= 0 {
                return Err(UpdateError::Inverted { update: u.0 });
            }
        }
        Ok(())
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one plan, made by the caller step by step")]
    fn perform_split(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        p: u32,
        star: &Star,
        sides: u64,
        fan: &Fan,
        halves: &Halves,
    ) {
        let q = mesh.new_vertex();
        self.put_halves(mesh, u, [p, q], halves);
        let mut created = [NONE; MAX_LINK];
        created[..fan.len].iter_mut().for_each(|t| *t = mesh.new_tet());
        for (f, triangle) in fan.triangles[..fan.len].iter().enumerate() {
            let (mut tet, c, j) = triangle.corners(mesh, star);
            let (near, far, t) =
                (star.tets[triangle.near as usize], star.tets[triangle.far as usize], created[f]);
            // v'' goes where v was and v' opposite the fan triangle: the mirror image of the near tetrahedron.
            (tet[c], tet[j]) = (q, p);
            mesh.tets[t as usize] = tet;
            let mut around = [NONE; 4];
            (around[c], around[j]) = (near, far);
            let [k, l] = REST[c][j];
            let fan_tet = |partner: u8| if partner == NO_PARTNER { NONE } else { created[partner as usize] };
            // The face opposite x holds y, and the other way round.
            around[k as usize] = fan_tet(fan.partner[f][1]);
            around[l as usize] = fan_tet(fan.partner[f][0]);
            mesh.neighbors[t as usize] = around;
            mesh.neighbors[near as usize][j] = t;
            mesh.mark_tet(near);
            mesh.relink(far, near, t);
        }
        mesh.touch(&star.tets[..star.len]);
        mesh.touch(&created[..fan.len]);
        for i in 0..star.len {
            let t = star.tets[i];
            if sides >> i & 1 == 1 {
                mesh.tets[t as usize][star.corner[i] as usize] = q;
                mesh.mark_tet(t);
                mesh.incident[q as usize] = t;
            } else {
                mesh.incident[p as usize] = t;
            }
        }
    }

    /// Puts `v'` and `v''` with their levels into the slots `[p, q]`; `p` holds `v` so far.
    #[inline]
    fn put_halves(&self, mesh: &mut CurrentMesh, u: UpdateId, [p, q]: [u32; 2], halves: &Halves) {
        let created = self.created(u);
        for (slot, vertex, position) in
            [(p, created[0], halves.positions[0]), (q, created[1], halves.positions[1])]
        {
            mesh.put_vertex(slot, self.labels(vertex), position);
        }
        for (f, &offset) in self.split(u).field_offsets.iter().enumerate() {
            let [at_p, at_q] = [p, q].map(|slot| slot as usize * mesh.fields + f);
            mesh.levels[at_q] = mesh.levels[at_p] - (offset >> 1);
            mesh.levels[at_p] = mesh.levels[at_q] + offset;
        }
    }

    #[inline]
    fn labels(&self, vertex: VertexId) -> Labels {
        Labels { vertex: vertex.0, split: self.split_by(vertex).map_or(NONE, |u| u.0) }
    }

    /// Undoes update `u` (`u−`, an edge collapse) in `mesh`, which must contain it.
    ///
    /// # Errors
    /// Never for an update that was applied to this mesh by [`Self::apply_split`].
    pub(super) fn apply_collapse(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        let (mut near, mut far) = (Star::default(), Star::default());
        let [p, q] = match self.collapsible(mesh, u, &mut near, &mut far)? {
            Ok(slots) => slots,
            Err(child) => return Ok(Applied::Blocked(child)),
        };
        mesh.touch(&near.tets[..near.len]);
        mesh.touch(&far.tets[..far.len]);
        for &t in &far.tets[..far.len] {
            let tet = mesh.tets[t as usize];
            let at = |slot: u32| tet.iter().position(|&v| v == slot);
            let (at_p, at_q) = (at(p), at(q));
            match (at_p, at_q) {
                (Some(i), Some(j)) => close_fan(mesh, t, i, j, p),
                (None, Some(j)) => {
                    mesh.tets[t as usize][j] = p;
                    mesh.mark_tet(t);
                }
                _ => {}
            }
        }
        for (f, &offset) in self.split(u).field_offsets.iter().enumerate() {
            mesh.levels[p as usize * mesh.fields + f] =
                mesh.levels[q as usize * mesh.fields + f] + (offset >> 1);
        }
        let (b, offset) = (mesh.positions[q as usize], self.split(u).offset);
        let position = [0, 1, 2].map(|i| b[i] + (offset[i] >> 1));
        let far_vertex = mesh.labels[q as usize].vertex;
        mesh.slot_of[far_vertex as usize] = NONE;
        mesh.free_vertex(q);
        mesh.put_vertex(p, self.labels(self.split(u).vertex), position);
        Ok(Applied::Done)
    }

    /// The slots of `v'` and `v''` if update `u` can be undone, with their stars; else a child that is in the way.
    fn collapsible(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        near: &mut Star,
        far: &mut Star,
    ) -> Result<Result<[u32; 2], UpdateId>, UpdateError> {
        let update = u.0;
        let mut slots = [NONE; 2];
        for (slot, vertex) in slots.iter_mut().zip(self.created(u)) {
            match (mesh.slot(vertex), self.split_by(vertex)) {
                (Some(s), _) => *slot = s,
                (None, Some(child)) => return Ok(Err(child)),
                (None, None) => return Err(UpdateError::Vertex { update, vertex: vertex.0 }),
            }
        }
        // A vertex born after u next to v' or v'' was made by an update that depends on u.
        let born_after = self.created(u)[1].0 + 1;
        for (slot, star) in slots.into_iter().zip([near, far]) {
            let younger = |labels: &[Labels], tet: &[u32; 4]| {
                tet.iter().map(|&v| labels[v as usize].vertex).find(|&v| v >= born_after)
            };
            match mesh.gather_star(slot, star, younger) {
                Ok(()) => {}
                Err(Gather::TooLarge) => return Err(UpdateError::Star { update }),
                Err(Gather::Stopped(vertex)) => {
                    let child = self.created_by(VertexId(vertex));
                    return Ok(Err(child.ok_or(UpdateError::Vertex { update, vertex })?));
                }
            }
        }
        Ok(Ok(slots))
    }

    /// Shows `look` the tetrahedra that `u+` removes, in a mesh that contains `u`: their corners' positions and
    /// levels of `field`, until it returns true.
    pub(super) fn look_at_coarse_star(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        field: usize,
        look: LookAtTet<'_>,
    ) -> Result<Applied, UpdateError> {
        let (mut near, mut far) = (Star::default(), Star::default());
        let [p, q] = match self.collapsible(mesh, u, &mut near, &mut far)? {
            Ok(slots) => slots,
            Err(child) => return Ok(Applied::Blocked(child)),
        };
        let split = self.split(u);
        let b = mesh.positions[q as usize];
        let position = [0, 1, 2].map(|i| b[i] + (split.offset[i] >> 1));
        let level = mesh.levels(q)[field] + (split.field_offsets[field] >> 1);
        for (star, centre, other) in [(&near, p, q), (&far, q, p)] {
            for &t in &star.tets[..star.len] {
                let tet = mesh.tets[t as usize];
                if tet.contains(&other) {
                    continue;
                }
                let corners = tet.map(|v| if v == centre { position } else { mesh.positions[v as usize] });
                let levels = tet.map(|v| if v == centre { level } else { mesh.levels(v)[field] });
                if look(&corners, &levels) {
                    return Ok(Applied::Done);
                }
            }
        }
        Ok(Applied::Done)
    }
}

/// Removes fan tetrahedron `t`, whose corners `i` and `j` are `v'` (in slot `p`) and `v''`: its two neighbours at
/// the fan triangle become neighbours of each other.
fn close_fan(mesh: &mut CurrentMesh, t: u32, i: usize, j: usize, p: u32) {
    let (tet, around) = (mesh.tets[t as usize], mesh.neighbors[t as usize]);
    let (far, near) = (around[i], around[j]);
    mesh.relink(far, t, near);
    mesh.relink(near, t, far);
    mesh.incident[p as usize] = near;
    for k in REST[i][j] {
        mesh.incident[tet[k as usize] as usize] = near;
    }
    mesh.free_tet(t);
}

/// The two halves `[a, b]` of lattice value `v` under offset `d`: `b = v − (d >> 1)`, `a = b + d`, both in
/// `0 ..= largest`.
#[inline]
fn half(v: i32, d: i32, largest: i64) -> Option<[i32; 2]> {
    let b = i64::from(v) - i64::from(d >> 1);
    let a = b + i64::from(d);
    let holds = |x: i64| 0 <= x && x <= largest;
    (holds(a) && holds(b)).then_some([a as i32, b as i32])
}

/// The smallest update before `update` that splits a vertex of the star.
#[inline]
fn smallest_split(mesh: &CurrentMesh, star: &Star, update: u32) -> Option<u32> {
    let splits = star.tets[..star.len].iter().flat_map(|&t| mesh.tets[t as usize]);
    splits.map(|v| mesh.labels[v as usize].split).min().filter(|&s| s < update)
}

/// The side of each tetrahedron of the star as gathered: bit `i` for `star.tets[i]`. The mask is in canonical
/// order; none if it has bits beyond the star.
#[inline]
fn sides_in_canonical_order(mesh: &CurrentMesh, star: &Star, mask: u64) -> Option<u64> {
    if star.len < 64 && mask >> star.len != 0 {
        return None;
    }
    let mut keys = [0_u128; MAX_STAR];
    for (i, key) in keys[..star.len].iter_mut().enumerate() {
        *key = opposite_key(mesh, star, i) << 8 | i as u128;
    }
    keys[..star.len].sort_unstable();
    let bits = keys[..star.len].iter().enumerate();
    Some(bits.fold(0, |sides, (rank, key)| sides | (mask >> rank & 1) << (*key & 0xFF)))
}

/// The sorted vertex numbers of the face opposite the centre, as one number.
#[inline]
fn opposite_key(mesh: &CurrentMesh, star: &Star, i: usize) -> u128 {
    let tet = mesh.tets[star.tets[i] as usize].map(|v| mesh.labels[v as usize].vertex);
    let [j, k, l] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][star.corner[i] as usize];
    let (a, b, c) = (tet[j], tet[k], tet[l]);
    let (low, high) = (a.min(b), a.max(b));
    let (least, most) = (low.min(c), high.max(c));
    let middle = low.max(c.min(high));
    u128::from(least) << 64 | u128::from(middle) << 32 | u128::from(most)
}

impl CurrentMesh {
    /// Brings the mask of a split from the order of other vertex numbers, which `other` gives, to that of the MT's.
    /// None if the vertex is not in the mesh or its star is too large.
    pub(crate) fn reorder_mask(
        &mut self,
        vertex: VertexId,
        mask: u64,
        other: impl Fn(VertexId) -> u32,
    ) -> Option<u64> {
        let mut star = Star::default();
        let slot = self.slot(vertex)?;
        self.gather_star(slot, &mut star, |_, _| None::<()>).ok()?;
        if star.len > MAX_STAR {
            return None;
        }
        let face = |i: usize, number: &dyn Fn(VertexId) -> u32| {
            let tet = self.tets[star.tets[i] as usize];
            let rest = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][star.corner[i] as usize];
            let mut face = rest.map(|k: usize| number(self.vertex(tet[k])));
            face.sort_unstable();
            face
        };
        let order = |number: &dyn Fn(VertexId) -> u32| {
            let mut order: Vec<usize> = (0..star.len).collect();
            order.sort_unstable_by_key(|&i| face(i, number));
            order
        };
        let theirs = order(&other);
        let sides = theirs.iter().enumerate().fold(0_u64, |s, (rank, &i)| s | (mask >> rank & 1) << i);
        let ours = order(&|v: VertexId| v.0);
        Some(ours.iter().enumerate().fold(0_u64, |m, (rank, &i)| m | (sides >> i & 1) << rank))
    }
}

impl FanTriangle {
    /// The near tetrahedron, its corner at the centre of the star, and its corner opposite the triangle.
    #[inline]
    fn corners(&self, mesh: &CurrentMesh, star: &Star) -> ([u32; 4], usize, usize) {
        let tet = mesh.tets[star.tets[self.near as usize] as usize];
        (tet, star.corner[self.near as usize] as usize, self.face as usize)
    }
}

impl Fan {
    /// The fan between the two sides of a star, if it parts the star as a split must: its triangles follow each
    /// other around a closed loop of the link, or along one path from border to border of it. On its way the path
    /// may touch the border: then a side falls into parts, which the fan tetrahedra hold together.
    #[inline]
    fn of(mesh: &CurrentMesh, star: &Star, sides: u64) -> Option<Self> {
        let mut fan = Self {
            len: 0,
            triangles: [FanTriangle::default(); MAX_LINK],
            partner: [[NO_PARTNER; 2]; MAX_LINK],
        };
        for i in 0..star.len {
            let around = mesh.neighbors[star.tets[i] as usize];
            for j in (0..4).filter(|&j| j != star.corner[i] as usize) {
                let Some(n) = mesh.in_star(around[j]) else { continue };
                if sides >> i & 1 == 1 || sides >> n & 1 == 0 {
                    continue;
                }
                *fan.triangles.get_mut(fan.len)? = FanTriangle { near: i as u8, face: j as u8, far: n as u8 };
                fan.len += 1;
            }
        }
        let loose = fan.find_partners(mesh, star)?;
        let whole = match loose {
            0 => fan.walk(0, 0) == fan.len,
            2 => {
                let start = (0..fan.len).find(|&f| fan.partner[f].contains(&NO_PARTNER))?;
                let from = usize::from(fan.partner[start][0] != NO_PARTNER);
                fan.walk(start, from) == fan.len
            }
            _ => false,
        };
        (fan.len > 0 && whole).then_some(fan)
    }

    /// Finds, for both link vertices of every triangle, the other triangle there. Returns how many have none;
    /// none at all if three triangles meet in an edge, or two whose tetrahedra would lie on the same side of the
    /// face between them (around an edge where the mesh is not a manifold).
    #[inline]
    fn find_partners(&mut self, mesh: &CurrentMesh, star: &Star) -> Option<usize> {
        let mut ends = [[NONE; 2]; MAX_LINK];
        // Whether the corners (v'', v', first end, second end) are an odd permutation of the tetrahedron's.
        let mut odd = [0; MAX_LINK];
        let mut loose = 0;
        for f in 0..self.len {
            let (tet, c, j) = self.triangles[f].corners(mesh, star);
            ends[f] = REST[c][j].map(|i| tet[i as usize]);
            odd[f] = (c + j + usize::from(c < j)) & 1;
            for side in 0..2 {
                let same = (0..2 * f).find(|&e| ends[e / 2][e % 2] == ends[f][side]);
                let Some(e) = same else {
                    loose += 1;
                    continue;
                };
                let same_side = (odd[f] ^ side) == (odd[e / 2] ^ e % 2);
                if self.partner[e / 2][e % 2] != NO_PARTNER || same_side {
                    return None;
                }
                self.partner[e / 2][e % 2] = f as u8;
                self.partner[f][side] = (e / 2) as u8;
                loose -= 1;
            }
        }
        Some(loose)
    }

    /// Number of triangles met when going round from triangle `start`, entered at its end `from`.
    #[inline]
    fn walk(&self, start: usize, from: usize) -> usize {
        let (mut at, mut entered, mut count) = (start, from, 0);
        while count < self.len {
            count += 1;
            let next = self.partner[at][1 - entered];
            if next == NO_PARTNER || next as usize == start {
                break;
            }
            // Two triangles may be each other's partner at both ends; then the walk has just come full circle.
            let back = if self.partner[next as usize][0] as usize == at { 0 } else { 1 };
            (at, entered) = (next as usize, back);
        }
        count
    }
}

impl MultiTessellation for EdgeMt {
    fn info(&self) -> &MtInfo {
        self.info()
    }

    fn base(&self) -> &BaseMesh {
        self.base()
    }

    fn updates(&self) -> u32 {
        self.updates()
    }

    #[inline]
    fn error(&self, u: UpdateId) -> ErrorCode {
        self.error_of(u)
    }

    #[inline]
    fn remover(&self, mesh: &CurrentMesh, tet: &[u32; 4]) -> Option<UpdateId> {
        let first = tet.iter().map(|&v| mesh.labels[v as usize].split).min();
        first.filter(|&s| s != NONE).map(UpdateId)
    }

    #[inline]
    fn creator(&self, mesh: &CurrentMesh, tet: &[u32; 4]) -> Option<UpdateId> {
        tet.iter().filter_map(|&v| self.created_by(mesh.vertex(v))).max()
    }

    #[inline]
    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool {
        self.created(u).iter().all(|&v| mesh.slot(v).is_some())
    }

    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        self.apply_split(mesh, u)
    }

    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        self.apply_collapse(mesh, u)
    }

    fn look_at_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        field: usize,
        look: LookAtTet<'_>,
    ) -> Result<Applied, UpdateError> {
        self.look_at_coarse_star(mesh, u, field, look)
    }

    fn announce(&self, mesh: &mut CurrentMesh, known: u32) {
        for u in (known..self.updates()).map(UpdateId) {
            if let Some(slot) = mesh.slot(self.split(u).vertex) {
                mesh.labels[slot as usize].split = u.0;
            }
        }
    }
}
