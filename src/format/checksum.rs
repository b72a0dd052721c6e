//! The checksum of files: CRC-32 as in gzip and PNG.
//!
//! Native programs have that of `crc32fast`, which knows the processor's instructions. Its tables do not compress and would be a
//! tenth of the download of the core; in wasm they are made when they are first needed.

#[cfg(not(target_arch = "wasm32"))]
pub use crc32fast::{Hasher, hash};
#[cfg(target_arch = "wasm32")]
pub use tables::{Hasher, hash};

#[cfg(any(test, target_arch = "wasm32"))]
mod tables {
    use std::sync::LazyLock;

    /// Bits of the polynomial, the lowest power first.
    const POLYNOMIAL: u32 = 0xEDB8_8320;
    /// Bytes that are taken in at once.
    const STRIDE: usize = 16;

    /// What a byte adds to the checksum, by the number of bytes that follow it in its stride.
    static TABLES: LazyLock<Box<[[u32; 256]; STRIDE]>> = LazyLock::new(|| {
        let mut tables = Box::new([[0; 256]; STRIDE]);
        for (byte, entry) in (0_u32..).zip(&mut tables[0]) {
            *entry = (0..8).fold(byte, |crc, _| crc >> 1 ^ if crc & 1 == 1 { POLYNOMIAL } else { 0 });
        }
        for follow in 1..STRIDE {
            tables[follow] = tables[follow - 1].map(|crc| shift(crc, &tables[0]));
        }
        tables
    });

    fn shift(crc: u32, table: &[u32; 256]) -> u32 {
        crc >> 8 ^ table[crc as usize & 0xFF]
    }

    /// A checksum of bytes that come one after another.
    #[derive(Clone, Debug)]
    pub struct Hasher {
        inverted: u32,
    }

    impl Hasher {
        pub fn new() -> Self {
            Self { inverted: u32::MAX }
        }

        pub fn update(&mut self, bytes: &[u8]) {
            let tables = &**TABLES;
            let (strides, rest) = bytes.as_chunks::<STRIDE>();
            for stride in strides {
                let mut stride = *stride;
                for (byte, crc) in stride.iter_mut().zip(self.inverted.to_le_bytes()) {
                    *byte ^= crc;
                }
                let entries = tables.iter().rev().zip(stride);
                self.inverted = entries.fold(0, |crc, (table, byte)| crc ^ table[usize::from(byte)]);
            }
            for byte in rest {
                self.inverted = shift(self.inverted ^ u32::from(*byte), &tables[0]);
            }
        }

        pub fn finalize(self) -> u32 {
            !self.inverted
        }
    }

    pub fn hash(bytes: &[u8]) -> u32 {
        let mut hasher = Hasher::new();
        hasher.update(bytes);
        hasher.finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::tables;

    #[test]
    fn tables_give_the_checksum_of_crc32fast() {
        assert_eq!(tables::hash(b"123456789"), 0xCBF4_3926);
        let bytes: Vec<u8> = (0..2000_u32).map(|i| ((i * i) >> 3) as u8).collect();
        for len in 0..bytes.len() {
            assert_eq!(tables::hash(&bytes[..len]), crc32fast::hash(&bytes[..len]), "{len} bytes");
        }
        for cut in 0..100 {
            let mut hasher = tables::Hasher::new();
            hasher.update(&bytes[..cut]);
            hasher.update(&bytes[cut..]);
            assert_eq!(hasher.finalize(), crc32fast::hash(&bytes), "cut at {cut}");
        }
    }
}
