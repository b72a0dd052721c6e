//! What a verification has found, in words.

use serde::Serialize;

/// The result of a verification.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VerifyReport {
    /// Whether all checks passed.
    pub valid: bool,
    /// Requests that were made and checked.
    pub queries: u32,
    /// The largest measured error as a fraction of the guaranteed one; at most 1 if the guarantee holds.
    pub worst_error_ratio: f64,
    /// Failed checks: the request, the place and the numbers. At most [`MAX_FAILURES`].
    pub failures: Vec<String>,
}

impl VerifyReport {
    /// What a check has found; its error is a failure after which nothing can be checked.
    pub(super) fn of(check: impl FnOnce(&mut Self) -> Result<(), String>) -> Self {
        let mut report = Self::default();
        if let Err(failure) = check(&mut report) {
            report.failures.push(failure);
        }
        report.valid = report.failures.is_empty();
        report
    }

    /// Adds what other checks of the same MT have found.
    pub fn add(&mut self, other: Self) {
        self.valid &= other.valid;
        self.queries += other.queries;
        self.worst_error_ratio = self.worst_error_ratio.max(other.worst_error_ratio);
        self.failures.extend(other.failures);
        self.failures.truncate(MAX_FAILURES);
    }
}

/// No more failures than this are described.
pub const MAX_FAILURES: usize = 50;

/// Adds a failure, unless enough are described.
pub(super) fn note(report: &mut VerifyReport, place: &dyn std::fmt::Display, failure: &str) {
    if report.failures.len() < MAX_FAILURES {
        report.failures.push(format!("{place}: {failure}"));
    }
}

/// What was found.
pub struct Measured {
    /// The largest error as a fraction of what is allowed.
    pub worst_ratio: f64,
    pub failures: Vec<String>,
}

/// Failures of one kind that are described for each query.
const DESCRIBED: usize = 3;

/// Failures of one kind: the first ones in full, and their number.
#[derive(Default)]
pub struct Failures {
    described: Vec<String>,
    count: usize,
}

impl Failures {
    pub fn add(&mut self, describe: impl FnOnce() -> String) {
        self.count += 1;
        if self.count <= DESCRIBED {
            self.described.push(describe());
        }
    }

    pub fn end(mut self, where_: &str, found: &mut Measured) {
        if self.count > DESCRIBED {
            self.described.push(format!("so at {} {where_}", self.count));
        }
        found.failures.append(&mut self.described);
    }
}
