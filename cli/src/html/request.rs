//! A request as the page makes it: the options of `Viewer.refine` as JSON.

use serde_json::{Map, Value, json};
use tetralod::mt::Regions;
use tetralod::refine::{Budget, Need, Part, Region, Transfer};

/// The options that make the same request in a page; the field that is shown has this number.
pub fn options<'a>(
    needs: impl Iterator<Item = &'a Need>,
    budget: &Budget,
    field: usize,
    regions: Option<&Regions>,
) -> Value {
    let needs: Vec<Value> = needs.map(|need| options_of(need, regions)).collect();
    let mut all = match <[Value; 1]>::try_from(needs) {
        Ok([Value::Object(only)]) => only,
        Ok([other]) => Map::from_iter([("needs".to_owned(), json!([other]))]),
        Err(needs) => Map::from_iter([("needs".to_owned(), json!(needs))]),
    };
    all.entry("field").or_insert_with(|| json!(field));
    let limits = [
        ("maxTets", budget.tets.map(u64::from)),
        ("maxVertices", budget.vertices.map(u64::from)),
        ("maxBytes", budget.bytes),
    ];
    let given = limits.into_iter().filter_map(|(name, limit)| Some((name.to_owned(), json!(limit?))));
    all.extend(given);
    Value::Object(all)
}

fn options_of(need: &Need, regions: Option<&Regions>) -> Value {
    let mut own = Map::new();
    let mut set = |name: &str, value: Value| own.insert(name.to_owned(), value);
    let mut field = need.field;
    match &need.part {
        Part::Everywhere => {}
        Part::Region(region) => {
            set_region(region, &mut set);
        }
        Part::Values(values) => {
            field = field.or(Some(values.field));
            set("ranges", json!(values.ranges));
        }
        Part::Both(region, values) => {
            field = field.or(Some(values.field));
            set_region(region, &mut set);
            set("ranges", json!(values.ranges));
        }
        Part::View(view) => {
            let pixels = need.error;
            set("view", json!({ "matrix": view.matrix, "viewport": view.viewport, "pixels": pixels }));
        }
        Part::Transfer(Transfer { field: of, points, unit_length }) => {
            field = Some(*of);
            let points: Vec<[f64; 5]> =
                points.iter().map(|&(value, [r, g, b, a])| [value, r, g, b, a]).collect();
            set("transfer", json!({ "points": points, "unitLength": unit_length }));
            set("error", json!(need.error));
        }
    }
    if !matches!(need.part, Part::View(_) | Part::Transfer(_)) {
        set("error", json!(percentage(need.error)));
    }
    if let Some(field) = field {
        set("field", json!(field));
    }
    if let (Some(chosen), Some(regions)) = (&need.regions, regions) {
        let names: Vec<&str> = chosen.iter().map(|&at| regions.all[usize::from(at)].name.as_str()).collect();
        set("regions", json!(names));
    }
    Value::Object(own)
}

fn set_region(region: &Region, set: &mut impl FnMut(&str, Value) -> Option<Value>) {
    match region {
        Region::Box(bounds) => set("box", json!([bounds.min, bounds.max].as_flattened())),
        Region::OrientedBox { centre, halves } => {
            set("orientedBox", json!({ "center": centre, "halfAxes": halves.as_flattened() }))
        }
        Region::Sphere { centre, radius } => set("sphere", json!({ "center": centre, "radius": radius })),
        Region::HalfSpace { normal, offset } => {
            set("halfSpace", json!({ "normal": normal, "offset": offset }))
        }
        Region::Slab { normal, offset, thickness } => {
            set("slab", json!({ "normal": normal, "offset": offset, "thickness": thickness }))
        }
        Region::Convex(planes) => set("planes", json!(planes)),
    };
}

/// A part of a range as the text that is read as it, or as the next larger number: a page must not need more than was asked for here.
fn percentage(error: f64) -> String {
    let near = 100.0 * error;
    let enough = [near.next_down().max(0.0), near].into_iter().find(|percent| percent / 100.0 >= error);
    format!("{}%", enough.unwrap_or(near.next_up()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetralod::geom::Bounds;

    #[test]
    fn percentages_are_read_as_no_less_than_what_they_are_of() {
        for i in 1..2000 {
            for error in [f64::from(i) / 1000.0, 1.0 / f64::from(i)] {
                let text = percentage(error);
                let read: f64 = text.trim_end_matches('%').parse().expect("a number");
                assert!([error, error.next_up()].contains(&(read / 100.0)), "{error}: {text}");
            }
        }
        assert_eq!(["1%", "0%"], [0.01, 0.0].map(percentage));
    }

    #[test]
    fn needs_have_the_names_of_javascript() {
        let inside = Region::Box(Bounds { min: [0.0; 3], max: [1.0, 2.0, 3.0] });
        let needs =
            [Need::within(0.01).inside(inside).between(1, vec![[5.0, 5.0]]), Need::within(0.1).of_field(2)];
        let budget = Budget { tets: Some(9), ..Budget::default() };
        assert_eq!(
            options(needs.iter(), &budget, 1, None),
            json!({
                "needs": [
                    { "box": [0.0, 0.0, 0.0, 1.0, 2.0, 3.0], "ranges": [[5.0, 5.0]], "error": "1%", "field": 1 },
                    { "error": "10%", "field": 2 },
                ],
                "field": 1,
                "maxTets": 9,
            })
        );
        assert_eq!(
            options(needs[1..].iter(), &Budget::default(), 0, None),
            json!({ "error": "10%", "field": 2 })
        );
    }
}
