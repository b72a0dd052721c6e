//! How far meshes are from the one that they stand for, and how good their cells are: a plain measurement that knows nothing of MTs,
//! so that meshes of other programs are measured by the same means. Prints JSON; `cargo xtask bench --against-vtk` makes tables of it.

mod cells;
mod deviation;

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use tetralod::mesh::TetMesh;
use tetralod_io::write_vtu;

/// Whatever goes wrong: this is a tool, it says so and ends.
pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    // The first argument is the program itself; Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["tetrahedra", input, output] => write_tetrahedra(input.as_ref(), output.as_ref()),
        ["compare", reference, meshes @ ..] => compare(reference.as_ref(), meshes),
        // `cargo test --all-targets` runs it without any.
        [] => Ok(()),
        other => Err(format!("no such measurement: {other:?}").into()),
    }
}

/// Writes a mesh or grid as tetrahedra with its first field, for programs that read nothing else, and prints the field's name.
fn write_tetrahedra(input: &Path, output: &Path) -> Result<()> {
    let mut mesh = read(input)?;
    mesh.fields.truncate(1);
    write_vtu(&mesh, &mut BufWriter::new(File::create(output)?))?;
    println!("{}", mesh.fields[0].name);
    Ok(())
}

/// Prints what is to be said of the reference and of each mesh, a line of JSON for each.
fn compare(reference: &Path, meshes: &[&str]) -> Result<()> {
    let reference = read(reference)?;
    println!("{{{}}}", cells::report(&reference));
    for path in meshes {
        let mesh = read(path.as_ref())?;
        let deviation = deviation::report(&reference, &mesh)?;
        println!("{{{}, {deviation}}}", cells::report(&mesh));
    }
    Ok(())
}

fn read(path: &Path) -> Result<TetMesh> {
    let mesh = tetralod_io::read(path)?;
    match mesh.fields.is_empty() || mesh.tets.is_empty() {
        true => Err(format!("{}: there is no field, or there are no tetrahedra", path.display()).into()),
        false => Ok(mesh),
    }
}
