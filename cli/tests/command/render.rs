//! Promise: `render` draws each kind of picture, of the size that is asked for, the same each time, and
//! refuses what it cannot draw.
//!
//! It needs a Vulkan driver, for which software will do.

use crate::fields::two_steps;
use crate::support::{Folder, bad, bucky, good, json, run, text};
use std::fs;
use std::fs::File;
use std::io::BufReader;

/// A coarse mesh in a small picture, for software that draws.
const SMALL: [&str; 6] = ["--size", "120x90", "--samples", "2", "--error", "10%"];

pub struct Picture {
    pub size: [u32; 2],
    /// Bytes of a pixel.
    pub channels: usize,
    pub bytes: Vec<u8>,
    about: String,
}

impl Picture {
    /// A picture; of a movie all of its pictures below one another, without words about it.
    pub fn read(path: &str) -> Self {
        if path.ends_with(".gif") {
            let (size, pictures, _) = gif_pictures(path);
            let size = [size[0], size[1] * pictures.len() as u32];
            return Self { size, channels: 4, bytes: pictures.concat(), about: String::new() };
        }
        let decoder = png::Decoder::new(BufReader::new(File::open(path).expect("a picture")));
        let mut reader = decoder.read_info().expect("PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut bytes).expect("pixels");
        reader.finish().expect("the end");
        let software = &reader.info().uncompressed_latin1_text;
        assert!(
            software.iter().any(|chunk| chunk.keyword == "Software" && chunk.text.starts_with("tetralod "))
        );
        let about = &reader.info().utf8_text;
        let about = about.iter().find(|chunk| chunk.keyword == "Description").expect("a description");
        let about = about.get_text().expect("UTF-8");
        Self { size: [info.width, info.height], channels: info.color_type.samples(), bytes, about }
    }

    /// How many pixels differ from those of another picture.
    fn differing(&self, other: &Self) -> usize {
        let pairs = self.bytes.chunks(self.channels).zip(other.bytes.chunks(other.channels));
        pairs.filter(|(a, b)| a != b).count()
    }
}

/// A folder, a small MT in it, and the name of a picture.
fn prepared(name: &str, size: u32) -> (Folder, String, String) {
    let folder = Folder::new(name);
    let [input, mt, out] = ["a.vti", "a.mt", "a.png"].map(|name| folder.path(name));
    bucky(size, &input, &mt);
    (folder, mt, out)
}

/// Draws with some more options.
fn draw(mt: &str, out: &str, options: &[&str]) -> Picture {
    good(&[&["render", mt, "-o", out], &SMALL[..], options].concat());
    Picture::read(out)
}

#[test]
fn each_mode_is_a_picture_of_its_own_and_the_same_each_time() {
    let (_folder, mt, out) = prepared("modes", 9);
    let empty = draw(&mt, &out, &["--isovalue", "99"]);
    let mut drawn: Vec<Picture> = Vec::new();
    for mode in
        ["isosurface", "volume", "slice", "boundary", "cells", "wire", "points", "isosurface,slice,wire"]
    {
        let picture = draw(&mt, &out, &["--mode", mode]);
        assert_eq!((picture.size, picture.channels), ([120, 90], 3), "{mode}");
        assert!(picture.differing(&empty) > 300, "{mode} is blank");
        assert!(drawn.iter().all(|other| picture.differing(other) > 50), "{mode} is like another mode");
        assert!(picture.about.starts_with("a.mt: density, "), "{}", picture.about);
        let first = fs::read(&out).expect("a picture");
        draw(&mt, &out, &["--mode", mode]);
        assert!(first == fs::read(&out).expect("a picture"), "{mode} is not the same again");
        drawn.push(picture);
    }
}

#[test]
fn options_change_the_picture() {
    let (_folder, mt, out) = prepared("options", 9);
    let boundary = ["--mode", "boundary,isosurface"];
    let before = draw(&mt, &out, &boundary);
    let sets: [&[&str]; 12] = [
        &["--clip", "y=0.5"],
        &["--clip-box", "0,0.5,0,1,1,1"],
        &["--edges"],
        &["--opacity", "40%"],
        &["--map", "turbo"],
        &["--colour-range", "-1,2"],
        &["--reversed"],
        &["--background", "light"],
        &["--from", "-x"],
        &["--turn", "20,-10"],
        &["--zoom", "1.5"],
        &["--orthographic"],
    ];
    for options in sets {
        let after = draw(&mt, &out, &[&boundary, options].concat());
        assert!(after.differing(&before) > 100, "{options:?} changes nothing");
    }
    let before = draw(&mt, &out, &["--mode", "cells"]);
    for options in [["--colour-by", "size"], ["--shrink", "30%"], ["--cut", "y=0.5"]] {
        assert!(draw(&mt, &out, &options).differing(&before) > 100, "{options:?} changes nothing");
    }
    // An isosurface has a colour of its own, or that of its value.
    let before = draw(&mt, &out, &["--isovalue", "0.5", "--background", "light"]);
    let coloured = ["--isovalue", "0.5", "--background", "light", "--colour-field", "density"];
    assert!(draw(&mt, &out, &coloured).differing(&before) > 100, "--colour-field changes nothing");
    // A part of the range is visible.
    let before = draw(&mt, &out, &["--mode", "volume"]);
    let after = draw(&mt, &out, &["--opacities", "0.4,0,0.6,0.9"]);
    assert!(after.differing(&before) > 100);
    let report = json(&[&["render", &mt, "-o", &out, "--json", "--mode", "slice"], &SMALL[..]].concat());
    assert_eq!((&report["width"], &report["colours"]["of"]), (&120.into(), &"density".into()));
}

#[test]
fn a_time_step_has_the_colours_of_all() {
    let (folder, mt) = two_steps("coloured-steps");
    let out = folder.path("a.png");
    let drawn = |more: &[&str]| {
        let all = ["render", &mt, "-o", &out, "--size", "120x90", "--samples", "1", "--json", "--field", "p"];
        let report = json(&[&all[..], more].concat());
        (report, Picture::read(&out))
    };
    let [(first, before), (second, after)] =
        ["-1", "3.5"].map(|time| drawn(&["--mode", "boundary", "--time", time]));
    assert_eq!((&first["time"], &second["time"]), (&(-1.0).into(), &3.5.into()));
    assert_eq!(first["colours"], second["colours"]);
    assert!(before.differing(&after) > 300);
    assert!(after.about.starts_with("s.mt: p at time 3.5, "), "{}", after.about);
    let (moved, _) = drawn(&["--mode", "boundary", "--time", "3.5", "--deform", "U", "--factor", "0.1"]);
    assert_eq!((&moved["deform_time"], &moved["colours"]), (&3.5.into(), &first["colours"]));
    // Another field has the colours of all of its steps, too.
    let by = |time| drawn(&["--mode", "isosurface", "--colour-field", "U_z", "--time", time]).0;
    assert_eq!((&by("-1")["colours"], &by("3.5")["colours"]["of"]), (&by("3.5")["colours"], &"U_z".into()));
}

/// The size of a .gif, its pictures as RGBA, and how long each is shown, in hundredths of a second.
fn gif_pictures(path: &str) -> ([u32; 2], Vec<Vec<u8>>, Vec<u16>) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(File::open(path).expect("a movie")).expect("GIF");
    let size = [decoder.width(), decoder.height()].map(u32::from);
    let (mut pictures, mut delays) = (Vec::new(), Vec::new());
    while let Some(frame) = decoder.read_next_frame().expect("a picture") {
        delays.push(frame.delay);
        pictures.push(frame.buffer.to_vec());
    }
    (size, pictures, delays)
}

