//! Writes the inputs that fuzzing starts from, made by code, into `corpus/<target>/`.

#[path = "../../tests/support/exodus.rs"]
mod exodus;

use exodus::{Values, Variable, decomposed, netcdf};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::error::Error;
use std::fs;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use tetralod_build::BuildConfig;
use tetralod_build::build;
use tetralod::format::EncodeOptions;
use tetralod::format::encode;
use tetralod_io::generate::by_name;
use tetralod_io as io;
use tetralod::mesh::TetMesh;
use tetralod::mt::Mt;
use tetralod::mt::MtKind;
use tetralod_fuzz::exercise::{NAMES, SCRIPT};

fn main() -> Result<(), Box<dyn Error>> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    let scripts =
        [[40; SCRIPT], [0, 1, 2, 3, 60, 5, 36, 97, 200, 66, 10, 11, 193, 13, 74, 15], [255; SCRIPT]];
    for (name, bytes) in mts()? {
        for (which, script) in scripts.iter().enumerate() {
            let input = [&script[..], &bytes].concat();
            for target in ["decode", "decode_fixed", "index", "refine"] {
                if target != "index" || name.starts_with("half-edge") {
                    write(&corpus.join(target), &format!("{name}-{which}"), &input)?;
                }
            }
        }
    }
    for (name, bytes) in meshes()? {
        write(&corpus.join("import"), &name, &bytes)?;
    }
    for name in HDF5_FILES {
        write(&corpus.join("hdf5"), name, &data(name)?)?;
    }
    for version in [1, 2, 5] {
        write(&corpus.join("hdf5"), &format!("classic-{version}"), &classic(version))?;
    }
    for (number, files) in folders()?.iter().enumerate() {
        let name = files.first().map_or("none", |(name, _)| *name);
        write(&corpus.join("folder"), &format!("{number}-{name}"), &together(files)?)?;
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
        let edge = build(&mesh, &all)?.mt;
        put(&format!("edge-{model}-{size}"), &edge, 4)?;
        put(&format!("edge-{model}-{size}"), &edge, 8)?;
        for kind in [MtKind::Vertex, MtKind::HalfEdge] {
            let config = BuildConfig { all_fields: true, ..BuildConfig::of(kind) };
            if let Ok(built) = build(&mesh, &config) {
                put(&format!("{}-{model}-{size}", kind.name()), &built.mt, 5)?;
            }
        }
    }
    Ok(files)
}

/// A tetrahedron, or a cube of samples, in formats that are not VTK's.
const OTHER_FORMATS: [(&str, &str); 10] = [
    (
        "ascii-2.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n\
        5 4 2 6 2 1 2 3 4\n$EndElements\n$NodeData\n1\n\"T\"\n1\n0\n3\n0\n1\n4\n1 1\n2 2\n3 3\n4 4\n$EndNodeData\n",
    ),
    (
        "ascii-4.msh",
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 2 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n\
        $EndNodes\n$Elements\n1 1 5 5\n3 2 4 1\n5 1 2 3 4\n$EndElements\n",
    ),
    (
        "a.mesh",
        "MeshVersionFormatted 1\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 1\n1 2 3 4 0\nEnd\n",
    ),
    (
        "a.vol",
        "mesh3d\ndimension 3\nvolumeelements\n1\n7 4 1 3 2 4\npoints\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nendmesh\n",
    ),
    (
        "list.nrrd",
        "NRRD0005\ntype: uint8\ndimension: 4\nsizes: 2 2 2 2\nkinds: domain domain domain list\naxis mins: 0 0 0 nan\naxis maxs: 2 4 6 nan\n\
        encoding: hex\nold min: 1\n\n000102030405060708090a0b0c0d0e0f",
    ),
    (
        "text.mha",
        "NDims = 3\nBinaryData = False\nDimSize = 2 2 2\nElementType = MET_SHORT_ARRAY\nElementDataFile = LOCAL\n1 2 3 4 5 6 7 8",
    ),
    (
        "quadratic.mesh",
        "MeshVersionFormatted 2\nDimension 3\nVertices 10\n0 0 0 0\n2 0 0 0\n0 2 0 0\n0 0 2 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n0 1 1 0\n\
        TetrahedraP2 1\n1 2 3 4 5 6 7 8 9 10 1\nSolAtVertices 10 1 1\n0 1 2 3 4 5 6 7 8 9\nEnd\n",
    ),
    (
        "steps.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n\
        1 4 2 1 1 1 2 3 4\n$EndElements\n$NodeData\n1\n\"T\"\n1\n0\n3\n0\n1\n4\n1 1\n2 2\n3 3\n4 4\n$EndNodeData\n$NodeData\n1\n\"T\"\n1\n1\n3\n1\n1\n4\n\
        1 1\n2 2\n3 3\n4 4\n$EndNodeData\n$ElementNodeData\n1\n\"s\"\n1\n0\n3\n0\n1\n1\n1 4 1 2 3 4\n$EndElementNodeData\n",
    ),
    ("a.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\nABCDEFGH"),
    ("a.mha", "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nABCDEFGH"),
];

