//! What a scene shows, as plain data: it can be saved, sent and compared.

use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use tetralod::geom::Bounds;
use tetralod::view::{ClipPlane, Colormap, Plane, VIRIDIS};

/// What a scene shows. The default is the outline of the domain alone.
///
/// Everything is opaque, lit and cut by the clip planes unless it says otherwise. In JSON, names are in camel case, and what is left
/// out has its default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct SceneState {
    /// Isosurfaces, each with a look of its own.
    pub isosurfaces: Vec<IsosurfaceState>,
    /// The volume, as emission and absorption.
    pub volume: Option<VolumeState>,
    /// Sections with planes.
    pub slices: Vec<SliceState>,
    /// The surface of the domain, coloured by the field.
    pub boundary: Option<BoundaryState>,
    /// The tetrahedra as they are.
    pub cells: Option<CellState>,
    /// Tubes along a vector field.
    pub streamlines: Option<StreamlineState>,
    /// Arrows of a vector field.
    pub arrows: Option<ArrowState>,
    /// What displaces all that is shown.
    pub deform: Option<DeformState>,
    /// What is cut away.
    pub clips: Vec<PlaneState>,
    /// A box outside of which everything is cut away: `[x0, y0, z0, x1, y1, z1]`.
    pub clip_box: Option<[f64; 6]>,
    /// The colours of values.
    pub colours: ColourState,
    /// Behind everything.
    pub background: Background,
    /// How dark places get that hardly any light reaches, 0 to 1.
    pub shade: f64,
    /// Whether the box around the domain is drawn.
    pub outline: bool,
    /// The regions that are shown, by their names or labels; all if there is no list. What is drawn of the others is nothing.
    pub regions: Option<Vec<RegionName>>,
    /// The part alone that is within a range of a field.
    pub threshold: Option<ThresholdState>,
    /// A box with handles: `[x0, y0, z0, x1, y1, z1]`. A picture only.
    pub region: Option<[f64; 6]>,
    /// The mesh beside the one that was kept: see [`Scene::keep`](super::Scene::keep).
    pub compare: Option<CompareState>,
}

impl Default for SceneState {
    fn default() -> Self {
        Self {
            isosurfaces: Vec::new(),
            volume: None,
            slices: Vec::new(),
            boundary: None,
            cells: None,
            streamlines: None,
            arrows: None,
            deform: None,
            clips: Vec::new(),
            clip_box: None,
            colours: ColourState::default(),
            background: Background::default(),
            shade: 0.5,
            outline: true,
            regions: None,
            threshold: None,
            region: None,
            compare: None,
        }
    }
}

/// What a region of a file is called in a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum RegionName {
    /// Its label, where a single array tells regions apart.
    Label(i64),
    /// Its name.
    Name(String),
}

impl fmt::Display for RegionName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Label(label) => label.fmt(f),
            Self::Name(name) => name.fmt(f),
        }
    }
}

/// What is shown of the mesh: where a field has a value within a range. What is drawn of all else is nothing, so the boundary is that of what
/// is shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThresholdState {
    /// The name of the field; the one that is shown if it is left out.
    #[serde(default)]
    pub field: Option<String>,
    /// The least and the largest value, in units of the field; both ends belong to it.
    pub range: [f64; 2],
    /// Whether tetrahedra are cut where the field crosses an end of the range. Else they are shown as a whole: those whose four vertices have
    /// a value within it.
    #[serde(default)]
    pub cut: bool,
}

/// The points of a plane: `normal · p = offset`. As a clip plane it cuts away the side that the normal points to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneState {
    /// Any length but zero.
    pub normal: [f64; 3],
    /// In model units, times the length of the normal.
    pub offset: f64,
}

impl PlaneState {
    pub(super) fn plane(&self) -> Plane {
        Plane { normal: self.normal, offset: self.offset }
    }

    pub(super) fn clip(&self) -> ClipPlane {
        ClipPlane { normal: self.normal, offset: self.offset }
    }

    pub(super) fn is_plane(&self) -> bool {
        let is_finite = self.normal.iter().chain([&self.offset]).all(|x| x.is_finite());
        is_finite && self.normal.iter().any(|x| *x != 0.0)
    }
}