/// The pictures of an .apng.
fn apng_pictures(path: &str) -> Vec<Vec<u8>> {
    let decoder = png::Decoder::new(BufReader::new(File::open(path).expect("a movie")));
    let mut reader = decoder.read_info().expect("PNG");
    let count = reader.info().animation_control().expect("a movie").num_frames;
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let mut next = || {
        reader.next_frame(&mut bytes).expect("a picture");
        bytes.clone()
    };
    (0..count).map(|_| next()).collect()
}

#[test]
fn a_movie_has_the_pictures_that_single_ones_are() {
    let (folder, mt, out) = prepared("turntable", 9);
    let [gif, apng, one] = ["a.gif", "a.apng", "one.png"].map(|name| folder.path(name));
    let movie = ["--mode", "boundary", "--turntable", "4"];
    let report = |out: &str, more: &[&str]| {
        json(&[&["render", &mt, "-o", out, "--json"], &SMALL[..], &movie, more].concat())
    };
    let told = report(&out, &[]);
    assert_eq!((&told["pictures"], told.get("fps"), told.get("times")), (&4.into(), None, None));
    let paths = [1, 2, 3, 4].map(|number| folder.path(&format!("a-000{number}.png")));
    let files = folder.names();
    assert_eq!(files.iter().filter(|name| name.ends_with(".png")).count(), 4, "{files:?}");
    let pictures = paths.each_ref().map(|path| Picture::read(path));
    for (picture, turn) in pictures.iter().zip(["0,0", "90,0", "180,0", "270,0"]) {
        // Of a cube that is turned by quarters, all pictures have the same distance.
        report(&folder.path("b.png"), &["--turn", turn]);
        let first = Picture::read(&folder.path("b-0001.png"));
        assert!(picture.differing(&first) < 20, "{turn}");
    }
    // A picture alone fills its frame more, with what is seen of the model in its middle.
    let alone = json(&[&["render", &mt, "-o", &one, "--json"], &SMALL[..], &["--mode", "boundary"]].concat());
    let [near, far] =
        [&alone, &told].map(|report| report["camera"]["distance"].as_f64().expect("a distance"));
    assert!(near < far && near > 0.8 * far, "{near} {far}");
    assert_eq!(told["camera"]["target"], serde_json::json!([0.5, 0.5, 0.5]));
    assert!(pictures[1].differing(&pictures[0]) > 300);
    // One file has the same, exactly or in 256 colours.
    assert_eq!(report(&apng, &[])["fps"], 20.0);
    assert_eq!(apng_pictures(&apng), pictures.each_ref().map(|picture| picture.bytes.clone()));
    assert_eq!(report(&gif, &["--fps", "30"])["fps"], 30.0);
    let (size, found, delays) = gif_pictures(&gif);
    assert_eq!((size, found.len(), delays), ([120, 90], 4, vec![3, 4, 3, 3]));
    for (found, picture) in found.iter().zip(&pictures) {
        let pairs = found.as_chunks::<4>().0.iter().zip(picture.bytes.as_chunks::<3>().0);
        let off = pairs.map(|(a, b)| (0..3).map(|k| u64::from(a[k].abs_diff(b[k]))).sum::<u64>());
        assert!(off.sum::<u64>() < 3 * 4 * 120 * 90, "the colours are others");
    }
    // The same again.
    for (path, more) in [(&apng, &[][..]), (&gif, &["--fps", "30"])] {
        let before = fs::read(path).expect("a movie");
        report(path, more);
        assert!(before == fs::read(path).expect("a movie"), "{path} is not the same again");
    }
    // What is transparent stays it.
    report(&gif, &["--background", "transparent", "--no-outline"]);
    let corner = |picture: &Vec<u8>| picture[3];
    let middle = |picture: &Vec<u8>| picture[4 * (45 * 120 + 60) + 3];
    let (_, found, _) = gif_pictures(&gif);
    assert!(found.iter().all(|picture| (corner(picture), middle(picture)) == (0, 255)));
    let refused: [(i32, &[&str], &str); 6] = [
        (2, &["-o", &gif], "--turntable"),
        (2, &["-o", &out, "--turntable", "4", "--fps", "3"], "--fps"),
        (2, &["-o", &gif, "--turntable", "4", "--fps", "60"], "50"),
        (2, &["-o", &gif, "--swing", "4"], "--deform"),
        (2, &["-o", &gif, "--turntable", "1"], "2"),
        (1, &["-o", &gif, "--over-time"], "no time steps"),
    ];
    for (code, options, word) in refused {
        bad(code, &[&["render", &mt], options].concat(), &[word]);
    }
    bad(2, &["render", &mt, "-o", &gif, "--over-time", "--time", "1"], &["cannot be used with"]);
}

