//! Insertions come back as they were written, and damage makes errors.

use super::*;
use crate::format::coder::{Counts, Models, Writer};
use crate::format::read::Reader;
use crate::geom::{Lattice, in_conflict, orient3d};
use crate::mesh::{FACES, kuhn_tets};
use crate::mt::{CurrentMesh, ErrorCode, ExplicitMt, ExplicitUpdate, FieldInfo, MtKind, UpdatePages};

/// A cube of 6 bits with two fields.
fn info() -> MtInfo {
    let field = FieldInfo { max: 255.0, step: 1.0, bits: 8, ..FieldInfo::default() };
    MtInfo {
        kind: MtKind::Vertex,
        lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 6 },
        fields: vec![field.clone(), field],
        vertices: 0,
        tetrahedra: 0,
        updates: 0,
        displacement_per_error: 0.0,
        quantization: 0.0,
        bounds: None,
    }
}

fn level(position: [i32; 3], field: i32) -> i32 {
    let [x, y, z] = position;
    (x * x / 16 + y * z / 32 + field * x).clamp(0, 255)
}

/// A grid with points inserted into it by the Delaunay criterion, some of them on its sides and edges.
pub fn delaunay(points: u32) -> VertexMt {
    let side = |i: u32| [i % 3, i / 3 % 3, i / 9].map(|k| 32 * k as i32);
    let mut positions: Vec<[i32; 3]> = (0..27).map(side).collect();
    let levels = |positions: &[[i32; 3]]| -> Vec<i32> {
        positions.iter().flat_map(|&position| [0, 1].map(|field| level(position, field))).collect()
    };
    let base = BaseMesh { positions: positions.clone(), values: levels(&positions), tets: kuhn_tets([3; 3]) };
    let mut live: Vec<(u32, [u32; 4])> = (0..).zip(base.tets.iter().copied()).collect();
    let mut mt = ExplicitMt::new(MtInfo { updates: points, ..info() }, base);
    let mut x = 0x9E37_79B9_7F4A_7C15_u64;
    while mt.updates() < points {
        x ^= x << 7;
        x ^= x >> 9;
        let new = [0, 16, 32].map(|shift| ((x >> shift & 0xFFFF) % 81) as i32 - 8).map(|c| c.clamp(0, 64));
        if positions.contains(&new) {
            continue;
        }
        let corners = |tet: [u32; 4]| tet.map(|v| positions[v as usize]);
        let (removed, kept): (Vec<_>, Vec<_>) = live.iter().copied().partition(|&(_, tet)| {
            let [a, b, c, d] = corners(tet);
            in_conflict(a, b, c, d, new)
        });
        let faces: Vec<[u32; 3]> =
            removed.iter().flat_map(|(_, tet)| FACES.map(|face| face.map(|k| tet[k]))).collect();
        let is_inner =
            |[a, b, c]: [u32; 3]| [[a, c, b], [c, b, a], [b, a, c]].iter().any(|other| faces.contains(other));
        let v = positions.len() as u32;
        let seen = faces.iter().filter(|&&face| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            !is_inner(face) && orient3d(a, b, c, new) != 0
        });
        let inserted: Vec<[u32; 4]> = seen.map(|&[a, b, c]| [v, a, b, c]).collect();
        let update = ExplicitUpdate {
            positions: &[new],
            levels: &levels(&[new]),
            removed: &removed.iter().map(|(t, _)| *t).collect::<Vec<_>>(),
            inserted: &inserted,
            errors: &[0, 7].map(|more| ErrorCode((60_000 - 3 * v + more) as u16)),
        };
        let u = mt.push(&update).unwrap();
        positions.push(new);
        live = kept;
        live.extend(mt.inserted(u).map(|t| (t, mt.tets()[t as usize])));
    }
    VertexMt::from_explicit(&mt).unwrap()
}

struct Coded {
    models: Models,
    head: Vec<u8>,
    blocks: Vec<Vec<u8>>,
}

fn coded(mt: &VertexMt, size: u32) -> Result<Coded, FormatError> {
    let mut counts = Counts::default();
    mt.put_head(&mut counts);
    let mut state = State::of(mt)?;
    mt.put_block(&mut counts, 0..mt.updates(), &mut state)?;
    let models = Models::new(&counts);
    let mut writer = Writer::new(&models);
    mt.put_head(&mut writer);
    let mut head = Vec::new();
    writer.finish(&mut head);
    let mut state = State::of(mt)?;
    let mut blocks = Vec::new();
    for first in (0..mt.updates()).step_by(size as usize) {
        let mut writer = Writer::new(&models);
        mt.put_block(&mut writer, first..mt.updates().min(first + size), &mut state)?;
        let mut block = Vec::new();
        writer.finish(&mut block);
        blocks.push(block);
    }
    Ok(Coded { models, head, blocks })
}

impl Coded {
    /// An MT into which no block has come.
    fn start(&self, info: &MtInfo, base: &BaseMesh) -> Result<(VertexMt, State), FormatError> {
        let mut source = Source::new(Reader::new(&self.head, 0), &self.models)?;
        let InsertionRules { always_grows, grain } = InsertionRules::read(&mut source)?;
        source.end()?;
        let mt = VertexMt::growing(info.clone(), base.clone(), always_grows, false)?;
        let state = State::new(&mt, grain)?;
        Ok((mt, state))
    }
}

fn read(
    source: &mut Source<'_>,
    mt: &mut VertexMt,
    count: u32,
    state: &mut State,
) -> Result<(), FormatError> {
    (0..count).try_for_each(|_| read_update(source, mt, state))
}

