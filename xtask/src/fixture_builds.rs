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
        (&["grid.nhdr"], &[], json!({})),
        (&["grid.mhd"], &[], json!({})),
        (&["tets.msh"], &["--all-fields"], json!({ "allFields": true })),
        (&["tets.node"], &[], json!({})),
        (&["tets.mesh"], &[], json!({})),
        (
            &["tets.vol"],
            &["--cell-to-point", "--field", "material"],
            json!({ "cellToPoint": true, "fields": ["material"] }),
        ),
        (&["tets.pvtu"], &[], json!({})),
        (&["tets.pvd"], &["--field", "v"], json!({ "fields": ["v"] })),
        (&["steps.vtkhdf"], &["--all-fields"], json!({ "allFields": true })),
        (&["image.vtkhdf"], &[], json!({})),
        (&["netcdf4.exo"], &["--all-fields"], json!({ "allFields": true })),
    ]
}

/// The files beside an input that it needs, which the command finds by itself.
fn beside(input: &str) -> &'static [&'static str] {
    match input {
        "grid.raw" => &["grid.json"],
        "grid.nhdr" | "grid.mhd" => &["grid.raw"],
        "tets.node" => &["tets.ele"],
        "tets.mesh" => &["tets.sol"],
        "tets.pvtu" => &["tets/0.vtu", "tets/1.vtu"],
        "tets.pvd" => &["tets.vtk", "tets/again.vtk"],
        _ => &[],
    }
}

/// Makes the files, `built-N.mt`, and `builds.json`, a list of `{ inputs, files, options, mt }`, where files are the inputs and what they need.
pub fn make(tetralod: &Path, folder: &Path) -> Result<()> {
    make_inputs(folder)?;
    let mut list = Vec::new();
    for (number, (inputs, arguments, options)) in builds().into_iter().enumerate() {
        let mt = format!("built-{number}.mt");
        let mut command = shell::command(tetralod, ["build", "--quiet"]);
        command.args(arguments).arg("-o").arg(folder.join(&mt));
        shell::run(command.args(inputs.iter().map(|name| folder.join(name))))?;
        let files: Vec<_> = inputs.iter().flat_map(|input| [&[*input], beside(input)].concat()).collect();
        list.push(json!({ "inputs": inputs, "files": files, "options": options, "mt": mt }));
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
    make_headers(folder)?;
    let position = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
    let places: Vec<_> = (0..points).map(position).map(|[x, y, z]| format!("{x} {y} {z}")).collect();
    let coordinates = places.join(" ");
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
    fs::write(folder.join("tets.vtk"), &tets)?;
    make_tets(folder, &places, &samples)?;
    fs::write(folder.join("tets/again.vtk"), tets)?;
    let entries =
        "<DataSet timestep=\"0.5\" file=\"tets/again.vtk\"/><DataSet timestep=\"0\" file=\"tets.vtk\"/>";
    let list = format!("<VTKFile type=\"Collection\"><Collection>{entries}</Collection></VTKFile>");
    fs::write(folder.join("tets.pvd"), list)?;
    for name in ["steps.vtkhdf", "image.vtkhdf", "netcdf4.exo"] {
        fs::copy(Path::new("crates/io/tests/data").join(name), folder.join(name))?;
    }
    make_blocks(folder)
}

/// Headers of images whose samples are those of `grid.raw`.
fn make_headers(folder: &Path) -> Result<()> {
    let sizes = DIMS.map(|size| size.to_string()).join(" ");
    let nrrd = format!(
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: {sizes}\nspacings: 1 1 2\ncenterings: node node node\nencoding: raw\n\
         data file: grid.raw\n\n"
    );
    fs::write(folder.join("grid.nhdr"), nrrd)?;
    let meta = format!(
        "NDims = 3\nDimSize = {sizes}\nElementType = MET_UCHAR\nElementSpacing = 1 1 2\nElementDataFile = grid.raw\n"
    );
    Ok(fs::write(folder.join("grid.mhd"), meta)?)
}

/// The tetrahedra of the grid, with a value at each of these points, in the formats of meshers and in pieces.
fn make_tets(folder: &Path, points: &[String], values: &[u8]) -> Result<()> {
    let cells = cells();
    let words = |cell: &[usize; 4], first: usize| cell.map(|point| (point + first).to_string()).join(" ");
    let lines =
        |count: usize, line: &dyn Fn(usize) -> String| (0..count).map(|i| line(i) + "\n").collect::<String>();
    let (n, m) = (points.len(), cells.len());
    let gmsh = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{n}\n{}$EndNodes\n$Elements\n{m}\n{}$EndElements\n\
         $NodeData\n1\n\"p\"\n1\n0\n3\n0\n1\n{n}\n{}$EndNodeData\n",
        lines(n, &|i| format!("{} {}", i + 1, points[i])),
        lines(m, &|i| format!("{} 4 2 1 {} {}", i + 1, 1 + i % 2, words(&cells[i], 1))),
        lines(n, &|i| format!("{} {}", i + 1, values[i])),
    );
    fs::write(folder.join("tets.msh"), gmsh)?;
    let nodes = format!("{n} 3 1 0\n{}", lines(n, &|i| format!("{i} {} {}", points[i], values[i])));
    fs::write(folder.join("tets.node"), nodes)?;
    fs::write(
        folder.join("tets.ele"),
        format!("{m} 4 0\n{}", lines(m, &|i| format!("{i} {}", words(&cells[i], 0)))),
    )?;
    let medit = format!(
        "MeshVersionFormatted 2\nDimension 3\nVertices {n}\n{}Tetrahedra {m}\n{}End\n",
        lines(n, &|i| format!("{} 0", points[i])),
        lines(m, &|i| format!("{} 0", words(&cells[i], 1))),
    );
    fs::write(folder.join("tets.mesh"), medit)?;
    let solution = format!(
        "MeshVersionFormatted 2\nDimension 3\nSolAtVertices {n}\n1 1\n{}End\n",
        lines(n, &|i| values[i].to_string())
    );
    fs::write(folder.join("tets.sol"), solution)?;
    let netgen = format!(
        "mesh3d\ndimension\n3\nvolumeelements\n{m}\n{}points\n{n}\n{}endmesh\n",
        lines(m, &|i| format!("{} 4 {}", 1 + i % 2, words(&cells[i], 1))),
        lines(n, &|i| points[i].clone()),
    );
    fs::write(folder.join("tets.vol"), netgen)?;
    make_pieces(folder, points, values, &cells)
}

