//! Does the input have the extremes that the MT states, where it states them?

use super::report::{VerifyReport, note};
use tetralod::mesh::{Extreme, Extremes, Field, TetMesh};
use tetralod::mt::{FieldInfo, MtInfo};

/// Checks what is stated of each field against the input's values and places.
pub fn check(info: &MtInfo, input: &TetMesh, report: &mut VerifyReport) {
    for field in &info.fields {
        let Some(found) = input.fields.iter().find(|found| field.is_of(found)) else { continue };
        let fault = fault(field, found, input);
        let place = format!("extremes of field '{}'", field.name);
        fault.iter().for_each(|fault| note(report, &place, fault));
    }
}

fn fault(field: &FieldInfo, found: &Field, TetMesh { positions, sides, .. }: &TetMesh) -> Option<String> {
    let places = || positions.iter().chain(sides.iter().map(|side| &positions[side.point as usize]));
    let values = || found.all_values().copied().zip(places().copied());
    if let (Some(stated), Some(known)) = (&field.extremes, Extremes::of(values())) {
        for (stated, known) in stated.both().into_iter().zip(known.both()) {
            let Extreme { value, place, .. } = stated;
            if *value != known.value {
                return Some(format!("{value} is stated, that of the input is {}", known.value));
            }
            // Of equal values any may be the first in another order of the points.
            if !values().any(|at| at == (*value, *place)) {
                return Some(format!("the input does not have {value} at {place:?}"));
            }
        }
    }
    match (&field.averaged, &found.averaged) {
        (Some(stated), Some(known)) if stated != known => {
            Some(format!("averaged from cells as {stated:?}, the input is as {known:?}"))
        }
        _ => None,
    }
}
