//! The volumes of the demo: how they are made, and the list of them that the page reads.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::{Value, json};

use crate::shell;

/// Where the page looks for its volumes.
pub const DATA: &str = "www/data";

/// The list of volumes.
const LIST: &str = "volumes.json";

/// Where the data of a volume comes from.
#[derive(Clone, Copy)]
enum Data {
    /// `tetralod generate NAME --size SIZE`.
    Generated { name: &'static str, size: &'static str, extension: &'static str },
    /// The mesh that inserting the points of the bucky ball of this size ends with: what `docs/paper.md` makes edge-based MTs of.
    Inserted { size: &'static str },
}

/// A volume of the demo.
#[derive(Clone, Copy)]
pub struct Volume {
    /// The name of its MT file.
    name: &'static str,
    title: &'static str,
    /// What it shows, in a sentence.
    sentence: &'static str,
    data: Data,
    /// Arguments of `tetralod build`.
    build: &'static [&'static str],
    /// How the page shows it first: settings, as in the address of the page.
    scene: &'static str,
    /// How its thumbnail is drawn: arguments of `tetralod render`.
    picture: &'static [&'static str],
    /// Whether the gallery shows it; all are in the list of data sets.
    is_shown: bool,
}

impl Volume {
    fn file(&self, extension: &str) -> PathBuf {
        Path::new(DATA).join(format!("{}.{extension}", self.name))
    }
}

/// Shown first as soon as it is there.
pub const LARGE: Volume = Volume {
    name: "helix",
    title: "Double helix",
    sentence: "A model of DNA: two backbones and the pairs of bases between them, with density and charge. \
               12.4 million tetrahedra, of which the page fetches what the picture needs.",
    data: Data::Generated { name: "helix", size: "97", extension: "vti" },
    build: &["--all-fields"],
    scene: "isovalue=0.55&surface-colour=charge&map=coolwarm&error=50&axes=0&outline=0&camera=14,14,32.67,116,-0.75,0.12",
    picture: &[
        "--isovalue",
        "0.55",
        "--error",
        "1%",
        "--colour-field",
        "charge",
        "--map",
        "coolwarm",
        "--colour-range",
        "-1.7,1.7",
        "--no-outline",
        "--zoom",
        "1.35",
    ],
    is_shown: true,
};

/// How many of the small volumes are made before the page is served: the first of them.
pub const BEFORE_PAGE: usize = 3;

/// Small volumes: each kind of MT is among them, since the page opens all alike.
pub const SMALL: [Volume; 8] = [
    Volume {
        name: "bucky",
        title: "Bucky ball",
        sentence: "The carbon molecule C60: one field on a grid, split into 1.6 million tetrahedra.",
        data: Data::Generated { name: "bucky", size: "65", extension: "vti" },
        build: &["--kind", "half-edge"],
        scene: "",
        picture: &["--error", "1%", "--no-outline", "--zoom", "1.6"],
        is_shown: true,
    },
    Volume {
        name: "sphere-flow",
        title: "Flow past a sphere",
        sentence: "Pressure and speed of a stream around a body. The mesh has a hole where the sphere is, and its \
                   surface is refined with the field.",
        data: Data::Generated { name: "sphere-flow", size: "24", extension: "vtu" },
        build: &["--kind", "half-edge", "--all-fields"],
        scene: "view=solid&cut=500&map=turbo",
        picture: &[
            "--mode",
            "boundary",
            "--clip",
            "0,-1,0,0",
            "--map",
            "turbo",
            "--no-outline",
            "--zoom",
            "2.2",
        ],
        is_shown: true,
    },
    Volume {
        name: "abc-flow",
        title: "ABC flow",
        sentence: "Pressure and velocity of a flow in eight time steps: press Play, or turn to the view Flow for \
                   streamlines and arrows.",
        data: Data::Generated { name: "abc-flow", size: "21", extension: "pvd" },
        build: &["--field", "pressure", "--field", "velocity", "--unit", "velocity=m/s"],
        scene: "view=flow",
        picture: &[
            "--mode",
            "volume",
            "--map",
            "inferno",
            "--opacities",
            "-2,0,-1.2,0.2,0,0.9",
            "--no-outline",
            "--zoom",
            "1.05",
        ],
        is_shown: true,
    },
    Volume {
        name: "figure-6",
        title: "Figure 6 of the paper",
        sentence: "Around the isovalue 0.81 the error is at most 0.1 %: 74,236 tetrahedra. With this error everywhere \
                   it takes 149,646, for the same surface of 18,206 triangles.",
        data: Data::Generated { name: "bucky", size: "33", extension: "vti" },
        build: &["--kind", "vertex", "--method", "insert"],
        scene: "view=mesh&isovalue=0.81&focus=1&error=25&cut=500",
        picture: &[
            "--mode",
            "cells",
            "--iso",
            "0.81",
            "--error",
            "0.1%",
            "--cut",
            "0,-1,0,-0.5",
            "--no-outline",
            "--zoom",
            "1.15",
        ],
        is_shown: true,
    },
    Volume {
        name: "figure-7",
        title: "Figure 7 of the paper",
        sentence: "Only in a box, the octant nearest to the eye, the mesh is exact: 155,875 of its 196,608 tetrahedra.",
        data: Data::Inserted { size: "33" },
        build: &["--kind", "edge"],
        scene: "view=mesh&error=0&region=box&box=0.5,0,0.5,1,0.5,1&cut=250",
        picture: &[
            "--mode",
            "cells",
            "--box",
            "0.5,0,0.5,1,0.5,1",
            "--error",
            "0",
            "--cut",
            "0,-1,0,-0.25",
            "--no-outline",
            "--zoom",
            "1.15",
        ],
        is_shown: true,
    },
    Volume {
        name: "sphere-flow-edge",
        title: "Flow past a sphere (edge-based MT)",
        sentence: "The same flow as an edge-based MT.",
        data: Data::Generated { name: "sphere-flow", size: "24", extension: "vtu" },
        build: &["--kind", "edge"],
        scene: "",
        picture: &[],
        is_shown: false,
    },
    Volume {
        name: "sphere-flow-vertex",
        title: "Flow past a sphere (vertex-based MT)",
        sentence: "The same flow as a vertex-based MT.",
        data: Data::Generated { name: "sphere-flow", size: "24", extension: "vtu" },
        build: &["--kind", "vertex"],
        scene: "",
        picture: &[],
        is_shown: false,
    },
    Volume {
        name: "bucky-explicit",
        title: "Small bucky ball (explicit MT)",
        sentence: "A small bucky ball as an explicit MT.",
        data: Data::Generated { name: "bucky", size: "17", extension: "vti" },
        build: &["--kind", "explicit"],
        scene: "",
        picture: &[],
        is_shown: false,
    },
];

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
        args.extend(volume.build.iter().map(|arg| (*arg).to_owned()));
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
    command.arg(mt).args(volume.picture);
    command.args(["--size", "480x300", "--samples", "4", "--background", "transparent", "-o"]).arg(picture);
    if let Err(error) = shell::run(&mut command) {
        println!("no thumbnail of {}: {error:#}", volume.name);
    }
}

