//! Movies: what changes from picture to picture, and the files that they are written to.

use super::picture::Picture;
use crate::files;
use crate::parse::parse_positive;
use crate::usage::refuse_usage;
use anyhow::{Context, Result};
use color_quant::NeuQuant;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// The options that make several pictures of one.
#[derive(clap::Args)]
#[command(next_help_heading = "Movie")]
pub struct Movie {
    /// Go around the model, which takes so many pictures.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=MOST), conflicts_with_all = ["over_time", "swing"])]
    turntable: Option<u32>,
    /// Draw each time step of the field. All have the mesh that meets what is asked for at all times.
    #[arg(long, conflicts_with_all = ["time", "swing"])]
    over_time: bool,
    /// Draw a whole period of what --deform displaces, which takes so many pictures.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=MOST), requires = "deform", conflicts_with = "phase")]
    swing: Option<u32>,
    /// Pictures in a second of a .gif or .apng, at most 50 [default: 20, of time steps 5].
    #[arg(long, value_name = "F", value_parser = parse_rate, allow_hyphen_values = true)]
    fps: Option<f64>,
}

/// Pictures of a movie, at most: those of a sequence have numbers of four digits.
const MOST: i64 = 9999;

/// Browsers show pictures of a GIF at most so many times a second.
const FASTEST: f64 = 50.0;

fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = parse_positive(text)?;
    if (0.01..=FASTEST).contains(&rate) {
        Ok(rate)
    } else {
        Err(format!("'{text}' is not from 0.01 to {FASTEST}"))
    }
}

/// How a picture of a movie differs from one alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame {
    /// Degrees around the model, to the right.
    pub turned: f64,
    /// The field that is shown, where it is another for each picture.
    pub step: Option<usize>,
    pub phase: Option<f64>,
}

impl Movie {
    /// Whether there are several pictures.
    fn is_movie(&self) -> bool {
        self.over_time || self.turntable.is_some() || self.swing.is_some()
    }

    /// Whether these are time steps.
    pub fn is_over_time(&self) -> bool {
        self.over_time
    }

    /// The pictures; `steps` are the time steps.
    pub fn frames(&self, steps: &[usize]) -> Vec<Frame> {
        let parts = |count: u32| (0..count).map(move |i| f64::from(i) / f64::from(count));
        if let Some(count) = self.turntable {
            parts(count).map(|part| Frame { turned: 360.0 * part, ..Frame::default() }).collect()
        } else if let Some(count) = self.swing {
            parts(count).map(|part| Frame { phase: Some(part), ..Frame::default() }).collect()
        } else if self.over_time {
            steps.iter().map(|&step| Frame { step: Some(step), ..Frame::default() }).collect()
        } else {
            vec![Frame::default()]
        }
    }

    /// Pictures in a second.
    pub fn rate(&self) -> f64 {
        self.fps.unwrap_or(if self.over_time { 5.0 } else { 20.0 })
    }

    /// What is written to a path.
    pub fn target(&self, path: &Path) -> Target {
        let kind = match files::ending(path).as_str() {
            "gif" => Kind::Gif,
            "apng" => Kind::Apng,
            _ if self.is_movie() => Kind::Sequence,
            _ => Kind::Still,
        };
        let is_animated = matches!(kind, Kind::Gif | Kind::Apng);
        if is_animated && !self.is_movie() {
            refuse_usage("a .gif or .apng is a movie: give --turntable, --over-time or --swing, too");
        }
        if self.fps.is_some() && !is_animated {
            refuse_usage("--fps is for a .gif or .apng: pictures of their own have no rate");
        }
        Target { path: path.to_owned(), kind }
    }
}

/// The file or files that are written.
pub struct Target {
    path: PathBuf,
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Still,
    Sequence,
    Gif,
    Apng,
}

/// The name of a .png, .gif or .apng.
pub fn parse_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match files::ending(&path).as_str() {
        "png" | "gif" | "apng" => Ok(path),
        _ => Err("the file's name must end in .png, or for a movie in .gif or .apng".to_owned()),
    }
}

impl Target {
    /// The file, or that with a number.
    pub fn path(&self, number: usize) -> PathBuf {
        if self.kind != Kind::Sequence {
            return self.path.clone();
        }
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        self.path.with_file_name(format!("{stem}-{:04}.png", number + 1))
    }

    /// Whether all pictures are in one file, with a rate.
    pub fn is_animated(&self) -> bool {
        matches!(self.kind, Kind::Gif | Kind::Apng)
    }

    /// Draws and writes `count` pictures.
    pub fn write(
        &self,
        count: usize,
        rate: f64,
        mut draw: impl FnMut(usize) -> Result<Picture>,
    ) -> Result<()> {
        match self.kind {
            Kind::Still | Kind::Sequence => {
                for number in 0..count {
                    let drawn = draw(number)?;
                    files::write_file(&self.path(number), |out| drawn.write(out))?;
                }
                Ok(())
            }
            Kind::Apng => files::write_file(&self.path, |out| write_apng(count, rate, draw, out)),
            Kind::Gif => files::write_file(&self.path, |out| write_gif(count, rate, draw, out)),
        }
    }
}

