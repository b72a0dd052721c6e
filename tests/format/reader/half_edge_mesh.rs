//! The mesh of a file of half-edge insertions. What an update removes is found by looking at all tetrahedra.

use super::change::{Change, Point, Tet};
use super::growth::volume;
use super::half_edge::{Child, Mark, Record};
use super::{File, half_edge_guess};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A tetrahedron of the mesh.
#[derive(Clone, Copy)]
pub struct Marked {
    pub tet: Tet,
    pub mark: Mark,
    /// 0 without regions.
    pub region: u16,
}

/// A vertex that has come, with the forest children that it can have.
#[derive(Clone)]
pub struct Vertex {
    pub position: Point,
    pub levels: Vec<i32>,
    /// By further region, then by field: those of fields that do not jump are `levels`.
    pub sides: BTreeMap<u16, Vec<i32>>,
    pub children: Vec<Child>,
}

impl Vertex {
    /// The levels in a region.
    pub fn levels_in(&self, region: u16) -> &[i32] {
        self.sides.get(&region).unwrap_or(&self.levels)
    }
}

pub struct Mesh<'a> {
    file: &'a File,
    pub vertices: HashMap<u32, Vertex>,
    pub tets: Vec<Marked>,
    /// Of the blocks that are here.
    records: HashMap<u32, Record>,
}

/// The other tetrahedron of a list with the face opposite a corner.
pub fn behind(tets: &[Tet], t: usize, corner: usize) -> Option<usize> {
    let is_of_face = |v: &u32| *v != tets[t][corner];
    (0..tets.len()).find(|&other| {
        other != t && tets[t].iter().filter(|v| is_of_face(v)).all(|v| tets[other].contains(v))
    })
}

impl<'a> Mesh<'a> {
    /// The base mesh.
    pub fn new(file: &'a File) -> Self {
        let forest = file.forest.as_ref().expect("a file of kind 3");
        let vertices = (0..).zip(&file.base.positions).zip(&forest.children);
        let vertices = vertices.map(|((v, &position), children)| {
            let levels: Vec<i32> = file.base_levels.iter().map(|levels| levels[v as usize]).collect();
            let mut sides: BTreeMap<u16, Vec<i32>> = BTreeMap::new();
            for (f, own) in file.base_sides.iter().enumerate() {
                for (&(_, region), &level) in own.range((v, 0)..=(v, u16::MAX)) {
                    sides.entry(region).or_insert_with(|| levels.clone())[f] = level;
                }
            }
            (v, Vertex { position, levels, sides, children: children.clone() })
        });
        let of = file.regions.as_ref().map(|regions| &regions.of_base);
        let tets = file.base.tets.iter().zip(&forest.marks).enumerate();
        let tets = tets.map(|(t, (&tet, &mark))| Marked { tet, mark, region: of.map_or(0, |of| of[t]) });
        Self { file, vertices: vertices.collect(), tets: tets.collect(), records: HashMap::new() }
    }

    pub fn add_block(&mut self, records: Vec<Record>) {
        self.records.extend(records.into_iter().map(|record| (record.update, record)));
    }

    /// Whether an update can be applied: its near vertex is there, and all that it removes.
    pub fn is_feasible(&self, k: u32) -> bool {
        self.records.contains_key(&k)
            && self.near(k).is_some()
            && self.taken(k).is_some_and(|taken| self.all_removed_by(k, &taken))
    }

    fn all_removed_by(&self, k: u32, taken: &[usize]) -> bool {
        taken.iter().all(|&t| self.tets[t].mark.remover == Some(k))
    }

    /// The vertex whose forest child an update is.
    fn near(&self, k: u32) -> Option<(u32, Point)> {
        let mut found = self.vertices.iter().filter_map(|(&v, vertex)| {
            let child = vertex.children.iter().find(|child| child.update == k)?;
            Some((v, [0, 1, 2].map(|axis| vertex.position[axis] + child.offset[axis])))
        });
        let near = found.next();
        assert!(found.next().is_none(), "two vertices have this child");
        near
    }

    /// What is reached through inner faces from a tetrahedron that an update removes.
    fn taken(&self, k: u32) -> Option<Vec<usize>> {
        let tets: Vec<Tet> = self.tets.iter().map(|marked| marked.tet).collect();
        let mut taken = vec![self.tets.iter().position(|marked| marked.mark.remover == Some(k))?];
        let mut next = 0;
        while next < taken.len() && self.all_removed_by(k, &taken) {
            let t = taken[next];
            next += 1;
            for corner in (0..4).filter(|&corner| self.tets[t].mark.inner[corner]) {
                taken.extend(behind(&tets, t, corner).filter(|other| !taken.contains(other)));
            }
        }
        Some(taken)
    }

