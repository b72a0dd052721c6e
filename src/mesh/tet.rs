//! Tetrahedra by themselves: the order of faces and edges, and how many a mesh may have.

/// "No tetrahedron": the neighbour across a boundary face.
pub const NONE: u32 = u32::MAX;

/// The four faces of a positive tetrahedron, face `i` opposite vertex `i`, ordered so that the right-handed
/// normal points outward.
///
/// ```text
///         3
///        /|\          face 0: 1 2 3
///       / | \         face 1: 0 3 2
///      0--|--2        face 2: 0 1 3
///       \ | /         face 3: 0 2 1
///         1
/// ```
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The six edges of a tetrahedron.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Most tetrahedra in a mesh: its faces, four a tetrahedron, are counted in 32 bits.
pub const MAX_TETS: usize = (1 << 30) - 1;

/// How many distinct colours regions have: where more touch each other, two may have the same.
pub const REGION_COLORS: u8 = 12;
