//! How much of a file the first useful picture needs.

use super::Result;
use super::mt_file::mt_file;
use super::sets::Set;
use super::surfaces::{Interpolant, Mesh, Surface};
use super::table::percent_of;
use std::io::Cursor;
use tetralod::format::DecodeOptions;
use tetralod::geom::Bounds;
use tetralod::mt::MtKind;
use tetralod::refine::{Need, RefineStats, Request};
use tetralod::session::{Client, Session};
use tetralod::stream::FileSource;
use tetralod_build::Purpose;

/// Fewest tetrahedra of a set whose first picture is measured.
const LARGE: usize = 150_000;
/// First pictures of sets of more tetrahedra are not measured.
const HUGE: usize = 6_000_000;

/// Shares of the file, in percent, after which a prefix is looked at.
const LADDER: [f64; 12] = [1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 75.0, 100.0];

type Reader = Client<FileSource<Cursor<Vec<u8>>>>;

pub fn run(sets: &[Set]) -> Result<()> {
    println!(
        "| set | file KB | prefix: guaranteed % | prefix: measured % | error % | Hausdorff % | ranges: guaranteed % | error % | Hausdorff % |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    for set in sets.iter().filter(|set| (LARGE..=HUGE).contains(&set.mesh.tets.len())) {
        eprintln!("{}", set.name);
        let file = mt_file(&set.mesh, MtKind::HalfEdge, Purpose::default())?;
        println!("{}", picture(set, &file)?);
    }
    Ok(())
}

fn open(file: &[u8]) -> Result<Reader> {
    Ok(Client::open(FileSource::new(Cursor::new(file.to_vec()))?, DecodeOptions::default(), u64::MAX)?)
}

/// The isosurface at the middle value, and what it is held against.
struct Reference {
    mesh: Mesh,
    surface: Surface,
    iso: f64,
    range: f64,
    diagonal: f64,
}

/// Percent of the range of the field, and of the diagonal.
#[derive(Clone, Copy)]
struct Accuracy {
    field: f64,
    distance: f64,
}

impl Reference {
    fn of(session: &Session, diagonal: f64) -> Result<Self> {
        let (info, mesh) = (session.info().ok_or("no MT")?, session.mesh().ok_or("no mesh")?);
        let mesh = Mesh::of(info, mesh);
        let field = &info.fields[0];
        let iso = 0.5 * (field.min + field.max);
        Ok(Self { surface: Surface::of(&mesh, iso), mesh, iso, range: field.range(), diagonal })
    }

    /// The distance of both surfaces from each other, and the error of the field: by how much it is on the wrong side of the
    /// isovalue at the ends of an edge that the reference surface crosses.
    fn compare(&self, session: &Session) -> Result<Accuracy> {
        let (info, mesh) = (session.info().ok_or("no MT")?, session.mesh().ok_or("no mesh")?);
        let mesh = Mesh::of(info, mesh);
        let surface = Surface::of(&mesh, self.iso);
        let values = Interpolant::new(&mesh);
        let mut field = 0.0_f64;
        for edge in &self.surface.edges {
            let [low, high] = edge.map(|v| values.at(self.mesh.positions[v as usize]));
            let above = low.map_or(0.0, |low| low - self.iso);
            field = field.max(above).max(high.map_or(0.0, |high| self.iso - high));
        }
        let distance = surface.distance_to(&self.surface).max(self.surface.distance_to(&surface));
        Ok(Accuracy { field: 100.0 * field / self.range, distance: 100.0 * distance / self.diagonal })
    }
}

fn picture(set: &Set, file: &[u8]) -> Result<String> {
    let mut whole = Session::new();
    whole.feed(file)?;
    whole.refine(&Request::within(0.0))?;
    let reference = Reference::of(&whole, Bounds::of(&set.mesh.positions).diagonal())?;
    let request: Request = Need::within(0.01).around(0, &[reference.iso]).into();
    let least = whole.refine(&request)?;
    let mut client = open(file)?;
    let stats = client.refine(&request)?;
    assert!(stats.satisfied && client.session().hash() == whole.hash(), "the same mesh by ranges");
    let ranges = percent_of(client.session().fetched(), file);
    let exact = reference.compare(client.session())?;
    let (guaranteed, measured) = in_order(file, &request, &reference, &least)?;
    let measured = measured.map_or("– | – | –".to_owned(), |(share, found)| {
        format!("{share:.0} | {:.2} | {:.2}", found.field, found.distance)
    });
    Ok(format!(
        "| {}, half-edge | {} | {guaranteed:.1} | {measured} | {ranges:.1} | {:.2} | {:.2} |",
        set.name,
        file.len() / 1000,
        exact.field,
        exact.distance
    ))
}

/// How much of the file has to be read in its order until the mesh is that of the request, and until both distances are
/// measured to be within 1 %, at the steps of the ladder.
fn in_order(
    file: &[u8],
    request: &Request,
    reference: &Reference,
    least: &RefineStats,
) -> Result<(f64, Option<(f64, Accuracy)>)> {
    let mut session = Session::new();
    let mut measured = None;
    let mut guaranteed = None;
    // In steps of a quarter of a percent.
    let step = file.len() / 400 + 1;
    for (at, piece) in file.chunks(step).enumerate() {
        session.feed(piece)?;
        let share = percent_of((at * step + piece.len()) as u64, file);
        if session.mesh().is_none() {
            continue;
        }
        let stats = session.refine(request)?;
        if guaranteed.is_none() && stats.applied == least.applied {
            guaranteed = Some(share);
        }
        let before = percent_of((at * step) as u64, file);
        if measured.is_none() && LADDER.iter().any(|&rung| before < rung && share >= rung - 1e-9) {
            let found = reference.compare(&session)?;
            if found.field <= 1.0 && found.distance <= 1.0 {
                measured = Some((share, found));
            }
        }
        if let (Some(guaranteed), Some(_)) = (guaranteed, measured) {
            return Ok((guaranteed, measured));
        }
    }
    Ok((guaranteed.ok_or("the whole file does not give the mesh of the request")?, measured))
}
