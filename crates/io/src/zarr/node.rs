//! The metadata of arrays and groups, of both versions.

use serde_json::{Map, Value};

use crate::error::{At, ReadError, ReadReason};
use crate::zarr::store::Store;

/// The attribute in which xarray and others keep the names of the axes of an array in version 2.
const NAMES: &str = "_ARRAY_DIMENSIONS";

/// An array or a group.
#[derive(Debug)]
pub(super) struct Node {
    pub attributes: Map<String, Value>,
    pub kind: Kind,
}

#[derive(Debug)]
pub(super) enum Kind {
    Array {
        shape: Vec<u64>,
        /// The names of the axes; an empty one where an axis has none.
        names: Option<Vec<String>>,
    },
    /// With the metadata of what is in it, as far as it has that, by path.
    Group { consolidated: Option<Map<String, Value>> },
}

/// The key of an object below a path in the store.
pub(super) fn key(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") }
}

impl Node {
    /// What is at a path in a store; none if nothing is.
    pub fn of(store: &Store, path: &str) -> Result<Option<Self>, ReadError> {
        let load = |name: &str| json(store, &key(path, name));
        if let Some(metadata) = load("zarr.json")? {
            return Self::of_version_3(&metadata).at(|| key(path, "zarr.json")).map(Some);
        }
        let array = load(".zarray")?;
        let group = if array.is_some() { None } else { load(".zgroup")? };
        let attributes = load(".zattrs")?;
        if let Some(array) = array {
            return Self::array(attributes.unwrap_or_default(), &array).at(|| key(path, ".zarray")).map(Some);
        }
        // OME-Zarr was written without a group, too.
        if group.is_none() && !attributes.as_ref().is_some_and(|of| of.contains_key("multiscales")) {
            return Ok(None);
        }
        let consolidated = load(".zmetadata")?;
        let kind =
            Kind::Group { consolidated: consolidated.and_then(|all| object(&all, "metadata").cloned()) };
        Ok(Some(Self { attributes: attributes.unwrap_or_default(), kind }))
    }

    fn of_version_3(metadata: &Map<String, Value>) -> Result<Self, ReadReason> {
        let attributes = object(metadata, "attributes").cloned().unwrap_or_default();
        match metadata.get("node_type").and_then(Value::as_str) {
            Some("array") => Self::array(attributes, metadata),
            Some("group") => {
                let all = object(metadata, "consolidated_metadata").and_then(|all| object(all, "metadata"));
                Ok(Self { attributes, kind: Kind::Group { consolidated: all.cloned() } })
            }
            _ => Err(ReadReason::Missing("the member \"node_type\", \"array\" or \"group\",".into())),
        }
    }

    /// `metadata` is that of an array of either version.
    fn array(attributes: Map<String, Value>, metadata: &Map<String, Value>) -> Result<Self, ReadReason> {
        let missing = || ReadReason::Missing("the member \"shape\", a list of counts,".into());
        let shape: Option<Vec<u64>> = metadata
            .get("shape")
            .and_then(Value::as_array)
            .and_then(|list| list.iter().map(Value::as_u64).collect());
        let names = metadata.get("dimension_names").filter(|names| !names.is_null());
        let names = names.or_else(|| attributes.get(NAMES)).and_then(Value::as_array);
        let names =
            names.map(|list| list.iter().map(|name| name.as_str().unwrap_or_default().to_owned()).collect());
        let kind = Kind::Array { shape: shape.ok_or_else(missing)?, names };
        Ok(Self { attributes, kind })
    }

    /// Arrays and groups directly in a group at the root of the store, by name; none if that is not known.
    pub fn children(&self, store: &Store) -> Result<Option<Vec<(String, Self)>>, ReadError> {
        let Kind::Group { consolidated } = &self.kind else { return Ok(None) };
        let mut names = match (consolidated, store.folders().at(String::new)?) {
            (_, Some(folders)) => folders,
            (Some(all), None) => all
                .keys()
                .filter_map(|path| path.split_once('/').map_or(Some(path.as_str()), |(first, _)| Some(first)))
                .filter(|name| !name.starts_with('.'))
                .map(str::to_owned)
                .collect(),
            (None, None) => return Ok(None),
        };
        names.sort_unstable();
        names.dedup();
        let mut children = Vec::new();
        for name in names {
            if let Some(node) = Self::of(store, &name)? {
                children.push((name, node));
            }
        }
        Ok(Some(children))
    }
}

/// A member that is an object.
pub(super) fn object<'a>(of: &'a Map<String, Value>, name: &str) -> Option<&'a Map<String, Value>> {
    of.get(name).and_then(Value::as_object)
}

/// An object in JSON; none if there is none.
fn json(store: &Store, key: &str) -> Result<Option<Map<String, Value>>, ReadError> {
    let place = || key.to_owned();
    let Some(bytes) = store.metadata(key).at(place)? else { return Ok(None) };
    let object = serde_json::from_slice(&bytes);
    object
        .map_err(|error| ReadReason::Syntax(format!("it is no object in JSON: {error}")))
        .at(place)
        .map(Some)
}
