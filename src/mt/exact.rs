//! Field values without loss: a side table for the vertices of the reference mesh.

use super::VertexId;

/// The exact values of one field at all vertices of the reference mesh. The levels of the MT approximate them.
#[derive(Clone, Debug, PartialEq)]
pub struct Exact {
    /// The field's number in [`MtInfo::fields`](super::MtInfo::fields).
    pub field: usize,
    /// The vertices of the reference mesh, ascending. In MTs of vertex insertions they are all vertices of the MT, in
    /// edge-based ones those that are never split.
    pub vertices: Vec<VertexId>,
    /// A value for each of them.
    pub values: ExactValues,
}

/// Values bit for bit, in as few bits as hold all of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExactValues {
    /// The bits of numbers of single precision.
    F32(Vec<u32>),
    /// The bits of numbers of double precision.
    F64(Vec<u64>),
}

impl Exact {
    /// Files have the values of at most so many vertices in one section.
    #[doc(hidden)]
    pub const IN_A_SECTION: u32 = 1 << 14;

    /// A table of these values, in single precision if that holds every one of them.
    pub fn new(field: usize, mut values: Vec<(VertexId, f64)>) -> Self {
        values.sort_unstable_by_key(|&(vertex, _)| vertex);
        let is_single = |&(_, x): &(VertexId, f64)| f64::from(x as f32).to_bits() == x.to_bits();
        let bits = if values.iter().all(is_single) {
            ExactValues::F32(values.iter().map(|&(_, x)| (x as f32).to_bits()).collect())
        } else {
            ExactValues::F64(values.iter().map(|&(_, x)| x.to_bits()).collect())
        };
        Self { field, vertices: values.into_iter().map(|(vertex, _)| vertex).collect(), values: bits }
    }

    /// The exact value at a vertex; none if it is not one of the reference mesh.
    pub fn get(&self, vertex: VertexId) -> Option<f64> {
        let place = self.vertices.binary_search(&vertex).ok()?;
        match &self.values {
            ExactValues::F32(bits) => bits.get(place).map(|&bits| f64::from(f32::from_bits(bits))),
            ExactValues::F64(bits) => bits.get(place).map(|&bits| f64::from_bits(bits)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_is_told_by_the_values() {
        let small = f64::from(f32::from_bits(1));
        let single = [(VertexId(9), -0.0), (VertexId(2), small), (VertexId(4), f64::from(f32::MAX))];
        let table = Exact::new(1, single.to_vec());
        assert!(matches!(table.values, ExactValues::F32(_)));
        for (vertex, value) in single {
            assert_eq!(table.get(vertex).map(f64::to_bits), Some(value.to_bits()));
        }
        assert_eq!(table.get(VertexId(3)), None);
        let double = Exact::new(0, vec![(VertexId(0), f64::from_bits(1)), (VertexId(1), 0.5)]);
        assert!(matches!(double.values, ExactValues::F64(_)));
        assert_eq!(double.get(VertexId(0)).map(f64::to_bits), Some(1));
    }
}
