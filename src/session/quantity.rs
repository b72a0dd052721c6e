//! The level of detail as numbers, one for each tetrahedron, to be seen as colours.

use super::{Session, SessionError};
use crate::format::FormatError;
use crate::geom::Lattice;
use crate::mesh::EDGES;
use crate::mt::{ApplyUpdates, CurrentMesh, Mt, MultiTessellation, ReplayError, UpdatePages};
use crate::refine::Front;
use std::fmt;

/// What can be said of each tetrahedron of the current mesh by a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TetQuantity {
    /// The length of the longest edge, in model units.
    #[default]
    Size,
    /// The error that refinement goes by, as a fraction of the field's range: see
    /// [`Front::tet_errors`](crate::refine::Front::tet_errors).
    Error,
    /// Updates on the longest path of the partial order from the base mesh to the update that made the
    /// tetrahedron, itself included; 0 in the base mesh.
    Depth,
    /// The block of the file that holds that update, counted from 1; 0 in the base mesh.
    Block,
    /// 1 where a finer mesh was asked for and the data has not arrived, else 0: see
    /// [`Front::missing_tets`](crate::refine::Front::missing_tets).
    Missing,
    /// The number of its region in [`Session::regions`], counted from 0; 0 without regions.
    Region,
}

impl TetQuantity {
    /// All quantities.
    pub const ALL: [Self; 6] =
        [Self::Size, Self::Error, Self::Depth, Self::Block, Self::Missing, Self::Region];

    /// The quantity in one word: `size`, `error`, `depth`, `block`, `missing` or `region`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Size => "size",
            Self::Error => "error",
            Self::Depth => "depth",
            Self::Block => "block",
            Self::Missing => "missing",
            Self::Region => "region",
        }
    }

    /// The quantity with this name; none if there is none.
    ///
    /// ```
    /// use tetralod::session::TetQuantity;
    ///
    /// assert_eq!(TetQuantity::named("depth"), Some(TetQuantity::Depth));
    /// assert_eq!(TetQuantity::named("Depth"), None);
    /// ```
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| quantity.name() == name)
    }
}

impl fmt::Display for TetQuantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Session {
    /// A number for each tetrahedron of [`Session::view`], in its order.
    ///
    /// Costs a pass over the mesh; [`TetQuantity::Depth`] as much as refining the mesh from the base mesh,
    /// whenever it has updates for which that has not been done before.
    ///
    /// # Errors
    /// If nothing has arrived yet; for [`TetQuantity::Depth`] also if the MT is damaged.
    ///
    /// ```
    /// use tetralod::session::{Session, SessionError, TetQuantity};
    ///
    /// let mut session = Session::new();
    /// assert_eq!(session.tet_quantity(TetQuantity::Size), Err(SessionError::NotReady));
    /// ```
    pub fn tet_quantity(&mut self, quantity: TetQuantity) -> Result<Vec<f64>, SessionError> {
        let mut values = Vec::new();
        self.tet_quantity_into(quantity, &mut values)?;
        Ok(values)
    }

    /// [`Session::tet_quantity`], into memory that is used again; what was in there is gone.
    ///
    /// # Errors
    /// As that; `values` is empty then.
    pub fn tet_quantity_into(
        &mut self,
        quantity: TetQuantity,
        values: &mut Vec<f64>,
    ) -> Result<(), SessionError> {
        values.clear();
        self.catch_up();
        let (Some(front), Some(mt)) = (&self.front, self.decoder.mt()) else {
            return Err(SessionError::NotReady);
        };
        match quantity {
            TetQuantity::Size => values.extend(sizes(mt, front.mesh())),
            TetQuantity::Error => values.extend(front.tet_errors(mt).iter().map(|e| e.error())),
            TetQuantity::Missing => {
                values.extend(front.missing_tets(mt).iter().map(|&missing| f64::from(u8::from(missing))));
            }
            TetQuantity::Region if front.mesh().regions().is_empty() => {
                values.resize(front.mesh().tets().len(), 0.0);
            }
            TetQuantity::Region => values.extend(front.mesh().regions().iter().map(|&r| f64::from(r))),
            TetQuantity::Block => {
                let bits = self.decoder.index().map_or(mt.page_bits(), |index| index.block_bits);
                values.extend(blocks(mt, front, bits));
            }
            TetQuantity::Depth => {
                self.depths.learn(mt, front).map_err(damaged)?;
                let tets = 0..front.mesh().tets().len() as u32;
                values.extend(tets.map(|t| self.depths.get(mt.creator(front.mesh(), t)) as f64));
            }
        }
        if let Some((cut, _)) = &self.shown.cut {
            *values = cut.of_tets(values);
        }
        Ok(())
    }
}

fn damaged(error: ReplayError) -> SessionError {
    SessionError::Format(match error {
        ReplayError::Base(error) => FormatError::Base(error),
        ReplayError::Update(error) => FormatError::from(error),
    })
}

fn sizes<'a>(mt: &'a Mt, mesh: &'a CurrentMesh) -> impl Iterator<Item = f64> + 'a {
    let lattice = &mt.info().lattice;
    mesh.tets().iter().map(|tet| size(lattice, mesh, *tet))
}

/// The length of the longest edge of a tetrahedron, in model units.
pub(super) fn size(lattice: &Lattice, mesh: &CurrentMesh, tet: [u32; 4]) -> f64 {
    let corners = tet.map(|slot| mesh.positions()[slot as usize]);
    let squared = |[a, b]: [usize; 2]| {
        let along = |i: usize| f64::from(corners[b][i] - corners[a][i]) * lattice.step[i];
        (0..3).map(|i| along(i) * along(i)).sum::<f64>()
    };
    EDGES.map(squared).into_iter().fold(0.0, f64::max).sqrt()
}

fn blocks<'a>(mt: &'a Mt, front: &'a Front, bits: u32) -> impl Iterator<Item = f64> + 'a {
    let mesh = front.mesh();
    let block = move |t: u32| mt.creator(mesh, t).map_or(0.0, |u| ((u.0 >> bits) + 1) as f64);
    (0..mesh.tets().len() as u32).map(block)
}
