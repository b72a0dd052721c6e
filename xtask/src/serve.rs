//! The server of pages on localhost: `tetralod serve`, in a process of its own.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};

use anyhow::{Context, Result, ensure};

use crate::shell;

/// A server that ends when this is dropped.
pub struct Server {
    child: Child,
    /// Where it answers, with a final slash.
    pub address: String,
}

impl Server {
    /// Serves `folder`, and other folders below the addresses of `mounts`, with this command; port 0 takes any free one.
    pub fn start(tetralod: &Path, folder: &str, mounts: &[(&str, &str)], port: u16) -> Result<Self> {
        let mut command = shell::command(tetralod, ["serve", folder, "--port"]);
        command.arg(port.to_string());
        command.args(mounts.iter().flat_map(|(at, folder)| ["--mount".to_owned(), format!("{at}={folder}")]));
        let mut child = command.stdout(Stdio::piped()).spawn().context("cannot start `tetralod serve`")?;
        let mut line = String::new();
        if let Some(stdout) = child.stdout.take() {
            BufReader::new(stdout).read_line(&mut line)?;
        }
        let server = Self { child, address: line.trim().to_owned() };
        ensure!(server.address.starts_with("http://"), "`tetralod serve {folder}` did not start");
        Ok(server)
    }

    /// Serves until it is interrupted.
    pub fn wait(mut self) -> Result<()> {
        let status = self.child.wait()?;
        ensure!(status.success(), "`tetralod serve` failed: {status}");
        Ok(())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
