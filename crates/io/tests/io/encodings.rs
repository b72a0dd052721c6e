//! One mesh written in every encoding reads back as the same mesh.

use crate::files::*;
use tetralod::mesh::TetMesh;
use tetralod_io as io;

#[test]
fn vtu_in_every_style() {
    for style in Style::all() {
        let mesh = io::read_bytes("a.vtu", &sample_vtu(style)).unwrap_or_else(|e| panic!("{style:?}: {e}"));
        assert_eq!(mesh, sample(), "{style:?}");
    }
}

#[test]
fn vti_in_every_style() {
    for style in Style::all() {
        let mesh = io::read_bytes("a.vti", &sample_vti(style)).unwrap_or_else(|e| panic!("{style:?}: {e}"));
        assert_eq!(mesh, grid_sample(), "{style:?}");
    }
}

#[test]
fn arrays_of_every_type() {
    for style in Style::all() {
        for kind in TYPES {
            let mut data = piece(&sample(), "Float64", "Int64");
            let values: Vec<f64> = (0..12).map(|i| f64::from(i * 11)).collect();
            data.1.push(Array::new("PointData", "more", kind, 1, &values));
            let file = xml(style, "UnstructuredGrid", "", &[data]);
            let mesh = io::read_bytes("a.vtu", &file).unwrap_or_else(|e| panic!("{style:?} {kind}: {e}"));
            assert_eq!(
                (mesh.fields[4].name.as_str(), &mesh.fields[4].values),
                ("more", &values),
                "{style:?} {kind}"
            );
        }
    }
}

#[test]
fn ids_and_types_of_every_integer_type() {
    for kind in &TYPES[..8] {
        for style in [Style::PLAIN, Style { format: Format::AppendedRaw, big: true, ..Style::PLAIN }] {
            let mut data = piece(&sample(), "Float32", kind);
            data.1.iter_mut().filter(|a| a.name == "types").for_each(|a| a.kind = kind);
            let mesh = io::read_bytes("a.vtu", &xml(style, "UnstructuredGrid", "", &[data])).unwrap();
            assert_eq!(mesh.tets, sample().tets, "{kind}");
        }
    }
}

#[test]
fn negative_and_large_integers_keep_their_value() {
    for style in Style::all() {
        for (kind, values) in [
            ("Int8", [-128.0, 127.0]),
            ("Int16", [-32768.0, 32767.0]),
            ("Int32", [-2147483648.0, 2147483647.0]),
            ("Int64", [-9007199254740992.0, 9007199254740992.0]),
            ("UInt64", [0.0, 9223372036854775808.0]),
            ("Float32", [f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)]),
            ("Float64", [5e-324, f64::MAX]),
        ] {
            let mut data = piece(&sample(), "Float64", "Int32");
            let values: Vec<f64> = values.iter().cycle().take(12).copied().collect();
            data.1.push(Array::new("PointData", "more", kind, 1, &values));
            let mesh = io::read_bytes("a.vtu", &xml(style, "UnstructuredGrid", "", &[data])).unwrap();
            assert_eq!(mesh.fields[4].values, values, "{style:?} {kind}");
        }
    }
}

#[test]
fn vtu_in_several_pieces() {
    let one = sample();
    for style in [Style::PLAIN, Style { format: Format::AppendedBase64, compressor: "LZ4", ..Style::PLAIN }] {
        let empty = TetMesh { positions: vec![], tets: vec![], ..one.clone() };
        let empty = TetMesh {
            fields: empty.fields.into_iter().map(|f| tetralod::mesh::Field { values: vec![], ..f }).collect(),
            ..empty
        };
        let pieces = [&one, &empty, &one].map(|m| piece(m, "Float64", "Int32"));
        let mesh = io::read_bytes("a.vtu", &xml(style, "UnstructuredGrid", "", &pieces)).unwrap();
        assert_eq!(mesh.positions, [one.positions.clone(), one.positions.clone()].concat());
        let moved: Vec<[u32; 4]> = one.tets.iter().map(|t| t.map(|v| v + 12)).collect();
        assert_eq!(mesh.tets, [one.tets.clone(), moved].concat());
        assert_eq!(mesh.fields[3].values, [&one.fields[3].values[..]; 2].concat());
    }
}

