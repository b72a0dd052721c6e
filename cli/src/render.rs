//! `tetralod render`: a picture of the mesh.

mod shown;

use super::parse::{one_of, parse_numbers, parse_positive};
use super::query::{Query, Summary};
use super::{files, output};
use anyhow::{Context, Result, anyhow};
use indicatif::ProgressBar;
use serde::Serialize;
use shown::{About, Shown};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetralod::geom::{Bounds, Camera, CameraState, Projection, ViewPreset};
use tetralod_render::gpu::{GpuError, Renderer, wait};
use tetralod_render::scene::{Background, Legend};
use tetralod_render::{SceneRenderer, ShowError};

const PICTURE: &str = "Picture";
const CAMERA: &str = "Camera";

/// The size of a picture in which lines have their width in pixels; in larger ones they get wider.
const USUAL: [u32; 2] = [1280, 960];

/// Draws a picture of the mesh: isosurfaces, the volume, sections, the boundary, tetrahedra, together if need
/// be.
///
/// It draws with Vulkan, on a GPU or in software. The same command gives the same picture on the same device.
#[derive(clap::Args)]
#[command(after_help = "\
Examples: tetralod render engine.mt --isovalue 0.3 --isovalue 0.6 --opacity 50% --error 1% -o engine.png
          tetralod render engine.mt --mode boundary,wire --clip z=0.5 --map turbo --from +x -o inside.png
          tetralod render engine.mt --mode cells --colour-by depth --shrink 20% --cut x=0.5 -o cells.png")]
pub struct Arguments {
    /// The picture to write, a .png file.
    #[arg(short, long, value_name = "FILE", value_parser = parse_png, required_unless_present = "print_scene")]
    output: Option<PathBuf>,
    #[command(flatten)]
    query: Query,
    #[command(flatten)]
    shown: Shown,
    #[command(flatten)]
    placed: Placed,
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

/// The options that place the camera.
#[derive(clap::Args)]
#[command(next_help_heading = CAMERA)]
struct Placed {
    /// The side from which it is seen; home is the front, a little from the right and from above.
    #[arg(long, value_name = "SIDE", value_parser = one_of(SIDES), default_value = "home", allow_hyphen_values = true)]
    from: ViewPreset,
    /// Then go around it: to the right and upwards, in degrees.
    #[arg(
        long,
        value_name = "YAW,PITCH",
        value_parser = |text: &str| parse_numbers::<2>(text, "a turn"),
        default_value = "0,0",
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    turn: [f64; 2],
    /// Magnify: 1 shows all of the model, 2 half of its width.
    #[arg(long, value_name = "F", value_parser = parse_positive, default_value = "1", allow_hyphen_values = true)]
    zoom: f64,
    /// What is farther away does not look smaller.
    #[arg(long)]
    orthographic: bool,
}

/// Sides to look from.
const SIDES: [(&str, ViewPreset); 7] = [
    ("home", ViewPreset::Home),
    ("+x", ViewPreset::AgainstX),
    ("-x", ViewPreset::AlongX),
    ("+y", ViewPreset::AgainstY),
    ("-y", ViewPreset::AlongY),
    ("+z", ViewPreset::AgainstZ),
    ("-z", ViewPreset::AlongZ),
];

fn parse_dimensions(text: &str) -> Result<[u32; 2], String> {
    let wrong = || format!("'{text}' is no width and height in pixels, such as 1280x960");
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let [width, height] = [width, height].map(|side| side.trim().parse().ok().filter(|side| *side > 0));
    Ok([width.ok_or_else(wrong)?, height.ok_or_else(wrong)?])
}

fn parse_png(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if files::ending(&path) == "png" { Ok(path) } else { Err("the file's name must end in .png".to_owned()) }
}

impl Placed {
    fn camera(&self, bounds: &Bounds, aspect: f64) -> Camera {
        let mut camera = Camera::home(bounds, aspect);
        if self.orthographic {
            camera.set_projection(Projection::Orthographic);
        }
        camera.turn_to(self.from);
        let [yaw, pitch] = self.turn.map(f64::to_radians);
        camera.orbit(yaw, pitch);
        camera.fit(bounds, aspect);
        camera.zoom(1.0 / self.zoom);
        camera
    }
}

/// The result as programs get it.
#[derive(Serialize)]
struct Report {
    width: u32,
    height: u32,
    samples: u32,
    /// Of isosurfaces, sections, the boundary, tubes and arrows.
    triangles: usize,
    colours: Option<Colours>,
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
}

impl Colours {
    fn of(legend: &Legend) -> Self {
        let scale = &legend.scale;
        Self {
            of: legend.label.clone(),
            map: scale.map.name,
            range: scale.range,
            log: scale.is_log,
            reversed: scale.is_reversed,
        }
    }

