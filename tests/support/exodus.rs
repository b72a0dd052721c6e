//! Files of Exodus in classic netCDF, and a mesh that is in one file and in several.

use tetralod::mesh::kuhn_tets;

/// A variable of a netCDF file: its name, its dimensions, an attribute of text, and its values.
#[derive(Clone)]
pub struct Variable {
    pub name: String,
    pub dimensions: Vec<&'static str>,
    pub kind: &'static str,
    pub values: Values,
}

#[derive(Clone)]
pub enum Values {
    Text(Vec<u8>),
    Integers(Vec<i32>),
    /// Of each record one list, or one for all.
    Floats(Vec<Vec<f64>>),
}

/// A file in classic netCDF: its header twice, as the first one does not know where the data begins.
pub fn netcdf(version: u8, dimensions: &[(&str, u64)], variables: &[Variable], records: u64) -> Vec<u8> {
    let header = |begins: &[u64]| {
        let count = |number: u64| {
            if version == 5 { number.to_be_bytes().to_vec() } else { (number as u32).to_be_bytes().to_vec() }
        };
        let offset = |number: u64| if version == 1 { count(number) } else { number.to_be_bytes().to_vec() };
        let padded = |bytes: &[u8]| [bytes, &vec![0; bytes.len().next_multiple_of(4) - bytes.len()]].concat();
        let name = |name: &str| [count(name.len() as u64), padded(name.as_bytes())].concat();
        let tag = |tag: u32, length: usize| [tag.to_be_bytes().to_vec(), count(length as u64)].concat();
        let mut bytes = [b"CDF", &[version][..], &count(records)].concat();
        bytes.extend(tag(10, dimensions.len()));
        for (text, size) in dimensions {
            bytes.extend([name(text), count(*size)].concat());
        }
        bytes.extend([tag(0, 0), tag(11, variables.len())].concat());
        for (variable, begin) in variables.iter().zip(begins) {
            bytes.extend([name(&variable.name), count(variable.dimensions.len() as u64)].concat());
            let number = |of: &str| dimensions.iter().position(|(text, _)| *text == of).unwrap() as u64;
            bytes.extend(variable.dimensions.iter().flat_map(|of| count(number(of))));
            if variable.kind.is_empty() {
                bytes.extend(tag(0, 0));
            } else {
                let text = [2_u32.to_be_bytes().to_vec(), name(variable.kind)].concat();
                bytes.extend([tag(12, 1), name("elem_type"), text].concat());
            }
            let (kind, size) = match &variable.values {
                Values::Text(text) => (2_u32, text.len()),
                Values::Integers(list) => (4, 4 * list.len()),
                Values::Floats(rows) => (6, 8 * rows[0].len()),
            };
            bytes.extend(
                [kind.to_be_bytes().to_vec(), count(size.next_multiple_of(4) as u64), offset(*begin)]
                    .concat(),
            );
        }
        bytes
    };
    let part = |variable: &Variable, record: usize| {
        let mut bytes: Vec<u8> = match &variable.values {
            Values::Text(text) => text.clone(),
            Values::Integers(list) => list.iter().flat_map(|number| number.to_be_bytes()).collect(),
            Values::Floats(rows) => rows[record].iter().flat_map(|number| number.to_be_bytes()).collect(),
        };
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes
    };
    let is_record = |variable: &&Variable| variable.dimensions.first() == Some(&"time_step");
    let mut data = Vec::new();
    let mut begins = vec![0; variables.len()];
    let start = header(&begins).len() as u64;
    for record in 0..=records as usize {
        for (begin, variable) in begins.iter_mut().zip(variables) {
            // First what has no records, then the records one by one.
            match (is_record(&variable), record) {
                (false, 0) | (true, 1) => *begin = start + data.len() as u64,
                (false, _) | (true, 0) => {}
                _ => {}
            }
            if is_record(&variable) == (record > 0) {
                data.extend(part(variable, record.saturating_sub(1)));
            }
        }
    }
    [header(&begins), data].concat()
}

