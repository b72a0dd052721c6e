//! What the axes of an array are: of space, of time, or of channels.

use crate::error::ReadReason;
use crate::grid::MAX_GRID_POINTS;

/// An axis as the metadata describe it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Axis {
    /// Empty if it has none.
    pub name: String,
    pub role: Role,
    pub unit: String,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Role {
    Space,
    Time,
    Channel,
    /// Its name does not say it.
    #[default]
    Unknown,
}

impl Axis {
    pub fn named(name: &str) -> Self {
        let role = match name.to_ascii_lowercase().as_str() {
            "x" | "y" | "z" => Role::Space,
            "t" | "time" => Role::Time,
            "c" | "ch" | "channel" | "channels" => Role::Channel,
            _ => Role::Unknown,
        };
        Self { name: name.to_owned(), role, unit: String::new() }
    }
}

/// The axes of an array of a volume, by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Axes {
    /// Those of x, y and z.
    pub space: [usize; 3],
    pub time: Option<usize>,
    pub channel: Option<usize>,
}

impl Axes {
    /// Which axes are which, of an array of this shape. Three axes that are not called x, y and z are taken to run z, y, x, as arrays in
    /// memory do; before them, axes without a known name and of one sample are no matter.
    pub fn of(all: &[Axis], shape: &[u64]) -> Result<Self, ReadReason> {
        let with = |role: Role| (0..all.len()).filter(move |&i| all[i].role == role);
        let mut space: Vec<usize> =
            (0..all.len()).filter(|&i| matches!(all[i].role, Role::Space | Role::Unknown)).collect();
        while space.len() > 3
            && let Some(at) = space.iter().position(|&i| shape[i] == 1 && all[i].role == Role::Unknown)
        {
            space.remove(at);
        }
        let [time, channel] = [Role::Time, Role::Channel].map(|role| (with(role).next(), with(role).count()));
        if time.1 > 1 || channel.1 > 1 || space.len() != 3 {
            let what = format!("an array with the axes {}", listed(all, shape));
            let remedy = if space.len() < 3 {
                "a volume has three axes of space: stack its slices to a volume"
            } else {
                "a volume has the axes z, y and x, and may have t for time and c for channels: name them so, in dimension_names (version 3), the \
                 attribute _ARRAY_DIMENSIONS (version 2) or OME's axes"
            };
            return Err(ReadReason::unsupported(what, remedy));
        }
        let by_name = |name: &str| space.iter().copied().find(|&i| all[i].name.eq_ignore_ascii_case(name));
        let named = [by_name("x"), by_name("y"), by_name("z")];
        let space = match named {
            [Some(x), Some(y), Some(z)] => [x, y, z],
            _ => [space[2], space[1], space[0]],
        };
        Ok(Self { space, time: time.0, channel: channel.0 })
    }

    /// How many samples there are along x, y and z.
    pub fn dims(&self, shape: &[u64]) -> [u64; 3] {
        self.space.map(|axis| shape[axis])
    }

    /// How many times, or channels, there are.
    pub fn count(axis: Option<usize>, shape: &[u64]) -> Result<usize, ReadReason> {
        let count = axis.map_or(1, |axis| shape[axis]);
        let limit = MAX_GRID_POINTS;
        if count > limit {
            return Err(ReadReason::TooLarge { what: "time steps or channels".into(), limit });
        }
        Ok(count as usize)
    }
}

/// Axes with their lengths: "t (3), y (5), x (7)", or "3 x 5 x 7" where they have no names.
pub(super) fn listed(all: &[Axis], shape: &[u64]) -> String {
    if all.iter().all(|axis| axis.name.is_empty()) {
        return shape.iter().map(u64::to_string).collect::<Vec<_>>().join(" x ");
    }
    let each = all.iter().zip(shape).map(|(axis, count)| format!("{} ({count})", axis.name));
    each.collect::<Vec<_>>().join(", ")
}

