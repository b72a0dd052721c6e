//! Runs tests of wasm in a browser: cargo calls it as `wasm-test-runner TEST.wasm ARGS...`.
#![forbid(unsafe_code)]

use anyhow::{Context, Result, ensure};

fn main() -> Result<()> {
    // wasm-bindgen's runner takes a file without tests for a success; here it would hide that nothing was run.
    let args: Vec<String> = std::env::args().collect();
    let file = args.get(1).context("the runner needs a wasm file")?;
    let wasm = std::fs::read(file).with_context(|| file.clone())?;
    ensure!(wasm.windows(7).any(|bytes| bytes == b"__wbgt_"), "{file} holds no test");
    wasm_bindgen_cli::wasm_bindgen_test_runner::run_cli_with_args(args)
}
