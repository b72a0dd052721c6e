//! A mesh by itself, which no later request changes, and what is made of it: surfaces, values at points, streamlines, sums.

use crate::array::Array;
use crate::errors::Failure;
use crate::watch::Watch;
use pyo3::prelude::*;
use std::sync::Arc;
use tetralod::mesh::NONE;
use tetralod::session::Session;
use tetralod::view::{
    BoundarySurface, FieldStats, FieldView, Histogram, IsoSurface, MeshView, NormalKind, Place, Plane, Probe,
    Slice, StreamPoint, TraceOptions, Tracer,
};

/// A mesh with the values of some fields at its points.
#[pyclass(frozen)]
pub struct Mesh {
    positions: Arc<Vec<[f64; 3]>>,
    tets: Arc<Vec<[u32; 4]>>,
    neighbors: Arc<Vec<[u32; 4]>>,
    /// Of each tetrahedron, where the file has regions.
    regions: Vec<u32>,
    groups: Vec<Group>,
    /// Of each field of the file, whether it is a label.
    labels: Vec<bool>,
}

/// Fields that are one array: the components of a vector, or one scalar field.
struct Group {
    /// Their numbers in the file.
    fields: Vec<usize>,
    /// The values of one behind those of the other.
    values: Arc<Vec<f64>>,
}

/// Points, triangles and the arrays of values.
type Triangles = (Array, Array, Vec<Array>);

/// How far streamlines go, and which way.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Way {
    forward: bool,
    backward: bool,
    max_length: f64,
    max_steps: u32,
    step: f64,
}

impl Mesh {
    /// The current mesh of a session, or its part in the regions that are shown; none if there is no mesh yet.
    pub fn of(
        session: &Session,
        groups: Vec<Vec<usize>>,
        shown: Option<&[u16]>,
        exact: bool,
    ) -> Option<Self> {
        let (mesh, info) = (session.mesh()?, session.info()?);
        let values = |field: usize| if exact { session.exact_values(field) } else { session.values(field) };
        let group = |fields: Vec<usize>| {
            let all: Vec<Vec<f64>> = fields.iter().map(|&field| values(field)).collect();
            let values = <[Vec<f64>; 1]>::try_from(all).map_or_else(|all| all.concat(), |[only]| only);
            Group { fields, values: Arc::new(values) }
        };
        let whole = Self {
            positions: Arc::new(mesh.positions().iter().map(|&q| info.lattice.point(q)).collect()),
            tets: Arc::new(mesh.tets().to_vec()),
            neighbors: Arc::new(mesh.neighbors().to_vec()),
            regions: mesh.regions().iter().map(|&region| region.into()).collect(),
            groups: groups.into_iter().map(group).collect(),
            labels: info.fields.iter().map(|field| field.is_label).collect(),
        };
        Some(match shown {
            Some(shown) => whole.part(|t| shown.iter().any(|&region| u32::from(region) == whole.regions[t])),
            None => whole,
        })
    }

