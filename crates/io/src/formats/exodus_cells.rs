//! Exodus's types of elements, and the order of their points.

use crate::cell_shapes::PYRAMID_14;

/// What becomes of the elements of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Element {
    /// They have no volume, and are left out.
    Flat,
    /// VTK's type, and which of Exodus's points is each of VTK's. Points beyond, at the middle of faces and of the cell, are
    /// left out: so they are in all cells around.
    Solid(i64, &'static [usize]),
}

/// Beginnings of the names of elements without a volume.
const FLAT: [&str; 14] =
    ["SHE", "TRI", "QUA", "BAR", "BEA", "TRU", "EDG", "SPH", "CIR", "POI", "NOD", "NSI", "LIN", "NUL"];

const HEXAHEDRON_20: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];
const HEXAHEDRON_27: &[usize] =
    &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15, 23, 24, 25, 26, 21, 22, 20];
const WEDGE_15: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11];
const WEDGE_18: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11, 15, 16, 17];
/// Nodes in the middle of triangles come before those of quadrilaterals, and that of the whole before both.
const WEDGE_20: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11, 19, 17, 18];
const WEDGE_21: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11, 20, 18, 19];
const FIRST: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13];

/// The elements of a block, by the name of their type, of which only the beginning counts, and their number of points.
pub(super) fn element(name: &str, points: usize) -> Option<Element> {
    let name = name.trim().to_ascii_uppercase();
    if FLAT.iter().any(|flat| name.starts_with(flat)) {
        return Some(Element::Flat);
    }
    let first = |kind, count: usize| Some(Element::Solid(kind, &FIRST[..count]));
    match (name.get(..3)?, points) {
        ("TET", 4 | 5 | 8 | 9) => first(10, 4),
        ("TET", 10 | 11 | 14 | 15) => first(24, 10),
        ("PYR", 5) => first(14, 5),
        ("PYR", 13) => first(27, 13),
        ("PYR", 14 | 18) => first(PYRAMID_14, 14),
        ("WED", 6 | 7) => first(13, 6),
        ("WED", 15 | 16) => Some(Element::Solid(26, WEDGE_15)),
        ("WED", 18) => Some(Element::Solid(32, WEDGE_18)),
        ("WED", 20) => Some(Element::Solid(32, WEDGE_20)),
        ("WED", 21) => Some(Element::Solid(32, WEDGE_21)),
        ("HEX", 8 | 9) => first(12, 8),
        ("HEX", 20 | 21) => Some(Element::Solid(25, HEXAHEDRON_20)),
        ("HEX", 27) => Some(Element::Solid(29, HEXAHEDRON_27)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell_shapes::recipe;

    /// A point for each corner of an element of Exodus and each middle of an edge, a face or the whole, as sums of corners.
    fn sums(corners: &[[i64; 3]], middles: &[&[usize]]) -> Vec<[i64; 3]> {
        let middle = |of: &&[usize]| {
            [0, 1, 2].map(|i| of.iter().map(|&c| 12 * corners[c][i]).sum::<i64>() / of.len() as i64)
        };
        corners.iter().map(|c| c.map(|x| 12 * x)).chain(middles.iter().map(middle)).collect()
    }

    /// Six times the volume of each tetrahedron that an element with these points becomes.
    fn volumes(name: &str, points: &[[i64; 3]]) -> Vec<i64> {
        let Some(Element::Solid(kind, order)) = element(name, points.len()) else { panic!("{name}") };
        let recipe = recipe(kind).unwrap();
        assert_eq!(recipe.points, order.len(), "{name}");
        let mut tets = Vec::new();
        let numbers: Vec<u32> = (0..recipe.points as u32).collect();
        recipe.split(&numbers, &mut tets);
        let place = |v: u32| points[order[v as usize]];
        let volume = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(place);
            let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
            u[0] * (v[1] * w[2] - v[2] * w[1])
                + u[1] * (v[2] * w[0] - v[0] * w[2])
                + u[2] * (v[0] * w[1] - v[1] * w[0])
        };
        tets.iter().map(volume).collect()
    }

    const CUBE: [[i64; 3]; 8] =
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    const CUBE_MIDDLES: [&[usize]; 19] = [
        &[0, 1],
        &[1, 2],
        &[2, 3],
        &[3, 0],
        &[0, 4],
        &[1, 5],
        &[2, 6],
        &[3, 7],
        &[4, 5],
        &[5, 6],
        &[6, 7],
        &[7, 4],
        &[0, 1, 2, 3, 4, 5, 6, 7],
        &[0, 1, 2, 3],
        &[4, 5, 6, 7],
        &[0, 3, 4, 7],
        &[1, 2, 5, 6],
        &[0, 1, 4, 5],
        &[2, 3, 6, 7],
    ];
    const PRISM: [[i64; 3]; 6] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]];
    const PRISM_MIDDLES: [&[usize]; 12] = [
        &[0, 1],
        &[1, 2],
        &[2, 0],
        &[0, 3],
        &[1, 4],
        &[2, 5],
        &[3, 4],
        &[4, 5],
        &[5, 3],
        &[0, 1, 4, 3],
        &[1, 2, 5, 4],
        &[2, 0, 3, 5],
    ];
    /// As libMesh has them in PRISM21, and without the first one in PRISM20.
    const PRISM_ALL_MIDDLES: [&[usize]; 6] =
        [&[0, 1, 2, 3, 4, 5], &[0, 1, 2], &[3, 4, 5], &[1, 2, 5, 4], &[2, 0, 3, 5], &[0, 1, 4, 3]];
    const TETRAHEDRON: [[i64; 3]; 4] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const TETRAHEDRON_MIDDLES: [&[usize]; 6] = [&[0, 1], &[1, 2], &[2, 0], &[0, 3], &[1, 3], &[2, 3]];
    const PYRAMID: [[i64; 3]; 5] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]];
    const PYRAMID_MIDDLES: [&[usize]; 13] = [
        &[0, 1],
        &[1, 2],
        &[2, 3],
        &[3, 0],
        &[0, 4],
        &[1, 4],
        &[2, 4],
        &[3, 4],
        &[0, 1, 2, 3],
        &[0, 1, 4],
        &[1, 2, 4],
        &[2, 3, 4],
        &[3, 0, 4],
    ];

    #[test]
    fn elements_fill_their_volume_with_tetrahedra_that_do_not_overlap() {
        let unit = 12 * 12 * 12;
        let [prism_20, prism_21] =
            [1, 0].map(|first| [&PRISM_MIDDLES[..9], &PRISM_ALL_MIDDLES[first..]].concat());
        for (name, corners, middles, counts, whole) in [
            ("HEX", &CUBE[..], &CUBE_MIDDLES[..], &[0, 12, 19][..], 6 * unit),
            ("WEDGE", &PRISM[..], &PRISM_MIDDLES[..], &[0, 9, 12][..], 3 * unit),
            ("WEDGE", &PRISM[..], &prism_20[..], &[14][..], 3 * unit),
            ("WEDGE", &PRISM[..], &prism_21[..], &[15][..], 3 * unit),
            ("tetra", &TETRAHEDRON[..], &TETRAHEDRON_MIDDLES[..], &[0, 6][..], unit),
            ("PYRAMID", &PYRAMID[..], &PYRAMID_MIDDLES[..], &[0, 8, 9, 13][..], 2 * unit),
        ] {
            for &count in counts {
                let volumes = volumes(name, &sums(corners, &middles[..count]));
                assert!(volumes.iter().all(|volume| *volume > 0), "{name} {count}: {volumes:?}");
                assert_eq!(volumes.iter().sum::<i64>(), whole, "{name} {count}");
            }
        }
    }

    #[test]
    fn names_of_types_are_known_by_their_beginning() {
        assert_eq!(element("Hex8", 8), element("HEX", 8));
        assert_eq!(element("SHELL4", 4), Some(Element::Flat));
        assert_eq!(element("quad", 4), Some(Element::Flat));
        assert_eq!((element("HEX", 12), element("", 4), element("NFACED", 0)), (None, None, None));
    }
}
