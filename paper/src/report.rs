//! The page: every number of ours in it is computed, so its words follow the numbers wherever these may change.

use crate::figure8::Curves;
use crate::figures::Pair;
use crate::findings::{Findings, Scan};
use crate::markdown::{count, fewer, percent};
use crate::model::Recipe;
use crate::own::Own;
use crate::{figures, node_table, own, published, table1};
use tetralod::mt::MOST_TRIES;

pub fn page(all: &Findings) -> String {
    let parts = [INTRODUCTION.to_owned(), table_1(all), figure_6(all), figure_7(all), figure_8(all)];
    parts.into_iter().chain(all.scan.as_ref().map(scan)).collect::<Vec<_>>().join("\n")
}

const INTRODUCTION: &str = "\
# The paper's experiments, done again

*Written by `cargo xtask paper`: change the command, not this page.*

The paper is E. Danovaro, L. De Floriani, P. Magillo, E. Puppo, *Data Structures for 3D Multi-Tessellations: an \
Overview* (2003); what follows is its section 6. Its numbers are set in *italics*. \
Everything else is computed by the command, from the library as it is, and is the same on every run and machine (but for the pictures, which depend on the GPU).

What differs from the paper before anything is built:

- **The field.** The paper's Smallbucky is a part of AVS's Bucky Ball, which we do not have. `tetralod generate bucky \
--size 33` makes a field of the same kind on a grid of as many points: a sum of Gaussians at the 60 atoms of C60. It is \
exactly symmetric, smooth, and almost zero far from the atoms. `bucky.vti` has 32³ samples of the same molecule, in \
8 bits.
- **The order of things** is the paper's: the vertex-based MT is made by inserting the points into a cube of six \
tetrahedra, the worst point first, and the edge-based MT by collapsing edges of the mesh that this ends with. To this \
we add vertex-based MTs made by decimation of that same mesh, by the Delaunay and by the half-edge criterion (the \
paper's section 2.2 has them, its section 6 does not). `.vtu` files have a mesh, so nothing is inserted there. The rows of a grid of 9³ points \
are made again by a test, which compares them with this page.
- **The error** of a tetrahedron is the largest deviation at the reference vertices in it, as a fraction of the \
field's range. An update's error is at least that of every update that depends on it, so a request's mesh keeps its \
error *by construction*, whatever else is applied; where an update's values overshoot those around it, that is added, \
so that requests by isovalue miss nothing. The paper does not say how it assigns errors to updates.
- **The tetrahedron's own error.** The MT *vertex, insertion, own errors* (`--tet-errors`) has the same updates as *vertex, \
insertion*. It keeps two bits for each tetrahedron and eight for each update besides, which say how far the tetrahedron's own \
error is below that of the update that removes it. A request then compares the tetrahedron's, and takes the least set of updates \
that it leads to from the base mesh: what violates forces the update that removes it, with its parents. The guarantee is the same, \
since it is the tetrahedra of the mesh that have to be within the error.
- **Limits.** The paper allows 32 vertices around a new vertex, we 64 in vertex-based MTs: insertion is not free in its choice of stars.
- **Lattices.** Positions and fields are integers of 16 bits or more, not floats of 32.
";

fn table_1(all: &Findings) -> String {
    format!(
        "\
## Table 1: storage

Bytes of the explicit structure, counted as the paper counts (4 bytes a coordinate, value and index, 1 a counter), and \
of the compact one, as this program really holds it in memory, base mesh and errors included. The factors compare with \
the reference mesh, indexed and indexed with adjacency, and with the explicit structure. The last column is the size of \
the MT file. All factors, the paper's too, are worked out from the bytes: the paper prints *5.7* where its own bytes \
make 5.3.

Rows with *nodes of §5* are the same MTs in memory with the paper's node code (`VertexTreeMt`); files have our nodes.

{}
n is the number of vertices of the reference mesh, m that of all tetrahedra of the MT. Shape bits are those that \
describe T_u, where it is, and what removes the tetrahedra of the star.

{}
{}
### Section 5's node code beside ours

{}
{}",
        table1::storage(&all.rows, &all.missing),
        table1::structure(&all.rows, &all.missing),
        about_table_1(all),
        about_node_code(all),
        node_table::table(&all.rows)
    )
}

