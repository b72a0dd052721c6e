//! Promise: exact values come out as they went in, also where only parts of a file are read, and through conversions.

use crate::support::meshes::{cube, hilly};
use std::io::Cursor;
use tetralod::format::{DecodeOptions, EncodeOptions, ExactStatus, FormatError, encode};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Exact, MtKind, VertexId};
use tetralod::refine::Request;
use tetralod::session::{Client, ClientError, Session, SessionError};
use tetralod::stream::FileSource;
use tetralod_build::{BuildConfig, BuildResult, build};

/// A file of a half-edge MT with exact values, in small blocks, and the MT's vertex for each point.
fn file(mesh: &TetMesh) -> (Vec<u8>, Vec<VertexId>) {
    let config = BuildConfig { all_lossless: true, block_bits: 4, ..BuildConfig::default() };
    let built = build(mesh, &config).expect("a mesh to build on");
    let BuildResult { mt, vertices, exact, .. } = built;
    let options = EncodeOptions { exact, ..EncodeOptions::default() };
    (encode(&mt, &options).expect("a sound MT"), vertices)
}

fn open(bytes: &[u8]) -> Client<FileSource<Cursor<Vec<u8>>>> {
    let source = FileSource::new(Cursor::new(bytes.to_vec())).expect("it can be read");
    Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file")
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
    let before = client.session().fetched();
    client.fetch_exact().expect("a sound file");
    assert_eq!(client.session().fetched(), before);
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
fn values_of_many_vertices_are_in_several_sections() {
    let mesh = cube(26, &[hilly]);
    assert!(mesh.positions.len() as u32 > Exact::IN_A_SECTION);
    let (bytes, vertices) = file(&mesh);
    let mut client = open(&bytes);
    client.refine(&Request::within(0.0)).expect("a sound file");
    client.fetch_exact().expect("a sound file");
    assert_eq!(exact(client.session(), &mesh, &vertices), [mesh.positions.len(); 2]);
    let range = client.session().decoder().exact_range().expect("there are exact values");
    let sections = &bytes[range.start as usize..range.end as usize];
    let length = u32::from_le_bytes(sections[4..8].try_into().expect("four"));
    let (first, second) = sections.split_at(12 + length as usize);
    assert!(!second.is_empty(), "one section");
    // Out of order, or twice, they are refused, and nothing has changed.
    let mut session = open(&bytes).into_session();
    for sections in [[second, first].concat(), [first, second, second].concat()] {
        let refused = session.take_exact(&sections);
        assert!(matches!(refused, Err(FormatError::Corrupt { .. })), "{refused:?}");
        assert_eq!(session.decoder().exact_status(), ExactStatus::Missing);
    }
    session.take_exact(sections).expect("as they are in the file");
    assert_eq!(session.decoder().exact_status(), ExactStatus::Here);
}

#[test]
fn a_file_without_exact_values_has_no_range_of_them() {
    let mesh = cube(5, &[hilly]);
    let built = build(&mesh, &BuildConfig::default()).expect("a mesh");
    let bytes = encode(&built.mt, &EncodeOptions::default()).expect("a sound MT");
    let mut client = open(&bytes);
    client.refine(&Request::within(0.0)).expect("a sound file");
    let before = client.session().fetched();
    client.fetch_exact().expect("nothing to fetch");
    assert_eq!((client.session().decoder().exact_range(), client.session().fetched()), (None, before));
    assert!(client.into_session().take_exact(&[]).is_err());
}

#[test]
fn conversions_keep_exact_values() {
    let mesh = cube(6, &[hilly]);
    let (mut bytes, vertices) = file(&mesh);
    for kind in [MtKind::Vertex, MtKind::HalfEdge] {
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

/// Feeds all but the last bytes.
fn fed(bytes: &[u8], left_out: usize) -> Session {
    let mut session = Session::new();
    session.feed(&bytes[..bytes.len() - left_out]).expect("a sound prefix");
    session
}

#[test]
fn a_file_whose_exact_values_are_cut_off_says_so() {
    let mut mesh = cube(6, &[hilly, |[x, y, z]| x * y / (1.5 + z)]);
    mesh.fields[0].values[3] = 1.0 / 3.0;
    let config =
        BuildConfig { all_fields: true, all_lossless: true, block_bits: 4, ..BuildConfig::default() };
    let built = build(&mesh, &config).expect("a mesh to build on");
    let options = EncodeOptions { exact: built.exact, ..EncodeOptions::default() };
    let bytes = encode(&built.mt, &options).expect("a sound MT");
    let whole = fed(&bytes, 0);
    assert_eq!(
        (whole.decoder().exact_status(), fed(&bytes, 1).decoder().exact_status()),
        (ExactStatus::Here, ExactStatus::Missing)
    );
    let range = whole.decoder().exact_range().expect("there are exact values");
    let first = range.start
        + 12
        + u64::from(u32::from_le_bytes(bytes[range.start as usize + 4..][..4].try_into().expect("four")));
    assert!(first < range.end, "a section for each field");
    // Where the blocks end, where the first of two sections ends, and within them.
    for end in [range.start, range.start + 5, first, first + 20, range.end - 1] {
        let cut = &bytes[..end as usize];
        let mut session = fed(cut, 0);
        assert!(matches!(session.finish(), Err(FormatError::Truncated { offset }) if offset == end));
        assert_eq!(session.decoder().exact_status(), ExactStatus::Missing, "{end}");
        session.refine(&Request::within(0.0)).expect("all blocks are here");
        assert_eq!(session.mesh().map(|mesh| mesh.tet_count()), Some(mesh.tets.len()));
        assert!(matches!(session.exact_tables(), Err(SessionError::ExactMissing)), "{end}");
        // In parts.
        let mut client = open(cut);
        client.refine(&Request::within(0.0)).expect("all blocks are here");
        assert_eq!(client.session().decoder().exact_status(), ExactStatus::Missing);
        for _ in 0..2 {
            let refused = client.fetch_exact();
            assert!(
                matches!(refused, Err(ClientError::Format(FormatError::Truncated { offset })) if offset == end),
                "{end}: {refused:?}"
            );
        }
        assert!(client.session().mesh().is_some_and(|found| found.tet_count() == mesh.tets.len()));
    }
    let mut client = open(&bytes);
    client.fetch_exact().expect("a whole file");
    assert_eq!(client.session().decoder().exact_status(), ExactStatus::Here);
    let plain = encode(&built.mt, &EncodeOptions::default()).expect("a sound MT");
    assert_eq!(fed(&plain, 0).decoder().exact_status(), ExactStatus::None);
    assert_eq!(fed(&plain, 1).decoder().exact_status(), ExactStatus::None);
}
