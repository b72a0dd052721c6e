//! The mesh: every star is found by looking at all tetrahedra.

use super::File;
use super::growth::volume;
use super::splits::Split;
use std::collections::{BTreeSet, HashMap};

#[derive(Clone, Default)]
pub struct Mesh {
    pub positions: HashMap<u32, [i32; 3]>,
    pub levels: HashMap<u32, Vec<i32>>,
    pub tets: Vec<[u32; 4]>,
    /// Which update splits a vertex of the MT.
    pub split_by: HashMap<u32, u32>,
}

/// A tetrahedron of a star: where it is among all, and the places of its link vertices in ascending order.
struct Corner {
    tet: usize,
    link: [usize; 3],
}

impl Corner {
    /// Whether the two have a face at the centre in common.
    fn is_beside(&self, other: &Self) -> bool {
        self.link.iter().filter(|place| other.link.contains(place)).count() == 2
    }
}

impl Mesh {
    /// The base mesh.
    pub fn new(file: &File) -> Self {
        let vertices = 0..file.base.positions.len() as u32;
        Self {
            positions: vertices.clone().zip(file.base.positions.iter().copied()).collect(),
            levels: vertices
                .map(|v| (v, file.base_levels.iter().map(|levels| levels[v as usize]).collect()))
                .collect(),
            tets: file.base.tets.clone(),
            split_by: file.splits.iter().map(|(&k, split)| (split.vertex, k)).collect(),
        }
    }

    fn neighbors(&self, v: u32) -> BTreeSet<u32> {
        self.tets.iter().filter(|tet| tet.contains(&v)).flatten().copied().filter(|&w| w != v).collect()
    }

    /// Whether update `k` can be applied.
    pub fn is_feasible(&self, k: u32, split: &Split) -> bool {
        let comes_before = |w: &u32| self.split_by.get(w).is_some_and(|&other| other < k);
        self.positions.contains_key(&split.vertex) && !self.neighbors(split.vertex).iter().any(comes_before)
    }

    /// Applies update `k`; gives the tetrahedra that it removes and inserts. The vertex that it splits can still be looked at.
    pub fn split(&mut self, file: &File, k: u32) -> [Vec<[u32; 4]>; 2] {
        let split = &file.splits[&k];
        assert!(self.is_feasible(k, split));
        let v = split.vertex;
        let link: Vec<u32> = self.neighbors(v).into_iter().collect();
        let star: Vec<Corner> = (0..self.tets.len())
            .filter(|&t| self.tets[t].contains(&v))
            .map(|t| {
                let others: Vec<u32> = self.tets[t].iter().copied().filter(|&w| w != v).collect();
                let mut places =
                    [0, 1, 2].map(|i| link.iter().position(|&w| w == others[i]).expect("a place"));
                places.sort_unstable();
                Corner { tet: t, link: places }
            })
            .collect();
        assert!(star.len() <= 64 && link.len() <= 32);
        let offset = self.offset(split, &star, &link);
        let guess = Guess::new(self, v, &link, offset);
        let sides = guess.sides(&star, split.mask);
        let (near, far) =
            (file.base.positions.len() as u32 + 2 * k, file.base.positions.len() as u32 + 2 * k + 1);
        let levels = &self.levels[&v];
        let offsets: Vec<i32> = (0..file.info.fields.len())
            .map(|f| guess.level(self, v, &link, f, file.info.fields[f].bits) + split.residuals[f])
            .collect();
        let far_levels: Vec<i32> = levels.iter().zip(&offsets).map(|(level, d)| level - (d >> 1)).collect();
        let near_levels: Vec<i32> = far_levels.iter().zip(&offsets).map(|(level, d)| level + d).collect();
        for levels in [&near_levels, &far_levels] {
            assert!(
                levels.iter().zip(&file.info.fields).all(|(&q, field)| (0..1 << field.bits).contains(&q))
            );
        }
        let far_position = [0, 1, 2].map(|i| self.positions[&v][i] - (offset[i] >> 1));
        let near_position = [0, 1, 2].map(|i| far_position[i] + offset[i]);
        for position in [near_position, far_position] {
            assert!(position.iter().all(|q| (0..=1 << file.info.bits).contains(q)));
        }
        self.levels.extend([(near, near_levels), (far, far_levels)]);
        self.positions.extend([(near, near_position), (far, far_position)]);
        let (mut removed, mut inserted) = (Vec::new(), Vec::new());
        for (corner, &side) in star.iter().zip(&sides) {
            let tet = self.tets[corner.tet];
            removed.push(tet);
            inserted.push(tet.map(|w| if w == v { [near, far][side] } else { w }));
        }
        let on_side = |side| {
            star.iter().zip(&sides).filter(move |(_, other)| **other == side).map(|(corner, _)| corner)
        };
        for a in on_side(0) {
            for b in on_side(1).filter(|b| a.is_beside(b)) {
                if let Some(&apex) = a.link.iter().find(|place| !b.link.contains(place)) {
                    let tet = self.tets[a.tet];
                    inserted.push(tet.map(|w| {
                        if w == v {
                            far
                        } else if w == link[apex] {
                            near
                        } else {
                            w
                        }
                    }));
                }
            }
        }
        assert!(inserted.len() > removed.len());
        self.tets.retain(|tet| !tet.contains(&v));
        self.tets.extend(&inserted);
        for tet in &inserted {
            assert!(volume(tet.map(|w| self.positions[&w])) > 0, "update {k} turns {tet:?} inside out");
        }
        [removed, inserted]
    }

