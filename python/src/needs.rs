//! Requests, as Python has checked and named their parts.

use crate::errors::Failure;
use pyo3::prelude::*;
use tetralod::geom::Bounds;
use tetralod::mt::{Mt, MultiTessellation, numbers_of};
use tetralod::refine::{Budget, Need, Region, Request, RequestError, Transfer, View};

/// A need: where the error counts, and how large it may be.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct NeedOptions {
    /// A fraction of the field's range; pixels of a view; of colour and opacity for a transfer function.
    error: f64,
    /// The field whose error counts; that of all if there is none.
    field: Option<usize>,
    /// The name of a shape, and its numbers one behind the other.
    region: Option<(String, Vec<f64>)>,
    /// The field that values and transfer functions are of.
    of: usize,
    /// Ranges of its values; none for all values.
    ranges: Vec<[f64; 2]>,
    /// A matrix, column by column, and the size of the picture.
    view: Option<([f64; 16], [f64; 2])>,
    /// Points, and the length along which the opacities apply.
    transfer: Option<(Vec<[f64; 5]>, f64)>,
    /// Names or labels of regions of the file.
    regions: Option<Vec<String>>,
}

/// Limits of tetrahedra, vertices and bytes.
pub type Limits = (Option<u32>, Option<u32>, Option<u64>);

/// The request of these needs, checked for an MT.
pub fn request(needs: Vec<NeedOptions>, limits: Limits, mt: &Mt) -> Result<Request, Failure> {
    let (tets, vertices, bytes) = limits;
    let needs = needs.into_iter().map(|options| need(options, mt)).collect::<Result<_, _>>()?;
    let request = Request { needs, budget: Budget { tets, vertices, bytes } };
    request.check(mt.info()).map_err(|error| match error {
        // Where there is one need, its number says nothing.
        RequestError::Need { problem, .. } if request.needs.len() == 1 => Failure::new("bad-option", problem),
        _ => Failure::new("bad-option", error.to_string()),
    })?;
    Ok(request)
}

fn need(options: NeedOptions, mt: &Mt) -> Result<Need, Failure> {
    let NeedOptions { error, field, region, of, ranges, view, transfer, regions } = options;
    let of_field = |need: Need| match field {
        Some(field) if mt.info().fields.len() > 1 => need.of_field(field),
        _ => need,
    };
    let mut need = match (view, transfer) {
        (Some((matrix, viewport)), _) => of_field(Need::seen(View { matrix, viewport }, error)),
        (_, Some((points, unit_length))) => {
            let points = points.into_iter().map(|[value, r, g, b, a]| (value, [r, g, b, a])).collect();
            Need::shown(Transfer { field: of, points, unit_length }, error)
        }
        _ => {
            let need = of_field(Need::within(error));
            let need = match region {
                Some((kind, numbers)) => need.inside(shape(&kind, &numbers)?),
                None => need,
            };
            if ranges.is_empty() { need } else { need.between(of, ranges) }
        }
    };
    need.regions = regions.map(|names| region_numbers(mt, &names)).transpose()?;
    Ok(need)
}

/// The numbers of regions that are named.
pub fn region_numbers(mt: &Mt, names: &[String]) -> Result<Vec<u16>, Failure> {
    let refused = |(_, problem)| Failure::new("bad-option", format!("option `regions`: {problem}"));
    numbers_of(mt.regions(), names).map_err(refused)
}

/// The shape with these numbers.
fn shape(kind: &str, numbers: &[f64]) -> Result<Region, Failure> {
    let region = match (kind, numbers) {
        ("box", &[x0, y0, z0, x1, y1, z1]) => {
            Some(Region::Box(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] }))
        }
        ("sphere", &[x, y, z, radius]) => Some(Region::Sphere { centre: [x, y, z], radius }),
        ("oriented_box", &[x, y, z, a, b, c, d, e, f, g, h, i]) => {
            let halves = [[a, b, c], [d, e, f], [g, h, i]];
            Some(Region::OrientedBox { centre: [x, y, z], halves })
        }
        ("half_space", &[x, y, z, offset]) => Some(Region::HalfSpace { normal: [x, y, z], offset }),
        ("slab", &[x, y, z, offset, thickness]) => {
            Some(Region::Slab { normal: [x, y, z], offset, thickness })
        }
        ("planes", numbers) => match numbers.as_chunks::<4>() {
            (planes, []) => Some(Region::Convex(planes.to_vec())),
            _ => None,
        },
        _ => None,
    };
    region.ok_or_else(|| Failure::new("internal", format!("a region {kind} of {} numbers", numbers.len())))
}
