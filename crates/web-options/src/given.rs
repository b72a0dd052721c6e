//! Options of a request or a build as JavaScript gives them, taken one by one; what cannot be used is refused by its whole path.

use crate::read_error::{ReadError, is_plain, list, names};
use js_sys::Reflect;
use std::ops::RangeInclusive;
use wasm_bindgen::JsValue;

/// An object of options, and where it stands.
pub struct Given {
    object: JsValue,
    /// What stands in front of the names of its members, such as `needs[1].view.`.
    place: String,
}

impl Given {
    /// `object`, whose members must be some of `known`.
    pub fn new(object: &JsValue, place: String, known: &[&str]) -> Result<Self, ReadError> {
        let given = Self { object: object.clone(), place };
        if !is_plain(object) {
            return Err(given.refuse("", "must be an object"));
        }
        match names(object).find(|name| !known.contains(&&**name) && given.has(name)) {
            Some(other) => {
                let problem = ["there is none of this name, only ", &known.join(", ")].concat();
                Err(given.refuse(&other, &problem))
            }
            None => Ok(given),
        }
    }

    /// The option `name` of these cannot be used.
    pub fn refuse(&self, name: &str, problem: &str) -> ReadError {
        ReadError::new(problem).inside([&self.place, name].concat().trim_end_matches('.'))
    }

    /// The option `name`; none if it is `undefined`, whereas `null` is a value.
    pub fn member(&self, name: &str) -> Option<JsValue> {
        let value = Reflect::get(&self.object, &name.into()).unwrap_or(JsValue::UNDEFINED);
        (!value.is_undefined()).then_some(value)
    }

    /// Whether the option is given.
    pub fn has(&self, name: &str) -> bool {
        self.member(name).is_some()
    }

    /// The options in the option `name`, of which there are those of `known`.
    pub fn inside(&self, name: &str, known: &[&str]) -> Result<Option<Self>, ReadError> {
        let Some(object) = self.member(name) else { return Ok(None) };
        Self::new(&object, [&self.place, name, "."].concat(), known).map(Some)
    }

    /// The objects in the list `name`, each with the options `known`.
    pub fn each(&self, name: &str, known: &[&str]) -> Result<Vec<Self>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(Vec::new()) };
        let list = list(&value).ok_or_else(|| self.refuse(name, MUST_BE_ARRAY))?;
        let place = |at: usize| format!("{}{name}[{at}].", self.place);
        list.iter().enumerate().map(|(at, item)| Self::new(&item, place(at), known)).collect()
    }

    /// A number.
    pub fn number(&self, name: &str) -> Result<Option<f64>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(None) };
        value.as_f64().map(Some).ok_or_else(|| self.refuse(name, MUST_BE_NUMBER))
    }

    /// A number that must be given.
    pub fn needed_number(&self, name: &str) -> Result<f64, ReadError> {
        self.number(name)?.ok_or_else(|| self.refuse(name, MISSING))
    }

    /// A finite number that is not negative, and must be given.
    pub fn needed_amount(&self, name: &str) -> Result<f64, ReadError> {
        let number = self.needed_number(name)?;
        self.check_amount(name, number)
    }

    fn check_amount(&self, name: &str, number: f64) -> Result<f64, ReadError> {
        if number.is_finite() && number >= 0.0 {
            return Ok(number);
        }
        Err(self.refuse(name, "must be a finite number that is not negative"))
    }

    /// A number of at least 1.
    pub fn at_least_one(&self, name: &str) -> Result<Option<f64>, ReadError> {
        match self.number(name)? {
            Some(number) if number.is_nan() || number < 1.0 => {
                Err(self.refuse(name, "must be a number of at least 1"))
            }
            number => Ok(number),
        }
    }

    /// An error as a part of `range`: a number in its unit, or a percentage of it.
    pub fn error(&self, name: &str, range: f64) -> Result<Option<f64>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(None) };
        let relative = match (value.as_f64(), value.as_string()) {
            (Some(number), _) => Some(number / range),
            (None, Some(text)) => percentage(&text),
            (None, None) => return Err(self.refuse(name, "must be a number or a percentage")),
        };
        let relative =
            relative.ok_or_else(|| self.refuse(name, "must be a number or a percentage such as \"1%\""))?;
        self.check_amount(name, relative).map(Some)
    }

    /// Numbers, in lists of lists or not.
    pub fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(None) };
        let items = list(&value).ok_or_else(|| self.refuse(name, MUST_BE_ARRAY))?;
        let mut numbers = Vec::new();
        for (at, item) in items.iter().enumerate() {
            if let Some(number) = item.as_f64() {
                numbers.push(number);
                continue;
            }
            let row = list(&item).ok_or_else(|| self.refuse(name, "must be numbers"))?;
            for (column, cell) in row.iter().enumerate() {
                let refused = || self.refuse(&format!("{name}[{at}][{column}]"), MUST_BE_NUMBER);
                numbers.push(cell.as_f64().ok_or_else(refused)?);
            }
        }
        Ok(Some(numbers))
    }

    /// Numbers that must be given, `count` of them.
    fn counted(&self, name: &str, count: usize) -> Result<Vec<f64>, ReadError> {
        let numbers = self.numbers(name)?.ok_or_else(|| self.refuse(name, MISSING))?;
        if numbers.len() == count {
            return Ok(numbers);
        }
        Err(self.refuse(name, &format!("must be {count} numbers")))
    }

    /// The same as an array.
    pub fn fixed<const N: usize>(&self, name: &str) -> Result<[f64; N], ReadError> {
        let numbers = self.counted(name, N)?;
        Ok(std::array::from_fn(|i| numbers[i]))
    }

    /// Rows of `N` numbers; none if the option is not there.
    pub fn rows<const N: usize>(&self, name: &str) -> Result<Vec<[f64; N]>, ReadError> {
        let numbers = self.numbers(name)?.unwrap_or_default();
        let (rows, rest) = numbers.as_chunks::<N>();
        if rest.is_empty() && self.has_rows_of(name, N) {
            Ok(rows.to_vec())
        } else {
            Err(self.refuse_rows(name, N))
        }
    }

    /// Whether each list in the list `name` has so many members.
    fn has_rows_of(&self, name: &str, count: usize) -> bool {
        let Some(items) = self.member(name).and_then(|value| list(&value)) else { return true };
        items.iter().all(|item| list(&item).is_none_or(|row| row.length() as usize == count))
    }

    fn refuse_rows(&self, name: &str, count: usize) -> ReadError {
        self.refuse(name, &format!("must be rows of {count} numbers"))
    }
}

