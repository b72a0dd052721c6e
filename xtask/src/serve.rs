//! The server of pages on localhost: `tetralod serve`, in a process of its own.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

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
        Self::of(command)
    }

    /// What a command serves that prints its address first.
    pub fn of(mut command: Command) -> Result<Self> {
        let mut child = command.stdout(Stdio::piped()).spawn().context("cannot start the server")?;
        let mut line = String::new();
        if let Some(stdout) = child.stdout.take() {
            BufReader::new(stdout).read_line(&mut line)?;
        }
        let server = Self { child, address: line.trim().to_owned() };
        ensure!(server.address.starts_with("http://"), "{command:?} did not start");
        Ok(server)
    }

    /// The file below this path.
    pub fn get(&self, path: &str) -> Result<Vec<u8>> {
        let host = self.address.trim_start_matches("http://").trim_end_matches('/');
        let mut stream = TcpStream::connect(host).with_context(|| self.address.clone())?;
        write!(stream, "GET /{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer)?;
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").context("no answer")?;
        ensure!(answer.starts_with(b"HTTP/1.1 200"), "{path} is not served");
        Ok(answer.split_off(end + 4))
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