/// All pictures as they are, one behind the other.
fn write_apng(
    count: usize,
    rate: f64,
    mut draw: impl FnMut(usize) -> Result<Picture>,
    out: &mut impl Write,
) -> Result<()> {
    let first = draw(0)?;
    let mut encoder = first.encoder(out)?;
    encoder.set_animated(count as u32, 0)?;
    // The rate has two digits behind its point.
    encoder.set_frame_delay(100, (100.0 * rate).round() as u16)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&first.bytes())?;
    for number in 1..count {
        writer.write_image_data(&draw(number)?.bytes())?;
    }
    Ok(writer.finish()?)
}

/// How many pixels of all pictures the palette is made from, at most.
const SAMPLED: usize = 1 << 20;
/// Of 1 to 30, the thoroughness with which the palette is made: 1 looks at all of these pixels.
const THOROUGH: i32 = 3;
const COLOURS: usize = 256;

/// All pictures with one palette, so that what stays the same has the same colour in all of them. They wait in a file without a name until all
/// are drawn, since the palette is of all.
fn write_gif(
    count: usize,
    rate: f64,
    mut draw: impl FnMut(usize) -> Result<Picture>,
    out: &mut impl Write,
) -> Result<()> {
    let mut waiting = BufWriter::new(tempfile::tempfile().context("a temporary file could not be made")?);
    let (mut sampled, mut size, mut is_transparent) = (Vec::new(), [0; 2], false);
    for number in 0..count {
        let drawn = draw(number)?;
        let pixels: Vec<[u8; 4]> = drawn.straight().collect();
        (size, is_transparent) = (drawn.size, drawn.is_transparent);
        let every = (count * pixels.len()).div_ceil(SAMPLED);
        // Another part of each picture.
        let chosen = pixels.iter().skip(number % every).step_by(every).filter(|pixel| is_seen(**pixel));
        sampled.extend(chosen.flat_map(|[r, g, b, _]| [*r, *g, *b, u8::MAX]));
        waiting.write_all(pixels.as_flattened())?;
    }
    let mut waiting: File = waiting.into_inner().context("a temporary file could not be written")?;
    waiting.rewind()?;
    let colours = COLOURS - usize::from(is_transparent);
    let palette = NeuQuant::new(THOROUGH, colours, &sampled);
    let side = |side: u32| u16::try_from(side).context("pictures of a .gif have at most 65535 pixels a side");
    let (width, height) = (side(size[0])?, side(size[1])?);
    let mut encoder = gif::Encoder::new(out, width, height, &palette.color_map_rgb())?;
    encoder.set_repeat(gif::Repeat::Infinite)?;
    let mut waiting = BufReader::new(waiting);
    let mut bytes = vec![0; 4 * usize::from(width) * usize::from(height)];
    // A time in hundredths of a second, rounded for each picture so that all together take as long as they should.
    let at = |number: usize| (100.0 * number as f64 / rate).round();
    let mut nearest = Nearest::new(&palette, colours as u8);
    for number in 0..count {
        waiting.read_exact(&mut bytes)?;
        let indices: Vec<u8> = bytes.as_chunks::<4>().0.iter().map(|pixel| nearest.of(*pixel)).collect();
        encoder.write_frame(&gif::Frame {
            delay: (at(number + 1) - at(number)) as u16,
            dispose: if is_transparent { gif::DisposalMethod::Background } else { gif::DisposalMethod::Keep },
            transparent: is_transparent.then_some(colours as u8),
            width,
            height,
            buffer: indices.into(),
            ..gif::Frame::default()
        })?;
    }
    Ok(())
}

/// Whether a pixel is drawn where pixels are either seen or not.
fn is_seen([_, _, _, opacity]: [u8; 4]) -> bool {
    opacity >= 128
}

/// The colours of a palette, of which the last that was asked for is remembered: pixels beside one another are often equal.
struct Nearest<'a> {
    palette: &'a NeuQuant,
    /// That of pixels that are not seen.
    none: u8,
    last: ([u8; 4], u8),
}

impl<'a> Nearest<'a> {
    fn new(palette: &'a NeuQuant, none: u8) -> Self {
        Self { palette, none, last: ([0; 4], none) }
    }

    fn of(&mut self, pixel: [u8; 4]) -> u8 {
        if pixel != self.last.0 {
            let [r, g, b, _] = pixel;
            let found = self.palette.index_of(&[r, g, b, u8::MAX]) as u8;
            self.last = (pixel, if is_seen(pixel) { found } else { self.none });
        }
        self.last.1
    }
}
