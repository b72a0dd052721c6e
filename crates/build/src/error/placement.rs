//! Where the points of replaced tetrahedra go, and the errors there: the common part of collapses and removals.

use crate::error::buckets::Buckets;
use crate::error::outside_points::Known;
use crate::error::points::{PointId, SLACK, barycentric, clamped};
use crate::error::reference::{Reference, ReferencePoint};
use glam::{DMat3, DVec3};
use tetralod::geom::nearest_on_triangle;

/// The tetrahedra that replace others, and the boundary triangles among their faces.
pub(crate) trait Replacement {
    fn reference(&self) -> &Reference<'_>;
    /// The boundary triangles: the cell and the corners.
    fn border(&self) -> &[(u32, [u32; 3])];
    /// A corner of a boundary triangle in model units, from the lattice's origin.
    fn corner(&self, v: u32) -> DVec3;
    /// The corners of a cell, in steps of the lattice.
    fn corners(&self, cell: usize) -> [DVec3; 4];
    /// The levels of a field at the corners of a cell.
    fn levels(&self, cell: usize, field: usize) -> [i32; 4];
    /// The region of a cell, if fields jump between regions.
    fn region(&self, _cell: usize) -> Option<u32> {
        None
    }
    /// A position in model units, relative to the origin of a cell, in steps of the lattice.
    fn relative(&self, q: DVec3, origin: DVec3) -> DVec3;
}

/// Where a point belongs.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    pub cell: usize,
    /// Whether it is outside of the cell.
    pub outside: bool,
    /// The error there.
    pub error: f64,
}

/// A new tetrahedron: where its points are.
#[derive(Clone, Copy, Default)]
struct Cell {
    /// `(λ_1, λ_2, λ_3)` of a point are this times its position relative to corner 0.
    barycentric: DMat3,
    origin: DVec3,
}

/// A boundary triangle in model units.
struct Face {
    corners: [DVec3; 3],
    normal: DVec3,
    /// The normal's length, squared.
    area: f64,
}

impl Face {
    fn new(corners: [DVec3; 3]) -> Self {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        Self { corners, normal, area: normal.length_squared() }
    }
}

/// The new cells of points, and the errors of the fields there; reused for each candidate.
#[derive(Default)]
pub(crate) struct Placement {
    /// The cells, if they are made: that is done when they are first needed.
    cells: Vec<Cell>,
    made: Vec<bool>,
    /// The boundary triangles, made when they are first needed.
    faces: Vec<Face>,
    /// For each point its cell, or the complement of its number if the point is outside.
    moves: Vec<(u32, i32)>,
    /// Points of other buckets that are inside: point and cell.
    foreign: Vec<(PointId, u32)>,
    border_moves: Vec<(u32, u32)>,
    /// The error of each field.
    pub errors: Vec<f64>,
}

impl Placement {
    /// Starts with so many cells, and no points.
    pub fn start(&mut self, cells: usize) {
        if self.cells.len() < cells {
            self.cells.resize_with(cells, Cell::default);
        }
        self.made.clear();
        self.made.resize(cells, false);
        self.faces.clear();
        self.moves.clear();
        self.foreign.clear();
        self.border_moves.clear();
    }

    /// Raises the errors of all fields to at least this.
    pub fn raise(&mut self, least: f64) {
        self.errors.iter_mut().for_each(|error| *error = error.max(least));
    }

    /// The cell that contains a position, in steps of the lattice, or is least outside of: its barycentric coordinates there but for
    /// the first one, and how deep inside it lies. The cell `hint` is tested first.
    pub fn locate(&mut self, position: DVec3, hint: usize, new: &impl Replacement) -> (usize, DVec3, f64) {
        let (mut cell, mut lambda, mut depth) = self.try_cell(hint, position, new);
        let mut next = 0;
        while depth < 0.0 && next < self.made.len() {
            if next != hint {
                let other = self.try_cell(next, position, new);
                if other.2 > depth {
                    (cell, lambda, depth) = other;
                }
            }
            next += 1;
        }
        (cell, lambda, depth)
    }

    /// The barycentric coordinates of a position in a cell, and how deep inside it lies.
    #[inline]
    fn try_cell(&mut self, i: usize, position: DVec3, new: &impl Replacement) -> (usize, DVec3, f64) {
        let Cell { barycentric, origin } = self.cell(i, new);
        let lambda = *barycentric * (position - *origin);
        let (least, own) = (lambda.min_element(), 1.0 - lambda.element_sum());
        (i, lambda, if least < own { least } else { own })
    }

    #[inline]
    fn cell(&mut self, i: usize, new: &impl Replacement) -> &Cell {
        if !self.made[i] {
            self.make(i, new);
        }
        &self.cells[i]
    }

    #[inline(never)]
    fn make(&mut self, i: usize, new: &impl Replacement) {
        // The orientation was found positive, so the matrices are regular.
        let corners = new.corners(i);
        self.cells[i] = Cell { barycentric: barycentric(corners), origin: corners[0] };
        self.made[i] = true;
    }

    /// Finds the cell for a point, testing `hint` first, and notes it. Returns the error there and the cell.
    pub fn place(&mut self, point: u32, hint: usize, new: &impl Replacement) -> (f64, usize) {
        let Found { cell, outside, error } = self.find(point, hint, new);
        self.moves.push((point, if outside { !(cell as i32) } else { cell as i32 }));
        (error, cell)
    }