/// These tetrahedra in two files, and the list of them.
fn make_pieces(folder: &Path, points: &[String], values: &[u8], cells: &[[usize; 4]]) -> Result<()> {
    fs::create_dir_all(folder.join("tets"))?;
    let mut sources = String::new();
    for (number, part) in cells.chunks(cells.len() / 2).enumerate() {
        let array = |kind: &str, name: &str, components: usize, numbers: &mut dyn Iterator<Item = String>| {
            let numbers = numbers.collect::<Vec<_>>().join(" ");
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">{numbers}</DataArray>"
            )
        };
        let file = format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\"><PointData>{}</PointData>\
             <Points>{}</Points><Cells>{}{}{}</Cells></Piece></UnstructuredGrid></VTKFile>",
            points.len(),
            part.len(),
            array("UInt8", "p", 1, &mut values.iter().map(u8::to_string)),
            array("Float64", "Points", 3, &mut points.iter().cloned()),
            array("Int64", "connectivity", 1, &mut part.as_flattened().iter().map(usize::to_string)),
            array("Int64", "offsets", 1, &mut (1..=part.len()).map(|i| (4 * i).to_string())),
            array("UInt8", "types", 1, &mut part.iter().map(|_| "10".to_owned())),
        );
        let name = format!("tets/{number}.vtu");
        fs::write(folder.join(&name), file)?;
        write!(sources, "<Piece Source=\"{name}\"/>")?;
    }
    let list = format!(
        "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid>{sources}</PUnstructuredGrid></VTKFile>"
    );
    Ok(fs::write(folder.join("tets.pvtu"), list)?)
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
