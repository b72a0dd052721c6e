//! Promise: version 2 of the format does not change. What these small MTs are written as, byte for byte, is kept in
//! `tests/golden`, one for each kind, and is read back; files of other versions are told apart.

use crate::support::files::{assert_same, decode, field, header, small_info};
use std::fmt::Write;
use tetralod::format::{EncodeOptions, FormatError, encode};
use tetralod::mt::{
    BaseMesh, EdgeMtBuilder, ErrorCode, ExplicitMt, ExplicitUpdate, Mt, MtInfo, MtKind, MultiTessellation,
    VertexId, VertexSplit,
};

/// Two tetrahedra on one face, with one field of 8 bits; there are going to be `updates` updates.
fn start(kind: MtKind, counts: [u32; 3]) -> (MtInfo, BaseMesh) {
    let info = small_info(kind, 5, vec![field("p", 8)], counts);
    let base = BaseMesh {
        positions: vec![[0, 8, 8], [16, 8, 8], [8, 8, 20], [8, 0, 8], [8, 20, 8]],
        values: vec![10, 20, 30, 200, 40],
        tets: vec![[0, 1, 2, 3], [1, 0, 2, 4]],
    };
    (info, base)
}

/// Splits of a vertex on the edge that both tetrahedra have, and of one of its halves.
fn edge_example() -> Mt {
    let (info, base) = start(MtKind::Edge, [7, 4, 2]);
    let splits = [(0, [0, -3, -1], -3, 0b10, 300), (5, [0, 1, 0], 2, 0b01, 299)];
    let mut builder = EdgeMtBuilder::new(info, base).expect("a valid base mesh");
    for (vertex, offset, level, mask, error) in splits {
        let (vertex, errors) = (VertexId(vertex), &[ErrorCode(error)]);
        let split = VertexSplit { vertex, offset, field_offsets: &[level], mask, errors };
        builder.push(&split).expect("the example is an MT");
    }
    builder.finish().into()
}

/// The only update puts a vertex into the first tetrahedron.
fn explicit_example() -> ExplicitMt {
    let (info, base) = start(MtKind::Vertex, [6, 5, 1]);
    let mut mt = ExplicitMt::new(info, base);
    let update = ExplicitUpdate {
        positions: &[[8, 6, 11]],
        levels: &[15],
        removed: &[0],
        inserted: &[[5, 1, 2, 3], [0, 5, 2, 3], [0, 1, 5, 3], [0, 1, 2, 5]],
        errors: &[ErrorCode(300)],
    };
    mt.push(&update).expect("the example is an MT");
    mt
}

/// The same update in a vertex-based MT.
fn vertex_example() -> Mt {
    explicit_example().compact(MtKind::Vertex).expect("an insertion")
}

/// The same update in a half-edge MT: its vertex collapses onto one of the tetrahedron's.
fn half_edge_example() -> Mt {
    let mt = explicit_example().compact(MtKind::HalfEdge).expect("a half-edge insertion");
    mt.in_pages(11).expect("a complete MT")
}

fn options() -> EncodeOptions {
    let metadata = [("tool".to_owned(), "hand".to_owned())].into();
    EncodeOptions { metadata, ..EncodeOptions::default() }
}

/// Bytes from pairs of hexadecimal digits; what follows two slashes is a remark.
fn bytes_of(text: &str) -> Vec<u8> {
    let digits = text.lines().flat_map(|line| line.split("//").next().unwrap_or("").split_whitespace());
    digits.map(|d| u8::from_str_radix(d, 16).expect("two hexadecimal digits")).collect()
}

/// The inverse, 32 bytes a line.
fn text_of(bytes: &[u8]) -> String {
    let mut text = String::new();
    for line in bytes.chunks(32) {
        let digits: Vec<String> = line.iter().map(|byte| format!("{byte:02X}")).collect();
        writeln!(text, "{}", digits.join(" ")).expect("a string takes everything");
    }
    text
}

#[test]
fn the_examples_are_written_and_read_as_ever() {
    let examples = [
        (edge_example(), include_str!("../golden/edge.hex")),
        (vertex_example(), include_str!("../golden/vertex.hex")),
        (half_edge_example(), include_str!("../golden/half-edge.hex")),
    ];
    let mut changes = String::new();
    for (mt, golden) in examples {
        let golden = bytes_of(golden);
        let found = encode(&mt, &options()).expect("the example is complete");
        if found == golden {
            assert_same(&decode(&golden).expect("a good file"), &mt);
        } else {
            write!(changes, "{}:\n{}\n", mt.info().kind.name(), text_of(&found)).expect("a string");
        }
    }
    assert!(changes.is_empty(), "these are written as other bytes now:\n{changes}");
}

#[test]
fn other_versions_are_told_apart() {
    let mut bytes = bytes_of(include_str!("../golden/half-edge.hex"));
    let total = bytes.len() as u64;
    for found in [0, 1, 3] {
        bytes[..32].copy_from_slice(&header(found, 0, total));
        let error = decode(&bytes).expect_err("only version 2 is read");
        assert_eq!(error, FormatError::UnsupportedVersion { found, supported: 2 });
        let text = error.to_string();
        assert!(
            text.contains(&format!("version {found},")) && text.contains("build the file again"),
            "{text}"
        );
    }
}
