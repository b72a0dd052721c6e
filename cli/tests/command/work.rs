//! Promises of `work` and `status`: one file, however many workers there are and whichever of them ends in the middle; a task is done by one
//! worker as long as that is alive; what is lost, damaged or of another plan or version is named; `status` changes nothing.

use crate::support::{Folder, bad, command, good, json, text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Child, Output, Stdio};
use std::time::Duration;

/// A mesh in parts, and what one process makes of it.
struct Parted {
    folder: Folder,
    input: String,
    dir: String,
    file: Vec<u8>,
}

impl Parted {
    fn new(name: &str, parts: u32) -> Self {
        let folder = Folder::new(name);
        let [input, dir, once] = ["b.vti", "dir", "once.mt"].map(|name| folder.path(name));
        good(&["generate", "bucky", "--size", "17", "-o", &input]);
        let parts = parts.to_string();
        good(&["part", &input, "--parts", &parts, "-o", &dir]);
        good(&["build", &input, "--parts", &parts, "-o", &once]);
        let file = fs::read(&once).expect("a file");
        Self { folder, input, dir, file }
    }

    fn path(&self, name: &str) -> String {
        format!("{}/{name}", self.dir)
    }

    /// Starts a worker.
    fn start(&self, more: &[&str]) -> Child {
        let mut worker = command(&[&["work", &self.dir, "--json", "--quiet"][..], more].concat());
        worker.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("a worker")
    }

    /// The report of a worker that works to the end.
    fn work(&self, more: &[&str]) -> Value {
        report(&self.start(more).wait_with_output().expect("a worker"))
    }

    fn status(&self) -> Value {
        json(&["status", &self.dir, "--json"])
    }

