//! The wasm module `core` of the npm package: the class that its worker holds, with one MT being decoded, and its current mesh.

use tetralod::mt::{MeshChanges, MtInfo};
use tetralod_web::file::File;
use tetralod_web::loader::RangeLoader;
use tetralod_web::mesh_changes::{self, Changes};
use tetralod_web::mesh_tools;
use tetralod_web::options::{RefineOptions, field_index};
use tetralod_web::results::{self, JsBlocks, JsDelta, JsInfo, JsMesh, JsProgress, JsStats};
use tetralod_web_options::error::WebError;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// A decoder, its MT and the current mesh.
#[wasm_bindgen]
#[derive(Default)]
pub struct CoreSession {
    file: File,
    /// How many meshes have been handed out.
    handed: u32,
    /// Positions and values of the mesh in single precision, for who reads wasm memory; kept up from the first time on.
    single: Option<(Vec<[f32; 3]>, Vec<f32>)>,
}

#[wasm_bindgen]
impl CoreSession {
    /// An empty session for the fields of these names, or for all if none is named, that is fed from front to back.
    #[wasm_bindgen(constructor)]
    pub fn new(fields: Vec<String>) -> Self {
        Self { file: File::whole(fields), ..Self::default() }
    }

    /// A session for a file that `loader` brings in parts: `supply` takes them, and those that are not needed go when they take
    /// more bytes than `memory`.
    #[wasm_bindgen(js_name = inParts)]
    pub fn in_parts(fields: Vec<String>, memory: f64, loader: &RangeLoader) -> Self {
        Self { file: File::in_parts(fields, memory, loader), ..Self::default() }
    }

    /// Takes the complete ranges of the loader, and gives it those that are wanted then; whether there was any.
    pub fn supply(&mut self) -> Result<bool, WebError> {
        self.file.supply()
    }

    /// Whether more is to come of a file in parts, if all goes well.
    #[wasm_bindgen(getter, js_name = isWaiting)]
    pub fn is_waiting(&self) -> bool {
        self.file.is_waiting()
    }

    /// How much of the file has come.
    pub fn progress(&self) -> JsProgress {
        self.file.progress()
    }

    /// How the blocks stand.
    pub fn blocks(&self) -> JsBlocks {
        self.file.blocks()
    }

    /// Takes the next bytes of the file, however they were cut.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<JsProgress, WebError> {
        self.file.session.feed(bytes)?;
        Ok(self.progress())
    }

    /// The file has ended: refuses one that was cut short.
    pub fn finish(&mut self) -> Result<JsProgress, WebError> {
        self.file.session.finish()?;
        Ok(self.progress())
    }

    /// What is known of the MT; `undefined` until the base mesh is there.
    pub fn info(&self) -> Option<JsInfo> {
        results::info(&self.file.session)
    }

    /// Changes the current mesh to what `options` asks for, as far as the data has arrived.
    pub fn refine(&mut self, options: &RefineOptions) -> Result<JsStats, WebError> {
        self.request(options)?;
        self.step(f64::INFINITY, f64::INFINITY)
    }

    /// Sets the request, for `step` to make its mesh.
    pub fn request(&mut self, options: &RefineOptions) -> Result<(), WebError> {
        self.file.request(options, None)
    }

    /// Goes on towards that mesh for about so many milliseconds or so many updates, whichever comes first.
    pub fn step(&mut self, milliseconds: f64, updates: f64) -> Result<JsStats, WebError> {
        let stats = self.file.step(milliseconds, updates)?;
        self.file.stats(&stats)
    }

    /// The field that `mesh` carries, by name or number.
    #[wasm_bindgen(js_name = setField)]
    pub fn set_field(&mut self, field: &JsValue) -> Result<(), WebError> {
        let index = field_index(self.known()?, field)?;
        Ok(self.file.session.set_field(index)?)
    }

    /// The current mesh, and what has changed in it since `mesh` or `delta` was last called. `arrays` is a set of bits: 1 for
    /// positions, 2 for the field, 4 for tetrahedra, 8 for neighbours.
    pub fn mesh(&mut self, arrays: u32) -> Result<JsMesh, WebError> {
        let (stored, changes) = (self.file.stored()?, self.changes()?);
        Ok(mesh_changes::mesh(&self.file.session.view(), &stored, &changes, arrays))
    }

    /// Of the current mesh only what has changed since `mesh` or `delta` was last called.
    pub fn delta(&mut self, arrays: u32) -> Result<JsDelta, WebError> {
        let (stored, changes) = (self.file.stored()?, self.changes()?);
        Ok(mesh_changes::delta(&self.file.session.view(), &stored, &changes, arrays))
    }

    /// Where those four arrays are in wasm memory, as `mesh` last handed them out, until the next call: address and number of elements of
    /// each.
    pub fn places(&mut self) -> Result<Vec<usize>, WebError> {
        let stored = self.file.stored()?;
        let mesh = self.file.session.view();
        let (positions, values) = self.single.get_or_insert_with(|| {
            let positions = mesh.positions.iter().map(|point| stored.position(*point));
            (positions.collect(), mesh.field.iter().map(|value| stored.value(*value)).collect())
        });
        let arrays = [
            place(positions.as_flattened()),
            place(values),
            place(mesh.tets.as_flattened()),
            place(mesh.neighbors.as_flattened()),
        ];
        Ok(arrays.concat())
    }

    /// What has changed since a mesh was last handed out; another one is handed out with it.
    fn changes(&mut self) -> Result<Changes, WebError> {
        self.known()?;
        self.handed += 1;
        let ranges = self.file.session.take_changes();
        if self.single.is_some() {
            self.keep_up(&ranges)?;
        }
        Ok(Changes { ranges, to: self.handed })
    }

    /// Brings the mesh in single precision up to date.
    fn keep_up(&mut self, changes: &MeshChanges) -> Result<(), WebError> {
        let stored = self.file.stored()?;
        let mesh = self.file.session.view();
        let Some((positions, values)) = &mut self.single else { return Ok(()) };
        positions.resize(mesh.positions.len(), [0.0; 3]);
        values.resize(mesh.field.len(), 0.0);
        for v in changes.vertices.iter().cloned().flatten().map(|v| v as usize) {
            (positions[v], values[v]) = (stored.position(mesh.positions[v]), stored.value(mesh.field[v]));
        }
        Ok(())
    }

    fn known(&self) -> Result<&MtInfo, WebError> {
        self.file.info()
    }
}

mesh_tools!(CoreSession);

/// Where an array is in wasm memory.
fn place<T>(array: &[T]) -> [usize; 2] {
    [array.as_ptr() as usize, array.len()]
}
