//! The progress of long work: a bar on stderr.

use super::output::Verbosity;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::ops::ControlFlow;
use tetralod_build::{BuildProgress, OnProgress};

/// Shows the progress of some work, on stderr and only on a terminal.
pub fn with_progress<T>(verbosity: &Verbosity, work: impl FnOnce(OnProgress<'_>) -> T) -> Result<T> {
    let bar = progress_bar(verbosity, "{pos}/{len}  ")?;
    let mut stage = "";
    let result = work(&mut |progress: BuildProgress| {
        bar.set_length(progress.total.max(1));
        if progress.stage != stage {
            stage = progress.stage;
            // Every stage has its own speed.
            bar.reset();
            bar.set_message(stage);
        }
        bar.set_position(progress.done);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    Ok(result)
}

/// A bar with the time that is left, on stderr and only on a terminal; `counts` stands behind the percentage.
pub fn progress_bar(verbosity: &Verbosity, counts: &str) -> Result<ProgressBar> {
    let bar = if verbosity.quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
    let style =
        format!("{{msg:<12}} {{wide_bar}} {{percent:>3}} %  {counts}{{elapsed_precise}}  about {{eta}} left");
    bar.set_style(ProgressStyle::with_template(&style).context("the style of the progress bar")?);
    Ok(bar)
}
