//! Promise: exact values come out as they went in, also where only parts of a file are read, and through conversions.

use crate::support::meshes::{cube, hilly};
use std::io::Cursor;
use std::ops::ControlFlow;
use tetralod::builder::{BuildConfig, BuildResult, build};
use tetralod::client::{Client, ClientError, ClientOptions};
use tetralod::format::{EncodeOptions, FormatError, encode};
use tetralod::mesh::TetMesh;
use tetralod::mt::{MtKind, VertexId};
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod::stream::FileSource;

/// A file of an edge-based MT with exact values, in small blocks, and the MT's vertex for each point.
fn file(mesh: &TetMesh) -> (Vec<u8>, Vec<VertexId>) {
    let config = BuildConfig { all_lossless: true, block_bits: 4, ..BuildConfig::of(MtKind::Edge) };
    let built = build(mesh, &config, &mut |_| ControlFlow::Continue(())).expect("a mesh to build on");
    let BuildResult { mt, vertices, exact, .. } = built;
    let options = EncodeOptions { block_bits: 4, exact, ..EncodeOptions::default() };
    (encode(&mt, &options).expect("a sound MT"), vertices)
}

fn open(bytes: &[u8]) -> Client<FileSource<Cursor<Vec<u8>>>> {
    let source = FileSource::new(Cursor::new(bytes.to_vec())).expect("it can be read");
    Client::open(source, ClientOptions::default()).expect("a sound file")
}

/// How many vertices of the current mesh have just the value of the input, of how many that belong to it.
fn exact(session: &Session, mesh: &TetMesh, vertices: &[VertexId]) -> [usize; 2] {
    let values = session.exact_values(0);
    let current = session.mesh().expect("a base mesh");
    let mut counts = [0; 2];
    for (vertex, wanted) in vertices.iter().zip(&mesh.fields[0].values) {
        if let Some(slot) = current.slot(*vertex) {
            counts[0] += usize::from(values[slot as usize].to_bits() == wanted.to_bits());
            counts[1] += 1;
        }
    }
    counts
}

#[test]
fn a_client_has_exact_values_when_it_has_fetched_them() {
    let mesh = cube(9, &[hilly]);
    let (bytes, vertices) = file(&mesh);
    let mut client = open(&bytes);
    for error in [0.05, 0.0] {
        client.refine(&Request::within(error)).expect("a sound file");
        client.fetch_exact().expect("a sound file");
        let [same, all] = exact(client.session(), &mesh, &vertices);
        assert_eq!(same, all, "error {error}");
    }
    assert_eq!(exact(client.session(), &mesh, &vertices)[1], mesh.positions.len());
    // Once they are here, nothing more is fetched.
    let before = client.fetched();
    client.fetch_exact().expect("a sound file");
    assert_eq!(client.fetched(), before);
    // What is damaged is refused, and the mesh stays.
    let range = client.session().decoder().exact_range().expect("there are exact values");
    let mut damaged = bytes.clone();
    damaged[(range.start + range.end) as usize / 2] ^= 4;
    let mut client = open(&damaged);
    client.refine(&Request::within(0.0)).expect("only the exact values are damaged");
    let refused = client.fetch_exact();
    assert!(matches!(refused, Err(ClientError::Format(FormatError::Corrupt { .. }))), "{refused:?}");
    assert!(client.session().mesh().is_some_and(|mesh| mesh.tet_count() > 0));
}

#[test]
fn a_file_without_exact_values_has_no_range_of_them() {
    let mesh = cube(5, &[hilly]);
    let built =
        build(&mesh, &BuildConfig::of(MtKind::Edge), &mut |_| ControlFlow::Continue(())).expect("a mesh");
    let bytes = encode(&built.mt, &EncodeOptions::default()).expect("a sound MT");
    let mut client = open(&bytes);
    client.refine(&Request::within(0.0)).expect("a sound file");
    let before = client.fetched();
    client.fetch_exact().expect("nothing to fetch");
    assert_eq!((client.session().decoder().exact_range(), client.fetched()), (None, before));
    assert!(client.session_mut().take_exact(&[]).is_err());
}

#[test]
fn conversions_keep_exact_values() {
    let mesh = cube(6, &[hilly]);
    let (mut bytes, vertices) = file(&mesh);
    for kind in [MtKind::Explicit, MtKind::Edge] {
        let mut session = Session::new();
        session.feed(&bytes).expect("a sound file");
        session.finish().expect("a whole file");
        let converted = session.mt().expect("a base mesh").convert(kind).expect("what it was made of");
        let exact_tables = session.exact_tables().expect("a sound MT");
        assert_eq!(exact_tables.len(), 1);
        let options = EncodeOptions { exact: exact_tables, ..EncodeOptions::default() };
        bytes = encode(&converted, &options).expect("a sound MT");
        let mut read = Session::new();
        read.feed(&bytes).expect("a sound file");
        read.refine(&Request::within(0.0)).expect("a sensible request");
        assert_eq!(exact(&read, &mesh, &vertices), [mesh.positions.len(); 2], "{}", kind.name());
    }
}
