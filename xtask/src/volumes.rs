//! The volumes of the demo: makes those of `xtask/volumes.json`, and writes the list of them that the page reads, `www/data/volumes.json`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::shell;

/// Where the page looks for its volumes.
pub const DATA: &str = "www/data";

/// The list of volumes.
const LIST: &str = "volumes.json";

/// The volumes that there are.
const VOLUMES: &str = "xtask/volumes.json";

/// How many of the small volumes are made before the page is served: the first of them.
pub const BEFORE_PAGE: usize = 3;

/// The volumes of the demo.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Volumes {
    /// Shown first as soon as it is there.
    pub large: Volume,
    /// Each kind of MT is among them, since the page opens all alike.
    pub small: Vec<Volume>,
}

/// A volume of the demo.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub struct Volume {
    /// The name of its MT file.
    name: String,
    title: String,
    /// What it shows, in a sentence.
    sentence: String,
    data: Data,
    /// Arguments of `tetralod build`, with spaces between them.
    build: String,
    /// How the page shows it first: settings, as in the address of the page.
    scene: String,
    /// How its thumbnail is drawn: arguments of `tetralod render`, with spaces between them.
    picture: String,
    /// Whether the gallery shows it; all are in the list of data sets.
    is_shown: bool,
}

/// Where the data of a volume comes from.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
enum Data {
    /// `tetralod generate NAME --size SIZE`.
    Generated { name: String, size: u32, extension: String },
    /// The mesh that inserting the points of the bucky ball of this size ends with: what `docs/paper.md` makes edge-based MTs of.
    Inserted { size: u32 },
}

impl Volume {
    fn file(&self, extension: &str) -> PathBuf {
        Path::new(DATA).join(format!("{}.{extension}", self.name))
    }
}

impl Volumes {
    pub fn read() -> Result<Self> {
        let text = fs::read_to_string(shell::root().join(VOLUMES)).context(VOLUMES)?;
        serde_json::from_str(&text).context(VOLUMES)
    }

    /// Draws the thumbnails of all volumes that are there.
    pub fn draw(&self, tetralod: &Path) {
        self.there().for_each(|volume| draw(tetralod, volume));
    }

    /// Writes the list of the volumes that are there, the largest first. `pending` are being made.
    pub fn write_list(&self, tetralod: &Path, pending: &[Volume]) -> Result<()> {
        let listed = self.there().map(|volume| entry(tetralod, volume)).collect::<Result<Vec<_>>>()?;
        let pending: Vec<Value> = pending
            .iter()
            .map(|volume| json!({ "title": volume.title, "isShown": volume.is_shown }))
            .collect();
        let list = Path::new(DATA).join(LIST);
        // Moved, so that the page reads the old list or the new one.
        let part = list.with_extension("part");
        fs::write(&part, serde_json::to_string_pretty(&json!({ "volumes": listed, "pending": pending }))?)?;
        fs::rename(&part, &list).with_context(|| list.display().to_string())
    }

    /// The volumes that are there, the largest first.
    fn there(&self) -> impl Iterator<Item = &Volume> {
        [&self.large].into_iter().chain(&self.small).filter(|volume| volume.file("mt").is_file())
    }
}

/// Makes the MT file of a volume where it is missing, or older than the command that makes it. The commands run with `prefix` in
/// front of them.
pub fn make(tetralod: &Path, volume: &Volume, prefix: &[&str]) -> Result<()> {
    let mt = volume.file("mt");
    let run = |args: Vec<String>| {
        let mut words = prefix.iter().map(|word| (*word).to_owned()).chain([tetralod.display().to_string()]);
        let program = words.next().context("no command")?;
        shell::run(&mut shell::command(program, words.chain(args)))
    };
    if !is_newer(&mt, tetralod) {
        println!("making {}", mt.display());
        let inputs = write_data(volume, &run)?;
        // Built beside and moved, so that an interrupted build is not taken for a finished one.
        let part = Path::new("target").join(format!("{}.mt", volume.name));
        let paths = inputs.iter().chain([&part]).map(|path| path.display().to_string()).collect::<Vec<_>>();
        let (part_name, inputs) = paths.split_last().context("no paths")?;
        let mut args = vec!["build".to_owned()];
        args.extend(inputs.iter().cloned());
        args.extend(volume.build.split_whitespace().map(str::to_owned));
        args.extend(["-o".to_owned(), part_name.clone()]);
        run(args)?;
        fs::rename(&part, &mt).with_context(|| format!("moving {}", mt.display()))?;
    }
    Ok(())
}

