//! Formats that are not read, by their content or their names: so that a message can say what a file is, and what converts it.

use std::path::Path;

use crate::error::ReadReason;
use crate::file_kind::{lower_extension, without_mark};

/// What files of a format are, and what makes a file of them that is read.
type Known = (&'static str, &'static str);

const PARAVIEW: &str = "open it in ParaView and save it as .vtu";
const MESHIO: &str = "convert it with meshio: `meshio convert FILE mesh.vtu`";
const ITK: &str = "convert it with SimpleITK, ITK-SNAP or 3D Slicer to NRRD or MetaImage";
const PICTURE: &str =
    "stack its pictures to a volume with ImageJ or SimpleITK, and save that as NRRD or MetaImage";
const SURFACE: &str = "fill it with tetrahedra first, with Gmsh, TetGen or fTetWild";
const CAD: &str = "make a mesh of tetrahedra of it first, with Gmsh or Netgen";
const UNPACK: &str = "unpack it first";

const MFEM: Known = ("a mesh of MFEM", "save it with MFEM's ParaViewDataCollection, or Mesh::PrintVTU");
const NIFTI: Known = ("a NIfTI image", ITK);
const OPENFOAM: Known =
    ("a case of OpenFOAM", "convert it with foamToVTK, or in ParaView, and give the .vtu");
const CGNS: Known = ("a file of CGNS", PARAVIEW);
const ENSIGHT: Known = ("a file of EnSight", PARAVIEW);
const ABAQUS: Known = ("an input of Abaqus", MESHIO);
const NASTRAN: Known = ("an input of Nastran", MESHIO);
const LS_DYNA: Known = ("an input of LS-DYNA", "convert it in ParaView or PrePoMax to .vtu");
const FLUENT: Known = ("a mesh or case of Fluent", "convert it in ParaView or with meshio to .vtu");
const DICOM: Known = ("a DICOM image", ITK);
const ANSYS: Known = ("an input of Ansys", "convert it with pymapdl-reader (mapdl-archive) to .vtu");
const STEP: Known = ("a CAD model (STEP)", CAD);
const IGES: Known = ("a CAD model (IGES)", CAD);
const XDMF: Known = ("a file of XDMF", "open it in ParaView, or convert it with meshio, and save it as .vtu");
const TECPLOT: Known = ("a file of Tecplot", PARAVIEW);
const UNV: Known =
    ("an I-deas universal file", "convert it with Gmsh to .msh: `gmsh FILE -save -o mesh.msh`");
const PLOT3D: Known = ("a file of PLOT3D", "open it in ParaView and save it as .vts");
const MED: Known = ("a mesh of MED (Salome)", MESHIO);
const TIFF: Known = ("a TIFF picture", PICTURE);
const STL: Known = ("a surface mesh (STL)", SURFACE);
const SU2: Known = ("a mesh of SU2", MESHIO);
const COMSOL: Known = ("a mesh of COMSOL", "save it as .vtu in COMSOL");
const ZARR: Known = (
    "a Zarr store",
    "read it in Python, and save it as raw samples with a .json sidecar, or with SimpleITK as NRRD",
);
const HDF5: Known =
    ("a file in HDF5 or netCDF, which this build of tetralod leaves out,", "use one with the feature hdf5");

