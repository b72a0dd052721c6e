//! Why bytes do not come, and what to change where they come from.

use thiserror::Error;

/// Why a file cannot be read from where it is, or not any further.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum StreamError {
    /// The server answered with a status that is no success, every time it was asked.
    #[error("the server answers with HTTP {0}; {advice}", advice = status_advice(*.0))]
    Status(u16),
    /// The connection failed or was cut, every time it was tried.
    #[error(
        "the server cannot be reached, or cuts every connection ({0}); check the address and that the server is running"
    )]
    Network(String),
    /// Nothing came for as long as was to be waited.
    #[error(
        "the server sends nothing any more; check that it is not overloaded, and that nothing between holds answers back"
    )]
    Timeout,
    /// The browser does not let this page read from that server.
    #[error(
        "this page may not read from that server; let the server send `Access-Control-Allow-Origin` with the origin of \
         this page, or put the file on the page's own server"
    )]
    Blocked,
    /// A web page came instead of the file.
    #[error(
        "the server sends a web page instead of the file; check the address, and that the server answers 404 for what \
         it does not have and asks for no login"
    )]
    WebPage,
    /// The server compresses what it sends, so that a range of it is no range of the file.
    #[error(
        "the server sends the file compressed (`Content-Encoding: {0}`), where parts of it are needed; switch \
         compression off for this kind of file"
    )]
    Encoded(String),
    /// The server answered with other bytes than it was asked for.
    #[error(
        "the server sends another part of the file than was asked for ({0}); mend or switch off Range requests on the \
         server or the cache before it"
    )]
    WrongRange(String),
    /// The file was replaced while it was being read.
    #[error(
        "the file on the server was replaced while it was being read; open it again, and give new versions new names"
    )]
    Changed,
    /// The file ends where more should follow: it was cut off, or it is in shards, and one of them is not there.
    #[error(
        "the file should have {total} bytes, and those from {from} on are missing: either it was cut off, or it is in shards, and the \
         one whose name ends in `{suffix}` is not there; copy it again, with all files whose names begin with its name"
    )]
    MissingShard {
        /// What stands behind the name of the file in that of the shard which was looked for.
        suffix: String,
        /// Where the shard begins.
        from: u64,
        /// The length of the whole file, by its header.
        total: u64,
    },
    /// A shard of the file has another length than it must have.
    #[error(
        "the shard whose name ends in `{suffix}` has {found} bytes instead of {expected}: it was cut off, or belongs to another version of \
         the file; copy all files again whose names begin with the name of the first one"
    )]
    WrongShard {
        /// What stands behind the name of the file in that of the shard.
        suffix: String,
        /// Its bytes.
        found: u64,
        /// The bytes that it must have.
        expected: u64,
    },
    /// A file on this machine cannot be read.
    #[error("the file cannot be read ({0})")]
    Unreadable(String),
}

impl StreamError {
    /// Whether another try may do better by itself.
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Status(status) => matches!(status, 408 | 425 | 429 | 500..),
            Self::Network(_) | Self::Timeout | Self::WrongRange(_) => true,
            Self::Blocked
            | Self::WebPage
            | Self::Encoded(_)
            | Self::Changed
            | Self::MissingShard { .. }
            | Self::WrongShard { .. }
            | Self::Unreadable(_) => false,
        }
    }
}

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

impl crate::Coded for StreamError {
    fn code(&self) -> &'static str {
        match self {
            Self::Status(_) | Self::Network(_) | Self::Timeout => "network",
            Self::Blocked => "cors",
            Self::Changed => "changed",
            Self::WebPage | Self::Encoded(_) | Self::WrongRange(_) => "server",
            Self::MissingShard { .. } => "truncated",
            Self::WrongShard { found, expected, .. } if found < expected => "truncated",
            Self::WrongShard { .. } => "corrupt",
            Self::Unreadable(_) => "network",
        }
    }
}
