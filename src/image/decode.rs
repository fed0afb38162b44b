//! Decoding of deep pictures: PNG of 8 and 16 bits, TIFF of integers and floats, with what they say of their colours.
//!
//! The usual readers cut 16-bit colour to 8 bits in silence. Here samples come as they are stored, palettes as colours,
//! with ICC profile, cICP, gAMA, sRGB mark, EXIF and orientation beside them; what they mean in linear light is decided in
//! Python (`pleinair.io`). The work is that of the crates `png` and `tiff`; a size above the limit is refused from the
//! header, before memory is taken.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use png::{BitDepth, Transformations};
use tiff::ColorType;
use tiff::decoder::DecodingResult;
use tiff::tags::Tag;

use crate::error::{Error, Result};

/// Samples in rows, channels last.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Levels of 8 bits.
    Byte(Vec<u8>),
    /// Levels of 16 bits.
    Word(Vec<u16>),
    /// Levels of 32 bits.
    Long(Vec<u32>),
    /// Numbers.
    Float(Vec<f32>),
}

/// What the channels are, alpha aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// One channel.
    Grey,
    /// Red, green, blue.
    Rgb,
    /// Cyan, magenta, yellow, black.
    Cmyk,
}

/// A decoded file.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// Width and height [px].
    pub size: [usize; 2],
    /// Samples of a pixel, alpha among them [1].
    pub samples_per_pixel: usize,
    /// The samples.
    pub samples: Samples,
    /// What they are.
    pub channels: Channels,
    /// Whether the last one is alpha, and whether the others are multiplied by it.
    pub alpha: Option<bool>,
    /// ICC profile.
    pub profile: Option<Vec<u8>>,
    /// Coding-independent code points (ITU-T H.273): primaries, transfer function, matrix, full range.
    pub cicp: Option<[u8; 4]>,
    /// Exponent of the encoding by a gAMA chunk [1].
    pub gamma: Option<f64>,
    /// Chromaticities of white, red, green and blue by a cHRM chunk [1].
    pub chromaticities: Option<[[f64; 2]; 4]>,
    /// Whether an sRGB chunk says that it is sRGB.
    pub srgb: bool,
    /// The raw EXIF block.
    pub exif: Option<Vec<u8>>,
    /// Orientation by TIFF's tag, 1 to 8 [1].
    pub orientation: u16,
}

#[allow(clippy::needless_pass_by_value, reason = "it stands in map_err, which hands the error over")]
fn refused(reason: impl ToString) -> Error {
    Error::Data { name: "picture", reason: reason.to_string() }
}

fn within(size: [usize; 2], most: usize) -> Result<()> {
    let pixels = size[0].saturating_mul(size[1]);
    if pixels > most {
        return Err(refused(format!("{} x {} pixels are more than the {most} that are allowed", size[0], size[1])));
    }
    Ok(())
}

/// Decode a PNG or TIFF of at most `most` pixels.
///
/// # Errors
/// Damage, another format, a layout that is not read, or a size above the limit.
pub fn decode(data: &[u8], most: usize) -> Result<Decoded> {
    let attempt = catch_unwind(AssertUnwindSafe(|| {
        if data.starts_with(b"\x89PNG\r\n\x1a\n") { from_png(data, most) } else { from_tiff(data, most) }
    }));
    attempt.unwrap_or_else(|_| Err(refused("the file is damaged in a way that its decoder does not survive")))
}

fn from_png(data: &[u8], most: usize) -> Result<Decoded> {
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(data), png::Limits { bytes: 1 << 28 });
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    let header = decoder.read_header_info().map_err(refused)?;
    let size = [header.width as usize, header.height as usize];
    within(size, most)?;
    let mut reader = decoder.read_info().map_err(refused)?;
    let bytes = reader.output_buffer_size().ok_or_else(|| refused("its size overflows"))?;
    let mut buffer = vec![0; bytes];
    let frame = reader.next_frame(&mut buffer).map_err(refused)?;
    buffer.truncate(frame.buffer_size());
    // Chunks may follow the picture: an eXIf, say. Damage there does not touch the pixels.
    let _ = reader.finish();
    let info = reader.info();
    let (channels, alpha) = match frame.color_type {
        png::ColorType::Grayscale => (Channels::Grey, None),
        png::ColorType::GrayscaleAlpha => (Channels::Grey, Some(false)),
        png::ColorType::Rgb => (Channels::Rgb, None),
        png::ColorType::Rgba => (Channels::Rgb, Some(false)),
        png::ColorType::Indexed => return Err(refused("its palette was not expanded")),
    };
    let samples = if frame.bit_depth == BitDepth::Sixteen {
        Samples::Word(buffer.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect())
    } else {
        Samples::Byte(buffer)
    };
    Ok(Decoded {
        size,
        samples_per_pixel: frame.color_type.samples(),
        samples,
        channels,
        alpha,
        profile: info.icc_profile.as_ref().map(|p| p.to_vec()),
        cicp: info.coding_independent_code_points.map(|c| {
            [c.color_primaries, c.transfer_function, c.matrix_coefficients, u8::from(c.is_video_full_range_image)]
        }),
        gamma: info.gama_chunk.map(|g| f64::from(g.into_scaled()) / 1e5),
        chromaticities: info
            .chrm_chunk
            .map(|c| [c.white, c.red, c.green, c.blue].map(|(x, y)| [x, y].map(|v| f64::from(v.into_scaled()) / 1e5))),
        srgb: info.srgb.is_some(),
        exif: info.exif_metadata.as_ref().map(|e| e.to_vec()),
        orientation: 1,
    })
}

