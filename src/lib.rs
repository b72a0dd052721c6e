//! **tetralod** brings very large tetrahedral volumes into a web page. This crate is its core: from the bytes of MT files to meshes, surfaces
//! and numbers.
//!
//! A tetrahedral mesh with scalar fields becomes, once and offline, a 3D *Multi-Tessellation* (MT): a coarse
//! base mesh plus a partially ordered set of local updates. A consumer streams it and extracts, at any moment,
//! the mesh that a request needs: within an error, inside a region, around an isovalue, under a budget.
//! The model and the terms follow Danovaro, De Floriani, Magillo, Puppo, *Data Structures for 3D
//! Multi-Tessellations: an Overview* (2003); `[§n]` in these docs points into that paper.
//!
//! # From a mesh to a surface
//! ```
//! use tetralod::format::{EncodeOptions, encode};
//! use tetralod::refine::Request;
//! use tetralod::session::Session;
//! use tetralod_build::{BuildConfig, build};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A mesh: generated here; `tetralod_io::read` reads one from a file. Meshes in files often need repair.
//! let mesh = tetralod_io::generate::bucky(17)?;
//! let (mesh, repaired) = tetralod::mesh::repair(mesh)?;
//! assert!(repaired.is_empty());
//!
//! // Once, offline: its MT, and the bytes of the MT file.
//! let built = build(&mesh, &BuildConfig::default())?;
//! let bytes = encode(&built.mt, &EncodeOptions::default())?;
//!
//! // Where it is used: bytes go in, in pieces of any size, and meshes come out before the last byte has arrived.
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
//! assert!(early.tetrahedra < stats.tetrahedra && u64::from(stats.tetrahedra) < built.summary.tetrahedra);
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
//! # Crates and features
//!
//! The core (decoder, encoder, refinement, isosurfaces on the CPU) needs no I/O, no GPU and no JavaScript, and is enough for a program that shows
//! MTs. Crates of the same version add the rest:
//!
//! | crate | adds |
//! |---|---|
//! | `tetralod-build` | MTs of meshes, natively or in wasm; what measures and verifies them |
//! | `tetralod-io` | exchange formats (with its feature `hdf5` also VTKHDF and Exodus), and volumes by formula |
//! | `tetralod-render` | scenes and the renderer on wgpu: WebGPU in pages, Vulkan natively |
//! | `tetralod-bench` | a benchmark on one thread |
//! | `tetralod-cli` | the command `tetralod` |
//!
//! The JavaScript API is the npm package `tetralod`, the Python API the package `tetralod` on PyPI. This crate has two features:
//!
//! | feature | adds |
//! |---|---|
//! | `parallel` (default) | work on all cores, natively: checks of meshes and MTs, and builds |
//! | `http` | `stream::HttpSource`: MT files on servers, in native programs |
//!
//! # Modules
//!
//! Bytes become an MT in [`format`](mod@format), requests become a mesh in [`refine`], slices of the mesh become
//! surfaces in [`view`]; [`session`] holds the three together and is what most programs want. [`mt`] is the structure
//! itself, [`mesh`] and [`geom`] are what it rests on; [`stream`] brings byte ranges of files that are elsewhere, and
//! [`session::Client`] does so for native programs. `ARCHITECTURE.md` has the way of the data; [`format`](mod@format) shows the specification of the file.
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
//! Terms of the paper first:
//!
//! | term | meaning |
//! |---|---|
//! | *Multi-Tessellation*, *MT* | a base mesh, and updates of it with a partial order [§2] |
//! | *base mesh* | the coarsest mesh: no update applied |
//! | *reference mesh* | the finest mesh: all updates applied. It is the input mesh with positions and values rounded to lattices |
//! | *update*, *node* `u` | one local change: `u+` (`refine`) removes some tetrahedra and inserts others that fill the same space, `u−` (`coarsen`) undoes that |
//! | *parents*, *children*, *arc* | `u` depends on its parents: `u+` removes a tetrahedron that a parent's `p+` inserted; then `u` is a child of `p`, and there is an arc from `p` to `u` |
//! | *partial order*, *depth* | the order that the arcs make: parents before children; the length of its longest chain |
//! | *consistent set* `S` | a set of updates that contains every parent of its members |
//! | *current mesh* `Σ_S`, *extracted mesh* | the base mesh with the updates of `S` applied |
//! | *selective refinement* | finds the smallest consistent set whose mesh meets a request [§2.3], with the errors that updates have here |
//! | *uniform*, *variable* mesh | one error everywhere; an error that depends on the place or the field |
//! | *ROI*, *region of interest* | the part of the model that a request selects |
//! | *budget* `b` | the largest size that the extracted mesh may have |
//! | *star*, *link* of a vertex | the tetrahedra around it; their faces opposite the vertex, with the edges and vertices of these |
//! | *star-shaped polyhedron*, *cavity* `Π_u` | the space that a vertex insertion fills with the star of the new vertex; the tetrahedra that it removes are `T_u` |
//! | *edge collapse*, *vertex split* | an edge becomes one vertex; the reverse |
//! | *half-edge collapse* | an edge collapse that moves one vertex onto the other, which stays where it is |
//! | *vertex removal*, *vertex insertion* | a vertex goes, and its star is filled without it; the reverse |
//! | *explicit structure* | all tetrahedra, updates and arcs stored one by one [§3] |
//!
//! Terms of this crate:
//!
//! | term | meaning |
//! |---|---|
//! | *kind* of an MT | [`edge`](mt::EdgeMt): vertex splits, undone by edge collapses to midpoints [§4]; [`vertex`](mt::VertexMt): vertex insertions [§5], whose nodes are ours (those of the paper: [`VertexTreeMt`](mt::VertexTreeMt), in memory); [`half-edge`](mt::HalfEdgeMt): vertex insertions, undone by half-edge collapses, whose blocks can be used by themselves; [`explicit`](mt::ExplicitMt): updates of any kind in the explicit structure |
//! | *method*, *criterion* | how an MT is built: by collapses, decimation or insertion; which vertex goes where or comes next |
//! | *store* | what holds the updates of an MT of one kind in memory |
//! | *remover*, *creator* of a tetrahedron | the update whose `u+` removes it; the one whose `u+` inserted it |
//! | *lattice*, *bits* | the integer coordinates of positions, or values of a field, and their number of binary digits; all meshes of an MT are on them |
//! | *level* | the value of a field at a vertex as an integer on its lattice |
//! | *label* | a field of whole numbers that say what something is: each place has that of the nearest corner of its tetrahedron ([`Field::is_label`](mesh::Field::is_label)); what `--preserve` names is one, too |
//! | *quantization* | the largest loss by rounding to a lattice, measured when an MT is built; part of every bound |
//! | *error* of a tetrahedron, of an update | the largest deviation from the input's field at the vertices of the reference mesh in the tetrahedron, as a fraction of the field's range; an upper bound of that for all tetrahedra that `u+` removes, and of the errors of all updates that depend on `u` |
//! | *error code* | an error as an integer of 16 bits, rounded up ([`ErrorCode`](mt::ErrorCode)) |
//! | *own error*, *quarterings* | of a tetrahedron by itself, where an MT keeps it: at most the error of its remover, as a number of quarterings of that |
//! | *displacement* | how far the boundary has moved; it counts as an error ([`MtInfo::displacement_per_error`](mt::MtInfo::displacement_per_error)) |
//! | *bound* | what is guaranteed of a mesh: of its error ([`error_bound`](refine::RefineStats::error_bound)), of the field at inner vertices ([`field_bound`](mt::MtInfo::field_bound)), of the boundary ([`boundary_bound`](mt::MtInfo::boundary_bound)) |
//! | *request*, *need* | what the current mesh is to be: a union of needs, each a part of the model with an error, and a budget |
//! | *region* | a convex part of space in a need: a box, ball, half-space, slab, or intersection of half-spaces |
//! | *LOD criterion* | decides whether a tetrahedron *violates* a request ([`Criterion`](refine::Criterion)) |
//! | *front* | selective refinement in progress: the current mesh and what is left to do for a request ([`Front`](refine::Front)) |
//! | *forced* update | applied only because an update that a request needs depends on it |
//! | *satisfied*, *missing* | the mesh meets its request; it does not because data has not arrived |
//! | *section*, *head* | a part of a file with a kind, a length and a checksum, which are its head |
//! | *block*, *index* | consecutive updates in a file, the smallest part that is fetched; the section that says where each block is and what it contains, or of a long file its pages, each a section for some blocks |
//! | *page* | the updates of a block in memory: they are inserted and evicted together |
//! | *prefix* | the first bytes of a file; with the base mesh in it, it is an MT by itself |
//! | *residual* | a number in a file minus its prediction, which the reader makes, too |
//! | *offset*, *mask* | of a vertex split: the difference between the two new vertices; which tetrahedra of the star go to which of them |
//! | *exact values* | the input's values before rounding, at the end of a file |
//! | *session*, *client* | decoder, MT and current mesh in one ([`Session`](session::Session)); a session that fetches blocks ([`Client`](session::Client)) |
//!
//! # Conventions
//!
//! A tetrahedron `(a, b, c, d)` is *positive* when `(b − a) × (c − a) · (d − a) > 0` (VTK's convention); all
//! tetrahedra here are. Face `i` is opposite vertex `i`; see [`mesh::FACES`] for outward vertex orders.
#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![deny(rustdoc::broken_intra_doc_links)]

mod coded;
pub mod format;
pub mod geom;
pub mod mesh;
pub mod mt;
pub mod refine;
pub mod session;
pub mod stream;
#[doc(hidden)]
pub mod threads;
pub mod view;

pub use coded::Coded;

/// The Rust code of README.md and of the pages in `docs/`, as tests.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../README.md")]
    struct Readme;
    #[doc = include_str!("../docs/command.md")]
    struct CommandLine;
    #[doc = include_str!("../docs/hosting.md")]
    struct Hosting;
    #[doc = include_str!("../docs/input.md")]
    struct Input;
    #[doc = include_str!("../docs/promises.md")]
    struct Promises;
}