/// What the table of node codes is of, and which code is smaller.
fn about_node_code(all: &Findings) -> String {
    // With the bits that our code takes for the same nodes, removers among them.
    let codes = || all.rows.iter().filter_map(|row| Some((row.codes.as_ref()?, row.shape_bits?)));
    format!(
        "\
Both are structures of the library behind one trait, with the same loops, vertices and errors. All bits are measured, and are those of a node.

- **The paper's**: a boundary face f_u, in 12 bits, and the stream of a depth-first traversal, in 6 p − q + 1. The paper has a limit of 32 \
neighbours, and does not say how 12 bits are divided; here five of them are the place of t_u in the star that the first parent in the loop made, \
two are f_u's in t_u, five are the place of t_0 in the new star. The limit of 64 makes them 14. A place of 32 or more is no obstacle as \
long as one face f_u has two smaller ones.
- **Ours** names, face by face, the vertex behind it, by its place in the order in which spheres reach them, where that takes fewer bits. The \
bits that fill up a node are counted here, and not in the paper's.
- **Removers** are what both have besides: which child removes each tetrahedron of the star. The paper refines nodes and does not need \
that; requests here start from tetrahedra. With it, our structure finds T_u without a seed. The paper's finds it by f_u and the stream alone.
- **Exceptions** are what the paper's nodes cannot say, in a list beside them, as three counts: no f_u fits; faces on the boundary are given up that the \
new vertex is in front of; the stream alone leads to other tetrahedra in Π_u than those of T_u, or to none in {tries} attempts.

With removers, as requests need them, ours takes fewer bits for {with} of {total} MTs. In a structure that only refines nodes, the paper's would do \
without them, and ours would not: then the paper's takes fewer for {without}.
",
        tries = count(MOST_TRIES),
        with = codes().filter(|(codes, ours)| *ours <= codes.of_the_paper().code_bits + codes.remover_bits).count(),
        without = codes().filter(|(codes, ours)| *ours > codes.of_the_paper().code_bits).count(),
        total = codes().count(),
    )
}

fn about_table_1(all: &Findings) -> String {
    let Some(row) = all.rows.iter().find(|row| row.recipe == Recipe::Insert) else { return String::new() };
    let one = |x: f64| format!("{x:.1}");
    let told = |recipe: Recipe, what: &dyn Fn(&table1::Row) -> String| {
        all.rows.iter().find(|row| row.recipe == recipe).map_or(String::new(), what)
    };
    let bytes = |r: &table1::Row| one(r.stats.compact_bytes as f64 / f64::from(r.stats.vertices));
    let by_formula = |r: &table1::Row| {
        count(table1::bytes_by_the_paper(u64::from(r.stats.vertices), r.stats.mt_tetrahedra))
    };
    format!(
        "\
What differs, and why:

- *{paper_tets} against {tets} tetrahedra.* On a grid all eight corners of a cell lie on one sphere, and Delaunay \
leaves open how it is split. We break such ties by a fixed rule that gives every cell six tetrahedra; the paper's \
mesh must have cells of five among them.
- *{bytes} bytes a vertex* in the inserted compact MT, against the paper's 56: node numbers, positions and values are as \
wide as they need to be, not 4 bytes each, which more than pays for shapes. *{half} bytes* for half-edge decimation.
- *{inserted} tetrahedra in u+* of the inserted MT, the paper's 16. What u+ inserts is the star of a vertex, and the \
mean star of the reference mesh has {star}; insertion does not choose by size, decimation does ({half_inserted} for \
half-edges).
- *{bits} bits a node* for shapes of the inserted MT, the paper's 69: our T_u are larger ({removed} tetrahedra, the \
paper's 12), and both structures here also tell which tetrahedra of the star belong to which child, so that every tetrahedron of a \
mesh knows what removes it ({remover_bits} bits of these). Half-edge decimation, with {half_removed}, takes {half_bits}. \
The section below has the parts.
- *Edge-based: {edge_inserted} tetrahedra in u+*, the paper's 27. With six tetrahedra a cell, an inner vertex has 24 around \
it, and the very first collapse of an inner edge joins two such stars: more than 40 tetrahedra. The paper does not say \
how it orders its collapses; ours go by the exact error.
- *The explicit structure.* The paper's formula, 24 n + 28 m, has about as many arcs as tetrahedra; we count the arcs \
there are. By the formula ours would be {edge_formula} (edge) and {insert_formula} (inserted) bytes. The paper's bytes \
for its vertex-based MT are fewer, too, than its formula gives for 16 tetrahedra an update: {paper_formula}.
",
        paper_tets = count(published::TETRAHEDRA),
        tets = count(row.stats.tetrahedra),
        bytes = bytes(row),
        half = told(Recipe::HalfEdge, &bytes),
        bits = row.shape_bits.map_or(String::new(), |bits| one(row.per_node(bits))),
        remover_bits =
            row.codes.as_ref().map_or(String::new(), |codes| one(row.per_node(codes.remover_bits))),
        removed = one(row.stats.removed_per_update()),
        inserted = one(row.stats.inserted_per_update()),
        star = one(4.0 * f64::from(row.stats.tetrahedra) / f64::from(row.stats.vertices)),
        half_inserted = told(Recipe::HalfEdge, &|r| one(r.stats.inserted_per_update())),
        half_removed = told(Recipe::HalfEdge, &|r| one(r.stats.removed_per_update())),
        half_bits =
            told(Recipe::HalfEdge, &|r| r.shape_bits.map_or(String::new(), |bits| one(r.per_node(bits)))),
        edge_inserted = told(Recipe::Edge, &|r| one(r.stats.inserted_per_update())),
        edge_formula = told(Recipe::Edge, &by_formula),
        insert_formula = by_formula(row),
        paper_formula = count(table1::bytes_by_the_paper(published::VERTICES, 16 * published::VERTICES)),
    )
}

