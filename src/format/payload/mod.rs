//! What is in each kind of section: one writer and one reader a kind, side by side. Updates have a file for each kind
//! of MT.

mod base;
pub mod bounds;
pub mod edge;
pub mod exact;
mod explicit;
pub mod half_edge;
pub mod histogram;
pub mod index;
mod vertex;

use super::coder::{Family, Models, Put, Source};
use super::header::Kind;
use super::read::{MAX_STRING, Reader};
use super::{EncodeError, FormatError, Limits, write};
use crate::geom::Lattice;
use crate::mesh::VectorPart;
use crate::mt::{
    BaseMesh, BaseMeshError, EdgeMt, EdgeUpdate, ErrorCode, ExplicitMt, FieldInfo, HalfEdgeMt,
    HalfEdgeUpdate, MAX_QUARTERINGS, Mt, MtInfo, MtKind, MultiTessellation, PageError, UpdateError,
    UpdatePages, VertexId,
};
use edge::{FieldPart, Splits};
use std::collections::BTreeMap;
use std::ops::Range;
pub use vertex::State;

/// Key and value of each entry, in ascending order of the keys.
pub type Metadata = Vec<(String, String)>;

/// Largest `INFO` section that is written.
const MAX_INFO_BYTES: usize = 1 << 20;

/// The number that stands for each kind of MT: its place here.
const KINDS: [MtKind; 4] = [MtKind::Edge, MtKind::Vertex, MtKind::Explicit, MtKind::HalfEdge];

pub fn write_info(
    out: &mut Vec<u8>,
    info: &MtInfo,
    metadata: &BTreeMap<String, String>,
) -> Result<(), EncodeError> {
    let fits = |text: &str| text.len() <= MAX_STRING as usize;
    let vector_fits = |field: &FieldInfo| field.vector.as_ref().is_none_or(|vector| fits(&vector.name));
    if !info.fields.iter().all(|field| fits(&field.name) && fits(&field.unit) && vector_fits(field)) {
        return Err(EncodeError::TooLong { what: "the name or the unit of a field" });
    }
    if !metadata.iter().all(|(key, value)| fits(key) && fits(value)) {
        return Err(EncodeError::TooLong { what: "a metadata key or value" });
    }
    out.push(KINDS.iter().position(|&kind| kind == info.kind).unwrap_or_default() as u8);
    for count in [info.vertices, info.tetrahedra, info.updates] {
        write::u32(out, count);
    }
    for number in info.lattice.origin.into_iter().chain(info.lattice.step) {
        write::f64(out, number);
    }
    out.push(info.lattice.bits as u8);
    write::f64(out, info.displacement_per_error);
    out.push(info.fields.len() as u8);
    for field in &info.fields {
        write::string(out, &field.name);
        for number in [field.min, field.max, field.origin, field.step] {
            write::f64(out, number);
        }
        out.push(field.bits as u8);
    }
    write::varint(out, metadata.len() as u64);
    for (key, value) in metadata {
        write::string(out, key);
        write::string(out, value);
    }
    write_more(out, info);
    if out.len() > MAX_INFO_BYTES {
        return Err(EncodeError::TooLong { what: "the description with all metadata" });
    }
    Ok(())
}

pub fn read_info(mut reader: Reader<'_>) -> Result<(MtInfo, Metadata), FormatError> {
    let kind = KINDS.get(usize::from(reader.u8()?)).copied();
    let kind = kind.ok_or_else(|| reader.corrupt("the kind of MT is not known"))?;
    let [vertices, tetrahedra, updates] = [reader.u32()?, reader.u32()?, reader.u32()?];
    let lattice = Lattice { origin: reader.f64x3()?, step: reader.f64x3()?, bits: u32::from(reader.u8()?) };
    let displacement_per_error = reader.f64()?;
    let count = reader.u8()?;
    let fields = (0..count).map(|_| read_field(&mut reader)).collect::<Result<_, _>>()?;
    let metadata = read_metadata(&mut reader)?;
    let mut info = MtInfo {
        kind,
        lattice,
        fields,
        vertices,
        tetrahedra,
        updates,
        displacement_per_error,
        quantization: 0.0,
        bounds: None,
    };
    read_more(&mut reader, &mut info)?;
    reader.end()?;
    info.check()?;
    Ok((info, metadata))
}

