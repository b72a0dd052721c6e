//! The base mesh: how it grows over its faces, and where its vertices are.
//!
//! Tetrahedra come in the order in which a mesh grows from its first one, and vertices in the order in which they come
//! with them: see `mesh::growth_order`, by which builders number them. A mesh that is in another
//! order comes back as it was, too, but takes far more bits.

use crate::format::coder::{Family, Put, Source};
use crate::format::error::Result;
use crate::geom::WIDE_BITS;
use crate::mesh::{Gate, Growth};
use crate::mt::BaseMesh;

/// What lies behind a face.
const BEHIND: Family = Family::NONE.after(24, 6);
/// Whether a corner of a tetrahedron that no face leads to is new.
const SEED: Family = BEHIND.after(1, 2);
/// Bits of a residual of a position, next to those of the size of what it is predicted from.
const LENGTH: Family = SEED.after(2, 66);
/// Positions less those before.
const STEP: Family = LENGTH.numbers_after(1, 0);
/// The place of a vertex among those that are no candidates.
const RANK: Family = STEP.numbers_after(1, 2);
/// The last family of a base mesh.
pub const LAST: Family = RANK;
/// All of them.
pub const FAMILIES: [Family; 5] = [BEHIND, SEED, LENGTH, STEP, RANK];

/// Symbols of [`BEHIND`]: nothing; a new vertex; the first of the candidates; another known vertex.
const NOTHING: u32 = 0;
const NEW: u32 = 1;
const FIRST: u32 = 2;
const OTHER: u32 = 5;

/// What [`LENGTH`] adds to the bits of a residual, if it is not zero.
const LENGTH_BIAS: u32 = 33;

/// The context of what lies behind a gate: how sharp the sharpest edge towards a candidate is, and whether the border is near.
fn context(gate: &Gate) -> u32 {
    let sharpness = match gate.candidates() {
        [] => 6,
        [first, ..] if first.faces > 1 => 7,
        [first, ..] => [0.5, 0.8, 1.1, 1.4, 1.8, 2.05].iter().filter(|&&x| first.angle > x).count() as u32,
    };
    let border = if gate.straight > 0 { 2 } else { u32::from(gate.borders > 0) };
    3 * sharpness + border
}

/// Puts a base mesh without its field levels. It must be valid: see [`BaseMesh::check`].
pub fn put(out: &mut impl Put, base: &BaseMesh) {
    let known = |&v: &u32| (v as usize) < base.positions.len();
    // A mesh that names vertices which there are not loses its tetrahedra: it is no use to any reader.
    let tets = if base.tets.as_flattened().iter().all(known) { &base.tets[..] } else { &[] };
    let mut growth = Growth::default();
    let in_order = is_in_order(tets);
    out.bits(u32::from(in_order), 1);
    if !in_order {
        put_rest(out, base, &mut growth);
    }
    while let Some(&tet) = tets.get(growth.tets.len()) {
        match growth.gate() {
            Some(gate) => put_behind(out, base, &mut growth, &gate, tet),
            None => put_seed(out, base, &mut growth, tet),
        }
    }
    put_rest(out, base, &mut growth);
}

/// Whether vertices are numbered as they come.
fn is_in_order(tets: &[[u32; 4]]) -> bool {
    let mut next = 0;
    tets.as_flattened().iter().all(|&v| {
        next += u32::from(v == next);
        v < next
    })
}

/// Puts what lies behind a gate, given the next tetrahedron.
fn put_behind(out: &mut impl Put, base: &BaseMesh, growth: &mut Growth, gate: &Gate, tet: [u32; 4]) {
    let (which, apex, next) = (context(gate), tet[3], growth.positions.len() as u32);
    let candidate = gate.candidates().iter().position(|candidate| candidate.vertex == apex);
    if tet[..3] != gate.face || apex > next {
        out.symbol(BEHIND, which, NOTHING);
        growth.close();
        return;
    }
    if apex == next {
        out.symbol(BEHIND, which, NEW);
        put_position(out, growth, gate, base.positions[apex as usize]);
    } else if let Some(at) = candidate {
        out.symbol(BEHIND, which, FIRST + at as u32);
    } else {
        out.symbol(BEHIND, which, OTHER);
        let others = growth.others(gate);
        let rank = others.iter().position(|&v| v == apex).unwrap_or(others.len());
        out.number(RANK, 0, rank as u32);
        if rank == others.len() {
            out.bits(apex, width(growth));
        }
    }
    growth.attach(gate, apex);
}