/// A variable at these dimensions.
fn variable(name: &str, dimensions: &[&'static str], kind: &'static str, values: Values) -> Variable {
    Variable { name: name.into(), dimensions: dimensions.to_vec(), kind, values }
}

/// The points of the mesh along each axis.
pub const DIMS: [u32; 3] = [9, 4, 3];

/// A grid of tetrahedra in two blocks, with `T` at nodes and `s` at elements at two times: in one file, and in so many. These have their nodes in
/// other orders, blocks that are empty where a piece has none of their elements, and `change` may change the variables of each.
pub fn decomposed(pieces: usize, change: &dyn Fn(usize, &mut Vec<Variable>)) -> (Vec<u8>, Vec<Vec<u8>>) {
    let all = kuhn_tets(DIMS);
    let points: Vec<usize> = (0..DIMS.iter().product::<u32>() as usize).collect();
    let elements: Vec<usize> = (0..all.len()).collect();
    let whole = exodus_of(&all, &points, &elements, &|_| ());
    let of_piece = |piece: usize| {
        // They follow one another along x.
        let side = |element: &usize| element / 6 % (DIMS[0] as usize - 1) * pieces / (DIMS[0] as usize - 1);
        let own: Vec<usize> = elements.iter().copied().filter(|element| side(element) == piece).collect();
        let is_used = |point: &usize| own.iter().any(|&element| all[element].contains(&(*point as u32)));
        let mut used: Vec<usize> = points.iter().copied().filter(is_used).collect();
        if piece % 2 == 1 {
            used.reverse();
        }
        exodus_of(&all, &used, &own, &|variables| change(piece, variables))
    };
    (whole, (0..pieces).map(of_piece).collect())
}

fn exodus_of(
    all: &[[u32; 4]],
    points: &[usize],
    elements: &[usize],
    change: &dyn Fn(&mut Vec<Variable>),
) -> Vec<u8> {
    // The first block has the elements of low x.
    let is_low = |element: usize| element / 6 % (DIMS[0] as usize - 1) < 3;
    let blocks = [true, false]
        .map(|low| elements.iter().copied().filter(|&e| is_low(e) == low).collect::<Vec<usize>>());
    let dimensions = [
        ("time_step", 0),
        ("num_dim", 3),
        ("num_nodes", points.len() as u64),
        ("num_elem", elements.len() as u64),
        ("num_el_blk", 2),
        ("len_name", 5),
        ("num_nod_var", 1),
        ("num_elem_var", 1),
        ("e1", blocks[0].len() as u64),
        ("e2", blocks[1].len() as u64),
        ("p", 4),
    ];
    let numbers = |list: &[usize]| Values::Integers(list.iter().map(|&i| i as i32 + 1).collect());
    let mut variables = vec![
        variable("eb_prop1", &["num_el_blk"], "", Values::Integers(vec![10, 20])),
        variable("eb_names", &["num_el_blk", "len_name"], "", Values::Text(b"low\0\0high\0".into())),
        variable("node_num_map", &["num_nodes"], "", numbers(points)),
        variable("elem_num_map", &["num_elem"], "", numbers(&blocks.concat())),
        variable("time_whole", &["time_step"], "", Values::Floats(vec![vec![0.25], vec![1.0]])),
        variable("name_nod_var", &["num_nod_var", "len_name"], "", Values::Text(b"T\0\0\0\0".into())),
        variable("name_elem_var", &["num_elem_var", "len_name"], "", Values::Text(b"s\0\0\0\0".into())),
    ];
    let place = |point: usize| {
        let [x, y, _] = DIMS.map(|n| n as usize);
        [point % x, point / x % y, point / (x * y)].map(|i| i as f64 / 3.0)
    };
    for (axis, name) in ["coordx", "coordy", "coordz"].into_iter().enumerate() {
        let along = points.iter().map(|&point| place(point)[axis]).collect();
        variables.push(variable(name, &["num_nodes"], "", Values::Floats(vec![along])));
    }
    let at_nodes = |time: f64| points.iter().map(|&p| time + place(p).iter().sum::<f64>()).collect();
    let values = Values::Floats([0.25, 1.0].map(at_nodes).to_vec());
    variables.push(variable("vals_nod_var1", &["time_step", "num_nodes"], "", values));
    for (number, (block, dimension)) in (1..).zip(blocks.iter().zip(["e1", "e2"])) {
        if block.is_empty() {
            continue;
        }
        let local = |v: &u32| points.iter().position(|p| *p == *v as usize).unwrap() as i32 + 1;
        let corners = block.iter().flat_map(|&e| all[e].iter().map(local)).collect();
        let connect = format!("connect{number}");
        variables.push(variable(&connect, &[dimension, "p"], "TETRA4", Values::Integers(corners)));
        let at_elements = |time: f64| block.iter().map(|&e| time + e as f64).collect();
        let values = Values::Floats([0.25, 1.0].map(at_elements).to_vec());
        let name = format!("vals_elem_var1eb{number}");
        variables.push(variable(&name, &["time_step", dimension], "", values));
    }
    // What has no size is left out, as it would be that of records.
    let is_there =
        |name: &str| name == "time_step" || dimensions.iter().all(|(other, n)| *other != name || *n > 0);
    variables.retain(|variable| variable.dimensions.iter().all(|name| is_there(name)));
    let dimensions: Vec<_> = dimensions.iter().copied().filter(|(name, _)| is_there(name)).collect();
    change(&mut variables);
    netcdf(2, &dimensions, &variables, 2)
}
