//! Splits of single stars made by hand: the cases that random MTs do not reach.

use crate::support::builder::{Plan, build};
use crate::support::compare::{live_tets, snapshot};
use crate::support::domains::{Domain, volume6};
use crate::support::meshes::prefix;
use tetralod::geom::Lattice;
use tetralod::mt::{
    Applied, ApplyUpdates, BaseMesh, CurrentMesh, EdgeMtBuilder, ErrorCode, FieldInfo, MtInfo, MtKind,
    MultiTessellation, UpdateError, UpdateId, UpdatePages, VertexId, VertexSplit,
};

const CENTRE: [i32; 3] = [512; 3];

/// Vertex 0 in the middle, link vertices around it by their directions, and the triangles of the link.
struct Cone {
    directions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Cone {
    fn info(&self) -> MtInfo {
        let field = FieldInfo {
            name: "f".into(),
            min: 0.0,
            max: 1.0,
            origin: 0.0,
            step: 1.0 / 255.0,
            bits: 8,
            ..FieldInfo::default()
        };
        MtInfo {
            kind: MtKind::Edge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 10 },
            fields: vec![field],
            vertices: 0,
            tetrahedra: 0,
            updates: 1,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        }
    }

    fn base(&self) -> BaseMesh {
        let mut positions = vec![CENTRE];
        positions
            .extend(self.directions.iter().map(|d| [0, 1, 2].map(|i| CENTRE[i] + (d[i] * 400.0) as i32)));
        let tets = self.triangles.iter().map(|&[a, b, c]| {
            let tet = [0, a, b, c];
            let volume = volume6(tet.map(|v| positions[v as usize]));
            assert_ne!(volume, 0);
            if volume > 0 { tet } else { [0, a, c, b] }
        });
        let tets = tets.collect();
        BaseMesh { values: vec![100; positions.len()], positions, tets }
    }

    /// Splits vertex 0 with the triangles of `far` on side 1 and checks that an error changes nothing and that
    /// the inverse gives the star back.
    fn split(&self, offset: [i32; 3], far: &[[u32; 3]]) -> Result<Vec<[u32; 4]>, UpdateError> {
        let mut faces: Vec<[u32; 3]> = self.triangles.clone();
        let sorted = |mut face: [u32; 3]| {
            face.sort_unstable();
            face
        };
        faces.iter_mut().for_each(|face| *face = sorted(*face));
        faces.sort_unstable();
        let far: Vec<[u32; 3]> = far.iter().map(|face| sorted(*face)).collect();
        assert!(far.iter().all(|face| faces.contains(face)));
        let bits = faces.iter().enumerate().take(64);
        let mask = bits.fold(0, |mask, (i, face)| mask | u64::from(far.contains(face)) << i);
        let mut builder = EdgeMtBuilder::new(self.info(), self.base()).expect("a valid base mesh");
        let (vertex, errors) = (VertexId(0), &[ErrorCode(1)]);
        let built = builder.push(&VertexSplit { vertex, offset, field_offsets: &[5], mask, errors });
        let mt = builder.finish();
        if mt.updates() == 0 {
            return Err(built.expect_err("it is not there"));
        }
        let mut mesh = CurrentMesh::new(mt.info(), mt.base()).expect("a valid base mesh");
        mt.updates_arrived(&mut mesh, 0);
        let (before, hash) = (snapshot(&mesh), mesh.hash());
        let result = mt.refine(&mut mesh, UpdateId(0));
        assert_eq!(result.clone().err(), built.err());
        assert_eq!(mesh.check(), Ok(()));
        if let Err(error) = result {
            assert_eq!(snapshot(&mesh), before);
            return Err(error);
        }
        assert_eq!(result, Ok(Applied::Done));
        let refined = live_tets(&mesh);
        assert_eq!(mt.coarsen(&mut mesh, UpdateId(0)), Ok(Applied::Done));
        mesh.compact();
        assert_eq!(mesh.check(), Ok(()));
        assert_eq!(mesh.hash(), hash);
        Ok(refined)
    }
}

/// A unit vector from its angle around z and its height, both in degrees.
fn direction(angle: f64, height: f64) -> [f64; 3] {
    let (a, h) = (angle.to_radians(), height.to_radians());
    [a.cos() * h.cos(), a.sin() * h.cos(), h.sin()]
}