#[test]
fn pieces_with_other_fields_are_refused() {
    let mut pieces = [&sample(), &sample()].map(|m| piece(m, "Float64", "Int32"));
    pieces[1].1.remove(0);
    let error = io::read_bytes("a.vtu", &xml(Style::PLAIN, "UnstructuredGrid", "", &pieces)).unwrap_err();
    assert!(error.to_string().contains("piece 1") && error.to_string().contains("scalar"), "{error}");
    pieces.swap(0, 1);
    let error = io::read_bytes("a.vtu", &xml(Style::PLAIN, "UnstructuredGrid", "", &pieces)).unwrap_err();
    assert!(error.to_string().contains("piece 1") && error.to_string().contains("scalar"), "{error}");
}

#[test]
fn vti_in_pieces_that_overlap() {
    let all = grid_sample();
    let part = |low: usize, high: usize| {
        let values: Vec<f64> =
            (0..24).filter(|i| (low..=high).contains(&(i % 4))).map(|i| all.fields[0].values[i]).collect();
        let arrays = vec![Array::new("PointData", "density", "Int32", 1, &values)];
        (format!("Extent=\"{low} {high} 0 2 0 1\""), arrays)
    };
    let dataset = "WholeExtent=\"0 3 0 2 0 1\" Origin=\"1 2 -3\" Spacing=\"0.5 1 0.25\"";
    let read = |pieces: &[(String, Vec<Array>)]| {
        io::read_bytes("a.vti", &xml(Style::PLAIN, "ImageData", dataset, pieces))
    };
    assert_eq!(read(&[part(0, 2), part(2, 3)]).unwrap(), all);
    assert!(read(&[part(0, 2)]).unwrap_err().to_string().contains("a piece of the grid is missing"));
    assert!(
        read(&[part(0, 2), part(0, 2)]).unwrap_err().to_string().contains("a piece of the grid is missing")
    );
}

#[test]
fn legacy_in_every_version() {
    for version in ["1.0", "2.0", "3.0", "4.0", "4.1", "4.2", "5.0", "5.1"] {
        for binary in [false, true] {
            let file = sample_vtk(version, binary);
            let mesh = io::read_bytes("a.vtk", &file).unwrap_or_else(|e| panic!("{version} {binary}: {e}"));
            assert_eq!(mesh, sample(), "{version} {binary}");
            if !binary {
                let text = String::from_utf8(file).unwrap().replace('\n', "\r\n");
                assert_eq!(
                    io::read_bytes("a.vtk", text.as_bytes()).unwrap(),
                    sample(),
                    "{version} with CR LF"
                );
            }
        }
    }
}

#[test]
fn legacy_structured_points() {
    for binary in [false, true] {
        assert_eq!(io::read_bytes("a.vtk", &sample_points_vtk(binary)).unwrap(), grid_sample());
    }
}

#[test]
fn legacy_attributes_of_every_kind() {
    let mut file = String::from_utf8(sample_points_vtk(false)).unwrap();
    let rows = |n: usize| vec!["1 ".repeat(n); 24].join("\n");
    file += &format!("VECTORS velocity float\n{}\n", rows(3));
    file += &format!("NORMALS normal double\n{}\n", rows(3));
    file += &format!("TENSORS stress float\n{}\n", rows(9));
    file += &format!("TENSORS6 strain float\n{}\n", rows(6));
    file += &format!("TEXTURE_COORDINATES uv 2 float\n{}\n", rows(2));
    file += &format!("COLOR_SCALARS colour 4\n{}\n", rows(4));
    file += &format!("GLOBAL_IDS ids vtkIdType\n{}\n", rows(1));
    file += &format!("SCALARS two bit 2\nLOOKUP_TABLE default\n{}\n", rows(2));
    let mesh = io::read_bytes("a.vtk", file.as_bytes()).unwrap();
    let names: Vec<&str> = mesh.fields.iter().map(|f| f.name.as_str()).collect();
    for name in
        ["velocity_z", "normal_magnitude", "stress_zx", "strain_xz", "uv_y", "colour_3", "ids", "two_x"]
    {
        assert!(names.contains(&name), "{name} of {names:?}");
    }
    assert_eq!(names.len(), 1 + 4 + 4 + 14 + 11 + 3 + 5 + 1 + 3);
}

#[test]
fn raw_samples_of_every_type() {
    let mut mesh = grid_sample();
    for kind in TYPES {
        mesh.fields[0].integer = !kind.starts_with("Float");
        for (endian, big) in [("little", false), ("big", true)] {
            let samples = numbers(kind, &mesh.fields[0].values, big);
            let sidecar = sample_sidecar(&kind.to_lowercase(), endian);
            assert_eq!(
                io::read_raw("a.json", sidecar.as_bytes(), &samples).unwrap(),
                mesh,
                "{kind} {endian}"
            );
            let error = io::read_raw("a.json", sidecar.as_bytes(), &samples[1..]).unwrap_err();
            assert!(error.to_string().contains("bytes of samples"), "{error}");
        }
    }
}