#[test]
fn movies_go_over_time_and_through_a_period() {
    let (folder, mt) = two_steps("movies");
    let [movie, out] = ["a.apng", "a.png"].map(|name| folder.path(name));
    let small = ["--size", "120x90", "--samples", "2", "--field", "p", "--mode", "boundary", "--json"];
    let drawn = |out: &str, more: &[&str]| json(&[&["render", &mt, "-o", out], &small[..], more].concat());
    let alone = |more: &[&str]| {
        drawn(&out, more);
        Picture::read(&out).bytes
    };
    // Without an error all have the reference mesh.
    let report = drawn(&movie, &["--over-time"]);
    assert_eq!((&report["times"], report.get("time")), (&serde_json::json!([-1.0, 3.5]), None));
    assert_eq!((&report["fps"], &report["pictures"]), (&5.0.into(), &2.into()));
    let pictures = apng_pictures(&movie);
    assert!(pictures == ["-1", "3.5"].map(|time| alone(&["--time", time])));
    assert!(pictures[0] != pictures[1]);
    // With one they have one mesh that is as good at all times, so no smaller than that of either.
    let count = |report: &serde_json::Value| report["tetrahedra"].as_u64().expect("a count");
    let all = drawn(&movie, &["--over-time", "--error", "10%", "--need", "range=-1,0; error=1%"]);
    assert!(all["needs"].as_array().expect("needs").len() == 4 && all["satisfied"] == true, "{all}");
    for time in ["-1", "3.5"] {
        let one = drawn(&out, &["--time", time, "--error", "10%", "--need", "range=-1,0; error=1%"]);
        assert!(count(&one) <= count(&all), "{time}");
    }
    // A period, in which the camera stays where it is.
    let deform = ["--deform", "U", "--factor", "0.1", "--time", "3.5"];
    let report = drawn(&movie, &[&deform[..], &["--swing", "4"]].concat());
    assert_eq!((&report["time"], &report["deform_time"]), (&3.5.into(), &3.5.into()));
    let pictures = apng_pictures(&movie);
    let phases =
        ["0", "0.25", "0.5", "0.75"].map(|phase| alone(&[&deform[..], &["--phase", phase]].concat()));
    assert!(pictures == phases);
    assert!(phases[0] == phases[2] && phases[1] != phases[3]);
}

