//! Isosurfaces by marching tetrahedra, into buffers that are used again.
//!
//! A point is *inside* when its value is smaller than the isovalue; a point that has exactly the isovalue is
//! outside, and a surface through it uses the point itself. The surface is indexed: one vertex for each crossed
//! edge or touched point, shared by all triangles around it.
//!
//! What holds for the triangles:
//! - Normals and counter-clockwise sides point towards **lower** values, so the surface around a blob of high
//!   values shows its front to the outside.
//! - No triangle names a vertex twice. Triangles of no area remain possible where rounding to `f32` makes
//!   neighbouring crossings coincide.
//! - Inside the domain every directed edge has exactly as many opposite ones: the surface is closed. An edge has
//!   two triangles, or an even number where the surface touches itself along points of exactly the isovalue.
//! - The result depends on the order of points and tetrahedra only: same mesh, same bytes.

use crate::mesh::NONE;
use crate::view::MeshView;

/// Edges of a tetrahedron as the table of cases numbers them.
const ENDS: [[usize; 2]; 6] = crate::mesh::EDGES;

/// The crossed edges of each of the 16 cases, in an order that turns counter-clockwise when seen from the inside;
/// bit `i` of the case is set when vertex `i` is inside. Four edges make a quadrilateral.
const CASES: [&[usize]; 16] = [
    &[],
    &[0, 2, 1],
    &[0, 3, 4],
    &[1, 3, 4, 2],
    &[1, 5, 3],
    &[2, 5, 3, 0],
    &[0, 1, 5, 4],
    &[2, 5, 4],
    &[2, 4, 5],
    &[0, 4, 5, 1],
    &[3, 5, 2, 0],
    &[1, 3, 5],
    &[1, 2, 4, 3],
    &[0, 4, 3],
    &[0, 1, 2],
    &[],
];

/// An isosurface, and the memory to extract the next one without allocating.
#[derive(Clone, Debug, Default)]
pub struct IsoSurface {
    /// Vertices, in model units.
    pub positions: Vec<[f32; 3]>,
    /// One unit normal per vertex, towards lower values.
    pub normals: Vec<[f32; 3]>,
    /// Triangles, counter-clockwise when seen from lower values.
    pub indices: Vec<[u32; 3]>,
    scratch: Scratch,
}

/// Where the surface crosses an edge: its ends, or twice the same point if the surface goes through that point.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    inside: u32,
    outside: u32,
    /// The next crossing that is chained at the same point.
    next: u32,
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    /// Per point of the mesh, the first crossing chained at it. All `NONE` between two extractions.
    chains: Vec<u32>,
    /// Per point of the mesh, its place in `gradients`. All `NONE` between two extractions.
    slots: Vec<u32>,
    /// One per vertex of the surface.
    crossings: Vec<Crossing>,
    /// Per end of a crossing: six times the sum of volume · gradient and of volume over its star.
    gradients: Vec<[f64; 4]>,
}

impl IsoSurface {
    /// An empty surface.
    pub fn new() -> Self {
        Self::default()
    }

