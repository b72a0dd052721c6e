//! What mesh a command works on: the options that say so, and the mesh itself.
//!
//! The plain options make needs of one error; each `--need` makes others, with an error of its own. The mesh suits all.

use super::files;
use super::files::Opened;
use super::needs;
use super::needs::Camera;
use super::needs::Group;
use super::needs::Tolerance;
use super::needs::Wanted;
use super::output;
use anyhow::Context;
use anyhow::Result;
use serde::Serialize;
use std::cell::Cell;
use std::path::Path;
use std::path::PathBuf;
use std::time::Duration;
use std::time::Instant;
use tetralod::client::Step;
use tetralod::geom::Bounds;
use tetralod::mt::MtInfo;
use tetralod::refine::Budget;
use tetralod::refine::Need;
use tetralod::refine::Outcome;
use tetralod::refine::RefineStats;
use tetralod::refine::Region;
use tetralod::refine::Request;
use tetralod::refine::View;

/// What the options look like in use.
pub const EXAMPLES: &str = "\
Examples (everything in model units and units of the field, errors also in % of the field's range):
  --error 1%                                        within 1 % of the range everywhere
  --box 0,0,0,1,1,1 --error 0.1% --outside 5%       fine in a box, coarse around it
  --sphere 5,5,5,2 --iso 0.5 --error 1%             an isosurface inside a ball
  --need 'box=0,0,0,1,1,1; error=0' --need 'iso=0.5; iso=0.8; error=1%'
                                                    a box at full detail and, everywhere, two isosurfaces
  --view camera.json --pixels 2 --outside 10%       what a camera sees, and roughly the rest
  --transfer colours.json --max-bytes 50M           the best picture that 50 MiB can give
Regions and values limit each other; everything else is a union. Without any option the mesh is the reference mesh.

