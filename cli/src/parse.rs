//! What stands on the command line: numbers, alone, in lists, with a percent sign or a unit, and names of a list.

use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::str::FromStr;
use tetralod::geom::Bounds;
use tetralod::view::Plane;

/// An error in units of a field, or as a fraction of its range.
#[derive(Clone, Copy, Debug)]
pub enum Tolerance {
    Absolute(f64),
    Relative(f64),
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, relative) = percentage(text)?;
        if number < 0.0 {
            return Err("an error must be at least 0".to_owned());
        }
        Ok(if relative { Self::Relative(number / 100.0) } else { Self::Absolute(number) })
    }
}

impl Tolerance {
    /// As a fraction of the field's range.
    pub fn relative(self, range: f64) -> f64 {
        match self {
            Self::Absolute(error) => error / range,
            Self::Relative(error) => error,
        }
    }
}

/// A number, and whether % stands behind it.
fn percentage(text: &str) -> Result<(f64, bool), String> {
    match text.trim().strip_suffix('%') {
        Some(number) => Ok((parse_number(number)?, true)),
        None => Ok((parse_number(text)?, false)),
    }
}

/// A whole number that is not negative.
pub fn parse_count<T: FromStr>(text: &str) -> Result<T, String> {
    text.trim().parse().map_err(|_| format!("'{text}' is not a whole number of at least 0, or too large"))
}

/// A finite number.
pub fn parse_number(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("'{text}' is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(format!("'{text}' is not finite")) }
}

/// Finite numbers between commas.
pub fn parse_list(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(parse_number).collect()
}

/// `N` finite numbers between commas; `what` has so many.
pub fn parse_numbers<const N: usize>(text: &str, what: &str) -> Result<[f64; N], String> {
    let numbers = parse_list(text)?;
    let found = numbers.len();
    numbers.try_into().map_err(|_| format!("{what} has {N} numbers, not {found}"))
}

/// A box by its smaller and its larger corner.
pub fn parse_bounds(text: &str) -> Result<Bounds, String> {
    let [x0, y0, z0, x1, y1, z1] = parse_numbers(text, "a box")?;
    if x0 > x1 || y0 > y1 || z0 > z1 {
        return Err("the smaller corner of a box must come first".to_owned());
    }
    Ok(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
}

/// A plane: x=D, y=D or z=D, or its normal and n · p.
pub fn parse_plane(text: &str) -> Result<Plane, String> {
    if let Some((axis, offset)) = text.split_once('=') {
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis.trim());
        let axis = axis.ok_or_else(|| format!("'{text}' is not x=, y= or z= and a number"))?;
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        return Ok(Plane { normal, offset: parse_number(offset)? });
    }
    let [x, y, z, offset] = parse_numbers(text, "a plane")?;
    if [x, y, z] == [0.0; 3] {
        return Err("the normal of a plane must not be 0,0,0".to_owned());
    }
    Ok(Plane { normal: [x, y, z], offset })
}

/// Two values, the smaller one first.
pub fn parse_range(text: &str) -> Result<[f64; 2], String> {
    let [low, high] = parse_numbers(text, "a range")?;
    if low > high { Err("the smaller value of a range must come first".to_owned()) } else { Ok([low, high]) }
}

/// A number that is not negative.
pub fn parse_size(text: &str) -> Result<f64, String> {
    let number = parse_number(text)?;
    if number >= 0.0 { Ok(number) } else { Err(format!("'{text}' is negative")) }
}

/// A number that is larger than 0.
pub fn parse_positive(text: &str) -> Result<f64, String> {
    let number = parse_number(text)?;
    if number > 0.0 { Ok(number) } else { Err(format!("'{text}' is not larger than 0")) }
}

/// A part of 1, or a percentage.
pub fn parse_share(text: &str) -> Result<f64, String> {
    let (number, percent) = percentage(text)?;
    let share = if percent { number / 100.0 } else { number };
    if share >= 0.0 { Ok(share) } else { Err(format!("'{text}' is negative")) }
}

/// A number of bytes; K, M and G stand for powers of 1024.
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
    let shift = match text[digits.len()..].trim() {
        "" | "B" => 0,
        "K" | "k" | "KiB" => 10,
        "M" | "MiB" => 20,
        "G" | "GiB" => 30,
        unit => return Err(format!("'{unit}' is not a unit of bytes; the units are K, M and G")),
    };
    let number = parse_size(digits)? * f64::from(1_u32 << shift);
    // The largest number of bytes that a float still counts one by one.
    if number <= (1_u64 << 53) as f64 { Ok(number as u64) } else { Err(format!("'{text}' is too large")) }
}

/// A number of bytes that is large enough for a shard of a file, or `none`, which is more than any file has.
pub fn parse_shard_size(text: &str) -> Result<u64, String> {
    if text == "none" {
        return Ok(u64::MAX);
    }
    let size = parse_bytes(text)?;
    if size < 64 << 10 { Err(format!("'{text}' is less than 64K")) } else { Ok(size) }
}

/// A number that `fits`; `expected` says which do.
pub fn number(text: &str, fits: impl Fn(f64) -> bool, expected: &str) -> anyhow::Result<f64> {
    text.trim().parse().ok().filter(|x| fits(*x)).with_context(|| format!("it must be {expected}"))
}

/// Names for the help, and what each stands for.
pub fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(|(name, _)| name)).try_map(move |name| named(&name, &all))
}

/// What has this name.
pub fn named<T: Copy>(text: &str, all: &[(&str, T)]) -> anyhow::Result<T> {
    let found = all.iter().find(|(name, _)| *name == text).map(|&(_, value)| value);
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    found.with_context(|| format!("it must be one of: {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_units() {
        let read = |text: &str| parse_bytes(text).ok();
        assert_eq!(
            ["17", "2K", "1.5M", "3 G", "1MiB"].map(read),
            [Some(17), Some(2048), Some(3 << 19), Some(3 << 30), Some(1 << 20)]
        );
        assert_eq!(["", "K", "1T", "-1", "1e300G", "1 2"].map(read), [None; 6]);
        let size = |text: &str| parse_shard_size(text).ok();
        assert_eq!(
            ["64K", "25M", "none", "63K", "0", "all"].map(size),
            [Some(1 << 16), Some(25 << 20), Some(u64::MAX), None, None, None]
        );
    }
}
