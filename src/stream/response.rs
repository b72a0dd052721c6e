//! What the head of a response says, judged against what was asked.

use super::error::StreamError;
use std::ops::Range;

/// The head of an HTTP response: what of it matters here.
#[derive(Clone, Copy, Debug, Default)]
pub struct ResponseHead<'a> {
    /// The status, after redirects.
    pub status: u16,
    /// `Content-Range`; pages see it only where the server exposes it.
    pub content_range: Option<&'a str>,
    /// `Content-Length`.
    pub content_length: Option<u64>,
    /// `Content-Encoding`.
    pub content_encoding: Option<&'a str>,
    /// Whether the client undoes that encoding, as browsers do.
    pub decoded: bool,
    /// `Content-Type`.
    pub content_type: Option<&'a str>,
    /// `ETag`.
    pub etag: Option<&'a str>,
    /// `Last-Modified`.
    pub last_modified: Option<&'a str>,
    /// `Retry-After`, where it is a number.
    pub retry_after_seconds: Option<u64>,
}

/// What a response brings.
#[derive(Debug, PartialEq, Eq)]
pub enum ResponseContent {
    /// These bytes of the file.
    Part(Range<u64>),
    /// The file from its start, to its end if that is known.
    Whole(u64),
    /// The file has no bytes from here on.
    Beyond(u64),
}

/// The end of what is not known to end.
pub const UNKNOWN: u64 = u64::MAX;

impl ResponseHead<'_> {
    /// What this head promises as the answer to `asked`.
    pub fn judge(&self, asked: &Range<u64>) -> Result<ResponseContent, StreamError> {
        match self.status {
            200 | 206 => {}
            412 => return Err(StreamError::Changed),
            416 => return self.beyond(asked),
            status => return Err(StreamError::Status(status)),
        }
        if self.content_type.is_some_and(is_web_page) {
            return Err(StreamError::WebPage);
        }
        if self.status == 206 {
            return self.part(asked);
        }
        match self.encoding() {
            Some(encoding) if !self.decoded => Err(StreamError::Encoded(short(encoding))),
            // The length is that of the packed bytes.
            Some(_) => Ok(ResponseContent::Whole(UNKNOWN)),
            None => Ok(ResponseContent::Whole(self.content_length.unwrap_or(UNKNOWN))),
        }
    }

    fn part(&self, asked: &Range<u64>) -> Result<ResponseContent, StreamError> {
        if let Some(encoding) = self.encoding() {
            return Err(StreamError::Encoded(short(encoding)));
        }
        let part = match self.content_range {
            Some(text) => {
                let wrong = || StreamError::WrongRange(short(text));
                parse_range(text).and_then(|(part, _)| part).ok_or_else(wrong)?
            }
            // Not to be seen: what was asked for, or its beginning.
            None => {
                let length = self.content_length.unwrap_or(UNKNOWN);
                asked.start..asked.start.saturating_add(length).min(asked.end)
            }
        };
        let length = part.end.saturating_sub(part.start);
        let fits = part.start == asked.start && part.end <= asked.end;
        if fits && length > 0 && self.content_length.is_none_or(|given| given == length) {
            return Ok(ResponseContent::Part(part));
        }
        let found = self.content_range.map_or_else(|| "a body of another length".to_owned(), short);
        Err(StreamError::WrongRange(found))
    }

    fn beyond(&self, asked: &Range<u64>) -> Result<ResponseContent, StreamError> {
        match self.total() {
            Some(total) if total > asked.start => {
                Err(StreamError::WrongRange("416 for bytes that there are".to_owned()))
            }
            total => Ok(ResponseContent::Beyond(total.unwrap_or(asked.start))),
        }
    }

    /// The size of the whole file, if this head contains it.
    pub fn total(&self) -> Option<u64> {
        match (self.status, self.content_range) {
            (206 | 416, Some(text)) => parse_range(text)?.1,
            (200, _) if self.encoding().is_none() => self.content_length,
            _ => None,
        }
    }

    /// A tag that stands for these very bytes.
    pub fn strong_etag(&self) -> Option<&str> {
        self.etag.filter(|tag| !tag.starts_with("W/"))
    }

    fn encoding(&self) -> Option<&str> {
        self.content_encoding
            .map(str::trim)
            .filter(|name| !name.is_empty() && !name.eq_ignore_ascii_case("identity"))
    }
}

