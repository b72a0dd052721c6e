//! The nodes of vertex-based MT files bit by bit, as the specification has them, without the library's help: what can be
//! taken apart can be put together wrong.
#![allow(dead_code, reason = "every test binary uses a part of it")]

use crate::format_support::assemble;
use crate::format_support::bytes_of;
use crate::format_support::decode;
use crate::format_support::sections;
use tetralod::format::FormatError;
use tetralod::mt::Mt;
use tetralod::mt::MtInfo;
use tetralod::mt::MultiTessellation;

/// Bits, the least significant of every number first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BitString(pub Vec<bool>);

impl BitString {
    pub fn push(&mut self, value: u64, width: u32) {
        self.0.extend((0..width).map(|bit| value >> bit & 1 == 1));
    }

    /// Takes a number off the front.
    pub fn take(&mut self, width: u32) -> u64 {
        let rest = self.0.split_off((width as usize).min(self.0.len()));
        let own = std::mem::replace(&mut self.0, rest);
        own.iter().rev().fold(0, |value, &bit| value << 1 | u64::from(bit))
    }
}

/// A node up to where the mesh is needed to read on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    pub position: [u64; 3],
    pub levels: Vec<u64>,
    /// Its own link first, then one for each child: an update, and which of its links goes on.
    pub links: Vec<[u64; 2]>,
    /// Tetrahedra that it removes.
    pub removed: u64,
    /// For each face on the boundary, whether it is given up; none if the boundary stays.
    pub given_up: Option<Vec<bool>>,
    /// Which child removes each new tetrahedron, whether T_u is a fan, and the code.
    pub rest: BitString,
}

/// How wide the parts of a node are.
#[derive(Clone, Debug)]
pub struct Widths {
    pub position: u32,
    pub levels: Vec<u32>,
    pub node: u32,
    pub link: u32,
}

/// Bits of the largest number there is.
pub fn width_of(largest: u64) -> u32 {
    64 - largest.leading_zeros()
}

impl Node {
    pub fn read(mut bits: BitString, widths: &Widths) -> Self {
        let position = [0; 3].map(|_| bits.take(widths.position));
        let levels = widths.levels.iter().map(|&width| bits.take(width)).collect();
        let children = bits.take(widths.link);
        let links = (0..=children).map(|_| [bits.take(widths.node), bits.take(widths.link)]).collect();
        let removed = bits.take(7);
        let given_up = (bits.take(1) == 1).then(|| {
            let count = bits.take(7);
            (0..count).map(|_| bits.take(1) == 1).collect()
        });
        Self { position, levels, links, removed, given_up, rest: bits }
    }

    pub fn write(&self, widths: &Widths) -> BitString {
        let mut bits = BitString::default();
        self.position.iter().for_each(|&x| bits.push(x, widths.position));
        self.levels.iter().zip(&widths.levels).for_each(|(&level, &width)| bits.push(level, width));
        bits.push(self.links.len().saturating_sub(1) as u64, widths.link);
        for [node, link] in &self.links {
            bits.push(*node, widths.node);
            bits.push(*link, widths.link);
        }
        bits.push(self.removed, 7);
        bits.push(u64::from(self.given_up.is_some()), 1);
        if let Some(given_up) = &self.given_up {
            bits.push(given_up.len() as u64, 7);
            given_up.iter().for_each(|&up| bits.push(u64::from(up), 1));
        }
        bits.0.extend(&self.rest.0);
        let missing = bits.0.len().next_multiple_of(4) - bits.0.len();
        bits.push(0, missing as u32);
        bits
    }
}

/// A vertex-based MT file of one block, taken apart.
#[derive(Clone, Debug)]
pub struct Parts {
    pub info: MtInfo,
    info_section: Vec<u8>,
    /// `BASE` up to its last column.
    pub base: Vec<u8>,
    /// Whether every update makes the mesh larger.
    pub grows: u64,
    pub most_children: u64,
    /// The update that removes each base tetrahedron, and one more; 0 for none.
    pub removers: Vec<u64>,
    pub nodes: Vec<Node>,
    errors: Vec<u8>,
}

fn varint(bytes: &mut &[u8]) -> u64 {
    let mut value = 0;
    for shift in (0..).step_by(7) {
        let (byte, rest) = bytes.split_first().expect("a number");
        *bytes = rest;
        value |= u64::from(byte & 127) << shift;
        if byte & 128 == 0 {
            return value;
        }
    }
    unreachable!("numbers end")
}

fn push_varint(out: &mut Vec<u8>, mut value: u64) {
    while value > 127 {
        out.push(value as u8 | 128);
        value >>= 7;
    }
    out.push(value as u8);
}