/// An isosurface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct IsosurfaceState {
    /// In units of the field; [`Session::first_isovalue`](tetralod::session::Session::first_isovalue) if it is left out.
    pub value: Option<f64>,
    /// 0 to 1.
    pub opacity: f64,
    /// One colour for both sides; without it, and without `field`, each side has one of its own.
    pub colour: Option<Colour>,
    /// The field whose values colour it.
    pub field: Option<String>,
    /// Whether the sides of its facets are drawn.
    pub edges: bool,
}

impl Default for IsosurfaceState {
    fn default() -> Self {
        Self { value: None, opacity: 1.0, colour: None, field: None, edges: false }
    }
}

/// The volume: which opacity each value has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct VolumeState {
    /// Values in units of the field, ascending, each with an opacity of 0 to 1; a ramp over the range of the colours if there are
    /// none. Colours are those of the scene's scale.
    pub opacities: Vec<[f64; 2]>,
    /// Values, each with red, green, blue and opacity of 0 to 1: instead of `opacities` and the scene's colours.
    pub points: Vec<[f64; 5]>,
    /// The way, in model units, that has these opacities; a tenth of the domain's diagonal if it is left out.
    pub unit_length: Option<f64>,
    /// Whether clip planes cut it.
    pub clipped: bool,
}

impl Default for VolumeState {
    fn default() -> Self {
        Self { opacities: Vec::new(), points: Vec::new(), unit_length: None, clipped: true }
    }
}

/// A section with a plane, coloured by the field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub struct SliceState {
    /// See [`PlaneState`].
    pub normal: [f64; 3],
    /// See [`PlaneState`].
    pub offset: f64,
    /// 0 to 1.
    #[serde(default = "one")]
    pub opacity: f64,
    /// Whether the edges of the tetrahedra that it cuts are drawn.
    #[serde(default)]
    pub edges: bool,
    /// The field that colours it; the one that is shown if it is left out.
    #[serde(default)]
    pub field: Option<String>,
    /// Whether clip planes cut it; one that is the same plane does not.
    #[serde(default = "yes")]
    pub clipped: bool,
}

impl SliceState {
    pub(super) fn plane(&self) -> PlaneState {
        PlaneState { normal: self.normal, offset: self.offset }
    }
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

/// The surface of the domain. What clip planes cut open is closed by sections with them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct BoundaryState {
    /// 0 to 1.
    pub opacity: f64,
    /// Regions with another opacity, by their names or labels. Where a region is more opaque than one beside it, its interface with that is
    /// drawn, too: it is seen through the other.
    pub region_opacities: BTreeMap<String, f64>,
    /// Whether the edges of tetrahedra are drawn.
    pub edges: bool,
    /// One colour instead of those of the values.
    pub colour: Option<Colour>,
    /// What gives it its colours, where it has not one alone.
    pub colour_by: ColourBy,
    /// Whether clip planes cut it, and what they cut open is closed.
    pub clipped: bool,
}

impl Default for BoundaryState {
    fn default() -> Self {
        Self {
            opacity: 1.0,
            region_opacities: BTreeMap::new(),
            edges: false,
            colour: None,
            colour_by: ColourBy::Field,
            clipped: true,
        }
    }
}

/// What the boundary is coloured by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum ColourBy {
    /// The values of the field.
    #[default]
    Field,
    /// The regions, each with a colour of its own. Without regions it is the field.
    Region,
}

impl ColourBy {
    const NAMES: [(Self, &'static str); 2] = [(Self::Field, "field"), (Self::Region, "region")];
}

/// The tetrahedra.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct CellState {
    /// What they look like.
    pub shape: CellKind,
    /// By which part of their size they are shrunk, 0 to 1.
    pub shrink: f64,
    /// Tetrahedra with their centroid on the side that the normal points to are left out as a whole.
    pub cut: Option<PlaneState>,
    /// What colours them: `"field"` or the name of a [`TetQuantity`](tetralod::session::TetQuantity).
    pub colour_by: String,
    /// Whether edges are drawn.
    pub edges: bool,
    /// Width of wires and diameter of points, in units of the page's layout.
    pub width: f64,
}

impl Default for CellState {
    fn default() -> Self {
        Self {
            shape: CellKind::Solid,
            shrink: 0.0,
            cut: None,
            colour_by: "field".to_owned(),
            edges: true,
            width: 1.1,
        }
    }
}

/// What tetrahedra look like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum CellKind {
    /// Solid.
    #[default]
    Solid,
    /// Their edges alone.
    Wire,
    /// Their points.
    Points,
}

