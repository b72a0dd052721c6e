//! The same MT with its updates in another order.

use crate::subjects::{Subject, sorted};
use tetralod::mt::{EdgeMt, ExplicitMt, ExplicitUpdate, MultiTessellation, UpdateId, VertexId};

/// A random order of the updates in which parents come first.
pub fn random_order(explicit: &ExplicitMt, mut below: impl FnMut(usize) -> usize) -> Vec<UpdateId> {
    let updates = || (0..explicit.updates()).map(UpdateId);
    let mut missing: Vec<usize> = updates().map(|u| explicit.parents(u).len()).collect();
    let mut ready: Vec<UpdateId> = updates().filter(|u| missing[u.0 as usize] == 0).collect();
    let mut order = Vec::new();
    while !ready.is_empty() {
        let u = ready.swap_remove(below(ready.len()));
        order.push(u);
        for child in explicit.children(u) {
            missing[child as usize] -= 1;
            if missing[child as usize] == 0 {
                ready.push(UpdateId(child));
            }
        }
    }
    order
}

/// The subject with its updates in `order`; the update that was `order[i]` is number `i`.
pub fn reordered(subject: &Subject, order: &[UpdateId]) -> Subject {
    let old = &subject.explicit;
    let base = old.base().positions.len() as u32;
    let mut vertex: Vec<u32> = (0..old.vertices()).collect();
    let mut tet: Vec<u32> = (0..old.tets().len() as u32).collect();
    let mut new = ExplicitMt::new(old.info().clone(), old.base().clone());
    let mut next = base;
    for &u in order {
        let created: Vec<VertexId> = old.created(u).map(VertexId).collect();
        for v in &created {
            vertex[v.0 as usize] = next;
            next += 1;
        }
        let positions: Vec<[i32; 3]> = created.iter().map(|&v| old.position(v)).collect();
        let levels: Vec<i32> = created.iter().flat_map(|&v| old.levels(v).to_vec()).collect();
        let removed: Vec<u32> = old.removed(u).iter().map(|&t| tet[t as usize]).collect();
        let renamed = |t: u32| old.tets()[t as usize].map(|v| vertex[v as usize]);
        let inserted: Vec<[u32; 4]> = old.inserted(u).map(renamed).collect();
        let first = new.tets().len() as u32;
        let errors = old.errors(u);
        let update = ExplicitUpdate {
            positions: &positions,
            levels: &levels,
            removed: &removed,
            inserted: &inserted,
            errors,
        };
        new.push(&update).expect("a topological order");
        // It sorts what is inserted.
        let corners = |t: [u32; 4]| sorted(t);
        for (t, named) in old.inserted(u).zip(&inserted) {
            let same = |at: &u32| corners(new.tets()[*at as usize]) == corners(*named);
            tet[t as usize] = (first..new.tets().len() as u32).find(same).expect("it was inserted");
        }
    }
    let mt = EdgeMt::from_explicit(&new).expect("the same splits");
    Subject::of(subject.input.clone(), mt)
}
