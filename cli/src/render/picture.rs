//! A picture as a PNG.

use anyhow::Result;
use std::io::Write;

/// A picture as it was drawn: premultiplied `RGBA`.
pub struct Picture {
    pub size: [u32; 2],
    pub pixels: Vec<u8>,
    pub is_transparent: bool,
    /// What it says of itself.
    pub about: String,
}

impl Picture {
    pub fn write(&self, out: &mut impl Write) -> Result<()> {
        let mut writer = self.encoder(out)?.write_header()?;
        writer.write_image_data(&self.bytes())?;
        Ok(writer.finish()?)
    }

    /// An encoder of such pictures, with what this one says of itself.
    pub fn encoder<'a, W: Write>(&self, out: &'a mut W) -> Result<png::Encoder<'a, &'a mut W>> {
        let [width, height] = self.size;
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(if self.is_transparent { png::ColorType::Rgba } else { png::ColorType::Rgb });
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let software = concat!("tetralod ", env!("CARGO_PKG_VERSION"));
        encoder.add_text_chunk("Software".to_owned(), software.to_owned())?;
        encoder.add_itxt_chunk("Description".to_owned(), self.about.clone())?;
        Ok(encoder)
    }

    /// The bytes of its file, before they are packed.
    pub fn bytes(&self) -> Vec<u8> {
        if self.is_transparent {
            self.straight().flatten().collect()
        } else {
            self.straight().flat_map(|[r, g, b, _]| [r, g, b]).collect()
        }
    }

    /// Its pixels with their colours as they are without their opacity.
    pub fn straight(&self) -> impl Iterator<Item = [u8; 4]> {
        let is_transparent = self.is_transparent;
        self.pixels
            .as_chunks::<4>()
            .0
            .iter()
            .map(move |pixel| if is_transparent { straight(*pixel) } else { *pixel })
    }
}

/// A pixel with its colour as it is without its opacity.
fn straight([r, g, b, a]: [u8; 4]) -> [u8; 4] {
    let [half, alpha] = [u32::from(a) / 2, u32::from(a).max(1)];
    let [r, g, b] = [r, g, b].map(|c| ((u32::from(c) * 255 + half) / alpha).min(255) as u8);
    [r, g, b, a]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_out_of_their_opacity() {
        assert_eq!(straight([0, 0, 0, 0]), [0, 0, 0, 0]);
        assert_eq!(straight([10, 128, 255, 255]), [10, 128, 255, 255]);
        assert_eq!(straight([64, 32, 0, 128]), [128, 64, 0, 128]);
        assert_eq!(straight([9, 1, 0, 8]), [255, 32, 0, 8]);
    }
}
