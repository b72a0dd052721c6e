//! A small MT and, for a list of requests, the hashes of the meshes that the native program extracts from it. The
//! tests in Node and in the browser must get the same ones.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};

use crate::{fixture_builds, shell};

/// Where the fixture is made; the wasm tests include its files.
pub const FOLDER: &str = "target/fixture";

/// Requests as JavaScript makes them. The order matters: the sessions under test go from one mesh to the next.
fn requests() -> Vec<Value> {
    vec![
        json!({ "error": "5%" }),
        json!({ "error": "0.5%" }),
        json!({ "error": "0%" }),
        json!({ "error": "2%", "box": [0, 0, 0, 0.5, 0.5, 0.5] }),
        json!({ "error": "1%", "isovalues": [0.5] }),
        json!({ "error": "0.1%", "maxTets": 5000 }),
        json!({ "error": "100%" }),
    ]
}

/// The files beside `small.mt`, of the other kinds, and how they are built.
const OTHERS: [(&str, &[&str]); 2] = [("edge", &["--kind", "edge"]), ("vertex", &["--kind", "vertex"])];

/// Makes `small.mt` and `hashes.json`, a list of `{ options, hash }`; and the same for the other kinds of MT, with the
/// kind in the names.
///
/// What this very command has made before stays: steps that run side by side read it.
pub fn make(tetralod: &Path) -> Result<()> {
    let folder = Path::new(FOLDER);
    fs::create_dir_all(folder)?;
    let (made, stamp) = (folder.join("made-by"), stamp(tetralod)?);
    if fs::read_to_string(&made).is_ok_and(|text| text == stamp) {
        return Ok(());
    }
    let (grid, mt) = (folder.join("small.vti"), folder.join("small.mt"));
    shell::run(shell::command(tetralod, ["generate", "bucky", "--size", "17", "-o"]).arg(&grid))?;
    make_one(tetralod, &grid, &mt, &folder.join("hashes.json"), &[])?;
    for (kind, arguments) in OTHERS {
        let [mt, hashes] = [format!("small-{kind}.mt"), format!("hashes-{kind}.json")];
        make_one(tetralod, &grid, &folder.join(mt), &folder.join(hashes), arguments)?;
    }
    make_blocks(tetralod, folder)?;
    fixture_builds::make(tetralod, folder)?;
    fs::write(&made, stamp).with_context(|| made.display().to_string())
}

/// Tells one build of the command from another.
fn stamp(tetralod: &Path) -> Result<String> {
    let about = fs::metadata(tetralod).with_context(|| tetralod.display().to_string())?;
    let time = about.modified()?.duration_since(std::time::UNIX_EPOCH)?;
    Ok(format!("{} bytes of {}", about.len(), time.as_nanos()))
}

/// Makes `blocks-half-edge.mt`, a file of hundreds of blocks, `fields.mt`, one of two fields, and `parts.mt`, one of twelve regions.
fn make_blocks(tetralod: &Path, folder: &Path) -> Result<()> {
    for (name, data, size, extension) in
        [("blocks-half-edge", "bucky", "33", "vti"), ("fields", "sphere-flow", "14", "vtu")]
    {
        let [mesh, mt] = [extension, "mt"].map(|extension| folder.join(format!("{name}.{extension}")));
        shell::run(shell::command(tetralod, ["generate", data, "--size", size, "-o"]).arg(&mesh))?;
        let build = ["build", "--quiet", "--all-fields", "--block-updates", "64", "-o"];
        shell::run(shell::command(tetralod, build).arg(mt).arg(mesh))?;
    }
    let [mesh, mt] = ["vtu", "mt"].map(|extension| folder.join(format!("parts.{extension}")));
    shell::run(shell::command(tetralod, ["generate", "turbine", "--size", "9", "-o"]).arg(&mesh))?;
    let build = ["build", "--quiet", "--all-fields", "--preserve", "part", "--block-updates", "64", "-o"];
    shell::run(shell::command(tetralod, build).arg(mt).arg(mesh))
}

/// Builds an MT and tells the hashes of its meshes.
fn make_one(tetralod: &Path, grid: &Path, mt: &Path, hashes: &Path, arguments: &[&str]) -> Result<()> {
    shell::run(shell::command(tetralod, ["build"]).arg(grid).args(arguments).arg("-o").arg(mt))?;
    let expected: Result<Vec<Value>> =
        requests().into_iter().map(|options| expectation(tetralod, mt, options)).collect();
    fs::write(hashes, serde_json::to_string_pretty(&expected?)?)?;
    Ok(())
}

fn expectation(tetralod: &Path, mt: &Path, options: Value) -> Result<Value> {
    let out = Path::new(FOLDER).join("extracted.vtu");
    let mut command = shell::command(tetralod, ["extract"]);
    command.arg(mt).args(arguments(&options)).arg("--json").arg("-o").arg(out);
    let summary: Value = serde_json::from_str(&shell::output(&mut command)?).context("extract --json")?;
    let hash = summary["hash"].as_str().context("extract --json gives no `hash`")?;
    let tetrahedra = summary["tetrahedra"].as_u64().context("extract --json gives no `tetrahedra`")?;
    Ok(json!({ "options": options, "hash": hash, "tetrahedra": tetrahedra }))
}

/// The options of the package as arguments of `tetralod extract`.
fn arguments(options: &Value) -> Vec<String> {
    let mut arguments = Vec::new();
    let list =
        |value: &Value| value.as_array().into_iter().flatten().map(Value::to_string).collect::<Vec<_>>();
    if let Some(error) = options["error"].as_str() {
        arguments.extend(["--error".to_owned(), error.to_owned()]);
    }
    if options["box"].is_array() {
        arguments.extend(["--box".to_owned(), list(&options["box"]).join(",")]);
    }
    for value in list(&options["isovalues"]) {
        arguments.extend(["--iso".to_owned(), value]);
    }
    if options["maxTets"].is_number() {
        arguments.extend(["--budget".to_owned(), options["maxTets"].to_string()]);
    }
    arguments
}
