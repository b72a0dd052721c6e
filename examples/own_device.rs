//! Draws a volume with the wgpu device of another program, into a texture of that program, as a viewer on egui, bevy or winit
//! does: it shows the texture as an image, or gives the view of its window's next frame.
//!
//! `cargo run --release --example own_device --features vulkan [FILE.mt]` draws an MT file; without a name, a volume that is made
//! here. It writes `own_device.ppm`.

use std::error::Error;
use std::fs::{File, read};
use std::io::Write;
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Camera;
use tetralod::mesh::{Field, Grid, TetMesh};
use tetralod::mt::MtKind;
use tetralod::refine::{Need, Request};
use tetralod::session::Session;
use tetralod_build::{BuildConfig, build};
use tetralod_render::SceneRenderer;
use tetralod_render::gpu::{Context, Renderer, wait, wgpu};
use tetralod_render::scene::{IsosurfaceState, SceneState, VolumeState};

const SIZE: [u32; 2] = [640, 480];
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// What every program on wgpu has.
struct Program {
    adapter: wgpu::Adapter,
    device: wgpu::Device,
    queue: wgpu::Queue,
    texture: wgpu::Texture,
}

impl Program {
    async fn start() -> Result<Self, Box<dyn Error>> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = instance.request_adapter(&wgpu::RequestAdapterOptions::default()).await?;
        // Meshes are large: ask for the limits that the adapter has, not for the least ones.
        let limits = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
        let (device, queue) = adapter.request_device(&descriptor).await?;
        let [width, height] = SIZE;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("the program's own"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Self { adapter, device, queue, texture })
    }

    /// The picture, as red, green, blue and opacity of each pixel.
    fn pixels(&self) -> Result<Vec<u8>, Box<dyn Error>> {
        let [width, height] = SIZE;
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * width * height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(self.texture.as_image_copy(), target, self.texture.size());
        self.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(buffer.get_mapped_range(..)?.to_vec())
    }
}

/// An MT file of the distance from the middle of a cube.
fn distances() -> Result<Vec<u8>, Box<dyn Error>> {
    let grid = Grid { dims: [25; 3], origin: [-1.0; 3], spacing: [1.0 / 12.0; 3] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let values = mesh.positions.iter().map(|p| p.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
    mesh.fields.push(Field::new("distance", values));
    let built = build(&mesh, &BuildConfig::of(MtKind::HalfEdge))?;
    Ok(encode(&built.mt, &EncodeOptions::default())?)
}

fn draw(program: &Program, file: &[u8]) -> Result<Vec<u8>, Box<dyn Error>> {
    // The mesh, as finely as it is wanted.
    let mut session = Session::new();
    session.feed(file)?;
    session.refine(&Request::from(Need::within(0.01)).at_most(200_000))?;

    // A renderer on the program's device: handles of wgpu are cheap to copy.
    let context = Context::of(program.adapter.clone(), program.device.clone(), program.queue.clone());
    let renderer = Renderer::with_device(context, SIZE, FORMAT)?;
    let mut scene = SceneRenderer::new(renderer);
    scene.set_state(SceneState {
        isosurfaces: vec![IsosurfaceState::default()],
        volume: Some(VolumeState::default()),
        ..SceneState::default()
    })?;
    scene.update(&mut session)?;

    // Each frame: a view of the program's texture, and the camera.
    let bounds = session.view().bounds();
    let camera = Camera::home(&bounds, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    let view = program.texture.create_view(&wgpu::TextureViewDescriptor::default());
    loop {
        scene.render(&view, &mut session, &camera)?;
        let pixels = program.pixels()?;
        // A picture of a new scene may lack room for all that is transparent: the next one has it.
        if !scene.renderer_mut().is_short() {
            return Ok(pixels);
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = match std::env::args_os().nth(1) {
        Some(path) => read(path)?,
        None => distances()?,
    };
    let program = wait(Program::start())?;
    let pixels = draw(&program, &file)?;
    let [width, height] = SIZE;
    let mut out = File::create("own_device.ppm")?;
    writeln!(out, "P6 {width} {height} 255")?;
    out.write_all(&pixels.as_chunks().0.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect::<Vec<_>>())?;
    println!("own_device.ppm: {width} x {height} pixels");
    Ok(())
}

/// The ball of the middle value in the middle of the picture, around it larger values, which are yellow; the background in
/// the corners.
#[test]
fn the_programs_texture_shows_the_volume() {
    let program = wait(Program::start()).expect("a Vulkan adapter");
    let pixels = draw(&program, &distances().expect("a volume")).expect("a picture");
    let at = |x: usize, y: usize| &pixels[4 * (y * SIZE[0] as usize + x)..][..4];
    let (middle, corner) = (at(320, 240), at(3, 3));
    assert!(middle != corner && middle[3] == 255 && corner[3] == 255, "{middle:?} {corner:?}");
    let seen = pixels.chunks_exact(4).filter(|p| p[0] > p[2]).count();
    assert!(seen > 3000, "{seen} yellow pixels");
}
