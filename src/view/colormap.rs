//! Colour maps: tables from a fraction of a field's range to a colour.

mod tables;

/// A colour map given by evenly spaced control colours (sRGB), linear in between. [`Colormap::ALL`] lists
/// those that there are; each is within 4/255 of its published table in every channel.
///
/// ```
/// use tetralod::view::Colormap;
///
/// let map = Colormap::named("batlow").expect("one of them");
/// assert!(!map.is_diverging());
/// let [r, g, b] = map.at(0.0);
/// assert!(r < g && g < b);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colormap {
    /// The name that legends show: lower case, unique.
    pub name: &'static str,
    controls: &'static [[u8; 3]],
    is_diverging: bool,
}

/// *viridis* by Stéfan van der Walt and Nathaniel Smith (matplotlib, released under CC0): blue to green to
/// yellow. Perceptually uniform, and readable with the common colour deficiencies.
pub const VIRIDIS: Colormap = Colormap::plain("viridis", tables::VIRIDIS);

/// *magma* by Stéfan van der Walt and Nathaniel Smith (matplotlib, released under CC0): black to purple to a
/// light yellow.
pub const MAGMA: Colormap = Colormap::plain("magma", tables::MAGMA);

/// *inferno* by Stéfan van der Walt and Nathaniel Smith (matplotlib, released under CC0): black to red to
/// yellow.
pub const INFERNO: Colormap = Colormap::plain("inferno", tables::INFERNO);

/// *plasma* by Stéfan van der Walt and Nathaniel Smith (matplotlib, released under CC0): blue to red to
/// yellow; bright at both ends.
pub const PLASMA: Colormap = Colormap::plain("plasma", tables::PLASMA);

/// *cividis* by Jamie Nuñez, Christopher Anderton and Ryan Renslow (*PLoS ONE*, 2018; the table is
/// matplotlib's, under its BSD-like licence): blue to yellow; looks the same with red-green deficiencies.
pub const CIVIDIS: Colormap = Colormap::plain("cividis", tables::CIVIDIS);

/// *turbo* by Anton Mikhailov (Google, 2019; the table is matplotlib's, under its BSD-like licence): a
/// rainbow with smooth brightness, for details in values. It is brightest in the middle, so it is neither
/// sequential nor diverging.
pub const TURBO: Colormap = Colormap::plain("turbo", tables::TURBO);

/// *batlow* by Fabio Crameri (*Scientific colour maps*, MIT): dark blue to green to a light pink.
pub const BATLOW: Colormap = Colormap::plain("batlow", tables::BATLOW);

/// *lajolla* by Fabio Crameri (*Scientific colour maps*, MIT): black to red to a light yellow.
pub const LAJOLLA: Colormap = Colormap::plain("lajolla", tables::LAJOLLA);

/// *oslo* by Fabio Crameri (*Scientific colour maps*, MIT): black to blue to white.
pub const OSLO: Colormap = Colormap::plain("oslo", tables::OSLO);

/// *lapaz* by Fabio Crameri (*Scientific colour maps*, MIT): blue to brown to a light pink.
pub const LAPAZ: Colormap = Colormap::plain("lapaz", tables::LAPAZ);

/// *thermal* by Kristen Thyng (cmocean, MIT): dark blue to red to yellow, for temperatures.
pub const THERMAL: Colormap = Colormap::plain("thermal", tables::THERMAL);

/// *haline* by Kristen Thyng (cmocean, MIT): dark blue to green to a light yellow, for salinity.
pub const HALINE: Colormap = Colormap::plain("haline", tables::HALINE);

/// *ice* by Kristen Thyng (cmocean, MIT): black to blue to white.
pub const ICE: Colormap = Colormap::plain("ice", tables::ICE);

/// Black to white.
pub const GREY: Colormap = Colormap::plain("grey", tables::GREY);

/// *coolwarm* by Kenneth Moreland (*Diverging Color Maps for Scientific Visualization*, 2009; the table is
/// matplotlib's, under its BSD-like licence): blue to grey to red.
pub const COOLWARM: Colormap = Colormap::diverging("coolwarm", tables::COOLWARM);

/// *vik* by Fabio Crameri (*Scientific colour maps*, MIT): blue to white to red.
pub const VIK: Colormap = Colormap::diverging("vik", tables::VIK);

/// *roma* by Fabio Crameri (*Scientific colour maps*, MIT): red to yellow to blue.
pub const ROMA: Colormap = Colormap::diverging("roma", tables::ROMA);

/// *balance* by Kristen Thyng (cmocean, MIT): blue to white to red, dark at both ends.
pub const BALANCE: Colormap = Colormap::diverging("balance", tables::BALANCE);

impl Colormap {
    /// All maps: first the sequential ones and turbo, then the diverging ones.
    pub const ALL: [Self; 18] = [
        VIRIDIS, MAGMA, INFERNO, PLASMA, CIVIDIS, TURBO, BATLOW, LAJOLLA, OSLO, LAPAZ, THERMAL, HALINE, ICE,
        GREY, COOLWARM, VIK, ROMA, BALANCE,
    ];

    pub(super) const fn plain(name: &'static str, controls: &'static [[u8; 3]]) -> Self {
        Self { name, controls, is_diverging: false }
    }

    const fn diverging(name: &'static str, controls: &'static [[u8; 3]]) -> Self {
        Self { name, controls, is_diverging: true }
    }