camera.json:  {\"matrix\": [16 numbers: clip from model space, column by column], \"viewport\": [1920, 1080], \"pixels\": 1}
colours.json: {\"points\": [[value, red, green, blue, opacity], ...], \"unit_length\": 0.1, \"field\": \"name\"}; colours and
              opacities 0 to 1, the opacity that of a way of unit_length times the model's diagonal";

/// How long is waited for a server at a time.
const PATIENCE: Duration = Duration::from_secs(1);

/// Headings of the help.
const WHAT: &str = "What mesh";
const LIMITS: &str = "How large, how long";

/// The mesh to work on: as coarse as these options allow.
#[derive(clap::Args)]
pub struct Query {
    /// Largest error, in units of the field, or with % of its range; 0 is the reference mesh [default: 0]
    #[arg(long, value_name = "E|E%", allow_hyphen_values = true, help_heading = WHAT)]
    error: Option<Tolerance>,
    /// Only inside this box, in model units; everywhere else as coarse as possible (regions are repeatable: their union).
    #[arg(long = "box", value_name = "x0,y0,z0,x1,y1,z1", value_parser = needs::parse_box, allow_hyphen_values = true, help_heading = WHAT)]
    boxes: Vec<Region>,
    /// Only inside this oriented box: its centre, and three vectors at right angles from there to the middles of faces.
    #[arg(long = "obox", value_name = "cx,cy,cz,ax,…,bx,…,cx,…", value_parser = needs::parse_oriented_box, allow_hyphen_values = true, help_heading = WHAT)]
    oriented_boxes: Vec<Region>,
    /// Only inside this ball: centre and radius.
    #[arg(long = "sphere", value_name = "x,y,z,r", value_parser = needs::parse_sphere, allow_hyphen_values = true, help_heading = WHAT)]
    spheres: Vec<Region>,
    /// Only where n · p <= d.
    #[arg(long = "half-space", value_name = "nx,ny,nz,d", value_parser = needs::parse_half_space, allow_hyphen_values = true, help_heading = WHAT)]
    half_spaces: Vec<Region>,
    /// Only within t / 2 of the plane n · p = d.
    #[arg(long = "slab", value_name = "nx,ny,nz,d,t", value_parser = needs::parse_slab, allow_hyphen_values = true, help_heading = WHAT)]
    slabs: Vec<Region>,
    /// Only where n · p <= d for all of these planes, at most 16.
    #[arg(long = "convex", value_name = "nx,ny,nz,d,nx,…", value_parser = needs::parse_convex, allow_hyphen_values = true, help_heading = WHAT)]
    convexes: Vec<Region>,
    /// Only where the field passes this value, in units of the field (repeatable).
    #[arg(long = "iso", value_name = "V", value_parser = parse_number, allow_hyphen_values = true, help_heading = WHAT)]
    isovalues: Vec<f64>,
    /// Only where the field has a value from a to b, in units of the field (repeatable).
    #[arg(long = "range", value_name = "a,b", value_parser = needs::parse_range, allow_hyphen_values = true, help_heading = WHAT)]
    ranges: Vec<[f64; 2]>,
    /// The field that all values are of; the first one if not given.
    #[arg(long, value_name = "NAME", help_heading = WHAT)]
    field: Option<String>,
    /// What a camera sees, within --pixels: a file with its matrix and viewport (repeatable).
    #[arg(long = "view", value_name = "FILE.json", help_heading = WHAT)]
    views: Vec<PathBuf>,
    /// The same without a file: 16 numbers, column by column, from model space to clip space.
    #[arg(long, value_name = "m0,…,m15", value_parser = needs::parse_matrix, allow_hyphen_values = true, requires = "viewport", help_heading = WHAT)]
    matrix: Option<[f64; 16]>,
    /// Width and height of the picture in pixels, for --matrix.
    #[arg(long, value_name = "w,h", value_parser = needs::parse_viewport, requires = "matrix", help_heading = WHAT)]
    viewport: Option<[f64; 2]>,
    /// Largest error on the screen in pixels, for --view and --matrix [default: what the file says, or 1]
    #[arg(long, value_name = "P", value_parser = needs::parse_size, allow_hyphen_values = true, help_heading = WHAT)]
    pixels: Option<f64>,
    /// What a transfer function makes visible, within --colour-error: a file with its points (repeatable).
    #[arg(long = "transfer", value_name = "FILE.json", help_heading = WHAT)]
    transfers: Vec<PathBuf>,
    /// Largest change of colour or opacity, 0 to 1 or with %, for --transfer [default: what the file says, or 1%]
    #[arg(long, value_name = "C|C%", value_parser = needs::parse_share, help_heading = WHAT)]
    colour_error: Option<f64>,
    /// Besides, everywhere within this error, in units of the field, or with % of its range.
    #[arg(long, value_name = "E|E%", allow_hyphen_values = true, help_heading = WHAT)]
    outside: Option<Tolerance>,
    /// Another need beside those of the options above, with its own error: 'key=value; key=value; …', the keys being box,
    /// obox, sphere, half-space, slab, convex, iso, range, field, error, view, pixels, transfer and colour-error
    /// (repeatable: the mesh suits all needs).
    #[arg(long = "need", value_name = "K=V;…", allow_hyphen_values = true, help_heading = WHAT)]
    needs: Vec<Group>,
    /// At most so many tetrahedra; the best mesh that fits, but never less than the base mesh.
    #[arg(long, value_name = "N", value_parser = needs::parse_count, allow_hyphen_values = true, help_heading = LIMITS)]
    budget: Option<u32>,
    /// At most so many vertices.
    #[arg(long, value_name = "N", value_parser = needs::parse_count, allow_hyphen_values = true, help_heading = LIMITS)]
    max_vertices: Option<u32>,
    /// At most so many bytes, 32 a tetrahedron and 16 a vertex; K, M and G are KiB, MiB and GiB.
    #[arg(long, value_name = "N[K|M|G]", value_parser = needs::parse_bytes, allow_hyphen_values = true, help_heading = LIMITS)]
    max_bytes: Option<u64>,
    /// Stop refining after so many milliseconds: a valid mesh, but an unfinished one, and not the same each time.
    #[arg(long, value_name = "MS", value_parser = needs::parse_size, allow_hyphen_values = true, help_heading = LIMITS)]
    max_ms: Option<f64>,
    /// Stop after so many updates: a valid mesh, but an unfinished one.
    #[arg(long, value_name = "N", value_parser = needs::parse_long_count, allow_hyphen_values = true, help_heading = LIMITS)]
    max_updates: Option<u64>,
}

impl Query {
    /// The files that it names.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.views.iter().chain(&self.transfers).chain(self.needs.iter().flat_map(Group::files))
    }

    /// The values that the mesh is refined around, if they are said by `--iso`.
    pub fn isovalues(&self) -> &[f64] {
        &self.isovalues
    }

    /// What the options beside `--need` and `--outside` say.
    fn group(&self) -> Result<Group> {
        let regions = [
            &self.boxes,
            &self.oriented_boxes,
            &self.spheres,
            &self.half_spaces,
            &self.slabs,
            &self.convexes,
        ];
        let isovalues = self.isovalues.iter().map(|&v| [v, v]);
        let mut cameras: Vec<Camera> = self.views.iter().cloned().map(Camera::File).collect();
        if let (Some(matrix), Some(viewport)) = (self.matrix, self.viewport) {
            cameras.push(Camera::Given(View { matrix, viewport }));
        }
        let group = Group {
            error: self.error,
            regions: regions.into_iter().flatten().cloned().collect(),
            ranges: isovalues.chain(self.ranges.iter().copied()).collect(),
            field: self.field.clone(),
            cameras,
            pixels: self.pixels,
            transfers: self.transfers.clone(),
            colour_error: self.colour_error,
        };
        group.check().map_err(anyhow::Error::msg)?;
        Ok(group)
    }

    fn wanted(&self, info: &MtInfo) -> Result<Vec<Wanted>> {
        let group = self.group()?;
        let mut wanted = Vec::new();
        // Needs said otherwise do without the reference mesh everywhere.
        let says_all = self.needs.is_empty() && self.outside.is_none();
        if !group.is_bare() || group.has_error() || says_all {
            group.add_to(info, None, &mut wanted)?;
        }
        for need in &self.needs {
            need.add_to(info, self.field.as_deref(), &mut wanted)?;
        }
        if let Some(error) = self.outside {
            let field = files::field_index(info, self.field.as_deref())?;
            let need = Need::within(error.relative(info.fields[field].range()));
            wanted.push(Wanted { name: "everywhere".to_owned(), need });
        }
        Ok(wanted)
    }

    fn budget(&self) -> Budget {
        Budget { tets: self.budget, vertices: self.max_vertices, bytes: self.max_bytes }
    }

    /// Opens an MT file and refines its mesh to what is asked for; the session shows the field that is asked for.
    pub fn answer(&self, file: &Path) -> Result<Answer> {
        self.answer_from(file, false)
    }

    /// [`Query::answer`] with the exact values that the file keeps.
    pub fn answer_exactly(&self, file: &Path) -> Result<Answer> {
        self.answer_from(file, true)
    }

    fn answer_from(&self, file: &Path, exact: bool) -> Result<Answer> {
        if let Err(wrong) = self.group() {
            super::refuse_usage(&wrong.to_string());
        }
        let name = || file.display().to_string();
        let mut client = files::open_parts(file).with_context(name)?;
        let info = client.session().info().context("the MT has no description").with_context(name)?;
        let wanted = self.wanted(info).with_context(name)?;
        let field = files::field_index(info, self.field.as_deref()).with_context(name)?;
        let needs = wanted.iter().map(|wanted| wanted.need.clone()).collect();
        let request = Request { needs, budget: self.budget() };
        client.aim(&request).with_context(name)?;
        while !client.fetch(PATIENCE).with_context(name)? {}
        if exact {
            client.fetch_exact().with_context(name)?;
        }
        let start = Instant::now();
        let deadline = self.max_ms.map(|ms| Duration::from_secs_f64(ms / 1000.0));
        let stopped = Cell::new(false);
        let mut go_on = |done: &Outcome| {
            let goes_on = self.max_updates.is_none_or(|most| done.refined + done.coarsened < most)
                && deadline.is_none_or(|deadline| start.elapsed() < deadline);
            stopped.set(!goes_on);
            goes_on
        };
        // What blocks of a half-edge MT it takes, the mesh shows on the way.
        let mut before = RefineStats::default();
        while client.session().mt().is_some_and(|mt| !mt.needs_parents()) {
            let Step { stats, complete } = client.step(PATIENCE, &mut go_on).with_context(name)?;
            before.add_work(&stats);
            if complete || stopped.get() {
                break;
            }
        }
        let mut opened = Opened::of(client);
        let mut stats = opened.session.step(&mut go_on).with_context(name)?;
        stats.add_work(&before);
        let seconds = start.elapsed().as_secs_f64();
        opened.session.set_field(field).with_context(name)?;
        let warnings = wanted.iter().filter_map(|wanted| needs::warning(&opened.session, &stats, wanted));
        warnings.for_each(|warning| eprintln!("warning: {warning}"));
        let summary = summary(&opened, field, &stats, &wanted)?;
        Ok(Answer { opened, field, wanted, stats, seconds, summary })
    }
}

/// A mesh that answers a query.
pub struct Answer {
    pub opened: Opened,
    /// Which field was asked for.
    pub field: usize,
    pub wanted: Vec<Wanted>,
    pub stats: RefineStats,
    /// What refinement took.
    pub seconds: f64,
    pub summary: Summary,
}

/// The mesh that a result is from, and the error that is guaranteed, as programs get them.
#[derive(Serialize)]
pub struct Summary {
    pub field: String,
    pub vertices: u32,
    pub tetrahedra: u32,
    pub updates_applied: u32,
    /// In units of the field; none as long as it is not known.
    pub error_bound: Option<f64>,
    /// As a fraction of the field's range.
    pub relative_error_bound: Option<f64>,
    /// Of the field at the vertices of the input inside the mesh, in its units: the error bound, or what rounding leaves.
    pub field_bound: Option<f64>,
    /// How far the boundary is from that of the input, in model units.
    pub boundary_bound: Option<f64>,
    /// How often the error exceeds what was asked for, at most.
    pub excess: Option<f64>,
    pub satisfied: bool,
    /// False if a limit of time or updates came first.
    pub done: bool,
    pub needs: Vec<NeedReport>,
    pub refined: u64,
    pub coarsened: u64,
    pub forced: u64,
    pub judged: u64,
    /// Bytes of the file that were read: where blocks of it are not needed, not all.
    pub bytes_read: u64,
    pub file_bytes: u64,
}

/// What was asked for in one need, and what is guaranteed.
#[derive(Serialize)]
pub struct NeedReport {
    /// In words.
    pub need: String,
    /// Of both errors: `relative` to the range of the field, `pixels` or `colour`.
    pub unit: &'static str,
    pub asked: f64,
    pub bound: Option<f64>,
}

fn summary(opened: &Opened, number: usize, stats: &RefineStats, wanted: &[Wanted]) -> Result<Summary> {
    let known = |value: f64| (stats.done && value.is_finite()).then_some(value);
    let report = |(i, wanted): (usize, &Wanted)| NeedReport {
        need: wanted.name.clone(),
        unit: needs::unit(&wanted.need),
        asked: wanted.need.error,
        bound: stats.bounds.get(i).copied().and_then(known),
    };
    let info = opened.info()?;
    let field = &info.fields[number];
    Ok(Summary {
        field: field.name.clone(),
        vertices: stats.vertices,
        tetrahedra: stats.tetrahedra,
        updates_applied: stats.applied,
        error_bound: known(stats.error_bound * field.range()),
        relative_error_bound: known(stats.error_bound),
        field_bound: known(info.field_bound(number, stats.error_bound)),
        boundary_bound: known(info.boundary_bound(stats.error_bound)),
        excess: known(stats.excess),
        satisfied: stats.satisfied,
        done: stats.done,
        needs: wanted.iter().enumerate().map(report).collect(),
        refined: stats.refined,
        coarsened: stats.coarsened,
        forced: stats.forced,
        judged: stats.judged,
        bytes_read: opened.read,
        file_bytes: opened.bytes,
    })
}

impl Summary {
    /// The same for people.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let bound = match (self.error_bound, self.relative_error_bound) {
            (Some(bound), Some(relative)) => {
                format!("{} ({} of the range)", output::number(bound), output::percent(relative))
            }
            _ => "not known yet".to_owned(),
        };
        let mut rows = vec![
            ("field", self.field.clone()),
            ("vertices", output::count(self.vertices)),
            ("tetrahedra", output::count(self.tetrahedra)),
            ("updates applied", output::count(self.updates_applied)),
            ("error bound", bound),
        ];
        if let Some(bound) = self.boundary_bound {
            rows.push(("boundary within", output::number(bound)));
        }
        // One need of the field says no more than the bound.
        if self.needs.len() > 1 || self.needs.iter().any(|need| need.unit != needs::RELATIVE) {
            rows.extend(self.needs.iter().map(|need| ("need", need.sentence())));
        }
        let [read, all] = [self.bytes_read, self.file_bytes].map(output::bytes);
        rows.push(("read", format!("{read} of {all}")));
        if !self.done {
            rows.push(("", "stopped before it was done".to_owned()));
        } else if !self.satisfied {
            rows.push(("", "the budget did not allow the error that was asked for".to_owned()));
        }
        rows
    }
}

