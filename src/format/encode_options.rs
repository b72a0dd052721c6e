//! What a file is to have besides the MT.

use crate::mt::Exact;
use std::collections::BTreeMap;

/// What goes into a file besides the MT.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncodeOptions {
    /// Refuse an MT whose errors do not fall along its partial order by as much as requests for values rely on, too; errors that
    /// grow are always refused. What the builders make passes.
    pub check_margins: bool,
    /// Exact values of fields at the vertices of the reference mesh.
    pub exact: Vec<Exact>,
    /// A histogram of each field over the reference mesh, some 160 bytes each, in front of the base mesh: see
    /// [`Decoder::histogram`](super::Decoder::histogram).
    pub histograms: bool,
    /// log2 of the blocks of a page of the index, in files that have one: pages come by themselves where a client needs them. More than 20 means no
    /// pages. None: pages where the index is longer than 32 KiB, as large as they must be for the list of them to be short.
    pub index_page_bits: Option<u32>,
    /// Free keys and values, kept as they are. What is here makes the bytes: leave out dates and paths.
    pub metadata: BTreeMap<String, String>,
}

impl EncodeOptions {
    /// For a file that has all that it may have.
    #[doc(hidden)]
    pub fn complete(exact: Vec<Exact>, metadata: BTreeMap<String, String>) -> Self {
        Self { check_margins: true, exact, histograms: true, index_page_bits: None, metadata }
    }
}
