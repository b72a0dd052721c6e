//! Promise: version 1 of the format does not change. The worked examples of the specification are what is written,
//! byte for byte, and they are read back.

mod format_support;

use format_support::{decode, field};
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Lattice;
use tetralod::mt::{
    BaseMesh, EdgeMt, ErrorCode, ExplicitMt, ExplicitUpdate, Mt, MtInfo, MtKind, VertexId, VertexSplit,
};

const SPEC: &str = include_str!("../docs/format.md");

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
        quantization: 0.0,
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
        errors: &[ErrorCode(300)],
    };
    mt.push(&split).expect("the example is an MT");
    mt
}

fn options() -> EncodeOptions {
    EncodeOptions { metadata: [("tool".to_owned(), "hand".to_owned())].into() }
}

/// The same base mesh in an explicit MT, whose only update puts a vertex into the tetrahedron.
fn spelled_example() -> ExplicitMt {
    let edge = example();
    let info = MtInfo { vertices: 5, tetrahedra: 4, ..edge.info().clone() };
    let mut mt = ExplicitMt::new(info, edge.base().clone());
    let update = ExplicitUpdate {
        positions: &[[2, 2, 2]],
        levels: &[15],
        removed: &[0],
        inserted: &[[4, 1, 2, 3], [0, 4, 2, 3], [0, 1, 4, 3], [0, 1, 2, 4]],
        errors: &[ErrorCode(300)],
    };
    mt.push(&update).expect("the example is an MT");
    mt
}

/// The same update in a vertex-based MT.
fn inserted_example() -> Mt {
    Mt::from(spelled_example()).convert(MtKind::Vertex).expect("an insertion")
}

/// The bytes in a code block behind the heading of the examples; what follows two slashes is a remark.
fn golden(number: usize) -> Vec<u8> {
    let examples = SPEC.split("## Examples").nth(1).expect("there are examples");
    let block = examples.split("```text\n").nth(number).and_then(|rest| rest.split("```").next());
    let lines = block.expect("as many blocks").lines();
    let digits = lines.flat_map(|line| line.split("//").next().unwrap_or("").split_whitespace());
    digits.map(|d| u8::from_str_radix(d, 16).expect("two hexadecimal digits")).collect()
}

#[test]
fn the_examples_are_written_as_specified() {
    let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02X} ")).collect::<String>();
    let edge = encode(&example(), &options()).expect("the example is complete");
    assert_eq!(hex(&edge), hex(&golden(1)));
    let spelled = encode(&spelled_example(), &EncodeOptions::default()).expect("the example is complete");
    assert_eq!(hex(&spelled), hex(&golden(2)));
    let inserted = encode(&inserted_example(), &EncodeOptions::default()).expect("the example is complete");
    assert_eq!(hex(&inserted), hex(&golden(3)));
}

#[test]
fn the_examples_are_read_as_specified() {
    assert_eq!(decode(&golden(1)), Ok(example().into()));
    assert_eq!(decode(&golden(2)), Ok(spelled_example().into()));
    assert_eq!(decode(&golden(3)), Ok(inserted_example()));
}