#[test]
fn raw_samples_from_files_by_either_name() {
    let folder = std::env::temp_dir().join(format!("tetralod-io-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mesh = grid_sample();
    std::fs::write(folder.join("a.raw"), numbers("UInt16", &mesh.fields[0].values, false)).unwrap();
    std::fs::write(folder.join("a.json"), sample_sidecar("uint16", "little")).unwrap();
    assert_eq!(io::read(&folder.join("a.raw")).unwrap(), mesh);
    assert_eq!(io::read(&folder.join("a.json")).unwrap(), mesh);
    let elsewhere = r#"{"dims": [2,2,2], "type": "uint8", "file": "../a.raw"}"#;
    std::fs::write(folder.join("b.json"), elsewhere).unwrap();
    let error = io::read(&folder.join("b.json")).unwrap_err();
    assert!(error.to_string().contains("another folder"), "{error}");
    let error = io::read(&folder.join("none.vtu")).unwrap_err();
    assert!(error.file.ends_with("none.vtu"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_key_of_a_sidecar_that_could_change_the_meaning_is_refused() {
    let read = |more: &str| {
        let sidecar = format!("{{\"dims\": [2, 2, 2], \"type\": \"uint8\"{more}}}");
        io::read_raw("a.json", sidecar.as_bytes(), &[0, 1, 2, 3, 4, 5, 6, 7])
            .map_err(|error| error.to_string())
    };
    let plain = read("").expect("nothing that is optional");
    for remark in [
        r#", "name": "a", "description": "b", "source": "c", "license": "d", "range": [0, 7]"#,
        r#", "order": "x fastest, then y, then z""#,
    ] {
        assert_eq!(read(remark).as_ref(), Ok(&plain), "{remark}");
    }
    for (more, words) in [
        (r#", "byteOrder": "big""#, "the key \"byteOrder\""),
        (r#", "order": "zyx""#, "the order \"zyx\""),
        (r#", "endian": 1"#, "\"endian\" is not a text"),
        (r#", "field": ["a"]"#, "\"field\" is not a text"),
        (r#", "skip": 3"#, "the key \"skip\""),
    ] {
        let error = read(more).expect_err(more);
        assert!(error.contains(words), "{more}: {error}");
    }
}

#[test]
fn what_is_written_reads_back() {
    let mut bytes = Vec::new();
    io::write_vtu(&sample(), &mut bytes).unwrap();
    assert_eq!(io::read_bytes("a.vtu", &bytes).unwrap(), sample());
    bytes.clear();
    io::write_vti(&grid_sample(), &mut bytes).unwrap();
    assert_eq!(io::read_bytes("a.vti", &bytes).unwrap(), grid_sample());
    // Many blocks, one of them full to the end.
    for size in [16, 17, 21] {
        let mesh = tetralod_io::generate::bucky(size).unwrap();
        bytes.clear();
        io::write_vtu(&mesh, &mut bytes).unwrap();
        assert_eq!(io::read_bytes("a.vtu", &bytes).unwrap(), TetMesh { grid: None, ..mesh.clone() });
        bytes.clear();
        io::write_vti(&mesh, &mut bytes).unwrap();
        assert_eq!(io::read_bytes("a.vti", &bytes).unwrap(), mesh);
    }
    let error = io::write_vti(&sample(), &mut bytes).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::InvalidInput);
    let empty = TetMesh::default();
    bytes.clear();
    io::write_vtu(&empty, &mut bytes).unwrap();
    assert_eq!(io::read_bytes("a.vtu", &bytes).unwrap(), empty);
}

/// `tests/data/lzma.vtu` was made by `tests/data/lzma.py`: the compressor of the test support stores only.
#[test]
fn lzma_that_compresses() {
    let grid = tetralod::mesh::Grid { dims: [9, 9, 9], origin: [0.0; 3], spacing: [1.0; 3] };
    let mesh = io::read_bytes("lzma.vtu", include_bytes!("../data/lzma.vtu")).unwrap();
    let expected = TetMesh::from_grid(grid, Vec::new());
    assert_eq!(mesh.positions, expected.positions);
    assert_eq!(mesh.tets, expected.tets);
    let linear: Vec<f64> = expected.positions.iter().map(|p| p[0] + 2.0 * p[1] + 3.0 * p[2]).collect();
    assert_eq!((mesh.fields[0].name.as_str(), &mesh.fields[0].values), ("linear", &linear));
}