    /// The part of some tetrahedra, with the points that they have.
    fn part(&self, is_kept: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.tets.len()).filter(|&t| is_kept(t)).collect();
        let mut tet_numbers = vec![NONE; self.tets.len()];
        (0..).zip(&kept).for_each(|(number, &t)| tet_numbers[t] = number);
        let mut is_used = vec![false; self.positions.len()];
        kept.iter().flat_map(|&t| self.tets[t]).for_each(|v| is_used[v as usize] = true);
        let points: Vec<usize> = (0..self.positions.len()).filter(|&v| is_used[v]).collect();
        let mut point_numbers = vec![NONE; self.positions.len()];
        (0..).zip(&points).for_each(|(number, &v)| point_numbers[v] = number);
        let neighbor = |n: u32| tet_numbers.get(n as usize).copied().unwrap_or(NONE);
        let group = |Group { fields, values }: &Group| {
            let components = values.chunks_exact(self.positions.len().max(1));
            let values = components.flat_map(|values| points.iter().map(|&v| values[v])).collect();
            Group { fields: fields.clone(), values: Arc::new(values) }
        };
        Self {
            positions: Arc::new(points.iter().map(|&v| self.positions[v]).collect()),
            tets: Arc::new(kept.iter().map(|&t| self.tets[t].map(|v| point_numbers[v as usize])).collect()),
            neighbors: Arc::new(kept.iter().map(|&t| self.neighbors[t].map(neighbor)).collect()),
            regions: kept.iter().map(|&t| self.regions[t]).collect(),
            groups: self.groups.iter().map(group).collect(),
            labels: self.labels.clone(),
        }
    }

    /// The values of a field by its number; of the first one if it is not there.
    fn values(&self, field: usize) -> &[f64] {
        let of = |group: &'_ Group| {
            let place = group.fields.iter().position(|&other| other == field)?;
            Some((place, Arc::as_ptr(&group.values)))
        };
        let found = self.groups.iter().find(|group| of(group).is_some()).or(self.groups.first());
        let Some(Group { fields, values }) = found else { return &[] };
        let place = fields.iter().position(|&other| other == field).unwrap_or(0);
        let points = self.positions.len();
        &values[place * points..(place + 1) * points]
    }

    fn view(&self, field: usize) -> MeshView<'_> {
        MeshView {
            positions: &self.positions,
            field: self.values(field),
            is_label: self.labels.get(field).copied().unwrap_or(false),
            tets: &self.tets,
            neighbors: &self.neighbors,
        }
    }

    /// An array for each group, of the values that `of` makes of those of a field.
    fn arrays(&self, of: impl Fn(FieldView<'_>) -> Vec<f64>) -> Vec<Array> {
        let array = |Group { fields, values }: &Group| {
            let components = fields.iter().zip(values.chunks_exact(self.positions.len().max(1)));
            let views = components.map(|(&field, values)| FieldView { values, is_label: self.labels[field] });
            Array::components(views.flat_map(&of).collect(), fields.len())
        };
        self.groups.iter().map(array).collect()
    }

    /// The values at places; NaN where there is none.
    fn at<'a>(&self, places: impl Iterator<Item = &'a Option<Place>> + Clone) -> Vec<Array> {
        let view = self.view(0);
        let value = |place: &Option<Place>, field: FieldView<'_>| {
            place.as_ref().map_or(f64::NAN, |place| place.interpolate(&view, field))
        };
        self.arrays(|field| places.clone().map(|place| value(place, field)).collect())
    }
}

/// Points that Python gives as bytes of doubles in the order of this machine.
fn points_of(bytes: &[u8]) -> Vec<[f64; 3]> {
    let (numbers, _) = bytes.as_chunks::<8>();
    let numbers: Vec<f64> = numbers.iter().map(|&number| f64::from_ne_bytes(number)).collect();
    numbers.as_chunks::<3>().0.to_vec()
}

#[pymethods]
impl Mesh {
    /// Points, tetrahedra, their neighbours and regions, and the arrays of values: nothing is copied.
    fn share(&self) -> (Array, Array, Array, Array, Vec<Array>) {
        let groups = self.groups.iter();
        (
            Array::shared_rows(&self.positions),
            Array::shared_rows(&self.tets),
            Array::shared_rows(&self.neighbors),
            Array::list(self.regions.clone()),
            groups.map(|group| Array::shared_components(&group.values, group.fields.len())).collect(),
        )
    }

    /// The isosurfaces of a field at some values, and their normals.
    fn isosurface(
        &self,
        py: Python<'_>,
        field: usize,
        values: Vec<f64>,
        is_smooth: bool,
    ) -> PyResult<(Triangles, Array)> {
        if self.labels.get(field).is_some_and(|is_label| *is_label) {
            let problem = "option `field`: it is a label, and between two labels there is no value; take the boundary or a slice";
            return Err(Failure::new("bad-option", problem).into());
        }
        Ok(py.detach(|| {
            let view = self.view(field);
            let mut surface = IsoSurface::new();
            surface.set_normal_kind(if is_smooth { NormalKind::Smooth } else { NormalKind::Gradient });
            surface.set_regions(!self.regions.is_empty());
            surface.extract_all(&view, &values);
            let own = self.values(field).as_ptr();
            // Of its own field they are the isovalues, without rounding.
            let arrays = self.arrays(|field| {
                if field.values.as_ptr() == own {
                    surface.values.clone()
                } else {
                    surface.interpolate(&view, field)
                }
            });
            let normals = Array::rows(surface.normals);
            ((Array::rows(surface.positions), Array::rows(surface.indices), arrays), normals)
        }))
    }

