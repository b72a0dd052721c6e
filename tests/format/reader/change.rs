//! What an update of a file of kind 1, 2 or 3 does, and what reading these has in common.

use super::coded::{Coded, Row};

pub type Point = [i32; 3];
pub type Tet = [u32; 4];

/// An update: the vertices that it creates, what it removes and what it inserts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    /// By field.
    pub errors: Vec<u16>,
    pub positions: Vec<Point>,
    /// By new vertex, then by field.
    pub levels: Vec<Vec<i32>>,
    pub removed: Vec<Tet>,
    pub inserted: Vec<Tet>,
    /// In files with flag 0: how far errors fall for all that is removed, and how often they are quartered for each of
    /// these.
    pub own: Option<(u32, Vec<u32>)>,
}

/// Reads the errors of an update, given those of the one before.
pub fn errors(coded: &mut Coded<'_>, fall: Row, before: &mut [u16]) -> Vec<u16> {
    for error in before.iter_mut() {
        let fall = u16::try_from(coded.number(fall, 0)).expect("16 bits");
        *error = error.wrapping_sub(fall);
    }
    before.to_vec()
}

/// The error that a code stands for.
pub fn error_of(code: u16) -> f64 {
    let bits = (u32::from(code) + (102 << 11)) << 12;
    if code == 0 { 0.0 } else { f64::from(f32::from_bits(bits)) }
}

pub fn sorted(mut tet: Tet) -> Tet {
    tet.sort_unstable();
    tet
}

/// The corners of a face, by the corner opposite.
pub fn face(tet: Tet, corner: usize) -> [u32; 3] {
    [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]][corner].map(|i: usize| tet[i])
}
