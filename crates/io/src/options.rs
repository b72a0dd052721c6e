//! What to read of a file, and how to get at those beside it.

use crate::error::ReadReason;
use crate::memory::{FileBytes, MemoryLimit};

/// What to read of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Names of the fields to keep, a vector's name for all its components; all if none. Others are not decoded, and may be
    /// anything: see [`MeshInput::other_fields`](tetralod::mesh::MeshInput::other_fields).
    pub fields: Option<Vec<String>>,
    /// Keep one field beside those that are named, and none else if none are: of those at points, or at cells where points have none, the
    /// first that does not number something or say where it is. Of a vector it is the length, of a symmetric tensor von Mises' value.
    pub first: bool,
    /// What to do with fields at cells.
    pub cells: CellData,
    /// Which step to read of a file that has several (see [`Step::number`](crate::Step::number)): the first one is 0. Others have one.
    pub step: usize,
    /// The most memory that reading may take.
    pub memory: MemoryLimit,
}

impl ReadOptions {
    /// Checks that a file with so many steps has the one that is wanted; without steps there is one.
    pub(super) fn expect_step(&self, steps: usize) -> Result<(), ReadReason> {
        let steps = steps.max(1);
        if self.step < steps {
            return Ok(());
        }
        Err(ReadReason::Missing(format!("time step {} of {steps}", self.step)))
    }
}

/// What to do with fields at cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellData {
    /// Leave them out.
    #[default]
    LeaveOut,
    /// Keep their names alone, for messages that say how to read them.
    Names,
    /// Read them: see [`TetMesh::cells_to_points`](tetralod::mesh::TetMesh::cells_to_points).
    Values,
}

/// Gets the bytes of another file, by its path from the folder of the one that is read.
pub(super) type Beside<'a> = &'a dyn Fn(&str) -> Result<FileBytes<'a>, ReadReason>;
