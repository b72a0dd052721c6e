//! Verification of single requests, for MTs of which not all is in memory: each is checked against the input near it alone.

use super::deviation::{Deviation, check_counts};
use super::history::Numbers;
use super::mesh_checks::PlainMesh;
use super::queries::Query;
use super::regions::KeptRegions;
use super::split::{Split, split};
use super::{Case, VerifyReport, fresh, note, satisfy};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;
use tetralod::geom::{Bounds, LatticeBox, tet_meets_box};
use tetralod::mesh::{FACES, Field, Grid, NONE, TetMesh, boundary_faces, kuhn_tets, neighbors};
use tetralod::mt::{ApplyUpdates, MtInfo, mix};
use tetralod::refine::{Need, Part, Region, Request};

/// A box has about so many tetrahedra of the reference mesh.
const BOX_TETS: f64 = 20_000.0;
/// The errors of boxes, one after the other.
const ERRORS: [f64; 4] = [0.0, 0.01, 0.001, 0.0];
/// One in so many requests is for values in a box.
const VALUES_EVERY: usize = 4;
/// Errors are measured at about so many reference vertices for each request.
const VERTICES: usize = 20_000;

/// The values of a [grid alone](TetMesh::of_grid_alone) that are not in memory.
#[derive(Clone, Copy)]
pub struct GridValues<'a> {
    /// Layers of points across z that are best read together.
    pub layers: u32,
    /// Reads the values of a field, by its number, at the points in a box, x fastest.
    pub read: &'a dyn Fn(usize, [Range<u32>; 3]) -> Result<Vec<f64>, String>,
}

impl GridValues<'_> {
    /// The values of a field at these points of a grid. Of those that follow one another in some layers, the box around them is read.
    fn at(&self, grid: &Grid, field: usize, points: &[usize]) -> Result<Vec<f64>, String> {
        let [nx, ny, _] = grid.dims.map(|n| n as usize);
        let place = |&v: &usize| [v % nx, v / nx % ny, v / (nx * ny)];
        let slab = |v: usize| v / (nx * ny) / self.layers.max(1) as usize;
        let mut values = Vec::with_capacity(points.len());
        for some in points.chunk_by(|&a, &b| slab(a) == slab(b)) {
            let (low, high) = some.iter().map(place).fold(([usize::MAX; 3], [0; 3]), |(low, high), at| {
                ([0, 1, 2].map(|k| at[k].min(low[k])), [0, 1, 2].map(|k| at[k].max(high[k])))
            });
            let read = (self.read)(field, [0, 1, 2].map(|k| low[k] as u32..high[k] as u32 + 1))?;
            let [across, rows] = [0, 1].map(|k| high[k] - low[k] + 1);
            for [x, y, z] in some.iter().map(place) {
                let value = read.get(x - low[0] + across * (y - low[1] + rows * (z - low[2])));
                values.push(*value.ok_or("the input lacks values")?);
            }
        }
        Ok(values)
    }
}

/// So many requests for an MT of `input`, a mesh or a [grid alone](TetMesh::of_grid_alone): the whole domain within the error `coarse`,
/// which should be one of a mesh that fits into memory, then boxes all over it, exactly or with an error, and values in boxes. They
/// follow from the input and `count` alone.
pub fn samples(info: &MtInfo, input: &TetMesh, count: usize, coarse: f64) -> Vec<Query> {
    let whole = bounds(input);
    let mut numbers = Numbers(0x5DEE_CE66_D1CE_4E5B);
    let part = (BOX_TETS / info.tetrahedra.max(1) as f64).min(1.0).cbrt();
    let mut all = vec![Query::new(&format!("everywhere, error {coarse}"), Request::within(coarse))];
    while all.len() < count {
        let i = all.len();
        let mut inside = whole;
        for k in 0..3 {
            let length = part * (whole.max[k] - whole.min[k]);
            // A box now and then sticks out, so that there is boundary in it.
            let low = whole.min[k] - 0.5 * length + numbers.part() * (whole.max[k] - whole.min[k]);
            (inside.min[k], inside.max[k]) = (low, low + length);
        }
        let error = ERRORS[i % ERRORS.len()];
        let need = Need::within(error).inside(inside);
        let (what, need) = if i % VALUES_EVERY == 0 {
            let field = i / VALUES_EVERY % info.fields.len().max(1);
            let value = info.fields[field].min + numbers.part() * info.fields[field].range();
            (format!("{} = {value} in a box", info.fields[field].name), need.around(field, &[value]))
        } else {
            ("box".to_owned(), need)
        };
        all.push(Query::new(&format!("{what} {:?} to {:?}, error {error}", inside.min, inside.max), need));
    }
    all.truncate(count);
    all
}

