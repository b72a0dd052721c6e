//! The data sets and their MTs, built as the paper built its own.

use anyhow::{Context, Result};
use std::path::Path;
use tetralod::mesh::{Field, Grid, TetMesh, repair};
use tetralod::mt::{CurrentMesh, Mt, MtInfo, MultiTessellation};
use tetralod::refine::Request;
use tetralod_build as builder;
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Purpose, VertexMethod};

use crate::query;

/// How an MT is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recipe {
    /// Midpoint edge collapses, cheapest first.
    Edge,
    /// Greedy insertion from a box of six tetrahedra: the paper's way for its vertex-based MT.
    Insert,
    /// Insertion with errors of the tetrahedra's own.
    InsertOwn,
    /// Vertices removed, cheapest first, and the hole filled by Delaunay tetrahedra.
    Delaunay,
    /// Vertices removed by moving them onto a neighbour.
    HalfEdge,
}

impl Recipe {
    #[cfg(test)]
    pub const ALL: [Self; 5] = [Self::Edge, Self::Insert, Self::InsertOwn, Self::Delaunay, Self::HalfEdge];

    /// Kind of MT and how it is made, in a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge, collapse",
            Self::Insert => "vertex, insertion",
            Self::InsertOwn => "vertex, insertion, own errors",
            Self::Delaunay => "vertex, decimation (Delaunay)",
            Self::HalfEdge => "vertex, decimation (half-edge)",
        }
    }

    fn config(self) -> BuildConfig {
        let decimated = |criterion| VertexMethod::Decimate { criterion, purpose: Purpose::Uniform };
        let construction = match self {
            Self::Edge => Construction::Edge,
            Self::Insert => Construction::Vertex(VertexMethod::Insert { tet_errors: false }),
            Self::InsertOwn => Construction::Vertex(VertexMethod::Insert { tet_errors: true }),
            Self::Delaunay => Construction::Vertex(decimated(BuildCriterion::Delaunay)),
            Self::HalfEdge => Construction::Vertex(decimated(BuildCriterion::HalfEdge)),
        };
        BuildConfig { construction, ..BuildConfig::default() }
    }
}

/// An MT and how it was made.
pub struct Model {
    pub recipe: Recipe,
    pub mt: Mt,
}

impl Model {
    pub fn build(recipe: Recipe, mesh: &TetMesh) -> Result<Self> {
        eprintln!("  {} ...", recipe.name());
        let built = builder::build(mesh, &recipe.config());
        Ok(Self { recipe, mt: built.with_context(|| recipe.name())?.mt })
    }
}

/// A data set with the MTs of one reference mesh.
pub struct DataSet {
    pub name: String,
    pub reference: TetMesh,
    pub models: Vec<Model>,
}

impl DataSet {
    /// The paper's way: points are inserted, and the mesh that this ends with is what the other MTs are made of.
    pub fn by_insertion(name: &str, points: &TetMesh, others: &[Recipe]) -> Result<Self> {
        eprintln!("{name}");
        let inserted = Model::build(Recipe::Insert, points)?;
        let reference = finest(&inserted.mt, points.grid)?;
        let mut models = vec![inserted];
        for &recipe in others {
            let mesh = if recipe == Recipe::InsertOwn { points } else { &reference };
            models.push(Model::build(recipe, mesh)?);
        }
        Ok(Self { name: name.to_owned(), reference, models })
    }

    /// A mesh that is there already.
    pub fn of_mesh(name: &str, mesh: TetMesh, recipes: &[Recipe]) -> Result<Self> {
        eprintln!("{name}");
        let models: Result<Vec<Model>> = recipes.iter().map(|&r| Model::build(r, &mesh)).collect();
        Ok(Self { name: name.to_owned(), models: models?, reference: mesh })
    }

    /// The MT that was made by a recipe of this data set.
    pub fn model(&self, recipe: Recipe) -> &Model {
        let found = self.models.iter().find(|model| model.recipe == recipe);
        found.expect("a recipe that the data set was made with")
    }
}

/// A mesh from a file, fit to be built on.
pub fn load(path: &Path) -> Result<TetMesh> {
    let mesh = tetralod_io::read(path)?;
    Ok(repair(mesh).with_context(|| path.display().to_string())?.0)
}

/// The reference mesh of an MT. `grid` is that of its points, if they are on one.
fn finest(mt: &Mt, grid: Option<Grid>) -> Result<TetMesh> {
    let front = query::front(mt, &Request::within(0.0))?;
    Ok(TetMesh { grid, ..in_model_units(mt.info(), front.mesh()) })
}

/// A current mesh as a mesh of its own.
fn in_model_units(info: &MtInfo, mesh: &CurrentMesh) -> TetMesh {
    let slots = 0..mesh.positions().len() as u32;
    let field = |(f, field): (usize, &tetralod::mt::FieldInfo)| {
        let values = slots.clone().map(|slot| field.value(mesh.levels(slot)[f])).collect();
        Field::new(field.name.clone(), values)
    };
    TetMesh {
        positions: mesh.positions().iter().map(|&q| info.lattice.point(q)).collect(),
        fields: info.fields.iter().enumerate().map(field).collect(),
        tets: mesh.tets().to_vec(),
        ..TetMesh::default()
    }
}
