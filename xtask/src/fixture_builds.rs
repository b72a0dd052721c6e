//! Small files of each input format, and what the native program builds of them with various options: building in wasm must give
//! the same bytes.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use anyhow::Result;
use serde_json::{Value, json};

use crate::shell;

/// Points of the grid along x, y and z.
const DIMS: [usize; 3] = [6, 5, 4];

/// Inputs in the folder of the fixture, options of the command, and the same options of the package.
fn builds() -> Vec<(&'static [&'static str], &'static [&'static str], Value)> {
    vec![
        (&["small.vti"], &[], json!({})),
        (
            &["small.vti"],
            &["--kind", "edge", "--displacement", "10%"],
            json!({ "kind": "edge", "displacement": "10%" }),
        ),
        (&["small.vti"], &["--kind", "vertex"], json!({ "kind": "vertex" })),
        (&["small.vti"], &["--for", "regions"], json!({ "purpose": "regions" })),
        (
            &["fields.vtu"],
            &["--all-fields", "--unit", "pressure=Pa", "--meta", "about=a test", "--block-updates", "64"],
            json!({ "allFields": true, "units": { "pressure": "Pa" }, "metadata": { "about": "a test" }, "blockUpdates": 64 }),
        ),
        (
            &["fields.vtu"],
            &["--field", "speed", "--field-bits", "speed=9", "--position-bits", "18"],
            json!({ "fields": ["speed"], "fieldBits": { "speed": 9 }, "positionBits": 18 }),
        ),
        (
            &["fields.vtu", "fields.vtu"],
            &["--field", "pressure", "--field-tolerance", "1%", "--lossless"],
            json!({ "fields": ["pressure"], "fieldTolerance": "1%", "lossless": true }),
        ),
        (&["grid.raw"], &[], json!({})),
        (&["grid.vtk"], &["--displacement-edges", "5"], json!({ "displacementEdges": 5 })),
        (
            &["grid.vtk"],
            &["--method", "insert", "--tet-errors"],
            json!({ "method": "insert", "tetErrors": true }),
        ),
        (&["tets.vtk"], &["--field", "v"], json!({ "fields": ["v"] })),
        (
            &["tets.vtk"],
            &["--cell-to-point", "--field", "material"],
            json!({ "cellToPoint": true, "fields": ["material"] }),
        ),
        (&["small.vti"], &["--repair", "none"], json!({ "repair": "none" })),
        (
            &["blocks.vtk"],
            &["--repair", "weld", "--weld-distance", "0.25"],
            json!({ "repair": "weld", "weldDistance": 0.25 }),
        ),
    ]
}

/// Makes the files, `built-N.mt`, and `builds.json`, a list of `{ inputs, options, mt }`.
pub fn make(tetralod: &Path, folder: &Path) -> Result<()> {
    make_inputs(folder)?;
    let mut list = Vec::new();
    for (number, (inputs, arguments, options)) in builds().into_iter().enumerate() {
        let mt = format!("built-{number}.mt");
        let mut command = shell::command(tetralod, ["build", "--quiet"]);
        command.args(arguments).arg("-o").arg(folder.join(&mt));
        shell::run(command.args(inputs.iter().map(|name| folder.join(name))))?;
        list.push(json!({ "inputs": inputs, "options": options, "mt": mt }));
    }
    Ok(fs::write(folder.join("builds.json"), serde_json::to_string_pretty(&list)?)?)
}

