//! The bytes of an OpenVDB file: bounded little-endian reading, zlib, and Blosc 1 frames with LZ4 or zlib inside.
//!
//! Every length comes from the file, so every one is compared with what is left before it is used, and what is unpacked is
//! never longer than the node needs (256 kB): no bytes make it panic, loop or take memory. Blosc's frame and LZ4's block
//! format after their public descriptions (c-blosc README_CHUNK_FORMAT, lz4_Block_format). Test: `lz4_by_hand` below,
//! files of OpenVDB 12 in `tests/oracles/test_openvdb.py`.

use flate2::{Decompress, FlushDecompress, Status};

use crate::error::{Error, Result};

/// An error of the file.
pub(super) fn bad(reason: impl Into<String>) -> Error {
    Error::Data { name: "file", reason: reason.into() }
}

/// A place in a file.
#[derive(Debug, Clone)]
pub(super) struct Cursor<'a> {
    data: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    /// Byte `at` of a file.
    pub(super) fn new(data: &'a [u8], at: usize) -> Result<Self> {
        if at > data.len() {
            return Err(bad(format!("is truncated: it points to byte {at} and has {}", data.len())));
        }
        Ok(Self { data, at })
    }

    /// How far it is.
    pub(super) fn position(&self) -> usize {
        self.at
    }

    /// The next bytes.
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let rest = &self.data[self.at..];
        if rest.len() < count {
            let (at, length) = (self.at, self.data.len());
            return Err(bad(format!("is truncated: {count} bytes are wanted at byte {at} and the file has {length}")));
        }
        self.at += count;
        Ok(&rest[..count])
    }

    /// The next bytes of a number.
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(N)?);
        Ok(out)
    }

    /// An unsigned number of 32 bits.
    pub(super) fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    /// A number of 64 bits.
    pub(super) fn i64(&mut self) -> Result<i64> {
        Ok(i64::from_le_bytes(self.array()?))
    }

    /// Double precision.
    pub(super) fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    /// A string of stated length.
    pub(super) fn text(&mut self) -> Result<String> {
        let length = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }

    /// A buffer of `size` bytes as `compression` (1 zlib, 4 Blosc) stores it.
    pub(super) fn buffer(&mut self, size: usize, compression: u32) -> Result<Vec<u8>> {
        if compression & 5 == 0 {
            return Ok(self.take(size)?.to_vec());
        }
        let length = self.i64()?;
        let count = usize::try_from(length.unsigned_abs()).map_err(|_| bad("is damaged: a length of 2^63"))?;
        let stored = self.take(count)?;
        let out = match (length, compression & 4) {
            (..=0, _) => stored.to_vec(),
            (_, 0) => inflate(stored, size)?,
            _ => blosc(stored, size)?,
        };
        if out.len() == size { Ok(out) } else { Err(bad(format!("is damaged: {size} bytes became {}", out.len()))) }
    }
}

/// A zlib stream of `size` bytes.
fn inflate(stored: &[u8], size: usize) -> Result<Vec<u8>> {
    let mut out = vec![0; size];
    let mut stream = Decompress::new(true);
    match stream.decompress(stored, &mut out, FlushDecompress::Finish) {
        Ok(Status::StreamEnd) if stream.total_out() == size as u64 => Ok(out),
        _ => Err(bad("is damaged: a zlib stream does not end where it should")),
    }
}

/// A little-endian number inside a frame.
fn word(frame: &[u8], at: usize) -> Result<usize> {
    let bytes = at.checked_add(4).and_then(|end| frame.get(at..end));
    let bytes: [u8; 4] = bytes.and_then(|b| b.try_into().ok()).ok_or_else(|| bad("is damaged: a short Blosc frame"))?;
    Ok(u32::from_le_bytes(bytes) as usize)
}

