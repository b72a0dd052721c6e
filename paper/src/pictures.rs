//! Pictures of meshes, drawn by the crate's renderer on whatever Vulkan there is: Mesa's lavapipe will do.

use anyhow::{Context, Result};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use tetralod::geom::Camera;
use tetralod::view::{ClipPlane, ColourScale, IsoSurface, Triangles, VIRIDIS};
use tetralod_render::draw::{BoxLines, CellStyle, Colouring, EdgeLook, Lighting, Look, Style};
use tetralod_render::gpu::{GpuError, Renderer, wait};

use crate::figures::Pair;
use crate::query::Shown;

/// Width and height of a picture in pixels.
const SIZE: [u32; 2] = [640, 640];

/// The background.
const PAPER: [f32; 4] = [0.98, 0.98, 0.98, 1.0];

/// Draws what is asked for; none where there is no adapter.
pub struct Painter {
    renderer: Renderer,
}

impl Painter {
    /// # Errors
    /// If there is an adapter that cannot be used.
    pub fn new() -> Result<Option<Self>> {
        match wait(Renderer::headless(SIZE)) {
            Ok(renderer) => Ok(Some(Self { renderer })),
            Err(GpuError::NoAdapter(_)) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// The adapter in words.
    pub fn description(&self) -> String {
        self.renderer.description()
    }

    /// Draws the pictures of a figure into `folder`; the page shows them by the same names.
    pub fn draw(&mut self, pair: &Pair, figure: u32, folder: &Path) -> Result<()> {
        let path = |mesh: &str, what: &str| folder.join(format!("figure-{figure}-{mesh}-{what}.png"));
        self.mesh(&pair.uniform, pair, &path("uniform", "mesh"))?;
        self.mesh(&pair.variable, pair, &path("variable", "mesh"))?;
        self.surface(&pair.uniform, pair, &path("uniform", "surface"))?;
        if !pair.same_surface() {
            self.surface(&pair.variable, pair, &path("variable", "surface"))?;
        }
        Ok(())
    }

    /// The isosurface with the edges of its facets.
    fn surface(&mut self, shown: &Shown, pair: &Pair, path: &Path) -> Result<()> {
        let mut surface = IsoSurface::new();
        surface.extract(&shown.view(), pair.isovalue);
        self.renderer.set_cells(None);
        self.renderer.set_surface(0, &Triangles::from(&surface), None)?;
        let sides = Colouring::Sides([VIRIDIS.at(0.8); 2]);
        let (lighting, edges) = (Lighting::Flat, Some(EdgeLook::default()));
        self.renderer.set_style(0, &Style { colouring: sides, lighting, edges, ..Style::default() });
        self.picture(shown, pair, 0.6, path)
    }

    /// The tetrahedra behind a plane through the middle of the domain, or of the box.
    fn mesh(&mut self, shown: &Shown, pair: &Pair, path: &Path) -> Result<()> {
        let view = shown.view();
        let bounds = pair.roi.unwrap_or_else(|| shown.view().bounds());
        let middle = (bounds.min[1] + bounds.max[1]) / 2.0;
        self.renderer.remove_surface(0);
        let low = view.field.iter().copied().fold(f64::INFINITY, f64::min);
        let high = view.field.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // The dark end of the colours would hide the edges.
        let range = [low - 0.8 * (high - low), high].map(f64::from);
        let cells = CellStyle::default();
        let style = Style { colouring: Colouring::Scale(ColourScale::new(VIRIDIS, range)?), ..cells.style };
        let cut = ClipPlane { normal: [0.0, -1.0, 0.0], offset: -middle };
        self.renderer.set_cells(Some(&CellStyle { style, cut, ..cells }));
        self.renderer.update_mesh(&view, None)?;
        self.picture(shown, pair, 0.97, path)
    }

    fn picture(&mut self, shown: &Shown, pair: &Pair, zoom: f64, path: &Path) -> Result<()> {
        let line = |bounds, colour, width| BoxLines { bounds, colour, width, handles: false };
        let domain = shown.view().bounds();
        let mut boxes = vec![line(domain, [0.45, 0.48, 0.52, 1.0], 1.0)];
        boxes.extend(pair.roi.map(|roi| line(roi, [0.85, 0.2, 0.1, 1.0], 2.0)));
        self.renderer.set_boxes(&boxes)?;
        let mut camera = Camera::home(&domain, self.renderer.aspect());
        camera.zoom(zoom);
        let look = Look { sky: PAPER, ground: PAPER, pixel_ratio: 0.6, ..Look::default() };
        let pixels = wait(self.renderer.picture(&camera, &look, 8))?;
        save(&pixels, self.renderer.size(), path).with_context(|| path.display().to_string())
    }
}

/// Writes a picture without its opacity, which is full everywhere.
fn save(rgba: &[u8], [width, height]: [u32; 2], path: &Path) -> Result<()> {
    let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&rgb)?;
    Ok(writer.finish()?)
}
