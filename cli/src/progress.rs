//! The progress of long work: a bar on stderr, or lines for programs.

use super::output::{Progress, Verbosity};
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, TermLike};
use std::io;
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

/// A bar with the time that is left, on stderr and only on a terminal; `counts` stands behind the percentage. For programs, lines.
pub fn progress_bar(verbosity: &Verbosity, counts: &str) -> Result<ProgressBar> {
    let is_bar = verbosity.progress != Some(Progress::Json);
    let target = match is_bar {
        false => ProgressDrawTarget::term_like_with_hz(Box::new(Lines), LINES_A_SECOND),
        true if verbosity.quiet => ProgressDrawTarget::hidden(),
        true => ProgressDrawTarget::stderr(),
    };
    let style = if is_bar {
        format!("{{msg:<12}} {{wide_bar}} {{percent:>3}} %  {counts}{{elapsed_precise}}  about {{eta}} left")
    } else {
        r#"{{"stage": "{msg}", "done": {pos}, "total": {len}}}"#.to_owned()
    };
    let bar = ProgressBar::with_draw_target(Some(0), target);
    bar.set_style(ProgressStyle::with_template(&style).context("the style of the progress bar")?);
    Ok(bar)
}

/// At most so many.
const LINES_A_SECOND: u8 = 5;

/// A terminal that nothing can be erased on: each state of a bar is a line of stderr.
#[derive(Debug)]
struct Lines;

impl TermLike for Lines {
    fn width(&self) -> u16 {
        // Longer than any line.
        1024
    }

    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.write_str(text)
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        if !text.trim().is_empty() {
            eprintln!("{text}");
        }
        Ok(())
    }

    fn clear_line(&self) -> io::Result<()> {
        Ok(())
    }

    fn flush(&self) -> io::Result<()> {
        Ok(())
    }
}
