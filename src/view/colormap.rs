//! Colour maps: tables from a fraction of a field's range to a colour.

/// A colour map given by evenly spaced control colours (sRGB), linear in between.
#[derive(Clone, Copy, Debug)]
pub struct Colormap {
    /// The name that legends show.
    pub name: &'static str,
    controls: &'static [[u8; 3]],
}

/// *viridis* by Stéfan van der Walt and Nathaniel Smith (matplotlib, released under CC0): perceptually uniform, and
/// readable with the common colour deficiencies. Every 17th of its 256 published colours; what lies between
/// differs from the published table by at most 7/255 in a channel.
pub const VIRIDIS: Colormap = Colormap {
    name: "viridis",
    controls: &[
        [0x44, 0x01, 0x54],
        [0x48, 0x1a, 0x6c],
        [0x47, 0x2f, 0x7d],
        [0x41, 0x44, 0x87],
        [0x39, 0x56, 0x8c],
        [0x31, 0x68, 0x8e],
        [0x2a, 0x78, 0x8e],
        [0x23, 0x88, 0x8e],
        [0x1f, 0x98, 0x8b],
        [0x22, 0xa8, 0x84],
        [0x35, 0xb7, 0x79],
        [0x54, 0xc5, 0x68],
        [0x7a, 0xd1, 0x51],
        [0xa5, 0xdb, 0x36],
        [0xd2, 0xe2, 0x1b],
        [0xfd, 0xe7, 0x25],
    ],
};

impl Colormap {
    /// The colour at `fraction` of the range, as sRGB components from 0 to 1. Fractions outside 0 ..= 1 get the
    /// colour of the nearer end, NaN that of the lower one.
    pub fn at(&self, fraction: f32) -> [f32; 3] {
        let last = self.controls.len() - 1;
        let place = if fraction.is_nan() { 0.0 } else { fraction.clamp(0.0, 1.0) * last as f32 };
        let below = (place as usize).min(last);
        let [low, high] =
            [below, (below + 1).min(last)].map(|i| self.controls[i].map(|c| f32::from(c) / 255.0));
        let t = place - below as f32;
        [0, 1, 2].map(|i| low[i] + t * (high[i] - low[i]))
    }

    /// `N` colours from the lower to the upper end of the range, as `RGBA` bytes.
    pub fn table<const N: usize>(&self) -> [[u8; 4]; N] {
        std::array::from_fn(|i| {
            let fraction = if N > 1 { i as f32 / (N - 1) as f32 } else { 0.0 };
            let [r, g, b] = self.at(fraction).map(|c| (c * 255.0).round() as u8);
            [r, g, b, 255]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_goes_through_published_colours() {
        let table = VIRIDIS.table::<256>();
        // Entries 0, 64, 128, 192 and 255 of matplotlib's list; the middle ones are no control colours.
        let published = [
            (0, [68, 1, 84]),
            (64, [59, 82, 139]),
            (128, [33, 145, 140]),
            (192, [94, 201, 98]),
            (255, [253, 231, 37]),
        ];
        for (i, colour) in published {
            let near = (0..3).all(|c| i32::from(table[i][c]).abs_diff(colour[c]) <= 3);
            assert!(near, "entry {i}: {:?} instead of {colour:?}", table[i]);
        }
    }

    #[test]
    fn brightness_only_rises() {
        let luma =
            |c: [u8; 4]| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
        let table = VIRIDIS.table::<64>();
        assert!(table.windows(2).all(|pair| luma(pair[0]) < luma(pair[1])));
    }

    #[test]
    fn fractions_out_of_range_are_held() {
        assert_eq!(VIRIDIS.at(-3.0), VIRIDIS.at(0.0));
        assert_eq!(VIRIDIS.at(7.0), VIRIDIS.at(1.0));
        assert_eq!(VIRIDIS.at(f32::NAN), VIRIDIS.at(0.0));
    }
}