    pub fn apply(&mut self, k: u32) -> Change {
        let (w, position) = self.near(k).expect("a near vertex");
        assert!(position.iter().all(|x| (0..=1 << self.file.info.bits).contains(x)));
        let taken = self.taken(k).expect("something to remove");
        assert!(self.all_removed_by(k, &taken) && taken.len() <= 128);
        let of_update = self.tets.iter().filter(|marked| marked.mark.remover == Some(k));
        assert_eq!(of_update.count(), taken.len(), "not all of what it removes hangs together");
        let removed: Vec<Marked> = taken.iter().map(|&t| self.tets[t]).collect();
        let v = self.file.base.positions.len() as u32 + k;
        let (star, regions) = star(&removed, w, v);
        let record = self.records[&k].clone();
        let (levels, sides) = self.levels(&removed, position, &record);
        let children = record.children.clone();
        let vertex = Vertex { position, levels: levels.clone(), sides, children };
        assert!(self.vertices.insert(v, vertex).is_none(), "applied twice");
        for tet in &star {
            assert!(volume(tet.map(|v| self.vertices[&v].position)) > 0, "{tet:?} is inside out");
        }
        let marks = half_edge_guess::marks(&self.vertices, &star, &record);
        self.tets.retain(|marked| marked.mark.remover != Some(k));
        let all = star.iter().zip(marks).zip(regions);
        self.tets.extend(all.map(|((&tet, mark), region)| Marked { tet, mark, region }));
        Change {
            errors: record.errors,
            positions: vec![position],
            levels: vec![levels],
            removed: removed.iter().map(|marked| marked.tet).collect(),
            inserted: star,
            own: None,
        }
    }

    /// The levels of the new vertex of an update, and those in further regions.
    fn levels(
        &self,
        removed: &[Marked],
        position: Point,
        record: &Record,
    ) -> (Vec<i32>, BTreeMap<u16, Vec<i32>>) {
        let around: BTreeSet<u32> = removed.iter().flat_map(|marked| marked.tet).collect();
        let regions: BTreeSet<u16> = removed.iter().map(|marked| marked.region).collect();
        let first = *regions.first().expect("a region");
        let square = |v: &u32| {
            let p = self.vertices[v].position;
            let d = [0, 1, 2].map(|axis| i128::from(p[axis]) - i128::from(position[axis]));
            d.iter().map(|x| x * x).sum::<i128>()
        };
        let largest = around.iter().map(square).max().unwrap_or(0).max(1);
        let weight = |v: &u32| 256 * largest / square(v).max(1);
        let predicted = |f: usize, region: u16| {
            let of_region = removed.iter().filter(|marked| marked.region == region);
            let own: BTreeSet<u32> = match self.file.jumps(f) {
                true => of_region.flat_map(|marked| marked.tet).collect(),
                false => around.clone(),
            };
            let all: i128 = own.iter().map(weight).sum();
            let level = |v: &u32| match self.file.jumps(f) {
                true => self.vertices[v].levels_in(region)[f],
                false => self.vertices[v].levels[f],
            };
            let sum: i128 = own.iter().map(|v| weight(v) * i128::from(level(v))).sum();
            (2 * sum + all).div_euclid(2 * all) as i32
        };
        let on_lattice = |f: usize, level: i32| {
            assert!((0..1 << self.file.info.fields[f].bits).contains(&level));
            level
        };
        let residuals = record.residuals.iter().enumerate();
        let levels: Vec<i32> =
            residuals.map(|(f, residual)| on_lattice(f, predicted(f, first) + residual)).collect();
        let mut counts = record.sides.iter().enumerate().filter(|(f, _)| self.file.jumps(*f));
        let count = counts.next().map_or(0, |(_, own)| own.len());
        assert!(counts.all(|(_, own)| own.len() == count), "fields that jump have as many");
        assert!(count == 0 || count == regions.len() - 1, "another number of regions");
        let further = regions.iter().skip(1).take(count).enumerate();
        let sides = further.map(|(i, &region)| {
            let level = |(f, own): (usize, &Vec<i32>)| match own.get(i) {
                Some(residual) => on_lattice(f, predicted(f, region) + residual),
                None => levels[f],
            };
            (region, record.sides.iter().enumerate().map(level).collect())
        });
        let sides = sides.collect();
        (levels, sides)
    }
}

/// The star of `v`, given what makes way for it, all of it at `w`; and the region of each tetrahedron.
fn star(removed: &[Marked], w: u32, v: u32) -> (Vec<Tet>, Vec<u16>) {
    let mut star: Vec<Tet> =
        removed.iter().map(|marked| marked.tet.map(|x| if x == w { v } else { x })).collect();
    let mut regions: Vec<u16> = removed.iter().map(|marked| marked.region).collect();
    let mut rim = Vec::new();
    for Marked { tet, mark, region } in removed {
        let near = tet.iter().position(|&x| x == w).expect("the near vertex");
        assert!(!mark.inner[near], "the face opposite the near vertex is inner");
        for corner in (0..4).filter(|&corner| tet[corner] != w && !mark.inner[corner]) {
            let mut added = *tet;
            added[corner] = v;
            rim.push(added.iter().copied().filter(|x| ![v, w].contains(x)).collect::<Vec<u32>>());
            star.push(added);
            regions.push(*region);
        }
    }
    assert!(star.len() <= 128 && goes_round_once(&rim), "{rim:?}");
    (star, regions)
}

/// Whether edges follow each other around once, or along one path.
fn goes_round_once(edges: &[Vec<u32>]) -> bool {
    let ends: BTreeSet<u32> = edges.iter().flatten().copied().collect();
    let at = |v: u32| edges.iter().filter(|edge| edge.contains(&v)).count();
    let mut reached: BTreeSet<u32> = edges.first().into_iter().flatten().copied().collect();
    for _ in edges {
        let met = edges.iter().filter(|edge| edge.iter().any(|v| reached.contains(v)));
        reached = met.flatten().copied().collect();
    }
    !edges.is_empty() && reached == ends && ends.iter().all(|&v| at(v) <= 2)
}
