//! What can be got out of the current mesh besides itself: the same calls in both classes that have one.

/// Gives these calls to a class that has a `file`. wasm-bindgen exports neither traits nor generic methods.
#[macro_export]
macro_rules! mesh_tools {
    ($class:ident) => {
        const _: () = {
            use tetralod::view::NormalKind;
            use tetralod_web_options::error::WebError;
            use $crate::options::field_index;
            use $crate::tools;

            #[wasm_bindgen::prelude::wasm_bindgen]
            impl $class {
                /// The isosurfaces of the current mesh at some values, as one; with normals of the field's gradient or of the triangles, and with
                /// the values of other fields, given by their numbers.
                pub fn isosurfaces(
                    &mut self,
                    values: &[f64],
                    smooth: bool,
                    fields: &[usize],
                ) -> Result<tools::JsIsoSurface, WebError> {
                    let session = &mut self.file.session;
                    session.set_normal_kind(if smooth { NormalKind::Smooth } else { NormalKind::Gradient });
                    session.isosurfaces(values)?;
                    let (session, stored) = (&self.file.session, self.file.stored()?);
                    let (surface, mesh) = (session.last_surfaces().0, session.last_view());
                    let js = tools::iso_surface(surface, &stored);
                    tools::put_fields(
                        js.as_ref(),
                        fields.iter().map(|field| {
                            surface.interpolate(&mesh, tools::view(session, *field, &session.values(*field)))
                        }),
                    );
                    Ok(js)
                }

                /// The section of the current mesh with the plane `normal · p = offset`, with the values of other fields.
                pub fn slice(
                    &mut self,
                    normal: &[f64],
                    offset: f64,
                    fields: &[usize],
                ) -> Result<tools::JsSlice, WebError> {
                    let plane = tools::plane(normal, offset)?;
                    self.file.session.slice(&plane)?;
                    let (session, stored) = (&self.file.session, self.file.stored()?);
                    let (slice, mesh) = (session.last_surfaces().1, session.last_view());
                    let js = tools::section(slice, &stored);
                    tools::put_fields(
                        js.as_ref(),
                        fields.iter().map(|field| {
                            slice.interpolate(&mesh, tools::view(session, *field, &session.values(*field)))
                        }),
                    );
                    Ok(js)
                }

                /// The boundary of the current mesh, with the values of other fields.
                pub fn surface(&mut self, fields: &[usize]) -> Result<tools::JsSurface, WebError> {
                    self.file.session.view();
                    let (session, stored) = (&self.file.session, self.file.stored()?);
                    let fields = fields.iter().map(|field| session.values(*field));
                    Ok(tools::boundary(&session.last_view(), fields, &stored))
                }

                /// A field at the points of the current mesh, by its number.
                pub fn values(&self, field: usize) -> Vec<f64> {
                    self.file.session.values(field)
                }

                /// The field at some points, three coordinates each; NaN outside of the mesh.
                pub fn probe(&mut self, points: &[f64]) -> Result<Vec<f64>, WebError> {
                    self.file.info()?;
                    tools::probe(self.file.session.view(), points)
                }

                /// The field along a line.
                pub fn line(&mut self, from: &[f64], to: &[f64]) -> Result<tools::JsProfile, WebError> {
                    self.file.info()?;
                    tools::line(self.file.session.view(), from, to)
                }

                /// The streamlines from some seeds, three coordinates each, through the vector field of three fields.
                pub fn streamlines(
                    &mut self,
                    names: Vec<String>,
                    seeds: &[f64],
                    backward: bool,
                    max_length: f64,
                    max_steps: f64,
                ) -> Result<tools::JsStreamlines, WebError> {
                    let info = self.file.info()?;
                    let fields = names
                        .iter()
                        .map(|name| field_index(info, &name.as_str().into()))
                        .collect::<Result<Vec<_>, _>>()?;
                    let fields: [usize; 3] = fields.try_into().map_err(|_| {
                        WebError::bad_option("fields", "a vector field is the names of three fields")
                    })?;
                    let session = &mut self.file.session;
                    let vectors = fields.map(|field| session.values(field));
                    let vectors = vectors.each_ref().map(|v| &v[..]);
                    tools::streamlines(
                        session.view(),
                        vectors,
                        seeds,
                        &tools::Way { backward, max_length, max_steps },
                    )
                }

                /// Sums over the current mesh and its regions, a histogram by volume of so many bins from `low` to `high`, and the values below which these
                /// fractions of the volume lie; NaN is the end of the field's range.
                pub fn stats(
                    &mut self,
                    bins: u32,
                    low: f64,
                    high: f64,
                    fractions: &[f64],
                ) -> Result<tools::JsStats, WebError> {
                    let field = self.file.session.field();
                    let info = &self.file.info()?.fields[field];
                    let low = if low.is_nan() { info.min } else { low };
                    let high = if high.is_nan() { info.min + info.range() } else { high };
                    tools::stats(&mut self.file.session, bins, [low, high], fractions)
                }

                /// A hash of the current mesh, the same wherever the same request was made.
                pub fn hash(&self) -> String {
                    self.file.hash()
                }
            }
        };
    };
}
