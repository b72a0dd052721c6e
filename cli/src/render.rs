//! `tetralod render`: a picture of the mesh.

pub mod drawn;
mod movie;
mod picture;
mod shown;

use super::deform::Displaced;
use super::query::{Scope, Summary};
use super::{files, output, steps};
use anyhow::{Context, Result, anyhow};
use drawn::Drawn;
use indicatif::ProgressBar;
use movie::{Movie, Target, parse_output};
use picture::Picture;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetralod::geom::{Camera, CameraState};
use tetralod::mesh::Averaged;
use tetralod::mt::MtInfo;
use tetralod::session::Session;
use tetralod_render::gpu::{GpuError, Renderer, wait};
use tetralod_render::scene::{Background, Legend, SceneState};
use tetralod_render::{SceneRenderer, ShowError};

const PICTURE: &str = "Picture";

/// The size of a picture in which lines have their width in pixels; in larger ones they get wider.
const USUAL: [u32; 2] = [1280, 960];

/// Draws a picture of the mesh: isosurfaces, the volume, sections, the boundary, tetrahedra, together if need
/// be.
///
/// It draws with Vulkan, on a GPU or in software. The same command gives the same picture on the same device. Movies are several pictures: a .png
/// gives one file each with a number (a-0001.png, …), a .gif or .apng has all.
#[derive(clap::Args)]
#[command(after_help = "\
Examples: tetralod render engine.mt --isovalue 0.3 --isovalue 0.6 --opacity 50% --error 1% -o engine.png
          tetralod render engine.mt --mode boundary,wire --clip z=0.5 --map turbo --from +x -o inside.png
          tetralod render engine.mt --mode cells --colour-by depth --shrink 20% --cut x=0.5 -o cells.png
          tetralod render engine.mt --turntable 72 --size 640x480 --error 1% -o engine.gif")]
pub struct Arguments {
    /// The picture to write, a .png file; of a movie a .gif, an .apng, or .png files with numbers.
    #[arg(short, long, value_name = "FILE", value_parser = parse_output, required_unless_present = "print_scene")]
    output: Option<PathBuf>,
    #[command(flatten)]
    drawn: Drawn,
    #[command(flatten)]
    movie: Movie,
    /// Width and height in pixels.
    #[arg(
        long,
        value_name = "WxH",
        default_value = "1280x960",
        value_parser = parse_dimensions,
        help_heading = PICTURE
    )]
    size: [u32; 2],
    /// How many pictures, from a little beside one another, the picture is the mean of: more are smoother.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 16,
        value_parser = clap::value_parser!(u32).range(1..=1024),
        help_heading = PICTURE
    )]
    samples: u32,
    /// Draw nothing: print the scene, as --scene reads it.
    #[arg(long, help_heading = PICTURE)]
    print_scene: bool,
}

pub fn parse_dimensions(text: &str) -> Result<[u32; 2], String> {
    let wrong = || format!("'{text}' is no width and height in pixels, such as 1280x960");
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let [width, height] = [width, height].map(|side| side.trim().parse().ok().filter(|side| *side > 0));
    Ok([width.ok_or_else(wrong)?, height.ok_or_else(wrong)?])
}

/// The result as programs get it.
#[derive(Serialize)]
struct Report {
    /// Of a movie, how many there are, how many in a second of a file that has all, and their times if they are time steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pictures: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fps: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    times: Option<Vec<f64>>,
    width: u32,
    height: u32,
    samples: u32,
    /// Of isosurfaces, sections, the boundary, tubes and arrows; this and what follows is of the first picture.
    triangles: usize,
    colours: Option<Colours>,
    #[serde(flatten)]
    displaced: Option<Displaced>,
    camera: CameraState,
    device: String,
}

/// What colours mean.
#[derive(Serialize)]
struct Colours {
    of: String,
    map: &'static str,
    range: [f64; 2],
    log: bool,
    reversed: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    bands: Option<u8>,
    /// Of a label, those that the mesh has, ascending, and their colours as CSS has them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    labels: Vec<Label>,
    /// What averaging has done to the field that is shown, if the input has it at cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    averaged: Option<Averaged>,
}

/// A label and its colour.
#[derive(Serialize)]
struct Label {
    label: f64,
    colour: String,
}

/// Labels that are printed, at most.
const LISTED: usize = 24;

impl Colours {
    /// Of a legend; `number` is that of the field that is shown, which may be one of several time steps.
    fn of(legend: &Legend, info: &MtInfo, number: usize) -> Self {
        let scale = &legend.scale;
        let fields = info.fields[number..=number].iter().chain(&info.fields);
        let field = fields.into_iter().find(|field| field.name == legend.label);
        Self {
            of: legend.label.clone(),
            map: scale.map.name,
            range: match (legend.labels.first(), legend.labels.last()) {
                (Some((least, _)), Some((most, _))) => [*least, *most],
                _ => scale.range,
            },
            log: scale.is_log,
            reversed: scale.is_reversed,
            bands: (scale.bands > 1).then_some(scale.bands),
            labels: legend
                .labels
                .iter()
                .map(|&(label, [r, g, b])| Label { label, colour: format!("#{r:02x}{g:02x}{b:02x}") })
                .collect(),
            averaged: field.and_then(|field| field.averaged.clone()),
        }
    }

