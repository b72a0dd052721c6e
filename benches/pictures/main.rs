//! How fast the renderer draws: each mode, with meshes of several sizes, on the adapter that this machine has. Prints
//! Markdown; `cargo xtask bench --pictures` puts it into docs/benchmarks.md.
//!
//! A picture is timed from the call to the moment at which the device has finished it; the camera turns between
//! pictures. Nothing else is under way, so on a fast GPU the times have the way to it in them.

#[path = "../format/mt_file.rs"]
mod mt_file;

use mt_file::mt_file;
use std::error::Error;
use std::time::Instant;
use tetralod::geom::{Bounds, Camera};
use tetralod::mt::MtKind;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod_build::Purpose;
use tetralod_io::generate;
use tetralod_render::SceneRenderer;
use tetralod_render::gpu::{Renderer, wait};
use tetralod_render::scene::{
    ArrowState, BoundaryState, CellKind, CellState, IsosurfaceState, PlaneState, SceneState, SliceState,
    StreamlineState, VolumeState,
};

/// Whatever goes wrong: this is a tool, it says so and ends.
pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

const USAGE: &str = "\
options: --size WxH       pixels [640x480]
         --tets N,N,...   tetrahedra of the current mesh [50000]
         --grid N         points along an edge of the generated volume [33]
         --file FILE.mt   an MT file instead of the generated volume
         --pictures N     pictures of each mode [15]
         --modes A,B,...  these modes alone";

struct Options {
    size: [u32; 2],
    tets: Vec<u32>,
    grid: u32,
    file: Option<String>,
    pictures: usize,
    modes: Vec<String>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self> {
        let mut options = Self {
            size: [640, 480],
            tets: vec![50_000],
            grid: 33,
            file: None,
            pictures: 15,
            modes: Vec::new(),
        };
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("{name} needs a value\n{USAGE}"))?;
            match name.as_str() {
                "--size" => {
                    let (width, height) = value.split_once('x').ok_or(USAGE)?;
                    options.size = [width.parse()?, height.parse()?];
                }
                "--tets" => {
                    options.tets = value.split(',').map(str::parse).collect::<std::result::Result<_, _>>()?;
                }
                "--grid" => options.grid = value.parse()?,
                "--file" => options.file = Some(value),
                "--pictures" => options.pictures = value.parse::<usize>()?.max(1),
                "--modes" => options.modes = value.split(',').map(str::to_owned).collect(),
                _ => return Err(format!("there is no option {name}\n{USAGE}").into()),
            }
        }
        Ok(options)
    }
}

/// What modes need to know of the volume.
struct About {
    bounds: Bounds,
    /// Of the field.
    range: [f64; 2],
    field: String,
}

impl About {
    fn value(&self, part: f64) -> f64 {
        self.range[0] + part * (self.range[1] - self.range[0])
    }

    fn point(&self, part: [f64; 3]) -> [f64; 3] {
        let Bounds { min, max } = self.bounds;
        [0, 1, 2].map(|k| min[k] + part[k] * (max[k] - min[k]))
    }

    fn surface(&self, part: f64, opacity: f64) -> IsosurfaceState {
        IsosurfaceState { value: Some(self.value(part)), opacity, ..IsosurfaceState::default() }
    }

    fn slice(&self, part: f64) -> SliceState {
        let offset = self.point([0.0, part, 0.0])[1];
        SliceState { normal: [0.0, 1.0, 0.0], offset, opacity: 1.0, edges: false, field: None, clipped: true }
    }

    fn cells(shape: CellKind) -> SceneState {
        SceneState { cells: Some(CellState { shape, ..CellState::default() }), ..SceneState::default() }
    }

    /// What mode `name` shows; `moved`, from 0 to 1, is what a hand on the slider changes. Cells and volume need
    /// the mesh alone.
    fn state(&self, name: &str, moved: f64) -> Option<SceneState> {
        let part = 0.4 + 0.2 * moved;
        let empty = SceneState::default();
        let fields = || [(); 3].map(|()| self.field.clone());
        Some(match name {
            "isosurface" => SceneState { isosurfaces: vec![self.surface(part, 1.0)], ..empty },
            "two translucent isosurfaces" => {
                let isosurfaces = vec![self.surface(0.5 * part, 0.4), self.surface(part, 0.6)];
                SceneState { isosurfaces, ..empty }
            }
            "volume" => SceneState { volume: Some(VolumeState::default()), ..empty },
            "slice" => SceneState { slices: vec![self.slice(part)], ..empty },
            "boundary" => SceneState { boundary: Some(BoundaryState::default()), ..empty },
            "cells" => Self::cells(CellKind::Solid),
            "wire" => Self::cells(CellKind::Wire),
            "points" => Self::cells(CellKind::Points),
            // Along a field that is no velocity: what counts is how many tubes there are.
            "streamlines" => {
                let steps = 0..25;
                let at = |i: u32| [0.2 + 0.15 * f64::from(i % 5), part, 0.2 + 0.15 * f64::from(i / 5)];
                let seeds = steps.map(|i| self.point(at(i))).collect();
                let streamlines = StreamlineState { fields: fields(), seeds, ..StreamlineState::default() };
                SceneState { streamlines: Some(streamlines), ..empty }
            }
            "arrows" => {
                let spacing = Some(self.bounds.diagonal() / (25.0 + 10.0 * moved));
                let arrows = ArrowState { fields: fields(), spacing, ..ArrowState::default() };
                SceneState { arrows: Some(arrows), ..empty }
            }
            "volume, isosurface, slice and clip" => {
                let middle = self.point([0.5, 0.5, 0.5]);
                let clips = vec![PlaneState { normal: [1.0, 0.0, 0.0], offset: middle[0] }];
                let (isosurfaces, slices) = (vec![self.surface(0.6 * part, 1.0)], vec![self.slice(part)]);
                SceneState { isosurfaces, slices, clips, volume: Some(VolumeState::default()), ..empty }
            }
            _ => return None,
        })
    }
}