fn put_seed(out: &mut impl Put, base: &BaseMesh, growth: &mut Growth, tet: [u32; 4]) {
    for v in tet {
        let is_new = v == growth.positions.len() as u32;
        out.symbol(SEED, 0, u32::from(is_new));
        if is_new {
            put_step(out, base, growth);
        } else {
            out.bits(v, width(growth));
        }
    }
    growth.add(tet);
}

/// Bits of the number of a vertex.
fn width(growth: &Growth) -> u32 {
    u32::BITS - (growth.positions.len() as u32).saturating_sub(1).leading_zeros()
}

fn put_rest(out: &mut impl Put, base: &BaseMesh, growth: &mut Growth) {
    while growth.positions.len() < base.positions.len() {
        put_step(out, base, growth);
    }
}

fn put_step(out: &mut impl Put, base: &BaseMesh, growth: &mut Growth) {
    let last = growth.positions.last().copied().unwrap_or_default();
    let position = base.positions[growth.positions.len()];
    (0..3).for_each(|k| out.signed(STEP, 0, position[k].wrapping_sub(last[k])));
    growth.add_vertex(position);
}

fn put_position(out: &mut impl Put, growth: &mut Growth, gate: &Gate, position: [i32; 3]) {
    let (expected, size) = predict(growth, gate);
    for ((expected, which), x) in expected.into_iter().zip(position) {
        let residual = x.wrapping_sub(expected);
        let length = u32::BITS - residual.unsigned_abs().leading_zeros();
        out.symbol(LENGTH, which, if length == 0 { 0 } else { LENGTH_BIAS + length - size });
        if length > 0 {
            out.bits(u32::from(residual < 0), 1);
            out.bits(residual.unsigned_abs(), length - 1);
        }
    }
    growth.add_vertex(position);
}

/// Where the vertex behind a gate is expected along each axis, with the context of the residual; and the bits of the size
/// of the gate. What two corners have in common the vertex may have, too: models have flat sides. Else it lies
/// above the middle of the gate.
fn predict(growth: &Growth, gate: &Gate) -> ([(i32, u32); 3], u32) {
    let [a, b, c] = gate.face.map(|v| growth.positions[v as usize].map(f64::from));
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    // Half as high as a square of twice the gate's area is wide.
    let height = 0.5 / square.sqrt().sqrt().max(1.0);
    let mut size = 0.0;
    let expected = [0, 1, 2].map(|k| {
        let [a, b, c] = [a[k], b[k], c[k]];
        size += a.max(b).max(c) - a.min(b).min(c);
        let pair = if a == b || a == c { Some(a) } else { Some(b).filter(|_| b == c) };
        match pair.filter(|_| a != b || b != c) {
            Some(x) => (x as i32, 1),
            None => (((a + b + c) / 3.0 + normal[k] * height + 0.5).floor() as i32, 0),
        }
    });
    (expected, u32::BITS - (size as u32).leading_zeros())
}

/// Reads a base mesh of so many vertices and tetrahedra, without field levels. Only what is there takes memory, but
/// symbols may take no bits: what the counts make of it has to be within limits.
pub fn read(source: &mut Source<'_>, vertices: u32, tets: u32) -> Result<BaseMesh> {
    let mut growth = Growth::default();
    if source.bits(1)? == 0 {
        read_rest(source, &mut growth, vertices)?;
    }
    while growth.tets.len() < tets as usize {
        match growth.gate() {
            Some(gate) => read_behind(source, &mut growth, &gate, vertices)?,
            None => read_seed(source, &mut growth, vertices)?,
        }
    }
    read_rest(source, &mut growth, vertices)?;
    Ok(BaseMesh { positions: growth.positions, values: Vec::new(), tets: growth.tets })
}

