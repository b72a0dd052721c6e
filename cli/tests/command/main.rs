//! Promises of the command `tetralod`: one module for each group of subcommands.

mod commands;
#[cfg(feature = "render")]
#[path = "../../../tests/support/data.rs"]
mod data;
mod fields;
#[cfg(feature = "render")]
mod gallery;
mod generate;
mod linking;
mod npz;
mod parts;
mod readme;
mod remote;
#[cfg(feature = "render")]
mod render;
mod repair;
mod serve;
mod support;
mod surfaces;
