//! Regions: parts of a volume, such as materials or the parts of an assembly, that every mesh of an MT keeps apart.
//!
//! Each tetrahedron of every mesh is of one region. A file states the regions of the base tetrahedra alone: all others follow. Where an
//! insertion puts its vertex `v` into a tetrahedron of T_u, in the place of the near vertex `n`, the tetrahedron keeps its region; one
//! that fills a gap beside it has the same region:
//!
//! ```text
//!      a ───── b                a ───── b
//!      │  A  ╱ │                │ ╲ A ╱ │       the gap at a face (n a) of T_u that stays lies where the tetrahedron of T_u
//!      │   ╱   │      u+        │A  v   │       was: along that face both are on the same side. So where interfaces stay
//!      │ ╱  B  │    ─────▶      │  ╱ ╲ B│       the same sets of points, it can have no other region. A builder that moves
//!      n ───── c                n ───── c       interfaces must only move them so that this holds.
//! ```
//!
//! So the regions of all that depends on an update are among those of what it removes.

use super::CurrentMesh;
use crate::geom::orient3d;
use crate::mesh::{NONE, REGION_COLORS};
use std::collections::{BTreeSet, HashMap};

/// A region of the volume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegionInfo {
    /// The name that the input has for it, or its labels as text. No two regions have the same one.
    pub name: String,
    /// The whole number that each of [`Regions::arrays`] has in its cells.
    pub labels: Vec<i64>,
    /// Its place in a palette of distinct colours, counted from 0: regions that touch each other have different ones.
    pub color: u8,
    /// Its tetrahedra in the reference mesh.
    pub tetrahedra: u64,
    /// Its volume in the reference mesh, in cubed model units.
    pub volume: f64,
    /// The box around it there: its least and its largest corner, on the lattice.
    pub bounds: [[i32; 3]; 2],
}

/// The regions of an MT.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Regions {
    /// The arrays of the input that tell them apart.
    pub arrays: Vec<String>,
    /// The regions, in ascending order of their labels: at most 65,536, and at least one.
    pub all: Vec<RegionInfo>,
    /// The region of each base tetrahedron, as an index into `all`.
    pub of_base: Vec<u16>,
    /// How far interfaces between regions are from those of the reference mesh in any mesh, in model units: 0 if they are the same sets of points.
    pub deviation: f64,
    /// The values of vertices at which several regions meet.
    pub sides: BaseSides,
}

/// Which fields jump where regions meet, and the levels of the base vertices there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BaseSides {
    /// For each field of the MT whether a vertex has a value for each region that it is in; empty if no field jumps.
    pub jumps: Vec<bool>,
    /// The levels of base vertices in each of their regions but the first: vertex by vertex, the regions ascending, field by field.
    pub levels: Vec<i32>,
}

/// Most regions of an MT.
pub const MAX_REGIONS: usize = 1 << 16;

/// The numbers of the regions that are meant by names or, in digits, by labels where a single array tells regions apart.
///
/// # Errors
/// The place in the list of the first name that no region has, and the problem in words.
pub fn numbers_of(regions: Option<&Regions>, names: &[String]) -> Result<Vec<u16>, (usize, String)> {
    let all = regions.map_or(&[][..], |regions| &regions.all);
    // Of several of one name or label the first.
    let numbered = || (0..=u16::MAX).zip(all).rev();
    let by_name: HashMap<&str, u16> = numbered().map(|(number, region)| (&*region.name, number)).collect();
    let by_label: HashMap<&[i64], u16> =
        numbered().map(|(number, region)| (&*region.labels, number)).collect();
    let find = |(place, name): (usize, &String)| {
        let label = || name.parse::<i64>().ok().and_then(|label| by_label.get(&[label][..]));
        by_name.get(&**name).or_else(label).copied().ok_or_else(|| (place, unknown(name, all)))
    };
    names.iter().enumerate().map(find).collect()
}

/// Most names that a message lists.
const LISTED: usize = 24;

fn unknown(name: &str, all: &[RegionInfo]) -> String {
    if all.is_empty() {
        return format!("there is no region {name}: the volume is not parted");
    }
    let listed: Vec<&str> = all.iter().take(LISTED).map(|region| &*region.name).collect();
    let more = all.len() - listed.len();
    let more = if more > 0 { format!(" and {more} others") } else { String::new() };
    format!("there is no region {name}, only {}{more}", listed.join(", "))
}