fn icosahedron() -> Cone {
    let phi = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut directions = Vec::new();
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let (u, v) = (s / 2.0, t * phi / 2.0);
        directions.extend([[0.0, u, v], [u, v, 0.0], [v, 0.0, u]]);
    }
    let near = |a: u32, b: u32| {
        let (p, q): ([f64; 3], [f64; 3]) = (directions[a as usize - 1], directions[b as usize - 1]);
        (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>() < 1.01
    };
    let mut triangles = Vec::new();
    for a in 1..=12 {
        for b in a + 1..=12 {
            triangles
                .extend((b + 1..=12).filter(|&c| near(a, b) && near(b, c) && near(a, c)).map(|c| [a, b, c]));
        }
    }
    assert_eq!(triangles.len(), 20);
    Cone { directions, triangles }
}

#[test]
fn a_closed_star_splits_along_one_loop_only() {
    let cone = icosahedron();
    let around = |v: u32| cone.triangles.iter().copied().filter(|t| t.contains(&v)).collect::<Vec<_>>();
    for v in 1..=12_usize {
        // v'' goes towards the cap around v.
        let offset = cone.directions[v - 1].map(|x| (-x * 60.0) as i32);
        let tets = cone.split(offset, &around(v as u32)).expect("a cap can be split off");
        assert_eq!(tets.len(), 25);
        let away = offset.map(|x| -x);
        assert_eq!(cone.split(away, &around(v as u32)), Err(UpdateError::Inverted { update: 0 }));
        // Two caps that do not touch: two loops. Two that touch in a vertex: a figure of eight.
        for w in 1..=12_usize {
            let distance: f64 =
                (0..3).map(|i| (cone.directions[v - 1][i] - cone.directions[w - 1][i]).powi(2)).sum();
            let two = [around(v as u32), around(w as u32)].concat();
            if distance > 3.0 {
                assert_eq!(cone.split(offset, &two), Err(UpdateError::Mask { update: 0 }));
            }
        }
    }
    for sides in [vec![], cone.triangles.clone()] {
        assert_eq!(cone.split([0, 0, 9], &sides), Err(UpdateError::Mask { update: 0 }));
    }
    let touching = cone.triangles.iter().find(|t| {
        !t.contains(&1)
            && t.iter().filter(|v| cone.triangles.iter().any(|u| u.contains(&1) && u.contains(v))).count()
                == 1
    });
    let eight = [cone.triangles[0], *touching.expect("such a triangle")];
    assert_eq!(cone.split([0, 0, 9], &eight), Err(UpdateError::Mask { update: 0 }));
}

/// A star that is bent so that two of its parts touch in an edge (0, 1) only. The split cuts through both parts
/// there, and its two new tetrahedra share a face, which they may only from different sides.
fn bent(last: &[[u32; 3]]) -> Cone {
    let mut directions = vec![[0.0, 0.0, 1.0]];
    directions.extend([-60.0, 0.0, 60.0, 100.0, 150.0, 230.0].map(|angle| direction(angle, 30.0)));
    directions.extend([30.0, 80.0, 125.0].map(|angle| direction(angle, -30.0)));
    directions.push([0.0, 0.0, -1.0]);
    if last.iter().flatten().any(|&v| v == 12) {
        directions.push(direction(190.0, -30.0));
    }
    // 2 3 4 and 5 6 7 are next to 1; 8 9 10 and, if it is used, 12 lie below, 11 at the bottom.
    let mut triangles = vec![[1, 2, 3], [1, 3, 4], [1, 5, 6], [1, 6, 7]];
    triangles.extend([[3, 4, 8], [4, 8, 9], [8, 9, 11], [9, 10, 11]]);
    triangles.extend(last);
    Cone { directions, triangles }
}

