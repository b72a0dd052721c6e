//! Promise: surfaces, lines and points are written as their formats have it.

use flate2::read::ZlibDecoder;
use std::io::{ErrorKind, Read};
use tetralod_io::{PointValues, PolyData, write_csv, write_obj, write_ply, write_stl, write_vtp};

/// Two triangles of a square, or a zigzag through its corners.
fn square(lines: bool) -> PolyData {
    let data = PolyData {
        positions: vec![[0.0, 0.0, 0.5], [2.0, 0.0, 0.5], [2.0, 2.0, 0.5], [0.0, 2.0, 0.5]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        step: 1e-6,
        fields: vec![values("a <b>", vec![1.0, 2.0, 3.0, 4.0]), values("x", vec![-0.5; 4])],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        lines: Vec::new(),
    };
    if lines {
        PolyData { triangles: Vec::new(), lines: vec![vec![0, 2, 1], vec![3, 1]], ..data }
    } else {
        data
    }
}

fn values(name: &str, values: Vec<f64>) -> PointValues {
    PointValues { name: name.to_owned(), values, step: 1e-6 }
}

/// The same far from the origin, with values in a narrow range.
fn far() -> PolyData {
    let data = square(false);
    let positions = data.positions.iter().map(|p| [p[0] + 600_000.1, p[1] + 5_800_000.3, p[2]]).collect();
    let values =
        PointValues { step: 1e-5, ..values("t", vec![1.7e9, 1.7e9 + 0.25, 1.7e9 + 0.5, 1.7e9 + 3.0]) };
    PolyData { positions, fields: vec![values], ..data }
}

fn doubles(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<8>().0.iter().map(|c| f64::from_le_bytes(*c)).collect()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|c| f32::from_le_bytes(*c)).collect()
}

#[test]
fn stl_holds_triangles_with_normals() {
    let mut out = Vec::new();
    write_stl(&square(false), &mut out).expect("written");
    assert!(!out.starts_with(b"solid"));
    assert_eq!(out[80..84], 2_u32.to_le_bytes());
    let first = &out[84..134];
    assert_eq!(floats(&first[..48]), [0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 2.0, 0.0, 0.5, 2.0, 2.0, 0.5]);
    assert_eq!((&first[48..], out.len()), (&[0, 0][..], 84 + 100));
    let refused = write_stl(&square(true), &mut Vec::new()).expect_err("lines");
    assert_eq!(refused.kind(), ErrorKind::InvalidInput);
    write_stl(&PolyData::default(), &mut Vec::new()).expect("an empty surface is one");
}

#[test]
fn ply_holds_points_with_properties() {
    for lines in [false, true] {
        let mut out = Vec::new();
        write_ply(&square(lines), &mut out).expect("written");
        let end = b"end_header\n";
        let at = out.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
        let header = String::from_utf8_lossy(&out[..at]).into_owned();
        assert!(header.contains("element vertex 4\n"));
        let properties: Vec<&str> =
            header.lines().filter_map(|line| line.strip_prefix("property float ")).collect();
        assert_eq!(properties, ["x", "y", "z", "nx", "ny", "nz", "a__b_", "x_1"]);
        let body = &out[at..];
        assert_eq!(floats(&body[32..64]), [2.0, 0.0, 0.5, 0.0, 0.0, 1.0, 2.0, -0.5]);
        let cells = &body[4 * 32..];
        let ints = |bytes: &[u8]| {
            bytes.as_chunks::<4>().0.iter().map(|c| u32::from_le_bytes(*c)).collect::<Vec<_>>()
        };
        if lines {
            assert!(header.contains("element edge 3\n"));
            assert_eq!(ints(cells), [0, 2, 2, 1, 3, 1]);
        } else {
            assert!(header.contains("element face 2\n"));
            assert_eq!((cells.len(), cells[0], ints(&cells[1..13])), (26, 3, vec![0, 1, 2]));
        }
    }
}

#[test]
fn obj_counts_from_one() {
    let written = |data: &PolyData| {
        let mut out = Vec::new();
        write_obj(data, &mut out).expect("written");
        String::from_utf8(out).expect("text")
    };
    let text = written(&square(false));
    assert!(text.starts_with("v 0 0 0.5\nv 2 0 0.5\n") && text.contains("\nvn 0 0 1\n"));
    assert!(text.ends_with("f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n"));
    assert!(written(&square(true)).ends_with("l 1 3 2\nl 4 2\n"));
    let points = PolyData { triangles: Vec::new(), normals: Vec::new(), ..square(false) };
    assert!(written(&points).ends_with("p 3\np 4\n"));
}

/// The numbers of the appended array at `offset`.
fn array(file: &[u8], offset: usize) -> Vec<u8> {
    let mark = b"encoding=\"raw\">\n   _";
    let start =
        file.windows(mark.len()).position(|w| w == mark).expect("appended data") + mark.len() + offset;
    let word = |i: usize| {
        let bytes = file[start + 8 * i..start + 8 * i + 8].try_into().expect("eight bytes");
        u64::from_le_bytes(bytes) as usize
    };
    let mut at = start + 8 * (3 + word(0));
    let mut plain = Vec::new();
    for block in 0..word(0) {
        ZlibDecoder::new(&file[at..at + word(3 + block)]).read_to_end(&mut plain).expect("zlib");
        at += word(3 + block);
    }
    plain
}