fn is_web_page(kind: &str) -> bool {
    let kind = kind.trim_start().as_bytes();
    kind.get(..9).is_some_and(|start| start.eq_ignore_ascii_case(b"text/html"))
}

/// The part, if any, and the size of the whole, if there is one, of `bytes 0-9/20`, `bytes 0-9/*` or `bytes */20`.
fn parse_range(text: &str) -> Option<(Option<Range<u64>>, Option<u64>)> {
    let (part, total) = text.trim().strip_prefix("bytes")?.trim_start().split_once('/')?;
    let total = if total == "*" { None } else { Some(total.trim().parse().ok()?) };
    if part.trim() == "*" {
        return Some((None, total));
    }
    let (first, last) = part.split_once('-')?;
    let (first, last): (u64, u64) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
    let end = last.checked_add(1)?;
    let inside = first < end && total.is_none_or(|total| end <= total);
    inside.then_some((Some(first..end), total))
}

/// The beginning of a header, for a message.
fn short(text: &str) -> String {
    text.get(..text.len().min(80)).unwrap_or("illegible").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_ranges_are_read_strictly() {
        assert_eq!(parse_range("bytes 0-9/20"), Some((Some(0..10), Some(20))));
        assert_eq!(parse_range(" bytes  5-5/*"), Some((Some(5..6), None)));
        assert_eq!(parse_range("bytes */20"), Some((None, Some(20))));
        for wrong in [
            "",
            "bytes",
            "0-9/20",
            "bytes 9-0/20",
            "bytes 0-20/20",
            "bytes -9/20",
            "bytes 0-x/20",
            "bytes 0-9",
        ] {
            assert_eq!(parse_range(wrong), None, "{wrong}");
        }
        assert_eq!(parse_range(&format!("bytes 0-{}/*", u64::MAX)), None);
    }

    #[test]
    fn a_part_must_be_the_one_that_was_asked_for() {
        let judge = |range: &'static str, length| {
            ResponseHead {
                status: 206,
                content_range: Some(range),
                content_length: length,
                ..ResponseHead::default()
            }
            .judge(&(10..20))
        };
        assert_eq!(judge("bytes 10-19/99", Some(10)), Ok(ResponseContent::Part(10..20)));
        assert_eq!(judge("bytes 10-14/15", None), Ok(ResponseContent::Part(10..15)));
        for wrong in ["bytes 0-9/99", "bytes 11-19/99", "bytes 10-20/99", "bytes */99", "nonsense"] {
            assert!(matches!(judge(wrong, None), Err(StreamError::WrongRange(_))), "{wrong}");
        }
        assert!(matches!(judge("bytes 10-19/99", Some(9)), Err(StreamError::WrongRange(_))));
    }

    #[test]
    fn pages_packed_ranges_and_refusals_are_no_bytes() {
        let head = |status| ResponseHead { status, ..ResponseHead::default() };
        let page = ResponseHead { content_type: Some("Text/HTML; charset=utf-8"), ..head(200) };
        assert_eq!(page.judge(&(0..9)), Err(StreamError::WebPage));
        let packed = ResponseHead {
            content_encoding: Some("gzip"),
            content_length: Some(5),
            decoded: true,
            ..head(206)
        };
        assert_eq!(packed.judge(&(0..9)), Err(StreamError::Encoded("gzip".to_owned())));
        assert_eq!(
            ResponseHead { status: 200, ..packed }.judge(&(0..9)),
            Ok(ResponseContent::Whole(UNKNOWN))
        );
        assert_eq!(ResponseHead { status: 200, ..packed }.total(), None);
        assert_eq!(head(404).judge(&(0..9)), Err(StreamError::Status(404)));
        assert_eq!(head(412).judge(&(0..9)), Err(StreamError::Changed));
        assert_eq!(head(416).judge(&(7..9)), Ok(ResponseContent::Beyond(7)));
        let lying = ResponseHead { content_range: Some("bytes */20"), ..head(416) };
        assert!(matches!(lying.judge(&(7..9)), Err(StreamError::WrongRange(_))));
        assert_eq!(lying.judge(&(30..31)), Ok(ResponseContent::Beyond(20)));
    }
}