fn column(bytes: &mut &[u8]) -> Vec<u8> {
    let length = varint(bytes) as usize;
    let (own, rest) = bytes.split_at(length);
    *bytes = rest;
    own.to_vec()
}

fn push_column(out: &mut Vec<u8>, column: &[u8]) {
    push_varint(out, column.len() as u64);
    out.extend_from_slice(column);
}

impl Parts {
    pub fn of(mt: &Mt) -> Self {
        let found = sections(&bytes_of(mt));
        assert!(found.len() <= 3, "more than one block");
        let [(info, info_section), (base, base_section)] = [found[0].clone(), found[1].clone()];
        assert_eq!((&info, &base), (b"INFO", b"BASE"));
        let mut rest = base_section.as_slice();
        let (vertices, tets) = (varint(&mut rest), varint(&mut rest));
        assert_eq!((vertices as usize, tets as usize), (mt.base().positions.len(), mt.base().tets.len()));
        (0..2 + mt.info().fields.len()).for_each(|_| drop(column(&mut rest)));
        let base = base_section[..base_section.len() - rest.len()].to_vec();
        let last = column(&mut rest);
        assert!(rest.is_empty());
        let mut last = last.as_slice();
        let (grows, most_children) = (varint(&mut last), varint(&mut last));
        let removers = (0..tets).map(|_| varint(&mut last)).collect();
        assert!(last.is_empty());
        let mut parts = Self {
            info: mt.info().clone(),
            info_section,
            base,
            grows,
            most_children,
            removers,
            nodes: Vec::new(),
            errors: Vec::new(),
        };
        if let Some((kind, block)) = found.get(2) {
            assert_eq!(kind, b"INSV");
            parts.read_nodes(block);
        }
        parts
    }

    fn read_nodes(&mut self, mut block: &[u8]) {
        let (first, count) = (varint(&mut block), varint(&mut block));
        assert_eq!((first, count), (0, u64::from(self.info.updates)));
        let [lengths, nodes, errors] = [(); 3].map(|()| column(&mut block));
        assert!(block.is_empty());
        let mut all = BitString::default();
        nodes.iter().for_each(|&byte| all.push(u64::from(byte), 8));
        let mut lengths = lengths.as_slice();
        let widths = self.widths();
        for _ in 0..count {
            let length = 4 * varint(&mut lengths) as usize;
            let rest = all.0.split_off(length);
            let own = std::mem::replace(&mut all.0, rest);
            self.nodes.push(Node::read(BitString(own), &widths));
        }
        assert!(lengths.is_empty() && all.0.len() < 8 && !all.0.contains(&true));
        self.errors = errors;
    }

    pub fn widths(&self) -> Widths {
        Widths {
            position: self.info.lattice.bits + 1,
            levels: self.info.fields.iter().map(|field| field.bits).collect(),
            node: width_of(u64::from(self.info.updates.saturating_sub(1))).max(1),
            link: width_of(self.most_children).max(1),
        }
    }

    /// The bits of all nodes.
    pub fn bits(&self) -> Vec<BitString> {
        self.nodes.iter().map(|node| node.write(&self.widths())).collect()
    }

    /// The file with other bits in the nodes, of which there must be as many.
    pub fn file(&self, nodes: &[BitString]) -> Vec<u8> {
        let mut last = Vec::new();
        push_varint(&mut last, self.grows);
        push_varint(&mut last, self.most_children);
        self.removers.iter().for_each(|&u| push_varint(&mut last, u));
        let mut base = self.base.clone();
        push_column(&mut base, &last);
        let (mut lengths, mut all) = (Vec::new(), BitString::default());
        for node in nodes {
            push_varint(&mut lengths, node.0.len() as u64 / 4);
            all.0.extend(&node.0);
        }
        let mut bytes = Vec::new();
        while !all.0.is_empty() {
            bytes.push(all.take(8) as u8);
        }
        let mut block = Vec::new();
        push_varint(&mut block, 0);
        push_varint(&mut block, nodes.len() as u64);
        [lengths, bytes, self.errors.clone()].iter().for_each(|column| push_column(&mut block, column));
        let mut all = vec![(*b"INFO", self.info_section.clone()), (*b"BASE", base)];
        if !nodes.is_empty() {
            all.push((*b"INSV", block));
        }
        assemble(&all, self.info.updates)
    }

    /// What the library makes of that file.
    pub fn decode(&self, nodes: &[BitString]) -> Result<Mt, FormatError> {
        decode(&self.file(nodes))
    }
}