/// Draws the thumbnails of all volumes that are there.
pub fn draw_all(tetralod: &Path) {
    there().iter().for_each(|volume| draw(tetralod, volume));
}

/// The volumes that are there, the largest first.
fn there() -> Vec<Volume> {
    [LARGE].into_iter().chain(SMALL).filter(|volume| volume.file("mt").is_file()).collect()
}

/// Writes the data of a volume; gives the files, one for each time step.
fn write_data(volume: &Volume, run: &impl Fn(Vec<String>) -> Result<()>) -> Result<Vec<PathBuf>> {
    let in_target = |name: String| Path::new("target").join(name);
    match volume.data {
        Data::Generated { name, size, extension } => {
            let input = in_target(format!("{}.{extension}", volume.name));
            let path = input.display().to_string();
            run(["generate", name, "--size", size, "-o", &path].map(str::to_owned).to_vec())?;
            Ok(vec![input])
        }
        Data::Inserted { size } => {
            let [points, mt, mesh] = ["vti", "mt", "vtu"].map(|extension| {
                in_target(format!("{}-points.{extension}", volume.name)).display().to_string()
            });
            let words = |args: &[&str]| args.iter().map(|&arg| arg.to_owned()).collect();
            run(words(&["generate", "bucky", "--size", size, "-o", &points]))?;
            run(words(&["build", &points, "--kind", "vertex", "--method", "insert", "-o", &mt]))?;
            run(words(&["extract", &mt, "--error", "0", "-o", &mesh]))?;
            Ok(vec![mesh.into()])
        }
    }
}

/// Writes the list of the volumes that are there, the largest first. `pending` are being made.
pub fn write_list(tetralod: &Path, pending: &[Volume]) -> Result<()> {
    let listed = there().iter().map(|volume| entry(tetralod, volume)).collect::<Result<Vec<_>>>()?;
    let pending: Vec<Value> =
        pending.iter().map(|volume| json!({ "title": volume.title, "isShown": volume.is_shown })).collect();
    let list = Path::new(DATA).join(LIST);
    // Moved, so that the page reads the old list or the new one.
    let part = list.with_extension("part");
    fs::write(&part, serde_json::to_string_pretty(&json!({ "volumes": listed, "pending": pending }))?)?;
    fs::rename(&part, &list).with_context(|| list.display().to_string())
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
    fn names_are_different() {
        let mut names: Vec<&str> = SMALL.iter().chain([&LARGE]).map(|volume| volume.name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