/// Set in the flags of a field that is a part of a vector, and that is its length; and of a field of a known time.
const OF_VECTOR: u8 = 1;
const IS_LENGTH: u8 = 2;
const HAS_TIME: u8 = 4;

/// Appends what the first writers did not know, unless there is none of it.
fn write_more(out: &mut Vec<u8>, info: &MtInfo) {
    let knows_no_more = |field: &FieldInfo| {
        field.unit.is_empty() && field.vector.is_none() && field.time.is_none() && field.quantization == 0.0
    };
    if info.quantization == 0.0 && info.fields.iter().all(knows_no_more) {
        return;
    }
    write::f64(out, info.quantization);
    for field in &info.fields {
        write::f64(out, field.quantization);
        write::string(out, &field.unit);
        let component = field.vector.as_ref().map(|vector| vector.component);
        let of_vector = match component {
            None => 0,
            Some(None) => OF_VECTOR | IS_LENGTH,
            Some(Some(_)) => OF_VECTOR,
        };
        out.push(of_vector | if field.time.is_some() { HAS_TIME } else { 0 });
        if let Some(VectorPart { name, component }) = &field.vector {
            write::string(out, name);
            out.extend(component);
        }
        field.time.iter().for_each(|&time| write::f64(out, time));
    }
}

fn read_more(reader: &mut Reader<'_>, info: &mut MtInfo) -> Result<(), FormatError> {
    if reader.is_empty() {
        return Ok(());
    }
    info.quantization = reader.f64()?;
    for field in &mut info.fields {
        field.quantization = reader.f64()?;
        field.unit = reader.string()?.to_owned();
        let flags = reader.u8()?;
        if flags & !(OF_VECTOR | IS_LENGTH | HAS_TIME) != 0 || flags & (OF_VECTOR | IS_LENGTH) == IS_LENGTH {
            return Err(reader.corrupt("the flags of a field are not known"));
        }
        if flags & OF_VECTOR != 0 {
            let name = reader.string()?.to_owned();
            let component = if flags & IS_LENGTH == 0 { Some(reader.u8()?) } else { None };
            field.vector = Some(VectorPart { name, component });
        }
        if flags & HAS_TIME != 0 {
            field.time = Some(reader.f64()?);
        }
    }
    Ok(())
}

fn read_field(reader: &mut Reader<'_>) -> Result<FieldInfo, FormatError> {
    Ok(FieldInfo {
        name: reader.string()?.to_owned(),
        min: reader.f64()?,
        max: reader.f64()?,
        origin: reader.f64()?,
        step: reader.f64()?,
        bits: u32::from(reader.u8()?),
        ..FieldInfo::default()
    })
}

fn read_metadata(reader: &mut Reader<'_>) -> Result<Metadata, FormatError> {
    let count = reader.varint()?;
    let mut metadata = Metadata::new();
    for _ in 0..count {
        let key = reader.string()?;
        if metadata.last().is_some_and(|(last, _)| last.as_str() >= key) {
            return Err(reader.corrupt("metadata keys are not in ascending order"));
        }
        metadata.push((key.to_owned(), reader.string()?.to_owned()));
    }
    Ok(metadata)
}

/// All families of contexts that files of a kind of MT may have, in the order of their contexts.
pub fn families(kind: MtKind) -> Vec<Family> {
    parts(kind).into_iter().map(|(_, family)| family).collect()
}

/// The same, with a name for what each codes.
pub fn parts(kind: MtKind) -> Vec<(&'static str, Family)> {
    let base = base::FAMILIES.into_iter().map(|family| ("base mesh", family));
    let own: &[(&str, Family)] = match kind {
        MtKind::Edge => &edge::PARTS,
        MtKind::Vertex => &vertex::PARTS,
        MtKind::HalfEdge => &half_edge::PARTS,
        MtKind::Explicit => &explicit::PARTS,
    };
    let last = [
        ("base mesh", BASE_LEVEL),
        ("exact values", exact::GAP),
        ("exact values", exact::LENGTH),
        ("errors of tetrahedra", QUARTERINGS),
        ("errors of tetrahedra", OWN_FALL),
    ];
    base.chain(own.iter().copied()).chain(last).collect()
}

