//! Promises of the command `tetralod`: one module for each group of subcommands.

mod commands;
mod fields;
mod linking;
mod readme;
mod remote;
mod serve;
mod support;
mod surfaces;