#[test]
fn a_transparent_picture_has_nothing_in_its_corners() {
    let (_folder, mt, out) = prepared("transparent", 9);
    let picture = draw(&mt, &out, &["--mode", "boundary", "--background", "transparent"]);
    assert_eq!(picture.channels, 4);
    let alpha = |x: usize, y: usize| picture.bytes[(y * 120 + x) * 4 + 3];
    assert_eq!([alpha(0, 0), alpha(119, 0), alpha(0, 89), alpha(119, 89)], [0; 4]);
    assert_eq!(alpha(60, 45), 255);
}

#[test]
fn a_scene_is_printed_and_read() {
    let (folder, mt, out) = prepared("scene", 9);
    let scene = folder.path("a.json");
    let options = ["--mode", "slice,cells", "--map", "magma", "--shrink", "0.5", "--clip", "x=0.5"];
    let printed = json(&[&["render", &mt, "--print-scene"], &options[..]].concat());
    assert_eq!(printed["colours"]["map"], "magma");
    assert_eq!(printed["slices"][0]["offset"], 0.5);
    assert_eq!(printed["clips"][0]["normal"][0], 1.0);
    fs::write(&scene, printed.to_string()).expect("a file");
    let again = json(&["render", &mt, "--print-scene", "--scene", &scene]);
    assert_eq!(again, printed);
    let other =
        json(&["render", &mt, "--print-scene", "--scene", &scene, "--shrink", "0.1", "--isovalue", "1"]);
    assert_eq!((&other["cells"]["shrink"], &other["isosurfaces"][0]["value"]), (&0.1.into(), &1.0.into()));
    assert_eq!(other["slices"], printed["slices"]);
    // The volume looks as what the mesh is refined for.
    let colours = folder.path("colours.json");
    let points = r#"{ "points": [[0, 0, 0, 1, 0], [1, 1, 0, 0, 0.5]], "unit_length": 0.2 }"#;
    fs::write(&colours, points).expect("a file");
    let volume = json(&["render", &mt, "--print-scene", "--mode", "volume", "--transfer", &colours]);
    assert_eq!(volume["volume"]["points"][1][4], 0.5);
    fs::write(&scene, "{ \"isosurface\": [] }").expect("a file");
    bad(1, &["render", &mt, "--print-scene", "--scene", &scene], &["a.json", "isosurface"]);
    fs::write(&scene, printed.to_string()).expect("a file");
    let [a, b] = [draw(&mt, &out, &options), draw(&mt, &out, &["--scene", &scene])];
    assert_eq!(a.differing(&b), 0);
}

