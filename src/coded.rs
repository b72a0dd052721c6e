//! Errors that programs can tell apart in any language.

/// An error that says in a word of what kind it is: the `code` of the errors of the JavaScript API.
pub trait Coded: std::error::Error {
    /// The word, such as `truncated`; `ErrorCode` of the npm package lists them.
    fn code(&self) -> &'static str;
}
