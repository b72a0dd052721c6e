//! Fields at cells: as fields at points, and as labels.

use crate::geom::bits_of;
use crate::mesh::adjacency::components;
use crate::mesh::{
    Averaged, Difference, Extreme, Extremes, Field, MeshInput, NONE, Side, TetMesh, neighbors,
};
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// The label that is the number of the part that a cell is in.
pub const COMPONENTS: &str = "components";

/// What becomes of fields at cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellsToPoints {
    /// Only their names are kept.
    No,
    /// They are averaged over all cells around a point.
    AcrossRegions,
    /// They are averaged over the cells around a point that are in one region, for each of its regions.
    ByRegion,
}

impl TetMesh {
    /// Turns fields at cells into fields at points, or leaves their values out. Those that are labels stay as well; the label
    /// [`COMPONENTS`] is made where there is none of this name, and the mesh is sound.
    #[doc(hidden)]
    pub fn settle_cells(&mut self, to_points: CellsToPoints, labels: &[String]) {
        let is_label = |field: &&Field| labels.contains(&field.name);
        let mut kept: Vec<Field> = self.cell_fields.iter().filter(is_label).cloned().collect();
        let is_it = |field: &Field| field.name == COMPONENTS;
        let MeshInput { other_fields, other_cell_fields, .. } = &self.input;
        let mut known =
            self.cell_fields.iter().chain(&self.fields).chain(other_fields).chain(other_cell_fields);
        if labels.iter().any(|name| name == COMPONENTS) && !known.any(is_it) {
            kept.extend(self.components());
        }
        match to_points {
            CellsToPoints::No => self.cell_fields.iter_mut().for_each(|field| field.values = Vec::new()),
            CellsToPoints::AcrossRegions => self.cells_to_points(),
            CellsToPoints::ByRegion => self.average_cells(&kept, labels),
        }
        self.cell_fields.extend(kept);
    }

    /// The parts that hang together by faces, counted from 1 in the order of their first cells.
    fn components(&self) -> Option<Field> {
        let mut groups = components(&neighbors(&self.tets).ok()?);
        let mut numbers = HashMap::new();
        let number = |t: usize| {
            let next = numbers.len() + 1;
            *numbers.entry(groups.root(t)).or_insert(next) as f64
        };
        Some(Field::new(COMPONENTS, (0..self.tets.len()).map(number).collect()))
    }

    /// Turns the fields at cells that have values into fields at points: the mean of the cells around a point, weighted
    /// by volume; of [labels](Field::is_label) the one that has most of this volume, the least of several. A name that a field at points has already gets `_cells` behind it. What that has done to the values is in
    /// [`Field::averaged`].
    ///
    /// Points without cells get 0; [`repair`](crate::mesh::repair) drops them, and turns cells whose volume would
    /// otherwise count as negative.
    pub fn cells_to_points(&mut self) {
        self.average_cells(&[], &[]);
    }

    /// As [`TetMesh::cells_to_points`], but for each region apart: a point at which several regions meet gets a value for each of them, the
    /// mean of the cells around it in that region. Regions are told apart by the arrays `labels`, at cells, which may be among `own`, or at
    /// points, of which the least of a tetrahedron counts. In a point's first region, by the labels in ascending order, its value is in
    /// [`Field::values`], in each further one, in [`Field::sides`]. What changes points or tetrahedra afterwards knows nothing of sides.
    fn average_cells(&mut self, own: &[Field], labels: &[String]) {
        let (read, named) = std::mem::take(&mut self.cell_fields)
            .into_iter()
            .partition::<Vec<Field>, _>(|field| field.values.len() == self.tets.len());
        self.cell_fields = named;
        if read.is_empty() {
            return;
        }
        let volumes = self.relative_volumes();
        let parting = self.parting(own, labels);
        // Time steps share a name.
        let key = |field: &Field| (field.name.clone(), field.time.map(bits_of));
        let mut taken: HashSet<_> = self.fields.iter().map(key).collect();
        for mut field in read {
            let mut values = match field.is_label {
                true => self.label_of_cells(&field.values, &volumes, &parting),
                false => self.mean_of_cells(&field.values, &volumes, &parting),
            };
            field.averaged = self.averaged(&field, &values, &volumes, &parting);
            field.sides = values.split_off(self.positions.len());
            field.values = values;
            field.integer = field.is_label;
            while !taken.insert(key(&field)) {
                field.name.push_str("_cells");
                field.vector = None;
            }
            self.fields.push(field);
        }
        self.sides = parting.sides;
    }