/// Differences between the levels of base vertices.
const BASE_LEVEL: Family = edge::LEVEL.numbers_after(1, 2);

/// By how many 32nds of a factor of 2 the errors of an update are larger than those of what it removes.
const OWN_FALL: Family = QUARTERINGS.after(1, 256);

/// How often what is left of the errors of an update can be quartered to bound those of a tetrahedron that it removes; by that of the one
/// before it in the update, and whether the new vertex lies in it.
const QUARTERINGS: Family = exact::LENGTH.after(8, MAX_QUARTERINGS as u32 + 1);

/// Puts what is coded of the base mesh.
pub fn put_base(out: &mut impl Put, mt: &Mt) {
    base::put(out, mt.base());
    match mt {
        Mt::Vertex(mt) => vertex::put_head(out, mt),
        Mt::HalfEdge(mt) => half_edge::put_head(out, mt),
        _ => {}
    }
}

/// Puts the levels of one field at the base vertices.
pub fn put_base_field(out: &mut impl Put, mt: &Mt, field: usize) {
    let mut last = 0;
    // Levels stand vertex by vertex; those of this field begin at its own place in the first one.
    for &level in mt.base().values.iter().skip(field).step_by(mt.info().fields.len()) {
        out.signed(BASE_LEVEL, 0, level - last);
        last = level;
    }
}

/// Appends what stands in front of the coded part of a `BASE` section.
pub fn write_base_head(out: &mut Vec<u8>, mt: &Mt) {
    write::varint(out, mt.base().positions.len() as u64);
    write::varint(out, mt.base().tets.len() as u64);
}

/// A base mesh whose levels have not all arrived.
#[derive(Debug, Default)]
pub struct BaseParts {
    base: BaseMesh,
    /// What files of vertex-based MTs contain besides.
    vertex: vertex::InsertionRules,
    /// What files of half-edge MTs contain besides.
    half_edge: half_edge::BaseHead,
    levels: Vec<Vec<i32>>,
}

/// Vertices and tetrahedra that a byte of a base mesh can stand for at most. Symbols may take no bits: without this, a few
/// bytes could claim what fills all memory that is allowed.
const MOST_IN_A_BYTE: u64 = 4096;

/// Whether a base mesh of so many bytes can be so large.
pub fn is_backed([vertices, tets]: [u64; 2], bytes: usize) -> bool {
    vertices + tets <= MOST_IN_A_BYTE * (bytes as u64 + 1)
}

/// Reads a `BASE` section of an MT of which so many updates are going to be in memory at once.
pub fn read_base(
    mut reader: Reader<'_>,
    info: &MtInfo,
    models: &Models,
    updates: u32,
    block_bits: u32,
    limits: &Limits,
) -> Result<BaseParts, FormatError> {
    let [vertices, tets] = [reader.varint()?, reader.varint()?];
    check_counts(info, u64::from(vertices))?;
    let counts = [vertices, tets].map(u64::from);
    check_memory(info, counts, updates, limits)?;
    if !is_backed(counts, reader.len()) {
        return Err(reader.corrupt("the base mesh is larger than its bytes can code"));
    }
    let mut source = Source::new(reader, models)?;
    let mut parts = BaseParts { base: base::read(&mut source, vertices, tets)?, ..BaseParts::default() };
    if info.kind == MtKind::Vertex {
        parts.vertex = vertex::read_head(&mut source)?;
    }
    if info.kind == MtKind::HalfEdge {
        let counts = [vertices, tets].map(|count| count as usize);
        parts.half_edge = half_edge::read_head(&mut source, info, counts, block_bits, limits)?;
    }
    source.end()?;
    Ok(parts)
}

