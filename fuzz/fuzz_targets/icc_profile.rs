//! Any bytes as an ICC profile: linear light of every level, or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pleinair::color::profile::Encoding;
use pleinair::job::Job;

fuzz_target!(|data: &[u8]| {
    if let Ok(encoding) = Encoding::icc(data) {
        let levels: Vec<u8> = (0..=255).flat_map(|v| [v, 255 - v, v / 2]).collect();
        let mut out = vec![0.0; levels.len()];
        encoding.linear(&Job::serial(), &levels, [3, 3], 255.0, &mut out).expect("the shapes fit");
    }
});
