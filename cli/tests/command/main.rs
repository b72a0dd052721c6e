//! Promises of the command `tetralod`: one module for each group of subcommands.

mod commands;
#[path = "../../../tests/support/data.rs"]
mod data;
mod deform;
#[path = "../../../tests/support/exodus.rs"]
mod exodus;
mod fields;
mod gallery;
mod generate;
mod html;
#[cfg(unix)]
mod in_situ;
mod linking;
mod npz;
mod parts;
mod readme;
mod remote;
mod render;
mod repair;
mod serve;
mod shards;
mod support;
mod surfaces;
mod view;
mod work;
mod zarr;
