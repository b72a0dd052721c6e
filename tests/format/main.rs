//! Promises of MT files: read back, split, cut off, damaged, and as the specification says.

mod blocks;
mod bounds;
mod counts;
mod damaged;
mod extremes;
mod facts;
mod golden;
mod histograms;
mod paged;
mod reader;
mod reference;
mod reference_kinds;
mod regions;
mod regressions;
mod roundtrip;
mod sections;
mod split;
#[path = "../support/mod.rs"]
mod support;
mod truncated;
