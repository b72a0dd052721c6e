//! Promise: what a builder notes of the blocks of a half-edge MT is what a run through the MT finds: files are the same with and without it.

use crate::support::meshes::{bent, cube, hilly};
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MtKind, UpdatePages};
use tetralod_build::{BuildConfig, build};

fn is_same(mt: &Mt, name: &str) {
    // In pages anew nothing is noted.
    let scanned = mt.in_pages(mt.page_bits()).expect("a complete MT");
    for check_margins in [false, true] {
        let options = EncodeOptions { check_margins, histograms: true, ..EncodeOptions::default() };
        let [noted, found] = [mt, &scanned].map(|mt| encode(mt, &options).expect("a sound MT"));
        assert!(noted == found, "{name}");
    }
}

#[test]
fn files_are_the_same_by_what_the_builder_notes() {
    let mut meshes: Vec<(&str, TetMesh)> =
        vec![("bent", bent(8)), ("cube", cube(9, &[hilly, |[x, y, _]| x * y]))];
    meshes.push(("bucky", tetralod_io::generate::bucky(15).expect("a volume")));
    for (name, mesh) in meshes {
        for all_fields in [false, true] {
            let config = BuildConfig { all_fields, block_bits: 6, ..BuildConfig::default() };
            let mt = build(&mesh, &config).expect("a valid mesh").mt;
            is_same(&mt, name);
            let vertex = mt.convert(MtKind::Vertex).expect("insertions");
            is_same(&vertex.convert(MtKind::HalfEdge).expect("half-edges"), name);
        }
    }
}
