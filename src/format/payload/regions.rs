//! `regn`: the regions of the volume, those of the base tetrahedra, and which of them each block, or page of the index, reaches.

use super::bounds;
use super::index::{Index, read_region_number, read_regions, write_regions};
use crate::format::read::{MAX_STRING, Reader};
use crate::format::{EncodeError, FormatError, write};
use crate::mt::{MAX_REGIONS, MtInfo, RegionInfo, Regions};

/// The regions of a file whose base mesh has not arrived yet.
#[derive(Debug)]
pub struct RegionsHead {
    regions: Regions,
    /// Regions of consecutive base tetrahedra, and how many these are.
    runs: Vec<(u16, u32)>,
    /// For each field of the file whether it jumps; empty if none does.
    pub jumps: Vec<bool>,
}

/// Appends the section of an MT whose blocks have this index.
pub fn write(out: &mut Vec<u8>, regions: &Regions, index: &Index) -> Result<(), EncodeError> {
    let fits = |text: &String| text.len() <= MAX_STRING as usize;
    if !regions.arrays.iter().chain(regions.all.iter().map(|region| &region.name)).all(fits) {
        return Err(EncodeError::TooLong { what: "the name of a region" });
    }
    write::varint(out, regions.arrays.len() as u64);
    regions.arrays.iter().for_each(|name| write::string(out, name));
    write::varint(out, regions.all.len() as u64);
    for region in &regions.all {
        write::string(out, &region.name);
        region.labels.iter().for_each(|&label| write::varint(out, ((label << 1) ^ (label >> 63)) as u64));
        out.push(region.color);
        write::varint(out, region.tetrahedra);
        write::f64(out, region.volume);
        bounds::write(out, region.bounds);
    }
    write::f64(out, regions.deviation);
    let runs: Vec<&[u16]> = regions.of_base.chunk_by(|a, b| a == b).collect();
    write::varint(out, runs.len() as u64);
    for run in runs {
        write::varint(out, u64::from(run[0]));
        write::varint(out, run.len() as u64);
    }
    index.region_lists().for_each(|list| write_regions(out, list));
    // Nothing where no field jumps.
    out.extend(regions.sides.jumps.iter().map(|&jumps| u8::from(jumps)));
    Ok(())
}

/// Reads the section, and enters in the index which regions blocks reach. `has_sides`: it says which fields jump.
pub fn read(
    mut reader: Reader<'_>,
    info: &MtInfo,
    index: &mut Index,
    has_sides: bool,
) -> Result<RegionsHead, FormatError> {
    let mut regions = Regions::default();
    for _ in 0..reader.varint()? {
        regions.arrays.push(reader.string()?.to_owned());
    }
    let count = reader.varint()?;
    if count == 0 || count as usize > MAX_REGIONS {
        return Err(reader.corrupt("there must be 1 to 65536 regions"));
    }
    for _ in 0..count {
        regions.all.push(read_region(&mut reader, regions.arrays.len(), info.lattice.bits)?);
    }
    regions.deviation = read_amount(&mut reader)?;
    let mut runs = Vec::new();
    for _ in 0..reader.varint()? {
        runs.push((read_region_number(&mut reader, 0, count)?, reader.varint()?));
    }
    for list in index.region_lists_mut() {
        *list = read_regions(&mut reader, count)?;
    }
    let mut jumps = Vec::new();
    for _ in info.fields.iter().filter(|_| has_sides) {
        jumps.push(match reader.u8()? {
            0 => false,
            1 => true,
            _ => return Err(reader.corrupt("a field jumps at interfaces or it does not")),
        });
    }
    reader.end()?;
    Ok(RegionsHead { regions, runs, jumps })
}

fn read_amount(reader: &mut Reader<'_>) -> Result<f64, FormatError> {
    let amount = reader.f64()?;
    let is_amount = amount.is_finite() && amount >= 0.0;
    if is_amount { Ok(amount) } else { Err(reader.corrupt("a length or volume is negative or no number")) }
}

fn read_region(reader: &mut Reader<'_>, arrays: usize, bits: u32) -> Result<RegionInfo, FormatError> {
    let mut region = RegionInfo { name: reader.string()?.to_owned(), ..RegionInfo::default() };
    for _ in 0..arrays {
        let code = reader.varint64()?;
        region.labels.push((code >> 1) as i64 ^ -((code & 1) as i64));
    }
    region.color = reader.u8()?;
    region.tetrahedra = reader.varint64()?;
    region.volume = read_amount(reader)?;
    region.bounds = bounds::read_corners(reader, bits)?;
    Ok(region)
}

impl RegionsHead {
    /// How many regions there are.
    pub fn count(&self) -> u32 {
        self.regions.all.len() as u32
    }

    /// The regions of an MT with so many base tetrahedra; none if these are others.
    pub fn of_base(mut self, tets: usize) -> Option<Regions> {
        let sum: u64 = self.runs.iter().map(|(_, length)| u64::from(*length)).sum();
        if sum != tets as u64 {
            return None;
        }
        self.regions.of_base =
            self.runs.iter().flat_map(|&(region, length)| (0..length).map(move |_| region)).collect();
        Some(self.regions)
    }
}
