//! Points in the middle of edges, faces and cells of the second order: see [`super::straighten`].

/// Points in the middle of others: one after the other the point, how many others, and these.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[doc(hidden)]
pub struct Middles(Vec<u32>);

impl Middles {
    /// Takes a point in the middle of these corners; not one that is a corner itself, as where cells are collapsed.
    pub fn push(&mut self, point: u32, corners: impl ExactSizeIterator<Item = u32> + Clone) {
        if corners.clone().all(|corner| corner != point) {
            self.0.extend([point, corners.len() as u32]);
            self.0.extend(corners);
        }
    }

    /// Adds those of another part of the mesh.
    pub fn append(&mut self, part: Self) {
        self.0.extend(part.0);
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The points with their corners.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[u32])> {
        let mut rest = self.0.as_slice();
        std::iter::from_fn(move || {
            let (&[point, corners], after) = rest.split_first_chunk::<2>()?;
            let (corners, after) = after.split_at_checked(corners as usize)?;
            rest = after;
            Some((point, corners))
        })
    }
}
