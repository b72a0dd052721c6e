//! Promise: the commands in `docs/gallery.md` draw the pictures that it shows, as far as an eye can tell.
//!
//! The pictures of generated data are always compared, the others where `TETRALOD_DATA` names the folder of the data
//! sets. `TETRALOD_UPDATE_GALLERY=1 cargo test --release --package tetralod-cli gallery -- --include-ignored` writes them again.

use crate::data::real_data;
use crate::readme::{PROMPT, arguments, content, root, write_files};
use crate::render::Picture;
use crate::support::{Folder, bucky, command, good, text};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const PAGE: &str = "docs/gallery.md";
/// The folder of the pictures. Those that VTK makes begin with `vtk-`: the script in `benches/` writes them.
const PICTURES: &str = "docs/gallery";
const FOREIGN: &str = "vtk-";

/// How much pictures of one scene may differ, in units of CIELAB: devices round differently, and smooth edges in
/// other ways. A difference of 2 is just visible.
const MOST: Difference = Difference { mean: 0.5, worst: 4.0 };

/// Pixels along each side of what is compared: one mean colour.
const BLOCK: usize = 4;

/// How two pictures differ to the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Difference {
    mean: f64,
    /// What 99 of 100 places do not exceed.
    worst: f64,
}

impl Difference {
    fn between(a: &Picture, b: &Picture) -> Self {
        assert_eq!((a.size, a.channels), (b.size, b.channels));
        let [a, b] = [a, b].map(blocks);
        let distance =
            |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        let mut distances: Vec<f64> = a.iter().zip(&b).map(distance).collect();
        distances.sort_by(f64::total_cmp);
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        Self { mean, worst: distances[distances.len() * 99 / 100] }
    }

    fn is_seen(self) -> bool {
        self.mean > MOST.mean || self.worst > MOST.worst
    }
}

/// The mean colours of blocks of pixels, in CIELAB. Parts of blocks at the right and at the bottom count as blocks.
fn blocks(picture: &Picture) -> Vec<[f64; 3]> {
    let [width, height] = picture.size.map(|side| side as usize);
    let starts = (0..height).step_by(BLOCK).flat_map(|y| (0..width).step_by(BLOCK).map(move |x| [x, y]));
    let mean = |[x, y]: [usize; 2]| {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for row in y..(y + BLOCK).min(height) {
            for column in x..(x + BLOCK).min(width) {
                let at = (row * width + column) * picture.channels;
                (0..3).for_each(|k| sum[k] += linear(picture.bytes[at + k]));
                count += 1.0;
            }
        }
        lab(sum.map(|c| c / count))
    };
    starts.map(mean).collect()
}

/// The light of a byte of sRGB, 0 to 1.
fn linear(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// CIELAB of linear sRGB, with the white of D65.
fn lab([r, g, b]: [f64; 3]) -> [f64; 3] {
    let x = (0.412_456 * r + 0.357_576 * g + 0.180_438 * b) / 0.950_47;
    let y = 0.212_673 * r + 0.715_152 * g + 0.072_175 * b;
    let z = (0.019_334 * r + 0.119_192 * g + 0.950_304 * b) / 1.088_83;
    let root = |t: f64| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    let [x, y, z] = [x, y, z].map(root);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The commands of the page. One may go on in the next line, after a backslash.
fn commands(page: &str) -> Vec<String> {
    let joined = page.replace("\\\n", " ");
    joined.lines().filter_map(|line| line.strip_prefix(PROMPT)).map(str::to_owned).collect()
}

/// What a command writes.
fn output<'a>(words: &[&'a str]) -> &'a str {
    let at = words.iter().position(|word| *word == "-o").expect("an output");
    words[at + 1]
}

/// The files that a command reads.
fn inputs<'a>(words: &[&'a str]) -> impl Iterator<Item = &'a str> {
    let out = output(words);
    let is_data = |word: &&str| [".vtu", ".vti", ".vtk", ".pvd", ".mt"].iter().any(|end| word.ends_with(end));
    words.iter().copied().filter(move |word| *word != out && is_data(word))
}

/// The commands that work on what others of them, and the page, write; and those that take data sets, or what is made of such.
fn by_origin<'a>(commands: &'a [String], folder: &Path) -> [Vec<&'a String>; 2] {
    let mut made = BTreeSet::new();
    let (own, foreign) = commands.iter().partition(|command| {
        let words = arguments(command);
        let is_own = inputs(&words).all(|name| made.contains(name) || folder.join(name).exists());
        if is_own {
            made.insert(output(&words).to_owned());
        }
        is_own
    });
    [own, foreign]
}

/// Runs a command in a folder; inputs that are not there are data sets.
fn run(words: &[&str], folder: &Path) {
    let inputs: BTreeSet<&str> = inputs(words).collect();
    let place = |word: &str| {
        let is_here = !inputs.contains(word) || folder.join(word).exists();
        if is_here {
            word.to_owned()
        } else {
            real_data().join(word).to_str().expect("a name in UTF-8").to_owned()
        }
    };
    let placed: Vec<String> = words.iter().map(|word| place(word)).collect();
    let placed: Vec<&str> = placed.iter().map(String::as_str).collect();
    let run = command(&placed).current_dir(folder).output().expect("the command starts");
    assert!(run.status.success(), "{words:?}: {}", text(&run.stderr));
}