/// Files of other programs: HDF5 and netCDF.
const HDF5_FILES: [&str; 7] = [
    "image.vtkhdf",
    "pieces.vtkhdf",
    "steps.vtkhdf",
    "dense.vtkhdf",
    "netcdf4.exo",
    "many_ways.exo",
    "own_root.exo",
];

/// A file that the tests have.
fn data(name: &str) -> Result<Vec<u8>, Box<dyn Error>> {
    Ok(fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/io/tests/data").join(name))?)
}

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
    for name in HDF5_FILES.into_iter().chain(["lzma.vtu"]) {
        files.push((name.into(), data(name)?));
    }
    files.extend(OTHER_FORMATS.map(|(name, content)| (name.to_owned(), content.into())));
    Ok(files)
}

/// A tetrahedron as Exodus in a format of netCDF's own.
fn classic(version: u8) -> Vec<u8> {
    let variable = |name: &str, dimensions: &[&'static str], kind: &'static str, values: Values| Variable {
        name: name.to_owned(),
        dimensions: dimensions.to_vec(),
        kind,
        values,
    };
    let along = |name: &str, values: [f64; 4]| {
        variable(name, &["num_nodes"], "", Values::Floats(vec![values.to_vec()]))
    };
    let corners = Values::Integers(vec![1, 2, 3, 4]);
    let variables = [
        along("coordx", [0.0, 1.0, 0.0, 0.0]),
        along("coordy", [0.0, 0.0, 1.0, 0.0]),
        along("coordz", [0.0, 0.0, 0.0, 1.0]),
        variable("connect1", &["num_el_in_blk1", "num_nod_per_el1"], "TETRA", corners),
    ];
    let dimensions = [("num_dim", 3), ("num_nodes", 4), ("num_el_in_blk1", 1), ("num_nod_per_el1", 4)];
    netcdf(version, &dimensions, &variables, 0)
}

/// A mesh in the XML of VTK, as text, with arrays that are left in the file where parts are read.
fn as_text(mesh: &TetMesh) -> String {
    let array = |kind: &str, name: &str, components: u32, values: Vec<String>| {
        let values = values.join(" ");
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">{values}</DataArray>"
        )
    };
    let (points, cells) = (mesh.positions.len(), mesh.tets.len());
    let positions = mesh.positions.as_flattened().iter().map(f64::to_string).collect();
    let corners = mesh.tets.as_flattened().iter().map(u32::to_string).collect();
    let [positions, corners, ends, types] = [
        array("Float64", "points", 3, positions),
        array("Int32", "connectivity", 1, corners),
        array("Int32", "offsets", 1, (1..=cells).map(|end| (4 * end).to_string()).collect()),
        array("UInt8", "types", 1, vec!["10".to_owned(); cells]),
    ];
    format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\"><Points>{positions}\
         </Points><Cells>{corners}{ends}{types}</Cells></Piece></UnstructuredGrid></VTKFile>"
    )
}

