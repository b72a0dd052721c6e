//! `INFO`: the description of an MT.

use super::kind_codec::{CODECS, number_of};
use crate::format::read::{MAX_STRING, Reader};
use crate::format::{EncodeError, FormatError, write};
use crate::geom::Lattice;
use crate::mesh::VectorPart;
use crate::mt::{FieldInfo, MtInfo};
use std::collections::BTreeMap;

/// Key and value of each entry, in ascending order of the keys.
pub type Metadata = Vec<(String, String)>;

/// Largest `INFO` section that is written.
const MAX_INFO_BYTES: usize = 1 << 20;

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
    out.push(number_of(info.kind));
    write::u32(out, info.vertices);
    let tetrahedra = info.tetrahedra.to_le_bytes();
    out.extend_from_slice(if has_many_tets(info) { &tetrahedra } else { &tetrahedra[..4] });
    write::u32(out, info.updates);
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
    if has_details(info) {
        write_details(out, info);
    }
    if out.len() > MAX_INFO_BYTES {
        return Err(EncodeError::TooLong { what: "the description with all metadata" });
    }
    Ok(())
}

/// Whether there are so many tetrahedra that their number has 64 bits. The header says so of a file.
pub fn has_many_tets(info: &MtInfo) -> bool {
    info.tetrahedra > u64::from(u32::MAX)
}

pub fn read_info(mut reader: Reader<'_>, many_tets: bool) -> Result<(MtInfo, Metadata), FormatError> {
    let number = reader.u8()?;
    let codec = CODECS.iter().find(|codec| codec.number == number);
    let kind = codec.ok_or_else(|| reader.corrupt("the kind of MT is not known"))?.kind;
    let vertices = reader.u32()?;
    let [low, high] = [reader.u32()?, if many_tets { reader.u32()? } else { 0 }];
    let tetrahedra = u64::from(high) << 32 | u64::from(low);
    if many_tets && high == 0 {
        return Err(reader.corrupt("a number of tetrahedra has 64 bits although 32 are enough"));
    }
    let updates = reader.u32()?;
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
    if !reader.is_empty() {
        read_details(&mut reader, &mut info)?;
    }
    reader.end()?;
    info.check()?;
    Ok((info, metadata))
}

/// Set in the flags of a field that is a part of a vector, and that is its length; of a field of a known time; of a label.
const OF_VECTOR: u8 = 1;
const IS_LENGTH: u8 = 2;
const HAS_TIME: u8 = 4;
const IS_LABEL: u8 = 8;

/// Whether lattices round something off, or a field has a unit, a vector or a time, or is a label: else nothing of that is written.
fn has_details(info: &MtInfo) -> bool {
    let of_field = |field: &FieldInfo| {
        let has_name = !field.unit.is_empty() || field.vector.is_some();
        has_name || field.time.is_some() || field.is_label || field.quantization != 0.0
    };
    info.quantization != 0.0 || info.fields.iter().any(of_field)
}

fn write_details(out: &mut Vec<u8>, info: &MtInfo) {
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
        let flag = |is_set: bool, flag: u8| if is_set { flag } else { 0 };
        out.push(of_vector | flag(field.time.is_some(), HAS_TIME) | flag(field.is_label, IS_LABEL));
        if let Some(VectorPart { name, component }) = &field.vector {
            write::string(out, name);
            out.extend(component);
        }
        field.time.iter().for_each(|&time| write::f64(out, time));
    }
}

fn read_details(reader: &mut Reader<'_>, info: &mut MtInfo) -> Result<(), FormatError> {
    info.quantization = reader.f64()?;
    for field in &mut info.fields {
        field.quantization = reader.f64()?;
        field.unit = reader.string()?.to_owned();
        let flags = reader.u8()?;
        let known = OF_VECTOR | IS_LENGTH | HAS_TIME | IS_LABEL;
        if flags & !known != 0 || flags & (OF_VECTOR | IS_LENGTH) == IS_LENGTH {
            return Err(reader.corrupt("the flags of a field are not known"));
        }
        field.is_label = flags & IS_LABEL != 0;
        if field.is_label && (field.step != 1.0 || field.origin.fract() != 0.0) {
            return Err(reader.corrupt("the values of a label are not whole numbers"));
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