#[test]
fn vtp_holds_all_there_is() {
    for (lines, what) in [(false, "NumberOfPolys=\"2\""), (true, "NumberOfLines=\"2\"")] {
        let mut out = Vec::new();
        write_vtp(&square(lines), &mut out).expect("written");
        let text = String::from_utf8_lossy(&out).into_owned();
        assert!(
            text.contains("type=\"PolyData\"")
                && text.contains("NumberOfPoints=\"4\"")
                && text.contains(what)
        );
        assert!(text.contains("Scalars=\"a &#60;b&#62;\"") && text.contains("Normals=\"Normals\""));
        let offset = |after: &str, name: &str| {
            let rest = &text[text.find(after).expect("the element")..];
            let rest = &rest[rest.find(&format!("Name=\"{name}\"")).expect("the array")..];
            let rest = &rest[rest.find("offset=\"").expect("an offset") + 8..];
            rest[..rest.find('"').expect("its end")].parse::<usize>().expect("a number")
        };
        assert_eq!(
            floats(&array(&out, offset("<Points>", "Points"))).into_iter().map(f64::from).collect::<Vec<_>>(),
            square(lines).positions.as_flattened()
        );
        assert_eq!(floats(&array(&out, offset("<PointData", "x"))), [-0.5; 4]);
        let ints = |offset| {
            let bytes = array(&out, offset);
            bytes.as_chunks::<8>().0.iter().map(|c| i64::from_le_bytes(*c)).collect::<Vec<_>>()
        };
        let element = if lines { "<Lines>" } else { "<Polys>" };
        let (connectivity, ends) =
            if lines { (vec![0, 2, 1, 3, 1], vec![3, 5]) } else { (vec![0, 1, 2, 0, 2, 3], vec![3, 6]) };
        assert_eq!(ints(offset(element, "connectivity")), connectivity);
        assert_eq!(ints(offset(element, "offsets")), ends);
    }
}

#[test]
fn what_single_precision_would_lose_is_written_in_double_precision() {
    let data = far();
    let mut out = Vec::new();
    write_vtp(&data, &mut out).expect("written");
    let text = String::from_utf8_lossy(&out).into_owned();
    assert!(
        text.contains("type=\"Float64\" Name=\"Points\"") && text.contains("type=\"Float64\" Name=\"t\"")
    );
    assert!(text.contains("type=\"Float32\" Name=\"Normals\""));
    assert_eq!(doubles(&array(&out, 0)), data.fields[0].values);

    let mut out = Vec::new();
    write_ply(&data, &mut out).expect("written");
    let end = b"end_header\n";
    let at = out.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let header = String::from_utf8_lossy(&out[..at]).into_owned();
    for line in ["double x", "double y", "double z", "float nx", "double t"] {
        assert!(header.contains(&format!("property {line}\n")), "{header}");
    }
    let second = &out[at + 44..at + 88];
    assert_eq!(
        (doubles(&second[..24]), doubles(&second[36..])),
        (data.positions[1].to_vec(), vec![1.7e9 + 0.25])
    );

    let mut out = Vec::new();
    write_obj(&data, &mut out).expect("written");
    let [x, y, z] = data.positions[2];
    assert!(String::from_utf8(out).expect("text").contains(&format!("v {x} {y} {z}\n")));
    // What single precision keeps is as short as it was.
    let mut out = Vec::new();
    let third = PolyData { positions: vec![[1.0 / 3.0; 3]; 4], ..square(false) };
    write_obj(&third, &mut out).expect("written");
    assert!(String::from_utf8(out).expect("text").contains("v 0.33333334 0.33333334 0.33333334\n"));
}

#[test]
fn stl_says_what_its_positions_are_relative_to() {
    let data = far();
    let mut out = Vec::new();
    let origin = write_stl(&data, &mut out).expect("written");
    assert!(origin[0] > 5e5 && origin[1] > 5e6 && origin[2] == 0.0, "{origin:?}");
    let [x, y, z] = origin;
    assert!(String::from_utf8_lossy(&out[..80]).contains(&format!("relative to {x:e} {y:e} {z:e} ")));
    let corners = floats(&out[84 + 12..84 + 48]);
    for (stored, triangle) in corners.as_chunks::<3>().0.iter().zip(data.triangles[0]) {
        for i in 0..3 {
            let back = origin[i] + f64::from(stored[i]);
            assert!((back - data.positions[triangle as usize][i]).abs() <= 0.5e-6, "{stored:?}");
        }
    }
    assert_eq!(write_stl(&square(false), &mut Vec::new()).expect("written"), [0.0; 3]);
    let too_far = PolyData { positions: vec![[0.0; 3], [1e39; 3], [0.0; 3], [1.0; 3]], ..square(false) };
    assert!(write_stl(&too_far, &mut Vec::new()).is_err());
}

#[test]
fn tables_read_back_exactly() {
    let third = 1.0 / 3.0;
    let columns = [("a".to_owned(), vec![1.0, third]), ("b, \"c\"".to_owned(), vec![f64::NAN, -1e-300])];
    let mut out = Vec::new();
    write_csv(&columns, &mut out).expect("written");
    let text = String::from_utf8(out).expect("text");
    assert_eq!(text, format!("a,\"b, \"\"c\"\"\"\n1.0,\n{third},-1e-300\n"));
}

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let spoilt: [fn(&mut PolyData); 4] = [
        |data| data.normals.truncate(1),
        |data| data.fields[1].values.push(0.0),
        |data| data.triangles[1][2] = 4,
        |data| data.lines.push(vec![0, 9]),
    ];
    for spoil in spoilt {
        let mut data = square(false);
        spoil(&mut data);
        let out = &mut Vec::new();
        for result in [
            write_vtp(&data, out),
            write_stl(&data, out).map(|_| ()),
            write_ply(&data, out),
            write_obj(&data, out),
        ] {
            assert_eq!(result.expect_err("it does not fit").kind(), ErrorKind::InvalidInput);
        }
        assert!(out.is_empty());
    }
    let columns = [("a".to_owned(), vec![1.0]), ("b".to_owned(), Vec::new())];
    assert!(write_csv(&columns, &mut Vec::new()).is_err());
}