    /// Where regions meet, by these labels.
    fn parting(&self, own: &[Field], labels: &[String]) -> Parting {
        let mut regions = vec![0_u32; self.tets.len()];
        for name in labels {
            let is_it = |field: &&Field| field.name == *name;
            let at_cells = own.iter().find(|field| is_it(field) && field.values.len() == self.tets.len());
            let at_points = self.fields.iter().find(is_it);
            let label = |t: usize| match (at_cells, at_points) {
                (Some(field), _) => field.values[t],
                (None, Some(field)) => {
                    self.tets[t].map(|v| field.values[v as usize]).into_iter().fold(f64::INFINITY, f64::min)
                }
                // Whoever needs the regions says so.
                (None, None) => 0.0,
            };
            // Both zeros are one label.
            let keys: Vec<(u32, f64)> =
                regions.iter().enumerate().map(|(t, &region)| (region, label(t) + 0.0)).collect();
            let order = |a: &(u32, f64), b: &(u32, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
            let mut known = keys.clone();
            known.sort_unstable_by(order);
            known.dedup_by(|a, b| order(a, b).is_eq());
            let number =
                |key: &(u32, f64)| known.binary_search_by(|known| order(known, key)).unwrap_or(0) as u32;
            regions = keys.iter().map(number).collect();
        }
        Parting::new(self.positions.len(), &self.tets, regions)
    }

    /// The mean at each point of the cells around it, weighted by their volumes: however they are split into tetrahedra. Then those in
    /// further regions.
    fn mean_of_cells(&self, values: &[f64], volumes: &[f64], parting: &Parting) -> Vec<f64> {
        let mut means = vec![0.0; self.positions.len() + parting.sides.len()];
        let mut weights = vec![0.0; means.len()];
        for (cell, places) in self.cells_with_places(parting) {
            let (value, volume) = (values[cell.start], volumes[cell].iter().sum::<f64>());
            for v in places {
                weights[v] += volume;
                // A running mean stays between the values that it is of: no sum that could overflow.
                if weights[v] > 0.0 {
                    let share = volume / weights[v];
                    means[v] = means[v] * (1.0 - share) + value * share;
                }
            }
        }
        means
    }

    /// The label at each point that has most volume of the cells around it, the least of several; 0 at points without cells. Then those in
    /// further regions.
    fn label_of_cells(&self, values: &[f64], volumes: &[f64], parting: &Parting) -> Vec<f64> {
        // The volume of each label at each point, labels in ascending order.
        let mut around: Vec<Vec<(f64, f64)>> = vec![Vec::new(); self.positions.len() + parting.sides.len()];
        for (cell, places) in self.cells_with_places(parting) {
            // 0 and -0 are one label.
            let (value, volume) = (values[cell.start] + 0.0, volumes[cell].iter().sum::<f64>());
            for v in places {
                let known = &mut around[v];
                match known.binary_search_by(|(label, _)| label.total_cmp(&value)) {
                    Ok(at) => known[at].1 += volume,
                    Err(at) => known.insert(at, (value, volume)),
                }
            }
        }
        let most = |labels: Vec<(f64, f64)>| {
            let better = |best: (f64, f64), next: (f64, f64)| if next.1 > best.1 { next } else { best };
            labels.into_iter().reduce(better).map_or(0.0, |(label, _)| label)
        };
        around.into_iter().map(most).collect()
    }

    /// What averaging has done: the values of a field of cells have become `means` at points, and in further regions.
    fn averaged(&self, field: &Field, means: &[f64], volumes: &[f64], parting: &Parting) -> Option<Averaged> {
        let values = &field.values;
        let mut ends: Option<[Range<usize>; 2]> = None;
        let (mut largest, mut squares, mut whole) = (0.0_f64, 0.0, 0.0);
        for cell in self.cells() {
            let value = values[cell.start];
            let region = parting.regions[cell.start];
            let (mut volume, mut mean) = (0.0, 0.0);
            // Of labels, how much of the cell has another one: a quarter of a tetrahedron is nearest to each corner.
            let at = |v: u32| {
                let mean = means[parting.place(v, region)];
                if field.is_label { f64::from(mean != value) } else { mean }
            };
            for t in cell.clone() {
                volume += volumes[t];
                let share = volumes[t] / volume;
                let of_tet: f64 = self.tets[t].iter().map(|&v| 0.25 * at(v)).sum();
                mean = mean * (1.0 - share) + of_tet * share;
            }
            let difference = if field.is_label { mean } else { (mean - value).abs() };
            // In units of the largest one so far, no square overflows.
            if difference > largest {
                squares *= (largest / difference) * (largest / difference);
                largest = difference;
            }
            if largest > 0.0 {
                squares += volume * (difference / largest) * (difference / largest);
            }
            whole += volume;
            match &mut ends {
                None => ends = Some([cell.clone(), cell]),
                Some([least, _]) if value < values[least.start] => *least = cell,
                Some([_, most]) if value > values[most.start] => *most = cell,
                Some(_) => {}
            }
        }
        let [min, max] = ends?.map(|cell| self.extreme(values[cell.start], cell, volumes));
        let rms = largest * (squares / whole).sqrt();
        Some(Averaged { input: Extremes { min, max }, difference: Difference { rms, largest } })
    }

    /// The tetrahedra of each cell of the input, which follow one another.
    fn cells(&self) -> impl Iterator<Item = Range<usize>> {
        let cell_of = |t: usize| self.input.cells.number(t as u32);
        let mut end = 0;
        std::iter::from_fn(move || {
            let start = end;
            end += 1;
            while end < self.tets.len() && cell_of(end) == cell_of(start) {
                end += 1;
            }
            (start < self.tets.len()).then_some(start..end)
        })
    }

    /// The tetrahedra of each cell of the input, and the places of the values of its corners, each once.
    fn cells_with_places(
        &self,
        parting: &Parting,
    ) -> impl Iterator<Item = (Range<usize>, impl Iterator<Item = usize>)> {
        self.cells().map(move |cell| {
            let region = parting.regions[cell.start];
            let mut corners: Vec<u32> = self.tets[cell.clone()].as_flattened().to_vec();
            corners.sort_unstable();
            corners.dedup();
            (cell, corners.into_iter().map(move |v| parting.place(v, region)))
        })
    }

    /// A value of the cell with these tetrahedra.
    fn extreme(&self, value: f64, cell: Range<usize>, volumes: &[f64]) -> Extreme {
        let found = self.input.cells.cell_of(cell.start as u32);
        let (mut volume, mut place) = (0.0, [0.0; 3]);
        for t in cell {
            volume += volumes[t];
            let share = volumes[t] / volume;
            for (k, x) in place.iter_mut().enumerate() {
                let of_tet: f64 = self.tets[t].iter().map(|&v| 0.25 * self.positions[v as usize][k]).sum();
                *x = *x * (1.0 - share) + of_tet * share;
            }
        }
        Extreme { value, place, cell: Some(found.number), part: found.part }
    }

    /// Volumes in a unit in which none overflows, and none is 0 that is not almost flat.
    fn relative_volumes(&self) -> Vec<f64> {
        let bounds = crate::geom::Bounds::of(&self.positions);
        let scale = bounds.extent().into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let volume = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|v| self.positions[v as usize].map(|x| x / scale));
            let [u, v, w] = [b, c, d].map(|p| glam::DVec3::from_array(p) - glam::DVec3::from_array(a));
            u.cross(v).dot(w).abs().max(f64::MIN_POSITIVE)
        };
        self.tets.iter().map(volume).collect()
    }
}