    /// The section with the plane `normal · p = offset`, and the edges of cells in it.
    fn slice(&self, py: Python<'_>, normal: [f64; 3], offset: f64) -> (Triangles, Array) {
        py.detach(|| {
            let view = self.view(0);
            let mut slice = Slice::new();
            slice.extract(&view, &Plane { normal, offset });
            let mut edges = Vec::new();
            slice.cell_edges(&mut edges);
            let arrays = self.arrays(|field| slice.interpolate(&view, field));
            let (points, triangles) = (slice.positions().to_vec(), slice.indices().to_vec());
            ((Array::rows(points), Array::rows(triangles), arrays), Array::rows(edges))
        })
    }

    /// The boundary.
    fn boundary(&self, py: Python<'_>) -> Triangles {
        py.detach(|| {
            let mut surface = BoundarySurface::new();
            surface.extract(&self.view(0));
            let arrays = self.arrays(|field| surface.interpolate(field.values));
            (Array::rows(surface.positions), Array::rows(surface.indices), arrays)
        })
    }

    /// The values at points.
    fn probe(&self, py: Python<'_>, points: &[u8]) -> Vec<Array> {
        py.detach(|| {
            let places = Probe::new(self.view(0)).locate_all(&points_of(points));
            self.at(places.iter())
        })
    }

    /// The streamlines from seeds through the vectors of three fields: points, times, where each line ends in these, the seed of each,
    /// why each ends, and the arrays of values.
    #[expect(clippy::type_complexity, reason = "Python has names for them")]
    fn streamlines(
        &self,
        py: Python<'_>,
        vector: [usize; 3],
        seeds: &[u8],
        way: Way,
    ) -> PyResult<(Array, Array, Array, Array, Vec<&'static str>, Vec<Array>)> {
        py.detach(|| {
            let Way { forward, backward, max_length, max_steps, step } = way;
            let options = TraceOptions { max_length, max_steps, step, ..TraceOptions::default() };
            let mut tracer = Tracer::new(self.view(0), vector.map(|field| self.values(field)));
            let (mut points, mut line_ends, mut of_seeds, mut ends) = (vec![], vec![], vec![], vec![]);
            let (seeds, mut watch) = (points_of(seeds), Watch::new(None));
            for (number, seed) in (0_u32..).zip(&seeds) {
                if !watch.goes_on("trace", number.into(), seeds.len() as u64) {
                    break;
                }
                for (backward, _) in [(false, forward), (true, backward)].into_iter().filter(|(_, is)| *is) {
                    let Some(line) = tracer.trace(*seed, &TraceOptions { backward, ..options }) else {
                        continue;
                    };
                    points.extend(line.points);
                    line_ends.push(points.len() as u32);
                    of_seeds.push(number);
                    ends.push(line.end.name());
                }
            }
            watch.check()?;
            let of = |of: &dyn Fn(&StreamPoint) -> f64| Array::list(points.iter().map(of).collect());
            let places: Vec<Option<Place>> = points.iter().map(|point| Some(point.place)).collect();
            let positions = Array::rows(points.iter().map(|point| point.position).collect());
            let times = of(&|point| point.time);
            let arrays = self.at(places.iter());
            Ok((positions, times, Array::list(line_ends), Array::list(of_seeds), ends, arrays))
        })
    }

    /// Sums of a field: its volume, integral, mean, deviation, minimum and maximum, and the volumes below and above the histogram; the
    /// volumes of its bins, their edges, and the values below which the fractions of the volume lie.
    fn stats(
        &self,
        py: Python<'_>,
        field: usize,
        range: [f64; 2],
        bins: usize,
        fractions: Vec<f64>,
    ) -> ([f64; 8], [Array; 3]) {
        py.detach(|| {
            let view = self.view(field);
            let stats = FieldStats::of(&view);
            let mut histogram = Histogram::new(range[0], range[1], bins);
            histogram.add_mesh(&view);
            let ([min, max], [below, above]) = (stats.range(), histogram.outside());
            let sums =
                [stats.volume(), stats.integral(), stats.mean(), stats.deviation(), min, max, below, above];
            let edges = (0..=bins).map(|bin| histogram.edge(bin)).collect();
            let percentiles = fractions.iter().map(|&part| histogram.percentile(part)).collect();
            (sums, [histogram.volumes(), edges, percentiles].map(Array::list))
        })
    }
}
