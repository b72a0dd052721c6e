//! What the MT tests share: small meshes, a slow and plain builder of random MTs, and its records as the oracle.
//!
//! Nothing here uses the library's own mesh code: simple sets and maps only, so that a mistake is not made twice.
#![allow(dead_code, reason = "each test binary uses a part of it")]

pub mod builder;
pub mod compare;
pub mod conformance;
pub mod data;
pub mod domains;
pub mod files;
pub mod meshes;
pub mod network;
pub mod oracle;
pub mod random;
pub mod requests;
pub mod strategies;
pub mod surfaces;
