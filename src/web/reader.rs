//! Reads a value of JavaScript as a type that serde describes.
//!
//! `serde-wasm-bindgen`, which makes the [results](super::results), skips names that a struct does not have, does not say where in
//! an object a value stands, and links the formatting of floats for its messages. [`Reader`] refuses such names, and its errors
//! name the option by its whole path.

use super::error::WebError;
use js_sys::{Array, Object, Reflect};
use serde::de::value::StringDeserializer;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Expected, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, Visitor,
};
use serde::forward_to_deserialize_any;
use std::fmt;
use thiserror::Error;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen]
extern "C" {
    /// The global function of this name: a text for any value.
    #[wasm_bindgen(js_name = String, catch)]
    fn text(value: &JsValue) -> Result<String, JsValue>;
}

/// Reads `value`.
pub fn read<T: DeserializeOwned>(value: &JsValue) -> Result<T, ReadError> {
    T::deserialize(Reader::new(value.clone()))
}

/// An array, typed array or anything like one, as an array.
pub fn list(value: &JsValue) -> Option<Array> {
    let has_length = || Reflect::get(value, &"length".into()).is_ok_and(|length| length.as_f64().is_some());
    (value.is_object() && has_length()).then(|| Array::from(value))
}

/// An option that cannot be used, and why.
#[derive(Debug, Error)]
#[error("{path}: {problem}")]
pub struct ReadError {
    /// The option, from the value on that was read; empty for that value itself.
    path: String,
    problem: String,
}

impl ReadError {
    #[inline(never)]
    pub fn new(problem: &str) -> Self {
        Self { path: String::new(), problem: problem.to_owned() }
    }

    /// Adds what `options` contain at the path.
    #[inline(never)]
    pub fn with_value(mut self, options: &JsValue) -> Self {
        let mut value = options.clone();
        for name in self.path.split(['.', '[', ']']).filter(|name| !name.is_empty()) {
            value = Reflect::get(&value, &name.into()).unwrap_or(JsValue::UNDEFINED);
        }
        if let (false, Ok(text)) = (value.is_undefined(), text(&value)) {
            self.problem += "; given: ";
            self.problem += &text;
        }
        self
    }

    /// The error of the option `name`, in which this one was found.
    #[inline(never)]
    pub fn inside(mut self, name: &str) -> Self {
        let between = if self.path.is_empty() || self.path.starts_with('[') { "" } else { "." };
        self.path = format!("{name}{between}{}", self.path);
        self
    }
}

impl From<ReadError> for WebError {
    fn from(error: ReadError) -> Self {
        let path = if error.path.is_empty() { "options" } else { &error.path };
        Self::bad_option(path, &error.problem)
    }
}

impl serde::de::Error for ReadError {
    fn custom<T: fmt::Display>(problem: T) -> Self {
        Self::new(&problem.to_string())
    }

    /// [`ReadError::with_value`] adds the value: formatting `Unexpected` would be larger than all of this.
    fn invalid_type(_: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(&format!("must be {expected}"))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(_: usize, expected: &dyn Expected) -> Self {
        Self::invalid_type(Unexpected::Seq, expected)
    }

    fn missing_field(name: &'static str) -> Self {
        Self::new("is missing").inside(name)
    }

    fn unknown_field(name: &str, known: &'static [&'static str]) -> Self {
        Self::new(&format!("there is none of this name, only {}", known.join(", "))).inside(name)
    }
}

/// A value, and which of its members are read.
pub struct Reader {
    value: JsValue,
    /// The names that the second type of [`Reader::read_both`] reads.
    names: &'static [&'static str],
    is_ours: bool,
}

impl Reader {
    fn new(value: JsValue) -> Self {
        Self { value, names: &[], is_ours: false }
    }

    // What is no generic code stays out of it: the same for each type would be a large part of the wasm.

    #[inline(never)]
    fn number(&self) -> Result<f64, ReadError> {
        self.value.as_f64().ok_or_else(|| ReadError::new("must be a number"))
    }

    #[inline(never)]
    fn items(&self) -> Result<Items, ReadError> {
        let array = list(&self.value).ok_or_else(|| ReadError::new("must be an array"))?;
        Ok(Items { array, next: 0 })
    }