fn make_inputs(folder: &Path) -> Result<()> {
    let [nx, ny, nz] = DIMS;
    let points = nx * ny * nz;
    // Any numbers of one byte that are not linear.
    let samples: Vec<u8> = (0..points).map(|i| (i * i * 7 % 251) as u8).collect();
    let words = |numbers: &mut dyn Iterator<Item = String>| numbers.collect::<Vec<_>>().join(" ");
    let values = words(&mut samples.iter().map(u8::to_string));
    fs::write(folder.join("grid.raw"), &samples)?;
    let sidecar =
        json!({ "dims": DIMS, "type": "uint8", "spacing": [1, 1, 2], "field": "density", "unit": "kg" });
    fs::write(folder.join("grid.json"), sidecar.to_string())?;
    let grid = format!(
        "# vtk DataFile Version 3.0\ngrid\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS {nx} {ny} {nz}\nORIGIN 0 0 0\n\
         SPACING 1 1 2\nPOINT_DATA {points}\nSCALARS density unsigned_char 1\nLOOKUP_TABLE default\n{values}\n"
    );
    fs::write(folder.join("grid.vtk"), grid)?;
    let position = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
    let coordinates = words(&mut (0..points).map(position).map(|[x, y, z]| format!("{x} {y} {z}")));
    let vectors = words(&mut (0..points).map(position).map(|[x, y, z]| format!("{} {} {}", y * z, x * x, z)));
    let cells = cells();
    let mut tets = format!(
        "# vtk DataFile Version 3.0\ntets\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {points} float\n{coordinates}\n\
         CELLS {} {}\n",
        cells.len(),
        5 * cells.len()
    );
    cells.iter().try_for_each(|[a, b, c, d]| writeln!(tets, "4 {a} {b} {c} {d}"))?;
    writeln!(tets, "CELL_TYPES {}\n{}", cells.len(), words(&mut cells.iter().map(|_| "10".to_owned())))?;
    let material = words(&mut (0..cells.len()).map(|i| (i % 5).to_string()));
    writeln!(tets, "CELL_DATA {}\nSCALARS material int 1\nLOOKUP_TABLE default\n{material}", cells.len())?;
    writeln!(tets, "POINT_DATA {points}\nVECTORS v float\n{vectors}")?;
    fs::write(folder.join("tets.vtk"), tets)?;
    make_blocks(folder)
}

/// Two cubes that touch, each with points of its own, which are a quarter apart.
fn make_blocks(folder: &Path) -> Result<()> {
    let mut points = String::new();
    for x in [0.0, 1.0, 1.25, 2.25] {
        [[0, 0], [1, 0], [0, 1], [1, 1]].iter().try_for_each(|[y, z]| writeln!(points, "{x} {y} {z}"))?;
    }
    // Points are numbered along y, z and x; the second half of the ways is turned.
    let ways = [[1, 3, 7], [2, 6, 7], [4, 5, 7], [1, 7, 5], [2, 7, 3], [4, 7, 6]];
    let mut cells = String::new();
    for first in [0, 8] {
        ways.iter().try_for_each(|[b, c, d]| {
            writeln!(cells, "4 {first} {} {} {}", first + b, first + c, first + d)
        })?;
    }
    let types = ["10"; 12].join(" ");
    let values = (0..16).map(|i| (i * i).to_string()).collect::<Vec<_>>().join(" ");
    let blocks = format!(
        "# vtk DataFile Version 3.0\nblocks\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 16 float\n{points}CELLS 12 60\n{cells}\
         CELL_TYPES 12\n{types}\nPOINT_DATA 16\nSCALARS p float 1\nLOOKUP_TABLE default\n{values}\n"
    );
    Ok(fs::write(folder.join("blocks.vtk"), blocks)?)
}

/// Six tetrahedra around the diagonal of each cube of the grid.
fn cells() -> Vec<[usize; 4]> {
    let [nx, ny, nz] = DIMS;
    let steps = [1, nx, nx * ny];
    let ways = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];
    let mut cells = Vec::new();
    for first in
        (0..nx * ny * nz).filter(|i| i % nx + 1 < nx && i / nx % ny + 1 < ny && i / (nx * ny) + 1 < nz)
    {
        for [i, j, k] in ways {
            let b = first + steps[i];
            cells.push([first, b, b + steps[j], b + steps[j] + steps[k]]);
        }
    }
    cells
}