fn read_behind(source: &mut Source<'_>, growth: &mut Growth, gate: &Gate, vertices: u32) -> Result<()> {
    let apex = match source.symbol(BEHIND, context(gate))? {
        NOTHING => {
            growth.close();
            return Ok(());
        }
        NEW => {
            let position = read_position(source, growth, gate)?;
            add_vertex(source, growth, vertices, position)?
        }
        OTHER => {
            let rank = source.number(RANK, 0)? as usize;
            match growth.others(gate).get(rank) {
                Some(&v) => v,
                None => read_vertex(source, growth)?,
            }
        }
        at => match gate.candidates().get((at - FIRST) as usize) {
            Some(candidate) => candidate.vertex,
            None => return Err(source.corrupt("the base mesh goes on behind a face where it cannot")),
        },
    };
    growth.attach(gate, apex);
    Ok(())
}

fn read_seed(source: &mut Source<'_>, growth: &mut Growth, vertices: u32) -> Result<()> {
    let mut tet = [0; 4];
    for v in &mut tet {
        *v = match source.symbol(SEED, 0)? {
            0 => read_vertex(source, growth)?,
            _ => read_step(source, growth, vertices)?,
        };
    }
    growth.add(tet);
    Ok(())
}

fn read_vertex(source: &mut Source<'_>, growth: &Growth) -> Result<u32> {
    let v = source.bits(width(growth))?;
    if v as usize >= growth.positions.len() {
        return Err(source.corrupt("the base mesh uses a vertex that is not there"));
    }
    Ok(v)
}

fn read_rest(source: &mut Source<'_>, growth: &mut Growth, vertices: u32) -> Result<()> {
    while growth.positions.len() < vertices as usize {
        read_step(source, growth, vertices)?;
    }
    Ok(())
}

fn read_step(source: &mut Source<'_>, growth: &mut Growth, vertices: u32) -> Result<u32> {
    let mut position = growth.positions.last().copied().unwrap_or_default();
    for x in &mut position {
        *x = x.wrapping_add(source.signed(STEP, 0)?);
    }
    add_vertex(source, growth, vertices, position)
}

fn read_position(source: &mut Source<'_>, growth: &Growth, gate: &Gate) -> Result<[i32; 3]> {
    let (expected, size) = predict(growth, gate);
    let mut position = [0; 3];
    for (x, (expected, which)) in position.iter_mut().zip(expected) {
        let symbol = source.symbol(LENGTH, which)?;
        let length = if symbol == 0 { 0 } else { (symbol + size).wrapping_sub(LENGTH_BIAS) };
        if length > 31 || symbol > 0 && length == 0 {
            return Err(source.corrupt("a vertex of the base mesh is off the lattice"));
        }
        let mut residual = 0;
        if length > 0 {
            let negative = source.bits(1)? == 1;
            residual = (1 << (length - 1) | source.bits(length - 1)?) as i32;
            residual = if negative { -residual } else { residual };
        }
        *x = expected.wrapping_add(residual);
    }
    Ok(position)
}