#[test]
fn new_tetrahedra_never_share_a_face_from_the_same_side() {
    let toward = |angle: f64| direction(angle, 0.0).map(|x| (x * 40.0) as i32);
    // The chain runs on to 6 7: the new tetrahedra at 3 and at 6 would both lie on the same side of (v', v'', 1).
    let cone = bent(&[[10, 11, 12], [6, 10, 12], [6, 7, 12]]);
    let far: Vec<[u32; 3]> =
        cone.triangles.iter().copied().filter(|t| *t != [1, 2, 3] && *t != [1, 5, 6]).collect();
    assert_eq!(cone.split(toward(-15.0), &far), Err(UpdateError::Mask { update: 0 }));
    // The chain runs on to 5 6: they lie on different sides.
    let cone = bent(&[[5, 9, 10], [5, 6, 10]]);
    let mut far = cone.triangles.clone();
    far.retain(|t| *t != [1, 2, 3] && *t != [1, 6, 7]);
    let tets = cone.split(toward(-100.0), &far).expect("a valid split");
    assert_eq!(tets.len(), cone.triangles.len() + 2);
}

#[test]
fn a_pinched_star_is_not_split() {
    let mut directions: Vec<[f64; 3]> = [0.0, 60.0, 120.0].map(|angle| direction(angle, 10.0)).to_vec();
    directions.push([0.0, 0.0, 1.0]);
    directions.extend([180.0, 240.0, 300.0].map(|angle| direction(angle, -10.0)));
    directions.push([0.0, 0.0, -1.0]);
    let cone = Cone { directions, triangles: vec![[1, 2, 4], [2, 3, 4], [5, 6, 8], [6, 7, 8]] };
    for far in [vec![[1, 2, 4]], vec![[5, 6, 8]], vec![[1, 2, 4], [5, 6, 8]]] {
        for offset in [[9, -3, 0], [-9, 3, 0], [0, 0, 9]] {
            assert_eq!(cone.split(offset, &far), Err(UpdateError::Star { update: 0 }));
        }
    }
}

/// A disc-shaped star of `n` tetrahedra around an axis from the centre.
fn wheel(n: u32) -> Cone {
    let mut directions = vec![[0.0, 0.0, 1.0]];
    directions.extend((0..n).map(|i| direction(360.0 * f64::from(i) / f64::from(n), -10.0)));
    let triangles = (0..n).map(|i| [1, 2 + i, 2 + (i + 1) % n]).collect();
    Cone { directions, triangles }
}

#[test]
fn stars_have_at_most_32_vertices_and_64_tetrahedra() {
    for n in [3, 8, 30, 31, 32, 33, 63, 64, 65, 100, 127, 128, 129, 200] {
        let cone = wheel(n);
        // One wedge for v'': a path of two triangles through the axis.
        let wedge: Vec<[u32; 3]> = cone.triangles[..n as usize / 2].to_vec();
        let result = cone.split([0, -6, 0], &wedge);
        if n < 32 {
            assert_eq!(result.map(|tets| tets.len()), Ok(n as usize + 2), "{n}");
        } else {
            assert_eq!(result, Err(UpdateError::Star { update: 0 }), "{n}");
        }
    }
}

/// The path of the fan touches the border on its way: side 0 falls into two parts.
#[test]
fn a_fan_may_touch_the_border() {
    // Triangles 2 3 1, 3 4 1, 4 5 1 around 1, which is on the border like all others; 1 is a border vertex.
    let mut directions = vec![[0.0, 0.0, 1.0]];
    directions.extend([-60.0, 0.0, 60.0, 120.0].map(|angle| direction(angle, 0.0)));
    let cone = Cone { directions, triangles: vec![[1, 2, 3], [1, 3, 4], [1, 4, 5]] };
    let tets = cone.split([-40, -20, 0], &[[1, 3, 4]]).expect("a valid split");
    assert_eq!(tets.len(), 5);
}

#[test]
fn a_mesh_that_was_not_told_of_an_update_refuses_it() {
    let built = build(Plan { domain: Domain::Cube(2), seed: 1, fields: 1, updates: 6 });
    let mt = prefix(&built.edge_mt(), 1);
    let mut mesh = CurrentMesh::new(mt.info(), mt.base()).expect("a valid base mesh");
    let before = snapshot(&mesh);
    assert_eq!(mt.refine(&mut mesh, UpdateId(0)), Err(UpdateError::UnknownToMesh { update: 0 }));
    assert_eq!(snapshot(&mesh), before);
    mt.updates_arrived(&mut mesh, 0);
    assert_eq!(mt.refine(&mut mesh, UpdateId(0)), Ok(Applied::Done));
}