/// Draws the thumbnail of a volume where it is missing, or older than the MT file, by a command that draws. Where there is no Vulkan
/// there are no thumbnails; the page does without.
fn draw(tetralod: &Path, volume: &Volume) {
    let (mt, picture) = (volume.file("mt"), volume.file("png"));
    if !volume.is_shown || is_newer(&picture, &mt) {
        return;
    }
    let mut command = shell::command(tetralod, ["render"]);
    command.arg(mt).args(volume.picture.split_whitespace());
    command.args(["--size", "480x300", "--samples", "4", "--background", "transparent", "-o"]).arg(picture);
    if let Err(error) = shell::run(&mut command) {
        println!("no thumbnail of {}: {error:#}", volume.name);
    }
}

/// Writes the data of a volume; gives the files, one for each time step.
fn write_data(volume: &Volume, run: &impl Fn(Vec<String>) -> Result<()>) -> Result<Vec<PathBuf>> {
    let in_target = |name: String| Path::new("target").join(name);
    match &volume.data {
        Data::Generated { name, size, extension } => {
            let input = in_target(format!("{}.{extension}", volume.name));
            let path = input.display().to_string();
            run(["generate", name, "--size", &size.to_string(), "-o", &path].map(str::to_owned).to_vec())?;
            Ok(vec![input])
        }
        Data::Inserted { size } => {
            let [points, mt, mesh] = ["vti", "mt", "vtu"].map(|extension| {
                in_target(format!("{}-points.{extension}", volume.name)).display().to_string()
            });
            let words = |args: &[&str]| args.iter().map(|&arg| arg.to_owned()).collect();
            run(words(&["generate", "bucky", "--size", &size.to_string(), "-o", &points]))?;
            run(words(&["build", &points, "--kind", "vertex", "--method", "insert", "-o", &mt]))?;
            run(words(&["extract", &mt, "--error", "0", "-o", &mesh]))?;
            Ok(vec![mesh.into()])
        }
    }
}

fn entry(tetralod: &Path, volume: &Volume) -> Result<Value> {
    let mt = volume.file("mt");
    let info = shell::output(shell::command(tetralod, ["info", "--json"]).arg(&mt))?;
    let info: Value = serde_json::from_str(&info).context("what `tetralod info --json` prints")?;
    let count = |name: &str| info[name].as_u64().with_context(|| format!("`tetralod info` gives no {name}"));
    let (vertices, tetrahedra) = (count("vertices")?, count("tetrahedra")?);
    let fields = info["fields"].as_array().map_or(1, Vec::len) as u64;
    let url = |extension: &str| format!("data/{}.{extension}", volume.name);
    let picture = volume.file("png").is_file().then(|| url("png"));
    Ok(json!({
        "url": url("mt"),
        "title": volume.title,
        "sentence": volume.sentence,
        "scene": volume.scene,
        "picture": picture,
        "isShown": volume.is_shown,
        "vertices": vertices,
        "tetrahedra": tetrahedra,
        "fields": fields,
        "bytes": count("file_bytes")?,
    }))
}

fn is_newer(file: &Path, than: &Path) -> bool {
    let modified = |path: &Path| path.metadata().and_then(|data| data.modified()).ok();
    matches!((modified(file), modified(than)), (Some(file), Some(than)) if file >= than)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_different_and_enough_are_small() -> Result<()> {
        let Volumes { large, small } = Volumes::read()?;
        assert!(small.len() >= BEFORE_PAGE);
        let mut names: Vec<&str> = small.iter().chain([&large]).map(|volume| volume.name.as_str()).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        Ok(())
    }
}
