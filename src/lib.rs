//! Skies, clouds and painted landscapes: four papers as one system for outdoor scenes.
//!
//! | floor | rooms | what lives there |
//! |---|---|---|
//! | 0 | [`error`], [`job`], [`math`] | numbers without meaning |
//! | 1 | [`astro`], [`color`], [`image`] | where it is in the sky, coordinates of colour, pixels without physics |
//! | 2 | [`air`], [`tone`] | what happens to light in air, after the eye or camera |
//! | 3 | [`clouds`], [`paint`], [`plants`], [`sky`], [`weather`] | what happens to light in a cloud, what mark is on the canvas, what shape, how bright a direction is, what falls |
//! | 5 | [`fit`] | which parameters explain a photograph |
//! | 6 | `bindings` | the Python objects |
//!
//! A room looks down only, and rooms of one floor do not see each other: `tests/floors.rs` holds it.
//!
//! | paper | page | tests in `tests/papers/` |
//! |---|---|---|
//! | aoas | [`papers::aoas`] | `test_aoas.py`, `test_aoas_styles.py` |
//! | realistic_sky | [`papers::realistic_sky`] | `test_realistic_sky.py`, `test_natural.py`, `test_dark_sky.py`, `test_cameras.py`, `test_tone_reproduction.py` |
//! | corot | [`papers::corot`] | `test_corot_plants.py`, `test_corot_paint.py`, `test_corot_detail.py`, `test_corot_scene.py`, `test_corot_motion.py`, `test_corot_whole.py` |
//! | inverse_clouds | [`papers::inverse_clouds`] | `test_inverse_clouds.py`, `test_inverse_clouds_search.py`, `test_inverse_clouds_fit.py`, `test_inverse_clouds_experiments.py`, `test_inverse_clouds_beyond.py`, `test_cloud_makers.py`, `test_multiple_laws.py`, `test_multiple_scattering.py`, `test_multiple_mitsuba.py`, `test_basis_low_rank.py` |
//!
//! Conventions: right-handed frame, x east, y north, z up, metres; directions are unit vectors pointing away from the
//! viewer; radians in the core, degrees at the Python face; pictures are `f32` `(height, width, 3)`, linear light,
//! Rec. 709 primaries, D65, row 0 at the top; volumes are `f32` `(nz, ny, nx)`.
//! The core is deterministic: same input, same bits, whatever the thread count or SIMD level.

pub mod air;
pub mod astro;
#[cfg(feature = "python")]
mod bindings;
pub mod clouds;
pub mod color;
pub mod error;
pub mod fit;
pub mod image;
pub mod job;
pub mod math;
pub mod paint;
#[cfg(doc)]
pub mod papers;
pub mod plants;
pub mod scene;
pub mod sky;
pub mod tone;
pub mod weather;

pub use error::{Error, Result};
