//! Writes small meshes in every encoding that files come in, the plain way: the twin of the readers.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use tetralod::mesh::{Field, Grid, TetMesh, VectorPart};

/// The number types of VTK XML files.
pub const TYPES: [&str; 10] =
    ["Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32", "Float64"];

/// A number as the bytes of type `kind`.
pub fn number(kind: &str, value: f64, big: bool) -> Vec<u8> {
    let mut bytes = match kind {
        "Int8" => (value as i8).to_le_bytes().to_vec(),
        "UInt8" => (value as u8).to_le_bytes().to_vec(),
        "Int16" => (value as i16).to_le_bytes().to_vec(),
        "UInt16" => (value as u16).to_le_bytes().to_vec(),
        "Int32" => (value as i32).to_le_bytes().to_vec(),
        "UInt32" => (value as u32).to_le_bytes().to_vec(),
        "Int64" => (value as i64).to_le_bytes().to_vec(),
        "UInt64" => (value as u64).to_le_bytes().to_vec(),
        "Float32" => (value as f32).to_le_bytes().to_vec(),
        "Float64" => value.to_le_bytes().to_vec(),
        other => panic!("no type {other}"),
    };
    if big {
        bytes.reverse();
    }
    bytes
}

pub fn numbers(kind: &str, values: &[f64], big: bool) -> Vec<u8> {
    values.iter().flat_map(|v| number(kind, *v, big)).collect()
}

/// How the arrays of a VTK XML file are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    Ascii,
    Inline,
    AppendedBase64,
    AppendedRaw,
}

/// How a VTK XML file is encoded.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    pub format: Format,
    /// `""`, `"ZLib"`, `"LZ4"` or `"LZMA"`.
    pub compressor: &'static str,
    pub wide: bool,
    pub big: bool,
    /// Bytes of a block before compression.
    pub block: usize,
    pub version: &'static str,
}

impl Style {
    pub const PLAIN: Self =
        Self { format: Format::Ascii, compressor: "", wide: false, big: false, block: 100, version: "0.1" };

    /// Every combination.
    pub fn all() -> Vec<Self> {
        let mut list = Vec::new();
        for format in [Format::Ascii, Format::Inline, Format::AppendedBase64, Format::AppendedRaw] {
            for compressor in ["", "ZLib", "LZ4", "LZMA"] {
                for (wide, big) in [(false, false), (false, true), (true, false), (true, true)] {
                    for (block, version) in [(96, "0.1"), (32768, "1.0")] {
                        list.push(Self { format, compressor, wide, big, block, version });
                    }
                }
            }
        }
        list
    }
}

/// An array of a file.
#[derive(Clone)]
pub struct Array {
    pub section: &'static str,
    pub name: String,
    pub kind: &'static str,
    pub components: usize,
    pub values: Vec<f64>,
}

impl Array {
    pub fn new(
        section: &'static str,
        name: &str,
        kind: &'static str,
        components: usize,
        values: &[f64],
    ) -> Self {
        Self { section, name: name.to_owned(), kind, components, values: values.to_vec() }
    }
}

/// A VTK XML file: attributes of the data set, and for each piece its attributes and arrays.
pub fn xml(style: Style, kind: &str, dataset: &str, pieces: &[(String, Vec<Array>)]) -> Vec<u8> {
    let mut data = Vec::new();
    let mut body = String::new();
    for (attributes, arrays) in pieces {
        body += &format!("<Piece {attributes}>");
        for section in ["PointData", "CellData", "Points", "Coordinates", "Cells"] {
            body += &format!("<{section}>\n");
            for array in arrays.iter().filter(|a| a.section == section) {
                body += &xml_array(style, array, &mut data);
            }
            body += &format!("</{section}>");
        }
        body += "</Piece>";
    }
    let compressor = match style.compressor {
        "" => String::new(),
        name => format!(" compressor=\"vtk{name}DataCompressor\""),
    };
    let mut file = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"{}\" byte_order=\"{}Endian\" header_type=\"UInt{}\"\
         {compressor}>\n<!-- made by a test --><{kind} {dataset}>{body}</{kind}>",
        style.version,
        if style.big { "Big" } else { "Little" },
        if style.wide { 64 } else { 32 },
    )
    .into_bytes();
    if !data.is_empty() {
        let encoding = if style.format == Format::AppendedRaw { "raw" } else { "base64" };
        file.extend(format!("<AppendedData encoding=\"{encoding}\">\n  _").bytes());
        file.extend(data);
        file.extend(b"</AppendedData>");
    }
    file.extend(b"</VTKFile>\n");
    file
}