/// The other parts are seen through the casing, which alone is drawn where they are hidden.
#[test]
fn a_translucent_region_shows_what_it_hides() {
    let folder = Folder::new("sheer");
    let [input, mt, out] = ["t.vtu", "t.mt", "t.png"].map(|name| folder.path(name));
    good(&["generate", "turbine", "--size", "5", "-o", &input]);
    good(&["build", &input, "--preserve", "part", "-o", &mt]);
    let casing = ["--region-opacity", "11=20%", "--region-opacity", "12=0.2"];
    let printed = json(&[&["render", &mt, "--print-scene"][..], &casing].concat());
    assert_eq!(printed["boundary"]["regionOpacities"], serde_json::json!({ "11": 0.2, "12": 0.2 }));
    let picture = |more: &[&str]| draw(&mt, &out, &[&["--colour-by", "region"], more].concat());
    let (plain, sheer, both) = (picture(&[]), picture(&casing), picture(&["--opacity", "20%"]));
    assert!(sheer.differing(&plain) > 0 && sheer.differing(&both) > 0);
    let hidden = ["--region", "11", "--region", "12"];
    let alone = picture(&[&hidden[..], &["--opacity", "20%"]].concat());
    assert_eq!(picture(&[&hidden[..], &casing].concat()).differing(&alone), 0);
    bad(1, &["render", &mt, "-o", &out, "--region-opacity", "stator=0.5"], &["no region stator", "1, 2, 3"]);
    for wrong in ["11", "11=2", "11=x"] {
        bad(2, &["render", &mt, "-o", &out, "--region-opacity", wrong], &["--region-opacity"]);
    }
    bad(
        2,
        &["render", &mt, "-o", &out, "--mode", "cells", "--region-opacity", "11=0.5"],
        &["add the mode boundary"],
    );
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let (_folder, mt, out) = prepared("refused", 5);
    let wrong: [(&[&str], &[&str]); 14] = [
        (&["--map", "jet"], &["--map", "must be a colour map", "viridis", "balance"]),
        (&["--mode", "cloud"], &["--mode", "volume", "points"]),
        (&["--mode", "cells,wire"], &["one of the modes"]),
        (&["--mode", "isosurface", "--shrink", "0.2"], &["--shrink", "add the mode cells"]),
        (&["--mode", "cells", "--opacity", "0.2"], &["--opacity", "isosurface, slice or boundary"]),
        (&["--mode", "cells", "--colour-by", "weight"], &["depth", "missing"]),
        (&["--mode", "volume", "--colour-field", "density"], &["--colour-field", "isosurface or slice"]),
        (&["--size", "100"], &["--size", "1280x960"]),
        (&["--samples", "0"], &["--samples", "1..=1024"]),
        (&["--from", "x"], &["--from", "+x", "home"]),
        (&["--zoom", "0"], &["larger than 0"]),
        (&["--opacities", "1,0.5,0.5,0"], &["must ascend"]),
        (&["--colour-range", "2,1"], &["smaller value of a range"]),
        (&["--slice", "0,0,0,1"], &["normal of a plane"]),
    ];
    for (options, words) in wrong {
        bad(2, &[&["render", &mt, "-o", &out], options].concat(), words);
    }
    bad(2, &["render", &mt], &["--output"]);
    bad(2, &["render", &mt, "-o", "a.jpg"], &[".png"]);
    bad(1, &["extract", &mt, "-o", &out], &["`tetralod render` writes .png"]);
    let mut without = crate::support::command(&["render", &mt, "-o", &out]);
    let without =
        without.env("VK_DRIVER_FILES", "none").env("VK_ICD_FILENAMES", "none").output().expect("it starts");
    let error = text(&without.stderr);
    assert!(without.status.code() == Some(1) && error.contains("mesa-vulkan-drivers"), "{error}");
    bad(1, &["render", &mt, "-o", &out, "--size", "999999x9"], &["--size", "at most"]);
    let planes = ["--clip", "x=1"].repeat(17);
    let planes: Vec<&str> = [&["render", &mt, "-o", &out], &planes[..]].concat();
    bad(1, &planes, &["at most 16"]);
    bad(1, &["render", &mt, "-o", &out, "--log", "--colour-range=-1,1", "--mode", "slice"], &["logarithmic"]);
    let warned = run(&["render", &mt, "-o", &out, "--isovalue", "9", "--size", "9x9", "--samples", "1"]);
    assert!(text(&warned.stderr).contains("warning: isovalue 9: density has only values from"));
}