/// What options of a build are besides.
impl Given {
    /// The members of the object in the option `name`, if it is one.
    pub fn members(&self, name: &str) -> Option<Vec<(String, JsValue)>> {
        let object = self.member(name).filter(is_plain)?;
        let value = |name: String| Some((name.clone(), Reflect::get(&object, &name.into()).ok()?));
        Some(names(&object).filter_map(value).collect())
    }

    /// A text.
    pub fn text(&self, name: &str) -> Result<Option<String>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(None) };
        value.as_string().map(Some).ok_or_else(|| self.refuse(name, "must be a text"))
    }

    /// A list of texts; none if the option is not there.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(Vec::new()) };
        let texts = list(&value).and_then(|list| list.iter().map(|text| text.as_string()).collect());
        texts.ok_or_else(|| self.refuse(name, "must be a list of names"))
    }

    /// One of `all`, by its name.
    pub fn name<T: Copy>(&self, option: &str, all: &[(&str, T)]) -> Result<Option<T>, ReadError> {
        let Some(text) = self.text(option)? else { return Ok(None) };
        let found = all.iter().find(|(name, _)| *name == text).map(|(_, value)| *value);
        let names: Vec<String> = all.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        found.map(Some).ok_or_else(|| self.refuse(option, &format!("must be one of {}", names.join(", "))))
    }

    /// Yes or no; no if the option is not there.
    pub fn answer(&self, name: &str) -> Result<bool, ReadError> {
        let Some(value) = self.member(name) else { return Ok(false) };
        value.as_bool().ok_or_else(|| self.refuse(name, "must be true or false"))
    }

    /// A number of a range, which is `expected`.
    pub fn number_in(
        &self,
        name: &str,
        range: RangeInclusive<f64>,
        expected: &str,
    ) -> Result<Option<f64>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(None) };
        let number = value.as_f64().filter(|number| range.contains(number));
        number.map(Some).ok_or_else(|| self.refuse(name, &["must be ", expected].concat()))
    }

    /// A finite number that is not negative.
    pub fn amount(&self, name: &str) -> Result<Option<f64>, ReadError> {
        self.number(name)?.map(|number| self.check_amount(name, number)).transpose()
    }
}

const MISSING: &str = "is missing";
const MUST_BE_ARRAY: &str = "must be an array";
const MUST_BE_NUMBER: &str = "must be a number";

/// The fraction that a percentage such as "1%" is.
pub fn percentage(text: &str) -> Option<f64> {
    let number: f64 = text.trim().strip_suffix('%')?.trim().parse().ok()?;
    (!number.is_nan()).then_some(number / 100.0)
}
