//! Promise: values are rounded to the nearest level, and the floor of the error is what the lattices round off.

use crate::support::files::{field, small_info};
use tetralod::mt::MtKind;

#[test]
fn levels_are_the_nearest() {
    let field = field("h", 4);
    for i in -40..=200 {
        let value = field.origin + 0.0625 * field.step * f64::from(i);
        let distance = |level: i32| (field.value(level) - value).abs();
        let nearest = distance(field.nearest(value));
        assert!((0..1 << field.bits).all(|level| nearest <= distance(level)), "{value}");
    }
}

#[test]
fn the_floor_is_what_positions_or_values_round_off() {
    let mut info = small_info(MtKind::Edge, 8, vec![field("h", 8), field("k", 8)], [4, 1, 0]);
    info.displacement_per_error = 2.0;
    info.quantization = 0.5;
    info.fields[0].quantization = 0.1 * info.fields[0].range();
    info.fields[1].quantization = 0.4 * info.fields[1].range();
    assert_eq!(info.floor(0), 0.25, "positions");
    assert!((info.floor(1) - 0.4).abs() < 1e-15, "values");
    // No displacement is allowed for, so none counts.
    info.displacement_per_error = 0.0;
    assert!((info.floor(0) - 0.1).abs() < 1e-15);
}
