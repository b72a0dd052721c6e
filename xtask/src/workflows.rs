//! Promise: the workflows of `workflows/` build the file that `tetralod build --parts` builds, byte for byte; that of Snakemake also where a process
//! is killed in the middle and the same command is given again: then nothing that is finished is done twice.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{shell, venv};

const SOURCES: &str = "workflows";
const FOLDER: &str = "target/workflows";

/// How many parts: enough for four levels.
const PARTS: u32 = 16;

/// Options of `build`.
const OPTIONS: [&str; 2] = ["--position-bits", "16"];

/// What is run in place of the program: it notes down each call. The first process that builds part 1 may write one block into a file: the
/// system kills it at the next, in the middle of the part, however fast it was before.
const WRAPPER: &str = r#"#!/bin/sh
echo "$*" >> "$CALLS"
case "$1 $*" in
    "build "*"--part 1/"*)
        if mkdir "$CALLS.killed" 2>/dev/null; then
            ulimit -f 1
        fi
        ;;
esac
exec "$PROGRAM" "$@"
"#;

/// Runs the workflows on a small volume.
pub fn test() -> Result<()> {
    let program = shell::tested_command()?;
    let snakemake = snakemake()?;
    let run = Run::new(&program)?;
    shell::run(shell::command(&program, ["generate", "bucky", "--size", "33", "-o"]).arg(&run.input))?;
    let undisturbed = run.output("undisturbed");
    let mut one_process = shell::command(&program, ["build", "--quiet", "--parts", &PARTS.to_string()]);
    shell::run(one_process.args(OPTIONS).arg(&run.input).arg("-o").arg(&undisturbed))?;
    run.kill_and_go_on("snakemake", |output, calls| run.snakemake(&snakemake, output, calls))?;
    let by_workers = run.slurm()?;
    let expected = fs::read(&undisturbed)?;
    for path in [run.output("snakemake"), by_workers] {
        let name = path.display();
        ensure!(fs::read(&path)? == expected, "{name} differs from the file that one process has built");
    }
    shell::run(shell::command(&program, ["verify"]).arg(&undisturbed).arg("--against").arg(&run.input))
}

/// A folder for one run of the test.
struct Run {
    folder: PathBuf,
    input: PathBuf,
    program: PathBuf,
    wrapper: PathBuf,
}

impl Run {
    fn new(program: &Path) -> Result<Self> {
        let folder = shell::root().join(FOLDER).join("run");
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        fs::create_dir_all(&folder)?;
        let wrapper = folder.join("wrapper.sh");
        fs::write(&wrapper, WRAPPER)?;
        shell::run(shell::command("chmod", ["+x"]).arg(&wrapper))?;
        let (program, input) = (program.to_owned(), folder.join("volume.vti"));
        Ok(Self { folder, input, program, wrapper })
    }

    fn output(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.mt"))
    }

    /// Runs two jobs of the array for Slurm as processes at a time; returns the file that they have built.
    fn slurm(&self) -> Result<PathBuf> {
        let folder = self.folder.join("slurm.parts");
        let mut part = shell::command(&self.program, ["part", "--quiet", "--parts", &PARTS.to_string()]);
        shell::run(part.args(OPTIONS).arg(&self.input).arg("-o").arg(&folder))?;
        let job = || {
            shell::command("sh", [format!("{SOURCES}/slurm.sh")])
                .arg(&folder)
                .env("TETRALOD", &self.program)
                .spawn()
        };
        for mut job in [job()?, job()?] {
            ensure!(job.wait()?.success(), "slurm.sh failed");
        }
        Ok(folder.join("built.mt"))
    }

    fn snakemake(&self, snakemake: &Path, output: &Path, calls: &str) -> Command {
        let mut command = shell::command(snakemake, ["--cores", "4", "--keep-going", "--quiet", "all"]);
        command.args(["--snakefile", &format!("{SOURCES}/Snakefile"), "--directory"]).arg(&self.folder);
        let setting = |name: &str, path: &Path| format!("{name}={}", path.display());
        command.arg("--config").args([setting("input", &self.input), setting("output", output)]);
        command.args([format!("parts={PARTS}"), setting("command", &self.wrapper)]);
        command.arg(format!("options={}", OPTIONS.join(" ")));
        self.counted(command, calls)
    }

    fn counted(&self, mut command: Command, calls: &str) -> Command {
        command.env("PROGRAM", &self.program).env("CALLS", self.folder.join(calls));
        command
    }

    /// Runs a workflow in which a process is killed; then again, to the end.
    fn kill_and_go_on(&self, name: &str, workflow: impl Fn(&Path, &str) -> Command) -> Result<()> {
        println!("{name}: a process is killed, which is an error; then it goes on");
        let (output, calls) = (self.output(name), format!("{name}.calls"));
        let failed = workflow(&output, &calls).output()?;
        ensure!(!failed.status.success(), "{name}: a process was killed, and nothing was said");
        ensure!(!output.exists(), "{name}: there is a file, though a part is missing");
        let part = self.folder.join(format!("{name}.mt.parts/built-0-1.part"));
        ensure!(!part.exists(), "{name}: the process that was killed left {}", part.display());
        shell::run(&mut workflow(&output, &calls))?;
        self.check_calls(name, &calls)
    }

    /// Every step was done once, but for the one that was killed.
    fn check_calls(&self, name: &str, calls: &str) -> Result<()> {
        let file = self.folder.join(calls);
        let text = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        let mut found: Vec<&str> = text.lines().collect();
        found.sort_unstable();
        let all = found.len();
        found.dedup();
        ensure!(all == found.len() + 1, "{name}: steps that were finished were done again:\n{text}");
        // The parts, the nodes of three levels above them, the first step and the last.
        ensure!(
            found.len() as u32 == PARTS + 8 + 2 + 1 + 2,
            "{name}: these are not the steps that are needed:\n{text}"
        );
        Ok(())
    }
}

/// Snakemake, in an environment of its own.
fn snakemake() -> Result<PathBuf> {
    let folder = Path::new(FOLDER).join("venv");
    let requirements = Path::new(SOURCES).join("requirements.txt");
    Ok(venv::program(&venv::environment(&folder, &requirements)?, "snakemake"))
}