/// Checks the mesh of one request against `input`, what the MT was built from, or a [grid alone](TetMesh::of_grid_alone): that it is
/// valid and conforming and has the topology of the base mesh, that all errors are within their bounds, where they are measured, that the
/// answer is true, and that coarsening leads back to the base mesh. In a box with error 0 the tetrahedra must be those of the input.
/// `mt` needs to have only what the request needs. The fields of a grid alone may have their values `elsewhere`.
pub fn run_request<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    elsewhere: Option<&GridValues<'_>>,
    query: &Query,
) -> VerifyReport {
    VerifyReport::of(|report| check(mt, input, elsewhere, query, report))
}

fn check<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    elsewhere: Option<&GridValues<'_>>,
    query: &Query,
    report: &mut VerifyReport,
) -> Result<(), String> {
    let info = mt.info();
    check_counts(info, input)?;
    let split = split(input, mt.regions())?;
    let around = match &query.request.needs[..] {
        [need] => region(need).map(|inside| (inside, need)),
        _ => None,
    };
    let most = if around.is_some() { VERTICES } else { usize::MAX };
    let near = match around {
        Some((inside, need)) => {
            let away = need.error.min(1.0) * info.displacement_per_error;
            let wide = Bounds { min: inside.min.map(|x| x - away), max: inside.max.map(|x| x + away) };
            Near::of(&split, elsewhere, &wide)?
        }
        None => Near::sparse(&split, elsewhere)?,
    };
    drop(split);
    let mut deviation = Deviation::of(info, near.split(), near.faces.clone(), most)?;
    let base = fresh(mt)?;
    let plain = PlainMesh::of(base.mesh());
    let shape = plain.shape().map_err(|failure| format!("the base mesh: {failure}"))?;
    let mut front = base.clone();
    let outcome = satisfy(mt, &mut front, query)?;
    if outcome.missing {
        note(report, query, "blocks that it needs are not here");
    }
    let kept = mt.regions().map(|regions| KeptRegions::of(regions, &plain)).transpose()?;
    let case = Case { mt, query, front: &front, outcome: &outcome, kept: kept.as_ref() };
    case.check(&base, &shape, &mut deviation, report);
    report.queries += 1;
    let exact = |(_, need): &(Bounds, &Need)| need.error == 0.0 && matches!(need.part, Part::Region(_));
    if let Some((inside, _)) = around.filter(exact)
        && let Err(failure) = check_tets(info, &near.mesh, &inside, &PlainMesh::of(front.mesh()))
    {
        note(report, query, &failure);
    }
    satisfy(mt, &mut front, &Query::new("full coarsening", Request::within(f64::INFINITY)))?;
    if front.mesh().hash() != base.mesh().hash() {
        note(report, query, "what is left after coarsening is not the base mesh");
    }
    Ok(())
}

/// The box that a need is limited to.
fn region(need: &Need) -> Option<Bounds> {
    match &need.part {
        Part::Region(Region::Box(inside)) | Part::Both(Region::Box(inside), _) => Some(*inside),
        _ => None,
    }
}

/// The box around an input.
fn bounds(input: &TetMesh) -> Bounds {
    match input.grid.filter(|_| input.is_grid_alone()) {
        Some(grid) => Bounds::of(&[grid.point([0; 3]), grid.point(grid.dims.map(|n| n - 1))]),
        None => Bounds::of(&input.positions),
    }
}

/// What an input has near a place.
struct Near {
    mesh: TetMesh,
    /// The faces of the mesh that are of the domain's boundary.
    faces: Vec<[u32; 3]>,
    /// As in [`Split`].
    regions: Vec<(u16, bool)>,
    may_move: bool,
}

impl Near {
    /// All tetrahedra whose bounding boxes meet a box.
    fn of(input: &Split<'_>, elsewhere: Option<&GridValues<'_>>, inside: &Bounds) -> Result<Self, String> {
        match input.mesh.grid.filter(|_| input.mesh.is_grid_alone()) {
            Some(grid) => Self::of_grid(&input.mesh, &grid, elsewhere, inside),
            None => Self::of_mesh(input, inside),
        }
    }

    /// These points of an input, with tetrahedra and faces by their numbers here.
    fn points(
        input: &Split<'_>,
        taken: &[usize],
        tets: Vec<[u32; 4]>,
        faces: Vec<[u32; 3]>,
    ) -> Result<Self, String> {
        let positions = taken.iter().map(|&v| input.mesh.positions[v]).collect();
        let mesh =
            TetMesh { positions, tets, fields: values(&input.mesh, None, taken)?, ..TetMesh::default() };
        let regions = taken.iter().filter_map(|&v| input.regions.get(v).copied()).collect();
        Ok(Self { mesh, faces, regions, may_move: input.may_move })
    }