impl BaseParts {
    /// Fields that have arrived.
    pub fn fields(&self) -> usize {
        self.levels.len()
    }

    /// Reads the levels of the next field.
    pub fn read_field(&mut self, reader: Reader<'_>, models: &Models) -> Result<(), FormatError> {
        let mut source = Source::new(reader, models)?;
        let (mut levels, mut last) = (Vec::new(), 0_i32);
        for _ in 0..self.base.positions.len() {
            last = last.wrapping_add(source.signed(BASE_LEVEL, 0)?);
            levels.push(last);
        }
        source.end()?;
        self.levels.push(levels);
        Ok(())
    }

    /// The MT without updates, when all levels are there.
    pub fn start(
        self,
        info: MtInfo,
        block_bits: u32,
        tet_errors: bool,
    ) -> Result<(Mt, Option<State>), FormatError> {
        let Self { mut base, vertex, half_edge, levels } = self;
        let vertices = base.positions.len();
        base.values = (0..vertices).flat_map(|v| levels.iter().map(move |levels| levels[v])).collect();
        base.check(&info)?;
        Ok(match info.kind {
            MtKind::Edge => (EdgeMt::with_page_bits(info, base, block_bits).into(), None),
            MtKind::Vertex => {
                let (mut mt, state) = vertex::start(info, base, vertex, tet_errors)?;
                mt.set_page_bits(block_bits);
                (mt.into(), Some(state))
            }
            MtKind::HalfEdge => {
                let half_edge::BaseHead { marks, children } = half_edge;
                (HalfEdgeMt::new(info, base, marks, &children, block_bits)?.into(), None)
            }
            MtKind::Explicit => {
                let mut mt = ExplicitMt::new(info, base);
                mt.set_page_bits(block_bits);
                if tet_errors {
                    mt.set_tet_errors(Vec::new(), vec![0; mt.tets().len()])?;
                }
                (mt.into(), None)
            }
        })
    }
}

/// What a description and a base mesh of so many vertices must be like, by the kind of MT.
pub fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError> {
    match info.kind {
        MtKind::Edge => edge::check_counts(info, base_vertices),
        MtKind::Vertex => vertex::check_counts(info, base_vertices),
        MtKind::HalfEdge => half_edge::check_counts(info, base_vertices),
        // Vertices and tetrahedra are counted update by update, and compared at the end.
        MtKind::Explicit => Ok(()),
    }
}

/// Whether an MT with so many base vertices, base tetrahedra and updates fits the limits. Counts are checked against what
/// arrives, so it cannot grow beyond; kinds whose updates differ in size check each of these as well.
pub fn check_memory(
    info: &MtInfo,
    [vertices, tets]: [u64; 2],
    updates: u32,
    limits: &Limits,
) -> Result<(), FormatError> {
    let fields = info.fields.len() as u64;
    let base = vertices * (16 + 4 * fields) + tets * 16;
    let each = match info.kind {
        MtKind::Edge => edge::update_bytes(fields),
        MtKind::Vertex => vertex::least_update_bytes(info),
        MtKind::HalfEdge => half_edge::least_update_bytes(fields),
        MtKind::Explicit => explicit::least_update_bytes(),
    };
    check_bytes(base + u64::from(updates) * each, limits)
}

fn check_bytes(needed: u64, limits: &Limits) -> Result<(), FormatError> {
    if needed > limits.memory_bytes {
        return Err(FormatError::Limit { what: "the MT in memory", needed, limit: limits.memory_bytes });
    }
    Ok(())
}

/// The kind of section that an MT's updates are in.
pub fn section_of(kind: MtKind) -> Kind {
    match kind {
        MtKind::Edge => Kind::UPDT,
        MtKind::Vertex => Kind::INSV,
        MtKind::HalfEdge => Kind::HALF,
        MtKind::Explicit => Kind::EXPL,
    }
}

/// Puts the updates of a block of an MT that has sections for fields, without what they do to these.
pub fn put_shared(out: &mut impl Put, mt: &Mt, Range { start, end }: Range<u32>) {
    match mt {
        Mt::Edge(mt) => edge::put(out, mt, start, end),
        Mt::HalfEdge(mt) => half_edge::put(out, mt, start, end),
        _ => {}
    }
}