/// Which regions meet at which points.
struct Parting {
    /// The region of each tetrahedron.
    regions: Vec<u32>,
    points: usize,
    sides: Vec<Side>,
    /// Where the sides of each point begin, and those of the last end; empty without any.
    starts: Vec<u32>,
}

impl Parting {
    fn new(points: usize, tets: &[[u32; 4]], regions: Vec<u32>) -> Self {
        if regions.iter().all(|region| *region == regions[0]) {
            return Self { regions, points, sides: Vec::new(), starts: Vec::new() };
        }
        // A tetrahedron for each point and region: first those at points that are in one region alone.
        let mut alone = vec![NONE; points];
        let mut several: Vec<[u32; 3]> = Vec::new();
        for (t, tet) in (0..).zip(tets) {
            for &v in tet {
                let first = &mut alone[v as usize];
                if *first == NONE {
                    *first = t;
                } else if regions[*first as usize] != regions[t as usize] {
                    several.push([v, regions[*first as usize], *first]);
                    several.push([v, regions[t as usize], t]);
                }
            }
        }
        several.sort_unstable();
        several.dedup_by_key(|[v, region, _]| [*v, *region]);
        let mut sides = Vec::new();
        let mut starts = vec![0; points + 1];
        for own in several.chunk_by(|a, b| a[0] == b[0]) {
            starts[own[0][0] as usize + 1] = own.len() as u32 - 1;
            sides.extend(own[1..].iter().map(|&[point, _, tet]| Side { point, tet }));
        }
        (0..points).for_each(|v| starts[v + 1] += starts[v]);
        Self { regions, points, sides, starts }
    }

