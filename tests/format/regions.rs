//! Promise: a file of regions says what `docs/format.md` says, and from that alone each tetrahedron of every mesh has the region that the
//! crate gives it.

use crate::reader;
use crate::reader::half_edge_mesh::{Marked, Mesh};
use crate::support::files::{assemble, decode, sections};
use crate::support::meshes::{blocks, hilly};
use std::collections::BTreeMap;
use tetralod::format::{EncodeOptions, FormatError, encode};
use tetralod::mesh::{CellsToPoints, Field, TetMesh};
use tetralod::mt::{Applied, ApplyUpdates, CurrentMesh, Mt, MultiTessellation, UpdateId};
use tetralod_build::{BuildConfig, build};

/// Three slabs and in the middle one a column, with labels that are no numbers from 0 on, by two arrays.
fn labelled(within: f64) -> Mt {
    built(labelled_mesh(), within)
}

fn labelled_mesh() -> TetMesh {
    let mut mesh = blocks([6, 5, 6], &[hilly], |_| true);
    let middle = |tet: &[u32; 4]| {
        let corners = tet.map(|v| mesh.positions[v as usize]);
        [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0)
    };
    let label = |[x, _, z]: [f64; 3]| match (z * 3.0) as u32 {
        1 => [if (2.0 * x - 1.0).abs() < 0.34 { 900.0 } else { -5.0 }, 1.0],
        slab => [7.0, f64::from(slab)],
    };
    let labels: Vec<[f64; 2]> = mesh.tets.iter().map(|tet| label(middle(tet))).collect();
    let array = |k: usize, name: &str| Field::new(name, labels.iter().map(|all| all[k]).collect());
    mesh.cell_fields = vec![array(0, "material"), array(1, "slab")];
    TetMesh { grid: None, ..mesh }
}

fn built(mesh: TetMesh, within: f64) -> Mt {
    let config = BuildConfig {
        all_fields: true,
        preserve: vec!["material".into(), "slab".into()],
        preserve_within: within,
        block_bits: 4,
        ..BuildConfig::default()
    };
    build(&mesh, &config).expect("a mesh to build on").mt
}

fn written(mt: &Mt) -> Vec<u8> {
    written_in_pages(mt, None)
}

fn written_in_pages(mt: &Mt, index_page_bits: Option<u32>) -> Vec<u8> {
    let options = EncodeOptions { histograms: true, index_page_bits, ..EncodeOptions::default() };
    encode(mt, &options).expect("a complete MT")
}

/// The region of each tetrahedron, by its vertices.
type OfTets = BTreeMap<[u32; 4], u16>;

fn sorted(mut tet: [u32; 4]) -> [u32; 4] {
    tet.sort_unstable();
    tet
}

fn of_crate(mesh: &CurrentMesh) -> OfTets {
    let of = |t: u32| {
        let tet = mesh.tet(t)?.map(|v| mesh.vertex(v).0);
        Some((sorted(tet), mesh.regions()[t as usize]))
    };
    (0..mesh.tet_slots() as u32).filter_map(of).collect()
}

fn of_reader(mesh: &Mesh<'_>) -> OfTets {
    mesh.tets.iter().map(|marked| (sorted(marked.tet), marked.region)).collect()
}

#[test]
fn a_second_reader_finds_the_same_regions_in_every_mesh() {
    for (within, pages) in [(0.0, None), (0.05, None), (0.0, Some(1))] {
        let mt = labelled(within);
        let bytes = written_in_pages(&mt, pages);
        let (file, parts) = reader::open(&bytes);
        let (own, read) = (mt.regions().expect("regions"), file.regions.as_ref().expect("the section"));
        assert_eq!((&read.arrays, read.deviation, &read.of_base), (&own.arrays, own.deviation, &own.of_base));
        let names: Vec<&str> = read.all.iter().map(|region| region.name.as_str()).collect();
        assert_eq!(
            names,
            ["material -5, slab 1", "material 7, slab 0", "material 7, slab 2", "material 900, slab 1"]
        );
        for (read, own) in read.all.iter().zip(&own.all) {
            assert_eq!((&read.name, &read.labels, read.color), (&own.name, &own.labels, own.color));
            assert_eq!((read.tetrahedra, read.volume), (own.tetrahedra, own.volume));
            assert_eq!(read.bounds, own.bounds);
        }
        let mut theirs = Mesh::new(&file);
        let mut ours = mt.start().expect("a valid base mesh");
        assert_eq!(of_reader(&theirs), of_crate(&ours));
        for block in 0..parts.len() as u32 {
            theirs.add_block(reader::half_edge::block(&file, block, &parts[block as usize]));
            for k in file.updates(block) {
                theirs.apply(k);
                assert_eq!(mt.refine(&mut ours, UpdateId(k)), Ok(Applied::Done));
            }
            assert_eq!(of_reader(&theirs), of_crate(&ours), "after block {block}, within {within}");
        }
        // Undone, the regions are those of before.
        for u in (0..mt.updates()).rev().map(UpdateId) {
            assert_eq!(mt.coarsen(&mut ours, u), Ok(Applied::Done));
        }
        assert_eq!(of_crate(&ours), of_crate(&mt.start().expect("a valid base mesh")));
    }
}

/// The levels of each corner of each tetrahedron, by its vertices.
type AtCorners = BTreeMap<[u32; 4], Vec<Vec<i32>>>;

