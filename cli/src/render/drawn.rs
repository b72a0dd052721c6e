//! What a picture is of: the options that say what is drawn of which mesh, and from where.

use super::movie::Frame;
use super::shown::{self, About, Shown};
use crate::output;
use crate::parse::{one_of, parse_numbers, parse_positive};
use crate::query::Query;
use anyhow::Result;
use std::path::PathBuf;
use tetralod::geom::{Bounds, Camera, Projection, ViewPreset};
use tetralod::mt::FieldInfo;
use tetralod::session::Session;
use tetralod_render::scene::SceneState;

/// What is drawn of which mesh, and from where.
#[derive(clap::Args)]
pub struct Drawn {
    #[command(flatten)]
    pub query: Query,
    #[command(flatten)]
    pub shown: Shown,
    #[command(flatten)]
    pub placed: Placed,
}

impl Drawn {
    /// The files that it reads.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.query.files().chain(self.shown.files())
    }

    /// The scene of a field, which `field` describes. Says what in it shows nothing.
    pub fn scene(&self, session: &mut Session, index: usize, field: &FieldInfo) -> Result<SceneState> {
        let bounds = session.view().bounds();
        let about = About { bounds, surface_first: session.surface_first(index) == Some(true), field };
        let scene = self.shown.state(&self.query, &about)?;
        let warnings = shown::warnings(&scene, &about);
        warnings.iter().for_each(|warning| output::note(&format!("warning: {warning}")));
        Ok(scene)
    }
}

/// The options that place the camera.
#[derive(clap::Args)]
#[command(next_help_heading = "Camera")]
pub struct Placed {
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

impl Placed {
    /// The camera of each picture, at one distance from what it looks at: the largest at which one of them shows all.
    pub fn cameras(&self, bounds: &Bounds, aspect: f64, frames: &[Frame]) -> Vec<Camera> {
        // What turns has its middle in the middle of all pictures.
        let fit =
            if frames.iter().any(|frame| frame.turned != 0.0) { Camera::fit_around } else { Camera::fit };
        let all = frames.iter().map(|frame| {
            let mut camera = self.camera(bounds, aspect, frame.turned);
            fit(&mut camera, bounds, aspect);
            camera
        });
        let mut cameras: Vec<Camera> = all.collect();
        let farthest = cameras.iter().map(Camera::distance).fold(0.0, f64::max);
        cameras.iter_mut().for_each(|camera| camera.zoom(farthest / camera.distance() / self.zoom));
        cameras
    }

    /// The camera of one picture.
    pub fn camera_of_one(&self, bounds: &Bounds, aspect: f64) -> Camera {
        self.cameras(bounds, aspect, &[Frame::default()]).remove(0)
    }

    /// The camera that looks in the right direction, `turned` by so many degrees around the model.
    fn camera(&self, bounds: &Bounds, aspect: f64, turned: f64) -> Camera {
        let mut camera = Camera::home(bounds, aspect);
        if self.orthographic {
            camera.set_projection(Projection::Orthographic);
        }
        camera.turn_to(self.from);
        let [yaw, pitch] = self.turn.map(f64::to_radians);
        camera.orbit(yaw + turned.to_radians(), pitch);
        camera
    }
}
