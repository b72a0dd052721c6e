//! Promise: `generate` makes every volume that it lists, grids without holding them, time steps as a list that `build` takes.

use crate::support::{Folder, bad, command, good, json, number};
use std::fs;
use std::path::Path;
use tetralod_io::generate::VOLUMES;
use tetralod_io::{read, steps};

#[test]
fn every_volume_that_is_listed_is_built() {
    let folder = Folder::new("volumes");
    let help = good(&["generate", "--help"]);
    for (name, sentence) in VOLUMES {
        assert!(help.contains(name) && help.contains(&sentence[..20]), "{help}");
        let ending = if ["sphere-flow", "turbine"].contains(&name) { "vtu" } else { "vti" };
        let [input, mt] = [format!("{name}.{ending}"), format!("{name}.mt")].map(|name| folder.path(&name));
        good(&["generate", name, "--size", "7", "-o", &input]);
        let built = json(&["build", &input, "--all-fields", "-o", &mt, "--json"]);
        assert!(number(&built, "tetrahedra") >= 6.0 * 216.0, "{name}");
        // A grid is the same as tetrahedra.
        let mesh = folder.path("mesh.vtu");
        good(&["generate", name, "--size", "7", "-o", &mesh]);
        let [whole, mut grid] = [&mesh, &input].map(|file| read(Path::new(file)).expect("a file of VTK"));
        grid.grid = None;
        assert_eq!(whole, grid, "{name}");
    }
}

#[test]
fn time_steps_are_files_beside_their_list() {
    let folder = Folder::new("series");
    let [list, mt] = ["flow.pvd", "flow.mt"].map(|name| folder.path(name));
    good(&["generate", "abc-flow", "--size", "5", "--steps", "3", "-o", &list]);
    assert_eq!(folder.names(), ["flow-0.vti", "flow-1.vti", "flow-2.vti", "flow.pvd"]);
    let times: Vec<_> = steps(Path::new(&list)).expect("a list").into_iter().map(|step| step.time).collect();
    assert_eq!(times, [Some(0.0), Some(1.0), Some(2.0)]);
    good(&["build", &list, "--field", "velocity", "-o", &mt, "--quiet"]);
    let info = json(&["info", &mt, "--json"]);
    assert_eq!(info["fields"].as_array().map(Vec::len), Some(9), "three components in three steps");
    let [first, second] = [0, 1].map(|i| fs::read(folder.path(&format!("flow-{i}.vti"))).expect("a step"));
    assert_ne!(first, second);
}

#[cfg(unix)]
#[test]
fn a_pipe_gets_the_same_bytes() {
    let folder = Folder::new("generate-pipe");
    let file = folder.path("h.vti");
    let arguments = ["generate", "hydrogen", "--orbital", "3,1,-1", "--size", "9", "-o"];
    good(&[&arguments[..], &[&file]].concat());
    let link = folder.path("pipe.vti");
    std::os::unix::fs::symlink("/dev/stdout", &link).expect("a link");
    let output = command(&[&arguments[..], &[&link]].concat()).output().expect("the command starts");
    assert!(output.status.success());
    assert_eq!(output.stdout, fs::read(&file).expect("the file"));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = Folder::new("generate-refused");
    let [vti, pvd] = ["a.vti", "a.pvd"].map(|name| folder.path(name));
    bad(2, &["generate", "bucky", "--orbital", "1,0,0", "--size", "5", "-o", &vti], &["hydrogen"]);
    bad(2, &["generate", "abc-flow", "--steps", "3", "--size", "5", "-o", &vti], &["pvd"]);
    bad(1, &["generate", "bucky", "--size", "5", "-o", &pvd], &["abc-flow", ".vti"]);
    for orbital in ["2,2,0", "1,0", "0,0,0", "-1,0,0", "a,b,c"] {
        let option = format!("--orbital={orbital}");
        bad(2, &["generate", "hydrogen", &option, "--size", "5", "-o", &vti], &["--orbital"]);
    }
    bad(1, &["generate", "bucky", "--size", "5000", "-o", &vti], &["4096"]);
    bad(1, &["generate", "bucky", "--size", "2000", "-o", &folder.path("a.vtu")], &["8000000000", ".vti"]);
    assert!(folder.names().is_empty());
}
