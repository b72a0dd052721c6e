//! Numbers as files hold them: type, byte order, text.

use crate::error::{ReadReason, shown};

/// The type of the numbers of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Decodes `$bytes` as numbers of the primitive type `$t` into a `Vec` of `$into`.
macro_rules! decoded {
    ($bytes:expr, $big:expr, $into:ty, $t:ty) => {{
        let (chunks, _) = $bytes.as_chunks::<{ size_of::<$t>() }>();
        if $big {
            chunks.iter().map(|c| <$t>::from_be_bytes(*c) as $into).collect()
        } else {
            chunks.iter().map(|c| <$t>::from_le_bytes(*c) as $into).collect()
        }
    }};
}

/// Decodes `$bytes` as numbers of the type `$number`.
macro_rules! all_decoded {
    ($number:expr, $bytes:expr, $big:expr, $into:ty) => {
        match $number {
            Self::I8 => decoded!($bytes, $big, $into, i8),
            Self::U8 => decoded!($bytes, $big, $into, u8),
            Self::I16 => decoded!($bytes, $big, $into, i16),
            Self::U16 => decoded!($bytes, $big, $into, u16),
            Self::I32 => decoded!($bytes, $big, $into, i32),
            Self::U32 => decoded!($bytes, $big, $into, u32),
            Self::I64 => decoded!($bytes, $big, $into, i64),
            Self::U64 => decoded!($bytes, $big, $into, u64),
            Self::F32 => decoded!($bytes, $big, $into, f32),
            Self::F64 => decoded!($bytes, $big, $into, f64),
        }
    };
}

impl NumberType {
    /// By the name used in VTK XML files and in sidecars (in any case).
    pub fn named(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "int8" => Self::I8,
            "uint8" => Self::U8,
            "int16" => Self::I16,
            "uint16" => Self::U16,
            "int32" => Self::I32,
            "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float32" => Self::F32,
            "float64" => Self::F64,
            _ => return None,
        })
    }

    /// By the name used in legacy VTK files, in lower case. VTK writes its ids as 32 bits, `long` as 64.
    pub fn legacy(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "signed_char" => Self::I8,
            "unsigned_char" => Self::U8,
            "short" => Self::I16,
            "unsigned_short" => Self::U16,
            "int" | "vtkidtype" => Self::I32,
            "unsigned_int" => Self::U32,
            "long" | "long_long" => Self::I64,
            "unsigned_long" | "unsigned_long_long" => Self::U64,
            "float" => Self::F32,
            "double" => Self::F64,
            other => return other.strip_prefix("vtktype").and_then(Self::named),
        })
    }

    /// Whether its numbers are integers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Bytes of one number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The numbers in `bytes`; a rest that is shorter than a number is left out.
    pub fn floats(self, bytes: &[u8], big: bool) -> Vec<f64> {
        all_decoded!(self, bytes, big, f64)
    }

    /// The numbers in `bytes` as indices. Unsigned numbers beyond `i64` wrap to negative ones, which no index is.
    pub fn integers(self, bytes: &[u8], big: bool) -> Result<Vec<i64>, ReadReason> {
        if self.is_integer() { Ok(all_decoded!(self, bytes, big, i64)) } else { Err(not_integers()) }
    }

    /// Appends the bytes of a number.
    pub fn put(self, value: f64, big: bool, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        match self {
            Self::I8 => bytes.extend((value as i8).to_le_bytes()),
            Self::U8 => bytes.extend((value as u8).to_le_bytes()),
            Self::I16 => bytes.extend((value as i16).to_le_bytes()),
            Self::U16 => bytes.extend((value as u16).to_le_bytes()),
            Self::I32 => bytes.extend((value as i32).to_le_bytes()),
            Self::U32 => bytes.extend((value as u32).to_le_bytes()),
            Self::I64 => bytes.extend((value as i64).to_le_bytes()),
            Self::U64 => bytes.extend((value as u64).to_le_bytes()),
            Self::F32 => bytes.extend((value as f32).to_le_bytes()),
            Self::F64 => bytes.extend(value.to_le_bytes()),
        }
        if big {
            bytes[start..].reverse();
        }
    }

    /// One number from text. Single precision is rounded as such, so that text and binary files agree.
    pub fn parse_float(self, text: &str) -> Result<f64, ReadReason> {
        let value = if self == Self::F32 { text.parse::<f32>().map(f64::from) } else { text.parse::<f64>() };
        value.map_err(|_| not_a_number(text))
    }

    /// One index from text.
    pub fn parse_integer(self, text: &str) -> Result<i64, ReadReason> {
        if !self.is_integer() {
            return Err(not_integers());
        }
        text.parse().map_err(|_| not_a_number(text))
    }
}

fn not_integers() -> ReadReason {
    ReadReason::Syntax("indices are stored as floating-point numbers".into())
}

fn not_a_number(text: &str) -> ReadReason {
    ReadReason::Syntax(format!("\"{}\" is not a number of the stated type", shown(text)))
}

/// Positions from three coordinates each.
pub(super) fn points_from(coordinates: &[f64]) -> Vec<[f64; 3]> {
    coordinates.as_chunks::<3>().0.to_vec()
}