/// Puts what the updates of such a block do to a field.
pub fn put_field(out: &mut impl Put, mt: &Mt, Range { start, end }: Range<u32>, field: usize) {
    match mt {
        Mt::Edge(mt) => edge::put_field(out, mt, start, end, field),
        Mt::HalfEdge(mt) => half_edge::put_field(out, mt, start, end, field),
        _ => {}
    }
}

/// The updates of a block of an MT that has sections for fields, without what they do to these.
#[derive(Debug)]
pub enum Shared {
    Splits(Splits),
    Insertions(half_edge::Insertions),
}

impl Shared {
    /// Reads what [`put_shared`] puts.
    pub fn read(
        source: &mut Source<'_>,
        mt: &Mt,
        Range { start, end }: Range<u32>,
        limits: &Limits,
    ) -> Result<Self, FormatError> {
        match mt {
            Mt::Edge(mt) => edge::read(source, mt, start, end - start).map(Self::Splits),
            Mt::HalfEdge(mt) => {
                half_edge::read(source, mt.info(), mt.page_bits(), start..end, limits).map(Self::Insertions)
            }
            _ => Err(source.corrupt("a section is out of place")),
        }
    }

    /// Reads what the `count` updates of the block do to a field.
    pub fn read_field(&self, source: &mut Source<'_>, count: u32) -> Result<FieldPart, FormatError> {
        match self {
            Self::Splits(_) => edge::read_changes(source, [edge::ERROR, edge::LEVEL], count),
            Self::Insertions(_) => half_edge::read_field(source, count),
        }
    }

    /// Whether an MT fits the limits with these updates in it. Those of an edge MT take the same each, and fit already.
    pub fn check_memory(&self, mt: &Mt, limits: &Limits) -> Result<(), FormatError> {
        match self {
            Self::Splits(_) => Ok(()),
            Self::Insertions(insertions) => {
                let fields = mt.info().fields.len() as u64;
                check_bytes(MultiTessellation::bytes(mt) + insertions.bytes(fields), limits)
            }
        }
    }

    /// Adds the updates to an MT as a page.
    pub fn insert(self, mt: &mut Mt, page: u32, fields: &[FieldPart]) -> Result<(), PageError> {
        let count = fields.first().map_or(0, |field| field.residuals.len());
        let residuals: Vec<i32> =
            (0..count).flat_map(|k| fields.iter().map(move |field| field.residuals[k])).collect();
        let errors: Vec<ErrorCode> =
            (0..count).flat_map(|k| fields.iter().map(move |field| field.errors[k])).collect();
        let stride = fields.len().max(1);
        let changes = (0..count).zip(residuals.chunks(stride).zip(errors.chunks(stride)));
        match (self, mt) {
            (Self::Splits(splits), Mt::Edge(mt)) => {
                let all: Vec<EdgeUpdate<'_>> = changes
                    .map(|(k, (level_residuals, errors))| EdgeUpdate {
                        vertex: VertexId(splits.vertices[k]),
                        offset_residual: splits.offsets[k].0,
                        edge: splits.offsets[k].1,
                        level_residuals: level_residuals.into(),
                        wrong_sides: splits.masks[k],
                        errors,
                    })
                    .collect();
                mt.insert_page(page, &all)
            }
            (Self::Insertions(insertions), Mt::HalfEdge(mt)) => {
                let updates: Vec<HalfEdgeUpdate<'_>> = changes
                    .map(|(k, (level_residuals, errors))| HalfEdgeUpdate {
                        children: &insertions.children[k],
                        level_residuals,
                        star: &insertions.stars[k],
                        errors,
                    })
                    .collect();
                mt.insert_page(page, &updates)
            }
            _ => Err(PageError::Absent { page }),
        }
    }
}

