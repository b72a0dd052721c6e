//! A stand-in that the base mesh coder replaces.
use crate::format::FormatError;
use crate::format::coder::Family;
use crate::format::coder::Put;
use crate::format::coder::Source;
use crate::mt::BaseMesh;

const POSITION: Family = Family::NONE.numbers_after(3, 2);
const CORNER: Family = POSITION.numbers_after(4, 2);
pub const LAST: Family = CORNER;
pub const FAMILIES: [Family; 2] = [POSITION, CORNER];

pub fn put(out: &mut impl Put, base: &BaseMesh) {
    let mut last = [0; 3];
    for p in &base.positions {
        for (axis, (x, last)) in (0..).zip(p.iter().zip(&mut last)) {
            out.signed(POSITION, axis, x - *last);
            *last = *x;
        }
    }
    let mut last = 0;
    for tet in &base.tets {
        for (corner, &v) in (0..).zip(tet) {
            out.signed(CORNER, corner, v as i32 - last);
            last = v as i32;
        }
    }
}

pub fn read(source: &mut Source<'_>, vertices: u32, tets: u32) -> Result<BaseMesh, FormatError> {
    let mut base = BaseMesh::default();
    let mut last = [0_i32; 3];
    for _ in 0..vertices {
        for (axis, x) in (0..).zip(&mut last) {
            *x = x.wrapping_add(source.signed(POSITION, axis)?);
        }
        base.positions.push(last);
    }
    let mut last = 0_i32;
    for _ in 0..tets {
        let mut tet = [0; 4];
        for (corner, v) in (0..).zip(&mut tet) {
            last = last.wrapping_add(source.signed(CORNER, corner)?);
            *v = last as u32;
        }
        base.tets.push(tet);
    }
    Ok(base)
}
