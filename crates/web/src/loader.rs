//! The loader of byte ranges, for `ranges.js`: what it says to do comes out as objects, what happens goes in as numbers.

use crate::arrays::object;
use js_sys::{Array, Uint8Array};
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;
use tetralod::stream::{Action, Failure, Loader, LoaderOptions, ResponseHead, Traffic, WantedRange};
use tetralod_web_options::error::WebError;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    /// `{ id, shard, start, end }`, `{ start, end }`, `{ id }` or `{ until }`: fetch, by places in that shard; read from the cache, cancel, wait.
    #[wasm_bindgen(
        typescript_type = "{ id?: number, shard?: number, start?: number, end?: number, until?: number }"
    )]
    pub type JsAction;
    /// `{ start, end, bytes }`.
    #[wasm_bindgen(typescript_type = "{ start: number, end: number, bytes: Uint8Array<ArrayBuffer> }")]
    pub type JsRange;
}

/// A loader that requests report to, and that a file gives the ranges it wants.
pub type SharedLoader = Rc<RefCell<Loader>>;

/// Decides which bytes to fetch next. Times are in milliseconds, ends may be `Infinity`.
#[wasm_bindgen]
pub struct RangeLoader {
    loader: SharedLoader,
    /// The bytes that can be had, if those are a part of the file.
    held: Option<Vec<Range<u64>>>,
}

impl RangeLoader {
    /// The same loader, for the file that takes what it brings.
    pub(crate) fn share(&self) -> SharedLoader {
        Rc::clone(&self.loader)
    }

    /// The bytes that can be had, if those are a part of the file.
    pub(crate) fn held(&self) -> Option<&[Range<u64>]> {
        self.held.as_deref()
    }
}

#[wasm_bindgen]
impl RangeLoader {
    /// A loader of one file; `undefined` is the default.
    #[wasm_bindgen(constructor)]
    pub fn new(
        max_requests: Option<u32>,
        gap: Option<f64>,
        max_request_bytes: Option<f64>,
        retries: Option<u32>,
        backoff_ms: Option<f64>,
        timeout_ms: Option<f64>,
        seed: f64,
    ) -> Self {
        let default = LoaderOptions::default();
        let number = |given: Option<f64>, default: u64| given.map_or(default, |given| given as u64);
        let loader = Loader::new(LoaderOptions {
            max_requests: max_requests.map_or(default.max_requests, |most| most as usize),
            gap: gap.map(|gap| gap as u64),
            max_request_bytes: number(max_request_bytes, default.max_request_bytes),
            retries: retries.unwrap_or(default.retries),
            backoff_ms: number(backoff_ms, default.backoff_ms),
            timeout_ms: number(timeout_ms, default.timeout_ms),
            seed: seed.to_bits(),
            ..default
        });
        Self { loader: Rc::new(RefCell::new(loader)), held: None }
    }

    /// Says, before a file is opened with it, that no other bytes can be had: start and end of each range.
    pub fn hold(&mut self, pairs: &[f64]) {
        let (ranges, _) = pairs.as_chunks::<2>();
        self.held = Some(ranges.iter().map(|&[start, end]| start as u64..end as u64).collect());
    }

    /// Asks for more or less at a time from now on.
    #[wasm_bindgen(js_name = setMaxRequests)]
    pub fn set_max_requests(&self, most: u32) {
        self.loader.borrow_mut().set_max_requests(most as usize);
    }

    /// Says what is wanted from now on, all of it: start, end and priority of each range. Files do so by themselves.
    pub fn want(&self, triples: &[f64]) {
        let (ranges, _) = triples.as_chunks::<3>();
        let wanted = |[start, end, priority]: &[f64; 3]| WantedRange {
            range: *start as u64..*end as u64,
            priority: *priority as f32,
        };
        self.loader.borrow_mut().want(&ranges.iter().map(wanted).collect::<Vec<_>>());
    }

    /// What to do now, if anything; an error if nothing helps any more.
    pub fn next(&self, now: f64) -> Result<Option<JsAction>, WebError> {
        let mut loader = self.loader.borrow_mut();
        let action = loader.next(now as u64);
        if let (None, Some(error)) = (&action, loader.error()) {
            return Err(WebError::of(error));
        }
        Ok(action.map(|action| match action {
            Action::Fetch { id, shard, range, .. } => {
                let [start, end] = ends(&range);
                object(&[("id", id.into()), ("shard", (shard as f64).into()), start, end])
            }
            Action::Read { range } => object(&ends(&range)),
            Action::Cancel { id } => object(&[("id", id.into())]),
            Action::Wait { until_ms } => object(&[("until", (until_ms as f64).into())]),
        }))
    }

