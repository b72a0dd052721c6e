//! `extr`: where the input has the smallest and the largest value of each field, and what averaging from cells has done to it.

use crate::format::read::{MAX_STRING, Reader};
use crate::format::{EncodeError, FormatError, write};
use crate::mesh::{Averaged, Difference, Extreme, Extremes};
use crate::mt::FieldInfo;

/// Set in the flags of a field whose extremes are known, and of one that was averaged from cells.
const KNOWN: u8 = 1;
const AVERAGED: u8 = 2;

/// Whether anything is known of any field: else there is no such section.
pub fn are_known(fields: &[FieldInfo]) -> bool {
    fields.iter().any(|field| field.extremes.is_some() || field.averaged.is_some())
}

pub fn write(out: &mut Vec<u8>, fields: &[FieldInfo]) -> Result<(), EncodeError> {
    for FieldInfo { extremes, averaged, .. } in fields {
        let flag = |is_set: bool, flag: u8| if is_set { flag } else { 0 };
        out.push(flag(extremes.is_some(), KNOWN) | flag(averaged.is_some(), AVERAGED));
        for extreme in extremes.iter().flat_map(Extremes::both) {
            write_value(out, extreme);
        }
        let Some(Averaged { input, difference }) = averaged else { continue };
        for extreme in input.both() {
            write_value(out, extreme);
            let part = extreme.part.as_deref().unwrap_or_default();
            if part.len() > MAX_STRING as usize {
                return Err(EncodeError::TooLong { what: "the name of a part of the input" });
            }
            write::varint(out, extreme.cell.unwrap_or(0).into());
            write::string(out, part);
        }
        write::f64(out, difference.rms);
        write::f64(out, difference.largest);
    }
    Ok(())
}

fn write_value(out: &mut Vec<u8>, Extreme { value, place, .. }: &Extreme) {
    write::f64(out, *value);
    place.iter().for_each(|&x| write::f64(out, x));
}

/// Reads them into the fields; whether the numbers make sense, [`MtInfo::check`](crate::mt::MtInfo::check) says.
pub fn read(mut reader: Reader<'_>, fields: &mut [FieldInfo]) -> Result<(), FormatError> {
    for field in &mut *fields {
        let flags = reader.u8()?;
        if flags & !(KNOWN | AVERAGED) != 0 {
            return Err(reader.corrupt("the flags of a field's extremes are not known"));
        }
        if flags & KNOWN != 0 {
            field.extremes = Some(read_extremes(&mut reader, false)?);
        }
        if flags & AVERAGED != 0 {
            let input = read_extremes(&mut reader, true)?;
            let difference = Difference { rms: reader.f64()?, largest: reader.f64()? };
            field.averaged = Some(Averaged { input, difference });
        }
    }
    if !are_known(fields) {
        return Err(reader.corrupt("a section of extremes has none"));
    }
    reader.end()
}

fn read_extremes(reader: &mut Reader<'_>, at_cells: bool) -> Result<Extremes, FormatError> {
    Ok(Extremes { min: read_extreme(reader, at_cells)?, max: read_extreme(reader, at_cells)? })
}

fn read_extreme(reader: &mut Reader<'_>, at_cell: bool) -> Result<Extreme, FormatError> {
    let mut extreme = Extreme { value: reader.f64()?, place: reader.f64x3()?, ..Extreme::default() };
    if at_cell {
        extreme.cell = Some(reader.varint()?);
        extreme.part = Some(reader.string()?).filter(|part| !part.is_empty()).map(str::to_owned);
    }
    Ok(extreme)
}
