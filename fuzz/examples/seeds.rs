//! Writes the inputs that fuzzing starts from, made by code, into `corpus/<target>/`.

use std::error::Error;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use tetralod::builder::BuildConfig;
use tetralod::builder::build;
use tetralod::format::EncodeOptions;
use tetralod::format::encode;
use tetralod::generate::by_name;
use tetralod::io;
use tetralod::mt::Mt;
use tetralod::mt::MtKind;
use tetralod_fuzz::exercise::SCRIPT;

fn main() -> Result<(), Box<dyn Error>> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    let scripts = [[40; SCRIPT], [0, 1, 2, 3, 60, 5, 36, 97, 200, 66, 10, 11, 193, 13, 74, 15], [255; SCRIPT]];
    for (name, bytes) in mts()? {
        for (which, script) in scripts.iter().enumerate() {
            let input = [&script[..], &bytes].concat();
            for target in ["decode", "decode_fixed", "index", "refine"] {
                if target != "index" || name.starts_with("edge") {
                    write(&corpus.join(target), &format!("{name}-{which}"), &input)?;
                }
            }
        }
    }
    for (name, bytes) in meshes()? {
        write(&corpus.join("import"), &name, &bytes)?;
    }
    Ok(())
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    Ok(fs::write(folder.join(name), bytes)?)
}

/// Small files of all kinds, in several block sizes.
fn mts() -> Result<Vec<(String, Vec<u8>)>, Box<dyn Error>> {
    let mut files = Vec::new();
    let mut put = |name: &str, mt: &Mt, block_bits: u32| -> Result<(), Box<dyn Error>> {
        let mt = mt.in_pages(block_bits)?;
        files.push((format!("{name}-{block_bits}"), encode(&mt, &EncodeOptions::default())?));
        Ok(())
    };
    for (model, size) in [("bucky", 4), ("bucky", 6), ("sphere-flow", 5)] {
        let mesh = by_name(model, size)?;
        let all = BuildConfig { all_fields: true, ..BuildConfig::of(MtKind::Edge) };
        let edge = build(&mesh, &all, &mut |_| ControlFlow::Continue(()))?.mt;
        put(&format!("edge-{model}-{size}"), &edge, 4)?;
        put(&format!("edge-{model}-{size}"), &edge, 8)?;
        put(&format!("explicit-{model}-{size}"), &edge.convert(MtKind::Explicit)?, 4)?;
        for kind in [MtKind::Vertex, MtKind::HalfEdge] {
            let config = BuildConfig { all_fields: true, ..BuildConfig::of(kind) };
            if let Ok(built) = build(&mesh, &config, &mut |_| ControlFlow::Continue(())) {
                put(&format!("{}-{model}-{size}", kind.name()), &built.mt, 5)?;
            }
        }
    }
    Ok(files)
}

/// A tetrahedron, or a cube of samples, in formats that are not VTK's.
const OTHER_FORMATS: [(&str, &str); 10] = [
    ("ascii-2.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n\
        5 4 2 6 2 1 2 3 4\n$EndElements\n$NodeData\n1\n\"T\"\n1\n0\n3\n0\n1\n4\n1 1\n2 2\n3 3\n4 4\n$EndNodeData\n"),
    ("ascii-4.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 2 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n\
        $EndNodes\n$Elements\n1 1 5 5\n3 2 4 1\n5 1 2 3 4\n$EndElements\n"),
    ("a.mesh", "MeshVersionFormatted 1\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 1\n1 2 3 4 0\nEnd\n"),
    ("a.vol", "mesh3d\ndimension 3\nvolumeelements\n1\n7 4 1 3 2 4\npoints\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nendmesh\n"),
    ("list.nrrd", "NRRD0005\ntype: uint8\ndimension: 4\nsizes: 2 2 2 2\nkinds: domain domain domain list\naxis mins: 0 0 0 nan\naxis maxs: 2 4 6 nan\n\
        encoding: hex\nold min: 1\n\n000102030405060708090a0b0c0d0e0f"),
    ("text.mha", "NDims = 3\nBinaryData = False\nDimSize = 2 2 2\nElementType = MET_SHORT_ARRAY\nElementDataFile = LOCAL\n1 2 3 4 5 6 7 8"),
    ("quadratic.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices 10\n0 0 0 0\n2 0 0 0\n0 2 0 0\n0 0 2 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n0 1 1 0\n\
        TetrahedraP2 1\n1 2 3 4 5 6 7 8 9 10 1\nSolAtVertices 10 1 1\n0 1 2 3 4 5 6 7 8 9\nEnd\n"),
    ("steps.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n\
        1 4 2 1 1 1 2 3 4\n$EndElements\n$NodeData\n1\n\"T\"\n1\n0\n3\n0\n1\n4\n1 1\n2 2\n3 3\n4 4\n$EndNodeData\n$NodeData\n1\n\"T\"\n1\n1\n3\n1\n1\n4\n\
        1 1\n2 2\n3 3\n4 4\n$EndNodeData\n$ElementNodeData\n1\n\"s\"\n1\n0\n3\n0\n1\n1\n1 4 1 2 3 4\n$EndElementNodeData\n"),
    ("a.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\nABCDEFGH"),
    ("a.mha", "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nABCDEFGH"),
];

/// Files of other programs: HDF5, netCDF and LZMA.
const FILES: [&str; 6] =
    ["image.vtkhdf", "pieces.vtkhdf", "steps.vtkhdf", "netcdf4.exo", "many_ways.exo", "lzma.vtu"];

/// Small meshes in most of the formats that are read.
fn meshes() -> Result<Vec<(String, Vec<u8>)>, Box<dyn Error>> {
    let mesh = by_name("bucky", 3)?;
    let mut files = Vec::new();
    let mut bytes = Vec::new();
    io::write_vtu(&mesh, &mut bytes)?;
    files.push(("mesh.vtu".into(), bytes));
    let mut bytes = Vec::new();
    io::write_vti(&mesh, &mut bytes)?;
    files.push(("grid.vti".into(), bytes));
    let ascii = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n\
                 CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nSCALARS p float 1\nLOOKUP_TABLE default\n1 2 3 4\n\
                 VECTORS U float\n1 0 0 1 0 0 1 0 0 1 0 0\n";
    files.push(("ascii.vtk".into(), ascii.into()));
    let grid = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n\
                POINT_DATA 8\nSCALARS p float 1\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 8\n";
    files.push(("grid.vtk".into(), grid.into()));
    let plain = "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>\
                 <Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><PointData><DataArray type=\"Float32\" Name=\"p\" \
                 format=\"ascii\">1 2 3 4</DataArray></PointData><Points><DataArray type=\"Float32\" \
                 NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>\
                 <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray><DataArray \
                 type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray><DataArray type=\"UInt8\" Name=\"types\" \
                 format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";
    files.push(("plain.vtu".into(), plain.into()));
    let sidecar = "{\"dims\": [2, 2, 2], \"type\": \"uint8\", \"endian\": \"little\", \"spacing\": [1, 1, 1], \"origin\": [0, 0, 0], \"field\": \"p\"}\0abcdefgh";
    files.push(("samples.raw".into(), sidecar.into()));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data");
    for name in FILES {
        files.push((name.into(), fs::read(folder.join(name))?));
    }
    files.extend(OTHER_FORMATS.map(|(name, content)| (name.to_owned(), content.into())));
    Ok(files)
}
