//! A scene and what draws it.

use crate::draw::{Edit, Look};
use crate::gpu::webgl::{GlContext, WebGl};
use crate::gpu::{GpuError, Renderer, TextureView};
use crate::scene::{Legend, OtherMesh, Scene, SceneError, SceneState, Update};
use tetralod::Coded;
use tetralod::geom::{Bounds, Camera, Ray};
use tetralod::session::{Deformation, Session};
use tetralod::view::{MeshView, Place};
use thiserror::Error;

/// Shows a session's mesh: a [`Scene`] says what is to be drawn of it, a [`Renderer`] draws that.
#[derive(Debug)]
pub struct SceneRenderer<R: ?Sized = Renderer> {
    scene: Scene,
    renderer: Box<R>,
}

/// What draws what a scene lists: a [`Renderer`], or another one that does what it does.
#[doc(hidden)]
pub trait Draw {
    /// As [`Renderer::apply`].
    fn apply(&mut self, edits: &[Edit<'_>]) -> Result<(), GpuError>;
    /// As [`Renderer::set_eye`].
    fn set_eye(&mut self, mesh: &MeshView<'_>, place: Option<&Place>);
    /// As [`Renderer::triangles`].
    fn triangles(&self) -> usize;
    /// As [`Renderer::draw`].
    fn draw(&mut self, camera: &Camera, look: &Look) -> Result<bool, GpuError>;
    /// As [`Renderer::draw_again`].
    fn draw_again(&mut self) -> Result<bool, GpuError>;
}

impl Draw for Renderer {
    fn apply(&mut self, edits: &[Edit<'_>]) -> Result<(), GpuError> {
        self.apply(edits)
    }

    fn set_eye(&mut self, mesh: &MeshView<'_>, place: Option<&Place>) {
        self.set_eye(mesh, place);
    }

    fn triangles(&self) -> usize {
        self.triangles()
    }

    fn draw(&mut self, camera: &Camera, look: &Look) -> Result<bool, GpuError> {
        self.draw(camera, look)
    }

    fn draw_again(&mut self) -> Result<bool, GpuError> {
        self.draw_again()
    }
}

impl<C: GlContext> Draw for WebGl<C> {
    fn apply(&mut self, edits: &[Edit<'_>]) -> Result<(), GpuError> {
        self.apply(edits)
    }

    fn set_eye(&mut self, _: &MeshView<'_>, _: Option<&Place>) {}

    fn triangles(&self) -> usize {
        self.triangles()
    }

    fn draw(&mut self, camera: &Camera, look: &Look) -> Result<bool, GpuError> {
        Ok(self.draw(camera, look))
    }

    fn draw_again(&mut self) -> Result<bool, GpuError> {
        Ok(self.draw_again())
    }
}

/// Why something is not shown, or not all of it.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum ShowError {
    /// It cannot be listed.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The GPU cannot draw it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl Coded for ShowError {
    fn code(&self) -> &'static str {
        match self {
            Self::Scene(error) => error.code(),
            Self::Gpu(error) => error.code(),
        }
    }
}

impl SceneRenderer {
    /// An empty scene that `renderer` draws.
    pub fn new(renderer: Renderer) -> Self {
        Self::of(Box::new(renderer))
    }

    /// Draws a picture into a view of a texture, as [`Renderer::render`] does.
    ///
    /// # Errors
    /// As [`SceneRenderer::draw`].
    pub fn render(
        &mut self,
        view: &TextureView,
        session: &mut Session,
        camera: &Camera,
    ) -> Result<(), GpuError> {
        self.place_eye(session, camera);
        self.renderer.render(view, camera, self.scene.look())
    }

    /// Draws a picture that is the mean of `samples` and reads it back, as [`Renderer::picture_with`] does.
    ///
    /// # Errors
    /// If the target is no image, or the device is lost or refused something.
    pub async fn picture(
        &mut self,
        session: &mut Session,
        camera: &Camera,
        samples: u32,
        drawn: impl FnMut(u32),
    ) -> Result<Vec<u8>, GpuError> {
        self.place_eye(session, camera);
        self.renderer.picture_with(camera, self.scene.look(), samples, drawn).await
    }
}

impl<R: Draw + ?Sized> SceneRenderer<R> {
    /// An empty scene that `renderer` draws.
    #[doc(hidden)]
    pub fn of(renderer: Box<R>) -> Self {
        Self { scene: Scene::default(), renderer }
    }

    /// Draws with another renderer, as when the device of the one before is lost. All is computed and uploaded
    /// again.
    pub fn set_renderer(&mut self, renderer: impl Into<Box<R>>) {
        self.renderer = renderer.into();
        self.scene.start_over();
    }

    /// The renderer.
    pub fn renderer(&self) -> &R {
        &self.renderer
    }

    /// The renderer, to resize it for example.
    pub fn renderer_mut(&mut self) -> &mut R {
        &mut self.renderer
    }

    /// As [`Scene::keep`].
    ///
    /// # Errors
    /// If nothing has arrived yet.
    pub fn keep(&mut self, session: &mut Session) -> Result<(), ShowError> {
        let edit = self.scene.keep(session)?;
        Ok(self.renderer.apply(&[edit])?)
    }

    /// As [`Scene::keep_other`].
    ///
    /// # Errors
    /// If nothing has arrived yet, or if the mesh is none.
    #[doc(hidden)]
    pub fn keep_other(&mut self, session: &Session, other: OtherMesh) -> Result<(), ShowError> {
        let edit = self.scene.keep_other(session, other)?;
        Ok(self.renderer.apply(&[edit])?)
    }

    /// As [`Scene::forget`].
    ///
    /// # Errors
    /// If the device refuses it.
    pub fn forget(&mut self) -> Result<(), GpuError> {
        self.renderer.apply(&[self.scene.forget()])
    }

    /// What is shown.
    pub fn state(&self) -> &SceneState {
        self.scene.state()
    }

    /// As [`Scene::set_state`].
    ///
    /// # Errors
    /// If a part of it makes no sense whatever the volume is; then nothing changes.
    pub fn set_state(&mut self, state: SceneState) -> Result<(), SceneError> {
        self.scene.set_state(state)
    }

    /// As [`Scene::set_pixel_ratio`].
    pub fn set_pixel_ratio(&mut self, ratio: f32) {
        self.scene.set_pixel_ratio(ratio);
    }

    /// As [`Scene::shown_regions`].
    ///
    /// # Errors
    /// If there is no such region.
    pub fn shown_regions(&self, session: &Session) -> Result<Option<Vec<u16>>, SceneError> {
        self.scene.shown_regions(session)
    }

    /// As [`Scene::bounds`].
    pub fn bounds(&self) -> Option<&Bounds> {
        self.scene.bounds()
    }

    /// As [`Scene::shown_bounds`].
    pub fn shown_bounds(&self, session: &Session) -> Option<Bounds> {
        self.scene.shown_bounds(session)
    }

    /// As [`Scene::deformation`].
    pub fn deformation(&self) -> Option<&Deformation> {
        self.scene.deformation()
    }

    /// As [`Scene::shown`].
    pub fn shown(&self, session: &mut Session, point: [f64; 3]) -> Option<[f64; 3]> {
        self.scene.shown(session, point)
    }

    /// As [`Scene::legend`].
    pub fn legend(&self) -> Option<&Legend> {
        self.scene.legend()
    }

    /// As [`Scene::meet`].
    pub fn meet(&mut self, session: &mut Session) -> bool {
        self.scene.meet(session)
    }

    /// As [`Scene::pick`].
    pub fn pick(&self, session: &mut Session, ray: &Ray) -> Option<[f64; 3]> {
        self.scene.pick(session, ray)
    }

    /// Triangles of all surfaces that are drawn.
    pub fn triangles(&self) -> usize {
        self.renderer.triangles()
    }

    /// Brings what is shown up to date with the session's mesh; whether anything has changed, so that a new picture is due.
    ///
    /// # Errors
    /// If the state names what the volume does not have, or it does not fit on the GPU; what fits is shown.
    pub fn update(&mut self, session: &mut Session) -> Result<bool, ShowError> {
        let Update { edits, changed } = self.scene.update(session);
        if let Err(error) = self.renderer.apply(&edits) {
            self.scene.lose_surfaces();
            return Err(error.into());
        }
        Ok(changed?)
    }

    /// Draws a picture; `false` when the target is not available, such as a hidden canvas.
    ///
    /// # Errors
    /// If the device is lost or refused something.
    pub fn draw(&mut self, session: &mut Session, camera: &Camera) -> Result<bool, GpuError> {
        self.place_eye(session, camera);
        self.renderer.draw(camera, self.scene.look())
    }

    /// Lets `draw` draw what is shown, with the renderer and the look of the scene.
    #[doc(hidden)]
    pub fn draw_with<T>(
        &mut self,
        session: &mut Session,
        camera: &Camera,
        draw: impl FnOnce(&mut R, &Look) -> T,
    ) -> T {
        self.place_eye(session, camera);
        draw(&mut self.renderer, self.scene.look())
    }

    /// Draws the last picture again, for a smoother mean of several: see [`Renderer::draw_again`].
    ///
    /// # Errors
    /// As [`SceneRenderer::draw`].
    pub fn draw_again(&mut self) -> Result<bool, GpuError> {
        self.renderer.draw_again()
    }

    /// Tells the renderer in which tetrahedron the eye is.
    fn place_eye(&mut self, session: &mut Session, camera: &Camera) {
        if let Some((mesh, place)) = self.scene.eye(session, camera) {
            self.renderer.set_eye(&mesh, place.as_ref());
        }
    }
}