fn from_tiff(data: &[u8], most: usize) -> Result<Decoded> {
    let mut limits = tiff::decoder::Limits::default();
    limits.decoding_buffer_size = most.saturating_mul(16);
    limits.intermediate_buffer_size = most.saturating_mul(16);
    let mut decoder = tiff::decoder::Decoder::new(Cursor::new(data)).map_err(refused)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(refused)?;
    let size = [width as usize, height as usize];
    within(size, most)?;
    let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).map_err(refused)?.unwrap_or_default();
    // 1 is associated (premultiplied) alpha, 2 straight; 0 says nothing and is straight by custom.
    let alpha = Some(extra.first() == Some(&1));
    let color = decoder.colortype().map_err(refused)?;
    let (channels, samples_per_pixel, alpha) = match color {
        ColorType::Gray(_) => (Channels::Grey, 1, None),
        ColorType::GrayA(_) => (Channels::Grey, 2, alpha),
        ColorType::RGB(_) => (Channels::Rgb, 3, None),
        ColorType::RGBA(_) => (Channels::Rgb, 4, alpha),
        ColorType::CMYK(_) => (Channels::Cmyk, 4, None),
        ColorType::CMYKA(_) => (Channels::Cmyk, 5, alpha),
        other => return Err(refused(format!("its samples are not read: {other:?}"))),
    };
    let orientation = decoder.find_tag_unsigned::<u16>(Tag::Orientation).ok().flatten().unwrap_or(1);
    let profile = decoder.get_tag_u8_vec(Tag::IccProfile).ok();
    let samples = match decoder.read_image().map_err(refused)? {
        DecodingResult::U8(v) => Samples::Byte(v),
        DecodingResult::U16(v) => Samples::Word(v),
        DecodingResult::U32(v) => Samples::Long(v),
        DecodingResult::F16(v) => Samples::Float(v.into_iter().map(f32::from).collect()),
        DecodingResult::F32(v) => Samples::Float(v),
        DecodingResult::F64(v) => Samples::Float(v.into_iter().map(|x| x as f32).collect()),
        DecodingResult::U64(_) => return Err(refused("integers of 64 bits are not read")),
        _ => return Err(refused("signed integers have no level that is white")),
    };
    let count = match &samples {
        Samples::Byte(v) => v.len(),
        Samples::Word(v) => v.len(),
        Samples::Long(v) => v.len(),
        Samples::Float(v) => v.len(),
    };
    if count != size[0] * size[1] * samples_per_pixel {
        return Err(refused(format!("{color:?} in planes or of unequal depth is not read")));
    }
    Ok(Decoded {
        size,
        samples_per_pixel,
        samples,
        channels,
        alpha,
        profile,
        cicp: None,
        gamma: None,
        chromaticities: None,
        srgb: false,
        exif: None,
        orientation,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sixteen() -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 2, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(BitDepth::Sixteen);
        let mut writer = encoder.write_header().expect("header");
        writer.write_image_data(&[0, 1, 0, 2, 0, 3, 128, 0, 128, 1, 255, 255]).expect("data");
        writer.finish().expect("end");
        file
    }

    #[test]
    fn sixteen_bits_stay() {
        let found = decode(&sixteen(), 100).expect("a picture");
        assert_eq!(found.samples, Samples::Word(vec![1, 2, 3, 32768, 32769, 65535]), "levels as they were written");
        assert_eq!((found.size, found.channels, found.alpha), ([2, 1], Channels::Rgb, None), "layout");
    }

    #[test]
    fn a_size_above_the_limit_is_refused_from_the_header() {
        let wrong = decode(&sixteen(), 1).expect_err("too large");
        assert!(wrong.to_string().contains("2 x 1 pixels are more than the 1"), "{wrong}");
    }

    #[test]
    fn every_cut_is_an_error() {
        let file = sixteen();
        for cut in 0..file.len() - 12 {
            assert!(decode(&file[..cut], 100).is_err(), "cut at {cut}");
        }
    }
}
