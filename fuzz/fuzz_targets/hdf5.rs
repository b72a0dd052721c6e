#![no_main]

use cap::Cap;
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use std::alloc::System;

/// As in `folder.rs`.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, tetralod_fuzz::MOST_BYTES);

fuzz_target!(|input: &[u8]| tetralod_fuzz::exercise::hdf5(input));

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    tetralod_fuzz::hdf5_structure::mutate(data, size, max_size, seed, fuzzer_mutate)
});