    /// Replaces this surface by the one of `mesh` at `value` (rounded to `f32`, as the field is).
    ///
    /// Costs one pass over the tetrahedra, and a second one for the normals if there is a surface.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract(&mut self, mesh: &MeshView<'_>, value: f64) {
        let value = value as f32;
        self.clear(mesh.positions.len());
        self.march(mesh, value);
        self.place(mesh, value);
        self.sum_gradients(mesh);
        self.set_normals(mesh, value);
        self.mend_normals();
        self.release();
    }

    fn clear(&mut self, points: usize) {
        self.positions.clear();
        self.normals.clear();
        self.indices.clear();
        self.scratch.crossings.clear();
        self.scratch.gradients.clear();
        self.scratch.chains.resize(points, NONE);
        self.scratch.slots.resize(points, NONE);
    }

    /// Finds the triangles, and the crossings that are their vertices.
    fn march(&mut self, mesh: &MeshView<'_>, value: f32) {
        for tet in mesh.tets {
            let values = tet.map(|p| mesh.field[p as usize]);
            let case = values.iter().rev().fold(0, |case, v| case << 1 | usize::from(*v < value));
            let edges = CASES[case];
            if edges.is_empty() {
                continue;
            }
            let mut corners = [0; 4];
            for (corner, &edge) in corners.iter_mut().zip(edges) {
                let [a, b] = ENDS[edge];
                let [inside, outside] = if case >> a & 1 == 1 { [a, b] } else { [b, a] };
                let touched = values[outside] == value;
                *corner = self.scratch.vertex(tet[if touched { outside } else { inside }], tet[outside]);
            }
            self.add_triangle([corners[0], corners[1], corners[2]]);
            if edges.len() == 4 {
                self.add_triangle([corners[0], corners[2], corners[3]]);
            }
        }
    }

    /// Adds a triangle unless a touched point has made it an edge.
    fn add_triangle(&mut self, [a, b, c]: [u32; 3]) {
        if a != b && b != c && c != a {
            self.indices.push([a, b, c]);
        }
    }

    /// Sets the positions of the vertices: where the linear field along the edge has the value.
    fn place(&mut self, mesh: &MeshView<'_>, value: f32) {
        self.positions.extend(self.scratch.crossings.iter().map(|crossing| {
            let [p, q] = crossing.ends().map(|point| mesh.positions[point].map(f64::from));
            let t = crossing.fraction(mesh.field, value);
            [0, 1, 2].map(|i| (p[i] + t * (q[i] - p[i])) as f32)
        }));
    }

    /// Sums the gradients of the tetrahedra around every end of a crossing, each with its volume as weight.
    fn sum_gradients(&mut self, mesh: &MeshView<'_>) {
        let Scratch { slots, crossings, gradients, .. } = &mut self.scratch;
        for end in crossings.iter().flat_map(Crossing::ends) {
            if slots[end] == NONE {
                slots[end] = gradients.len() as u32;
                gradients.push([0.0; 4]);
            }
        }
        if crossings.is_empty() {
            return;
        }
        for tet in mesh.tets {
            let places = tet.map(|p| slots[p as usize]);
            if places == [NONE; 4] {
                continue;
            }
            let weighted = weighted_gradient(mesh, *tet);
            for place in places.into_iter().filter(|place| *place != NONE) {
                let sum = &mut gradients[place as usize];
                (0..4).for_each(|i| sum[i] += weighted[i]);
            }
        }
    }

    /// Interpolates the gradients along the edges; a normal that cannot be told is left at zero.
    fn set_normals(&mut self, mesh: &MeshView<'_>, value: f32) {
        let Scratch { slots, crossings, gradients, .. } = &self.scratch;
        self.normals.extend(crossings.iter().map(|crossing| {
            let t = crossing.fraction(mesh.field, value);
            let [g, h] = crossing.ends().map(|end| {
                let [x, y, z, volume] = gradients[slots[end] as usize];
                [x, y, z].map(|v| if volume > 0.0 { v / volume } else { 0.0 })
            });
            unit([0, 1, 2].map(|i| -(g[i] + t * (h[i] - g[i])))).unwrap_or([0.0; 3])
        }));
    }

    /// Gives vertices at which the gradient vanishes the mean direction of their triangles, or +z as last resort.
    fn mend_normals(&mut self) {
        if !self.normals.contains(&[0.0; 3]) {
            return;
        }
        let mut sums = vec![[0.0; 3]; self.normals.len()];
        for triangle in &self.indices {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize].map(f64::from));
            let area = cross(sub(b, a), sub(c, a));
            for v in triangle {
                (0..3).for_each(|i| sums[*v as usize][i] += area[i]);
            }
        }
        for (normal, sum) in self.normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == [0.0; 3]) {
            *normal = unit(sum).unwrap_or([0.0, 0.0, 1.0]);
        }
    }

    /// Empties the per-point tables where they were used, which is a small part of them.
    fn release(&mut self) {
        let Scratch { slots, chains, crossings, .. } = &mut self.scratch;
        for end in crossings.iter().flat_map(Crossing::ends) {
            chains[end] = NONE;
            slots[end] = NONE;
        }
    }
}

impl Crossing {
    fn ends(&self) -> [usize; 2] {
        [self.inside as usize, self.outside as usize]
    }

    /// How far the crossing is from the inside end to the outside end, 0 to 1.
    fn fraction(&self, field: &[f32], value: f32) -> f64 {
        if self.inside == self.outside {
            return 0.0;
        }
        let [low, high] = self.ends().map(|end| f64::from(field[end]));
        let t = (f64::from(value) - low) / (high - low);
        // Only infinite values make it NaN.
        if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) }
    }
}

impl Scratch {
    /// The surface vertex of this crossing: an earlier one, or a new one.
    fn vertex(&mut self, inside: u32, outside: u32) -> u32 {
        let first = self.chains[inside as usize];
        let mut at = first;
        while at != NONE {
            let crossing = self.crossings[at as usize];
            if crossing.outside == outside {
                return at;
            }
            at = crossing.next;
        }
        let new = self.crossings.len() as u32;
        self.crossings.push(Crossing { inside, outside, next: first });
        self.chains[inside as usize] = new;
        new
    }
}

/// Six times volume · gradient, and six times the volume, of one tetrahedron.
fn weighted_gradient(mesh: &MeshView<'_>, tet: [u32; 4]) -> [f64; 4] {
    let [a, b, c, d] = tet.map(|p| mesh.positions[p as usize].map(f64::from));
    let [fa, fb, fc, fd] = tet.map(|p| f64::from(mesh.field[p as usize]));
    let (u, v, w) = (sub(b, a), sub(c, a), sub(d, a));
    let (vw, wu, uv) = (cross(v, w), cross(w, u), cross(u, v));
    let g = |i: usize| (fb - fa) * vw[i] + (fc - fa) * wu[i] + (fd - fa) * uv[i];
    [g(0), g(1), g(2), dot(u, vw)]
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `v` at length 1; `None` if it has no direction.
fn unit(v: [f64; 3]) -> Option<[f32; 3]> {
    // Divided by the largest component first, so that tiny and huge gradients do not leave the range of `f64`.
    let largest = v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let v = v.map(|x| x / largest);
    let length = dot(v, v).sqrt();
    (length.is_finite() && length > 0.0).then(|| v.map(|x| (x / length) as f32))
}