impl Regions {
    /// Whether vertices may have a value for each region, in some field.
    #[doc(hidden)]
    pub fn has_sides(&self) -> bool {
        !self.sides.jumps.is_empty()
    }

    /// The colour of each: its place in the palette.
    pub fn colors(&self) -> Vec<u8> {
        self.all.iter().map(|region| region.color).collect()
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        let own = |region: &RegionInfo| {
            size_of::<RegionInfo>() + region.name.len() + size_of_val(&region.labels[..])
        };
        let sides = size_of_val(&self.sides.levels[..]);
        (sides + size_of_val(&self.of_base[..]) + self.all.iter().map(own).sum::<usize>()) as u64
    }
}

/// The regions of each of so many vertices but its first, given those of the tetrahedra: vertex and region, ascending.
pub fn further_regions(vertices: usize, tets: &[[u32; 4]], regions: &[u16]) -> Vec<(u32, u16)> {
    let mut all = vec![Vec::new(); vertices];
    for (tet, &region) in tets.iter().zip(regions) {
        for &v in tet {
            let own = &mut all[v as usize];
            if let Err(place) = own.binary_search(&region) {
                own.insert(place, region);
            }
        }
    }
    let further = |(v, own): (u32, Vec<u16>)| own.into_iter().skip(1).map(move |region| (v, region));
    (0..).zip(all).flat_map(further).collect()
}

/// Tetrahedra, volume, box and colour of regions, found mesh by mesh.
pub(crate) struct RegionSums {
    all: Vec<RegionInfo>,
    /// Six times the volume of each. Whole numbers add up to the same in any order.
    sixths: Vec<i128>,
    touching: BTreeSet<[u16; 2]>,
}

impl RegionSums {
    /// Of so many regions, of which nothing has come yet.
    pub fn new(regions: usize) -> Self {
        let empty = RegionInfo { bounds: [[i32::MAX; 3], [i32::MIN; 3]], ..RegionInfo::default() };
        Self { all: vec![empty; regions], sixths: vec![0; regions], touching: BTreeSet::new() }
    }

    /// Adds a mesh.
    pub fn add(&mut self, mesh: &CurrentMesh) {
        self.add_touching(mesh);
        for (t, &region) in (0..).zip(mesh.regions()) {
            let own = self.all.get_mut(usize::from(region));
            let (Some(tet), Some(info)) = (mesh.tet(t), own) else { continue };
            let corners = tet.map(|v| mesh.positions()[v as usize]);
            info.tetrahedra += 1;
            let [a, b, c, d] = corners;
            self.sixths[usize::from(region)] += orient3d(a, b, c, d);
            let [low, high] = &mut info.bounds;
            for p in corners {
                *low = [0, 1, 2].map(|k| low[k].min(p[k]));
                *high = [0, 1, 2].map(|k| high[k].max(p[k]));
            }
        }
    }

    /// Notes which regions touch in a mesh, and no more of it.
    pub fn add_touching(&mut self, mesh: &CurrentMesh) {
        let of_tets = (0..).zip(mesh.regions()).filter(|(t, _)| mesh.tet(*t).is_some());
        for (t, &region) in of_tets.filter(|(_, region)| usize::from(**region) < self.all.len()) {
            let around = mesh.neighbors()[t as usize].into_iter().filter(|&n| n != NONE);
            self.touching.extend(around.map(|n| [region, mesh.region(n)]).filter(|[a, b]| b < a));
        }
    }

    /// What has been found, where the lattice has these steps.
    pub fn finish(self, step: [f64; 3]) -> Vec<RegionInfo> {
        let Self { mut all, sixths, touching } = self;
        for (info, sixths) in all.iter_mut().zip(sixths) {
            info.volume = sixths as f64 / 6.0 * step[0] * step[1] * step[2];
        }
        for (region, around) in (0..).zip(neighbors_before(all.len(), &touching)) {
            let is_free =
                |color: &u8| around.iter().all(|&other: &u16| all[usize::from(other)].color != *color);
            let own = (region % usize::from(REGION_COLORS)) as u8;
            let mut colors = (0..REGION_COLORS).map(|k| (own + k) % REGION_COLORS);
            all[region].color = colors.find(is_free).unwrap_or(own);
        }
        all
    }
}