    /// What errors are measured against: no one asks for the topology of it.
    fn split(&self) -> Split<'_> {
        let (mesh, joined) = (Cow::Borrowed(&self.mesh), Cow::Borrowed(&self.mesh.tets[..]));
        Split { mesh, joined, regions: self.regions.clone(), may_move: self.may_move }
    }

    fn of_grid(
        input: &TetMesh,
        grid: &Grid,
        elsewhere: Option<&GridValues<'_>>,
        inside: &Bounds,
    ) -> Result<Self, String> {
        // From this point to that one, with one to spare.
        let [mut low, mut high] = [[0_u32; 3]; 2];
        for k in 0..3 {
            let last = grid.dims[k] - 1;
            let at = |x: f64| ((x - grid.origin[k]) / grid.spacing[k]).clamp(0.0, f64::from(last)) as u32;
            low[k] = at(inside.min[k]).saturating_sub(1).min(last - 1);
            high[k] = (at(inside.max[k]) + 2).min(last).max(low[k] + 1);
        }
        let dims = [0, 1, 2].map(|k: usize| high[k] - low[k] + 1);
        let indices: Vec<[u32; 3]> = (low[2]..=high[2])
            .flat_map(|z| (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| [x, y, z])))
            .collect();
        let of_whole = |[x, y, z]: [u32; 3]| {
            (u64::from(x) + u64::from(grid.dims[0]) * (u64::from(y) + u64::from(grid.dims[1]) * u64::from(z)))
                as usize
        };
        let taken: Vec<usize> = indices.iter().map(|&index| of_whole(index)).collect();
        let tets = kuhn_tets(dims);
        let positions = indices.iter().map(|&index| grid.point(index)).collect();
        let fields = values(input, elsewhere, &taken)?;
        let mesh = TetMesh { positions, tets, fields, ..TetMesh::default() };
        let across = neighbors(&mesh.tets).map_err(|error| format!("the input: {error}"))?;
        let is_side = |face: &[u32; 3]| {
            (0..3).any(|k| {
                let at = face.map(|v| indices[v as usize][k]);
                at.iter().all(|&i| i == 0) || at.iter().all(|&i| i == grid.dims[k] - 1)
            })
        };
        let faces = boundary_faces(&mesh.tets, &across).map(|(_, face)| face).filter(is_side).collect();
        Ok(Self { mesh, faces, regions: Vec::new(), may_move: false })
    }

    fn of_mesh(input: &Split<'_>, inside: &Bounds) -> Result<Self, String> {
        let Split { mesh, joined: all, .. } = input;
        let meets = |tet: &[u32; 4]| {
            (0..3).all(|k| {
                let x = tet.map(|v| mesh.positions[v as usize][k]);
                let [low, high] = [
                    x.iter().copied().fold(f64::INFINITY, f64::min),
                    x.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                ];
                low <= inside.max[k] && high >= inside.min[k]
            })
        };
        let mut local = vec![NONE; mesh.positions.len()];
        let mut taken = Vec::new();
        let mut number = |v: u32| {
            let number = &mut local[v as usize];
            if *number == NONE {
                *number = taken.len() as u32;
                taken.push(v as usize);
            }
            *number
        };
        let (mut tets, mut joined) = (Vec::new(), Vec::new());
        for (tet, with_shared) in mesh.tets.iter().zip(&**all).filter(|(tet, _)| meets(tet)) {
            tets.push(tet.map(&mut number));
            joined.push(with_shared.map(&mut number));
        }
        let across = neighbors(&joined).map_err(|error| format!("the input: {error}"))?;
        let sorted = |mut face: [u32; 3]| {
            face.sort_unstable();
            face
        };
        let mut faces: BTreeSet<[u32; 3]> =
            boundary_faces(&joined, &across).map(|(_, face)| sorted(face)).collect();
        // Some of these have a tetrahedron behind them that was not taken.
        for tet in all.iter().filter(|tet| !meets(tet)) {
            let corners = tet.map(|v| local[v as usize]);
            for face in FACES.map(|face| face.map(|k| corners[k])) {
                if !face.contains(&NONE) {
                    faces.remove(&sorted(face));
                }
            }
        }
        Self::points(input, &taken, tets, faces.into_iter().collect())
    }

    /// Some points from all over the domain, and its boundary, without tetrahedra.
    fn sparse(split: &Split<'_>, elsewhere: Option<&GridValues<'_>>) -> Result<Self, String> {
        let Split { mesh: input, joined, .. } = split;
        let [points, _] = input.counts();
        let stride = (points as usize).div_ceil(VERTICES).max(1);
        let mut taken: Vec<usize> = (0..points as usize).step_by(stride).collect();
        let Some(grid) = input.grid.filter(|_| input.is_grid_alone()) else {
            let across = neighbors(joined).map_err(|error| format!("the input: {error}"))?;
            let mut faces: Vec<[u32; 3]> = boundary_faces(joined, &across).map(|(_, face)| face).collect();
            taken.extend(faces.iter().flatten().map(|&v| v as usize));
            taken.sort_unstable();
            taken.dedup();
            let number = |v: u32| taken.partition_point(|&other| other < v as usize) as u32;
            faces.iter_mut().for_each(|face| *face = face.map(number));
            return Self::points(split, &taken, Vec::new(), faces);
        };
        // The boundary of a grid is that of its box.
        let [nx, ny, nz] = grid.dims.map(|n| n as usize);
        let of_corner = |c: usize| [(c & 1) * (nx - 1), (c >> 1 & 1) * (ny - 1), (c >> 2) * (nz - 1)];
        let first = taken.len() as u32;
        let index = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
        let mut indices: Vec<[usize; 3]> = taken.iter().map(|&i| index(i)).collect();
        indices.extend((0..8).map(of_corner));
        taken.extend((0..8).map(of_corner).map(|[x, y, z]| x + nx * (y + ny * z)));
        let cube = kuhn_tets([2; 3]);
        let across = neighbors(&cube).map_err(|error| format!("the input: {error}"))?;
        let faces = boundary_faces(&cube, &across).map(|(_, face)| face.map(|v| first + v)).collect();
        let positions = indices.iter().map(|index| grid.point(index.map(|i| i as u32))).collect();
        let mesh = TetMesh { positions, fields: values(input, elsewhere, &taken)?, ..TetMesh::default() };
        Ok(Self { mesh, faces, regions: Vec::new(), may_move: false })
    }
}

