//! `tetralod html`: one HTML file with a volume, the viewer, and of the MT file what a request needs.

mod request;

use super::files::{self, Bytes};
use super::parse::parse_bytes;
use super::query::{Answer, Summary};
use super::render;
use super::render::drawn::Drawn;
use super::view::page::Page;
use super::{output, usage};
use anyhow::{Context, Result, ensure};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::io::{Cursor, Write};
use std::ops::Range;
use std::path::PathBuf;
use tetralod::format::DecodeOptions;
use tetralod::session::Client;
use tetralod::stream::{FileSource, RangeSource};
use tetralod_render::scene::SceneState;

/// Writes one HTML file that shows a volume: with the viewer, and of the MT file what a request needs.
///
/// It opens from a disk and out of a mail, and asks for nothing elsewhere. Inside of what was asked for, all works as with the whole file; a
/// request for more detail gets what there is, and the page says so.
#[derive(clap::Args)]
#[command(after_help = "\
Examples: tetralod html engine.mt --error 1% -o engine.html
          tetralod html engine.mt --isovalue 0.3 --error 1% --map turbo --from +x -o engine.html
          tetralod html engine.mt --bytes 3M -o engine.html")]
pub struct Arguments {
    /// The page to write, a .html file.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    drawn: Drawn,
    #[command(flatten)]
    own: Own,
}

/// The options of the page itself.
#[derive(clap::Args)]
#[command(next_help_heading = "Page")]
struct Own {
    /// At most so many bytes for the page: blocks with smaller errors are left out. K, M and G are KiB, MiB and GiB.
    #[arg(long, value_name = "N[K|M|G]", value_parser = parse_bytes, allow_hyphen_values = true)]
    bytes: Option<u64>,
    /// The title of the page [default: the name of the file].
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// Width and height in pixels of the picture that is there until the viewer draws, and where it cannot.
    #[arg(long, value_name = "WxH", default_value = "960x720", value_parser = render::parse_dimensions)]
    poster: [u32; 2],
    /// Without such a picture: then the same command gives the same bytes on all machines.
    #[arg(long)]
    no_poster: bool,
    /// A folder with the page of `view`, and with the npm package in `pkg`, in the place of those in this program.
    #[arg(long, value_name = "DIR", hide = true)]
    page: Option<PathBuf>,
}

/// The result as programs get it, in bytes.
#[derive(Serialize)]
struct Report {
    bytes: usize,
    /// As text, as all that follows is.
    viewer_bytes: usize,
    volume_bytes: usize,
    poster_bytes: usize,
    /// Why there is no picture, if there was to be one.
    #[serde(skip_serializing_if = "Option::is_none")]
    no_poster: Option<String>,
}

/// A page, and what it has been made of.
pub struct Made {
    pub page: String,
    report: Report,
    summary: Summary,
    seconds: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { output, drawn, .. } = arguments;
    files::check_ending(output, "html")?;
    files::check_output(output, drawn.files())?;
    let Made { page, report, summary, seconds } = make(arguments)?;
    files::write_file(output, |out| Ok(out.write_all(page.as_bytes())?))?;
    let [viewer, volume, poster] = [report.viewer_bytes, report.volume_bytes, report.poster_bytes]
        .map(|bytes| output::bytes(bytes as u64));
    let rows = vec![
        ("file", output.display().to_string()),
        ("file size", output::bytes(report.bytes as u64)),
        ("of that", format!("viewer {viewer}, volume {volume}, picture {poster}")),
    ];
    if let Some(why) = &report.no_poster {
        output::note(&format!("warning: the page has no picture for browsers that cannot draw: {why}"));
    }
    drawn.query.print(&report, rows, (&summary, seconds))
}

/// Makes the page.
pub fn make(arguments: &Arguments) -> Result<Made> {
    let Arguments { drawn, own, .. } = arguments;
    let query = &drawn.query;
    drawn.shown.check();
    if query.is_stopped_early() {
        usage::refuse_usage("--max-ms and --max-updates stop work before it is done; a page does all of it");
    }
    let viewer = Page::of(own.page.as_deref())?.read("pkg/inline-viewer.js")?;
    let viewer = String::from_utf8(viewer.into_owned()).context("pkg/inline-viewer.js")?;
    let mut answer = query.answer()?;
    let field = answer.opened.info()?.fields[answer.field].clone();
    let scene = drawn.scene(&mut answer.opened.session, answer.field, &field)?;
    let limit = own.bytes.unwrap_or(u64::MAX);
    // Text takes four bytes for three; what else is in the page shows when it is there.
    let mut room = limit / 4 * 3;
    let needed = |most: u64| answer.opened.session.needed_bytes(most);
    let head: u64 = needed(0).iter().map(|range| range.end - range.start).sum();
    let source = Bytes::of(&query.file).and_then(|mut source| Part::of(&mut source, needed(u64::MAX)));
    let part = source.with_context(|| query.file.display().to_string())?;
    if (part.bytes.len() as u64) <= room {
        let made = assemble(arguments, &mut answer, &scene, &viewer, &part)?;
        if made.page.len() as u64 <= limit {
            return Ok(made);
        }
        room = (part.bytes.len() as u64 - head).saturating_sub(beyond(&made, limit));
    }
    let mut source = part.source(answer.opened.bytes);
    loop {
        let part = Part::of(&mut source, answer.opened.session.needed_bytes(room))?;
        let source = Bytes::of_part(part.source(answer.opened.bytes));
        let client = Client::open(source, DecodeOptions::default(), u64::MAX)?;
        let made = assemble(arguments, &mut query.answer_from(client)?, &scene, &viewer, &part)?;
        if made.page.len() as u64 <= limit {
            return Ok(made);
        }
        ensure!(
            room > 0,
            "--bytes {limit}: the smallest page of this volume has {} bytes; give more{}",
            made.page.len(),
            if own.no_poster { "" } else { ", or --no-poster" }
        );
        room = room.min(part.bytes.len() as u64 - head).saturating_sub(beyond(&made, limit));
    }
}