/// For each region those with smaller numbers that it touches.
fn neighbors_before(regions: usize, touching: &BTreeSet<[u16; 2]>) -> Vec<Vec<u16>> {
    let mut before = vec![Vec::new(); regions];
    touching.iter().for_each(|&[region, other]| before[usize::from(region)].push(other));
    before
}

/// Sets of regions, each stored once.
#[derive(Clone, Debug)]
pub(crate) struct RegionSets {
    sets: Vec<Vec<u16>>,
    numbers: HashMap<Vec<u16>, u32>,
    joined: HashMap<[u32; 2], u32>,
}

impl Default for RegionSets {
    /// With the empty set, whose number is 0.
    fn default() -> Self {
        Self {
            sets: vec![Vec::new()],
            numbers: std::iter::once((Vec::new(), 0)).collect(),
            joined: HashMap::new(),
        }
    }
}

impl RegionSets {
    /// The number of a set, given as a list in any order.
    pub fn number(&mut self, mut set: Vec<u16>) -> u32 {
        set.sort_unstable();
        set.dedup();
        if let Some(&number) = self.numbers.get(&set) {
            return number;
        }
        let number = self.sets.len() as u32;
        self.sets.push(set.clone());
        self.numbers.insert(set, number);
        number
    }

    /// The number of the union of two sets.
    pub fn join(&mut self, a: u32, b: u32) -> u32 {
        if a == b || b == 0 {
            return a;
        }
        let key = [a.min(b), a.max(b)];
        if let Some(&known) = self.joined.get(&key) {
            return known;
        }
        let all = [&self.sets[a as usize][..], &self.sets[b as usize][..]].concat();
        let number = self.number(all);
        self.joined.insert(key, number);
        number
    }

    /// The regions of a set, ascending.
    pub fn get(&self, number: u32) -> &[u16] {
        &self.sets[number as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_found_by_name_and_by_label() {
        let region = |name: &str, labels: &[i64]| RegionInfo {
            name: name.into(),
            labels: labels.to_vec(),
            ..RegionInfo::default()
        };
        let mut regions = Regions {
            arrays: vec!["part".into()],
            all: vec![region("7", &[-2]), region("rotor", &[7])],
            ..Regions::default()
        };
        let find = |regions: &Regions, name: &str| numbers_of(Some(regions), &[name.to_owned()]);
        assert_eq!(find(&regions, "rotor"), Ok(vec![1]));
        assert_eq!(find(&regions, "-2"), Ok(vec![0]));
        // A name comes first.
        assert_eq!(find(&regions, "7"), Ok(vec![0]));
        let names = ["rotor", "stator"].map(String::from);
        let problem = "there is no region stator, only 7, rotor".to_owned();
        assert_eq!(numbers_of(Some(&regions), &names), Err((1, problem)));
        let problem = "there is no region rotor: the volume is not parted".to_owned();
        assert_eq!(numbers_of(None, &names), Err((0, problem)));
        regions.all = vec![region("1, 7", &[1, 7]), region("2, 7", &[2, 7])];
        assert!(find(&regions, "7").is_err());
        assert_eq!(find(&regions, "2, 7"), Ok(vec![1]));
        // Labels are told by what is listed first of many.
        regions.all = (0..30).map(|label| region(&format!("r{label}"), &[label])).collect();
        let problem = find(&regions, "r30").unwrap_err().1;
        assert!(problem.ends_with("r22, r23 and 6 others"), "{problem}");
    }

    #[test]
    fn sets_are_stored_once() {
        let mut sets = RegionSets::default();
        let [a, b] = [vec![3, 1, 3], vec![2]].map(|set| sets.number(set));
        let both = sets.join(a, b);
        assert_eq!(sets.get(both), [1, 2, 3]);
        assert_eq!((sets.join(b, a), sets.number(vec![2, 3, 1])), (both, both));
        assert_eq!((sets.join(both, b), sets.join(0, a), sets.join(a, 0)), (both, a, a));
        assert_eq!(sets.get(0), [0_u16; 0]);
    }
}
