//! Reads a value of JavaScript as a type that serde describes.
//!
//! `serde-wasm-bindgen`, which makes the [results](crate::results), skips names that a struct does not have, does not say where in
//! an object a value stands, and links the formatting of floats for its messages. [`Reader`] refuses such names, and its errors
//! name the option by its whole path.

use crate::read_error::{ReadError, is_plain, list, names};
use js_sys::{Array, Reflect};
use serde::de::value::StringDeserializer;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Expected, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, Visitor,
};
use serde::forward_to_deserialize_any;
use std::fmt;
use wasm_bindgen::JsValue;

/// Reads `value`.
pub fn read<T: DeserializeOwned>(value: &JsValue) -> Result<T, ReadError> {
    T::deserialize(Reader(value.clone()))
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

/// Whole numbers up to this one are exact in JavaScript.
const EXACT: f64 = 9_007_199_254_740_991.0;

/// A value that is read.
pub struct Reader(JsValue);

impl Reader {
    // What is no generic code stays out of it: the same for each type would be a large part of the wasm.

    #[inline(never)]
    fn number(&self) -> Result<f64, ReadError> {
        self.0.as_f64().ok_or_else(|| ReadError::new("must be a number"))
    }

    #[inline(never)]
    fn items(&self) -> Result<Items, ReadError> {
        let array = list(&self.0).ok_or_else(|| ReadError::new("must be an array"))?;
        Ok(Items { array, next: 0 })
    }

    #[inline(never)]
    fn members(self) -> Result<Members, ReadError> {
        if !is_plain(&self.0) {
            return Err(ReadError::new("must be an object"));
        }
        Ok(Members { left: names(&self.0).collect(), object: self.0, current: None })
    }
}

impl<'de> Deserializer<'de> for Reader {
    type Error = ReadError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        if let Some(number) = self.0.as_f64() {
            // Where a number may stand beside other types, a whole one is an integer.
            let is_whole = number.fract() == 0.0 && number.abs() <= EXACT;
            return if is_whole { visitor.visit_i64(number as i64) } else { visitor.visit_f64(number) };
        }
        if let Some(text) = self.0.as_string() {
            return visitor.visit_string(text);
        }
        if let Some(answer) = self.0.as_bool() {
            return visitor.visit_bool(answer);
        }
        if list(&self.0).is_some() {
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

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_map(self.members()?)
    }

    /// An enum is the name of one of its variants.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        let name = self.0.as_string().ok_or_else(|| ReadError::new("must be a name"))?;
        visitor.visit_enum(name.into_deserializer())
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string bytes byte_buf unit unit_struct newtype_struct
        tuple tuple_struct identifier
    }
}

/// The members of an object.
struct Members {
    object: JsValue,
    /// The names that are still to come.
    left: Vec<String>,
    current: Option<(String, JsValue)>,
}

impl Members {
    #[inline(never)]
    fn next_name(&mut self) -> Option<String> {
        while let Some(name) = self.left.pop() {
            let value = Reflect::get(&self.object, &name.as_str().into()).unwrap_or(JsValue::UNDEFINED);
            if !value.is_undefined() {
                self.current = Some((name.clone(), value));
                return Some(name);
            }
        }
        None
    }

    #[inline(never)]
    fn value(&mut self) -> (String, Reader) {
        let (name, value) = self.current.take().unwrap_or_default();
        (name, Reader(value))
    }
}

impl<'de> MapAccess<'de> for Members {
    type Error = ReadError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ReadError> {
        let Some(name) = self.next_name() else { return Ok(None) };
        let key: StringDeserializer<ReadError> = name.into_deserializer();
        seed.deserialize(key).map(Some)
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
        let item = seed.deserialize(Reader(self.array.get(at)));
        item.map(Some).map_err(|error| error.inside(&format!("[{at}]")))
    }
}
