//! The project's own commands, behind `cargo xtask`.
fn main() -> anyhow::Result<()> {
    anyhow::bail!("usage: cargo xtask <demo|test|bench>")
}
