//! How long work takes, by a clock of the caller's.

/// Does the work and sets the `time` that it took, in the unit of the clock.
pub(super) fn timed<T>(clock: &mut dyn FnMut() -> f64, time: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = clock();
    let done = work();
    *time = clock() - start;
    done
}
