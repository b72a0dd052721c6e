//! The codecs of all kinds, as values that a kind is looked up in.

use super::codec::{Codec, Head, Parts};
use super::families;
use crate::format::coder::{Family, Source};
use crate::format::header::Kind;
use crate::format::{FormatError, Limits};
use crate::mt::{BaseMeshError, EdgeMt, HalfEdgeMt, MtInfo, MtKind, VertexMt};

/// The codec of a kind as far as whoever reads a file needs it.
pub struct KindCodec {
    pub kind: MtKind,
    pub number: u8,
    pub section: Kind,
    parts: Parts,
    pub has_tet_errors: bool,
    pub check_counts: fn(&MtInfo, u64) -> Result<(), BaseMeshError>,
    pub least_update_bytes: fn(&MtInfo) -> u64,
    pub read_head: ReadHead,
}

/// See [`Codec::read_head`].
type ReadHead = fn(&mut Source<'_>, &MtInfo, [u32; 2], u32, &Limits) -> Result<Box<dyn Head>, FormatError>;

impl KindCodec {
    const fn of<C: Codec>() -> Self {
        Self {
            kind: C::KIND,
            number: C::NUMBER,
            section: C::SECTION,
            parts: C::PARTS,
            has_tet_errors: C::HAS_TET_ERRORS,
            check_counts: C::check_counts,
            least_update_bytes: C::least_update_bytes,
            read_head: C::read_head,
        }
    }

    /// The families of the kind, in the order of their contexts, with names for what they code.
    pub fn parts(&self) -> Vec<(&'static str, Family)> {
        families::parts(self.parts)
    }
}

/// Of all kinds.
pub static CODECS: [KindCodec; 3] =
    [KindCodec::of::<EdgeMt>(), KindCodec::of::<VertexMt>(), KindCodec::of::<HalfEdgeMt>()];

/// The number of a kind in files. Asked for the codec, whoever writes would have what reads all kinds, too.
pub fn number_of(kind: MtKind) -> u8 {
    match kind {
        MtKind::Edge => EdgeMt::NUMBER,
        MtKind::Vertex => VertexMt::NUMBER,
        MtKind::HalfEdge => HalfEdgeMt::NUMBER,
    }
}

/// The codec of a kind.
pub fn codec_of(kind: MtKind) -> &'static KindCodec {
    let [edge, vertex, half_edge] = &CODECS;
    match kind {
        MtKind::Edge => edge,
        MtKind::Vertex => vertex,
        MtKind::HalfEdge => half_edge,
    }
}
