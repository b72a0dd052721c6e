//! The loader of byte ranges, for `ranges.js`: what it says to do comes out as objects, what happens goes in as numbers.

use super::error::WebError;
use super::results;
use crate::stream::Action;
use crate::stream::Failure;
use crate::stream::Head;
use crate::stream::Loader;
use crate::stream::LoaderOptions;
use crate::stream::Wanted;
use js_sys::Uint8Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    /// `{ id, start, end }`, `{ id }` or `{ until }`: fetch, cancel, wait.
    pub type JsAction;
    /// `{ start, end, bytes }`.
    pub type JsRange;
}

/// Decides which bytes to fetch next. Times are in milliseconds, ends may be `Infinity`.
#[wasm_bindgen]
pub struct RangeLoader {
    loader: Loader,
}

#[wasm_bindgen]
impl RangeLoader {
    /// A loader of one file; what is `undefined` is as usual.
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
        let usual = LoaderOptions::default();
        let number = |given: Option<f64>, usual: u64| given.map_or(usual, |given| given as u64);
        let loader = Loader::new(LoaderOptions {
            max_requests: max_requests.map_or(usual.max_requests, |most| most as usize),
            gap: number(gap, usual.gap),
            max_request_bytes: number(max_request_bytes, usual.max_request_bytes),
            retries: retries.unwrap_or(usual.retries),
            backoff_ms: number(backoff_ms, usual.backoff_ms),
            timeout_ms: number(timeout_ms, usual.timeout_ms),
            seed: seed.to_bits(),
            ..usual
        });
        Self { loader }
    }

    /// Says what is wanted from now on, all of it: start, end and priority of each range.
    pub fn want(&mut self, triples: &[f64]) {
        let (ranges, _) = triples.as_chunks::<3>();
        let wanted = |[start, end, priority]: &[f64; 3]| Wanted {
            range: *start as u64..*end as u64,
            priority: *priority as f32,
        };
        self.loader.want(&ranges.iter().map(wanted).collect::<Vec<_>>());
    }

    /// What to do now, if anything; an error if nothing helps any more.
    pub fn next(&mut self, now: f64) -> Result<Option<JsAction>, WebError> {
        let action = self.loader.next(now as u64);
        if let (None, Some(error)) = (&action, self.loader.error()) {
            return Err(error.into());
        }
        Ok(action.map(|action| match action {
            Action::Fetch { id, range, .. } => results::object(&[
                ("id", id.into()),
                ("start", (range.start as f64).into()),
                ("end", (range.end as f64).into()),
            ]),
            Action::Cancel { id } => results::object(&[("id", id.into())]),
            Action::Wait { until_ms } => results::object(&[("until", (until_ms as f64).into())]),
        }))
    }

    /// A head has come. `fields` are the texts, or `null`, of `Content-Range`, `Content-Length`, `Content-Encoding`,
    /// `Content-Type`, `ETag`, `Last-Modified` and `Retry-After`; the client undoes encodings.
    pub fn head(&mut self, id: u32, now: f64, status: u16, fields: Vec<JsValue>) {
        let text = |at: usize| fields.get(at).and_then(JsValue::as_string);
        let number = |at: usize| text(at).and_then(|text| text.trim().parse().ok());
        let [range, encoding, kind, etag, modified] = [0, 2, 3, 4, 5].map(text);
        let head = Head {
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
        self.loader.head(id, now as u64, &head);
    }

    /// Bytes of a body have come.
    pub fn data(&mut self, id: u32, now: f64, bytes: &[u8]) {
        self.loader.data(id, now as u64, bytes);
    }

    /// A body has ended.
    pub fn end(&mut self, id: u32, now: f64) {
        self.loader.end(id, now as u64);
    }

    /// A request has failed; `blocked` if that was the browser's doing.
    pub fn failed(&mut self, id: u32, now: f64, blocked: bool, detail: String) {
        let failure = if blocked { Failure::Blocked } else { Failure::Network(detail) };
        self.loader.failed(id, now as u64, failure);
    }

    /// A range that is complete.
    pub fn take(&mut self) -> Option<JsRange> {
        let (range, bytes) = self.loader.take()?;
        Some(results::object(&[
            ("start", (range.start as f64).into()),
            ("end", (range.end as f64).into()),
            ("bytes", Uint8Array::from(bytes.as_slice()).into()),
        ]))
    }

    /// Tries again after an error.
    pub fn retry(&mut self) {
        self.loader.retry();
    }

    /// The size of the file, once it is known.
    pub fn total(&self) -> Option<f64> {
        self.loader.total().map(|total| total as f64)
    }

    /// What names the version of the file, if the server tells.
    pub fn version(&self) -> Option<String> {
        self.loader.version().map(str::to_owned)
    }

    /// Whether the server gives ranges, once that is known.
    #[wasm_bindgen(js_name = servesRanges)]
    pub fn serves_ranges(&self) -> Option<bool> {
        self.loader.serves_ranges()
    }

    /// Requests made, bytes that came, and those of them that were wanted.
    pub fn traffic(&self) -> Vec<f64> {
        let traffic = self.loader.traffic();
        [traffic.requests, traffic.received, traffic.used].map(|count| count as f64).to_vec()
    }
}
