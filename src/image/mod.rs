//! Pixels without physics (floor 1): histograms, thresholds, segmentation, filling.
//!
//! | file | computes | source |
//! |---|---|---|
//! | [`histogram`] | exact counts per channel | – |
//! | [`otsu`] | the threshold that separates two classes best | Otsu 1979 |
//! | [`segment`] | cloud and sky of a photograph | Dobashi et al. 2012 §4.1 |
//! | [`skyline`] | where the sky of a photograph ends | – |
//! | [`laplace`] | the smooth continuation of a picture into a hole | Pérez et al. 2003; Dobashi et al. 2012 §4.1 |
//! | [`clear_sky`] | the sky behind clouds and ground | – |
//! | [`grow`] | a mask grown by a disc | – |
//! | [`blur`], [`warp`] | means of neighbours; a picture moved and scaled | – |
//! | [`resize`] | area averages | – |
//! | [`multigrid`], [`gradients`] | the solver behind it | – |

pub mod blur;
pub mod clear_sky;
pub mod decode;
pub mod gradients;
pub mod grow;
pub mod histogram;
pub mod laplace;
pub mod multigrid;
pub mod otsu;
mod otsu_cut;
mod otsu_float;
pub mod resize;
pub mod rgbe;
pub mod segment;
pub mod skyline;
pub mod warp;

use crate::error::{Error, Result};

/// A number type that pictures are stored in.
pub trait Sample: Copy + PartialOrd + Send + Sync + 'static {
    /// Every value is also an `f32`.
    const SINGLE: bool;
    /// As `f32` (exact where [`SINGLE`](Self::SINGLE)).
    fn single(self) -> f32;
    /// As `f64`, exactly.
    fn double(self) -> f64;
}

macro_rules! sample {
    ($($t:ty: $single:expr),*) => {$(
        impl Sample for $t {
            const SINGLE: bool = $single;
            #[inline(always)]
            #[allow(clippy::unnecessary_cast, reason = "the macro also makes the identity")]
            fn single(self) -> f32 { self as f32 }
            #[inline(always)]
            #[allow(clippy::unnecessary_cast, reason = "the macro also makes the identity")]
            fn double(self) -> f64 { self as f64 }
        }
    )*};
}
sample!(u8: true, u16: true, f32: true, f64: false);

/// Check that a mask has one element for each of `pixels`.
fn check_mask(mask: Option<&[bool]>, pixels: usize) -> Result<()> {
    match mask {
        Some(m) if m.len() != pixels => {
            Err(Error::Shape { name: "mask", expected: format!("({pixels},)"), got: format!("({},)", m.len()) })
        }
        _ => Ok(()),
    }
}
