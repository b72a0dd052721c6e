//! `cargo xtask random`: the tests whose inputs are random, again and again with other seeds.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};

use crate::shell;

/// Runs for as many minutes as `args` says, or for half an hour; ends with the first failure and its seed.
pub fn run(args: &[String]) -> Result<()> {
    let minutes: u64 = match args {
        [] => 30,
        [minutes] => minutes.parse().with_context(|| format!("`{minutes}` minutes"))?,
        _ => bail!("`random` takes a number of minutes, nothing else"),
    };
    let end = Instant::now() + Duration::from_secs(60 * minutes);
    while Instant::now() < end {
        let seed = SystemTime::now().duration_since(UNIX_EPOCH)?.as_millis().to_string();
        println!("\n=== TETRALOD_SEED={seed}");
        let mut tests = shell::cargo(["test", "--tests"]);
        shell::run(tests.args(shell::ALL).env("TETRALOD_SEED", &seed))
            .with_context(|| format!("set TETRALOD_SEED={seed} to see this failure again"))?;
    }
    Ok(())
}