    fn sentence(&self) -> String {
        let [low, high] = output::ends(self.range);
        let log = if self.log { ", logarithmic" } else { "" };
        let reversed = if self.reversed { ", reversed" } else { "" };
        format!("{} from {low} to {high} ({}{log}{reversed})", self.of, self.map)
    }
}

pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.shown.check();
    let Some(output) = arguments.output.as_ref().filter(|_| !arguments.print_scene) else {
        return print_scene(arguments);
    };
    files::check_output(output, arguments.query.files().chain(arguments.shown.files()))?;
    // Whether it can draw shows before anything is read.
    let size = arguments.size;
    let renderer = renderer(size)?;
    let mut answer = arguments.query.answer()?;
    let start = Instant::now();
    let about = About {
        bounds: answer.opened.session.view().bounds(),
        is_box: answer.opened.session.is_box() == Some(true),
        field: &answer.opened.info()?.fields[answer.field],
    };
    let state = arguments.shown.state(&arguments.query, &about)?;
    shown::warnings(&state, &about).iter().for_each(|warning| output::note(&format!("warning: {warning}")));
    let is_transparent = state.background == Background::Transparent;
    let camera = arguments.placed.camera(&about.bounds, f64::from(size[0]) / f64::from(size[1]));
    let mut scene = SceneRenderer::new(renderer);
    scene.set_pixel_ratio([0, 1].map(|k| size[k] as f32 / USUAL[k] as f32).into_iter().fold(1.0, f32::max));
    scene.set_state(state).map_err(explained)?;
    let session = &mut answer.opened.session;
    scene.update(session).map_err(explained)?;
    let bar = ProgressBar::new(u64::from(arguments.samples));
    let picture = scene.picture(session, &camera, arguments.samples, |count| bar.set_position(count.into()));
    let pixels = wait(picture).map_err(explained)?;
    bar.finish_and_clear();
    let report = Report {
        width: size[0],
        height: size[1],
        samples: arguments.samples,
        triangles: scene.triangles(),
        colours: scene.legend().map(Colours::of),
        camera: camera.state(),
        device: scene.renderer().description(),
    };
    let about = description(&arguments.query.file, &report, &answer.summary);
    let picture = Picture { size, pixels: &pixels, is_transparent, about: &about };
    files::write_file(output, |out| picture.write(out))?;
    let seconds = start.elapsed().as_secs_f64();
    arguments.query.print(&report, rows(output, &report), (&answer.summary, seconds))
}

fn rows(output: &Path, report: &Report) -> Vec<(&'static str, String)> {
    let &Report { width, height, samples, .. } = report;
    let mean = if samples > 1 { format!(", mean of {samples} pictures") } else { String::new() };
    let mut rows = vec![
        ("file", output.display().to_string()),
        ("size", format!("{width} x {height} pixels{mean}")),
        ("triangles", output::count(report.triangles as u64)),
    ];
    rows.extend(report.colours.iter().map(|colours| ("colours", colours.sentence())));
    rows.push(("drawn by", report.device.clone()));
    rows
}

/// What the picture says of itself.
fn description(file: &Path, report: &Report, mesh: &Summary) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let mut text = format!("{name}: {}, {}", mesh.field, output::mesh(mesh.vertices, mesh.tetrahedra));
    if let Some(bound) = mesh.error_bound {
        text += &format!(", error at most {}", output::number(bound));
    }
    if let Some(colours) = &report.colours {
        text += &format!("; colours: {}", colours.sentence());
    }
    text
}

/// Prints the scene of the base mesh.
fn print_scene(arguments: &Arguments) -> Result<()> {
    let name = || arguments.query.file.display().to_string();
    let mut opened = files::Opened::of(files::open_parts(&arguments.query.file).with_context(name)?);
    let bounds = opened.session.view().bounds();
    let info = opened.info()?;
    let field = &info.fields[files::field_index(info, arguments.query.field()).with_context(name)?];
    let is_box = opened.session.is_box() == Some(true);
    output::json(&arguments.shown.state(&arguments.query, &About { bounds, is_box, field })?)
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

/// A picture as it was drawn: premultiplied `RGBA`.
struct Picture<'a> {
    size: [u32; 2],
    pixels: &'a [u8],
    is_transparent: bool,
    about: &'a str,
}

impl Picture<'_> {
    fn write(&self, out: &mut impl Write) -> Result<()> {
        let [width, height] = self.size;
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(if self.is_transparent { png::ColorType::Rgba } else { png::ColorType::Rgb });
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let software = concat!("tetralod ", env!("CARGO_PKG_VERSION"));
        encoder.add_text_chunk("Software".to_owned(), software.to_owned())?;
        encoder.add_itxt_chunk("Description".to_owned(), self.about.to_owned())?;
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.bytes())?;
        Ok(writer.finish()?)
    }

    fn bytes(&self) -> Vec<u8> {
        let pixels = self.pixels.as_chunks::<4>().0;
        if self.is_transparent {
            pixels.iter().copied().flat_map(straight).collect()
        } else {
            pixels.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()
        }
    }
}

/// A pixel with its colour as it is without its opacity.
fn straight([r, g, b, a]: [u8; 4]) -> [u8; 4] {
    let [half, alpha] = [u32::from(a) / 2, u32::from(a).max(1)];
    let [r, g, b] = [r, g, b].map(|c| ((u32::from(c) * 255 + half) / alpha).min(255) as u8);
    [r, g, b, a]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_out_of_their_opacity() {
        assert_eq!(straight([0, 0, 0, 0]), [0, 0, 0, 0]);
        assert_eq!(straight([10, 128, 255, 255]), [10, 128, 255, 255]);
        assert_eq!(straight([64, 32, 0, 128]), [128, 64, 0, 128]);
        assert_eq!(straight([9, 1, 0, 8]), [255, 32, 0, 8]);
    }
}