/// A Blosc 1 frame of `size` bytes.
fn blosc(frame: &[u8], size: usize) -> Result<Vec<u8>> {
    const CODECS: [&str; 8] = ["BloscLZ", "LZ4", "Snappy", "zlib", "Zstandard", "unknown", "unknown", "unknown"];
    let (total, block) = (word(frame, 4)?, word(frame, 8)?);
    let (flags, width) = (usize::from(frame[2]), usize::from(frame[3]).max(1));
    if total != size || block == 0 || frame.len() < 16 {
        return Err(bad(format!("is damaged: a Blosc frame of {total} bytes where {size} are wanted")));
    }
    if flags & 2 != 0 {
        return frame.get(16..16 + size).map(<[u8]>::to_vec).ok_or_else(|| bad("is truncated inside a Blosc frame"));
    }
    let codec = flags >> 5;
    if flags & 4 != 0 || (codec != 1 && codec != 3) {
        let how = if flags & 4 != 0 { "bit shuffle" } else { CODECS[codec] };
        return Err(bad(format!("is compressed by Blosc with {how}; LZ4 and zlib are read: save it again with one")));
    }
    let mut out = Vec::with_capacity(size);
    for (k, start) in (0..size).step_by(block).enumerate() {
        let length = block.min(size - start);
        // Bytes of equal significance are separate streams, but in a last, shorter block and in small ones.
        let apart = flags & 16 == 0 && length == block && width <= 16 && block / width >= 128;
        let streams = if apart { width } else { 1 };
        let (piece, mut at) = (length / streams, word(frame, 16 + 4 * k)?);
        let mut plain = Vec::with_capacity(length);
        for _ in 0..streams {
            let count = word(frame, at)?;
            let end = (at + 4).checked_add(count).filter(|&end| end <= frame.len());
            let part = &frame[at + 4..end.ok_or_else(|| bad("is truncated inside a Blosc frame"))?];
            match codec {
                _ if count == piece => plain.extend_from_slice(part),
                1 => plain.extend(lz4(part, piece)?),
                _ => plain.extend(inflate(part, piece)?),
            }
            at += 4 + count;
        }
        if plain.len() != length {
            return Err(bad("is damaged: a Blosc block of the wrong length"));
        }
        if flags & 1 == 0 || width == 1 {
            out.extend(plain);
        } else {
            let whole = length / width;
            out.extend((0..whole * width).map(|i| plain[(i % width) * whole + i / width]));
            out.extend_from_slice(&plain[whole * width..]);
        }
    }
    Ok(out)
}

/// An LZ4 block of `size` bytes: literals, then a match that may run into what it writes.
fn lz4(block: &[u8], size: usize) -> Result<Vec<u8>> {
    let short = || bad("is damaged: an LZ4 block ends early");
    let mut out: Vec<u8> = Vec::with_capacity(size);
    let mut at = 0;
    let byte = |at: &mut usize| -> Result<usize> {
        let value = *block.get(*at).ok_or_else(short)?;
        *at += 1;
        Ok(usize::from(value))
    };
    let extended = |nibble: usize, at: &mut usize| -> Result<usize> {
        let mut length = nibble;
        let mut more = if nibble == 15 { 255 } else { 0 };
        while more == 255 {
            more = byte(at)?;
            length += more;
        }
        Ok(length)
    };
    loop {
        let token = byte(&mut at)?;
        let literals = extended(token >> 4, &mut at)?;
        let end = at + literals;
        out.extend_from_slice(block.get(at..end).ok_or_else(short)?);
        at = end;
        if at == block.len() && out.len() == size {
            return Ok(out);
        }
        let back = byte(&mut at)? | byte(&mut at)? << 8;
        let length = extended(token & 15, &mut at)? + 4;
        if back == 0 || back > out.len() || out.len() + length > size {
            return Err(bad("is damaged: an LZ4 match outside of its block"));
        }
        for from in out.len() - back..out.len() - back + length {
            out.push(out[from]);
        }
    }
}

/// Half precision as single.
pub(super) fn half(bits: u16) -> f32 {
    let (sign, exponent, fraction) = (u32::from(bits >> 15) << 31, (bits >> 10) & 31, bits & 1023);
    let magnitude = match exponent {
        0 => f32::from(fraction) * f32::from_bits((127 - 24) << 23),
        31 => f32::from_bits(0x7f80_0000 | u32::from(fraction) << 13),
        _ => f32::from_bits((u32::from(exponent) + 112) << 23 | u32::from(fraction) << 13),
    };
    f32::from_bits(magnitude.to_bits() | sign)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block worked out by hand from the description: "abcabcabc" + 20 × "z", and its ways to be wrong.
    #[test]
    fn lz4_by_hand() {
        let block = [0x32, b'a', b'b', b'c', 3, 0, 0x1f, b'z', 1, 0, 0, 0x00];
        let plain = lz4(&block, 9 + 20).expect("the block is sound");
        assert_eq!(plain, [&b"abcabcabc"[..], &[b'z'; 20]].concat(), "literals, overlapping matches");
        for cut in 0..block.len() {
            assert!(lz4(&block[..cut], 29).is_err(), "cut at {cut}");
        }
        assert!(lz4(&block, 28).is_err() && lz4(&block, 30).is_err(), "another size");
        assert!(lz4(&[0x10, b'a', 2, 0], 5).is_err(), "a match before the block");
    }

    #[test]
    fn halves_are_exact() {
        let known = [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_5e-8),
            (0x3555, 0.333_251_95),
            (0x7c00, f32::INFINITY),
        ];
        for (bits, value) in known {
            assert_eq!(half(bits), value, "{bits:#x}");
        }
        assert!(half(0x7e00).is_nan() && half(0x8000).is_sign_negative(), "NaN and -0");
    }
}