/// What lengths along x, y and z are multiplied by so that all are in the unit of x, by powers of ten.
pub(super) fn to_one_unit(units: [&str; 3]) -> Result<[f64; 3], ReadReason> {
    let mut factors = [1.0; 3];
    for (factor, unit) in factors.iter_mut().zip(units) {
        if unit == units[0] || unit.is_empty() || units[0].is_empty() {
            continue;
        }
        let [Some(own), Some(of_x)] = [power(unit), power(units[0])] else {
            let what = format!("a grid with x in \"{}\" and another axis in \"{unit}\"", units[0]);
            return Err(ReadReason::unsupported(what, "give all axes of space the same unit"));
        };
        *factor = POWERS[(own - of_x + ZERO) as usize];
    }
    Ok(factors)
}

/// Powers of ten from -18 on.
const POWERS: [f64; 37] = [
    1e-18, 1e-17, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3,
    1e-2, 1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18,
];
const ZERO: i32 = 18;

/// Units of length by the power of ten that makes them of metres.
fn power(unit: &str) -> Option<i32> {
    Some(match unit {
        "femtometer" | "fm" => -15,
        "picometer" | "pm" => -12,
        "angstrom" | "Å" => -10,
        "nanometer" | "nm" => -9,
        "micrometer" | "micron" | "µm" | "μm" | "um" => -6,
        "millimeter" | "mm" => -3,
        "centimeter" | "cm" => -2,
        "decimeter" | "dm" => -1,
        "meter" | "m" => 0,
        "kilometer" | "km" => 3,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(names: &[&str], shape: &[u64]) -> Result<Axes, String> {
        let all: Vec<Axis> = names.iter().map(|name| Axis::named(name)).collect();
        Axes::of(&all, shape).map_err(|reason| reason.to_string())
    }

    #[test]
    fn axes_are_known_by_their_names() {
        let of = |space, time, channel| Ok(Axes { space, time, channel });
        assert_eq!(axes(&["z", "y", "x"], &[2, 3, 4]), of([2, 1, 0], None, None));
        assert_eq!(axes(&["x", "y", "z"], &[2, 3, 4]), of([0, 1, 2], None, None));
        assert_eq!(axes(&["", "", ""], &[2, 3, 4]), of([2, 1, 0], None, None));
        assert_eq!(axes(&["t", "c", "z", "y", "x"], &[5; 5]), of([4, 3, 2], Some(0), Some(1)));
        assert_eq!(axes(&["time", "level", "lat", "lon"], &[5; 4]), of([3, 2, 1], Some(0), None));
        assert_eq!(axes(&["", "", "", "", ""], &[1, 1, 2, 2, 2]), of([4, 3, 2], None, None));
        assert_eq!(axes(&["Y", "c", "X", "Z"], &[2; 4]), of([2, 0, 3], None, Some(1)));
    }

    #[test]
    fn axes_that_are_no_volume_are_listed() {
        let refused = |names: &[&str], shape: &[u64]| axes(names, shape).unwrap_err();
        assert!(refused(&["t", "y", "x"], &[3, 4, 5]).contains("t (3), y (4), x (5)"));
        assert!(refused(&["", "", "", ""], &[2, 3, 4, 5]).contains("2 x 3 x 4 x 5"));
        assert!(refused(&["w", "z", "y", "x"], &[2; 4]).contains("dimension_names"));
        assert!(refused(&["y", "x"], &[2; 2]).contains("stack"));
        assert!(refused(&["t", "time", "z", "y", "x"], &[2; 5]).contains("t (2), time (2)"));
        assert!(refused(&[], &[]).contains("stack"));
    }

    #[test]
    fn lengths_come_to_one_unit() {
        assert_eq!(to_one_unit(["nanometer", "nm", "micrometer"]), Ok([1.0, 1.0, 1e3]));
        assert_eq!(to_one_unit(["m", "cm", ""]), Ok([1.0, 1e-2, 1.0]));
        assert_eq!(to_one_unit(["parsec"; 3]), Ok([1.0; 3]));
        assert!(to_one_unit(["km", "parsec", "km"]).unwrap_err().to_string().contains("parsec"));
    }
}