    /// The offset of a split, with the step along the edge that it is counted from.
    fn offset(&self, split: &Split, star: &[Corner], link: &[u32]) -> [i32; 3] {
        if split.edge == 0 {
            return split.offset;
        }
        let mut edges: Vec<[usize; 2]> = star
            .iter()
            .flat_map(|corner| {
                let [i, j, l] = corner.link;
                [[j, i], [l, i], [l, j]]
            })
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges.reverse();
        let [m, i] = edges[split.edge as usize - 1].map(|place| self.positions[&link[place]]);
        let step = [0, 1, 2].map(|k| m[k] - i[k]);
        let step = if step < [0, 0, 0] { step.map(|d| -d) } else { step };
        [0, 1, 2].map(|k| split.offset[k] + step[k])
    }

    /// Forgets a vertex that has been split.
    pub fn forget(&mut self, v: u32) {
        self.positions.remove(&v);
        self.levels.remove(&v);
    }
}

/// What the star of a vertex tells.
struct Guess {
    offset: [i32; 3],
    spokes: Vec<[f64; 3]>,
    q: Vec<f64>,
    along: Vec<f64>,
}

impl Guess {
    fn new(mesh: &Mesh, v: u32, link: &[u32], offset: [i32; 3]) -> Self {
        let centre = mesh.positions[&v];
        let mut guess = Self { offset, spokes: Vec::new(), q: Vec::new(), along: Vec::new() };
        for w in link {
            let p = [0, 1, 2].map(|k| i128::from(mesh.positions[w][k]) - i128::from(centre[k]));
            let square: i128 = p.iter().map(|x| x * x).sum();
            let product: i128 = p.iter().zip(offset).map(|(x, d)| x * i128::from(d)).sum();
            let q = square.max(1) as f64;
            guess.spokes.push(p.map(|x| x as f64));
            guess.q.push(q);
            guess.along.push(product as f64 / q.sqrt());
        }
        guess
    }

    fn sides(&self, star: &[Corner], mask: u64) -> Vec<usize> {
        let t = |corner: &Corner| {
            let [i, j, l] = corner.link;
            (self.along[i] + self.along[j]) + self.along[l]
        };
        let certain = |corner: &Corner| (t(corner).abs() as f32).to_bits() >> 15;
        let mut order: Vec<usize> = (0..star.len()).collect();
        order.sort_by_key(|&i| (certain(&star[i]), star[i].link));
        assert!(star.len() == 64 || mask >> star.len() == 0);
        let mut sides: Vec<Option<usize>> = vec![None; star.len()];
        for place in (0..star.len()).rev() {
            let own = &star[order[place]];
            let mut votes = [0, 0];
            for (other, side) in star.iter().zip(&sides) {
                if let Some(side) = side.filter(|_| own.is_beside(other)) {
                    votes[side] += 1;
                }
            }
            let guess = match votes[1].cmp(&votes[0]) {
                std::cmp::Ordering::Greater => 1,
                std::cmp::Ordering::Less => 0,
                std::cmp::Ordering::Equal => usize::from(t(own) < 0.0),
            };
            sides[order[place]] = Some(guess ^ (mask >> place & 1) as usize);
        }
        sides.into_iter().flatten().collect()
    }

    fn weights(&self) -> Vec<f64> {
        let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz] = [0.0; 6];
        for ([x, y, z], q) in self.spokes.iter().zip(&self.q) {
            let w = 1.0 / q;
            xx += w * (x * x);
            xy += w * (x * y);
            xz += w * (x * z);
            yy += w * (y * y);
            yz += w * (y * z);
            zz += w * (z * z);
        }
        let a = [
            [yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy],
            [xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz],
            [xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy],
        ];
        let det = (xx * a[0][0] + xy * a[0][1]) + xz * a[0][2];
        if det > 1e-6 {
            let d = self.offset.map(f64::from);
            let s = a.map(|row| ((row[0] * d[0] + row[1] * d[1]) + row[2] * d[2]) / det);
            let weight = |([x, y, z], q): (&[f64; 3], &f64)| ((x * s[0] + y * s[1]) + z * s[2]) / q;
            self.spokes.iter().zip(&self.q).map(weight).collect()
        } else {
            vec![0.0; self.spokes.len()]
        }
    }

    fn level(&self, mesh: &Mesh, v: u32, link: &[u32], field: usize, bits: u32) -> i32 {
        let mut sum = 0.0;
        for (w, weight) in link.iter().zip(self.weights()) {
            sum += weight * f64::from(mesh.levels[w][field] - mesh.levels[&v][field]);
        }
        let most = f64::from(1 << bits);
        sum.trunc().clamp(-most, most) as i32
    }
}