    /// Finds the cell for a point, testing `hint` first.
    pub fn find(&mut self, point: impl ReferencePoint, hint: usize, new: &impl Replacement) -> Found {
        let reference = new.reference();
        let (mut cell, mut lambda, depth) = self.locate(point.place(reference), hint, new);
        // The point stays outside of the mesh where no boundary is near, too: it was not in the star from the start.
        let outside = depth < -SLACK;
        let mut displaced = 0.0;
        if outside && !new.border().is_empty() {
            let (p, moved) = reference.place(point);
            let (found, q, distance) = self.nearest(p, usize::MAX, new);
            cell = found as usize;
            let Cell { barycentric, origin } = self.cell(cell, new);
            lambda = *barycentric * new.relative(q, *origin);
            displaced = reference.error_at(point, distance - moved);
            self.raise(displaced);
        }
        let region = point.region(reference);
        if region.is_some() && new.region(cell) != region {
            (cell, lambda) = self.locate_in(point, region, new).unwrap_or((cell, lambda));
        }
        let error = self.compare(point, cell, lambda, new).max(displaced);
        Found { cell, outside, error }
    }

    /// The cell of a point's region that contains it, or is least outside of.
    fn locate_in(
        &mut self,
        point: impl ReferencePoint,
        region: Option<u32>,
        new: &impl Replacement,
    ) -> Option<(usize, DVec3)> {
        let place = point.place(new.reference());
        let cells: Vec<usize> = (0..self.made.len()).filter(|&cell| new.region(cell) == region).collect();
        let mut best: Option<(usize, DVec3, f64)> = None;
        for cell in cells {
            let found = self.try_cell(cell, place, new);
            if best.is_none_or(|best| found.2 > best.2) {
                best = Some(found);
            }
        }
        best.map(|(cell, lambda, _)| (cell, lambda))
    }

    /// Notes the cell that contains a point.
    pub fn moved_to(&mut self, point: u32, cell: usize) {
        self.moves.push((point, cell as i32));
    }

    /// The largest error at those of `points`, which are in other buckets, that the new cells contain.
    pub fn place_foreign<P: ReferencePoint>(
        &mut self,
        points: impl Iterator<Item = (PointId, P)>,
        new: &impl Replacement,
    ) -> f64 {
        self.foreign.clear();
        let mut error = 0.0_f64;
        for (id, point) in points {
            let (cell, lambda, depth) = self.locate(point.place(new.reference()), 0, new);
            let region = point.region(new.reference());
            if depth >= -SLACK && (region.is_none() || region == new.region(cell)) {
                self.foreign.push((id, cell as u32));
                error = error.max(self.compare(point, cell, lambda, new));
            }
        }
        error
    }

    /// Finds the boundary triangles for reference vertices of the boundary. Returns the largest error of their distances.
    pub fn place_on_border(&mut self, points: impl Iterator<Item = u32>, new: &impl Replacement) -> f64 {
        self.border_moves.clear();
        let mut largest = 0.0_f64;
        for point in points {
            let p = new.reference().position(point);
            let (cell, _, distance) = self.nearest(p, usize::MAX, new);
            self.border_moves.push((point, cell));
            largest = largest.max(new.reference().error_at(point, distance));
        }
        largest
    }

    /// The nearest of the first `count` boundary triangles: its cell, the nearest point, and the distance.
    pub fn nearest(&mut self, p: DVec3, count: usize, new: &impl Replacement) -> (u32, DVec3, f64) {
        let border = new.border();
        if self.faces.is_empty() {
            self.faces.extend(border.iter().map(|&(_, face)| Face::new(face.map(|v| new.corner(v)))));
        }
        let (mut least, mut found, mut nearest) = (f64::INFINITY, 0, p);
        for (i, face) in self.faces.iter().take(count).enumerate() {
            // No point of a triangle is nearer than its plane.
            let height = (p - face.corners[0]).dot(face.normal);
            if height * height > least * face.area {
                continue;
            }
            let q = nearest_on_triangle(p, face.corners);
            let distance = p.distance_squared(q);
            if distance < least {
                (least, found, nearest) = (distance, i, q);
            }
        }
        (border.get(found).map_or(0, |&(cell, _)| cell), nearest, least.sqrt())
    }

    /// Raises the errors to those at a point with these barycentric coordinates in a cell; returns the largest one.
    pub fn compare(
        &mut self,
        point: impl ReferencePoint,
        cell: usize,
        lambda: DVec3,
        new: &impl Replacement,
    ) -> f64 {
        let quantized = new.reference().quantized;
        let levels = |f| new.levels(cell, f);
        quantized.deviation_from(point.values(quantized), clamped(lambda), levels, &mut self.errors)
    }

    /// The points whose cells have been noted, their cells, and whether they are outside of them.
    pub fn moves(&self) -> impl Iterator<Item = (u32, usize, bool)> {
        self.moves.iter().map(|&(point, cell)| {
            let outside = cell < 0;
            (point, if outside { !cell } else { cell } as usize, outside)
        })
    }

    /// Puts the points into the buckets of their new cells, those inside unless they are stored; `tets` are the numbers of the cells.
    pub fn move_points(
        &self,
        buckets: &mut Buckets<'_>,
        reference: &Reference<'_>,
        tets: impl Fn(u32) -> u32,
    ) {
        if buckets.stored.is_none() {
            for (point, cell, outside) in self.moves() {
                buckets.inside.put(tets(cell as u32), point);
                let known = || Known::at(reference.quantized.places.at(point));
                buckets.outside_points.set_outside(point.into(), outside, known);
            }
        }
        self.foreign.iter().for_each(|&(point, cell)| buckets.outside_points.add_foreign(tets(cell), point));
        self.border_moves.iter().for_each(|&(point, cell)| buckets.border.put(tets(cell), point));
    }
}
