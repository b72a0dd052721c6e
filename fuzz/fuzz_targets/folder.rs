#![no_main]

use cap::Cap;
use libfuzzer_sys::fuzz_target;
use std::alloc::System;

/// Beyond its limit the process ends, which is a finding.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, tetralod_fuzz::MOST_BYTES);

fuzz_target!(|input: &[u8]| tetralod_fuzz::exercise::folder(input));
