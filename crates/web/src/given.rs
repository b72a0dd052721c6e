//! Options of a request as JavaScript gives them, taken one by one; what cannot be used is refused by its whole path.
//!
//! No generic code reads them: what serde makes for each struct of options was a tenth of the core's wasm.

use crate::read_error::{ReadError, is_plain, list, names};
use js_sys::Reflect;
use wasm_bindgen::JsValue;

/// An object of options, and where it stands.
pub struct Given {
    object: JsValue,
    /// What stands in front of the names of its members, such as `needs[1].view.`.
    place: String,
}

impl Given {
    /// `object`, whose members must be some of `known`.
    #[inline(never)]
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
    #[inline(never)]
    pub fn refuse(&self, name: &str, problem: &str) -> ReadError {
        ReadError::new(problem).inside([&self.place, name].concat().trim_end_matches('.'))
    }

    /// The option `name`; none if it is `undefined`, whereas `null` is a value.
    #[inline(never)]
    pub fn member(&self, name: &str) -> Option<JsValue> {
        let value = Reflect::get(&self.object, &name.into()).unwrap_or(JsValue::UNDEFINED);
        (!value.is_undefined()).then_some(value)
    }

    /// Whether the option is given.
    pub fn has(&self, name: &str) -> bool {
        self.member(name).is_some()
    }

    /// The options in the option `name`, of which there are those of `known`.
    #[inline(never)]
    pub fn inside(&self, name: &str, known: &[&str]) -> Result<Option<Self>, ReadError> {
        let Some(object) = self.member(name) else { return Ok(None) };
        Self::new(&object, [&self.place, name, "."].concat(), known).map(Some)
    }

    /// The objects in the list `name`, each with the options `known`.
    #[inline(never)]
    pub fn each(&self, name: &str, known: &[&str]) -> Result<Vec<Self>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(Vec::new()) };
        let list = list(&value).ok_or_else(|| self.refuse(name, MUST_BE_ARRAY))?;
        let place = |at: usize| format!("{}{name}[{at}].", self.place);
        list.iter().enumerate().map(|(at, item)| Self::new(&item, place(at), known)).collect()
    }

    /// A number.
    #[inline(never)]
    pub fn number(&self, name: &str) -> Result<Option<f64>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(None) };
        value.as_f64().map(Some).ok_or_else(|| self.refuse(name, MUST_BE_NUMBER))
    }

    /// A number that must be given.
    #[inline(never)]
    pub fn needed_number(&self, name: &str) -> Result<f64, ReadError> {
        self.number(name)?.ok_or_else(|| self.refuse(name, MISSING))
    }

    /// A finite number that is not negative, and must be given.
    #[inline(never)]
    pub fn needed_amount(&self, name: &str) -> Result<f64, ReadError> {
        let number = self.needed_number(name)?;
        self.amount(name, number)
    }

    fn amount(&self, name: &str, number: f64) -> Result<f64, ReadError> {
        if number.is_finite() && number >= 0.0 {
            return Ok(number);
        }
        Err(self.refuse(name, "must be a finite number that is not negative"))
    }

    /// A number of at least 1.
    #[inline(never)]
    pub fn at_least_one(&self, name: &str) -> Result<Option<f64>, ReadError> {
        match self.number(name)? {
            Some(number) if number.is_nan() || number < 1.0 => {
                Err(self.refuse(name, "must be a number of at least 1"))
            }
            number => Ok(number),
        }
    }

    /// An error as a part of `range`: a number in its unit, or a percentage of it.
    #[inline(never)]
    pub fn error(&self, name: &str, range: f64) -> Result<Option<f64>, ReadError> {
        let Some(value) = self.member(name) else { return Ok(None) };
        let relative = match (value.as_f64(), value.as_string()) {
            (Some(number), _) => Some(number / range),
            (None, Some(text)) => percentage(&text),
            (None, None) => return Err(self.refuse(name, "must be a number or a percentage")),
        };
        let relative =
            relative.ok_or_else(|| self.refuse(name, "must be a number or a percentage such as \"1%\""))?;
        self.amount(name, relative).map(Some)
    }

    /// Numbers, in lists of lists or not.
    #[inline(never)]
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
    #[inline(never)]
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
    #[inline(never)]
    fn has_rows_of(&self, name: &str, count: usize) -> bool {
        let Some(items) = self.member(name).and_then(|value| list(&value)) else { return true };
        items.iter().all(|item| list(&item).is_none_or(|row| row.length() as usize == count))
    }

    #[inline(never)]
    fn refuse_rows(&self, name: &str, count: usize) -> ReadError {
        self.refuse(name, &format!("must be rows of {count} numbers"))
    }
}

const MISSING: &str = "is missing";
const MUST_BE_ARRAY: &str = "must be an array";
const MUST_BE_NUMBER: &str = "must be a number";

/// JavaScript reads the number: Rust's own way would bring tables of its own.
fn percentage(text: &str) -> Option<f64> {
    let number = text.trim().strip_suffix('%').map(str::trim_end).filter(|number| !number.is_empty())?;
    let number = f64::try_from(JsValue::from(number)).ok().filter(|number| !number.is_nan())?;
    Some(number / 100.0)
}
