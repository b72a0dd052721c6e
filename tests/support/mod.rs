//! What the MT tests share: small meshes, a slow and plain builder of random MTs, and its records as the oracle.
//!
//! Nothing here uses the library's own mesh code: simple sets and maps only, so that a mistake is not made twice.
#![allow(dead_code, reason = "every test binary uses a part of it")]

pub mod builder;
pub mod compare;
pub mod domains;
pub mod oracle;
pub mod random;
pub mod strategies;
