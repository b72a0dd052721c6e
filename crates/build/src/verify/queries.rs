//! The requests that an MT is tried with: derived from the input alone, so that they are the same on every run.

use glam::DVec3;
use std::fmt;
use tetralod::geom::Bounds;
use tetralod::mesh::TetMesh;
use tetralod::mt::{ApplyUpdates, FieldInfo, MtInfo};
use tetralod::refine::{Budget, LodCriterion, Need, Region, Request, Transfer, View};

/// A request that an MT is tried with.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// What it is, in words.
    pub name: String,
    /// The request.
    pub request: Request,
}

impl fmt::Display for Query {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl Query {
    pub(super) fn new(name: &str, request: impl Into<Request>) -> Self {
        Self { name: name.to_owned(), request: request.into() }
    }

    pub(super) fn criterion(&self, info: &MtInfo) -> LodCriterion {
        LodCriterion::new(info, &self.request)
    }
}

const ERRORS: [f64; 5] = [0.0, 0.001, 0.01, 0.05, 0.2];

/// All requests for an MT of `input`.
pub fn of(mt: &impl ApplyUpdates, input: &TetMesh) -> Vec<Query> {
    let mut queries = Queries {
        all: Vec::new(),
        boxes: boxes(input),
        regions: regions(input),
        views: views(input),
        sizes: [mt.base().tets.len() as u64, mt.info().tetrahedra],
    };
    queries.add_uniform();
    queries.add_boxes();
    for (f, info) in mt.info().fields.iter().enumerate() {
        let values = input.fields.iter().find(|field| info.is_of(field));
        if let Some(values) = values {
            queries.add_values(f, info, &quantiles(&values.values));
        }
    }
    if mt.info().fields.len() > 1 {
        mt.info().fields.iter().enumerate().for_each(|(f, info)| queries.add_field(f, info));
    }
    queries.add_regions();
    queries.add_views();
    if let Some(info) = mt.info().fields.last() {
        queries.add_unions(mt.info().fields.len() - 1, info);
    }
    queries.all
}

struct Queries {
    all: Vec<Query>,
    boxes: [(&'static str, Bounds); 4],
    regions: [(&'static str, Region); 5],
    views: [(&'static str, View); 3],
    /// Tetrahedra of the base and of the reference mesh.
    sizes: [u64; 2],
}

impl Queries {
    /// So many tetrahedra that the mesh has grown from the base by one part in `k`.
    fn part(&self, k: u64) -> u32 {
        let [base, all] = self.sizes;
        (base + all.saturating_sub(base) / k) as u32
    }

    fn add(&mut self, what: &str, request: impl Into<Request>) {
        let request = request.into();
        let errors: Vec<String> = request.needs.iter().map(|need| need.error.to_string()).collect();
        let Budget { tets, vertices, bytes } = request.budget;
        let limit =
            |most: Option<u64>, of: &str| most.map_or(String::new(), |n| format!(", at most {n} {of}"));
        let name = format!(
            "{what}, error {}{}{}{}",
            errors.join(" and "),
            limit(tets.map(u64::from), "tetrahedra"),
            limit(vertices.map(u64::from), "vertices"),
            limit(bytes, "bytes")
        );
        self.all.push(Query { name, request });
    }

    fn add_uniform(&mut self) {
        for error in ERRORS.into_iter().chain([f64::INFINITY]) {
            self.add("uniform", Need::within(error));
        }
        for budget in [0, self.part(100), self.part(10), self.part(2), u32::MAX] {
            self.add("uniform", Request::within(0.0).at_most(budget));
        }
        self.add("uniform", Request::within(0.01).at_most(self.part(50)));
    }

    fn add_boxes(&mut self) {
        for (i, (name, roi)) in self.boxes.into_iter().enumerate() {
            for error in [0.0, ERRORS[i % 4 + 1]] {
                self.add(name, Need::within(error).inside(roi));
            }
            self.add(name, Request::from(Need::within(0.0).inside(roi)).at_most(self.part(30)));
        }
    }

    fn add_values(&mut self, field: usize, info: &FieldInfo, quantiles: &[f64]) {
        for (i, &value) in quantiles.iter().enumerate() {
            let name = format!("{} = {value}", info.name);
            let around = |error: f64| Need::within(error).around(field, &[value]);
            self.add(&name, around(ERRORS[i % 4]));
            let (roi_name, roi) = self.boxes[i % self.boxes.len()];
            let both = format!("{roi_name} and {name}");
            self.add(&both, around(0.001).inside(roi));
            if i % 2 == 0 {
                self.add(&both, Request::from(around(0.0).inside(roi)).at_most(self.part(20)));
            }
        }
        let several = |error: f64| Need::within(error).around(field, quantiles);
        let name = format!("{} at all quantiles", info.name);
        self.add(&name, several(0.01));
        self.add(&name, Request::from(several(0.0)).at_most(self.part(5)));
        let at = |part: f64| info.min + part * info.range();
        let bands = vec![[at(0.3), at(0.4)], [at(0.9), f64::INFINITY]];
        self.add(&format!("two bands of {}", info.name), Need::within(0.005).between(field, bands));
    }

    fn add_regions(&mut self) {
        for (i, (name, region)) in self.regions.clone().into_iter().enumerate() {
            self.add(name, Need::within(ERRORS[i % 3]).inside(region));
        }
    }

    fn add_views(&mut self) {
        let views = self.views;
        for (name, view) in views {
            self.add(name, Need::seen(view, 2.0));
        }
        let (name, view) = views[0];
        for k in [20, 5] {
            let bytes = Some(40 * u64::from(self.part(k)));
            let budget = Budget { bytes, ..Budget::default() };
            self.add(name, Request { budget, ..Need::seen(view, 0.5).into() });
        }
    }

    /// Needs of one field among several.
    fn add_field(&mut self, field: usize, info: &FieldInfo) {
        let (name, roi) = self.boxes[field % self.boxes.len()];
        let only = |error: f64| Need::within(error).of_field(field);
        self.add(&format!("{} alone", info.name), only(ERRORS[field % 3 + 1]));
        self.add(&format!("{} alone, {name}", info.name), only(ERRORS[field % 2]).inside(roi));
        self.add(&format!("{} alone", info.name), Request::from(only(0.0)).at_most(self.part(10)));
        self.add(&format!("{} exactly, all coarsely", info.name), Request::within(0.1).and(only(0.002)));
    }

    /// Colours of a field, and needs of several kinds at once.
    fn add_unions(&mut self, field: usize, info: &FieldInfo) {
        let at = |part: f64| info.min + part * info.range();
        let [clear, red, white] = [[0.0; 4], [1.0, 0.2, 0.0, 0.4], [1.0, 1.0, 1.0, 0.9]];
        let ramp = vec![(at(0.2), clear), (at(0.5), red), (at(0.8), white), (at(0.9), clear)];
        let step = vec![(at(0.4), clear), (at(0.4), red)];
        let shown =
            |points: &[(f64, [f64; 4])]| Transfer { field, points: points.to_vec(), unit_length: 0.5 };
        let (ramp, step) = (shown(&ramp), shown(&step));
        self.add("ramps of colour", Need::shown(ramp.clone(), 0.05));
        self.add("a step of colour", Need::shown(step, 0.1));
        let tight = Request::from(Need::shown(ramp.clone(), 0.0)).at_most(self.part(10));
        self.add("ramps of colour", tight);

        let ((_, corner), (_, middle)) = (self.boxes[0], self.boxes[1]);
        let [ball, .., slab] = self.regions.clone().map(|(_, region)| region);
        let view = self.views[1].1;
        let two = Request::within(0.05).and(Need::within(0.0).inside(corner));
        self.add("everywhere and a box", two.clone().and(Need::within(0.002).inside(middle)));
        let around = Need::within(0.01).around(field, &[at(0.6)]);
        let kinds = Request::from(Need::within(0.001).inside(ball)).and(around).and(Need::seen(view, 4.0));
        self.add("a ball, a value and a view", kinds.clone());
        let colours = Request::from(Need::shown(ramp, 0.1)).and(Need::within(0.0).inside(slab));
        self.add("ramps of colour and a region", colours);
        for k in [40, 8] {
            let vertices = Some(self.part(k) / 5);
            let budget = Budget { vertices, ..Budget::default() };
            self.add("a ball, a value and a view", Request { budget, ..kinds.clone() });
        }
        self.add("everywhere and a box", two.at_most(self.part(15)));
    }
}

/// A place in a box, by fractions of its sides.
pub fn place(whole: &Bounds, part: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| whole.min[i] + part[i] * (whole.max[i] - whole.min[i]))
}

/// A corner, the middle, a plane through the middle and a single vertex.
fn boxes(input: &TetMesh) -> [(&'static str, Bounds); 4] {
    let whole = Bounds::of(&input.positions);
    let between =
        |low: [f64; 3], high: [f64; 3]| Bounds { min: place(&whole, low), max: place(&whole, high) };
    let vertex = input.positions[input.positions.len() / 3];
    [
        ("box in a corner", between([-0.1; 3], [0.4, 0.3, 0.5])),
        ("box in the middle", between([0.35; 3], [0.65; 3])),
        ("plane", between([0.0, 0.0, 0.55], [1.0, 1.0, 0.55])),
        ("one vertex", Bounds { min: vertex, max: vertex }),
    ]
}

/// One of each shape that is no box along the axes.
fn regions(input: &TetMesh) -> [(&'static str, Region); 5] {
    let whole = Bounds::of(&input.positions);
    let size = 0.1 * whole.diagonal();
    let [centre, side] = [place(&whole, [0.4, 0.6, 0.5]), place(&whole, [0.8, 0.3, 0.4])];
    let along = |normal: [f64; 3], p: [f64; 3]| DVec3::from(normal).dot(DVec3::from(p));
    let halves = [[0.8, 0.6, 0.0], [-0.3, 0.4, 0.0], [0.0, 0.0, 1.2]].map(|v: [f64; 3]| v.map(|x| x * size));
    let [tilted, across] = [[1.0, 2.0, -1.0], [-2.0, 1.0, 0.5]];
    let plane = |n: [f64; 3], p: [f64; 3]| [n[0], n[1], n[2], along(n, p)];
    [
        ("ball", Region::Sphere { centre, radius: 1.5 * size }),
        ("oriented box", Region::OrientedBox { centre: side, halves }),
        ("half-space", Region::HalfSpace { normal: tilted, offset: along(tilted, place(&whole, [0.15; 3])) }),
        (
            "wedge",
            Region::Convex(vec![
                plane(tilted, centre),
                plane(across, centre),
                plane([0.0, 0.0, 1.0], place(&whole, [0.5; 3])),
            ]),
        ),
        ("slab", Region::Slab { normal: across, offset: along(across, side), thickness: 0.2 * size }),
    ]
}

/// A camera in front of the volume, one inside it, and one that sees a part of it without perspective.
fn views(input: &TetMesh) -> [(&'static str, View); 3] {
    let whole = Bounds::of(&input.positions);
    let size = whole.diagonal();
    let at = |part: [f64; 3]| DVec3::from(place(&whole, part));
    let viewport = [1280.0, 720.0];
    let way = DVec3::new(0.6, -0.75, 0.3);
    let far = perspective(at([0.5; 3]) - 1.1 * size * way, way, 2.2, viewport);
    let near = perspective(at([0.45, 0.5, 0.3]), DVec3::new(0.3, 0.4, 0.5), 1.5, viewport);
    let parallel = parallel(at([0.7, 0.4, 0.5]), 6.0 / size, viewport);
    [("view from outside", far), ("view from inside", near), ("parallel view", parallel)]
}

/// A camera without perspective that looks along z at a point; lengths are multiplied by `scale`.
pub fn parallel(centre: DVec3, scale: f64, viewport: [f64; 2]) -> View {
    let [x, y, z] = (centre * scale).to_array();
    let columns = [
        [scale, 0.0, 0.0, 0.0],
        [0.0, 1.5 * scale, 0.0, 0.0],
        [0.0, 0.0, scale, 0.0],
        [-x, -1.5 * y, -z, 1.0],
    ];
    View { matrix: std::array::from_fn(|i| columns[i / 4][i % 4]), viewport }
}

/// A camera at `eye` that looks along `way`, z up; `zoom` is the distance at which the picture is 2 units high.
pub fn perspective(eye: DVec3, way: DVec3, zoom: f64, viewport: [f64; 2]) -> View {
    let forward = way.normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    let rows = [right * (zoom * viewport[1] / viewport[0]), up * zoom, forward, forward];
    let column = |axis: usize| rows.map(|row| row[axis]);
    let columns = [column(0), column(1), column(2), rows.map(|row| -row.dot(eye))];
    View { matrix: std::array::from_fn(|i| columns[i / 4][i % 4]), viewport }
}

/// Values that split the field's values into parts of equal size, and two at the ends of the range.
fn quantiles(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |part: f64| sorted[((sorted.len() - 1) as f64 * part) as usize];
    let mut chosen = vec![at(0.1), at(0.5), at(0.9), 0.5 * (at(0.0) + at(1.0)), at(0.999)];
    chosen.sort_by(f64::total_cmp);
    chosen.dedup();
    chosen
}
