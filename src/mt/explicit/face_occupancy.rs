//! Which faces and vertices of a mesh are occupied: explicit updates that would overlap it are refused.

use crate::mesh::FACES;
use crate::mt::mesh::KindState;
use foldhash::HashMap;

/// The faces of a set of tetrahedra: how often each is used from either side.
#[derive(Clone, Debug, Default)]
pub(in crate::mt) struct Faces(HashMap<[u32; 3], [u8; 2]>);

impl Faces {
    /// Adds the faces of a tetrahedron. False if one of them is occupancy on that side; they are added all the same.
    pub fn add(&mut self, tet: &[u32; 4]) -> bool {
        let mut free = true;
        for (face, side) in faces(tet) {
            let uses = self.0.entry(face).or_default();
            uses[side] = uses[side].saturating_add(1);
            free &= uses[side] == 1;
        }
        free
    }

    pub fn remove(&mut self, tet: &[u32; 4]) {
        for (face, side) in faces(tet) {
            let uses = self.0.entry(face).or_default();
            uses[side] = uses[side].saturating_sub(1);
            if *uses == [0, 0] {
                self.0.remove(&face);
            }
        }
    }

    pub fn has(&self, face: &[u32; 3], side: usize) -> bool {
        self.0.get(face).is_some_and(|uses| uses[side] > 0)
    }
}

/// The four faces: their sorted vertices, and the side of each that the tetrahedron lies on.
pub(in crate::mt) fn faces(tet: &[u32; 4]) -> impl Iterator<Item = ([u32; 3], usize)> + '_ {
    FACES.iter().map(|face| {
        let mut sorted = face.map(|i| tet[i]);
        let mut side = 0;
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            if sorted[i] > sorted[j] {
                sorted.swap(i, j);
                side = 1 - side;
            }
        }
        (sorted, side)
    })
}

/// Faces and vertices of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceOccupancy {
    faces: Faces,
    /// Tetrahedra at each vertex.
    around: Vec<u32>,
}

impl KindState for FaceOccupancy {
    /// With what the hash table keeps free.
    fn bytes(&self) -> u64 {
        let faces = self.faces.0.capacity() * (size_of::<([u32; 3], [u8; 2])>() + 1);
        (faces + size_of_val(&self.around[..])) as u64
    }
}

impl FaceOccupancy {
    /// What these tetrahedra take.
    pub fn by(tets: &[[u32; 4]]) -> Self {
        let mut occupancy = Self::default();
        for tet in tets {
            occupancy.add(tet);
        }
        occupancy
    }

    /// Puts `new` in the place of `old`, unless a side of a face would be occupancy twice: nothing changes then, and it
    /// is false.
    pub fn exchange(&mut self, old: &[[u32; 4]], new: &[[u32; 4]]) -> bool {
        old.iter().for_each(|tet| self.remove(tet));
        let Some(crowded) = new.iter().position(|tet| !self.add(tet)) else { return true };
        self.undo(old, &new[..=crowded]);
        false
    }

    /// Takes an exchange back.
    pub fn undo(&mut self, old: &[[u32; 4]], new: &[[u32; 4]]) {
        new.iter().for_each(|tet| self.remove(tet));
        for tet in old {
            self.add(tet);
        }
    }

    /// Whether a tetrahedron lies on that side of a face.
    pub fn has_face(&self, face: &[u32; 3], side: usize) -> bool {
        self.faces.has(face, side)
    }

    /// Whether a tetrahedron has the vertex.
    pub fn has_vertex(&self, v: u32) -> bool {
        self.around.get(v as usize).is_some_and(|&count| count > 0)
    }

    fn add(&mut self, tet: &[u32; 4]) -> bool {
        for &v in tet {
            if v as usize >= self.around.len() {
                self.around.resize(v as usize + 1, 0);
            }
            self.around[v as usize] += 1;
        }
        self.faces.add(tet)
    }

    fn remove(&mut self, tet: &[u32; 4]) {
        for &v in tet {
            self.around[v as usize] -= 1;
        }
        self.faces.remove(tet);
    }
}