    /// The place of the value of a point in a region.
    fn place(&self, point: u32, region: u32) -> usize {
        let v = point as usize;
        let Some(&[start, end]) = self.starts.get(v..v + 2).and_then(<[u32]>::first_chunk) else { return v };
        let mut own = start as usize..end as usize;
        let found = own.find(|&side| self.regions[self.sides[side].tet as usize] == region);
        found.map_or(v, |side| self.points + side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Grid;

    #[test]
    fn points_get_the_mean_weighted_by_volume() {
        // Two tetrahedra on one face, the second three times as high.
        let positions =
            vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -3.0]];
        let mut mesh = TetMesh {
            positions,
            tets: vec![[0, 1, 2, 3], [0, 2, 1, 4]],
            cell_fields: vec![Field::new("m", vec![8.0, 4.0])],
            ..TetMesh::default()
        };
        mesh.cells_to_points();
        assert_eq!(mesh.fields[0].values, [5.0, 5.0, 5.0, 8.0, 4.0]);
        assert!(mesh.cell_fields.is_empty());
        // The means over the tetrahedra are 5.75 and 4.75; the second one has three quarters of the volume.
        let found = mesh.fields[0].averaged.as_ref().expect("it was averaged");
        let extreme = |value, z, cell| {
            let place = [0.25, 0.25, z];
            Extreme { value, place, cell: Some(cell), part: None }
        };
        assert_eq!(found.input, Extremes { min: extreme(4.0, -0.75, 1), max: extreme(8.0, 0.25, 0) });
        assert_eq!(found.difference.largest, 2.25);
        assert!((found.difference.rms - 1.6875_f64.sqrt()).abs() < 1e-15);
    }

    /// The first coordinate of each point and the value of the first field there.
    fn by_x(mesh: &TetMesh) -> Vec<(f64, f64)> {
        mesh.positions.iter().map(|p| p[0]).zip(mesh.fields[0].values.iter().copied()).collect()
    }

