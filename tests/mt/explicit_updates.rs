//! Explicit updates that do not fit are refused and change nothing; what is no split does not become one.

use crate::support::builder::{Plan, build};
use crate::support::domains::{Domain, volume6};
use tetralod::mt::{
    Applied, ApplyUpdates, ConvertError, CurrentMesh, EdgeMt, ErrorCode, ExplicitMt, ExplicitUpdate, Mt,
    MtKind, MultiTessellation, UpdateError, UpdateId, VertexId,
};

/// One MT and its current mesh.
struct Walk<M> {
    mt: M,
    mesh: CurrentMesh,
}

impl<M: ApplyUpdates> Walk<M> {
    fn new(mt: M) -> Self {
        let mut mesh = mt.start().expect("a valid base mesh");
        mt.updates_arrived(&mut mesh, 0);
        Self { mt, mesh }
    }

    fn step(&mut self, u: UpdateId, undo: bool) -> bool {
        let Self { mt, mesh } = self;
        let applied = if undo { mt.coarsen(mesh, u) } else { mt.refine(mesh, u) };
        applied.expect("a valid MT") == Applied::Done
    }

    /// For every tetrahedron its vertices, ascending, and the updates that made and will remove it.
    fn tets(&self) -> Vec<([u32; 4], Option<UpdateId>, Option<UpdateId>)> {
        let live = (0..self.mesh.tet_slots() as u32).filter_map(|t| Some((t, self.mesh.tet(t)?)));
        let mut tets: Vec<_> = live
            .map(|(t, tet)| {
                let mut name = tet.map(|slot| self.mesh.vertex(slot).0);
                name.sort_unstable();
                (name, self.mt.creator(&self.mesh, t), self.mt.remover(&self.mesh, t))
            })
            .collect();
        tets.sort_unstable();
        tets
    }
}

/// An octahedron around vertex 0, cut into eight, and an MT of the updates that `push` makes of it.
fn octahedron(push: impl FnOnce(&mut ExplicitMt)) -> ExplicitMt {
    let info = build(Plan { domain: Domain::Cube(1), seed: 1, fields: 1, updates: 0 }).info;
    let axes = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    let mut positions = vec![[64; 3]];
    positions.extend(axes.map(|a: [i32; 3]| a.map(|x| 64 + 32 * x)));
    let ring = [[1, 2], [2, 3], [3, 4], [4, 1]];
    let mut tets: Vec<[u32; 4]> = ring.map(|[a, b]| [0, a, b, 5]).to_vec();
    tets.extend(ring.map(|[a, b]| [0, b, a, 6]));
    let base = tetralod::mt::BaseMesh { values: vec![0; 7], positions, tets };
    let mut mt = ExplicitMt::new(tetralod::mt::MtInfo { kind: MtKind::Edge, ..info }, base);
    push(&mut mt);
    mt
}

fn update<'a>(positions: &'a [[i32; 3]], removed: &'a [u32], inserted: &'a [[u32; 4]]) -> ExplicitUpdate<'a> {
    ExplicitUpdate {
        positions,
        levels: &[0; 8][..positions.len()],
        removed,
        inserted,
        errors: &[ErrorCode(9)],
    }
}

/// The tetrahedra, turned round where they are inside out.
fn turned(mt: &ExplicitMt, new: &[[i32; 3]], tets: &[[u32; 4]]) -> Vec<[u32; 4]> {
    let known = (0..mt.vertices()).map(|v| mt.position(VertexId(v)));
    let positions: Vec<[i32; 3]> = known.chain(new.iter().copied()).collect();
    let side = |tet: [u32; 4]| volume6(tet.map(|v| positions[v as usize]));
    tets.iter()
        .map(|&[a, b, c, d]| if side([a, b, c, d]) > 0 { [a, b, c, d] } else { [b, a, c, d] })
        .collect()
}