fn xml_array(style: Style, array: &Array, data: &mut Vec<u8>) -> String {
    let offset = data.len();
    let (format, content) = match style.format {
        Format::Ascii => {
            let text: Vec<String> = array.values.iter().map(|v| format!("{v}")).collect();
            ("ascii".to_owned(), text.join(" "))
        }
        Format::Inline => {
            // White space may stand anywhere between the characters.
            let text = in_base64(&block(style, array));
            let lines: Vec<&str> =
                text.as_bytes().chunks(61).map(|c| std::str::from_utf8(c).unwrap()).collect();
            ("binary".to_owned(), lines.join("\n   "))
        }
        Format::AppendedBase64 => {
            data.extend(in_base64(&block(style, array)).bytes());
            (format!("appended\" offset=\"{offset}"), String::new())
        }
        Format::AppendedRaw => {
            data.extend(block(style, array).concat());
            (format!("appended\" offset=\"{offset}"), String::new())
        }
    };
    let name = array.name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    format!(
        "<DataArray type=\"{}\" Name=\"{name}\" NumberOfComponents=\"{}\" format=\"{format}\">\n{content}\n\
         <InformationKey name=\"L2_NORM_RANGE\" length=\"1\"><Value index=\"0\"> 17 </Value></InformationKey></DataArray>\n",
        array.kind, array.components
    )
}

/// Header and data, in the parts that base64 pads separately.
pub fn block(style: Style, array: &Array) -> Vec<Vec<u8>> {
    let bytes = numbers(array.kind, &array.values, style.big);
    let header = |n: usize| number(if style.wide { "UInt64" } else { "UInt32" }, n as f64, style.big);
    if style.compressor.is_empty() {
        return vec![[header(bytes.len()), bytes].concat()];
    }
    let packed: Vec<Vec<u8>> = bytes.chunks(style.block).map(|c| compress(style.compressor, c)).collect();
    let mut head = [header(packed.len()), header(style.block), header(bytes.len() % style.block)].concat();
    packed.iter().for_each(|p| head.extend(header(p.len())));
    vec![head, packed.concat()]
}

/// The bytes as a file in gzip.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn in_base64(parts: &[Vec<u8>]) -> String {
    parts.iter().map(|p| STANDARD.encode(p)).collect()
}