fn decoded(coded: &Coded, info: &MtInfo, base: &BaseMesh, size: u32) -> Result<VertexMt, FormatError> {
    let (mut mt, mut state) = coded.start(info, base)?;
    for block in &coded.blocks {
        let mut source = Source::new(Reader::new(block, 0), &coded.models)?;
        let count = size.min(info.updates - mt.updates());
        read(&mut source, &mut mt, count, &mut state)?;
        source.end()?;
    }
    Ok(mt)
}

#[test]
fn insertions_come_back_in_blocks_of_any_size() -> Result<(), FormatError> {
    let mt = delaunay(150);
    assert!((0..150).any(|u| mt.given_up(UpdateId(u)).contains(&true)));
    for size in [1, 7, 150] {
        let coded = coded(&mt, size)?;
        assert!(decoded(&coded, mt.info(), mt.base(), size)? == mt);
    }
    let none = delaunay(0);
    assert!(decoded(&coded(&none, 1)?, none.info(), none.base(), 1)? == none);
    Ok(())
}

#[test]
fn what_has_come_is_an_mt() -> Result<(), FormatError> {
    let whole = delaunay(120);
    let coded = coded(&whole, 10)?;
    let (mut mt, mut state) = coded.start(whole.info(), whole.base())?;
    // One mesh follows; at every stage another one is taken back to the base, and there again.
    let mut mesh = mt.start()?;
    let mut reference = whole.start()?;
    for block in &coded.blocks {
        let mut source = Source::new(Reader::new(block, 0), &coded.models)?;
        let known = mt.updates();
        read(&mut source, &mut mt, 10, &mut state)?;
        mt.updates_arrived(&mut mesh, known);
        let mut other = mt.start()?;
        for u in (0..mt.updates()).map(UpdateId) {
            let parents: Vec<UpdateId> = mt.parents(u).collect();
            assert_eq!(parents, whole.parents(u).collect::<Vec<_>>());
            mt.refine(&mut other, u)?;
        }
        for u in (known..mt.updates()).map(UpdateId) {
            assert_eq!(mt.refine(&mut mesh, u)?, Applied::Done);
            assert_eq!(whole.refine(&mut reference, u)?, Applied::Done);
        }
        assert_eq!(mesh.hash(), reference.hash());
        assert_eq!(other.hash(), reference.hash());
        for u in (0..mt.updates()).rev().map(UpdateId) {
            assert_eq!(mt.coarsen(&mut other, u)?, Applied::Done);
        }
        other.compact();
        assert_eq!(other.hash(), mt.start()?.hash());
    }
    assert!(mt == whole);
    Ok(())
}

/// What removes each tetrahedron of a mesh, as far as is known.
fn removers(mt: &VertexMt, mesh: &CurrentMesh) -> Vec<([u32; 4], Option<u32>)> {
    let tets = (0..mesh.tet_slots() as u32).filter_map(|t| Some((t, mesh.tet(t)?)));
    let mut removers: Vec<_> = tets
        .map(|(t, tet)| {
            let mut labels = tet.map(|slot| mesh.vertex(slot).0);
            labels.sort_unstable();
            (labels, mt.remover(mesh, t).map(|u| u.0))
        })
        .collect();
    removers.sort_unstable();
    removers
}

#[test]
fn updates_that_come_one_by_one_are_revealed_wherever_they_lie() -> Result<(), FormatError> {
    let whole = delaunay(240);
    let coded = coded(&whole, 1)?;
    let (mut mt, mut state) = coded.start(whole.info(), whole.base())?;
    let mut mesh = mt.start()?;
    let mut applied = Vec::new();
    for (u, block) in (0..).zip(&coded.blocks) {
        let mut source = Source::new(Reader::new(block, 0), &coded.models)?;
        read(&mut source, &mut mt, 1, &mut state)?;
        mesh.clear_touched();
        mt.updates_arrived(&mut mesh, u);
        let is_news = |&t: &u32| mt.remover(&mesh, t) == Some(UpdateId(u));
        let news = (0..mesh.tet_slots() as u32).filter(|t| mesh.tet(*t).is_some()).filter(is_news);
        assert!(news.into_iter().all(|t| mesh.touched().contains(&t)));
        if u % 8 == 7 {
            // A mesh that knew of all from the start.
            let mut other = mt.start()?;
            for &u in &applied {
                assert_eq!(mt.refine(&mut other, u)?, Applied::Done);
            }
            assert_eq!(removers(&mt, &mesh), removers(&mt, &other));
        }
        // Some are left out later on, and all that depends on them.
        if (u < 150 || u % 9 > 0) && mt.refine(&mut mesh, UpdateId(u))? == Applied::Done {
            applied.push(UpdateId(u));
        }
    }
    assert!((151..230).contains(&applied.len()));
    Ok(())
}

#[test]
fn damage_makes_errors_or_other_mts() -> Result<(), FormatError> {
    let mt = delaunay(40);
    let whole = coded(&mt, 40)?;
    let read = |blocks: Vec<Vec<u8>>| {
        let coded = Coded { models: whole.models.clone(), head: whole.head.clone(), blocks };
        decoded(&coded, mt.info(), mt.base(), 40)
    };
    let block = &whole.blocks[0];
    for cut in 0..block.len() {
        assert!(read(vec![block[..cut].to_vec()]).is_err());
    }
    for bit in 0..8 * block.len() {
        let mut damaged = block.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        if let Ok(other) = read(vec![damaged]) {
            assert!(other != mt);
            // It has an explicit form, so all of its updates can be applied.
            assert!(ExplicitMt::of(&other).is_ok());
        }
    }
    Ok(())
}