/// Four tetrahedra around the vertical axis in place of the eight: without the vertex in the middle.
const AROUND_AXIS: [[u32; 4]; 4] = [[6, 1, 2, 5], [6, 2, 3, 5], [6, 3, 4, 5], [6, 4, 1, 5]];
const ALL: [u32; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

#[test]
fn updates_that_are_not_even_updates_are_refused() {
    let pushed = |update: ExplicitUpdate<'_>| {
        let mut result = None;
        let mt = octahedron(|mt| result = Some(mt.push(&update)));
        (result.expect("it was pushed"), mt.updates())
    };
    assert_eq!(pushed(update(&[], &ALL, &AROUND_AXIS)), (Ok(UpdateId(0)), 1));
    let cavity = (Err(UpdateError::Cavity { update: 0 }), 0);
    let inverted = (Err(UpdateError::Inverted { update: 0 }), 0);
    let off = (Err(UpdateError::OffLattice { update: 0 }), 0);
    assert_eq!(pushed(update(&[], &[0, 0], &AROUND_AXIS)), cavity, "removed twice");
    assert_eq!(pushed(update(&[], &[8], &AROUND_AXIS)), cavity, "not there");
    assert_eq!(pushed(update(&[], &[], &AROUND_AXIS)), cavity, "nothing removed");
    assert_eq!(pushed(update(&[], &ALL, &[])), cavity, "nothing inserted");
    assert_eq!(pushed(update(&[], &ALL, &[[6, 1, 2, 7]])), cavity, "no such vertex");
    assert_eq!(pushed(update(&[], &ALL[..2], &AROUND_AXIS)), cavity, "vertices of others");
    assert_eq!(pushed(update(&[], &ALL, &[[1, 6, 2, 5]])), inverted);
    assert_eq!(pushed(update(&[], &ALL, &[[6, 6, 2, 5]])), inverted);
    assert_eq!(pushed(update(&[[-1, 0, 0]], &ALL, &AROUND_AXIS)), off);
    let uneven = ExplicitUpdate { levels: &[], ..update(&[[9; 3]], &ALL, &AROUND_AXIS) };
    assert_eq!(pushed(uneven), off);
    let mut growing = None;
    octahedron(|mt| {
        mt.push(&update(&[], &[0], &[[0, 1, 2, 5]])).expect("good so far");
        let larger = ExplicitUpdate { errors: &[ErrorCode(10)], ..update(&[], &[1], &[[0, 2, 3, 5]]) };
        growing = Some(mt.push(&larger));
    });
    assert_eq!(growing, Some(Ok(UpdateId(1))), "numbers say nothing of errors");
}

/// Applying the last update fails, and the mesh stays what it was.
fn refused(what: &str, push: impl FnOnce(&mut ExplicitMt)) {
    let mut walk = Walk::new(octahedron(push));
    let last = UpdateId(walk.mt.updates() - 1);
    for u in (0..last.0).map(UpdateId) {
        assert!(walk.step(u, false), "{what}: {u:?}");
    }
    let before = (walk.mesh.hash(), walk.tets());
    for _ in 0..2 {
        let found = walk.mt.refine(&mut walk.mesh, last);
        assert_eq!(found, Err(UpdateError::Cavity { update: last.0 }), "{what}");
        assert_eq!((walk.mesh.hash(), walk.tets()), before, "{what}");
        assert_eq!(walk.mesh.check(), Ok(()), "{what}");
    }
    // What does fit still does.
    for u in (0..last.0).rev().map(UpdateId) {
        assert!(walk.step(u, true), "{what}: {u:?}");
    }
    assert_eq!(walk.mesh.check(), Ok(()), "{what}");
}

