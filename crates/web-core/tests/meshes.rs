//! In a real browser: the core gives the meshes that the native program gives, and WebGPU is there.
//!
//! `cargo xtask test wasm` makes the fixture and runs this; TETRALOD_FIXTURE is its folder.
#![cfg(target_arch = "wasm32")]

use js_sys::{Array, Float32Array, Function, JSON, Promise, Reflect, Uint32Array};
use tetralod_web_core::CoreSession;
use wasm_bindgen::{JsCast, JsValue};
use wasm_bindgen_futures::JsFuture;
use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};

wasm_bindgen_test_configure!(run_in_browser);

const MT: &[u8] = include_bytes!(concat!(env!("TETRALOD_FIXTURE"), "/small.mt"));
const HASHES: &str = include_str!(concat!(env!("TETRALOD_FIXTURE"), "/hashes.json"));

/// MTs of the other kinds, each with its hashes.
const OTHERS: [(&[u8], &str); 2] = [
    (
        include_bytes!(concat!(env!("TETRALOD_FIXTURE"), "/small-edge.mt")),
        include_str!(concat!(env!("TETRALOD_FIXTURE"), "/hashes-edge.json")),
    ),
    (
        include_bytes!(concat!(env!("TETRALOD_FIXTURE"), "/small-vertex.mt")),
        include_str!(concat!(env!("TETRALOD_FIXTURE"), "/hashes-vertex.json")),
    ),
];

fn get(object: &JsValue, name: &str) -> JsValue {
    Reflect::get(object, &name.into()).expect("an object")
}

fn number(object: &JsValue, name: &str) -> f64 {
    get(object, name).as_f64().unwrap_or_else(|| panic!("`{name}` is not a number"))
}

fn code(error: impl Into<JsValue>) -> String {
    get(&error.into(), "code").as_string().expect("an error with a code")
}

/// A session that has got `bytes` in pieces of `piece`.
fn fed(bytes: &[u8], piece: usize) -> CoreSession {
    let mut session = CoreSession::new(Vec::new());
    for bytes in bytes.chunks(piece) {
        session.feed(bytes).expect("the fixture is a good file");
    }
    session
}

fn options(json: &str) -> JsValue {
    JSON::parse(json).expect("JSON")
}

#[wasm_bindgen_test]
fn the_same_requests_give_the_same_hashes_as_natively() {
    for piece in [MT.len(), 1000, 7] {
        same_hashes(MT, HASHES, piece);
    }
}

#[wasm_bindgen_test]
fn mts_of_the_other_kinds_do_as_well() {
    for (mt, hashes) in OTHERS {
        same_hashes(mt, hashes, mt.len());
        same_hashes(mt, hashes, 1000);
    }
}

fn same_hashes(mt: &[u8], hashes: &str, piece: usize) {
    let mut session = fed(mt, piece);
    let end = session.finish().expect("a complete file");
    assert_eq!(get(&end, "complete"), JsValue::TRUE);
    let cases: Array = options(hashes).unchecked_into();
    assert!(cases.length() >= 5, "the fixture holds requests");
    for case in cases.iter() {
        let stats = session.refine(get(&case, "options").unchecked_ref()).expect("a good request");
        let request = JSON::stringify(&case).map(String::from).expect("JSON");
        assert_eq!(number(&stats, "tetrahedra"), number(&case, "tetrahedra"), "{request}");
        assert_eq!(Some(session.hash()), get(&case, "hash").as_string(), "{request}");
    }
}