fn figure_6(all: &Findings) -> String {
    let pair = &all.figure_6;
    let same = if pair.same_surface() {
        "The two isosurfaces are the same, triangle for triangle, so one picture shows both."
    } else {
        "The two isosurfaces differ where the field only comes near the isovalue."
    };
    format!(
        "\
## Figure 6: around an isovalue

Inserted vertex-based MT, error 0.1 %: everywhere, and only where the field passes the isovalue. The paper's isovalue, \
105,000, means nothing for our field. Ours is {}: of all multiples of 0.01 the one whose isosurface on the uniform mesh \
has most nearly as many facets as the paper's.

{}
{same}

{}",
        pair.isovalue,
        pair.table(&published::FIGURE_6),
        pictures(pair, 6, "behind a plane through the middle")
    )
}

fn figure_7(all: &Findings) -> String {
    let pair = &all.figure_7;
    let roi = pair.roi.map_or(String::new(), |roi| {
        let side = |i: usize| format!("[{}, {}]", roi.min[i], roi.max[i]);
        format!("{} × {} × {}", side(0), side(1), side(2))
    });
    let ratio = pair.variable.tetrahedra() as f64 / pair.uniform.tetrahedra().max(1) as f64;
    let paper = published::FIGURE_7.variable_tets as f64 / published::FIGURE_7.uniform_tets as f64;
    format!(
        "\
## Figure 7: in a box

Edge-based MT, error 0: everywhere, and only in a box. The paper does not say which. Ours is the octant nearest to \
the eye, {roi}.

{}
{}
Two things differ:

- *At error 0 the paper's uniform mesh has {paper_tets} tetrahedra, not all {paper_all}.* The updates that are left out \
have no error. Here error 0 means the reference mesh, every update applied. Beside it, a mesh that is exact at all \
reference vertices, up to the rounding to lattices:

{zero}
- *Boxes cost more here:* the octant needs {ratio:.2} of the uniform mesh, the paper's box {paper:.2} of its own. \
Other boxes and other MTs, among them boxes in the middle of the domain, as wide as this part of it:

{}
In brackets, the part of the mesh that is fine everywhere. The octant holds an eighth of the reference mesh; what comes \
on top lies outside. Some of it are large tetrahedra that reach into the box and have to go; the rest was forced, by updates \
that depend on updates further out, in chains as long as Table 1 says (depth). MTs with smaller updates and shorter \
chains suffer less. This is a shortfall, not a difference of data.
",
        pair.table(&published::FIGURE_7),
        pictures(pair, 7, "behind a plane through the middle of the box"),
        figures::box_table(&all.boxes),
        zero = figures::zero_table(&all.at_zero),
        paper_tets = count(published::FIGURE_7.uniform_tets),
        paper_all = count(published::TETRAHEDRA),
    )
}

/// The pictures of a figure, side by side.
fn pictures(pair: &Pair, figure: u32, place: &str) -> String {
    let picture = |mesh: &str, what: &str, words: &str| {
        format!("![{words}, {mesh} resolution](paper/figure-{figure}-{mesh}-{what}.png)")
    };
    let mesh = |mesh: &str| picture(mesh, "mesh", "tetrahedra");
    let surface = |mesh: &str| picture(mesh, "surface", "isosurface");
    let variable = if pair.same_surface() { String::new() } else { surface("variable") };
    format!(
        "| uniform | variable |\n| --- | --- |\n| {} | {variable} |\n| {} | {} |\n\nAbove, the isosurface with the \
         edges of its facets; below, the tetrahedra {place}, coloured by the field.\n",
        surface("uniform"),
        mesh("uniform"),
        mesh("variable")
    )
}

