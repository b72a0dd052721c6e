//! Colours that tell regions apart.

use crate::mesh::REGION_COLORS;
use crate::view::{Colormap, ColourScale};

/// sRGB colours that people tell apart who see colours differently, too: those of Okabe and Ito (*Color Universal Design*, 2008) and of Tol
/// (*Colour schemes*, 2021).
static COLORS: [[u8; 3]; REGION_COLORS as usize] = [
    [0x56, 0xB4, 0xE9],
    [0xE6, 0x9F, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xF0, 0xE4, 0x42],
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x99, 0x99, 0x33],
    [0x44, 0xAA, 0x99],
    [0x88, 0x22, 0x55],
    [0xBB, 0xBB, 0xBB],
    [0x33, 0x22, 0x88],
];

/// The scale that has these colours: a region whose colour has place `i` in the palette has the value `i + 0.5`.
pub fn region_scale() -> ColourScale {
    let (map, bands) = (Colormap::plain("regions", &COLORS), REGION_COLORS);
    ColourScale { map, range: [0.0, f64::from(bands)], is_reversed: false, is_log: false, bands }
}

/// The sRGB colour of a place in the palette of regions, which a region of an MT has
/// ([`RegionInfo::color`](https://docs.rs/tetralod/latest/tetralod/mt/struct.RegionInfo.html)).
pub fn region_color(place: u8) -> [u8; 3] {
    COLORS[usize::from(place) % COLORS.len()]
}

/// The value that a label has on that scale, where `least` is the least label of its field: colours come again after as many labels as there are
/// colours, and do not depend on the mesh.
pub fn label_value(label: f64, least: f64) -> f64 {
    (label - least).rem_euclid(f64::from(REGION_COLORS)) + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_the_colours_of_the_palette_in_turn() {
        for i in 0..30_u8 {
            let value = label_value(f64::from(i) - 7.0, -7.0);
            let colour = region_color(i % REGION_COLORS).map(|c| f32::from(c) / 255.0);
            let found = region_scale().colour(value);
            assert!(
                found.iter().zip(colour).all(|(a, b)| (a - b).abs() < 1e-3),
                "{i}: {found:?}, {colour:?}"
            );
        }
    }
}
