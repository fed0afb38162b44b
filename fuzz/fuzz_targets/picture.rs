//! Any bytes as a PNG or TIFF file: samples that fit the size, or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pleinair::image::decode::{Samples, decode};

fuzz_target!(
    // A decoder that panics is caught by `decode`, and is an error like others: libFuzzer's own hook would end the run.
    init: { std::panic::set_hook(Box::new(|_| {})); },
    |data: &[u8]| {
        let Ok(picture) = decode(data, 1 << 20) else { return };
        let count = match &picture.samples {
            Samples::Byte(s) => s.len(),
            Samples::Word(s) => s.len(),
            Samples::Long(s) => s.len(),
            Samples::Float(s) => s.len(),
        };
        if count != picture.size[0] * picture.size[1] * picture.samples_per_pixel {
            std::process::abort();
        }
    }
);