/// The fields at these points.
fn values(
    input: &TetMesh,
    elsewhere: Option<&GridValues<'_>>,
    points: &[usize],
) -> Result<Vec<Field>, String> {
    let of = |(number, field): (usize, &Field)| {
        let values = match (elsewhere, &input.grid) {
            (Some(elsewhere), Some(grid)) => elsewhere.at(grid, number, points)?,
            _ => {
                let values: Option<Vec<f64>> = points.iter().map(|&v| field.values.get(v).copied()).collect();
                values.ok_or_else(|| format!("the input: field '{}' lacks values", field.name))?
            }
        };
        Ok(Field { values, ..field.without_values() })
    };
    input.fields.iter().enumerate().map(of).collect()
}

/// Whether the tetrahedra in a box are those of the input near it. Those that only touch its rim may be either.
fn check_tets(info: &MtInfo, input: &TetMesh, inside: &Bounds, mesh: &PlainMesh<'_>) -> Result<(), String> {
    let lattice = &info.lattice;
    let on_lattice = |p: [f64; 3]| [0, 1, 2].map(|k| (p[k] - lattice.origin[k]) / lattice.step[k]);
    let [low, high] = [inside.min, inside.max].map(on_lattice);
    let region = LatticeBox {
        min: low.map(|x| (x.floor() as i32).saturating_add(1)),
        max: high.map(|x| (x.ceil() as i32).saturating_sub(1)),
    };
    let fields: Vec<&Field> =
        info.fields.iter().filter_map(|field| input.fields.iter().find(|known| field.is_of(known))).collect();
    let hash = |p: [i32; 3], levels: &mut dyn Iterator<Item = i32>| {
        p.into_iter().chain(levels).fold(0, |h, word| mix(h ^ u64::from(word as u32)))
    };
    let positions: Vec<[i32; 3]> = input.positions.iter().map(|&p| lattice.nearest(p)).collect();
    let wanted = keys(&positions, &input.tets, &region, |v| {
        let levels =
            fields.iter().zip(&info.fields).map(|(known, field)| field.nearest(known.values[v as usize]));
        hash(positions[v as usize], &mut levels.into_iter())
    });
    let found = keys(mesh.positions, mesh.tets, &region, |v| {
        hash(mesh.positions[v as usize], &mut mesh.mesh.levels(v).iter().copied())
    });
    if found == wanted {
        return Ok(());
    }
    let common = found.iter().filter(|key| wanted.binary_search(key).is_ok()).count();
    Err(format!(
        "of {} tetrahedra in the box {common} are of the input, which has {} there",
        found.len(),
        wanted.len()
    ))
}

/// The tetrahedra that meet a box, by what is known of their corners; sorted.
fn keys(
    positions: &[[i32; 3]],
    tets: &[[u32; 4]],
    region: &LatticeBox,
    corner: impl Fn(u32) -> u64,
) -> Vec<[u64; 4]> {
    let meets = |tet: &&[u32; 4]| tet_meets_box(&tet.map(|v| positions[v as usize]), region);
    let key = |tet: &[u32; 4]| {
        let mut key = tet.map(&corner);
        key.sort_unstable();
        key
    };
    let mut all: Vec<[u64; 4]> = tets.iter().filter(meets).map(key).collect();
    all.sort_unstable();
    all
}