#[test]
fn a_second_reader_finds_the_values_of_each_region() {
    for (within, pages) in [(0.0, None), (0.05, None), (0.0, Some(1))] {
        let mut mesh = labelled_mesh();
        let own =
            |label: f64, t: usize| 0.01 * label + ((t * t) % 17) as f64 * if label < 0.0 { 0.3 } else { 0.0 };
        let stress = mesh.cell_fields[0].values.iter().enumerate().map(|(t, &label)| own(label, t)).collect();
        mesh.cell_fields.push(Field::new("stress", stress));
        mesh.settle_cells(CellsToPoints::ByRegion, &["material".into(), "slab".into()]);
        let mt = built(mesh, within);
        let bytes = written_in_pages(&mt, pages);
        let (file, parts) = reader::open(&bytes);
        let regions = file.regions.as_ref().expect("the section");
        assert_eq!(regions.jumps, mt.regions().expect("regions").sides.jumps);
        assert!(regions.jumps.contains(&true) && regions.jumps.contains(&false));
        assert!(file.base_sides.iter().any(|own| !own.is_empty()));
        let of_reader = |mesh: &Mesh<'_>| -> AtCorners {
            let of = |marked: &Marked| {
                let tet = sorted(marked.tet);
                (tet, tet.map(|v| mesh.vertices[&v].levels_in(marked.region).to_vec()).to_vec())
            };
            mesh.tets.iter().map(of).collect()
        };
        let of_crate = |mesh: &CurrentMesh| -> AtCorners {
            let of = |t: u32| {
                let mut corners = mesh.tet(t)?.map(|v| (mesh.vertex(v).0, mesh.levels(v).to_vec()));
                corners.sort_unstable();
                Some((corners.each_ref().map(|(v, _)| *v), corners.map(|(_, levels)| levels).to_vec()))
            };
            (0..mesh.tet_slots() as u32).filter_map(of).collect()
        };
        let mut theirs = Mesh::new(&file);
        let mut ours = mt.start().expect("a valid base mesh");
        assert!(of_reader(&theirs) == of_crate(&ours), "the base mesh");
        let mut several = 0;
        for block in 0..parts.len() as u32 {
            let records = reader::half_edge::block(&file, block, &parts[block as usize]);
            several += records.iter().flat_map(|record| &record.sides).filter(|own| !own.is_empty()).count();
            theirs.add_block(records);
            let entry = &file.index.as_ref().expect("an index").blocks[block as usize];
            for k in file.updates(block) {
                let change = theirs.apply(k);
                assert_eq!(mt.refine(&mut ours, UpdateId(k)), Ok(Applied::Done));
                // The index knows of all regions.
                let is_new = |marked: &&Marked| change.inserted.contains(&marked.tet);
                for Marked { tet, region, .. } in theirs.tets.iter().filter(is_new) {
                    for v in tet {
                        let levels = theirs.vertices[v].levels_in(*region).iter();
                        for (&level, (_, [low, high])) in levels.zip(&entry.fields) {
                            assert!((*low..=*high).contains(&(level as u64)));
                        }
                    }
                }
            }
            assert!(of_reader(&theirs) == of_crate(&ours), "after block {block}, within {within}");
        }
        assert!(several > 20, "{several}");
    }
}

#[test]
fn readers_that_do_not_know_regions_skip_them() {
    let mt = labelled(0.0);
    let mut all = sections(&written(&mt));
    // A kind that nobody knows.
    let at = all.iter().position(|(kind, _)| kind == b"regn").expect("the section");
    all[at].0 = *b"regx";
    let found = decode(&assemble(&all, mt.updates())).expect("a sound file");
    assert!(found.regions().is_none());
    assert_eq!((found.info(), found.base()), (mt.info(), mt.base()));
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let mt = labelled(0.0);
    let good = sections(&written(&mt));
    let at = good.iter().position(|(kind, _)| kind == b"regn").expect("the section");
    let with = |payload: Vec<u8>| {
        let mut all = good.clone();
        all[at].1 = payload;
        decode(&assemble(&all, mt.updates()))
    };
    let payload = &good[at].1;
    assert!(with(payload.clone()).is_ok());
    // Whatever is cut off or changed, it is an error or another file, never a crash.
    for end in 0..payload.len() {
        assert!(matches!(with(payload[..end].to_vec()), Err(FormatError::Corrupt { .. })), "{end}");
    }
    for place in 0..payload.len() {
        for bit in 0..8 {
            let mut other = payload.clone();
            other[place] ^= 1 << bit;
            if let Ok(found) = with(other) {
                let regions = found.regions().expect("the section");
                assert!(regions.of_base.iter().all(|&region| usize::from(region) < regions.all.len()));
                assert_eq!(regions.of_base.len(), found.base().tets.len());
            }
        }
    }
    // In front of the index, behind the base mesh, twice.
    let moved = |to: usize| {
        let mut all = good.clone();
        let section = all.remove(at);
        all.insert(to, section);
        decode(&assemble(&all, mt.updates()))
    };
    let base = good.iter().position(|(kind, _)| kind == b"BASE").expect("the section");
    assert!(moved(1).is_err() && moved(base).is_err());
    let mut twice = good.clone();
    twice.insert(at, good[at].clone());
    assert!(decode(&assemble(&twice, mt.updates())).is_err());
}
