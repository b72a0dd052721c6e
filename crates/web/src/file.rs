//! What both classes hold: a file that is being read, whole or in parts, and the mesh that is made of it.

use crate::callback;
use crate::loader::{RangeLoader, SharedLoader};
use crate::options::{Asked, asked};
use crate::results::{self, JsBlocks, JsProgress, JsStats};
use crate::stored::Stored;
use tetralod::format::DecodeOptions;
use tetralod::mt::MtInfo;
use tetralod::refine::{RefineStats, Request, View};
use tetralod::session::{Progress, Session};
use tetralod_web_options::error::WebError;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// Updates between two looks at the clock: one takes about a microsecond, and so does the clock.
const UPDATES_A_LOOK: f64 = 16.0;

#[wasm_bindgen]
extern "C" {
    /// Milliseconds, finer than `Date` gives them.
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    pub fn now() -> f64;
}

/// A session, the loader that brings its bytes where they come in parts, and what is asked for.
#[derive(Default)]
pub struct File {
    pub session: Session,
    loader: Option<SharedLoader>,
    pub asked: Asked,
    /// A budget of tetrahedra besides that of the request.
    limit: Option<u32>,
    /// The regions in which needs count that name none.
    pub regions: Option<Vec<u16>>,
}

impl File {
    /// A file that comes from front to back, for the fields of these names, or for all if none is named.
    pub fn whole(fields: Vec<String>) -> Self {
        let options = DecodeOptions { fields, ..DecodeOptions::default() };
        Self { session: Session::with_options(options), ..Self::default() }
    }

    /// A file that `loader` brings in parts, whose blocks may take so many bytes of memory.
    pub fn in_parts(fields: Vec<String>, memory: f64, loader: &RangeLoader) -> Self {
        let options = DecodeOptions { fields, ..DecodeOptions::default() };
        let mut session = Session::in_parts(options, memory as u64);
        if let Some(held) = loader.held() {
            session.hold(held.to_vec());
        }
        Self { session, loader: Some(loader.share()), ..Self::default() }
    }

    /// Takes the complete ranges of the loader, and gives it those that are wanted then; whether there was any.
    pub fn supply(&mut self) -> Result<bool, WebError> {
        match &self.loader {
            Some(loader) => Ok(self.session.supply(&mut loader.borrow_mut())?),
            None => Ok(false),
        }
    }

    /// How much of the file has come.
    pub fn progress(&self) -> JsProgress {
        let progress = self.session.progress();
        let of_loader = self.loader.as_ref().and_then(|loader| loader.borrow().total());
        let total = of_loader.or(progress.total);
        results::progress(&Progress { bytes: self.session.fetched(), total, ..progress })
    }

    /// How the blocks stand.
    pub fn blocks(&self) -> JsBlocks {
        results::blocks(&self.session.block_progress())
    }

    /// Whether more is to come of a file in parts, if all goes well.
    pub fn is_waiting(&self) -> bool {
        self.loader.is_some() && self.session.is_waiting()
    }

    pub fn info(&self) -> Result<&MtInfo, WebError> {
        self.session.info().ok_or_else(WebError::not_ready)
    }

    /// How the mesh is stored in arrays of single precision, with the field that it carries.
    pub fn stored(&self) -> Result<Stored, WebError> {
        Stored::of(self.info()?, self.session.field())
    }

    /// What `options` ask for; `camera` is the one of the viewer, if there is one.
    pub fn request(&mut self, options: &JsValue, camera: Option<&View>) -> Result<(), WebError> {
        let mt = self.session.mt().ok_or_else(WebError::not_ready)?;
        let asked = asked(options, mt, camera)?;
        self.session.request_with(&self.limited(&asked.request), &asked.custom)?;
        self.session.set_field(asked.field)?;
        self.asked = asked;
        Ok(())
    }

    /// What is asked for has changed a little.
    pub fn request_again(&mut self) -> Result<(), WebError> {
        Ok(self.session.request_with(&self.limited(&self.asked.request), &self.asked.custom)?)
    }

    fn limited(&self, request: &Request) -> Request {
        let mut request = request.clone();
        request.budget.tets = request.budget.tets.into_iter().chain(self.limit).min();
        if let Some(regions) = &self.regions {
            for need in request.needs.iter_mut().filter(|need| need.regions.is_none()) {
                need.regions = Some(regions.clone());
            }
        }
        request
    }

    /// Holds the mesh to so many tetrahedra, whatever is asked for; none lets it be.
    pub fn limit(&mut self, tets: Option<u32>) -> Result<(), WebError> {
        self.limit = tets;
        if self.session.info().is_none() { Ok(()) } else { self.request_again() }
    }

    /// Goes on towards what was asked for, for about so many milliseconds or so many updates; each that is
    /// made takes those with it that it depends on.
    pub fn step(&mut self, milliseconds: f64, updates: f64) -> Result<RefineStats, WebError> {
        let end = if milliseconds == f64::INFINITY { milliseconds } else { now() + milliseconds };
        let mut looked = 0.0;
        let stepped = self.session.step(&mut |outcome| {
            let done = (outcome.refined + outcome.coarsened) as f64;
            if done - looked >= UPDATES_A_LOOK {
                looked = done;
                if callback::failed() || end.is_finite() && now() >= end {
                    return false;
                }
            }
            done < updates
        });
        callback::check()?;
        Ok(stepped?)
    }

    /// `stats` for JavaScript.
    pub fn stats(&self, stats: &RefineStats) -> Result<JsStats, WebError> {
        Ok(results::stats(stats, self.info()?, &self.asked))
    }

    /// A hash of the current mesh, the same wherever the same request was made.
    pub fn hash(&self) -> String {
        format!("{:016x}", self.session.hash())
    }
}
