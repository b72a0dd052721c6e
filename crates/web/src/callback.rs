//! A need that a JavaScript function decides: it gets many tetrahedra at once and returns the excess of each.

use crate::arrays::{doubles, object};
use js_sys::{Function, Object, Reflect};
use std::cell::RefCell;
use std::fmt;
use tetralod::geom::Lattice;
use tetralod::mt::{FieldInfo, MtInfo};
use tetralod::refine::{ANY, Criterion, TetData, Verdict};
use tetralod_web_options::error::WebError;
use tetralod_web_options::read_error::list;
use wasm_bindgen::JsValue;

/// A function gets at most so many tetrahedra in a call, so that its arrays stay small.
const BATCH: usize = 1 << 14;

/// Functions cannot leave their thread, and criteria must be able to: they know functions by number.
#[derive(Default)]
struct Functions {
    slots: Vec<Option<Function>>,
    /// What went wrong in a function since that was last asked.
    failure: Option<String>,
}

thread_local! {
    static FUNCTIONS: RefCell<Functions> = RefCell::default();
}

/// The criterion of a function. Anything may come out of it, so it is answered from the base mesh each time.
pub struct Callback {
    slot: usize,
    lattice: Lattice,
    number: usize,
    field: FieldInfo,
}

impl Callback {
    /// The criterion of `function`, which is shown field number `number`.
    pub fn new(function: Function, info: &MtInfo, number: usize) -> Self {
        let slot = FUNCTIONS.with_borrow_mut(|functions| {
            let free = functions.slots.iter().position(Option::is_none);
            let slot = free.unwrap_or(functions.slots.len());
            if free.is_none() {
                functions.slots.push(None);
            }
            functions.slots[slot] = Some(function);
            slot
        });
        Self { slot, lattice: info.lattice, number, field: info.fields[number].clone() }
    }

    /// What the function says of some tetrahedra.
    fn excesses(&self, tets: &[TetData<'_>]) -> Result<Vec<f64>, String> {
        // Not held during the call: the function may do whatever it likes.
        let function = FUNCTIONS.with_borrow(|functions| functions.slots[self.slot].clone());
        let Some(function) = function else { return Ok(vec![0.0; tets.len()]) };
        let answer = function.call1(&JsValue::UNDEFINED, &self.batch(tets)).map_err(|thrown| {
            let words = Reflect::get(&thrown, &"message".into()).ok().and_then(|words| words.as_string());
            format!("it threw: {}", words.or_else(|| thrown.as_string()).unwrap_or_default())
        })?;
        let numbers = list(&answer).map(|list| list.to_vec()).unwrap_or_default();
        if numbers.len() != tets.len() {
            return Err("it must return an array of one number for each tetrahedron of the batch".to_owned());
        }
        // What is no number asks for nothing.
        Ok(numbers.iter().map(|number| number.as_f64().unwrap_or(0.0).max(0.0)).collect())
    }

    fn batch(&self, tets: &[TetData<'_>]) -> Object {
        let mut positions = Vec::with_capacity(12 * tets.len());
        let mut values = Vec::with_capacity(4 * tets.len());
        let mut errors = Vec::with_capacity(tets.len());
        for tet in tets {
            let corners = tet.corners.iter().flat_map(|corner| self.lattice.point(*corner));
            positions.extend(corners);
            values.extend((tet.levels)(self.number).map(|level| self.field.value(level)));
            errors.push(tet.error.error() * self.field.range());
        }
        object(&[
            ("positions", doubles(&positions)),
            ("values", doubles(&values)),
            ("errors", doubles(&errors)),
            ("count", tets.len().into()),
        ])
    }
}

/// Without the floats, whose formatting is larger than all of this.
impl fmt::Debug for Callback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Callback").field("slot", &self.slot).finish_non_exhaustive()
    }
}

impl Drop for Callback {
    fn drop(&mut self) {
        // On another thread the function is not there.
        FUNCTIONS.with_borrow_mut(|functions| {
            if let Some(slot) = functions.slots.get_mut(self.slot) {
                *slot = None;
            }
        });
    }
}

impl Criterion for Callback {
    fn judge(&self, tet: &TetData<'_>) -> Verdict {
        self.judge_all(std::slice::from_ref(tet)).pop().unwrap_or(Verdict::NEVER)
    }

    fn judge_all(&self, tets: &[TetData<'_>]) -> Vec<Verdict> {
        let mut verdicts = Vec::with_capacity(tets.len());
        for batch in tets.chunks(BATCH) {
            let excesses = if failed() { Ok(Vec::new()) } else { self.excesses(batch) };
            let excesses = excesses.unwrap_or_else(|problem| {
                FUNCTIONS.with_borrow_mut(|functions| functions.failure = Some(problem));
                Vec::new()
            });
            verdicts.extend(excesses.into_iter().map(|excess| Verdict {
                excess,
                slack: 0.0,
                component: ANY,
            }));
        }
        // A function that fails asks for nothing from then on; the step returns its failure.
        verdicts.resize(tets.len(), Verdict::NEVER);
        verdicts
    }

    fn is_batched(&self) -> bool {
        true
    }

    fn is_monotone(&self) -> bool {
        false
    }
}

/// Whether a function has failed since [`check`].
pub fn failed() -> bool {
    FUNCTIONS.with_borrow(|functions| functions.failure.is_some())
}

/// The failure of a function, if one has failed; it is forgotten then.
pub fn check() -> Result<(), WebError> {
    let failure = FUNCTIONS.with_borrow_mut(|functions| functions.failure.take());
    failure.map_or(Ok(()), |problem| Err(WebError::bad_option("where", &problem)))
}
