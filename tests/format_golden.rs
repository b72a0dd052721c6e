//! Promise: version 1 of the format does not change. The worked example of the specification is what is written,
//! byte for byte, and it is read back.

mod format_support;

use format_support::{decode, field};
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Lattice;
use tetralod::mt::{BaseMesh, EdgeMt, ErrorCode, MtInfo, MtKind, VertexId, VertexSplit};

const SPEC: &str = include_str!("../src/format/SPEC.md");

/// The example: one tetrahedron, one field of 8 bits, one update.
fn example() -> EdgeMt {
    let info = MtInfo {
        kind: MtKind::Edge,
        lattice: Lattice { origin: [0.0; 3], step: [0.5; 3], bits: 4 },
        fields: vec![field("p", 8)],
        vertices: 5,
        tetrahedra: 2,
        updates: 1,
        displacement_per_error: 2.0,
    };
    let base = BaseMesh {
        positions: vec![[1, 0, 0], [9, 0, 0], [0, 8, 0], [0, 0, 8]],
        values: vec![10, 20, 30, 200],
        tets: vec![[0, 1, 2, 3]],
    };
    let mut mt = EdgeMt::new(info, base);
    let split = VertexSplit {
        vertex: VertexId(0),
        offset: [2, 0, -1],
        field_offsets: &[-3],
        mask: 1,
        error: ErrorCode(300),
    };
    mt.push(&split).expect("the example is an MT");
    mt
}

fn options() -> EncodeOptions {
    EncodeOptions { metadata: [("tool".to_owned(), "hand".to_owned())].into() }
}

/// The bytes in the last code block of the specification; what follows two slashes is a remark.
fn golden() -> Vec<u8> {
    let block = SPEC.rsplit("```text\n").next().expect("rsplit gives something");
    let block = block.split("```").next().expect("split gives something");
    let digits = block.lines().flat_map(|line| line.split("//").next().unwrap_or("").split_whitespace());
    digits.map(|d| u8::from_str_radix(d, 16).expect("two hexadecimal digits")).collect()
}

#[test]
fn the_example_is_written_as_specified() {
    let bytes = encode(&example(), &options()).expect("the example is complete");
    let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02X} ")).collect::<String>();
    assert_eq!(hex(&bytes), hex(&golden()));
}

#[test]
fn the_example_is_read_as_specified() {
    assert_eq!(decode(&golden()), Ok(example()));
}