    #[test]
    fn a_cell_that_is_split_is_one_cell() {
        let grid = Grid { dims: [3, 2, 2], origin: [1.0, 2.0, 3.0], spacing: [2.0, 1.0, 4.0] };
        let mut mesh = TetMesh::from_grid(grid, Vec::new());
        mesh.input.cells = crate::mesh::CellNumbers::equal(2, 6, "cube");
        let cubes = |values: [f64; 2]| values.into_iter().flat_map(|value| [value; 6]).collect();
        mesh.cell_fields = vec![Field::new("a", cubes([7.0, 3.0])), Field::new("same", cubes([1.5; 2]))];
        mesh.cells_to_points();
        let [a, same] = [0, 1].map(|f| mesh.fields[f].averaged.clone().expect("it was averaged"));
        for (found, value, cell, middle) in
            [(&a.input.min, 3.0, 1, [4.0, 2.5, 5.0]), (&a.input.max, 7.0, 0, [2.0, 2.5, 5.0])]
        {
            assert_eq!((found.value, found.cell), (value, Some(cell)));
            // The mean of six places is rounded.
            assert!((0..3).all(|k| (found.place[k] - middle[k]).abs() < 1e-14), "{found:?}");
        }
        // Each cube counts once, however many of its tetrahedra are at a point.
        let at_points = by_x(&mesh);
        for (x, expected) in [(1.0, 7.0), (3.0, 5.0), (5.0, 3.0)] {
            assert_eq!(at_points.iter().filter(|(at, _)| *at == x).count(), 4);
            assert!(
                at_points.iter().all(|(at, value)| *at != x || (value - expected).abs() < 1e-14),
                "{at_points:?}"
            );
        }
        // All tetrahedra of a cube have the same volume.
        let middle = |t: &[u32; 4]| 0.25 * t.iter().map(|&v| mesh.fields[0].values[v as usize]).sum::<f64>();
        let mean = |cube: usize| mesh.tets[6 * cube..][..6].iter().map(middle).sum::<f64>() / 6.0;
        let differences = [7.0 - mean(0), mean(1) - 3.0];
        let squares = differences.map(|x| x * x);
        assert!((a.difference.largest - differences[0].max(differences[1])).abs() < 1e-12, "{a:?}");
        assert!((a.difference.rms - (0.5 * (squares[0] + squares[1])).sqrt()).abs() < 1e-12, "{a:?}");
        let Difference { rms, largest } = same.difference;
        assert!(rms < 1e-14 && largest < 1e-14, "{same:?}");
        // Of equal values it is the first cell.
        assert_eq!([same.input.min.cell, same.input.max.cell], [Some(0); 2]);
    }

    #[test]
    fn a_constant_stays_and_names_stay_different() {
        let grid = Grid { dims: [4, 3, 3], origin: [1e200; 3], spacing: [1e190; 3] };
        let mut mesh = TetMesh::from_grid(grid, vec![Field::new("m", vec![0.0; 36])]);
        let huge = vec![f64::MAX; mesh.tets.len()];
        mesh.cell_fields = vec![Field::new("m", huge), Field::new("only named", Vec::new())];
        mesh.cells_to_points();
        assert_eq!(mesh.fields[1].name, "m_cells");
        assert!(mesh.fields[1].values.iter().all(|v| (v / f64::MAX - 1.0).abs() < 1e-12));
        assert_eq!(mesh.cell_fields.len(), 1);
    }

    #[test]
    fn points_get_the_label_that_has_most_volume_around_them() {
        // Three tetrahedra around one edge, of volumes 1, 1 and 3: the two that are alike have less.
        let positions = vec![
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, -3.0, 0.0],
        ];
        let label = |values: Vec<f64>| Field { integer: true, is_label: true, ..Field::new("id", values) };
        let mut mesh = TetMesh {
            positions,
            tets: vec![[0, 2, 3, 1], [0, 3, 4, 1], [0, 4, 5, 1]],
            cell_fields: vec![label(vec![2.0, 2.0, 7.0]), label(vec![9.0, 4.0, -0.0])],
            ..TetMesh::default()
        };
        mesh.cell_fields[1].name = "other".to_owned();
        mesh.cells_to_points();
        assert_eq!(mesh.fields[0].values, [7.0, 7.0, 2.0, 2.0, 7.0, 7.0]);
        // Of equal volumes it is the least one.
        assert_eq!(mesh.fields[1].values, [0.0, 0.0, 9.0, 4.0, 0.0, 0.0]);
        assert!(mesh.fields.iter().all(|field| field.is_label && field.integer));
        // Two, three and no corners of the cells have another label.
        let [shares, volume] = [[0.5, 0.75, 0.0], [1.0, 1.0, 3.0]];
        let squares: f64 = (0..3).map(|t| volume[t] * shares[t] * shares[t]).sum();
        let found = mesh.fields[0].averaged.as_ref().expect("it was averaged");
        assert_eq!(found.difference.largest, 0.75);
        assert!((found.difference.rms - (squares / 5.0).sqrt()).abs() < 1e-15);
        assert_eq!((found.input.min.value, found.input.max.value), (2.0, 7.0));
    }
}
