//! Why bytes do not come, and what to change where they come from.

use std::fmt;

/// Why a file cannot be read from where it is, or not any further.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StreamError {
    /// The server answered with a status that is no success, every time it was asked.
    Status(u16),
    /// The connection failed or was cut, every time it was tried.
    Network(String),
    /// Nothing came for as long as was to be waited.
    Timeout,
    /// The browser does not let this page read from that server.
    Blocked,
    /// A web page came instead of the file.
    WebPage,
    /// The server compresses what it sends, so that a range of it is no range of the file.
    Encoded(String),
    /// The server answered with other bytes than it was asked for.
    WrongRange(String),
    /// The file was replaced while it was being read.
    Changed,
    /// A file on this machine cannot be read.
    Unreadable(String),
}

impl StreamError {
    /// Whether another try may do better by itself.
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Status(status) => matches!(status, 408 | 425 | 429 | 500..),
            Self::Network(_) | Self::Timeout | Self::WrongRange(_) => true,
            Self::Blocked | Self::WebPage | Self::Encoded(_) | Self::Changed | Self::Unreadable(_) => false,
        }
    }
}

impl fmt::Display for StreamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Status(status) => write!(f, "the server answers with HTTP {status}; {}", status_advice(*status)),
            Self::Network(detail) => write!(
                f,
                "the server cannot be reached, or cuts every connection ({detail}); check the address and that the \
                 server is running"
            ),
            Self::Timeout => f.write_str(
                "the server sends nothing any more; check that it is not overloaded, and that nothing between holds \
                 answers back",
            ),
            Self::Blocked => f.write_str(
                "this page may not read from that server; let the server send `Access-Control-Allow-Origin` with \
                 the origin of this page, or put the file on the page's own server",
            ),
            Self::WebPage => f.write_str(
                "the server sends a web page instead of the file; check the address, and that the server answers 404 \
                 for what it does not have and asks for no login",
            ),
            Self::Encoded(encoding) => write!(
                f,
                "the server sends the file compressed (`Content-Encoding: {encoding}`), where parts of it are needed; \
                 switch compression off for this kind of file"
            ),
            Self::WrongRange(found) => write!(
                f,
                "the server sends another part of the file than was asked for ({found}); mend or switch off Range \
                 requests on the server or the cache before it"
            ),
            Self::Changed => f.write_str(
                "the file on the server was replaced while it was being read; open it again, and give new versions \
                 new names",
            ),
            Self::Unreadable(detail) => write!(f, "the file cannot be read ({detail})"),
        }
    }
}

impl std::error::Error for StreamError {}

fn status_advice(status: u16) -> &'static str {
    match status {
        401 | 403 => "allow reading the file there, or send what the server wants to see",
        404 | 410 => "check the address",
        405 => "let the server allow GET",
        408 | 425 | 429 | 503 => "it has too much to do: ask less often, or give it room",
        300..=399 => "let the address lead to the file",
        500.. => "look into the log of the server",
        _ => "the server must answer Range requests with 206, or with 200 and the whole file",
    }
}
