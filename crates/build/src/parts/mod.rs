//! Building in parts: of volumes that one machine cannot hold at once, or on many machines.
//!
//! The domain is parted in space ([`part`]). Each part is built on its own ([`build_part`]): vertices that it shares with others stay,
//! so what is left of it still fits them. Eight parts at a time are joined ([`join`]): what was between them is simplified then, and
//! what is left joins the next seven, as in an octree; but the last eight are joined in two steps, for at the end most is left. In the end one MT is made of all updates (`assemble`), which does not know
//! of the parts. (Danovaro, De Floriani, Magillo, Puppo 2003 name this as future work [§7].)
//!
//! Each step reads and writes plain bytes, its result depends on nothing else, and takes memory for what is left of a part. The error
//! of each update is measured at all reference vertices that it covers, exactly as in a whole: they travel with what is left.
//!
//! How tetrahedra are cut: into halves of halves, each across its longest side, by how many there are on both sides. A tetrahedron is
//! where its lowest corner is. Parts are numbered by which side of each cut they are on, so those that are joined follow one another.
//!
//! ```text
//!     one cut                   a cut in each half          four parts
//!     +-----------------+       +---------+-------+         +---------+-------+
//!     |         :       |       |         |   :   |         |    1    |   |   |
//!     |         :       |       |. . . . .|   :   |         +---------+ 2 | 3 |
//!     |         :       |       |         |   :   |         |    0    |   |   |
//!     +-----------------+       +---------+-------+         +---------+---+---+
//! ```
//!
//! A face behind which there is another part is neither inner, for its neighbour is not here, nor of the boundary, for there is one: in
//! the mesh that a step works on, its neighbour is `ELSEWHERE`. Its corners are open: other parts have them, too, and they stay.
//!
//! ```text
//!         part 0        part 1
//!     N +-----o E   E o-----+ N         N  no tetrahedron: the boundary of the domain
//!       | \   |       |   / |           E  the same face in both parts, each sees the other ELSEWHERE
//!       |   \ |       | /   |           o  an open vertex, which both have and neither removes
//!     N +-----o E   E o-----+ N
//! ```
//!
//! How parts are joined: open vertices that nobody outside has become ordinary ones, and faces between these parts become inner ones again.
//! So what stayed at them is simplified now, and nothing stays in the end.
//!
//! ```text
//!     +---+---+---+---+         +-------+-------+         +---------------+
//!     |   |   |   |   |         |       |       |         |               |
//!     +---+---+---+---+   ->    |       |       |   ->    |               |
//!     |   |   |   |   |         |       |       |         |               |
//!     +---+---+---+---+         +-------+-------+         +---------------+
//!     level 0: eight parts      level 1: two nodes        level 2: the whole
//!     (four make one of the last eight, eight make one before)
//! ```
//!
//! What must hold:
//! - The tetrahedra of all nodes of a level together are a conforming mesh of the domain: two nodes that meet have the same faces there.
//! - An update depends on none but updates of its own node and of the nodes that it is joined into. What these remove is removed later,
//!   and inserted earlier: the order of levels from the last to the first extends the partial order.
//! - All reference vertices are in the buckets of tetrahedra of their node, so errors are those of a whole.
//! - The parts follow from the mesh and the configuration, and not from how the mesh comes: in memory, as a grid alone, in pieces.
//!
//! ```
//! use std::ops::ControlFlow;
//! use tetralod_build::BuildConfig;
//! use std::io::Cursor;
//! use tetralod_build::parts::{self, InMemory, Node, Part, PartUpdates};
//!
//! let mesh = tetralod_io::generate::bucky(9)?;
//! let mut parted = Vec::new();
//! let plan = parts::part(&mesh, &BuildConfig::default(), 2, Default::default(), &mut |part| {
//!     parted.push(part);
//!     Ok(())
//! })?;
//! assert_eq!(plan.levels(), [2, 1]);
//! let scratch = InMemory::default();
//! let mut go_on = |_| ControlFlow::Continue(());
//! let mut files = Vec::new();
//! for part in parted {
//!     let (left, updates) = parts::build_part(part, &scratch, &mut go_on)?;
//!     let mut file = Vec::new();
//!     left.write_built(&updates, &mut file)?;
//!     files.push((left.node(), file));
//! }
//! let of_parts = files.iter().map(|(_, file)| Part::read(&mut Cursor::new(file), &scratch));
//! let of_parts = of_parts.collect::<Result<_, _>>()?;
//! let (left, updates) = parts::join(Node { level: 1, index: 0 }, of_parts, &scratch, &mut go_on)?;
//! let mut file = Vec::new();
//! left.write_built(&updates, &mut file)?;
//! files.push((left.node(), file));
//! let of = |node| Cursor::new(&files.iter().find(|(of, _)| *of == node).unwrap().1);
//! let left = |node| Part::read_mesh(&mut of(node));
//! let built = parts::assemble(&plan, &left, &|node| PartUpdates::read(&mut of(node)), &mut go_on)?;
//! assert_eq!(built.summary.tetrahedra, 6 * 8 * 8 * 8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assemble;
mod children;
mod cut;
mod exact_values;
mod fragments;
mod grid;
mod node;
mod numbering;
mod partition;
mod piece;
mod piecewise;
mod plan;
mod points_frame;
mod prepared;
mod wire;