    fn sentence(&self) -> String {
        if !self.labels.is_empty() {
            let words =
                self.labels.iter().take(LISTED).map(|Label { label, colour }| format!("{label} {colour}"));
            let words = words.collect::<Vec<_>>().join(", ");
            let rest = self.labels.len().saturating_sub(LISTED);
            let more = if rest > 0 { format!(" and {rest} more: --json lists all") } else { String::new() };
            return format!("labels of {}: {words}{more}", self.of);
        }
        let [low, high] = output::ends(self.range);
        let log = if self.log { ", logarithmic" } else { "" };
        let reversed = if self.reversed { ", reversed" } else { "" };
        let bands = self.bands.map_or_else(String::new, |bands| format!(", {bands} colours"));
        let averaged = self.averaged.as_ref().map(|Averaged { input, .. }| {
            let [low, high] = output::ends(input.both().map(|extreme| extreme.value));
            format!(", averaged from cells; input {low} to {high}")
        });
        let averaged = averaged.unwrap_or_default();
        format!("{} from {low} to {high} ({}{log}{reversed}{bands}){averaged}", self.of, self.map)
    }
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let Drawn { query, shown, placed } = &arguments.drawn;
    shown.check();
    let Some(output) = arguments.output.as_ref().filter(|_| !arguments.print_scene) else {
        return print_scene(&arguments.drawn);
    };
    let (movie, target) = (&arguments.movie, arguments.movie.target(output));
    files::check_output(&target.path(0), arguments.drawn.files())?;
    // Whether it can draw shows before anything is read.
    let size = arguments.size;
    let renderer = renderer(size)?;
    let of_all = movie.is_over_time();
    let scope = Scope { at_all_times: of_all, ..Scope::default() };
    let mut answer = query.answer_for(&scope)?;
    let start = Instant::now();
    let info = answer.opened.info()?;
    let steps = if of_all { steps::in_order(info, answer.field)? } else { Vec::new() };
    let mut field = info.fields[answer.field].clone();
    if of_all {
        [field.min, field.max] = info.range_at_all_times(answer.field);
    }
    let times = of_all.then(|| steps.iter().filter_map(|&step| info.fields[step].time).collect());
    let bounds = answer.opened.session.view().bounds();
    let state = arguments.drawn.scene(&mut answer.opened.session, answer.field, &field)?;
    let frames = movie.frames(&steps);
    let mut scene = SceneRenderer::new(renderer);
    scene.set_pixel_ratio([0, 1].map(|k| size[k] as f32 / USUAL[k] as f32).into_iter().fold(1.0, f32::max));
    let bar = ProgressBar::new(frames.len() as u64 * u64::from(arguments.samples));
    let (mut cameras, mut report) = (Vec::new(), None);
    // The next pictures find the scene and the renderer as the one before has left them.
    let draw = |number: usize| {
        let (frame, session) = (frames[number], &mut answer.opened.session);
        if let Some(step) = frame.step {
            session.set_field(step)?;
            answer.summary.time = session.info().and_then(|info| info.fields[step].time);
        }
        let mut state = state.clone();
        if let (Some(deform), Some(phase)) = (&mut state.deform, frame.phase) {
            deform.phase = Some(phase);
        }
        scene.set_state(state).map_err(explained)?;
        scene.update(session).map_err(explained)?;
        shown.check_steps(query, session, scene.deformation())?;
        if cameras.is_empty() {
            let displaced = scene.deformation().and_then(|_| scene.shown_bounds(session));
            let aspect = f64::from(size[0]) / f64::from(size[1]);
            cameras = placed.cameras(&displaced.unwrap_or(bounds), aspect, &frames);
        }
        let camera = &cameras[number];
        let before = number as u64 * u64::from(arguments.samples);
        let drawn = |count: u32| bar.set_position(before + u64::from(count));
        let pixels = wait(scene.picture(session, camera, arguments.samples, drawn)).map_err(explained)?;
        let own = Report::of(arguments, &scene, session, camera)?;
        let about = description(&query.file, &own, &answer.summary);
        report.get_or_insert(own);
        let is_transparent = scene.state().background == Background::Transparent;
        Ok(Picture { size, pixels, is_transparent, about })
    };
    target.write(frames.len(), movie.rate(), draw)?;
    bar.finish_and_clear();
    let mut report = report.context("there is no picture")?;
    if frames.len() > 1 {
        report.pictures = Some(frames.len());
        report.fps = target.is_animated().then(|| movie.rate());
        report.times = times;
        answer.summary.time = answer.summary.time.filter(|_| !of_all);
    }
    let seconds = start.elapsed().as_secs_f64();
    query.print(&report, rows(&target, &report), (&answer.summary, seconds))
}

