//! How the numbers of a Gmsh file are written.

use crate::error::ReadReason;
use crate::number::NumberType;
use crate::scanner::Scanner;

/// Which of the layouts a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Version {
    Two,
    Four,
    FourOne,
}

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub version: Version,
    pub binary: bool,
    pub big: bool,
    /// Of version 4.1: the type of counts and tags.
    pub wide: NumberType,
}

/// Numbers of either encoding.
pub(super) struct Numbers<'s, 'a> {
    pub file: &'s mut Scanner<'a>,
    pub layout: Layout,
}

impl Numbers<'_, '_> {
    /// A number that is an `int` in binary files.
    pub fn int(&mut self) -> Result<i64, ReadReason> {
        self.integer(NumberType::I32)
    }

    /// A count, or a tag of version 4.1.
    pub fn wide(&mut self) -> Result<i64, ReadReason> {
        self.integer(self.layout.wide)
    }

    fn integer(&mut self, kind: NumberType) -> Result<i64, ReadReason> {
        if !self.layout.binary {
            return self.file.number();
        }
        // One number was asked for, so there is one.
        Ok(self.file.integers(1, kind, self.layout.big)?[0])
    }

    pub fn count(&mut self) -> Result<usize, ReadReason> {
        // Version 2 writes counts as text in either encoding.
        let has_text = self.layout.version == Version::Two;
        let count = if has_text { self.file.number()? } else { self.wide()? };
        usize::try_from(count).map_err(|_| ReadReason::Syntax(format!("{count} is not a count")))
    }

    pub fn tag(&mut self) -> Result<i64, ReadReason> {
        if self.layout.version == Version::FourOne { self.wide() } else { self.int() }
    }

    pub fn float(&mut self) -> Result<f64, ReadReason> {
        // One number was asked for, so there is one.
        Ok(self.floats(1)?[0])
    }

    /// The next `count` floats.
    pub fn floats(&mut self, count: usize) -> Result<Vec<f64>, ReadReason> {
        if self.layout.binary {
            return self.file.floats(count, NumberType::F64, self.layout.big);
        }
        let mut list = Vec::with_capacity(self.file.capacity(count));
        for _ in 0..count {
            list.push(self.file.number()?);
        }
        Ok(list)
    }

    /// Steps to the first byte behind the line, if numbers are bytes.
    pub fn end_line(&mut self) {
        if self.layout.binary {
            self.file.skip_line();
        }
    }

    /// The number of entities of each dimension, points first.
    pub fn entities(&mut self) -> Result<[usize; 4], ReadReason> {
        Ok([self.count()?, self.count()?, self.count()?, self.count()?])
    }

    /// The dimension and the tag of a geometric entity.
    pub fn entity(&mut self) -> Result<(i64, i64), ReadReason> {
        let (first, second) = (self.int()?, self.int()?);
        Ok(if self.layout.version == Version::Four { (second, first) } else { (first, second) })
    }
}