fn compress(compressor: &str, bytes: &[u8]) -> Vec<u8> {
    match compressor {
        "ZLib" => {
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        "LZ4" => lz4_flex::block::compress(bytes),
        "LZMA" => {
            let mut packed = Vec::new();
            lzma_rs::xz_compress(&mut &*bytes, &mut packed).unwrap();
            packed
        }
        other => panic!("no compressor {other}"),
    }
}

/// Two cells of a grid and three fields, all of whose numbers every format can hold.
pub fn sample() -> TetMesh {
    let grid = Grid { dims: [3, 2, 2], origin: [-1.5, 0.25, 1.0e3], spacing: [0.5, 0.125, 2.0] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let values = |f: fn(f64) -> f64| (0..12).map(|i| f(f64::from(i))).collect();
    mesh.fields = vec![
        Field::new("scalar <&> \"1\"", values(|i| i * 0.375 - 2.0)),
        Field::new("v_x", values(|i| 3.0 * i)),
        Field::new("v_y", values(|i| -4.0 * i)),
        Field::new("v_magnitude", values(|i| 5.0 * i)),
    ];
    // They are written as an array of integers.
    for (field, component) in mesh.fields[1..].iter_mut().zip([Some(0), Some(1), None]) {
        field.vector = Some(VectorPart { name: "v".into(), component });
        field.integer = component.is_some();
    }
    mesh.grid = None;
    mesh
}

/// Some points and all arrays of [`sample`] or a part of it, as a piece of an unstructured grid.
pub fn piece(mesh: &TetMesh, float: &'static str, id: &'static str) -> (String, Vec<Array>) {
    let points: Vec<f64> = mesh.positions.as_flattened().to_vec();
    let vectors: Vec<f64> = (0..mesh.positions.len())
        .flat_map(|i| [mesh.fields[1].values[i], mesh.fields[2].values[i]])
        .collect();
    let ids: Vec<f64> = mesh.tets.as_flattened().iter().map(|v| f64::from(*v)).collect();
    let cells = mesh.tets.len();
    let ends: Vec<f64> = (1..=cells).map(|i| 4.0 * i as f64).collect();
    let arrays = vec![
        Array::new("PointData", &mesh.fields[0].name, float, 1, &mesh.fields[0].values),
        Array::new("PointData", "v", "Int16", 2, &vectors),
        Array::new("CellData", "left out", "Float32", 1, &vec![f64::from(f32::MAX); cells]),
        Array::new("Points", "Points", float, 3, &points),
        Array::new("Cells", "connectivity", id, 1, &ids),
        Array::new("Cells", "offsets", id, 1, &ends),
        Array::new("Cells", "types", "UInt8", 1, &vec![10.0; cells]),
    ];
    (format!("NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\"", mesh.positions.len()), arrays)
}

/// [`sample`] as a `.vtu` file of one piece.
pub fn sample_vtu(style: Style) -> Vec<u8> {
    xml(style, "UnstructuredGrid", "", &[piece(&sample(), "Float64", "Int32")])
}

/// Numbers for a legacy file: text, or big-endian bytes.
fn legacy_numbers(binary: bool, kind: &str, values: &[f64]) -> Vec<u8> {
    if binary {
        let mut bytes = numbers(kind, values, true);
        bytes.push(b'\n');
        return bytes;
    }
    values
        .chunks(7)
        .flat_map(|c| c.iter().map(|v| format!("{v} ")).collect::<String>().into_bytes())
        .collect::<Vec<_>>()
        .into_iter()
        .chain([b'\n'])
        .collect()
}

/// [`sample`] as a legacy file with all kinds of things around it.
pub fn sample_vtk(version: &str, binary: bool) -> Vec<u8> {
    let mesh = sample();
    let (points, cells) = (mesh.positions.len(), mesh.tets.len());
    let mut file = format!(
        "# vtk DataFile Version {version}\nany title, even with POINTS\n{}\n\nDATASET UNSTRUCTURED_GRID\n",
        if binary { "BINARY" } else { "ASCII" }
    )
    .into_bytes();
    let say = |file: &mut Vec<u8>, text: &str| file.extend(text.bytes());
    say(&mut file, "FIELD FieldData 1\nProperties 1 3 float\n");
    file.extend(legacy_numbers(binary, "Float32", &[1.0, 2.0, 3.0]));
    say(&mut file, &format!("POINTS {points} double\n"));
    file.extend(legacy_numbers(binary, "Float64", mesh.positions.as_flattened()));
    say(&mut file, "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 1 2\n\n");
    let ids: Vec<f64> = mesh.tets.as_flattened().iter().map(|v| f64::from(*v)).collect();
    if version.starts_with('5') {
        say(&mut file, &format!("CELLS {} {}\nOFFSETS vtktypeint64\n", cells + 1, 4 * cells));
        let offsets: Vec<f64> = (0..=cells).map(|i| 4.0 * i as f64).collect();
        file.extend(legacy_numbers(binary, "Int64", &offsets));
        say(&mut file, "CONNECTIVITY vtktypeint64\n");
        file.extend(legacy_numbers(binary, "Int64", &ids));
    } else {
        say(&mut file, &format!("CELLS {cells} {}\n", 5 * cells));
        let list: Vec<f64> = ids.chunks(4).flat_map(|c| [&[4.0], c].concat()).collect();
        file.extend(legacy_numbers(binary, "Int32", &list));
    }
    say(&mut file, &format!("\nCELL_TYPES {cells}\n"));
    file.extend(legacy_numbers(binary, "Int32", &vec![10.0; cells]));
    say(&mut file, &format!("CELL_DATA {cells}\nSCALARS left_out unsigned_char 1\nLOOKUP_TABLE default\n"));
    file.extend(legacy_numbers(binary, "UInt8", &vec![7.0; cells]));
    say(&mut file, &format!("POINT_DATA {points}\nSCALARS scalar%20<&>%20\"1\" double\nLOOKUP_TABLE mine\n"));
    file.extend(legacy_numbers(binary, "Float64", &mesh.fields[0].values));
    say(&mut file, "METADATA\nINFORMATION 0\n\nLOOKUP_TABLE mine 2\n");
    file.extend(legacy_numbers(
        binary,
        if binary { "UInt8" } else { "Float32" },
        &[0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0],
    ));
    let vectors: Vec<f64> =
        (0..points).flat_map(|i| [mesh.fields[1].values[i], mesh.fields[2].values[i]]).collect();
    say(&mut file, &format!("FIELD FieldData 2\nlabels 1 {points} string\n"));
    for i in 0..points {
        // The two top bits say that the length takes one byte.
        file.extend(if binary {
            vec![0xc0 | 2, b'l', b'0' + i as u8 % 10]
        } else {
            format!("l{i}\n").into_bytes()
        });
    }
    say(&mut file, &format!("\nv 2 {points} short\n"));
    file.extend(legacy_numbers(binary, "Int16", &vectors));
    file
}

/// The values of the grid in the grid files below.
pub fn grid_sample() -> TetMesh {
    let grid = Grid { dims: [4, 3, 2], origin: [1.0, 2.0, -3.0], spacing: [0.5, 1.0, 0.25] };
    let values = (0..24).map(f64::from).collect();
    TetMesh::from_grid(grid, vec![Field { integer: true, ..Field::new("density", values) }])
}

/// [`grid_sample`] as a `.vti` file.
pub fn sample_vti(style: Style) -> Vec<u8> {
    let values = &grid_sample().fields[0].values;
    let arrays = vec![Array::new("PointData", "density", "UInt8", 1, values)];
    let pieces = [("Extent=\"2 5 0 2 -1 0\"".to_owned(), arrays)];
    xml(
        style,
        "ImageData",
        "WholeExtent=\"2 5 0 2 -1 0\" Origin=\"0 2 -2.75\" Spacing=\"0.5 1 0.25\"",
        &pieces,
    )
}

/// [`grid_sample`] as legacy structured points.
pub fn sample_points_vtk(binary: bool) -> Vec<u8> {
    let mut file = format!(
        "# vtk DataFile Version 3.0\ntitle\n{}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 3 2\nSPACING 0.5 1 0.25\n\
         ORIGIN 1 2 -3\nPOINT_DATA 24\nSCALARS density unsigned_char\nLOOKUP_TABLE default\n",
        if binary { "BINARY" } else { "ASCII" }
    )
    .into_bytes();
    file.extend(legacy_numbers(binary, "UInt8", &grid_sample().fields[0].values));
    file
}

/// The sidecar of [`grid_sample`] as raw samples.
pub fn sample_sidecar(kind: &str, endian: &str) -> String {
    format!(
        "{{\"dims\": [4, 3, 2], \"type\": \"{kind}\", \"endian\": \"{endian}\", \"spacing\": [0.5, 1, 0.25], \
         \"origin\": [1, 2, -3], \"field\": \"density\"}}"
    )
}

/// The positions of a grid whose points are not evenly spaced, along each axis.
const UNEVEN: [&[f64]; 3] = [&[0.0, 1.0, 4.0], &[-2.0, 0.5], &[0.0, 0.25, 8.0]];

/// A grid whose points are not evenly spaced.
pub fn uneven_sample() -> TetMesh {
    let grid = Grid { dims: [3, 2, 3], origin: [0.0; 3], spacing: [1.0; 3] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let at = |axis: usize, index: f64| UNEVEN[axis][index as usize];
    mesh.positions.iter_mut().for_each(|p| *p = [at(0, p[0]), at(1, p[1]), at(2, p[2])]);
    mesh.grid = None;
    let values = (0..18).map(|i| f64::from(i) * 1.5).collect();
    mesh.fields = vec![Field::new("density", values)];
    mesh
}

fn uneven_file(style: Style, kind: &'static str, places: Vec<Array>) -> Vec<u8> {
    let mut arrays =
        vec![Array::new("PointData", "density", "Float64", 1, &uneven_sample().fields[0].values)];
    arrays.extend(places);
    xml(style, kind, "WholeExtent=\"0 2 5 6 0 2\"", &[("Extent=\"0 2 5 6 0 2\"".to_owned(), arrays)])
}

/// [`uneven_sample`] as a `.vtr` file.
pub fn sample_vtr(style: Style) -> Vec<u8> {
    let axis = |axis: usize| Array::new("Coordinates", "", "Float32", 1, UNEVEN[axis]);
    uneven_file(style, "RectilinearGrid", (0..3).map(axis).collect())
}

/// [`uneven_sample`] as a `.vts` file.
pub fn sample_vts(style: Style) -> Vec<u8> {
    let points = uneven_sample().positions.into_flattened();
    uneven_file(style, "StructuredGrid", vec![Array::new("Points", "Points", "Float64", 3, &points)])
}

fn uneven_vtk(binary: bool, kind: &str, places: &[(String, &[f64])]) -> Vec<u8> {
    let encoding = if binary { "BINARY" } else { "ASCII" };
    let head = format!("# vtk DataFile Version 3.0\ntitle\n{encoding}\nDATASET {kind}\nDIMENSIONS 3 2 3\n");
    let mut file = head.into_bytes();
    for (announcement, numbers) in places {
        file.extend(format!("{announcement} double\n").bytes());
        file.extend(legacy_numbers(binary, "Float64", numbers));
    }
    file.extend(b"POINT_DATA 18\nSCALARS density double\nLOOKUP_TABLE default\n");
    file.extend(legacy_numbers(binary, "Float64", &uneven_sample().fields[0].values));
    file
}

/// [`uneven_sample`] as a legacy rectilinear grid.
pub fn sample_rectilinear_vtk(binary: bool) -> Vec<u8> {
    let axis =
        |(name, axis): (&str, usize)| (format!("{name}_COORDINATES {}", UNEVEN[axis].len()), UNEVEN[axis]);
    uneven_vtk(binary, "RECTILINEAR_GRID", &[("X", 0), ("Y", 1), ("Z", 2)].map(axis))
}

/// [`uneven_sample`] as a legacy structured grid.
pub fn sample_structured_vtk(binary: bool) -> Vec<u8> {
    let points = uneven_sample().positions.into_flattened();
    uneven_vtk(binary, "STRUCTURED_GRID", &[("POINTS 18".to_owned(), &points)])
}

/// A hexahedron, a wedge and a pyramid beside it, a tetrahedron on the wedge, and a triangle: types and points.
const MIXED: [(u8, &[u32]); 5] = [
    (12, &[0, 1, 2, 3, 4, 5, 6, 7]),
    (5, &[0, 1, 2]),
    (13, &[1, 5, 8, 2, 6, 9]),
    (14, &[4, 5, 6, 7, 10]),
    (10, &[1, 8, 5, 11]),
];
const MIXED_POINTS: [[f64; 3]; 12] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
    [2.0, 0.0, 0.0],
    [2.0, 1.0, 0.0],
    [0.5, 0.5, 2.0],
    [1.5, -1.0, 0.5],
];

/// What a file of these cells is read as: the rule by which they are split is written here once more, by hand.
pub fn mixed_sample() -> TetMesh {
    let tets = vec![
        // The hexahedron: its lowest vertex to the faces that it is not on.
        [0, 4, 5, 6],
        [0, 4, 6, 7],
        [0, 1, 2, 6],
        [0, 1, 6, 5],
        [0, 2, 3, 7],
        [0, 2, 7, 6],
        // The wedge.
        [1, 2, 6, 9],
        [1, 5, 8, 9],
        [1, 5, 9, 6],
        // The pyramid.
        [4, 5, 6, 10],
        [4, 6, 7, 10],
        [1, 8, 5, 11],
    ];
    let values = (0..12).map(|i| f64::from(i) * 0.5).collect();
    TetMesh {
        positions: MIXED_POINTS.to_vec(),
        fields: vec![Field::new("p", values)],
        tets,
        ..TetMesh::default()
    }
}

/// [`mixed_sample`] as a `.vtu` file with a field `m` at its cells: their numbers.
pub fn mixed_vtu(style: Style) -> Vec<u8> {
    let ids: Vec<f64> = MIXED.iter().flat_map(|(_, points)| points.iter().map(|p| f64::from(*p))).collect();
    let mut end = 0.0;
    let ends: Vec<f64> = MIXED
        .iter()
        .map(|(_, points)| {
            end += points.len() as f64;
            end
        })
        .collect();
    let types: Vec<f64> = MIXED.iter().map(|(kind, _)| f64::from(*kind)).collect();
    let arrays = vec![
        Array::new("PointData", "p", "Float32", 1, &mixed_sample().fields[0].values),
        Array::new("CellData", "m", "Float64", 1, &[0.0, 1.0, 2.0, 3.0, 4.0]),
        Array::new("Points", "Points", "Float32", 3, MIXED_POINTS.as_flattened()),
        Array::new("Cells", "connectivity", "Int32", 1, &ids),
        Array::new("Cells", "offsets", "Int64", 1, &ends),
        Array::new("Cells", "types", "UInt8", 1, &types),
    ];
    xml(style, "UnstructuredGrid", "", &[("NumberOfPoints=\"12\" NumberOfCells=\"5\"".to_owned(), arrays)])
}

/// The same as a legacy file.
pub fn mixed_vtk(version: &str, binary: bool) -> Vec<u8> {
    let lists = MIXED.map(|(_, points)| points.iter().map(|p| f64::from(*p)).collect());
    let types = MIXED.map(|(kind, _)| f64::from(kind));
    let at_points = &mixed_sample().fields[0].values;
    legacy_vtk(version, binary, &MIXED_POINTS, &lists, &types, at_points, &[0.0, 1.0, 2.0, 3.0, 4.0])
}

/// An unstructured grid as a legacy file, of cells with these lists of numbers, with a field `p` at points and `m` at cells.
pub fn legacy_vtk(
    version: &str,
    binary: bool,
    points: &[[f64; 3]],
    lists: &[Vec<f64>],
    types: &[f64],
    at_points: &[f64],
    at_cells: &[f64],
) -> Vec<u8> {
    let encoding = if binary { "BINARY" } else { "ASCII" };
    let (n, cells) = (points.len(), lists.len());
    let mut file = format!(
        "# vtk DataFile Version {version}\ntitle\n{encoding}\nDATASET UNSTRUCTURED_GRID\nPOINTS {n} float\n"
    )
    .into_bytes();
    file.extend(legacy_numbers(binary, "Float32", points.as_flattened()));
    if version.starts_with('5') {
        let ids = lists.concat();
        file.extend(format!("CELLS {} {}\nOFFSETS vtktypeint64\n", cells + 1, ids.len()).bytes());
        let mut offsets = vec![0.0];
        lists.iter().for_each(|list| offsets.push(offsets[offsets.len() - 1] + list.len() as f64));
        file.extend(legacy_numbers(binary, "Int64", &offsets));
        file.extend(b"CONNECTIVITY vtktypeint64\n");
        file.extend(legacy_numbers(binary, "Int64", &ids));
    } else {
        let counted = |list: &Vec<f64>| [&[list.len() as f64], list.as_slice()].concat();
        let list: Vec<f64> = lists.iter().flat_map(counted).collect();
        file.extend(format!("CELLS {cells} {}\n", list.len()).bytes());
        file.extend(legacy_numbers(binary, "Int32", &list));
    }
    file.extend(format!("CELL_TYPES {cells}\n").bytes());
    file.extend(legacy_numbers(binary, "Int32", types));
    file.extend(format!("CELL_DATA {cells}\nSCALARS m double\nLOOKUP_TABLE default\n").bytes());
    file.extend(legacy_numbers(binary, "Float64", at_cells));
    file.extend(format!("POINT_DATA {n}\nSCALARS p float\nLOOKUP_TABLE default\n").bytes());
    file.extend(legacy_numbers(binary, "Float32", at_points));
    file
}