    /// A head has come. `fields` are the texts, or `null`, of `Content-Range`, `Content-Length`, `Content-Encoding`,
    /// `Content-Type`, `ETag`, `Last-Modified` and `Retry-After`; the client undoes encodings.
    pub fn head(&self, id: u32, now: f64, status: u16, fields: Vec<JsValue>) {
        let text = |at: usize| fields.get(at).and_then(JsValue::as_string);
        let number = |at: usize| text(at).and_then(|text| text.trim().parse().ok());
        let [range, encoding, kind, etag, modified] = [0, 2, 3, 4, 5].map(text);
        let head = ResponseHead {
            status,
            content_range: range.as_deref(),
            content_length: number(1),
            content_encoding: encoding.as_deref(),
            decoded: true,
            content_type: kind.as_deref(),
            etag: etag.as_deref(),
            last_modified: modified.as_deref(),
            retry_after_seconds: number(6),
        };
        self.loader.borrow_mut().head(id, now as u64, &head);
    }

    /// Bytes of a body have come.
    pub fn data(&self, id: u32, now: f64, bytes: &[u8]) {
        self.loader.borrow_mut().data(id, now as u64, bytes);
    }

    /// A body has ended.
    pub fn end(&self, id: u32, now: f64) {
        self.loader.borrow_mut().end(id, now as u64);
    }

    /// A request has failed; `blocked` if that was the browser's doing.
    pub fn failed(&self, id: u32, now: f64, blocked: bool, detail: String) {
        let failure = if blocked { Failure::Blocked } else { Failure::Network(detail) };
        self.loader.borrow_mut().failed(id, now as u64, failure);
    }

    /// Whether a range is complete that has not been taken.
    #[wasm_bindgen(js_name = hasComplete)]
    pub fn has_complete(&self) -> bool {
        self.loader.borrow().has_complete()
    }

    /// A range that is complete. Files take them by themselves.
    pub fn take(&self) -> Option<JsRange> {
        let (range, bytes) = self.loader.borrow_mut().take()?;
        Some(range_object(&range, &bytes))
    }

    /// Copies of the complete ranges that the cache does not have.
    pub fn uncached(&self) -> Array {
        let loader = self.loader.borrow();
        loader.uncached().map(|(range, bytes)| JsValue::from(range_object(range, bytes))).collect()
    }

    /// Says of more ranges that the cache has them: start and end of each.
    #[wasm_bindgen(js_name = addCached)]
    pub fn add_cached(&self, pairs: &[f64]) {
        let (ranges, _) = pairs.as_chunks::<2>();
        let ranges: Vec<_> = ranges.iter().map(|&[start, end]| start as u64..end as u64).collect();
        self.loader.borrow_mut().add_cached(&ranges);
    }

    /// There is no cache any more.
    #[wasm_bindgen(js_name = forgetCached)]
    pub fn forget_cached(&self) {
        self.loader.borrow_mut().forget_cached();
    }

    /// The cache had a range.
    pub fn put(&self, start: f64, end: f64, bytes: &[u8]) {
        self.loader.borrow_mut().put(&(start as u64..end as u64), bytes);
    }

    /// The cache does not have a range any more.
    pub fn lost(&self, start: f64, end: f64) {
        self.loader.borrow_mut().lost(&(start as u64..end as u64));
    }

    /// Tries again after an error.
    pub fn retry(&self) {
        self.loader.borrow_mut().retry();
    }

    /// The size of the file, once it is known.
    pub fn total(&self) -> Option<f64> {
        self.loader.borrow().total().map(|total| total as f64)
    }

    /// What names the version of the file, if the server sends it.
    pub fn version(&self) -> Option<String> {
        self.loader.borrow().version().map(str::to_owned)
    }

    /// Whether the server gives ranges, once that is known.
    #[wasm_bindgen(js_name = servesRanges)]
    pub fn serves_ranges(&self) -> Option<bool> {
        self.loader.borrow().serves_ranges()
    }

    /// Requests made, bytes that came, those of them that were wanted and that had come before, rounds, and milliseconds waited.
    pub fn traffic(&self) -> Vec<f64> {
        let Traffic { requests, received, used, repeated, rounds, waited_ms } =
            self.loader.borrow().traffic();
        [requests, received, used, repeated, rounds, waited_ms].map(|count| count as f64).to_vec()
    }
}

fn ends(range: &Range<u64>) -> [(&'static str, JsValue); 2] {
    [("start", (range.start as f64).into()), ("end", (range.end as f64).into())]
}

fn range_object(range: &Range<u64>, bytes: &[u8]) -> JsRange {
    let [start, end] = ends(range);
    object(&[start, end, ("bytes", Uint8Array::from(bytes).into())])
}