/// How many bytes of the volume less make a page as small as it has to be.
fn beyond(made: &Made, limit: u64) -> u64 {
    (made.page.len() as u64).saturating_sub(limit).div_ceil(4) * 3
}

/// Some bytes of a file.
struct Part {
    ranges: Vec<Range<u64>>,
    /// Those of all ranges, one behind the other.
    bytes: Vec<u8>,
}

impl Part {
    fn of(source: &mut impl RangeSource, ranges: Vec<Range<u64>>) -> Result<Self> {
        Ok(Self { bytes: source.read(&ranges)?, ranges })
    }

    /// A file of so many bytes of which this part is there.
    fn source(&self, total: u64) -> FileSource<Cursor<Vec<u8>>> {
        FileSource::of_part(Cursor::new(self.bytes.clone()), self.ranges.clone(), total)
    }
}

/// Puts a page together.
fn assemble(
    arguments: &Arguments,
    answer: &mut Answer,
    scene: &SceneState,
    viewer: &str,
    part: &Part,
) -> Result<Made> {
    let Arguments { drawn: Drawn { query, placed, .. }, own, .. } = arguments;
    let [width, height] = own.poster;
    let aspect = f64::from(width) / f64::from(height);
    let bounds = answer.opened.session.view().bounds();
    let camera = placed.camera_of_one(&bounds, aspect);
    let (mut poster, mut no_poster) = (String::new(), None);
    if !own.no_poster {
        match render::png(&mut answer.opened.session, scene, &camera, own.poster) {
            Ok(bytes) => {
                let picture = BASE64_STANDARD.encode(bytes);
                poster = format!("<img slot=\"poster\" alt=\"\" src=\"data:image/png;base64,{picture}\">");
            }
            Err(error) => no_poster = Some(format!("{error:#}")),
        }
    }
    let opened = &answer.opened;
    let name = query.file.file_name().unwrap_or_default().to_string_lossy();
    let title = own.title.as_deref().unwrap_or(&name);
    let needs = answer.needs.iter().map(|named| &named.need);
    let ranges: Vec<u64> = part.ranges.iter().flat_map(|range| [range.start, range.end]).collect();
    let about = json!({
        "name": name,
        "title": title,
        "ranges": ranges,
        "total": opened.bytes,
        "request": request::options(needs, &query.limits(), answer.field, opened.session.regions()),
        "scene": without_nulls(serde_json::to_value(scene)?),
        "camera": camera.state(),
        "narrowest": 0.5 * placed.camera_of_one(&bounds, 0.5).distance(),
    });
    let volume = BASE64_STANDARD.encode(&part.bytes);
    let page = page(title, &about.to_string().replace('<', "\\u003c"), &poster, viewer, &volume)?;
    let report = Report {
        bytes: page.len(),
        viewer_bytes: viewer.len(),
        volume_bytes: volume.len(),
        poster_bytes: poster.len(),
        no_poster,
    };
    Ok(Made { page, report, summary: answer.summary.clone(), seconds: answer.seconds })
}

/// What is left out has its default; in a page, nothing else may say so inside of an object.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(members) => {
            let given = members.into_iter().filter(|(_, value)| !value.is_null());
            Value::Object(given.map(|(name, value)| (name, without_nulls(value))).collect())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(without_nulls).collect()),
        other => other,
    }
}

const STYLE: &str = include_str!("html/page.css");
const CODE: &str = concat!(include_str!("html/page.js"), "\n", include_str!("html/part.js"));
const BODY: &str = include_str!("html/body.html");

/// The text of a page. Its policy names what is in it and nothing else, so that nothing else is ever asked for or run.
fn page(title: &str, about: &str, poster: &str, viewer: &str, volume: &str) -> Result<String> {
    ensure!(
        !viewer.contains("</script") && !viewer.contains("<!--"),
        "pkg/inline-viewer.js cannot stand in a page; make the package anew"
    );
    let [style, of_viewer, of_code] = [STYLE, viewer, CODE].map(hash);
    let version = env!("CARGO_PKG_VERSION");
    let title = escaped(title);
    let body = BODY.replace("{version}", version).replace("{title}", &title).replace("{poster}", poster);
    Ok(format!(
        "<!doctype html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src {of_viewer} {of_code} 'wasm-unsafe-eval'; \
worker-src blob:; style-src {style}; img-src data: blob:; base-uri 'none'; form-action 'none'\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<meta name=\"generator\" content=\"tetralod {version}\">
<title>{title}</title>
<style>{STYLE}</style>
</head>
{body}<script type=\"application/json\" id=\"about\">{about}</script>
<script type=\"text/plain\" id=\"volume\">{volume}</script>
<script type=\"module\">{viewer}</script>
<script type=\"module\">{CODE}</script>
</html>
"
    ))
}

/// A text in a page.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// What a policy calls a script or a style.
fn hash(text: &str) -> String {
    format!("'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(text.as_bytes())))
}