impl CellKind {
    const NAMES: [(Self, &'static str); 3] =
        [(Self::Solid, "solid"), (Self::Wire, "wire"), (Self::Points, "points")];
}

/// What is behind everything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum Background {
    /// A dark gradient.
    #[default]
    Dark,
    /// Nearly white.
    Light,
    /// Nothing.
    Transparent,
}

impl Background {
    const NAMES: [(Self, &'static str); 3] =
        [(Self::Dark, "dark"), (Self::Light, "light"), (Self::Transparent, "transparent")];
}

/// Reading and writing of enums by their names.
macro_rules! named {
    ($type:ty) => {
        impl TryFrom<String> for $type {
            type Error = String;

            fn try_from(name: String) -> Result<Self, String> {
                let found = Self::NAMES.iter().find(|(_, own)| *own == name);
                let names = || Self::NAMES.map(|(_, own)| format!("{own:?}")).join(", ");
                found.map(|(value, _)| *value).ok_or_else(|| format!("must be one of {}", names()))
            }
        }

        impl From<$type> for &'static str {
            fn from(value: $type) -> Self {
                <$type>::NAMES.iter().find(|(own, _)| *own == value).map_or("", |(_, name)| name)
            }
        }
    };
}

named!(CellKind);
named!(ColourBy);
named!(Background);

/// Tubes along a vector field.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct StreamlineState {
    /// The names of the fields along x, y and z.
    pub fields: [String; 3],
    /// Where they start, in model units.
    pub seeds: Vec<[f64; 3]>,
    /// Radius in model units; 1/400 of the domain's diagonal if it is left out.
    pub radius: Option<f64>,
    /// The field that colours them; the speed if it is left out, from 0 to the largest that the ranges of the components allow.
    pub field: Option<String>,
}

/// Arrows of a vector field.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct ArrowState {
    /// The names of the fields along x, y and z.
    pub fields: [String; 3],
    /// From one to the next, in model units; a twentieth of the domain's diagonal if it is left out.
    pub spacing: Option<f64>,
    /// The field that colours them; the magnitude if it is left out, over the range of the speed of [`StreamlineState::field`].
    pub field: Option<String>,
    /// Whether all have the same length.
    pub constant: bool,
}

/// Everything is drawn where a vector field displaces it, by so many times the vector at each place.
///
/// Places of the state itself are those of the model as it is: planes, boxes and seeds. What they cut moves along, and so does what they
/// are a section of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct DeformState {
    /// The name of the vector. Its components are the fields that the file says so of, those of this name with `_x`, `_y` and `_z`, or three
    /// that it lists with commas between them.
    pub field: String,
    /// How many times the vector. If it is left out, nothing goes farther than [`Deformation::AUTOMATIC`](tetralod::session::Deformation::AUTOMATIC) of the domain's
    /// diagonal: by the ranges of the components, so at all times and in all meshes the same.
    pub factor: Option<f64>,
    /// For what swings: how much of a period has passed. The displacement is that times the sine: none at 0, all at 0.25, against the
    /// vector at 0.75. If it is left out, all of it.
    pub phase: Option<f64>,
    /// Whether the boundary as it is without displacement is drawn, too, so that one sees through it.
    pub undeformed: bool,
}

impl DeformState {
    /// The same with another factor and at another phase.
    pub(super) fn at_rest(&self) -> Self {
        Self { factor: None, phase: None, ..self.clone() }
    }
}

/// The mesh that was kept on the left, the current one on the right.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct CompareState {
    /// Where the one ends and the other begins, as a fraction of the width.
    pub at: f64,
    /// Whether the current mesh is coloured by its field minus that of the mesh that was kept, with a range of colours
    /// that is symmetric around 0.
    pub difference: bool,
}