pub use assemble::assemble;
#[doc(hidden)]
pub use assemble::{Assembled, assemble_blocks};
#[doc(hidden)]
pub use grid::{GridValues, PointBox, part_grid};
pub(super) use node::left_at_interface;
pub use node::{build_part, join};
pub use partition::part;
pub use piece::{Part, PartUpdates};
pub use piecewise::Piecewise;
pub(super) use plan::levels;
pub use plan::{MOST_PARTS, Node, Plan};

#[doc(hidden)]
pub use crate::scratch::InMemory;
pub use crate::scratch::Scratch;

use crate::BuildError;
use std::io;
use thiserror::Error;

/// Why a step of building in parts failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PartsError {
    /// The mesh cannot be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// No such number of parts.
    #[error("{parts} parts: give a power of two from 1 to {MOST_PARTS}")]
    Count {
        /// How many were asked for.
        parts: u32,
    },
    /// The mesh cannot be parted so often.
    #[error("{tetrahedra} tetrahedra cannot be cut into {parts} parts; ask for fewer")]
    TooMany {
        /// How many were asked for.
        parts: u32,
        /// The tetrahedra of the mesh.
        tetrahedra: u64,
    },
    /// Only half-edge MTs are built in parts.
    #[error("only MTs of kind half-edge are built in parts")]
    Kind,
    /// Pieces cannot be parted one by one.
    #[error("pieces of this mesh cannot be parted one by one ({why}); read it as a whole")]
    NeedsWhole {
        /// Why.
        why: &'static str,
    },
    /// A point belongs to no tetrahedron.
    #[error("point {point} belongs to no tetrahedron; repair the mesh first")]
    UnusedPoint {
        /// The point.
        point: u32,
    },
    /// The plan has no such part.
    #[error("the plan has no part {index} at level {level}")]
    NoNode {
        /// Its level.
        level: u32,
        /// Its number there.
        index: u32,
    },
    /// Other parts were given than the step needs.
    #[error("to join part {index} of level {level} takes parts {} to {} of the level below, in this order", .children[0], .children[1])]
    Children {
        /// The level of the result.
        level: u32,
        /// Its number there.
        index: u32,
        /// The first and the last that it takes.
        children: [u32; 2],
    },
    /// What is joined was parted by different plans.
    #[error("the parts come from different plans; make all of them again from one plan")]
    OtherPlan,
    /// The bytes are no part, or not one of this version.
    #[error("this is no part that this version of tetralod has written; write it again")]
    Format,
    /// The bytes are damaged.
    #[error("the part is damaged ({what}); make it again")]
    Damaged {
        /// What is wrong.
        what: &'static str,
    },
    /// Reading or writing failed.
    #[error("a part could not be read or written")]
    Io(#[from] io::Error),
    /// The caller could not take or give a part.
    #[error(transparent)]
    Other(Box<dyn std::error::Error + Send + Sync>),
}

impl PartsError {
    /// An error of the caller.
    pub fn other(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Other(error.into())
    }
}