/// Samples in Zarr: in two chunks, as a shard with its index, in version 2, and as an image.
fn arrays() -> Vec<Files> {
    let array = |chunk: &str, codecs: &str| {
        format!(
            r#"{{"zarr_format": 3, "node_type": "array", "shape": [2, 2, 2], "data_type": "uint8", "chunk_grid": {{"name": "regular", "configuration":
            {{"chunk_shape": {chunk}}}}}, "chunk_key_encoding": {{"name": "default"}}, "fill_value": 0, "codecs": [{codecs}],
            "dimension_names": ["z", "y", "x"]}}"#
        )
        .into_bytes()
    };
    let bytes = r#"{"name": "bytes"}"#;
    let sharded = r#"{"name": "sharding_indexed", "configuration": {"chunk_shape": [2, 2, 1], "codecs": [{"name": "bytes"}], "index_codecs":
        [{"name": "bytes", "configuration": {"endian": "little"}}]}}"#;
    let index = [0_u64, 4, 4, 4].map(u64::to_le_bytes).concat();
    let old = r#"{"zarr_format": 2, "shape": [2, 2, 2], "chunks": [2, 2, 2], "dtype": "|u1", "compressor": null, "fill_value": 0, "order": "C",
        "filters": null}"#;
    let attributes = r#"{"_ARRAY_DIMENSIONS": ["z", "y", "x"], "scale_factor": 0.5, "units": "K"}"#;
    let image = r#"{"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"version": "0.5", "multiscales": [{"name": "i", "axes":
        [{"name": "z", "type": "space", "unit": "nanometer"}, {"name": "y", "type": "space"}, {"name": "x", "type": "space"}], "datasets":
        [{"path": "p", "coordinateTransformations": [{"type": "scale", "scale": [2, 1, 1]}]}]}]}}}"#;
    vec![
        vec![
            ("a.zarr/zarr.json", array("[2, 2, 1]", bytes)),
            ("a.zarr/c/0/0/0", b"ABCD".to_vec()),
            ("a.zarr/c/0/0/1", b"EFGH".to_vec()),
        ],
        vec![
            ("a.zarr/zarr.json", array("[2, 2, 2]", sharded)),
            ("a.zarr/c/0/0/0", [b"ABCDEFGH", &index[..]].concat()),
        ],
        vec![
            ("a.zarr/.zarray", old.into()),
            ("a.zarr/.zattrs", attributes.into()),
            ("a.zarr/0.0.0", b"ABCDEFGH".to_vec()),
        ],
        vec![
            ("a.zarr/zarr.json", image.into()),
            ("a.zarr/p/zarr.json", array("[2, 2, 2]", bytes)),
            ("a.zarr/p/c/0/0/0", b"ABCDEFGH".to_vec()),
        ],
    ]
}

/// A mesh of Exodus in two pieces, with and without numbers of nodes.
fn decompositions() -> [Files; 2] {
    [true, false].map(|has_numbers| {
        let (_, pieces) = decomposed(2, &|_, variables| {
            variables.retain(|variable| has_numbers || variable.name != "node_num_map");
        });
        ["a.e.2.0", "a.e.2.1"].into_iter().zip(pieces).collect()
    })
}

/// Files as the target `folder` takes them.
fn together(files: &[(&str, Vec<u8>)]) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut input = Vec::new();
    for (name, content) in files {
        let number = NAMES.iter().position(|known| known == name).ok_or("a name that is not known")?;
        input.push(u8::try_from(number)?);
        input.extend(u16::try_from(content.len())?.to_le_bytes());
        input.extend(content);
    }
    Ok(input)
}

