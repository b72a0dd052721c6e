//! Which updates insert their vertices beside which vertex, outside of memory: they come in the order of updates, and are asked for by
//! vertices.

use crate::scratch::Scratch;
use std::io;
use tetralod::mt::ForestChild;

/// log2 of the vertices whose children are sorted at a time.
const BUCKET_BITS: u32 = 16;

/// Bytes of a child, and of one with its vertex.
const CHILD: usize = 16;
const RECORD: usize = CHILD + 4;

/// All buckets together keep about so many bytes until they are written.
const BUFFERED: usize = 16 << 20;

/// Vertices that are asked for are read together if they are no further apart.
const GAP: u32 = 64;

/// The names under which children are kept, and where those of each vertex begin.
const CHILDREN: &str = "children";
const STARTS: &str = "children-starts";

/// Takes children in any order.
pub(super) struct ChildSorter<'a> {
    scratch: &'a dyn Scratch,
    vertices: u32,
    buckets: Vec<Vec<u8>>,
    /// Whether some of a bucket have been written.
    written: Vec<bool>,
}

/// Children by their vertices.
pub(super) struct Children<'a> {
    scratch: &'a dyn Scratch,
}

fn put(out: &mut Vec<u8>, ForestChild { update, offset }: ForestChild) {
    out.extend_from_slice(&update.to_le_bytes());
    offset.iter().for_each(|d| out.extend_from_slice(&d.to_le_bytes()));
}

fn number(bytes: &[u8], at: usize) -> u32 {
    bytes
        .get(4 * at..4 * at + 4)
        .map_or(0, |four| four.iter().rev().fold(0, |n, &byte| n << 8 | u32::from(byte)))
}

fn child(bytes: &[u8]) -> ForestChild {
    ForestChild { update: number(bytes, 0), offset: [1, 2, 3].map(|at| number(bytes, at) as i32) }
}

impl<'a> ChildSorter<'a> {
    /// Of so many vertices.
    pub fn new(scratch: &'a dyn Scratch, vertices: u32) -> Self {
        let buckets = (vertices >> BUCKET_BITS) as usize + 1;
        Self { scratch, vertices, buckets: vec![Vec::new(); buckets], written: vec![false; buckets] }
    }

    fn name(bucket: usize) -> String {
        format!("children-{bucket}")
    }

    pub fn put(&mut self, vertex: u32, child: ForestChild) -> io::Result<()> {
        let bucket = (vertex >> BUCKET_BITS) as usize;
        let most = (BUFFERED / self.buckets.len()).max(RECORD);
        let bytes = &mut self.buckets[bucket];
        bytes.extend_from_slice(&vertex.to_le_bytes());
        put(bytes, child);
        if bytes.len() >= most {
            self.scratch.append(&Self::name(bucket), bytes)?;
            self.written[bucket] = true;
            bytes.clear();
        }
        Ok(())
    }

    pub fn finish(self) -> io::Result<Children<'a>> {
        let Self { scratch, vertices, buckets, written } = self;
        let mut start = 0_u32;
        scratch.write(CHILDREN, &[])?;
        scratch.write(STARTS, &[])?;
        for (bucket, (rest, is_written)) in buckets.into_iter().zip(written).enumerate() {
            let mut all = if is_written { scratch.read(&Self::name(bucket))? } else { Vec::new() };
            all.extend_from_slice(&rest);
            let mut records: Vec<(u32, ForestChild)> =
                all.chunks_exact(RECORD).map(|record| (number(record, 0), child(&record[4..]))).collect();
            drop(all);
            records.sort_unstable_by_key(|(vertex, child)| (*vertex, child.update));
            let first = (bucket as u32) << BUCKET_BITS;
            let end = vertices.min(first.saturating_add(1 << BUCKET_BITS));
            let (mut starts, mut rows) = (Vec::new(), Vec::with_capacity(CHILD * records.len()));
            let mut left = &records[..];
            for vertex in first..end {
                starts.extend_from_slice(&start.to_le_bytes());
                let own = left.partition_point(|(other, _)| *other <= vertex);
                left[..own].iter().for_each(|(_, child)| put(&mut rows, *child));
                left = &left[own..];
                start += own as u32;
            }
            scratch.append(STARTS, &starts)?;
            scratch.append(CHILDREN, &rows)?;
            if is_written {
                scratch.remove(&Self::name(bucket))?;
            }
        }
        scratch.append(STARTS, &start.to_le_bytes())?;
        Ok(Children { scratch })
    }
}

impl Children<'_> {
    /// The children of these vertices, which ascend: where those of each begin, and one more.
    pub fn of(&self, vertices: &[u32]) -> io::Result<(Vec<u32>, Vec<ForestChild>)> {
        let (mut starts, mut children) = (vec![0], Vec::new());
        for near in vertices.chunk_by(|a, b| b - a <= GAP) {
            let (first, last) = (near[0], near[near.len() - 1]);
            let mut bounds = vec![0; 4 * (last - first + 2) as usize];
            self.scratch.read_at(STARTS, 4 * u64::from(first), &mut bounds)?;
            let bound = |v: u32| number(&bounds, (v - first) as usize);
            let from = bound(first);
            let mut rows = vec![0; (bound(last + 1) - from) as usize * CHILD];
            self.scratch.read_at(CHILDREN, CHILD as u64 * u64::from(from), &mut rows)?;
            for &v in near {
                let own = [v, v + 1].map(|v| (bound(v) - from) as usize * CHILD);
                children.extend(rows[own[0]..own[1]].chunks_exact(CHILD).map(child));
                starts.push(children.len() as u32);
            }
        }
        Ok((starts, children))
    }

    /// Removes what was kept.
    pub fn remove(&self) -> io::Result<()> {
        self.scratch.remove(CHILDREN)?;
        self.scratch.remove(STARTS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::InMemory;

    #[test]
    fn children_come_back_by_vertices() {
        let vertices = 3_u32 << BUCKET_BITS;
        // Some vertices have none, one has many.
        let vertex = |u: u32| if u.is_multiple_of(5) { 70_000 } else { u * 7919 % vertices };
        let offset = |u: u32| [u as i32, -(u as i32), 3];
        let scratch = InMemory::default();
        let mut sorter = ChildSorter::new(&scratch, vertices);
        for u in (0..50_000).rev() {
            sorter.put(vertex(u), ForestChild { update: u, offset: offset(u) }).expect("room");
        }
        let children = sorter.finish().expect("room");
        let asked: Vec<u32> =
            (0..vertices).filter(|v| v % 3 == 0 || *v == 70_000 || v / 1000 % 7 == 2).collect();
        let (starts, found) = children.of(&asked).expect("children");
        let mut expected = vec![Vec::new(); vertices as usize];
        (0..50_000)
            .for_each(|u| expected[vertex(u) as usize].push(ForestChild { update: u, offset: offset(u) }));
        assert_eq!(starts.len(), asked.len() + 1);
        for (bounds, &v) in starts.windows(2).zip(&asked) {
            assert_eq!(found[bounds[0] as usize..bounds[1] as usize], expected[v as usize], "vertex {v}");
        }
        children.remove().expect("it is there");
        assert!(scratch.read(CHILDREN).is_err());
    }
}