impl Report {
    /// Of a picture that has been drawn.
    fn of(arguments: &Arguments, scene: &SceneRenderer, session: &Session, camera: &Camera) -> Result<Self> {
        let info = session.info().context("the MT has no description")?;
        let displaced = match (scene.deformation(), &scene.state().deform) {
            (Some(deformation), Some(state)) => {
                Some(Displaced::new(&state.field, deformation, info, session))
            }
            _ => None,
        };
        let [width, height] = arguments.size;
        Ok(Self {
            pictures: None,
            fps: None,
            times: None,
            width,
            height,
            samples: arguments.samples,
            triangles: scene.triangles(),
            colours: scene.legend().map(|legend| Colours::of(legend, info, session.field())),
            displaced,
            camera: camera.state(),
            device: scene.renderer().description(),
        })
    }
}

fn rows(target: &Target, report: &Report) -> Vec<(&'static str, String)> {
    let &Report { width, height, samples, .. } = report;
    let mean = if samples > 1 { format!(", mean of {samples} pictures") } else { String::new() };
    let mut rows = vec![("file", target.path(0).display().to_string())];
    if let Some(count) = report.pictures {
        let last = target.path(count - 1);
        let rate = report.fps.map(|rate| format!(", {} a second", output::number(rate)));
        rows.push((
            "pictures",
            output::count(count as u64) + &rate.unwrap_or_else(|| format!(", the last {}", last.display())),
        ));
        if let Some([first, .., last]) = report.times.as_deref() {
            rows.push(("times", [*first, *last].map(output::exact).join(" to ")));
        }
    }
    rows.push(("size", format!("{width} x {height} pixels{mean}")));
    rows.push(("triangles", output::count(report.triangles as u64)));
    rows.extend(report.colours.iter().map(|colours| ("colours", colours.sentence())));
    rows.extend(report.displaced.iter().flat_map(Displaced::rows));
    rows.push(("drawn by", report.device.clone()));
    rows
}

/// What the picture says of itself.
fn description(file: &Path, report: &Report, mesh: &Summary) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let mut text =
        format!("{name}: {}, {}", mesh.field(), output::mesh(mesh.vertices, mesh.tetrahedra.into()));
    if let Some(bound) = mesh.error_bound {
        text += &format!(", error at most {}", output::number(bound));
    }
    if let Some(colours) = &report.colours {
        text += &format!("; colours: {}", colours.sentence());
    }
    text
}

/// Prints the scene of the base mesh.
fn print_scene(drawn: &Drawn) -> Result<()> {
    let query = &drawn.query;
    let name = || query.file.display().to_string();
    let mut opened = files::Opened::of(files::open_parts(&query.file).with_context(name)?);
    let info = opened.info()?;
    let index = query.field_index(info).with_context(name)?;
    let field = info.fields[index].clone();
    output::json(&drawn.scene(&mut opened.session, index, &field)?)
}

/// A picture of a scene, as the bytes of a PNG.
pub fn png(session: &mut Session, state: &SceneState, camera: &Camera, size: [u32; 2]) -> Result<Vec<u8>> {
    let mut scene = SceneRenderer::new(renderer(size)?);
    scene.set_state(state.clone()).map_err(explained)?;
    scene.update(session).map_err(explained)?;
    let pixels = wait(scene.picture(session, camera, 16, |_| ())).map_err(explained)?;
    let is_transparent = state.background == Background::Transparent;
    let mut bytes = Vec::new();
    Picture { size, pixels, is_transparent, about: String::new() }.write(&mut bytes)?;
    Ok(bytes)
}

/// A renderer of pictures of this size.
fn renderer(size: [u32; 2]) -> Result<Renderer> {
    // The longest row that the device has shows how large pictures can be, and takes little memory.
    let mut renderer = wait(Renderer::headless([u32::MAX, 1])).map_err(explained)?;
    let [longest, _] = renderer.size();
    if size.iter().any(|side| *side > longest) {
        let [width, height] = size;
        let device = renderer.description();
        return Err(anyhow!(
            "--size {width}x{height}: pictures of this device ({device}) have at most {longest} x {longest} \
             pixels"
        ));
    }
    renderer.resize(size);
    Ok(renderer)
}

/// What is wrong and what to do, on the command line.
fn explained(error: impl Into<ShowError>) -> anyhow::Error {
    match error.into() {
        ShowError::Gpu(GpuError::NoAdapter(why)) => anyhow!(
            "there is no Vulkan adapter to draw with ({why}); install the driver of the GPU, or \
             Mesa's software driver (package mesa-vulkan-drivers of Debian, Ubuntu and Fedora, vulkan-swrast \
             of Arch Linux)"
        ),
        ShowError::Gpu(GpuError::NoDevice(why)) => {
            anyhow!("the GPU cannot be opened: {why}; end other programs that use it")
        }
        ShowError::Gpu(GpuError::DeviceLost(why)) => {
            anyhow!("the GPU was lost: {why}; draw a smaller --size or a mesh of a smaller --budget")
        }
        // The text of these holds that of their cause.
        other => anyhow!("{other}"),
    }
}