const MODES: [&str; 11] = [
    "isosurface",
    "two translucent isosurfaces",
    "volume",
    "volume, isosurface, slice and clip",
    "slice",
    "boundary",
    "cells",
    "wire",
    "points",
    "streamlines",
    "arrows",
];

fn main() -> Result<()> {
    // The first argument is the program itself; Cargo adds `--bench`, and `cargo test --all-targets` nothing.
    let mut arguments = std::env::args().skip(1).peekable();
    if arguments.next_if(|argument| argument == "run").is_none() {
        return Ok(());
    }
    let options = Options::parse(arguments.filter(|argument| argument != "--bench"))?;
    let bytes = match &options.file {
        Some(file) => std::fs::read(file)?,
        None => mt_file(&generate::bucky(options.grid)?, MtKind::HalfEdge, Purpose::default())?,
    };
    let renderer = wait(Renderer::headless(options.size))?;
    let [width, height] = renderer.size();
    println!("### {}, {width} × {height}\n", renderer.description());
    drop(renderer);
    println!(
        "| current tetrahedra | mode | triangles | compute ms | draw ms | pictures/s | quick ms | half as wide ms | GPU MB | bytes/tet |"
    );
    println!("|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    for tets in &options.tets {
        for mode in MODES {
            let name = mode.split([',', ' ']).next().unwrap_or(mode);
            if options.modes.is_empty() || options.modes.iter().any(|wanted| wanted == mode || wanted == name)
            {
                measure(&options, &bytes, *tets, mode)?;
            }
        }
    }
    Ok(())
}

/// A row of the table. Each mode has a renderer of its own, so that its memory is what this mode takes.
fn measure(options: &Options, bytes: &[u8], tets: u32, mode: &str) -> Result<()> {
    let mut session = Session::new();
    session.feed(bytes)?;
    session.refine(&Request::within(0.0).at_most(tets))?;
    let info = session.info().ok_or("the file is not whole")?;
    let field = info.fields.first().ok_or("the file has no field")?;
    let (range, field) = ([field.min, field.max], field.name.clone());
    let positions = session.view().positions;
    let bounds = positions.iter().fold(Bounds::EMPTY, |bounds, p| bounds.with(p.map(f64::from)));
    let about = About { bounds, range, field };
    let mut scene = SceneRenderer::new(wait(Renderer::headless(options.size))?);
    let mut camera = Camera::home(&about.bounds, f64::from(options.size[0]) / f64::from(options.size[1]));
    let state = |moved| about.state(mode, moved).ok_or_else(|| format!("there is no mode {mode}"));
    let (mut computed, mut drawn) = (Vec::new(), Vec::new());
    scene.set_state(state(0.0)?)?;
    scene.update(&mut session)?;
    for count in 0..=options.pictures {
        scene.set_state(state(count as f64 / options.pictures as f64)?)?;
        let start = Instant::now();
        scene.update(&mut session)?;
        let compute = start.elapsed().as_secs_f64();
        camera.orbit(0.05, 0.0);
        let mut draw = picture(&mut scene, &mut session, &camera)?;
        // Where the lists had no room, a viewer draws again; they keep what they got.
        while scene.renderer_mut().is_short() {
            draw = picture(&mut scene, &mut session, &camera)?;
        }
        // With the first picture drivers compile.
        if count > 0 {
            computed.push(compute);
            drawn.push(draw);
        }
    }
    let tets = session.mesh().map_or(0, |mesh| mesh.tet_count());
    let (compute, draw) = (median(computed), median(drawn));
    let bytes = [scene.renderer().gpu_bytes(), scene.renderer().mesh_bytes()].map(|bytes| bytes as f64);
    scene.renderer_mut().set_quick(true);
    let mut quick = [0.0; 2];
    for (time, scale) in quick.iter_mut().zip([1.0, 0.5]) {
        scene.renderer_mut().set_scale(scale);
        let mut drawn = Vec::new();
        for _ in 0..=options.pictures {
            camera.orbit(0.05, 0.0);
            drawn.push(picture(&mut scene, &mut session, &camera)?);
        }
        *time = median(drawn);
    }
    println!(
        "| {tets} | {mode} | {} | {:.2} | {:.2} | {:.1} | {:.2} | {:.2} | {:.1} | {:.1} |",
        scene.triangles(),
        1e3 * compute,
        1e3 * draw,
        1.0 / draw,
        1e3 * quick[0],
        1e3 * quick[1],
        bytes[0] / 1e6,
        bytes[1] / tets.max(1) as f64,
    );
    Ok(())
}

/// Seconds until the device has finished a picture.
fn picture(scene: &mut SceneRenderer, session: &mut Session, camera: &Camera) -> Result<f64> {
    let start = Instant::now();
    scene.draw(session, camera)?;
    while scene.renderer().in_flight()? > 0 {
        std::thread::yield_now();
    }
    Ok(start.elapsed().as_secs_f64())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
