//! Promise: `tetralod html` writes one file, with the blocks of a volume that a request needs, that names nothing outside of it.

use crate::support::{Folder, bad, bucky, good, json, number};
use serde_json::Value;
use std::fs;

/// A folder with a volume, and a page whose viewer is a few words: what the real one does, `tests/js/html-browser.test.js` tests.
fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    fs::create_dir_all(folder.path("page/pkg")).expect("a folder");
    for (file, content) in
        [("index.html", "the page"), ("pkg/viewer.js", ""), ("pkg/inline-viewer.js", "let viewer;")]
    {
        fs::write(folder.path(&format!("page/{file}")), content).expect("a file");
    }
    bucky(17, &folder.path("bucky.vti"), &folder.path("bucky.mt"));
    folder
}

impl Folder {
    /// Makes a page, and gives its report and its text.
    fn page(&self, options: &[&str]) -> (Value, String) {
        let (mt, page, out) = (self.path("bucky.mt"), self.path("page"), self.path("out.html"));
        let mut all = vec!["html", &mt, "-o", &out, "--page", &page, "--no-poster", "--json"];
        all.extend(options);
        let report = json(&all);
        (report, fs::read_to_string(&out).expect("a page"))
    }
}

/// What the page is told of the volume.
fn about(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"about\">").expect("it is there");
    serde_json::from_str(rest.split_once("</script>").expect("it ends").0).expect("JSON")
}

#[test]
fn a_page_has_what_its_request_needs_and_the_scene() {
    let folder = folder("html-request");
    let (report, page) = folder.page(&[
        "--error",
        "5%",
        "--isovalue",
        "0.5",
        "--map",
        "turbo",
        "--from",
        "+x",
        "--title",
        "A <b> & \"c\"",
    ]);
    let about = about(&page);
    assert_eq!(about["request"], serde_json::json!({ "error": "5%", "field": 0 }));
    assert_eq!(about["scene"]["isosurfaces"][0]["value"], 0.5);
    assert_eq!(about["scene"]["colours"]["map"], "turbo");
    assert_eq!(about["camera"]["yaw"], 0.0);
    assert_eq!((&about["title"], &about["name"]), (&Value::from("A <b> & \"c\""), &Value::from("bucky.mt")));
    assert!(page.contains("<title>A &lt;b> &amp; &quot;c&quot;</title>"));
    assert_eq!(number(&report, "bytes") as usize, page.len());
    let ranges: Vec<u64> = serde_json::from_value(about["ranges"].clone()).expect("numbers");
    let held: u64 = ranges.as_chunks::<2>().0.iter().map(|[start, end]| end - start).sum();
    assert_eq!(number(&report, "volume_bytes") as u64, held.div_ceil(3) * 4);
    let (finer, _) = folder.page(&["--error", "1%"]);
    let (whole, _) = folder.page(&[]);
    let sizes = [&report, &finer, &whole].map(|report| number(report, "volume_bytes"));
    assert!(sizes[0] < sizes[1] && sizes[1] < sizes[2], "{sizes:?}");
    assert!(number(&report, "relative_error_bound") <= 0.05);
}

#[test]
fn a_page_names_nothing_outside_of_it_and_is_the_same_each_time() {
    let folder = folder("html-alone");
    let (_, page) = folder.page(&["--error", "5%"]);
    assert_eq!(folder.page(&["--error", "5%"]).1, page);
    for outside in ["http:", "https:", " src=", "href=", "@import", "url("] {
        assert!(!page.replace(" src=\"data:", "").contains(outside), "{outside}");
    }
    let (_, policy) = page.split_once("Content-Security-Policy\" content=\"").expect("a policy");
    let (policy, _) = policy.split_once('"').expect("its end");
    assert!(
        policy.starts_with("default-src 'none'; script-src 'sha256-") && !policy.contains("unsafe-inline"),
        "{policy}"
    );
}

#[test]
fn a_page_of_so_many_bytes_has_as_much_detail_as_fits() {
    let folder = folder("html-bytes");
    let (full, _) = folder.page(&[]);
    let whole = number(&full, "bytes");
    let least = whole - number(&full, "volume_bytes");
    let mut last = f64::INFINITY;
    for part in [0.4, 0.7, 1.0] {
        let most = (least + part * (whole - least)).floor();
        let (report, page) = folder.page(&["--bytes", &most.to_string()]);
        assert!(page.len() as f64 <= most, "{part}");
        let bound = number(&report, "relative_error_bound");
        assert!(bound < last, "{part}: {bound}");
        last = bound;
    }
    assert_eq!(last, number(&full, "relative_error_bound"));
    let (mt, page, out) = (folder.path("bucky.mt"), folder.path("page"), folder.path("none.html"));
    bad(
        1,
        &["html", &mt, "-o", &out, "--page", &page, "--no-poster", "--bytes", "1K"],
        &["--bytes 1024", "the smallest page"],
    );
    assert!(!folder.names().contains(&"none.html".to_owned()));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = folder("html-refused");
    let (mt, page) = (folder.path("bucky.mt"), folder.path("page"));
    let [out, picture] = ["out.html", "out.png"].map(|name| folder.path(name));
    bad(1, &["html", &mt, "-o", &picture, "--page", &page], &[".html", "tetralod render"]);
    bad(2, &["html", &mt, "-o", &out, "--page", &page, "--max-updates", "9"], &["--max-updates"]);
    bad(2, &["html", &mt, "-o", &out, "--page", &page, "--opacity", "9"], &["--opacity"]);
    bad(1, &["html", &mt, "-o", &out, "--page", &folder.path("")], &["pkg/viewer.js"]);
    fs::write(folder.path("page/pkg/inline-viewer.js"), "'</script>'").expect("a file");
    bad(1, &["html", &mt, "-o", &out, "--page", &page], &["inline-viewer.js"]);
}

#[test]
fn a_file_that_does_not_come_in_blocks_is_there_as_a_whole() {
    let folder = folder("html-vertex");
    let [half_edge, vertex] = ["bucky.mt", "vertex.mt"].map(|name| folder.path(name));
    good(&["convert", &half_edge, "--kind", "vertex", "-o", &vertex]);
    fs::rename(&vertex, &half_edge).expect("it is there");
    let bytes = fs::metadata(&half_edge).expect("it is there").len();
    let (_, page) = folder.page(&["--error", "10%"]);
    assert_eq!(about(&page)["ranges"], serde_json::json!([0, bytes]));
}
