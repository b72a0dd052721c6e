//! Building in parts: of volumes that one machine cannot hold at once, or on many machines.
//!
//! The domain is parted in space ([`part`]). Each part is built on its own ([`build_part`]): vertices that it shares with others stay,
//! so what is left of it still fits them. Eight parts at a time are joined ([`join`]): what was between them is simplified then, and
//! what is left joins the next seven, as in an octree. In the end one MT is made of all updates ([`assemble`]), which does not know
//! of the parts. (Danovaro, De Floriani, Magillo, Puppo 2003 name this as future work [§7].)
//!
//! Each step reads and writes plain bytes, its result depends on nothing else, and takes memory for what is left of a part. The error
//! of each update is measured at all reference vertices that it covers, exactly as in a whole: they travel with what is left.
//!
//! ```
//! use std::ops::ControlFlow;
//! use tetralod_build::BuildConfig;
//! use tetralod_build::parts::{self, Node};
//!
//! let mesh = tetralod_io::generate::bucky(9)?;
//! let mut parted = Vec::new();
//! let plan = parts::part(&mesh, &BuildConfig::default(), 2, Default::default(), &mut |part| {
//!     parted.push(part);
//!     Ok(())
//! })?;
//! assert_eq!(plan.levels(), [2, 1]);
//! let mut go_on = |_| ControlFlow::Continue(());
//! let (mut left, mut updates) = (Vec::new(), Vec::new());
//! for part in parted {
//!     let (part, of_part) = parts::build_part(part, &mut go_on)?;
//!     left.push(part);
//!     updates.push(of_part);
//! }
//! let (whole, last) = parts::join(Node { level: 1, index: 0 }, left, &mut go_on)?;
//! updates.push(last);
//! let of = |node| Ok(updates.iter().find(|of| of.node() == node).cloned().unwrap());
//! let built = parts::assemble(whole, &of, &mut go_on)?;
//! assert_eq!(built.summary.tetrahedra, 6 * 8 * 8 * 8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assemble;
mod fragments;
mod grid;
mod node;
mod partition;
mod piece;
mod piecewise;
mod plan;
mod wire;

pub use assemble::assemble;
pub(super) use node::LEFT_AT_INTERFACE;
pub use node::{build_part, join};
pub use partition::part;
pub use piece::{Part, PartUpdates};
pub use piecewise::{Piecewise, Scratch};
pub use plan::{MOST_PARTS, Node, Plan};

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
