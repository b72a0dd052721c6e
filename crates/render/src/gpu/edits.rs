//! Lists of what is to be drawn.

use crate::draw::Edit;
use crate::gpu::{GpuError, Renderer};

impl Renderer {
    /// Makes these edits, in order. One that fails does not keep the ones after it from being made.
    ///
    /// # Errors
    /// The first one, if something does not fit on the GPU: that is not drawn, and a surface must come whole next.
    pub fn apply(&mut self, edits: &[Edit<'_>]) -> Result<(), GpuError> {
        edits.iter().map(|edit| self.apply_one(edit)).fold(Ok(()), Result::and)
    }

    fn apply_one(&mut self, edit: &Edit<'_>) -> Result<(), GpuError> {
        match edit {
            Edit::Clear => self.clear()?,
            Edit::Points(points) => _ = self.set_points(*points),
            Edit::Values(values) => _ = self.set_values(*values),
            Edit::Boxes(boxes) => self.set_boxes(boxes)?,
            Edit::Cells(style) => self.set_cells(style.as_ref()),
            Edit::CellValues(values) => self.set_cell_values(values)?,
            Edit::Volume(medium) => {
                self.set_volume(medium.as_ref().map(|(medium, clips)| (medium, *clips)))?
            }
            Edit::Mesh(mesh, changes) => self.update_mesh(mesh, Some(*changes))?,
            Edit::Moves(moves) => self.set_moves(moves)?,
            Edit::Surface { key, triangles, changes, style } => {
                self.set_surface(*key, triangles, *changes)?;
                self.set_style(*key, style);
            }
            Edit::Remove(key) => self.remove_surface(*key),
            Edit::Beside { split, edits } => {
                self.set_split(*split);
                if *split > 0.0 {
                    self.beside()?.apply(edits)?;
                }
            }
        }
        Ok(())
    }
}