impl NeedReport {
    fn sentence(&self) -> String {
        let say = |error: f64| match self.unit {
            needs::PIXELS => format!("{} pixels", output::number(error)),
            _ => output::percent(error),
        };
        let bound = self.bound.map_or("not known yet".to_owned(), say);
        format!("{}: {bound}, {} wanted", self.need, say(self.asked))
    }
}

impl Answer {
    /// The names of all fields, in the order of the MT.
    pub fn field_names(&self) -> Result<Vec<String>> {
        Ok(self.opened.info()?.fields.iter().map(|field| field.name.clone()).collect())
    }

    /// All fields at the vertices of the mesh, in the order of the MT.
    pub fn all_values(&self) -> Result<Vec<Vec<f32>>> {
        Ok((0..self.opened.info()?.fields.len()).map(|field| self.opened.session.values(field)).collect())
    }
}

/// A finite number.
pub fn parse_number(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("'{text}' is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(format!("'{text}' is not finite")) }
}

/// Finite numbers between commas.
pub fn parse_list(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(parse_number).collect()
}

/// `N` finite numbers between commas; `what` has so many.
pub fn parse_numbers<const N: usize>(text: &str, what: &str) -> Result<[f64; N], String> {
    let numbers = parse_list(text)?;
    let found = numbers.len();
    numbers.try_into().map_err(|_| format!("{what} has {N} numbers, not {found}"))
}

/// A box by its smaller and its larger corner.
pub fn parse_bounds(text: &str) -> Result<Bounds, String> {
    let [x0, y0, z0, x1, y1, z1] = parse_numbers(text, "a box")?;
    if x0 > x1 || y0 > y1 || z0 > z1 {
        return Err("a box has its smaller corner first".to_owned());
    }
    Ok(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
}
