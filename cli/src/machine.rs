//! What this machine is called, the threads and the memory that it gives to a program, and how much memory a program has taken.

use anyhow::{Context, Result};
use sysinfo::{MemoryRefreshKind, RefreshKind, System};

/// The bytes of memory, or of address space where that is limited to less; none if they are not known.
pub fn memory() -> Option<u64> {
    let system = System::new_with_specifics(
        RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram()),
    );
    let of_container = system.cgroup_limits().map(|limits| limits.total_memory);
    let known = [Some(system.total_memory()), of_container, address_space()];
    known.into_iter().flatten().filter(|bytes| *bytes > 0).min()
}

/// The most memory in bytes that a process of this machine has had at a time; none if the system does not say.
pub fn peak_memory(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

/// Has all work be done by so many threads; by as many as there are cores if none is given.
pub fn set_threads(threads: Option<u16>) -> Result<()> {
    let Some(threads) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
    pool.build_global().context("starting the threads")
}

/// The name of this machine.
pub fn name() -> String {
    System::host_name().unwrap_or_else(|| "unknown".to_owned())
}

/// The most address space that this process may take.
#[cfg(unix)]
fn address_space() -> Option<u64> {
    rustix::process::getrlimit(rustix::process::Resource::As).current
}

#[cfg(not(unix))]
fn address_space() -> Option<u64> {
    None
}
