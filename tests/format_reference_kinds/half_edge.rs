//! Files of kind 3.

use super::Domain;
use super::build_support::cube;
use super::build_support::hilly;
use super::build_support::linear;
use super::*;
use reader::half_edge;
use reader::half_edge_mesh::Mesh;
use tetralod::build::Purpose;

fn built(mesh: &TetMesh, config: BuildConfig) -> Mt {
    let config = BuildConfig { all_fields: true, ..config };
    let built = tetralod::build::build(mesh, &config, &mut |_| ControlFlow::Continue(()));
    built.expect("a valid mesh").mt
}

/// With lattices of so many bits.
fn with_bits(purpose: Purpose, position_bits: u32, field_bits: u32) -> BuildConfig {
    BuildConfig {
        purpose,
        position_bits: Some(position_bits),
        field_precision: FieldPrecision::Bits(field_bits),
        ..BuildConfig::of(MtKind::HalfEdge)
    }
}

#[test]
fn random_insertions_are_read_alike() {
    for (tets, fields, updates, block_bits) in [(1, 1, 0, 4), (1, 1, 60, 4), (2, 3, 300, 5), (7, 2, 300, 16)]
    {
        compare(&bytes_in_blocks(&format_support::half_edge(tets, fields, updates), block_bits));
    }
}

#[test]
fn built_mts_are_read_alike() {
    let mesh = cube(5, &[hilly, linear]);
    for purpose in [Purpose::Uniform, Purpose::Regions] {
        for (position_bits, field_bits, block_bits) in [(6, 5, 4), (16, 12, 5), (30, 24, 4)] {
            let mt = built(&mesh, with_bits(purpose, position_bits, field_bits));
            compare(&bytes_in_blocks(&mt, block_bits));
        }
    }
}
