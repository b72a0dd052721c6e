//! Times isosurfaces of the finest mesh of an MT file: `contour FILE.mt RUNS FRACTION...`, where a fraction of the
//! field's range says which isovalue. Prints, for each, the number of tetrahedra, the isovalue, triangles, vertices,
//! and the seconds of each run for
//!
//! - `extract`: out of slices of which nothing is known, as VTK does it;
//! - `smooth`: the same with normals out of the triangles, as those of VTK are;
//! - `sweep`: in a session, the isovalue having moved by 0.5 % of the range since the last time.

use std::error::Error;
use std::time::Instant;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod::view::IsoSurface;
use tetralod::view::NormalKind;

fn main() -> Result<(), Box<dyn Error>> {
    // The first argument is the program itself.
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, runs, fractions @ ..] = arguments.as_slice() else {
        return Err("contour FILE.mt RUNS FRACTION...".into());
    };
    let runs: usize = runs.parse()?;
    let mut session = Session::new();
    session.feed(&std::fs::read(file)?)?;
    session.refine(&Request::default())?;
    let field = &session.info().ok_or("no base mesh")?.fields[0];
    let (min, range) = (field.min, field.range());
    for fraction in fractions {
        let fraction: f64 = fraction.parse()?;
        let value = min + fraction * range;
        let mut surface = IsoSurface::new();
        let mut extract = Vec::new();
        let mesh = session.view();
        for _ in 0..runs {
            let start = Instant::now();
            surface.extract(&mesh, value);
            extract.push(start.elapsed().as_secs_f64());
        }
        surface.set_normal_kind(NormalKind::Smooth);
        let mut smooth = Vec::new();
        for _ in 0..runs {
            let start = Instant::now();
            surface.extract(&mesh, value);
            smooth.push(start.elapsed().as_secs_f64());
        }
        let tets = mesh.tets.len();
        let mut sweep = Vec::new();
        for run in 0..runs + WARM {
            let moved = value + (run as f64 - (WARM + runs / 2) as f64) * 0.005 * range;
            let start = Instant::now();
            session.isosurface(moved)?;
            sweep.push(start.elapsed().as_secs_f64());
        }
        println!(
            "{tets} {value} {} {} extract {} smooth {} sweep {}",
            surface.indices.len(),
            surface.positions.len(),
            join(&extract),
            join(&smooth),
            join(&sweep[WARM..])
        );
    }
    Ok(())
}

/// Runs of a sweep that are not counted: a session gets to know its mesh in the first ones.
const WARM: usize = 3;

fn join(times: &[f64]) -> String {
    times.iter().map(|time| format!("{time:.7}")).collect::<Vec<_>>().join(",")
}