impl Default for CompareState {
    fn default() -> Self {
        Self { at: 0.5, difference: false }
    }
}

/// The colours of values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct ColourState {
    /// The colour map.
    pub map: MapName,
    /// The values of the field that is shown with the first and the last colour; if it is left out, and for other fields, their range over
    /// all of their time steps.
    pub range: Option<[f64; 2]>,
    /// Whether the colours run backwards.
    pub reversed: bool,
    /// Whether the scale is logarithmic. Without a range it has the positive part of the values; without such a part it is linear.
    pub log: bool,
    /// How many colours there are, each for an equal part of the range: 2 to 64. Without it they run into one another.
    #[serde(deserialize_with = "number_of_bands")]
    pub bands: Option<u8>,
}

/// What is no such number becomes 0, which is refused like all that are too small.
fn number_of_bands<'de, D: Deserializer<'de>>(from: D) -> Result<Option<u8>, D::Error> {
    let number = Option::<f64>::deserialize(from)?;
    Ok(number.map(|number| if number.fract() == 0.0 { number as u8 } else { 0 }))
}

impl Default for ColourState {
    fn default() -> Self {
        Self { map: MapName(VIRIDIS), range: None, reversed: false, log: false, bands: None }
    }
}

/// A colour map, written as its name.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub struct MapName(pub Colormap);

impl TryFrom<String> for MapName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let names = || Colormap::ALL.map(|map| map.name).join(", ");
        Colormap::named(&name).map(Self).ok_or_else(|| format!("must be a colour map: {}", names()))
    }
}

impl From<MapName> for &'static str {
    fn from(name: MapName) -> Self {
        name.0.name
    }
}

/// An sRGB colour, written as `"#rrggbb"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Colour(pub [u8; 3]);

impl TryFrom<String> for Colour {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, &'static str> {
        let wrong = "must be a colour such as \"#e8b35c\"";
        let digits = text.strip_prefix('#').ok_or(wrong)?;
        if digits.len() != 6 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return Err(wrong);
        }
        let number = u32::from_str_radix(digits, 16).map_err(|_| wrong)?;
        let [_, r, g, b] = number.to_be_bytes();
        Ok(Self([r, g, b]))
    }
}

impl From<Colour> for String {
    fn from(Colour([r, g, b]): Colour) -> Self {
        format!("#{r:02x}{g:02x}{b:02x}")
    }
}

impl Colour {
    /// Red, green and blue from 0 to 1.
    pub fn rgb(self) -> [f32; 3] {
        self.0.map(|c| f32::from(c) / 255.0)
    }
}

/// The box of six numbers; none if its corners are exchanged or not finite.
pub(super) fn bounds(&[x0, y0, z0, x1, y1, z1]: &[f64; 6]) -> Option<Bounds> {
    let is_box = x0 <= x1 && y0 <= y1 && z0 <= z1 && [x0, y0, z0, x1, y1, z1].iter().all(|x| x.is_finite());
    is_box.then_some(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_and_names_come_back() {
        let colour = Colour::try_from("#e8b35c".to_owned()).expect("a colour");
        assert_eq!(String::from(colour), "#e8b35c");
        assert!(
            ["e8b35c", "#e8b35", "#é8b35", "#+8b35c1", "#ggb35c"]
                .iter()
                .all(|text| { Colour::try_from((*text).to_owned()).is_err() })
        );
        for (kind, name) in CellKind::NAMES {
            assert_eq!(CellKind::try_from(name.to_owned()), Ok(kind));
            assert_eq!(<&str>::from(kind), name);
        }
        assert!(Background::try_from("pink".to_owned()).is_err_and(|why| why.contains("\"light\"")));
    }

    #[test]
    fn boxes_are_finite_and_ascend() {
        assert!(bounds(&[0.0, 0.0, 0.0, 1.0, 0.0, 2.0]).is_some());
        assert!(bounds(&[0.0, 0.0, 0.0, 1.0, -1.0, 2.0]).is_none());
        assert!(bounds(&[0.0, 0.0, f64::NAN, 1.0, 1.0, 2.0]).is_none());
        assert!(bounds(&[0.0, 0.0, 0.0, 1.0, 1.0, f64::INFINITY]).is_none());
    }
}
