//! What MT files cost: bytes beside other forms of the same meshes, what requests need of them by ranges, and a model larger
//! than the memory for it. Prints Markdown; `cargo xtask bench --format` and `--network` put it into docs/benchmarks.md.

// The slow and plain isosurface of the tests says how near a surface is to the exact one.
#[path = "../../tests/support/surfaces.rs"]
mod surfaces;

// What requests cost over a network, in the time of that.
#[path = "../../tests/support/network.rs"]
mod network;

mod first_picture;
mod mt_file;
mod requests;
mod sets;
mod table;
mod walk;

use std::error::Error;

/// Whatever goes wrong: this is a tool, it says so and ends.
pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    // The first argument is the program itself; Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["table", inputs @ ..] => table::run(&sets::all(inputs)?),
        ["first-picture", inputs @ ..] => first_picture::run(&sets::all(inputs)?),
        ["requests", inputs @ ..] => requests::run(inputs),
        ["walk", file] => walk::run(file.as_ref()),
        ["make", size, kind, file] => sets::make(size.parse()?, kind, file.as_ref()),
        // `cargo test --all-targets` runs it without any.
        [] => Ok(()),
        other => Err(format!("no such benchmark: {other:?}").into()),
    }
}
