//! Promises of the paper's node code [§5] that the conformance suite does not state: how many bits it takes, what its nodes cannot say,
//! and what it refuses.

use crate::support::conformance::{DELAUNAY, EDGE, HALF_EDGE, INSERTED, Subject, border, inputs};
use crate::support::domains::{Domain, POSITION_BITS, volume6};
use crate::support::random::Random;
use tetralod::geom::Lattice;
use tetralod::mt::{
    Applied, ApplyUpdates, BaseMesh, ConvertError, ErrorCode, ExplicitMt, ExplicitUpdate, FieldInfo,
    MostNeighbors, MtInfo, MtKind, MultiTessellation, TreeExceptions, UpdateId, VertexId, VertexTreeMt,
};

const LIMITS: [(MostNeighbors, u64); 2] = [(MostNeighbors::ThirtyTwo, 12), (MostNeighbors::SixtyFour, 14)];
const NONE: TreeExceptions = TreeExceptions { faces: 0, given_up: 0, trees: 0 };

/// 12 bits (or 14) and 6 p − q + 1 for each update, where T_u has p tetrahedra and q faces on its boundary.
fn assert_bits(mt: &ExplicitMt) -> [TreeExceptions; 2] {
    let tet = |&t: &u32| mt.tets()[t as usize];
    let stream = |u: u32| {
        let removed: Vec<[u32; 4]> = mt.removed(UpdateId(u)).iter().map(tet).collect();
        6 * removed.len() as u64 + 1 - border(&removed).len() as u64
    };
    let streams: u64 = (0..mt.updates()).map(stream).sum();
    LIMITS.map(|(limit, face_bits)| {
        let trees = VertexTreeMt::from_explicit(mt, limit).expect("an MT of insertions");
        assert_eq!((limit, u64::from(limit.face_bits())), (trees.most_neighbors(), face_bits));
        assert_eq!(trees.code_bits(), face_bits * u64::from(mt.updates()) + streams);
        trees.exceptions()
    })
}

#[test]
fn nodes_take_as_many_bits_as_the_paper_says() {
    for how in [HALF_EDGE, DELAUNAY, INSERTED] {
        for subject in inputs().into_iter().filter_map(|input| Subject::new(how, input)) {
            let [narrow, wide] = assert_bits(&subject.explicit);
            let name = format!("{how:?} {}: {narrow:?} {wide:?}", subject.input.name);
            assert!(wide.faces <= narrow.faces && narrow.given_up == wide.given_up, "{name}");
            // The stream alone leads back to every T_u that builders have made so far.
            assert_eq!([narrow.trees, wide.trees], [0; 2], "{name}");
        }
    }
}

/// An MT of one insertion: of a vertex at `at` into all tetrahedra of `removed`, in front of these faces.
fn insertion(base: BaseMesh, at: [i32; 3], removed: &[u32], faces: &[[u32; 3]]) -> ExplicitMt {
    let new = base.positions.len() as u32;
    let side = |tet: [u32; 4]| volume6(tet.map(|v| if v == new { at } else { base.positions[v as usize] }));
    let star = faces.iter().map(|&[a, b, c]| [new, a, b, c]);
    let star: Vec<[u32; 4]> =
        star.map(|tet @ [v, a, b, c]| if side(tet) > 0 { tet } else { [v, a, c, b] }).collect();
    let field = FieldInfo { name: "f".into(), bits: 8, step: 1.0 / 255.0, ..FieldInfo::default() };
    let info = MtInfo {
        kind: MtKind::Vertex,
        lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: POSITION_BITS },
        fields: vec![field],
        vertices: new + 1,
        tetrahedra: (base.tets.len() + star.len() - removed.len()) as u64,
        updates: 1,
        displacement_per_error: 1.0,
        quantization: 0.0,
        bounds: None,
    };
    let mut mt = ExplicitMt::new(info, base);
    let update =
        ExplicitUpdate { positions: &[at], levels: &[7], removed, inserted: &star, errors: &[ErrorCode(9)] };
    mt.push(&update).expect("an insertion");
    mt
}

fn base(positions: Vec<[i32; 3]>, tets: &[[u32; 4]]) -> BaseMesh {
    let turn = |&[a, b, c, d]: &[u32; 4]| {
        let tet = [a, b, c, d];
        if volume6(tet.map(|v| positions[v as usize])) > 0 { tet } else { [b, a, c, d] }
    };
    BaseMesh { values: vec![0; positions.len()], tets: tets.iter().map(turn).collect(), positions }
}