    #[inline(never)]
    fn members(self) -> Result<Members, ReadError> {
        // Objects of other pages are instances of other classes.
        if !self.value.is_object() || Array::is_array(&self.value) {
            return Err(ReadError::new("must be an object"));
        }
        let names = Object::keys(self.value.unchecked_ref::<Object>());
        Ok(Members {
            left: names.iter().filter_map(|name| name.as_string()).collect(),
            reader: self,
            current: None,
        })
    }

    /// Reads an object whose members `names` are read by the second type, and all others by the first.
    pub fn read_both<A: DeserializeOwned, B: DeserializeOwned>(
        value: &JsValue,
        names: &'static [&'static str],
    ) -> Result<(A, B), ReadError> {
        let reader = |is_ours| Self { value: value.clone(), names, is_ours };
        let first = A::deserialize(reader(false))?;
        Ok((first, B::deserialize(reader(true))?))
    }
}

impl<'de> Deserializer<'de> for Reader {
    type Error = ReadError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        if let Some(number) = self.value.as_f64() {
            return visitor.visit_f64(number);
        }
        if let Some(text) = self.value.as_string() {
            return visitor.visit_string(text);
        }
        if let Some(answer) = self.value.as_bool() {
            return visitor.visit_bool(answer);
        }
        if list(&self.value).is_some() {
            return self.deserialize_seq(visitor);
        }
        Err(serde::de::Error::invalid_type(Unexpected::Unit, &visitor))
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_f64(self.number()?)
    }

    /// Members that are `undefined` are not there, and `null` is a value.
    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_some(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_seq(self.items()?)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        visitor.visit_map(self.members()?)
    }

    /// An enum is the name of one of its variants.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        let name = self.value.as_string().ok_or_else(|| ReadError::new("must be a name"))?;
        visitor.visit_enum(name.into_deserializer())
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string bytes byte_buf unit unit_struct newtype_struct
        tuple tuple_struct map identifier
    }
}

/// The members of an object.
struct Members {
    reader: Reader,
    /// The names that are still to come.
    left: Vec<String>,
    current: Option<(String, JsValue)>,
}

impl Members {
    #[inline(never)]
    fn next_name(&mut self) -> Option<String> {
        let Reader { value: object, names, is_ours } = &self.reader;
        while let Some(name) = self.left.pop() {
            let value = Reflect::get(object, &name.as_str().into()).unwrap_or(JsValue::UNDEFINED);
            if !value.is_undefined() && names.contains(&name.as_str()) == *is_ours {
                self.current = Some((name.clone(), value));
                return Some(name);
            }
        }
        None
    }

    /// An error that lists names lists those of the other type, too.
    #[inline(never)]
    fn refuse_name(&self, mut error: ReadError) -> ReadError {
        self.reader.names.iter().for_each(|name| error.problem += &format!(", {name}"));
        error
    }

    #[inline(never)]
    fn value(&mut self) -> (String, Reader) {
        let (name, value) = self.current.take().unwrap_or_default();
        (name, Reader::new(value))
    }
}

impl<'de> MapAccess<'de> for Members {
    type Error = ReadError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ReadError> {
        let Some(name) = self.next_name() else { return Ok(None) };
        let key: StringDeserializer<ReadError> = name.into_deserializer();
        seed.deserialize(key).map(Some).map_err(|error| self.refuse_name(error))
    }

    // One copy for each type of value, not one for each member.
    #[inline(never)]
    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, ReadError> {
        let (name, reader) = self.value();
        seed.deserialize(reader).map_err(|error| error.inside(&name))
    }
}

/// The items of an array.
struct Items {
    array: Array,
    next: u32,
}

impl<'de> SeqAccess<'de> for Items {
    type Error = ReadError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, ReadError> {
        let at = self.next;
        if at == self.array.length() {
            return Ok(None);
        }
        self.next += 1;
        let item = seed.deserialize(Reader::new(self.array.get(at)));
        item.map(Some).map_err(|error| error.inside(&format!("[{at}]")))
    }
}