/// What files begin with, behind white space and before whatever follows.
const BEGINNINGS: [(&[&[u8]], Known); 29] = [
    (&[b"MFEM "], MFEM),
    (
        &[b"version https://git-lfs"],
        ("a pointer of Git LFS, which stands for a file,", "fetch that with `git lfs pull`"),
    ),
    (&[b"\x89PNG"], ("a PNG picture", PICTURE)),
    (&[b"II*\0", b"MM\0*", b"II+\0"], TIFF),
    (&[b"\xff\xd8\xff"], ("a JPEG picture", PICTURE)),
    (&[b"BM"], ("a BMP picture", PICTURE)),
    (&[b"GIF8"], ("a GIF picture", PICTURE)),
    (&[b"ISO-10303-21"], STEP),
    (&[b"<?xml version=\"1.0\" ?><!DOCTYPE Xdmf", b"<Xdmf", b"<!DOCTYPE Xdmf"], XDMF),
    (&[b"#!TDV", b"TITLE", b"VARIABLES", b"Variables"], TECPLOT),
    (&[b"EnSight ", b"C Binary", b"Fortran Binary", b"FORMAT\ntype:", b"FORMAT\r\ntype:"], ENSIGHT),
    (&[b"*KEYWORD"], LS_DYNA),
    (
        &[b"*HEADING", b"*Heading", b"*heading", b"*NODE", b"*Node", b"*PART", b"*Part", b"*INCLUDE", b"**"],
        ABAQUS,
    ),
    (&[b"/COM", b"/PREP7", b"/BATCH"], ANSYS),
    (&[b"SOL ", b"BEGIN BULK", b"CEND", b"GRID", b"NASTRAN"], NASTRAN),
    (&[b"(0 \"", b"(1 \"", b"(0\"", b"(2 3)", b"(2 2)"], FLUENT),
    (&[b"solid"], STL),
    (&[b"ply\n", b"ply\r\n"], ("a surface mesh (PLY)", SURFACE)),
    (&[b"OFF"], ("a surface mesh (OFF)", SURFACE)),
    (&[b"glTF"], ("a surface mesh (glTF)", SURFACE)),
    (&[b"NDIME"], SU2),
    (&[b"# Created by COMSOL"], COMSOL),
    (&[b"\x93NUMPY"], ("an array of NumPy", "save it as raw samples with a .json sidecar")),
    (
        &[b"SIMPLE  ="],
        ("a FITS image", "read it in Python (astropy), and save it as raw samples with a .json sidecar"),
    ),
    (&[b"MATLAB 5.0"], ("a file of MATLAB", "save it as raw samples with a .json sidecar, or as .vtu")),
    (&[b"PK\x03\x04"], ("an archive (ZIP)", UNPACK)),
    (&[b"BZh"], ("a file compressed by bzip2", UNPACK)),
    (&[b"\x28\xb5\x2f\xfd"], ("a file compressed by Zstandard", UNPACK)),
    (&[b"\xfd7zXZ"], ("a file compressed by xz", UNPACK)),
];

/// What files are by the ending of their names, where the content does not say it.
const ENDINGS: [(&[&str], Known); 27] = [
    (&["nii", "hdr", "img"], NIFTI),
    (&["foam", "openfoam"], OPENFOAM),
    (&["cgns"], CGNS),
    (&["case", "encas", "geo", "geom"], ENSIGHT),
    (&["inp"], ABAQUS),
    (&["bdf", "nas", "fem"], NASTRAN),
    (&["k", "key", "dyn"], LS_DYNA),
    (&["cas", "dat.h5", "cas.h5", "msh.h5"], FLUENT),
    (&["dcm", "dicom", "ima"], DICOM),
    (&["cdb", "rst"], ANSYS),
    (&["step", "stp"], STEP),
    (&["iges", "igs"], IGES),
    (&["brep", "x_t", "sat", "geo_unrolled"], ("a CAD model", CAD)),
    (&["xdmf", "xmf"], XDMF),
    (&["tec", "plt", "szplt"], TECPLOT),
    (&["unv"], UNV),
    (&["p3d", "xyz", "q"], PLOT3D),
    (&["zarr"], ZARR),
    (&["tif", "tiff"], TIFF),
    (&["stl"], STL),
    (&["obj"], ("a surface mesh (Wavefront)", SURFACE)),
    (
        &["face", "edge", "neigh", "poly", "smesh"],
        ("a file of TetGen without tetrahedra", "give its .node or .ele file"),
    ),
    (&["su2"], SU2),
    (&["mphtxt", "mphbin"], COMSOL),
    (&["med"], MED),
    (
        &["vdb"],
        ("a volume of OpenVDB", "sample it on a grid, and save it as raw samples with a .json sidecar"),
    ),
    (
        &["mt"],
        (
            "a file of tetralod itself, which is a result and no input,",
            "give the mesh that it was built from",
        ),
    ),
];

/// Why a file that no reader knows is refused: by what it is, if that is known.
pub(super) fn refused(name: &str, bytes: &[u8]) -> ReadReason {
    let found = by_content(bytes).or_else(|| by_name(name));
    found.map_or(ReadReason::UnknownFormat, |(what, remedy)| ReadReason::unsupported(what, remedy))
}

