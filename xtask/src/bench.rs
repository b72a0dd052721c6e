//! `cargo xtask bench`: the same benchmark natively and in the browser, side by side.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::serve::Server;
use crate::{
    bench_against_vtk, bench_beside_vtk, bench_build, bench_first_visit, bench_format, bench_kinds,
    bench_network, bench_parts, bench_pictures, browser, demo, package, shell,
};

/// Measures `FILE.mt`, or the demo's volume; with `--browser` also in Chromium. With other options what `cargo xtask` says of them.
pub fn run(args: &[String]) -> Result<()> {
    match args {
        [option, rest @ ..] if option == "--build" => return bench_build::run(rest),
        [option, rest @ ..] if option == "--parts" => return bench_parts::run(rest),
        [option, rest @ ..] if option == "--network" => return bench_network::run(rest),
        [option, rest @ ..] if option == "--against-vtk" => return bench_against_vtk::run(rest),
        [option, rest @ ..] if option == "--beside-vtk" => return bench_beside_vtk::run(rest),
        [option, rest @ ..] if option == "--first-visit" => return bench_first_visit::run(rest),
        [option, rest @ ..] if option == "--pictures" => return bench_pictures::run(rest),
        [option] if option == "--format" => return bench_format::run(),
        [option] if option == "--kinds" => return bench_kinds::run(false),
        [option, large] if option == "--kinds" && large == "--large" => return bench_kinds::run(true),
        [option] if option == "--all" => return all(),
        _ => {}
    }
    let (mut file, mut in_browser) = (None, false);
    for arg in args {
        match arg.as_str() {
            "--browser" => in_browser = true,
            path if !path.starts_with('-') && file.is_none() => file = Some(PathBuf::from(path)),
            other => {
                bail!(
                    "`bench` knows one FILE.mt and --browser, --all, --format, --network, --build, --parts, --against-vtk, --first-visit, --pictures, --beside-vtk or --kinds, not `{other}`"
                )
            }
        }
    }
    let file = file.map_or_else(demo::bench_volume, Ok)?;
    println!("measuring {}", file.display());
    let native = native(&file)?;
    let browser = if in_browser { Some(browser(&file)?) } else { None };
    print(&native, browser.as_deref());
    Ok(())
}

/// All that `docs/benchmarks.md` and `docs/beside-vtk.md` are made of, one after the other: hours.
fn all() -> Result<()> {
    bench_format::run()?;
    bench_build::run(&[])?;
    bench_parts::run(&[])?;
    bench_network::run(&[])?;
    bench_against_vtk::run(&[])?;
    bench_first_visit::run(&[])?;
    bench_pictures::run(&[])?;
    bench_beside_vtk::run(&[])
}

type Rates = Vec<(String, f64)>;

fn native(file: &Path) -> Result<Rates> {
    let tetralod = shell::released_command()?;
    rates(&shell::output(shell::command(tetralod, ["bench"]).arg(file).arg("--json"))?)
}

/// A page that holds the wasm module alone runs the benchmark; Node starts the browser and prints what it found.
fn browser(file: &Path) -> Result<Rates> {
    let browser = browser::require()?;
    let folder = Path::new("target/bench");
    package::build_bench(folder)?;
    std::fs::copy(file, folder.join("volume.mt")).with_context(|| file.display().to_string())?;
    let mounts = [("/bench", "target/bench")];
    let server = Server::start(&shell::released_command()?, "tests/js/bench", &mounts, 0)?;
    let mut command = shell::command("node", ["tests/js/bench/run.js"]);
    command.env("TETRALOD_PAGE", &server.address).env("CHROMIUM", browser.chromium);
    rates(&shell::output(&mut command)?)
}

/// The numbers of a report such as `{ "decode": { "updates_per_second": 1e6 } }`, as `decode.updates_per_second`.
fn rates(json: &str) -> Result<Rates> {
    let report: Value = serde_json::from_str(json).with_context(|| format!("not a report: {json}"))?;
    let mut rates = Vec::new();
    collect("", &report, &mut rates);
    Ok(rates)
}

fn collect(path: &str, value: &Value, rates: &mut Rates) {
    match value {
        Value::Number(number) => rates.push((path.to_owned(), number.as_f64().unwrap_or(f64::NAN))),
        Value::Object(members) => {
            for (name, member) in members {
                let separator = if path.is_empty() { "" } else { "." };
                collect(&format!("{path}{separator}{name}"), member, rates);
            }
        }
        _ => {}
    }
}

fn print(native: &Rates, browser: Option<&[(String, f64)]>) {
    println!("{:<36} {:>14} {:>14} {:>7}", "", "native", "browser", "ratio");
    for (name, value) in native {
        let other = browser.and_then(|rates| rates.iter().find(|(other, _)| other == name));
        match other {
            Some((_, other)) => {
                println!("{name:<36} {:>14} {:>14} {:>7.2}", short(*value), short(*other), other / value)
            }
            None => println!("{name:<36} {:>14} {:>14} {:>7}", short(*value), "-", "-"),
        }
    }
}

/// Small numbers are milliseconds and bytes.
fn short(value: f64) -> String {
    if value.abs() < 1000.0 && value.fract() != 0.0 { format!("{value:.2}") } else { format!("{value:.0}") }
}

#[cfg(test)]
mod tests {
    use super::rates;

    #[test]
    fn nested_numbers_get_dotted_names() {
        let report = r#"{ "decode": { "updates_per_second": 5 }, "name": "x", "n": 1.5 }"#;
        let expected = vec![("decode.updates_per_second".to_owned(), 5.0), ("n".to_owned(), 1.5)];
        assert_eq!(rates(report).unwrap(), expected);
        assert!(rates("oops").is_err());
    }
}
