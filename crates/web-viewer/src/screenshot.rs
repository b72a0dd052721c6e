//! Pictures of any size, drawn on a canvas of their own beside the one of the page.

use crate::Viewer;
use tetralod_web_options::error::WebError;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
impl Viewer {
    /// Makes `canvas` the place of a picture of its size.
    #[wasm_bindgen(js_name = beginScreenshot)]
    pub fn begin_screenshot(&mut self, canvas: web_sys::OffscreenCanvas) -> Result<(), WebError> {
        let size = [canvas.width(), canvas.height()];
        let most = self.scene.renderer().largest_picture();
        if size.into_iter().any(|length| length > most) {
            let problem = format!("must be at most {most} on this GPU, and `height` as well");
            return Err(WebError::bad_option("width", &problem));
        }
        self.screenshot = Some(self.scene.renderer_mut().side(canvas)?);
        Ok(())
    }

    /// Draws what is shown there, as the mean of so many pictures. The canvas keeps it until the task ends that has called this.
    #[wasm_bindgen(js_name = drawScreenshot)]
    pub fn draw_screenshot(&mut self, samples: u32) -> Result<(), WebError> {
        let Some(target) = &mut self.screenshot else { return Err(WebError::not_ready()) };
        let session = &mut self.file.session;
        self.scene.update(session)?;
        let camera = &self.camera;
        self.scene
            .draw_with(session, camera, |device, look| device.draw_side(target, camera, look, samples))?;
        self.is_stale = true;
        Ok(())
    }

    /// Whether something is missing in that picture for lack of memory that there is: then it must be drawn again. Known when the GPU
    /// has finished it.
    #[wasm_bindgen(js_name = isScreenshotShort)]
    pub fn is_screenshot_short(&mut self) -> bool {
        self.screenshot.as_mut().is_some_and(|target| self.scene.renderer_mut().is_side_short(target))
    }

    /// Frees what that picture has taken.
    #[wasm_bindgen(js_name = endScreenshot)]
    pub fn end_screenshot(&mut self) {
        self.screenshot = None;
    }
}
