//! Is the fully refined mesh the input, tetrahedron for tetrahedron?

use super::mesh_checks::{PlainMesh, PlainReference};
use tetralod::geom::orient3d;
use tetralod::mt::mix;

/// Rounds of comparing neighbourhoods: vertices at one place with equal values are distinguished by their neighbours.
const ROUNDS: usize = 4;

/// Compares the two meshes up to the numbering of vertices and tetrahedra. Vertices correspond by position and level;
/// where several share both, by the tetrahedra around them, and those around these, and so on.
pub fn check(extracted: &PlainMesh<'_>, reference: &PlainReference<'_>) -> Result<(), String> {
    let counts = |positions: &[[i32; 3]], tets: &[[u32; 4]]| [positions.len(), tets.len()];
    let found = counts(extracted.positions, extracted.tets);
    let wanted = counts(reference.positions, reference.tets);
    if found != wanted {
        return Err(format!("vertices and tetrahedra are {found:?}, in the input {wanted:?}"));
    }
    let volumes = [volume(extracted.positions, extracted.tets), volume(reference.positions, reference.tets)];
    if volumes[0] != volumes[1] {
        return Err(format!("the volume times six is {}, that of the input {}", volumes[0], volumes[1]));
    }
    let fields = reference.levels.len() / reference.positions.len().max(1);
    let mut ours = Vertices::new(extracted.positions, extracted.tets, |v| extracted.mesh.levels(v as u32));
    let mut theirs =
        Vertices::new(reference.positions, reference.tets, |v| &reference.levels[v * fields..][..fields]);
    for round in 0..=ROUNDS {
        if let Some(at) = first_difference(ours.sorted(), theirs.sorted()) {
            let what = if round == 0 { "vertices" } else { "tetrahedra" };
            return Err(format!("the {what} are not those of the input ({at})"));
        }
        ours.spread();
        theirs.spread();
    }
    Ok(())
}

fn first_difference(ours: Vec<u64>, theirs: Vec<u64>) -> Option<String> {
    let differing = ours.iter().zip(&theirs).filter(|(a, b)| a != b).count();
    (differing > 0).then(|| format!("from number {} in order", ours.len() - differing))
}

/// Six times the volume, exactly.
pub fn volume(positions: &[[i32; 3]], tets: &[[u32; 4]]) -> i128 {
    let six = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| positions[v as usize]);
        orient3d(a, b, c, d)
    };
    tets.iter().map(six).sum()
}

/// What is known of each vertex, as a hash.
struct Vertices<'a> {
    known: Vec<u64>,
    tets: &'a [[u32; 4]],
}

impl<'a> Vertices<'a> {
    fn new<'l>(positions: &[[i32; 3]], tets: &'a [[u32; 4]], levels: impl Fn(usize) -> &'l [i32]) -> Self {
        let hash = |(v, position): (usize, &[i32; 3])| {
            let words = position.iter().chain(levels(v));
            words.fold(0, |h, &word| mix(h ^ u64::from(word as u32)))
        };
        Self { known: positions.iter().enumerate().map(hash).collect(), tets }
    }

    fn sorted(&self) -> Vec<u64> {
        let mut sorted = self.known.clone();
        sorted.sort_unstable();
        sorted
    }

    /// Adds to what is known of each vertex what is known of the tetrahedra around it.
    fn spread(&mut self) {
        let mut around = vec![0_u64; self.known.len()];
        for tet in self.tets {
            let mut corners = tet.map(|v| self.known[v as usize]);
            corners.sort_unstable();
            let hash = corners.iter().fold(1, |h, &word| mix(h ^ word));
            for &v in tet {
                around[v as usize] = around[v as usize].wrapping_add(hash);
            }
        }
        self.known.iter_mut().zip(around).for_each(|(known, around)| *known = mix(*known ^ mix(around)));
    }
}
