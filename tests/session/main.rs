//! Promises of sessions and of the ranges that they are fetched by.

mod bench;
mod changes;
mod client;
mod curve;
mod deformation;
mod first_picture;
mod hostile;
mod kinds;
mod network;
mod paged;
mod parts;
mod quantity;
mod regions;
mod shards;
mod states;
#[cfg(feature = "http")]
mod stream_faults;
mod stream_loader;
#[path = "../support/mod.rs"]
mod support;