#[test]
fn updates_that_do_not_fit_are_refused_and_change_nothing() {
    let push = |mt: &mut ExplicitMt, positions: &[[i32; 3]], removed: &[u32], inserted: &[[u32; 4]]| {
        let inserted = turned(mt, positions, inserted);
        mt.push(&update(positions, removed, &inserted)).expect("nothing to see without the mesh");
    };
    refused("a hole between it and the rest", |mt| push(mt, &[], &ALL[..7], &AROUND_AXIS));
    refused("the same twice", |mt| push(mt, &[], &[0], &[[0, 1, 2, 5], [0, 1, 2, 5]]));
    refused("what stays, again", |mt| {
        push(mt, &[], &[0, 5], &[[0, 1, 2, 5], [0, 2, 3, 6], [0, 2, 3, 5]]);
    });
    refused("on the side that is taken", |mt| {
        push(mt, &[[64, 20, 90]], &[0], &[[0, 1, 2, 5], [1, 0, 7, 5]]);
    });
    refused("leaves something bare", |mt| push(mt, &[[80, 80, 80]], &[0], &[[7, 1, 2, 5]]));
    refused("on top of another", |mt| {
        push(mt, &[], &ALL, &AROUND_AXIS);
        push(mt, &[[72, 72, 64]], &[8], &[AROUND_AXIS[0], [7, 1, 2, 5]]);
    });
    // Two of the four go, and a third is touched at a face that it had bare.
    refused("touches what it did not border on", |mt| {
        push(mt, &[], &ALL, &AROUND_AXIS);
        push(mt, &[[120, 10, 120]], &[8, 11], &[AROUND_AXIS[0], AROUND_AXIS[2], [1, 4, 7, 5]]);
    });
    refused("takes a vertex from what touches it there alone", |mt| {
        // A part that hangs on by vertex 1, then the rest lets go of that vertex.
        push(mt, &[[120, 64, 64], [120, 80, 64], [120, 64, 90]], &[0], &[[0, 1, 2, 5], [1, 7, 8, 9]]);
        push(mt, &[], &[1, 2, 3, 4, 5, 6, 7, 8], &[[6, 2, 3, 5], [6, 3, 4, 5]]);
    });
}

#[test]
fn parts_may_come_and_go() {
    let mt = octahedron(|mt| {
        let far = [[1, 1, 1], [9, 1, 1], [1, 9, 1], [1, 1, 9]];
        mt.push(&update(&far, &[0], &[[0, 1, 2, 5], [7, 8, 9, 10]])).expect("an update");
    });
    let mut walk = Walk::new(mt);
    let start = walk.mesh.hash();
    assert!(walk.step(UpdateId(0), false));
    assert_eq!((walk.mesh.check(), walk.mesh.tet_count()), (Ok(()), 9));
    assert!(walk.step(UpdateId(0), true));
    walk.mesh.compact();
    assert_eq!((walk.mesh.check(), walk.mesh.hash()), (Ok(()), start));
}

#[test]
fn what_is_no_split_does_not_become_one() {
    let to_edge = |mt: ExplicitMt| match mt.compact(MtKind::Edge) {
        Err(ConvertError::Update { update, .. }) => update,
        other => panic!("{other:?}"),
    };
    let removal = octahedron(|mt| {
        mt.push(&update(&[], &ALL, &AROUND_AXIS)).expect("an update");
    });
    assert_eq!(to_edge(removal), 0);

    // A split along x, right but for one half, which is off by more than rounding.
    let split = |near: [i32; 3]| {
        let halves = [near, [56, 64, 64]];
        let mut tets = vec![[7, 1, 2, 5], [8, 2, 3, 5], [8, 3, 4, 5], [7, 4, 1, 5]];
        tets.extend([[7, 2, 1, 6], [8, 3, 2, 6], [8, 4, 3, 6], [7, 1, 4, 6]]);
        tets.extend([[7, 8, 5, 2], [7, 8, 2, 6], [7, 8, 6, 4], [7, 8, 4, 5]]);
        octahedron(|mt| {
            let tets = turned(mt, &halves, &tets);
            mt.push(&update(&halves, &ALL, &tets)).expect("an update");
        })
    };
    let good = split([72, 64, 64]);
    let edge = good.compact(MtKind::Edge).expect("a split");
    assert_eq!(ExplicitMt::of(&edge), Ok(good));
    assert_eq!(to_edge(split([74, 64, 64])), 0);

    let edge = Mt::from(EdgeMt::new(edge.info().clone(), edge.base().clone()));
    let other = edge.convert(MtKind::Vertex);
    assert_eq!(other, Err(ConvertError::Kinds { from: MtKind::Edge, to: MtKind::Vertex }));
}