/// Refuses a file in HDF5 whose root has these groups and datasets, if it is of another format than those that are read: Exodus has no
/// groups. The library for netCDF follows each way to a group, of which a small file may have any number.
#[cfg(feature = "hdf5")]
pub(super) fn refuse_hdf5(groups: &[String], datasets: &[String]) -> Result<(), ReadReason> {
    let has = |name: &str| groups.iter().chain(datasets).any(|member| member == name);
    let (what, remedy) = if has("CGNSLibraryVersion") || has(" hdf5version") {
        CGNS
    } else if has("meshes") && has("settings") {
        FLUENT
    } else if has("ENS_MAA") {
        MED
    } else if let Some(group) = groups.first() {
        let what = format!("a file in HDF5 with the group \"{group}\", which is neither VTKHDF nor Exodus");
        let remedy = "convert it to one of these with a tool that reads it; Exodus has all in the root, without groups";
        return Err(ReadReason::unsupported(what, remedy));
    } else {
        return Ok(());
    };
    Err(ReadReason::unsupported(what, remedy))
}

/// Whether XML is of another format than VTK's.
pub(super) fn is_foreign_xml(bytes: &[u8]) -> bool {
    let head = bytes.get(..1 << 12).unwrap_or(bytes);
    ["<Xdmf", "<dolfin"].iter().any(|root| head.windows(root.len()).any(|window| window == root.as_bytes()))
}

/// Why a folder is refused.
pub(super) fn refused_folder(path: &Path) -> ReadReason {
    let has = |file: &str| path.join(file).exists();
    let holds = |ending: &str| {
        let entries = path.read_dir().into_iter().flatten().flatten().take(1 << 10);
        entries.map(|entry| entry.path()).any(|file| lower_extension(&file) == ending)
    };
    let is_foam = has("constant/polyMesh") || has("system/controlDict") || has("faces") && has("owner");
    let (what, remedy) = if is_foam {
        OPENFOAM
    } else if has(".zgroup") || has(".zarray") || has("zarr.json") {
        ZARR
    } else if holds("dcm") || holds("ima") {
        ("a folder of DICOM images", ITK)
    } else if holds("tif") || holds("tiff") || holds("png") {
        ("a folder of pictures", PICTURE)
    } else {
        ("a folder", "give a file")
    };
    ReadReason::unsupported(what, remedy)
}

fn by_content(bytes: &[u8]) -> Option<Known> {
    let start = without_mark(bytes);
    let head = start.get(..1 << 12).unwrap_or(start);
    let at = |range: std::ops::Range<usize>, word: &[u8]| bytes.get(range) == Some(word);
    let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    if !cfg!(feature = "hdf5") && (bytes.starts_with(b"\x89HDF") || bytes.starts_with(b"CDF")) {
        return Some(HDF5);
    }
    if at(128..132, b"DICM") {
        return Some(DICOM);
    }
    if [b"n+1\0", b"ni1\0"].iter().any(|word| at(344..348, *word)) || at(4..8, b"n+2\0") || at(4..8, b"ni2\0")
    {
        return Some(NIFTI);
    }
    if at(208..212, b"MAP ") {
        return Some((
            "a map of MRC or CCP4",
            "read it in Python (mrcfile), and save it as raw samples with a .json sidecar",
        ));
    }
    if at(4..8, b"ADF ") || has(b"ADF Database Version") {
        return Some(CGNS);
    }
    if has(b"FoamFile") {
        return Some(OPENFOAM);
    }
    if start.starts_with(b"<") && has(b"<Xdmf") {
        return Some(XDMF);
    }
    if start.starts_with(b"<") && has(b"<dolfin") {
        return Some(("a mesh of DOLFIN", MESHIO));
    }
    let begins = |beginnings: &[&[u8]]| beginnings.iter().any(|beginning| start.starts_with(beginning));
    let known = BEGINNINGS.iter().find(|(beginnings, _)| begins(beginnings)).map(|(_, known)| *known);
    known.or_else(|| by_lines(head))
}

