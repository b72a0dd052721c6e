//! How much memory this machine gives to a program.

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

/// The most address space that this process may take.
#[cfg(unix)]
fn address_space() -> Option<u64> {
    rustix::process::getrlimit(rustix::process::Resource::As).current
}

#[cfg(not(unix))]
fn address_space() -> Option<u64> {
    None
}
