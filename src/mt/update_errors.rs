//! The errors of updates, field by field.

use super::ErrorCode;

/// The errors of updates, one for each field, and the largest of them. With one field it is its own largest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Errors {
    /// Codes of an update: the largest and one a field, or the only one.
    stride: usize,
    codes: Vec<ErrorCode>,
}

impl Errors {
    /// No updates yet, in an MT of so many fields.
    pub fn new(fields: usize) -> Self {
        Self::with_capacity(fields, 0)
    }

    /// No errors yet, with room for those of so many updates.
    pub fn with_capacity(fields: usize, updates: usize) -> Self {
        let stride = if fields == 1 { 1 } else { fields + 1 };
        Self { stride, codes: Vec::with_capacity(stride * updates) }
    }

    /// Adds those of the next update. False if they are not one for each field.
    #[must_use]
    pub fn push(&mut self, errors: &[ErrorCode]) -> bool {
        let leading = usize::from(self.stride > 1);
        if errors.len() + leading != self.stride {
            return false;
        }
        if leading > 0 {
            self.codes.push(errors.iter().copied().fold(ErrorCode::ZERO, ErrorCode::max));
        }
        self.codes.extend_from_slice(errors);
        true
    }

    /// The largest one of update `k`.
    #[inline]
    pub fn largest(&self, k: usize) -> ErrorCode {
        self.codes[k * self.stride]
    }

    /// The errors of update `k`, field by field.
    #[inline]
    pub fn of(&self, k: usize) -> &[ErrorCode] {
        &self.codes[k * self.stride..][usize::from(self.stride > 1)..self.stride]
    }

    /// How many updates have errors here.
    pub fn updates(&self) -> u32 {
        (self.codes.len() / self.stride) as u32
    }

    /// Turns the order round.
    #[cfg(test)]
    pub fn swap(&mut self) {
        self.codes.reverse();
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.codes[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_has_its_own_error_and_the_largest_leads() {
        for fields in 1..4 {
            let mut errors = Errors::new(fields);
            let code = |k: usize, f: usize| ErrorCode((k * 37 % 11 + f * 29 % 7) as u16);
            let row = |k: usize| (0..fields).map(|f| code(k, f)).collect::<Vec<_>>();
            assert!((0..9).all(|k| errors.push(&row(k))));
            assert!(!errors.push(&[ErrorCode::MAX; 5][..fields + 1]));
            for k in 0..9 {
                assert_eq!(errors.of(k), row(k));
                assert_eq!(Some(errors.largest(k)), row(k).into_iter().max());
            }
            assert_eq!(errors.bytes(), 18 * if fields == 1 { 1 } else { fields + 1 });
        }
    }
}