    /// The map with this name, in lower case; `None` if there is none.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|map| map.name == name)
    }

    /// Whether it is for values on two sides of a middle one: brightest in the middle, with another hue on
    /// each side.
    pub const fn is_diverging(&self) -> bool {
        self.is_diverging
    }

    /// The colour at `fraction` of the range, as sRGB components from 0 to 1. Fractions outside 0 ..= 1 get
    /// the colour of the nearer end, NaN that of the lower one.
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
    use std::collections::BTreeSet;

    /// Entries 0, 37, 90, 128, 201 and 255 of the published tables; most are between control colours.
    const PUBLISHED: [(&str, [u32; 6]); 18] = [
        ("viridis", [0x440154, 0x46337f, 0x2e6d8e, 0x21918c, 0x73d056, 0xfde725]),
        ("magma", [0x000004, 0x241253, 0x792282, 0xb73779, 0xfd9a6a, 0xfcfdbf]),
        ("inferno", [0x000004, 0x290b55, 0x801f6c, 0xbc3754, 0xfc9f07, 0xfcffa4]),
        ("plasma", [0x0d0887, 0x5502a4, 0xa21d9a, 0xcc4778, 0xfba238, 0xf0f921]),
        ("cividis", [0x00224e, 0x233c6e, 0x5c616e, 0x7d7c78, 0xc5b568, 0xfee838]),
        ("turbo", [0x30123b, 0x4778f0, 0x22ebaa, 0xa4fc3c, 0xf36315, 0x7a0403]),
        ("batlow", [0x011959, 0x124861, 0x447052, 0x828231, 0xf9a382, 0xfaccfa]),
        ("lajolla", [0x191900, 0x3d2614, 0x9a4340, 0xd9604e, 0xefb956, 0xfffecb]),
        ("oslo", [0x010101, 0x0f2135, 0x225183, 0x507bbc, 0xaeb9cb, 0xffffff]),
        ("lapaz", [0x1a0c64, 0x253782, 0x396c9e, 0x5c8ca3, 0xc5b49b, 0xfef2f3]),
        ("thermal", [0x042333, 0x21348a, 0x7a4c91, 0xb15f82, 0xfba13d, 0xe8fa5b]),
        ("haline", [0x2a186c, 0x193c9f, 0x24728a, 0x3c9387, 0x8dd25f, 0xfdef9a]),
        ("ice", [0x040613, 0x252449, 0x3f519d, 0x427bb7, 0x88c8d4, 0xeafdfd]),
        ("coolwarm", [0x3b4cc0, 0x688aef, 0xb1cbfc, 0xdddcdc, 0xf08a6c, 0xb40426]),
        ("vik", [0x001261, 0x044c86, 0x80b2ca, 0xece5e0, 0xbb602d, 0x590008]),
        ("roma", [0x7e1700, 0xa1611c, 0xccbe62, 0xc0eac3, 0x308dc0, 0x033198]),
        ("balance", [0x181c43, 0x1952bc, 0x85b1c0, 0xf1eceb, 0xb74029, 0x3c0912]),
        ("grey", [0x000000, 0x252525, 0x5a5a5a, 0x808080, 0xc9c9c9, 0xffffff]),
    ];

    fn luma(c: [u8; 4]) -> f64 {
        0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2])
    }

    #[test]
    fn the_tables_go_through_published_colours() {
        for (name, colours) in PUBLISHED {
            let table = Colormap::named(name).unwrap().table::<256>();
            for (i, colour) in [0, 37, 90, 128, 201, 255].into_iter().zip(colours) {
                let [_, published @ ..] = colour.to_be_bytes();
                let is_near = (0..3).all(|c| table[i][c].abs_diff(published[c]) <= 4);
                assert!(is_near, "{name}: entry {i} is {:?}, published as {published:?}", table[i]);
            }
        }
    }

    #[test]
    fn names_are_unique_and_find_their_maps() {
        let names: BTreeSet<_> = Colormap::ALL.iter().map(|map| map.name).collect();
        assert_eq!(names.len(), Colormap::ALL.len());
        assert!(Colormap::ALL.iter().all(|map| Colormap::named(map.name) == Some(*map)));
        assert!(PUBLISHED.iter().all(|(name, _)| names.contains(name)));
        assert_eq!(PUBLISHED.len(), names.len());
        assert_eq!(Colormap::named("jet"), None);
    }

    #[test]
    fn brightness_only_rises_in_sequential_maps() {
        let sequential = |map: &&Colormap| !map.is_diverging() && map.name != TURBO.name;
        for map in Colormap::ALL.iter().filter(sequential) {
            let table = map.table::<64>();
            assert!(table.windows(2).all(|pair| luma(pair[0]) < luma(pair[1])), "{}", map.name);
        }
    }

    #[test]
    fn diverging_maps_are_brightest_in_the_middle() {
        for map in Colormap::ALL.iter().filter(|map| map.is_diverging()) {
            let brightness = map.table::<65>().map(luma);
            let peak = (0..65).max_by(|a, b| brightness[*a].total_cmp(&brightness[*b])).unwrap();
            assert!(peak.abs_diff(32) <= 2, "{} at {peak}", map.name);
            assert!(brightness[..peak].is_sorted() && brightness[peak..].iter().rev().is_sorted());
        }
    }

    #[test]
    fn fractions_out_of_range_are_held() {
        for map in Colormap::ALL {
            assert_eq!(map.at(-3.0), map.at(0.0));
            assert_eq!(map.at(7.0), map.at(1.0));
            assert_eq!(map.at(f32::NAN), map.at(0.0));
        }
    }
}
