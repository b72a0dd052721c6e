//! What the points of a part of a file are called in the mesh.

use crate::error::ReadReason;

/// What the points of a part of a file are called in the mesh.
pub(super) enum Numbering {
    /// As many points, of which the first has this number.
    From { first: u32, points: usize },
    /// Each has its own; `next` is the number of the first that is added to them.
    Each { numbers: Vec<u32>, next: u32 },
}

impl Numbering {
    fn points(&self) -> usize {
        match self {
            Self::From { points, .. } => *points,
            Self::Each { numbers, .. } => numbers.len(),
        }
    }

    /// Whether no other part of the file can have some of the points, too.
    pub fn is_whole(&self) -> bool {
        matches!(self, Self::From { .. })
    }

    /// The number of a point that a cell has.
    pub fn of(&self, cell: usize, point: i64) -> Result<u32, ReadReason> {
        let index = usize::try_from(point).ok().filter(|p| *p < self.points());
        let number = index.and_then(|p| match self {
            Self::From { first, .. } => u32::try_from(p).ok().and_then(|p| p.checked_add(*first)),
            Self::Each { numbers, .. } => numbers.get(p).copied(),
        });
        let points = || self.points() as u64;
        number.ok_or_else(|| ReadReason::MissingPoint { cell: cell as u64, point, points: points() })
    }

    /// The number of a point that is added to those of the file behind so many others.
    pub fn added(&self, others: usize) -> Result<u32, ReadReason> {
        let next = match self {
            Self::From { first, points } => u64::from(*first) + *points as u64,
            Self::Each { next, .. } => u64::from(*next),
        };
        // The last number is that of no point.
        let number = u32::try_from(next + others as u64).ok().filter(|number| *number < u32::MAX);
        number.ok_or_else(|| ReadReason::TooLarge { what: "points".into(), limit: u64::from(u32::MAX) })
    }
}
