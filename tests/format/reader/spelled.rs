//! Blocks of updates that are spelled out.

use super::change::{Change, Point, Tet};
use super::coded::{
    CORNER, COUNT, Coded, DIFFERENCE, LEVEL_DIFFERENCE, OWN_FALL, QUARTERS, REMOVED, SPELLED_FALL,
};
use super::growth::volume;
use super::wire::Info;
use super::{File, change};
use std::collections::BTreeSet;

/// All vertices and tetrahedra so far, by their numbers.
pub struct Spelled<'a> {
    info: &'a Info,
    pub positions: Vec<Point>,
    pub tets: Vec<Tet>,
    pub is_removed: Vec<bool>,
    tet_errors: bool,
}

/// What goes on from one update of a block to the next.
struct Before {
    errors: Vec<u16>,
    position: Point,
    levels: Vec<i32>,
}

impl<'a> Spelled<'a> {
    pub fn new(file: &'a File) -> Self {
        Self {
            info: &file.info,
            positions: file.base.positions.clone(),
            tets: file.base.tets.clone(),
            is_removed: vec![false; file.base.tets.len()],
            tet_errors: file.tet_errors,
        }
    }

    pub fn block(&mut self, coded: &mut Coded<'_>, updates: usize) -> Vec<Change> {
        let fields = self.info.fields.len();
        let mut before = Before { errors: vec![65_535; fields], position: [0; 3], levels: vec![0; fields] };
        (0..updates).map(|_| self.update(coded, &mut before)).collect()
    }

    fn update(&mut self, coded: &mut Coded<'_>, before: &mut Before) -> Change {
        let errors = change::errors(coded, SPELLED_FALL, &mut before.errors);
        let mut change = Change { errors, ..Change::default() };
        let first = self.positions.len() as u32;
        for _ in 0..coded.number(COUNT, 0) {
            for (axis, x) in before.position.iter_mut().enumerate() {
                *x += coded.signed(DIFFERENCE, axis as u32);
                assert!((0..=1 << self.info.bits).contains(x));
            }
            for (level, field) in before.levels.iter_mut().zip(&self.info.fields) {
                *level += coded.signed(LEVEL_DIFFERENCE, 0);
                assert!((0..1 << field.bits).contains(level));
            }
            change.positions.push(before.position);
            change.levels.push(before.levels.clone());
        }
        self.positions.extend(&change.positions);
        let removed = coded.number(COUNT, 1);
        let mut t = self.tets.len() - 1;
        for i in 0..removed {
            t -= if i == 0 {
                coded.number(REMOVED, 0) as usize
            } else {
                1 + coded.number(REMOVED, 1) as usize
            };
            assert!(!self.is_removed[t], "removed twice");
            self.is_removed[t] = true;
            change.removed.push(self.tets[t]);
        }
        if self.tet_errors {
            let (fall, mut before) = (coded.symbol(OWN_FALL, 0), 0);
            let mut next = || {
                before = coded.symbol(QUARTERS, 2 * before);
                before
            };
            change.own = Some((fall, (0..removed).map(|_| next()).collect()));
        }
        let known: BTreeSet<u32> = change.removed.iter().flatten().copied().collect();
        let places: Vec<u32> = known.into_iter().chain(first..self.positions.len() as u32).collect();
        let mut p = 0;
        for _ in 0..coded.number(COUNT, 2) {
            let mut place = p;
            let mut corner = |which| {
                place += coded.number(CORNER, which) as usize;
                (place, places[place])
            };
            let (a, b, c) = (corner(0), corner(1), corner(2));
            // Not from `c` on.
            let d = b.0 + coded.number(CORNER, 3) as usize;
            p = a.0;
            let tet = [a.1, b.1, c.1, places[d]];
            assert!(tet[0] < tet[1] && tet[1] < tet[2] && tet[1] < tet[3]);
            assert!(volume(tet.map(|v| self.positions[v as usize])) > 0);
            change.inserted.push(tet);
        }
        assert!(!change.removed.is_empty() && !change.inserted.is_empty());
        change.inserted.sort_unstable();
        self.tets.extend(&change.inserted);
        self.is_removed.resize(self.tets.len(), false);
        change
    }
}
