//! A position in a file of words and numbers, which may hold binary parts.

use std::str::FromStr;

use crate::error::{ReadReason, shown};
use crate::number::NumberType;

/// A position in a file.
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Whether `#` begins a comment that goes to the end of the line.
    comments: bool,
}

impl<'a> Scanner<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, comments: false }
    }

    /// Of a format in which `#` begins a comment.
    pub fn with_comments(bytes: &'a [u8]) -> Self {
        Self { comments: true, ..Self::new(bytes) }
    }

    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Where this is, for errors in text.
    pub fn line_number(&self) -> String {
        let before = &self.bytes[..self.at.min(self.bytes.len())];
        format!("line {}", 1 + before.iter().filter(|c| **c == b'\n').count())
    }

    /// Where this is, for errors in binary data.
    pub fn byte_number(&self) -> String {
        format!("byte {}", self.at)
    }

    /// The next word, if there is one.
    pub fn next_word(&mut self) -> Result<Option<&'a str>, ReadReason> {
        self.skip_space();
        let rest = self.rest();
        let ends = |c: &u8| c.is_ascii_whitespace() || self.comments && *c == b'#';
        let length = rest.iter().position(ends).unwrap_or(rest.len());
        if length == 0 {
            return Ok(None);
        }
        let word = std::str::from_utf8(&rest[..length]);
        let word = word.map_err(|_| ReadReason::Syntax("binary data where text is expected".into()))?;
        self.at += length;
        Ok(Some(word))
    }

    fn skip_space(&mut self) {
        loop {
            let blank = self.rest().iter().take_while(|c| c.is_ascii_whitespace()).count();
            self.at += blank;
            if !self.comments || self.rest().first() != Some(&b'#') {
                return;
            }
            self.skip_line();
        }
    }

    pub fn word(&mut self) -> Result<&'a str, ReadReason> {
        self.next_word()?.ok_or(ReadReason::Truncated { needed: 1, found: 0 })
    }

    /// The next word if `is_wanted`; else it stays.
    pub fn word_if(&mut self, is_wanted: impl Fn(&str) -> bool) -> Option<&'a str> {
        let start = self.at;
        let word = self.next_word().ok().flatten().filter(|word| is_wanted(word));
        if word.is_none() {
            self.at = start;
        }
        word
    }

    /// The words of the next line that has some, without its comment; none at the end of the file.
    pub fn row(&mut self) -> Result<Option<Vec<&'a str>>, ReadReason> {
        self.skip_space();
        if self.rest().is_empty() {
            return Ok(None);
        }
        let line = std::str::from_utf8(self.line());
        let line = line.map_err(|_| ReadReason::Syntax("binary data where text is expected".into()))?;
        let line = if self.comments { line.split('#').next().unwrap_or_default() } else { line };
        Ok(Some(line.split_ascii_whitespace().collect()))
    }

    /// The rest of the line, without its end.
    pub fn line(&mut self) -> &'a [u8] {
        let start = self.at;
        self.skip_line();
        self.bytes[start..self.at].trim_ascii_end()
    }

    pub fn skip_line(&mut self) {
        let rest = self.rest();
        self.at += rest.iter().position(|c| *c == b'\n').map_or(rest.len(), |i| i + 1);
    }

    pub fn number<T: FromStr>(&mut self) -> Result<T, ReadReason> {
        let word = self.word()?;
        parsed(word)
    }

    pub fn numbers<T: FromStr, const N: usize>(&mut self) -> Result<[T; N], ReadReason> {
        let mut list = Vec::with_capacity(N);
        for _ in 0..N {
            list.push(self.number()?);
        }
        list.try_into().map_err(|_| ReadReason::Truncated { needed: N as u64, found: 0 })
    }

    /// How much memory `count` items may take that have at least two bytes each here.
    pub fn capacity(&self, count: usize) -> usize {
        count.min(self.rest().len() / 2 + 1)
    }

    /// The next `count` bytes.
    pub fn take(&mut self, count: Option<usize>) -> Result<&'a [u8], ReadReason> {
        let (rest, needed) = (self.rest(), count.unwrap_or(usize::MAX));
        let found = rest.len() as u64;
        let taken = rest.get(..needed).ok_or(ReadReason::Truncated { needed: needed as u64, found })?;
        self.at += needed;
        Ok(taken)
    }

    /// The next `count` binary numbers as indices.
    pub fn integers(&mut self, count: usize, kind: NumberType, big: bool) -> Result<Vec<i64>, ReadReason> {
        kind.integers(self.take(count.checked_mul(kind.size()))?, big)
    }

    /// The next `count` binary numbers.
    pub fn floats(&mut self, count: usize, kind: NumberType, big: bool) -> Result<Vec<f64>, ReadReason> {
        Ok(kind.floats(self.take(count.checked_mul(kind.size()))?, big))
    }
}

/// The number that a word stands for.
pub(super) fn parsed<T: FromStr>(word: &str) -> Result<T, ReadReason> {
    let wrong = || ReadReason::Syntax(format!("\"{}\" is not a number of the expected kind", shown(word)));
    word.parse().map_err(|_| wrong())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_numbers_and_comments() {
        let mut file = Scanner::with_comments(b" # head\n 3 -1.5#rest\nword\n\x00\x01");
        assert_eq!(file.number::<u32>(), Ok(3));
        assert_eq!(file.number::<f64>(), Ok(-1.5));
        assert_eq!(file.word_if(|word| word == "other"), None);
        assert_eq!((file.word(), file.line_number()), (Ok("word"), "line 3".to_owned()));
        file.skip_line();
        assert_eq!(file.integers(1, NumberType::I16, true), Ok(vec![1]));
        assert!(matches!(file.word(), Err(ReadReason::Truncated { .. })));
        assert!(matches!(file.take(Some(1)), Err(ReadReason::Truncated { needed: 1, found: 0 })));
        assert!(Scanner::new(b"x").number::<u8>().unwrap_err().to_string().contains("\"x\""));
    }
}
