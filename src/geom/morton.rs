//! An order of cells along a curve that seldom leaps far.

/// Where a cell lies on a curve through all cells of a cube (Morton 1966); of each coordinate the low 21 bits count.
#[inline]
pub fn morton([x, y, z]: [u32; 3]) -> u64 {
    spread(x) | spread(y) << 1 | spread(z) << 2
}

/// Puts two zeros before each of the low 21 bits.
#[inline]
fn spread(x: u32) -> u64 {
    let x = u64::from(x) & 0x1f_ffff;
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        for x in [0, 1, 5, 0x1f_ffff, 0x12_3456, 0xff_ffff] {
            let expected = (0..21).fold(0_u64, |sum, bit| sum | u64::from(x >> bit & 1) << (3 * bit));
            assert_eq!(morton([x, 0, 0]), expected);
            assert_eq!(morton([0, x, x]), expected << 1 | expected << 2);
        }
    }
}
