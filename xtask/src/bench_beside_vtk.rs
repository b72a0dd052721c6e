//! `cargo xtask bench --beside-vtk`: the same volumes in a browser, with tetralod and with VTK's programs from npm; writes
//! `docs/beside-vtk.md`.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

use crate::{browser, package, shell};

const PAGE: &str = "docs/beside-vtk.md";
const SOURCES: &str = "benches/beside_vtk";
const DATA: &str = "target/beside-vtk";

const HEAD: &str = "\
# Beside VTK in a browser

Written by `cargo xtask bench --beside-vtk`, which installs the other programs from npm, generates the volumes and drives headless
Chromium (`benches/beside_vtk`). Each number is the median of three visits with a new browser.

- **vtk.js** (`@kitware/vtk.js` 37.4.3, bundled by esbuild) reads the grid and extracts the isosurface in JavaScript. It has no tetrahedra.
- **F3D** (`f3d` 3.5.0) is VTK, compiled to WebAssembly, with readers for many formats. It reads the tetrahedra and draws their
  boundary.
- **VTK.wasm** (`@kitware/vtk-wasm` 3.0.5) is VTK in WebAssembly with all classes that can be reached from JavaScript. Its package has
  no WebAssembly; that comes from `@pyvista-wasm/vtk-wasm-binary` 9.6.20260228, a copy of what its developers publish. The page
  decodes the grid, since the module has no readers, and extracts the isosurface by `vtkFlyingEdges3D`. It has no filter or mapper that
  makes a boundary of tetrahedra (`vtkGeometryFilter`, `vtkDataSetSurfaceFilter` and `vtkDataSetMapper` cannot be made), so that the
  second table is without it.
- **tetralod** draws a mesh within 1 % of the field's range: for the isosurface only around its value. The others draw the
  full data. It draws with WebGPU, and in the last column, as in browsers without that, with WebGL 2: without shade in hollows.

*program*: JavaScript and WebAssembly, compressed by gzip. *file*: the whole volume, as `tetralod generate` writes it (`.vti` and
`.vtu` are compressed by zlib) or as an MT file. *fetched*: what was read of it. *first picture*: the time from the start of
the navigation to the first picture; for tetralod it shows the base mesh, in which little can be recognised. *within 5 %*: to a picture of a
mesh within 5 % of the field's range. *full picture*: to the picture that does not change any more.
The rows with 20 Mbit/s have a server that sends no faster, and answers after 40 ms. *memory*: of all processes of the browser with the
full picture, less than those of an empty page. *frame*: from one picture to the next while the camera turns, 640 × 480 pixels,
drawn in software, since the machine has no GPU. Where pictures take longer than 60 ms,
tetralod draws those of a movement without shade in hollows and with one sample a pixel, then with fewer pixels, which the next row has. *with
everything*: with shade and four samples a pixel, as at rest.

";

/// The volumes: name, data set and size, and the format for the others.
const VOLUMES: [(&str, &str, &str, &str); 2] =
    [("bucky", "bucky", "65", "vti"), ("flow", "sphere-flow", "32", "vtu")];

/// Measures and writes the page.
pub fn run(args: &[String]) -> Result<()> {
    if let Some(arg) = args.first() {
        bail!("`bench --beside-vtk` takes no argument, got `{arg}`");
    }
    package::ensure_built(package::Profile::Released)?;
    shell::install_node_packages(Path::new(SOURCES))?;
    make_data(&shell::released_command()?)?;
    let mut command = shell::command("node", [format!("{SOURCES}/run.js")]);
    let tables = shell::output(command.env("CHROMIUM", browser::require()?.chromium))?;
    fs::write(PAGE, [HEAD, &tables].concat()).with_context(|| PAGE.to_owned())?;
    println!("wrote {PAGE}");
    Ok(())
}

fn make_data(tetralod: &Path) -> Result<()> {
    fs::create_dir_all(DATA)?;
    for (name, set, size, extension) in VOLUMES {
        let (input, mt) = (format!("{DATA}/{name}.{extension}"), format!("{DATA}/{name}.mt"));
        shell::run(&mut shell::command(tetralod, ["generate", set, "--size", size, "-o", &input]))?;
        shell::run(&mut shell::command(tetralod, ["build", &input, "-o", &mt]))?;
    }
    Ok(())
}