#[wasm_bindgen_test]
fn arrays_fit_the_stats_and_each_other() {
    let mut session = fed(MT, MT.len());
    let stats = session.refine(options(r#"{ "error": "1%" }"#).unchecked_ref()).expect("a good request");
    let mesh = session.mesh(15).expect("a mesh");
    let floats = |name| get(&mesh, name).unchecked_into::<Float32Array>().to_vec();
    let integers = |name| get(&mesh, name).unchecked_into::<Uint32Array>().to_vec();
    let (vertices, tetrahedra) = (number(&stats, "vertices") as usize, number(&stats, "tetrahedra") as usize);
    assert_eq!((floats("positions").len(), floats("field").len()), (3 * vertices, vertices));
    assert_eq!((integers("tets").len(), integers("neighbors").len()), (4 * tetrahedra, 4 * tetrahedra));
    assert!(integers("tets").iter().all(|vertex| (*vertex as usize) < vertices));
    assert!(number(&stats, "relativeErrorBound") <= 0.01);
}

#[wasm_bindgen_test]
fn steps_and_deltas_lead_to_the_same_mesh() {
    let mut session = fed(MT, MT.len());
    session.refine(options(r#"{ "error": "2%" }"#).unchecked_ref()).expect("a good request");
    let whole = session.hash();
    session.refine(options(r#"{ "error": "100%" }"#).unchecked_ref()).expect("a good request");
    let mut copy: Vec<u32> = Vec::new();
    session.request(options(r#"{ "error": "2%" }"#).unchecked_ref()).expect("a good request");
    for step in 0.. {
        assert!(step < 10_000, "it ends");
        let stats = session.step(f64::INFINITY, 100.0).expect("a good MT");
        let delta = session.delta(15).expect("a mesh");
        let [ranges, tets] = [get(&get(&delta, "changes"), "tets"), get(&delta, "tets")]
            .map(|array| array.unchecked_into::<Uint32Array>().to_vec());
        copy.resize(4 * number(&delta, "tetCount") as usize, 0);
        let mut at = 0;
        for range in ranges.chunks_exact(2) {
            let range = 4 * range[0] as usize..4 * range[1] as usize;
            copy[range.clone()].copy_from_slice(&tets[at..at + range.len()]);
            at += range.len();
        }
        if get(&stats, "done") == JsValue::TRUE {
            break;
        }
    }
    assert_eq!(session.hash(), whole);
    let mesh = session.mesh(15).expect("a mesh");
    assert_eq!(get(&mesh, "tets").unchecked_into::<Uint32Array>().to_vec(), copy);
}

#[wasm_bindgen_test]
fn a_function_tells_where_the_mesh_is_wanted() {
    let mut session = fed(MT, MT.len());
    let asked = |body: &str| {
        let options = options("{}");
        let function = Function::new_with_args("batch", body);
        Reflect::set(&options, &"where".into(), &function).expect("an object");
        options
    };
    let all = asked("return batch.errors.map((error) => error / 1e-9)");
    let stats = session.refine(all.unchecked_ref()).expect("a good request");
    assert_eq!(number(&stats, "tetrahedra"), number(&session.info().expect("it is there"), "tetrahedra"));
    let none = asked("return new Float32Array(batch.count)");
    let stats = session.refine(none.unchecked_ref()).expect("a good request");
    assert_eq!(number(&stats, "applied"), 0.0);
    for (wrong, words) in [("throw new Error('mine')", "mine"), ("return [1, 2]", "one number for each")] {
        let error: JsValue = session.refine(asked(wrong).unchecked_ref()).err().expect(wrong).into();
        let message = get(&error, "message").as_string().unwrap_or_default();
        assert!(message.contains("`where`") && message.contains(words), "{message}");
        assert_eq!(code(error), "bad-option");
    }
    session.refine(options("{}").unchecked_ref()).expect("it is usable still");
}

#[wasm_bindgen_test]
fn broken_files_and_requests_are_refused_with_a_code() {
    let mut early = CoreSession::new(Vec::new());
    assert_eq!(code(early.mesh(15).err().expect("refused")), "not-ready");
    assert_eq!(code(early.feed(b"<!doctype html><title>404</title>").err().expect("refused")), "not-mt");

    let half = MT.len() / 2;
    let mut cut = fed(&MT[..half], half);
    assert_eq!(code(cut.finish().err().expect("refused")), "truncated");

    let mut broken = MT.to_vec();
    broken[half] ^= 0x10;
    let mut session = CoreSession::new(Vec::new());
    assert_eq!(code(session.feed(&broken).err().expect("refused")), "corrupt");

    let mut session = fed(MT, MT.len());
    for (wrong, name) in [
        (r#"{ "eror": 1 }"#, "eror"),
        (r#"{ "error": -1 }"#, "error"),
        (r#"{ "error": "much" }"#, "error"),
        (r#"{ "error": {} }"#, "error"),
        (r#"{ "box": [0, 1] }"#, "box"),
        (r#"{ "box": [1, 1, 1, 0, 0, 0] }"#, "box"),
        (r#"{ "box": "all" }"#, "box"),
        (r#"{ "isovalues": ["x"] }"#, "isovalues"),
        (r#"{ "field": "none" }"#, "field"),
        (r#"{ "field": 1 }"#, "field"),
        (r#"{ "maxTets": 0 }"#, "maxTets"),
        (r#"{ "maxTets": "many" }"#, "maxTets"),
        (r#"{ "needs": [{ "eror": 1 }] }"#, "needs[0].eror"),
        (r#"{ "needs": [{ "sphere": { "center": [0, 0, 0] } }] }"#, "needs[0].sphere.radius"),
        (r#"{ "view": { "pixels": 1 } }"#, "view.matrix"),
        (r#"{ "where": "here" }"#, "where"),
        ("7", "options"),
    ] {
        let error = session.refine(options(wrong).unchecked_ref()).err().expect(wrong);
        let error: JsValue = error.into();
        let message = get(&error, "message").as_string().unwrap_or_default();
        assert!(message.contains(&format!("`{name}`")), "{wrong}: {message}");
        assert_eq!(code(error), "bad-option", "{wrong}");
    }
}

/// Without this, everything that draws could pass by never drawing.
#[wasm_bindgen_test]
async fn a_webgpu_adapter_gives_a_device() {
    let gpu = get(&get(&js_sys::global(), "navigator"), "gpu");
    assert!(!gpu.is_undefined(), "this browser has no WebGPU");
    let adapter = call(&gpu, "requestAdapter").await;
    assert!(!adapter.is_null(), "WebGPU gives no adapter");
    let device = call(&adapter, "requestDevice").await;
    assert!(!get(&device, "queue").is_undefined(), "the adapter gives no device");
}

/// What the promise of `object.method()` resolves to.
async fn call(object: &JsValue, method: &str) -> JsValue {
    let method: Function = get(object, method).unchecked_into();
    let promise: Promise = method.call0(object).expect("a method without arguments").unchecked_into();
    JsFuture::from(promise).await.expect("a promise that resolves")
}