fn figure_8(all: &Findings) -> String {
    format!(
        "\
## Figure 8: size against error

Tetrahedra of extracted meshes, and in brackets their part of the reference mesh. The paper plots two curves and \
prints no numbers for them; what it does print, in the captions of Figures 6 and 7, are the diamonds. The last column \
compares with the edge-based MT: the mean over all errors but 0.

![uniform LOD](paper/figure-8-uniform.svg)

{}
![variable LOD](paper/figure-8-variable.svg)

{}
{}",
        all.uniform.table(),
        all.variable.table(),
        about_figure_8(all)
    )
}

fn about_figure_8(all: &Findings) -> String {
    let against_edge =
        |curves: &Curves, recipe| curves.saved(recipe, Recipe::Edge).map_or(String::new(), fewer);
    let both = |recipe| {
        format!(
            "{} (uniform) and {} (variable)",
            against_edge(&all.uniform, recipe),
            against_edge(&all.variable, recipe)
        )
    };
    let [paper_uniform, paper_variable] = published::FIGURE_8_SAVED.map(fewer);
    format!(
        "\
The paper finds that its vertex-based MT needs {paper_uniform} (uniform) and {paper_variable} (variable) than its \
edge-based one. Here, compared with the edge-based MT of the same reference mesh:

- decimation by half-edge collapse needs {half};
- decimation by the Delaunay criterion needs {delaunay};
- insertion needs {insert};
- insertion with errors of the tetrahedra's own needs {own}.

E. Danovaro et al., *The half-edge tree: a compact data structure for level-of-detail tetrahedral meshes* (Shape Modeling \
International 2005), have {literature} by half-edge collapses than by general edge collapses, on average; our edge collapses \
put the new vertex at the midpoint, as the paper's do.

{why}",
        half = both(Recipe::HalfEdge),
        delaunay = both(Recipe::Delaunay),
        insert = both(Recipe::Insert),
        own = both(Recipe::InsertOwn),
        literature = fewer(published::HALF_EDGE_SAVED),
        why = why(&all.own),
    )
}

/// Why the MT by insertion has the sizes that it has.
fn why(all: &[Own]) -> String {
    let of = |recipe| all.iter().find(|own| own.recipe == recipe);
    let (Some(insert), Some(half)) = (of(Recipe::Insert), of(Recipe::HalfEdge)) else { return String::new() };
    let &[needed, for_others] = &insert.needed[0];
    let &[half_needed, half_for_others] = &half.needed[0];
    format!(
        "\
**Why insertion behaves as it does.** Greedy insertion looks for the worst point and inserts it; what the new \
tetrahedra are like, it does not ask. {worse} of its {updates} insertions make a tetrahedron that is worse than every \
one they remove. Some later insertion mends it, and that one is needed at every error below the damage; by the promise \
above so is everything it depends on. At {at}, {needed} insertions are needed, of which {own} remove a tetrahedron \
that is worse than that; the other {for_others} are there only because others depend on them (or for what overshoots). With half-edge \
decimation these are {half_for_others} of {half_needed}, since decimation chooses by the error of what it leaves behind.

{table}
Errors of less than a level of the field count as none here. So the paper's order, vertex before edge, holds for the decimated \
vertex-based MTs; for an inserted one it depends on how errors are assigned. With errors of the tetrahedra's own the same updates come near to \
the edge-based MT; at large errors two bits are too few to tell them well. The single numbers that the \
paper does print for its inserted MT (at 0.1 %) are near to ours.
",
        worse = count(insert.worse),
        updates = count(insert.updates),
        at = percent(own::AT[0]),
        needed = count(needed),
        own = count(needed - for_others),
        for_others = count(for_others),
        half_for_others = count(half_for_others),
        half_needed = count(half_needed),
        table = own::table(all),
    )
}

/// Figures 6 to 8 of a volume that was measured.
fn scan(scan: &Scan) -> String {
    format!(
        "\
## Figures 6 to 8 on `{name}`

The same on a measured volume, in 8 bits.

Figure 6, with isovalue {isovalue}, and Figure 7, in the octant:

{figure_6}
{figure_7}
What error 0 takes:

{zero}
Boxes, the octant and those in the middle:

{boxes}
Figure 8, uniform:

{uniform}
Figure 8, by field value:

{variable}",
        name = scan.name,
        isovalue = scan.figure_6.isovalue,
        figure_6 = scan.figure_6.table(&published::FIGURE_6),
        figure_7 = scan.figure_7.table(&published::FIGURE_7),
        zero = figures::zero_table(&scan.at_zero),
        boxes = figures::box_table(&scan.boxes),
        uniform = scan.uniform.table(),
        variable = scan.variable.table(),
    )
}
