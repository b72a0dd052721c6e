//! **tetralod** brings very large tetrahedral volumes into a web page.
//!
//! A tetrahedral mesh with scalar fields becomes, once and offline, a 3D *Multi-Tessellation* (MT): a coarse
//! base mesh plus a partially ordered set of local updates. A consumer streams it and extracts, at any moment,
//! the mesh that a request needs: within an error, inside a region, around an isovalue, under a budget.
//! The model and the terms follow Danovaro, De Floriani, Magillo, Puppo, *Data Structures for 3D
//! Multi-Tessellations: an Overview* (2003); `[§n]` in these docs points into that paper.
//!
//! # From a mesh to a surface
#![cfg_attr(feature = "build", doc = "```")]
#![cfg_attr(not(feature = "build"), doc = "```ignore")]
//! use std::ops::ControlFlow;
//! use tetralod::build::{BuildConfig, build};
//! use tetralod::format::{EncodeOptions, encode};
//! use tetralod::refine::Request;
//! use tetralod::session::Session;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A mesh: here made by formula; `tetralod::io::read` takes one from a file. Files are rarely flawless.
//! let mesh = tetralod::generate::bucky(17)?;
//! let (mesh, repaired) = tetralod::mesh::repair(mesh)?;
//! assert!(repaired.is_empty());
//!
//! // Once, offline: its MT, and the bytes of the MT file.
//! let built = build(&mesh, &BuildConfig::default(), &mut |_| ControlFlow::Continue(()))?;
//! let bytes = encode(&built.mt, &EncodeOptions::default())?;
//!
//! // Wherever it is wanted: bytes go in, in pieces of any size, and the first meshes come out before the last byte.
//! let mut session = Session::new();
//! let (first, rest) = bytes.split_at(bytes.len() / 2);
//! session.feed(first)?;
//! let early = session.refine(&Request::within(0.01))?;
//! session.feed(rest)?;
//! session.finish()?;
//!
//! // Within 1 % of the field's range at every vertex of the reference mesh.
//! let stats = session.refine(&Request::within(0.01))?;
//! assert!(stats.satisfied && stats.error_bound <= 0.01);
//! assert!(early.tetrahedra < stats.tetrahedra && stats.tetrahedra < built.summary.tetrahedra);
//!
//! // Arrays: positions, one field value per vertex, tetrahedra and their neighbours; and the isosurface at 0.5.
//! assert_eq!(session.view().tets.len() as u32, stats.tetrahedra);
//! let surface = session.isosurface(0.5)?;
//! assert_eq!(surface.positions.len(), surface.normals.len());
//! assert!(!surface.indices.is_empty());
//! # Ok(())
//! # }
//! ```
//!
//! # Features
//!
//! The core (decoder, refinement, isosurfaces on the CPU) is always there and needs no I/O, no GPU and no JavaScript:
//! `default-features = false` is enough for a program that shows MT files. The features open its edges:
//!
//! | feature | adds | for |
//! |---|---|---|
//! | `build` | modules `io`, `generate`, `build`, `measure`, `verify` | making MTs, natively or in wasm |
//! | `cli` (default) | `build` and the command `tetralod` | the command line |
//! | `serve` (default) | its subcommand `serve` | files for pages on your own machine |
//! | `http` (default) | `stream::HttpSource` | MT files on servers, in native programs and on the command line |
//! | `gpu` | module `gpu`: the renderer on wgpu, with WebGPU as its only backend | pages; add a backend of wgpu for native use |
//! | `vulkan` | `gpu` with wgpu's Vulkan backend | testing the renderer without a browser |
//! | `web` | module `web`: the JavaScript API, with `gpu` also the viewer | `wasm32-unknown-unknown` |
//!
//! # Modules
//!
//! Bytes become an MT in [`format`](mod@format), requests become a mesh in [`refine`], slices of the mesh become
//! surfaces in [`view`]; [`session`] holds the three together and is what most programs want. [`mt`] is the structure
//! itself, [`mesh`] and [`geom`] are what it rests on, [`bench`](mod@bench) times it; [`stream`] brings byte ranges of files
//! that are elsewhere, and [`client`] a session those that it needs. `ARCHITECTURE.md` has the graph;
//! [`format`](mod@format) shows the specification of the file.
//!
//! # What holds
//!
//! - Every mesh that comes out is a valid conforming mesh: positive tetrahedra, faces shared by at most two, complete
//!   adjacency.
//! - [`RefineStats::error_bound`](refine::RefineStats::error_bound) bounds the error at every vertex of the reference
//!   mesh in the selected part. What the lattices round off ([`MtInfo::floor`](mt::MtInfo::floor)) is part of it.
//! - The same file and request give the same mesh on every platform, whatever was asked for before; the same input
//!   gives the same file.
//! - No bytes cause a panic, an endless loop or an MT beyond [`Limits`](format::Limits): decoders return typed errors,
//!   and what was decoded before stays usable.
//!
//! # Glossary
//!
//! | term | meaning |
//! |---|---|
//! | *lattice* | integer coordinates for positions, and integer *levels* for fields, on which all meshes of an MT live |
//! | *reference mesh* | the input mesh on the lattice: all updates applied |
//! | *base mesh* | the coarsest mesh: no update applied |
//! | *update*, *node* `u` | one local change: `refine` is `u+`, `coarsen` is `u−` |
//! | *parents*, *children* | `u` depends on its parents: `u+` removes a tetrahedron that a parent's `p+` created |
//! | *consistent set* `S` | a set of updates that holds every parent of its members |
//! | *current mesh* `Σ_S` | the base mesh with the updates of `S` applied |
//! | *star* of a vertex | the tetrahedra around it; its *link* is their opposite faces |
//! | *error* | largest deviation from the input's fields at the vertices of the reference mesh, as a fraction of each field's range; where the boundary has moved, its displacement counts as an error, too ([`MtInfo::displacement_per_error`](mt::MtInfo::displacement_per_error)) |
//! | *ROI* | region of interest: the box that a request selects |
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
pub mod client;
pub mod format;
#[cfg(feature = "build")]
pub mod generate;
pub mod geom;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(feature = "build")]
pub mod io;
#[cfg(feature = "build")]
pub mod measure;
pub mod mesh;
pub mod mt;
pub mod refine;
pub mod remote;
pub mod session;
pub mod stream;
#[cfg(feature = "build")]
pub mod verify;
pub mod view;
#[cfg(feature = "web")]
pub mod web;

/// The Rust code of README.md, as a test.
#[cfg(all(doctest, feature = "build"))]
#[doc = include_str!("../README.md")]
struct Readme;