/// What is known by more than its first words.
fn by_lines(head: &[u8]) -> Option<Known> {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let first = lines.next()?;
    let second = lines.next().unwrap_or_default();
    // A data set begins with a line of -1, then its number.
    if first == "-1" && second.parse::<u32>().is_ok() {
        return Some(UNV);
    }
    // Fixed format: the letter of the section is in column 73.
    let fixed = text.lines().next().unwrap_or_default();
    if fixed.len() >= 80 && fixed.as_bytes().get(72) == Some(&b'S') {
        return Some(IGES);
    }
    // Remarks begin with a dollar sign, as sections of Gmsh do.
    let is_card = |line: &str| {
        ["GRID", "CTETRA", "BEGIN BULK", "SOL ", "CEND"].iter().any(|card| line.starts_with(card))
    };
    if first.starts_with('$') && text.lines().any(is_card) {
        return Some(NASTRAN);
    }
    if first.starts_with('$') && text.lines().any(|line| line.starts_with("*KEYWORD")) {
        return Some(LS_DYNA);
    }
    if first.starts_with('#')
        && text.lines().any(|line| line.starts_with("type:") && line.contains("ensight"))
    {
        return Some(ENSIGHT);
    }
    (first == "FORMAT" && second.starts_with("type")).then_some(ENSIGHT)
}

fn by_name(name: &str) -> Option<Known> {
    let name = name.to_ascii_lowercase();
    let is_of = |ending: &&&str| name.strip_suffix(**ending).is_some_and(|rest| rest.ends_with('.'));
    ENDINGS.iter().find(|(endings, _)| endings.iter().any(|ending| is_of(&ending))).map(|(_, known)| *known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_that_are_not_read_are_named() {
        let of = |name: &str, bytes: &[u8]| refused(name, bytes).to_string();
        for (content, word) in [
            ("MFEM mesh v1.0\n", "MFEM"),
            ("version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
            ("FoamFile\n{\n", "OpenFOAM"),
            ("/*---*\\\n| OpenFOAM |\n*/\nFoamFile { version 2.0; }", "OpenFOAM"),
            ("EnSight Model Geometry File\n", "EnSight"),
            ("FORMAT\ntype:  ensight gold\n", "EnSight"),
            ("# made by hand\nFORMAT\ntype: ensight\n", "EnSight"),
            ("*Heading\n", "Abaqus"),
            ("** a remark\n*Node\n", "Abaqus"),
            ("$ a remark\nBEGIN BULK\nGRID,1,,0.,0.,0.\n", "Nastran"),
            ("$ a remark\n*KEYWORD\n", "LS-DYNA"),
            ("*KEYWORD\n", "LS-DYNA"),
            ("(0 \"GAMBIT to Fluent File\")\n", "Fluent"),
            ("/COM,ANSYS RELEASE 19\n", "Ansys"),
            ("ISO-10303-21;\n", "STEP"),
            ("<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">", "XDMF"),
            ("TITLE = \"a\"\nVARIABLES = \"x\"\n", "Tecplot"),
            ("    -1\n  2411\n", "universal file"),
            ("solid a\nfacet normal 0 0 1\n", "surface mesh (STL)"),
            ("OFF\n3 1 0\n", "surface mesh (OFF)"),
        ] {
            let message = of("a", content.as_bytes());
            assert!(message.contains(word) && message.contains("; "), "{content}: {message}");
        }
        let mut nifti = vec![0; 348];
        nifti[344..].copy_from_slice(b"n+1\0");
        assert!(of("a", &nifti).contains("NIfTI"));
        let dicom = [&[0; 128], b"DICM".as_slice()].concat();
        assert!(of("a", &dicom).contains("DICOM"));
        let iges = format!("{:<72}S      1\n", "a model");
        assert!(of("a", iges.as_bytes()).contains("IGES"));
        assert!(of("a.p3d", b"\x01\x02").contains("PLOT3D"));
        assert!(of("A.CGNS", b"\x01\x02").contains("CGNS"));
        let word = if cfg!(feature = "hdf5") { "Fluent" } else { "HDF5" };
        assert!(of("a.cas.h5", b"\x89HDF").contains(word));
        assert!(of("a", b"\x89PNG").contains("PNG"));
        assert_eq!(refused("a.txt", b"words"), ReadReason::UnknownFormat);
    }
}