    /// Waits until the status is such; the test's runner ends what never gets so far.
    fn wait_until(&self, is_so: impl Fn(&Value) -> bool) -> Value {
        loop {
            let status = self.status();
            if is_so(&status) {
                return status;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn assert_built(&self, how: &str) {
        let built = fs::read(self.path("built.mt")).expect("the file");
        assert!(built == self.file, "{how}: the file is that of one process");
    }
}

fn report(output: &Output) -> Value {
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// The tasks that are running.
fn running(status: &Value) -> Vec<&str> {
    let all = status["running"].as_array().expect("a list");
    all.iter().map(|task| task["task"].as_str().expect("a name")).collect()
}

#[test]
fn many_workers_make_the_file_of_one_process() {
    let parted = Parted::new("work-many", 16);
    let before = parted.status();
    assert_eq!((&before["file"], &before["goes_on"]), (&Value::Null, &true.into()));
    let counts = |status: &Value, key: &str| -> Vec<u64> {
        let levels = status["levels"].as_array().expect("a list");
        levels.iter().map(|level| level[key].as_u64().expect("a number")).collect()
    };
    assert_eq!(
        (counts(&before, "tasks"), counts(&before, "waiting")),
        (vec![16, 8, 2, 1, 1], vec![16, 8, 2, 1, 1])
    );
    let workers: Vec<Child> = (0..3).map(|_| parted.start(&["--threads", "1"])).collect();
    let reports = workers.into_iter().map(|worker| report(&worker.wait_with_output().expect("a worker")));
    let done: u64 = reports.map(|report| report["tasks"].as_u64().expect("a number")).sum();
    // More if one was so slow that another took its task.
    assert!(done >= 28, "{done}");
    parted.assert_built("three workers");
    // One that comes late has nothing to do; what was noted is kept.
    assert_eq!(parted.work(&[])["tasks"], 0);
    let names = || {
        let names = |folder: &str| {
            fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path())
        };
        names(&parted.dir).chain(names(&parted.path("work"))).collect::<Vec<_>>()
    };
    let all = names();
    let after = parted.status();
    assert_eq!((counts(&after, "done"), &after["goes_on"]), (vec![16, 8, 2, 1, 1], &false.into()));
    assert_eq!(after["finished"].as_array().map(Vec::len), Some(28));
    if cfg!(target_os = "linux") {
        assert!(after["levels"][0]["peak_memory"].as_u64() > Some(1 << 20), "{after}");
    }
    let shown = good(&["status", &parted.dir]);
    assert!(shown.contains("16 of 16 done") && shown.contains("built.mt"), "{shown}");
    assert_eq!(good(&["status", &parted.dir, "--watch"]), shown, "it ends, as nothing is left to be done");
    assert_eq!(names(), all, "status changes nothing, and no lease is left");
    assert!(!all.iter().any(|path| path.to_string_lossy().contains("lease")), "{all:?}");
}

#[test]
fn what_fails_is_tried_again_and_then_left() {
    let parted = Parted::new("work-fails", 2);
    let (part, lost) = (parted.path("input-1.part"), parted.folder.path("input-1.part"));
    fs::rename(&part, &lost).expect("a file");
    let work = ["work", &parted.dir, "--quiet"];
    let words =
        ["build 1/2 has failed 2 times", "input-1.part (written by `tetralod part`)", "--retry-failed"];
    bad(1, &[&work[..], &["--retries", "1"]].concat(), &words);
    let status = parted.status();
    let failed = &status["failed"][0];
    assert_eq!((&failed["times"], &failed["is_final"]), (&2.into(), &true.into()), "{status}");
    assert!(failed["error"].as_str().expect("words").contains("input-1.part"), "{failed}");
    assert_eq!((&status["levels"][0]["done"], &status["goes_on"]), (&1.into(), &false.into()), "{status}");
    assert!(good(&["status", &parted.dir, "--watch"]).contains("2 times, left: "), "it ends");
    // Nobody tries it again, unless that is asked for.
    fs::rename(&lost, &part).expect("a file");
    bad(1, &[&work[..], &["--retries", "1"]].concat(), &["failed 2 times"]);
    let report = parted.work(&["--retry-failed"]);
    assert_eq!((&report["tasks"], &report["failures"]), (&3.into(), &0.into()), "what was done is used");
    parted.assert_built("after failures");
}

#[test]
fn what_is_lost_or_damaged_is_made_again_or_named() {
    let parted = Parted::new("work-lost", 16);
    let work = ["work", &parted.dir, "--quiet"];
    let (status, watch) = (["status", &parted.dir], ["status", &parted.dir, "--watch"]);
    parted.work(&[]);
    let remove =
        |names: &[&str]| names.iter().for_each(|name| fs::remove_file(parted.path(name)).expect("a file"));
    // Of what is lost, what follows from what is there.
    remove(&["built.mt", "built-0-3.part", "built-1-1.part"]);
    assert_eq!(parted.work(&[])["tasks"], 3);
    parted.assert_built("after losses");
    // A part that is cut off is no part.
    let (mt, part) = (parted.path("built.mt"), parted.path("built-0-3.part"));
    let whole = fs::read(&part).expect("a part");
    for cut in [whole.len() - 1, whole.len() / 2, 3] {
        fs::remove_file(&mt).expect("a file");
        fs::write(&part, &whole[..cut]).expect("a file");
        for told in [&work[..], &status, &watch] {
            bad(1, told, &["built-0-3.part: remove it, and `tetralod build --part 3/16` makes it again"]);
        }
        fs::remove_file(&part).expect("a file");
        assert_eq!(parted.work(&[])["tasks"], 2);
        parted.assert_built("after damage");
    }
    // So is the file.
    for cut in [parted.file.len() - 1, 3] {
        fs::write(&mt, &parted.file[..cut]).expect("a file");
        for told in [&work[..], &status, &watch] {
            bad(1, told, &["built.mt is cut off: remove it, and `tetralod work"]);
        }
    }
    fs::write(&mt, &parted.file).expect("a file");
    // One with other bytes is found when it is read.
    remove(&["built.mt", "built-1-1.part"]);
    let mut other = whole.clone();
    other[whole.len() / 2] ^= 1;
    fs::write(&part, &other).expect("a file");
    bad(1, &work, &["built-0-3.part", "checksum"]);
    fs::write(&part, &whole).expect("a file");
    parted.work(&["--retry-failed"]);
    parted.assert_built("after other bytes");
    // A task file that is lost comes back by the same command; finished pieces are used.
    remove(&["built.mt", "built-0-3.part", "input-3.part"]);
    bad(1, &[&work[..], &["--retries", "0"]].concat(), &["input-3.part (written by `tetralod part`)"]);
    good(&["part", &parted.input, "--parts", "16", "-o", &parted.dir]);
    assert_eq!(parted.work(&[])["tasks"], 2);
    parted.assert_built("parted again");
}

#[test]
fn other_plans_and_versions_are_refused() {
    let parted = Parted::new("work-other", 2);
    let plan = parted.path("plan.json");
    let text = fs::read_to_string(&plan).expect("a plan");
    let version = env!("CARGO_PKG_VERSION");
    fs::write(&plan, text.replace(version, "99.1.2")).expect("a plan");
    for subcommand in ["work", "status"] {
        let told = |words: &[&str]| bad(1, &[subcommand, &parted.dir], words);
        told(&["written by tetralod 99.1.2", &format!("this is {version}"), "take tetralod 99.1.2"]);
    }
    fs::write(&plan, "{}").expect("a plan");
    bad(1, &["work", &parted.dir], &["plan.json is no plan of this version"]);
    fs::remove_file(&plan).expect("a plan");
    bad(1, &["work", &parted.dir], &["has no plan.json: `tetralod part INPUT --parts N -o"]);
    bad(2, &["work", &parted.dir, "--stale-after", "0"], &["--stale-after"]);
    // A plan of another mesh: its parts are there, and those of the mesh before.
    good(&["part", &parted.input, "--parts", "2", "-o", &parted.dir]);
    parted.work(&[]);
    good(&["part", &parted.input, "--parts", "2", "--position-bits", "8", "-o", &parted.dir]);
    assert!(!Path::new(&parted.path("built.mt")).exists(), "the file of the plan before");
    for subcommand in ["work", "status"] {
        let words = ["is of another plan: remove it, or part the mesh into another folder"];
        bad(1, &[subcommand, &parted.dir], &words);
    }
}

#[test]
fn a_lease_without_a_heartbeat_is_taken_over() {
    let parted = Parted::new("work-stale", 2);
    // Of a worker that was killed before it could write its name, and of one that was killed later.
    let place = parted.path("work");
    fs::create_dir_all(&place).expect("a folder");
    let holder =
        r#"{"host": "elsewhere", "process": 1, "version": "0.1.0", "since": 0.0, "stale_after": 0.2}"#;
    fs::write(format!("{place}/0-0.lease-0"), "").expect("a lease");
    fs::write(format!("{place}/0-1.lease-0"), format!("{holder}\n...")).expect("a lease");
    fs::write(format!("{place}/0-1.lease-1"), format!("{holder}\n")).expect("a lease");
    let status = parted.status();
    let shown = &status["running"][0];
    assert_eq!((&shown["task"], &shown["host"]), (&"build 1/2".into(), &"elsewhere".into()), "{status}");
    parted.wait_until(|status| status["running"][0]["is_stale"] == true);
    assert_eq!(parted.work(&["--stale-after", "0.2"])["tasks"], 4);
    parted.assert_built("after two that are gone");
    let names = fs::read_dir(&place).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let leases = names.filter(|name| name.to_string_lossy().contains("lease")).count();
    assert_eq!(leases, 0, "stale leases are removed");
}

/// Tasks that last until something is written: their input is a pipe.
#[cfg(target_os = "linux")]
mod while_a_task_runs {
    use super::*;
    use std::process::Command;

    impl Parted {
        /// Makes a pipe of the input of part 1; returns what it was.
        fn stop_part_1(&self) -> Vec<u8> {
            let part = self.path("input-1.part");
            let whole = fs::read(&part).expect("a part");
            fs::remove_file(&part).expect("a file");
            assert!(Command::new("mkfifo").arg(&part).status().expect("mkfifo is there").success());
            whole
        }

        /// Has the input of part 1 be a file again.
        fn restore_part_1(&self, whole: &[u8]) {
            fs::write(self.path("new"), whole).expect("a file");
            fs::rename(self.path("new"), self.path("input-1.part")).expect("a file");
        }

        /// Has a process that waits for the input of part 1 get it.
        fn go_on(&self, whole: &[u8]) {
            let pipe = self.folder.path("pipe");
            fs::rename(self.path("input-1.part"), &pipe).expect("a pipe");
            self.restore_part_1(whole);
            // It reads the beginning, and then all from the file.
            let _ = fs::write(&pipe, whole);
        }

        /// The processes of its tasks.
        fn processes(&self) -> Vec<u32> {
            let is_task = |process: &u32| {
                let words = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
                let words: Vec<&[u8]> = words.split(|&byte| byte == 0).collect();
                words.contains(&self.dir.as_bytes()) && words.iter().any(|word| word.starts_with(b"--task="))
            };
            let entries = fs::read_dir("/proc").expect("processes").flatten();
            entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).filter(is_task).collect()
        }

        fn wait_until_none(&self) {
            while !self.processes().is_empty() {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
    }

    fn signal(signal: &str, process: u32) {
        let sent = Command::new("kill").args([signal, &process.to_string()]).status().expect("kill is there");
        assert!(sent.success());
    }

    #[test]
    fn nobody_else_takes_it() {
        let parted = Parted::new("work-lease", 4);
        let whole = parted.stop_part_1();
        let first = parted.start(&["--stale-after", "100000"]);
        parted.wait_until(|status| running(status).contains(&"build 1/4"));
        let second = parted.start(&[]);
        let status = parted.wait_until(|status| status["levels"][0]["done"] == 3);
        assert_eq!(
            (running(&status), &status["running"][0]["process"]),
            (vec!["build 1/4"], &first.id().into())
        );
        parted.go_on(&whole);
        let reports = [first, second].map(|worker| report(&worker.wait_with_output().expect("a worker")));
        let done = reports.iter().map(|report| report["tasks"].as_u64().expect("a number")).sum::<u64>();
        assert!(done >= 8, "{reports:?}");
        parted.assert_built("two workers");
    }

    #[test]
    fn a_worker_that_is_killed_loses_no_more_than_its_task() {
        let parted = Parted::new("work-killed", 4);
        let whole = parted.stop_part_1();
        let mut first = parted.start(&["--stale-after", "0.5"]);
        parted.wait_until(|status| running(status).contains(&"build 1/4"));
        first.kill().expect("a worker");
        first.wait().expect("a worker");
        parted.wait_until_none();
        let status = parted.wait_until(|status| status["running"][0]["is_stale"] == true);
        let levels = status["levels"].as_array().expect("a list");
        let done: u64 = levels.iter().map(|level| level["done"].as_u64().expect("a number")).sum();
        parted.restore_part_1(&whole);
        assert_eq!(parted.work(&[])["tasks"], 8 - done);
        parted.assert_built("after a worker was killed");
        let left =
            fs::read_dir(&parted.dir).expect("a folder").map(|entry| entry.expect("an entry").file_name());
        let left: Vec<_> = left.filter(|name| name.to_string_lossy().ends_with(".partial")).collect();
        assert!(left.is_empty(), "{left:?}");
    }

    #[test]
    fn an_interrupt_gives_it_back() {
        let parted = Parted::new("work-interrupt", 2);
        let whole = parted.stop_part_1();
        let mut worker = parted.start(&["--stale-after", "100000"]);
        parted.wait_until(|status| running(status).contains(&"build 1/2"));
        signal("-TERM", worker.id());
        assert_eq!(worker.wait().expect("a worker").code(), Some(130));
        parted.wait_until_none();
        let status = parted.status();
        assert_eq!(
            (running(&status), status["failed"].as_array().map(Vec::len)),
            (vec![], Some(0)),
            "{status}"
        );
        parted.restore_part_1(&whole);
        parted.work(&[]);
        parted.assert_built("after an interrupt");
    }

    #[test]
    fn a_process_that_the_system_ends_is_a_failure() {
        let parted = Parted::new("work-memory", 2);
        let whole = parted.stop_part_1();
        let worker = parted.start(&[]);
        parted.wait_until(|status| running(status).contains(&"build 1/2"));
        let process = loop {
            if let [process] = parted.processes()[..] {
                break process;
            }
        };
        parted.restore_part_1(&whole);
        signal("-KILL", process);
        let report = report(&worker.wait_with_output().expect("a worker"));
        assert_eq!((&report["failures"], &report["tasks"]), (&1.into(), &4.into()));
        parted.assert_built("after a process was ended");
        let note = fs::read_to_string(parted.path("work/0-1.failed-1")).expect("a note");
        assert!(note.contains("SIGKILL") && note.contains("perhaps for want of memory"), "{note}");
    }
}