/// Runs the commands of the page that take data sets, or the others, and compares their pictures, at least so many, with those that are shown;
/// or writes them.
fn check_pictures(of_data_sets: bool, least: usize) {
    let (page, folder) = (content(PAGE), Folder::new(if of_data_sets { "gallery-data" } else { "gallery" }));
    let path = PathBuf::from(folder.path(""));
    write_files(&page, &path);
    let commands = commands(&page);
    let update = std::env::var_os("TETRALOD_UPDATE_GALLERY").is_some();
    let (mut drawn, mut seen) = (0, Vec::new());
    for command in &by_origin(&commands, &path)[usize::from(of_data_sets)] {
        let words = arguments(command);
        run(&words, &path);
        if words[0] != "render" {
            continue;
        }
        drawn += 1;
        let name = output(&words);
        let stored = root().join(PICTURES).join(name);
        if update {
            fs::create_dir_all(root().join(PICTURES)).expect("the folder can be made");
            fs::copy(path.join(name), stored).expect("the picture can be written");
        } else {
            let [found, expected] =
                [&path.join(name), &stored].map(|file| Picture::read(file.to_str().unwrap()));
            let difference = Difference::between(&found, &expected);
            seen.extend(difference.is_seen().then_some((name.to_owned(), difference)));
        }
    }
    assert!(seen.is_empty(), "these differ from the pictures shown: {seen:?}");
    assert!(drawn >= least, "{drawn} pictures");
}

#[test]
fn commands_draw_the_pictures_of_generated_data_that_are_shown() {
    check_pictures(false, 10);
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn commands_draw_the_pictures_of_data_sets_that_are_shown() {
    check_pictures(true, 1);
}

#[test]
fn all_pictures_are_shown_and_made_by_a_command() {
    let page = content(PAGE);
    let commands = commands(&page);
    let made: BTreeSet<&str> = commands
        .iter()
        .map(|command| arguments(command))
        .filter(|words| words[0] == "render")
        .map(|words| output(&words))
        .collect();
    let files = fs::read_dir(root().join(PICTURES)).expect("the folder of the pictures");
    let names = files.map(|file| file.expect("a file").file_name().to_string_lossy().into_owned());
    let (foreign, own): (BTreeSet<String>, BTreeSet<String>) =
        names.partition(|name| name.starts_with(FOREIGN));
    assert_eq!(own.iter().map(String::as_str).collect::<BTreeSet<_>>(), made);
    for name in own.iter().chain(&foreign) {
        assert!(page.contains(&format!("](gallery/{name})")), "{PAGE} does not show {name}");
        let bytes = fs::metadata(root().join(PICTURES).join(name)).expect("a file").len();
        assert!(bytes < 130_000, "{name} has {bytes} bytes");
    }
}

/// The measure must tell pictures apart that show different things, and none that show the same.
#[test]
fn other_pictures_are_told_apart() {
    let folder = Folder::new("measure");
    let [input, mt, out] = ["a.vti", "a.mt", "a.png"].map(|name| folder.path(name));
    bucky(17, &input, &mt);
    let draw = |options: &[&str]| {
        let common = ["render", &mt, "-o", &out, "--size", "400x300"];
        good(&[&common, options].concat());
        Picture::read(&out)
    };
    let surface = ["--isovalue", "0.5", "--samples", "8"];
    let before = draw(&surface);
    assert_eq!(Difference::between(&before, &before), Difference { mean: 0.0, worst: 0.0 });
    let check = |name: &str, before: &Picture, after: &Picture, is_other: bool| {
        let difference = Difference::between(before, after);
        println!("{name}: {difference:.2?}");
        assert_eq!(difference.is_seen(), is_other, "{name}: {difference:?}");
    };
    check("other samples", &before, &draw(&["--isovalue", "0.5", "--samples", "11"]), false);
    for [name, option, value] in [
        ["shifted isovalue", "--isovalue", "0.54"],
        ["lower error", "--error", "5%"],
        ["turned camera", "--turn", "2,0"],
        ["moved closer", "--zoom", "1.03"],
        ["light background", "--background", "light"],
    ] {
        let options =
            [if option == "--isovalue" { &surface[2..] } else { &surface }, &[option, value]].concat();
        check(name, &before, &draw(&options), true);
    }
    let slice = ["--slice", "y=0.5", "--samples", "8"];
    let before = draw(&slice);
    for [name, option, value] in [["other map", "--map", "cividis"], ["other range", "--colour-range", "0,1"]]
    {
        check(name, &before, &draw(&[&slice[..], &[option, value]].concat()), true);
    }
    let volume = |last: &str| draw(&["--mode", "volume", "--samples", "2", "--opacities", last]);
    check("denser volume", &volume("0.2,0,0.9,0.5"), &volume("0.2,0,0.9,0.6"), true);
}