/// Applies the update and undoes it; the MT is the same when it is spelled out again.
fn assert_applies(mt: &ExplicitMt, limit: MostNeighbors) -> VertexTreeMt {
    let trees = VertexTreeMt::from_explicit(mt, limit).expect("an MT of insertions");
    assert!(ExplicitMt::of(&trees).as_ref() == Ok(mt));
    let (u, vertex) = (UpdateId(0), trees.vertex(UpdateId(0)));
    assert_eq!(vertex, VertexId(mt.vertices() - 1));
    let mut mesh = trees.start().expect("a valid base mesh");
    let before = mesh.hash();
    for _ in 0..2 {
        assert_eq!(trees.refine(&mut mesh, u), Ok(Applied::Done));
        assert_eq!((mesh.check(), mesh.tet_count()), (Ok(()), mt.info().tetrahedra as usize));
        assert!(trees.refine(&mut mesh, u).is_err(), "it is applied already");
        assert_eq!(trees.coarsen(&mut mesh, u), Ok(Applied::Done));
        assert_eq!((mesh.check(), mesh.hash()), (Ok(()), before));
        assert!(trees.coarsen(&mut mesh, u).is_err(), "it is not applied");
        mesh.compact();
    }
    trees
}

/// The three tetrahedra around an edge that `tree_code.rs` draws.
#[test]
fn a_small_node_is_as_worked_out_by_hand() {
    let positions = vec![[500, 500, 100], [500, 500, 900], [900, 500, 500], [300, 800, 500], [300, 200, 500]];
    let base = base(positions, &[[0, 1, 2, 3], [0, 1, 3, 4], [0, 1, 4, 2]]);
    let around = [[2, 3], [3, 4], [4, 2]];
    let faces: Vec<[u32; 3]> = around.iter().flat_map(|&[a, b]| [[0, a, b], [1, a, b]]).collect();
    let mt = insertion(base, [510, 505, 480], &[0, 1, 2], &faces);
    for (limit, face_bits) in LIMITS {
        let trees = assert_applies(&mt, limit);
        assert_eq!((trees.code_bits(), trees.remover_bits()), (face_bits + 13, 0));
        assert_eq!((trees.exceptions(), trees.exception_bytes()), (NONE, 0));
    }
}

fn corner() -> BaseMesh {
    base(vec![[0, 0, 0], [900, 0, 0], [0, 900, 0], [0, 0, 900]], &[[0, 1, 2, 3]])
}

#[test]
fn faces_that_the_vertex_lies_on_or_behind_are_given_up() {
    for height in [0, 300] {
        // On the face 1 2 3, and beyond it.
        let mt = insertion(
            corner(),
            [300 + height, 300 + height, 300 + height],
            &[0],
            &[[0, 1, 2], [0, 2, 3], [0, 1, 3]],
        );
        let trees = assert_applies(&mt, MostNeighbors::ThirtyTwo);
        assert_eq!((trees.code_bits(), trees.exceptions()), (12 + 3, NONE));
    }
}

#[test]
fn what_a_node_cannot_say_is_an_exception() {
    // The face 1 2 3 is given up although the vertex is in front of it.
    let mt = insertion(corner(), [200, 200, 200], &[0], &[[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
    let trees = assert_applies(&mt, MostNeighbors::ThirtyTwo);
    assert_eq!(trees.exceptions(), TreeExceptions { given_up: 1, ..NONE });
    assert!(trees.exception_bytes() > 0);

    // t_u is the last of 162 tetrahedra of the base mesh.
    let plain = Domain::Cube(3).mesh(&mut Random(1));
    let many = base(plain.positions, &plain.tets);
    let last = many.tets.len() as u32 - 1;
    let [a, b, c, d] = many.tets[last as usize];
    let middle =
        [0, 1, 2].map(|k| [a, b, c, d].map(|v| many.positions[v as usize][k]).iter().sum::<i32>() / 4);
    let mt = insertion(many, middle, &[last], &[[a, b, c], [a, b, d], [a, c, d], [b, c, d]]);
    for (limit, _) in LIMITS {
        assert_eq!(assert_applies(&mt, limit).exceptions(), TreeExceptions { faces: 1, ..NONE });
    }
}

#[test]
fn what_is_no_tree_is_refused() {
    let refused = |mt: &ExplicitMt| match VertexTreeMt::from_explicit(mt, MostNeighbors::ThirtyTwo) {
        Err(ConvertError::Update { why, .. }) => why,
        other => panic!("{other:?}"),
    };
    let input = || inputs().into_iter().next().expect("an input");
    let edge = Subject::new(EDGE, input()).expect("any input");
    assert_eq!(refused(&edge.explicit), "it is not the insertion of one vertex");

    let mut own = Subject::new(INSERTED, input()).expect("a convex input").explicit;
    let [falls, quarterings] = [own.updates() as usize, own.tets().len()].map(|len| vec![0; len]);
    own.set_tet_errors(falls, quarterings).expect("as many as there are");
    assert_eq!(refused(&own), "its tetrahedra have errors of their own");

    // Two tetrahedra that share an edge alone, with a vertex that sees two faces of each from outside.
    let positions = vec![
        [500, 500, 100],
        [500, 500, 900],
        [900, 450, 500],
        [900, 550, 500],
        [100, 450, 500],
        [100, 550, 500],
    ];
    let apart = base(positions, &[[0, 1, 2, 3], [0, 1, 4, 5]]);
    let mt = insertion(apart, [500, 900, 500], &[0, 1], &[[0, 1, 2], [0, 2, 3], [0, 1, 4], [0, 4, 5]]);
    assert_eq!(refused(&mt), "what it removes does not hang together through faces");
}