/// Puts the updates of an MT that is not edge-based; `state` goes from one block to the next.
pub fn put_updates(
    out: &mut impl Put,
    mt: &Mt,
    Range { start, end }: Range<u32>,
    state: Option<&mut State>,
) -> Result<(), UpdateError> {
    match (mt, state) {
        (Mt::Vertex(mt), Some(state)) => vertex::put(out, mt, start, end, state),
        (Mt::Explicit(mt), _) => {
            explicit::put(out, mt, start, end);
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Where the updates of an MT begin to be put.
pub fn start_state(mt: &Mt) -> Result<Option<State>, BaseMeshError> {
    if let Mt::Vertex(mt) = mt { State::of(mt).map(Some) } else { Ok(None) }
}

/// Reads what [`put_updates`] puts.
pub fn read_updates(
    source: &mut Source<'_>,
    mt: &mut Mt,
    count: u32,
    state: Option<&mut State>,
    limits: &Limits,
) -> Result<(), FormatError> {
    match (mt, state) {
        (Mt::Vertex(mt), Some(state)) => vertex::read(source, mt, count, state, limits),
        (Mt::Explicit(mt), _) => explicit::read(source, mt, count, limits),
        _ => Ok(()),
    }
}

/// Whether the reference mesh of a complete MT is that of its description, as far as that follows without a mesh.
pub fn check_reference(mt: &Mt) -> Result<(), BaseMeshError> {
    match mt {
        Mt::Edge(_) | Mt::Vertex(_) | Mt::HalfEdge(_) => Ok(()),
        Mt::Explicit(mt) => explicit::check_reference(mt),
    }
}

/// Puts by how many codes each error of an update is below that of the update before.
fn put_errors(out: &mut impl Put, family: Family, before: &mut [ErrorCode], errors: &[ErrorCode]) {
    for (before, &error) in before.iter_mut().zip(errors) {
        out.number(family, 0, u32::from(before.0.wrapping_sub(error.0)));
        *before = error;
    }
}

/// Turns the errors of the update before into those of the next one.
fn read_errors(source: &mut Source<'_>, family: Family, errors: &mut [ErrorCode]) -> Result<(), FormatError> {
    for error in errors {
        let fall = u16::try_from(source.number(family, 0)?);
        let fall = fall.map_err(|_| source.corrupt("an error is out of its range"))?;
        error.0 = error.0.wrapping_sub(fall);
    }
    Ok(())
}

/// Puts the own errors of what an update removes: of each tetrahedron its quarterings, and whether it has the new vertex.
fn put_quarterings(out: &mut impl Put, own_fall: u8, removed: impl Iterator<Item = (u8, bool)>) {
    out.symbol(OWN_FALL, 0, u32::from(own_fall));
    let mut before = 0;
    for (own, is_home) in removed {
        out.symbol(QUARTERINGS, 2 * before + u32::from(is_home), u32::from(own));
        before = u32::from(own);
    }
}

/// Reads them, of as many tetrahedra as there are in `are_home`; returns the fall of the own errors.
fn read_quarterings(
    source: &mut Source<'_>,
    quarterings: &mut Vec<u8>,
    are_home: impl Iterator<Item = bool>,
) -> Result<u8, FormatError> {
    let own_fall = source.symbol(OWN_FALL, 0)? as u8;
    quarterings.clear();
    for is_home in are_home {
        let before = quarterings.last().map_or(0, |&before| u32::from(before));
        quarterings.push(source.symbol(QUARTERINGS, 2 * before + u32::from(is_home))? as u8);
    }
    Ok(own_fall)
}

/// The totals at the end of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Totals {
    pub updates: u32,
    pub sections: u32,
    /// Checksum of the sections' checksums.
    pub crc: u32,
}

pub fn write_end(out: &mut Vec<u8>, totals: Totals) {
    [totals.updates, totals.sections, totals.crc].into_iter().for_each(|number| write::u32(out, number));
}

pub fn read_end(mut reader: Reader<'_>) -> Result<Totals, FormatError> {
    let totals = Totals { updates: reader.u32()?, sections: reader.u32()?, crc: reader.u32()? };
    reader.end()?;
    Ok(totals)
}