/// Files that come together, the one that is read first.
type Files = Vec<(&'static str, Vec<u8>)>;

fn folders() -> Result<Vec<Files>, Box<dyn Error>> {
    let mesh = by_name("bucky", 3)?;
    let (mut vtu, mut vti) = (Vec::new(), Vec::new());
    io::write_vtu(&mesh, &mut vtu)?;
    io::write_vti(&mesh, &mut vti)?;
    let packed = |bytes: &[u8]| -> Result<Vec<u8>, Box<dyn Error>> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes)?;
        Ok(encoder.finish()?)
    };
    let samples = || b"ABCDEFGH".to_vec();
    let nrrd = |rest: &str| format!("NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 2 2\n{rest}").into_bytes();
    let image = |file: &str| {
        format!("NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = {file}").into_bytes()
    };
    let slices = || [("s0.raw", b"ABCD".to_vec()), ("s1.raw", b"EFGH".to_vec())];
    let collection = "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"a.vtu\"/>\
                      <DataSet timestep=\"1.5\" file=\"sub/a.vtu\"/></Collection></VTKFile>";
    let pieces = |kind: &str, extents: &str, sources: [&str; 2]| {
        let pieces = sources.map(|source| format!("<Piece {extents} Source=\"{source}\"/>")).concat();
        let whole = extents.replace("Extent", "WholeExtent");
        format!("<VTKFile type=\"P{kind}\"><P{kind} {whole} GhostLevel=\"0\" Origin=\"0 0 0\" Spacing=\"1 1 1\">{pieces}</P{kind}></VTKFile>")
            .into_bytes()
    };
    let sidecar = b"{\"dims\": [2, 2, 2], \"type\": \"uint8\", \"file\": \"b.raw\"}".to_vec();
    let nodes = b"5 3 1 1\n1 0 0 0 10 1\n2 1 0 0 20 1\n3 0 1 0 30 1\n4 0 0 1 40 0\n5 0 0 -1 50 0\n".to_vec();
    let cells = b"2 4 1\n1 1 2 3 4 7\n2 1 3 2 5 8\n".to_vec();
    let medit = b"MeshVersionFormatted 1\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 1\n1 2 3 4 0\nEnd\n";
    let solution = b"MeshVersionFormatted 1\nDimension 3\nSolAtVertices 4 1 1\n1 2 3 4\nEnd\n".to_vec();
    let [first, second] = slices();
    let listed = |header: (&'static str, Vec<u8>)| vec![header, first.clone(), second.clone()];
    let mut files = vec![
        vec![("a.nhdr", nrrd("encoding: raw\ndata file: a.raw\n")), ("a.raw", samples())],
        vec![("a.nhdr", nrrd("encoding: gzip\ndata file: a.raw.gz\n")), ("a.raw.gz", packed(&samples())?)],
        listed(("a.nhdr", nrrd("encoding: raw\ndata file: LIST\ns0.raw\ns1.raw\n"))),
        listed(("a.nhdr", nrrd("encoding: raw\ndata file: s%d.raw 0 1 1 2\n"))),
        vec![("a.mhd", image("a.raw")), ("a.raw", samples())],
        listed(("a.mhd", image("LIST\ns0.raw\ns1.raw\n"))),
        listed(("a.mhd", image("s%d.raw 0 1 1\n"))),
        vec![("a.json", sidecar), ("b.raw", samples())],
        vec![("a.pvd", collection.into()), ("a.vtu", vtu.clone()), ("sub/a.vtu", vtu.clone())],
        vec![
            ("a.pvtu", pieces("UnstructuredGrid", "", ["a.vtu", "sub/a.vtu"])),
            ("a.vtu", vtu.clone()),
            ("sub/a.vtu", vtu.clone()),
        ],
        vec![
            ("a.pvti", pieces("ImageData", "Extent=\"0 2 0 2 0 2\"", ["a.vti", "b.vti"])),
            ("a.vti", vti.clone()),
            ("b.vti", vti),
        ],
        vec![("a.node", nodes.clone()), ("a.ele", cells.clone())],
        vec![("a.ele", cells), ("a.node", nodes)],
        vec![("a.mesh", medit.to_vec()), ("a.sol", solution)],
        vec![("a.vtu.gz", packed(&vtu)?)],
        vec![("a.vtu", vtu)],
        vec![("a.vtu", as_text(&by_name("bucky", 5)?).into())],
    ];
    files.extend(arrays());
    files.extend(decompositions());
    Ok(files)
}
