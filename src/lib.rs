//! **tetralod** brings very large tetrahedral volumes into a web page.
//!
//! A tetrahedral mesh with scalar fields becomes, once and offline, a 3D *Multi-Tessellation* (MT): a coarse
//! base mesh plus a partially ordered set of local updates. A consumer streams it and extracts, at any moment,
//! the mesh that a request needs: within an error, inside a region, around an isovalue, under a budget.
//! The model and the terms follow Danovaro, De Floriani, Magillo, Puppo, *Data Structures for 3D
//! Multi-Tessellations: an Overview* (2003); `[§n]` in these docs points into that paper.
//!
//! # Glossary
//!
//! | term | meaning |
//! |---|---|
//! | *reference mesh* | the input mesh on the lattice: all updates applied |
//! | *base mesh* | the coarsest mesh: no update applied |
//! | *update*, *node* `u` | one local change: `refine` is `u+`, `coarsen` is `u−` |
//! | *parents*, *children* | `u` depends on its parents: `u+` removes a tetrahedron that a parent's `p+` created |
//! | *consistent set* `S` | a set of updates that holds every parent of its members |
//! | *current mesh* `Σ_S` | the base mesh with the updates of `S` applied |
//! | *star* of a vertex | the tetrahedra around it; its *link* is their opposite faces |
//! | *error* | largest deviation from the reference field, as a fraction of the field's range |
//! | *budget* `b` | largest number of tetrahedra that the extracted mesh may have |
//!
//! # Conventions
//!
//! A tetrahedron `(a, b, c, d)` is *positive* when `(b − a) × (c − a) · (d − a) > 0` (VTK's convention); all
//! tetrahedra here are. Face `i` is opposite vertex `i`; see [`mesh::FACES`] for outward vertex orders.
#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![deny(rustdoc::broken_intra_doc_links)]

pub mod bench;
#[cfg(feature = "build")]
pub mod build;
pub mod format;
#[cfg(feature = "build")]
pub mod generate;
pub mod geom;
#[cfg(feature = "build")]
pub mod io;
#[cfg(feature = "build")]
pub mod measure;
pub mod mesh;
pub mod mt;
pub mod refine;
pub mod session;
#[cfg(feature = "build")]
pub mod verify;
pub mod view;
#[cfg(feature = "web")]
pub mod web;