fn add_vertex(source: &Source<'_>, growth: &mut Growth, vertices: u32, position: [i32; 3]) -> Result<u32> {
    if !position.iter().all(|x| (0..=1 << WIDE_BITS).contains(x)) {
        return Err(source.corrupt("a vertex of the base mesh is off the lattice"));
    }
    if growth.positions.len() >= vertices as usize {
        return Err(source.corrupt("the base mesh has more vertices than it says"));
    }
    Ok(growth.add_vertex(position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::FormatError;
    use crate::format::coder::{Counts, Models, Writer};
    use crate::format::read::Reader;
    use crate::mesh::{NONE, growth_order, kuhn_tets};

    fn coded(base: &BaseMesh) -> (Models, Vec<u8>) {
        let mut counts = Counts::default();
        put(&mut counts, base);
        let models = Models::new(&counts);
        let mut writer = Writer::new(&models);
        put(&mut writer, base);
        let mut bytes = Vec::new();
        writer.finish(&mut bytes);
        (models, bytes)
    }

    /// Reads as many vertices and tetrahedra as `base` has.
    fn decoded(models: &Models, bytes: &[u8], base: &BaseMesh) -> Result<BaseMesh, FormatError> {
        let mut source = Source::new(Reader::new(bytes, 0), models)?;
        let found = read(&mut source, base.positions.len() as u32, base.tets.len() as u32)?;
        source.end()?;
        Ok(found)
    }

    fn comes_back(base: &BaseMesh) -> Result<usize, FormatError> {
        let (models, bytes) = coded(base);
        assert_eq!(&decoded(&models, &bytes, base)?, base);
        Ok(bytes.len())
    }

    fn in_order(base: &BaseMesh) -> BaseMesh {
        let order = growth_order(&base.positions, &base.tets);
        let loose = (0..).zip(&order.number).filter(|(_, number)| **number == NONE).map(|(v, _)| v);
        let vertices = order.vertices.iter().copied().chain(loose);
        let positions = vertices.map(|v| base.positions[v as usize]).collect();
        BaseMesh { positions, values: Vec::new(), tets: order.tets }
    }

    /// A grid with points off their places, and some of its cells left out.
    fn grid(n: usize, keep: impl Fn(usize) -> bool) -> BaseMesh {
        let mut x = 0x9E37_79B9_7F4A_7C15_u64;
        let mut noise = || {
            x ^= x << 7;
            x ^= x >> 9;
            (x % 201) as i32
        };
        let position = |i: usize| [i % n, i / n % n, i / n / n].map(|k| 1000 * k as i32 + noise());
        let positions = (0..n * n * n).map(position).collect();
        let tets =
            kuhn_tets([n as u32; 3]).into_iter().enumerate().filter(|(t, _)| keep(*t)).map(|(_, tet)| tet);
        BaseMesh { positions, values: Vec::new(), tets: tets.collect() }
    }

    #[test]
    fn any_mesh_comes_back_as_it_was() -> Result<(), FormatError> {
        let meshes = [
            BaseMesh::default(),
            grid(2, |_| true),
            grid(5, |_| true),
            // Parts that meet in faces, edges and vertices, or not at all; vertices that nothing uses.
            grid(5, |t| t / 6 % 3 != 1),
            grid(6, |t| t % 7 < 3),
            grid(4, |t| t % 23 == 5),
            grid(3, |_| false),
        ];
        for mesh in meshes {
            let plain = comes_back(&mesh)?;
            let ordered = in_order(&mesh);
            assert_eq!(in_order(&ordered), ordered);
            let small = comes_back(&ordered)?;
            assert!(small <= plain + 8);
            if mesh.tets.len() == 6 * 64 {
                // Less than 4 bits a tetrahedron and 36 a vertex.
                assert!(8 * small < 4 * mesh.tets.len() + 36 * mesh.positions.len());
            }
        }
        Ok(())
    }

    #[test]
    fn no_mesh_is_too_odd_to_be_told() -> Result<(), FormatError> {
        let mut base = grid(3, |_| true);
        // Inside out, three at a face, a corner twice.
        base.tets[3].swap(0, 1);
        base.tets.push(base.tets[7]);
        base.tets.push([1, 1, 5, 6]);
        base.tets.push([2, 0, 1, 3]);
        comes_back(&base)?;
        base.tets.push([0, 1, 2, 27]);
        let (models, bytes) = coded(&base);
        assert!(decoded(&models, &bytes, &base).is_err());
        Ok(())
    }

    #[test]
    fn damage_is_noticed_or_makes_another_mesh() {
        let base = in_order(&grid(4, |t| t % 5 < 4));
        let (models, bytes) = coded(&base);
        for cut in 0..bytes.len() {
            assert!(decoded(&models, &bytes[..cut], &base).is_err());
        }
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(decoded(&models, &damaged, &base).as_ref(), Ok(&base));
        }
    }
}
