//! The sky model: radiance as a function of direction ([`SkyModel`]), and the view rays to ask for it (floor 3).
//!
//! A picture is never a list of directions in memory: they are made block by block where they are used, so a panorama
//! of 16 000 columns needs the picture and nothing else.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::fisheye::{Fisheye, half_sine};
use crate::math::geometry::Pinhole;

/// Directions of a block.
pub const BLOCK: usize = 256;
/// Some directions and what is seen there, one array for each coordinate.
#[derive(Debug, Clone)]
pub struct Block {
    /// Unit vectors away from the viewer.
    pub to: [[f32; BLOCK]; 3],
    /// Radiance of the three channels.
    pub light: [[f32; BLOCK]; 3],
}

impl Default for Block {
    fn default() -> Self {
        Self { to: [[0.0; BLOCK], [0.0; BLOCK], [1.0; BLOCK]], light: [[0.0; BLOCK]; 3] }
    }
}

/// Light on single pixels: indices and what is added there.
pub type SparsePixels = Vec<(usize, [f32; 3])>;

/// The relative error is that against the value plus this fraction of the largest.
pub const FLOOR: f64 = 1e-3;
/// A sky.
pub trait SkyModel: Sync {
    /// Fill in the radiance of a block. `without_table`: so few directions are wanted in all that a table is not worth
    /// making.
    fn shade(&self, block: &mut Block, without_table: bool);

    /// Radiance in one direction in `f64`, without tables.
    fn reference(&self, to: DVec3) -> [f64; 3];

    /// Radiance of its air in one direction by Monte Carlo, with the standard error; of other skies the reference.
    fn monte_carlo(&self, to: DVec3, _paths: usize, _key: u64) -> ([f64; 3], [f64; 3]) {
        (self.reference(to), [0.0; 3])
    }

    /// The sun's light that arrives on a plane facing it, for a disc of this angular radius \[rad\].
    fn direct_irradiance(&self, radius: f64) -> [f64; 3];

    /// Rows and columns of the table that `shade` looks up, if it is made.
    fn table_size(&self) -> Option<[usize; 2]> {
        None
    }

    /// What is too small for `shade`: discs and stars.
    fn overlay(&self, _look: &ViewRays<'_>) -> SparsePixels {
        SparsePixels::new()
    }

    /// Where `shade` varies so little from pixel to pixel that a picture may be interpolated (adaptive_sampling.rs).
    fn smooth(&self) -> Option<Smooth> {
        None
    }

    /// Sources of no extent: their directions, and their light on a plane that faces them.
    fn points(&self) -> Vec<(DVec3, DVec3)> {
        Vec::new()
    }

    /// Make what `shade` looks up for many directions, if it is not made.
    fn prepare(&self, _job: &Job) -> Result<()> {
        Ok(())
    }
}

/// Around Sun and Moon every pixel of a smooth sky is computed for itself \[rad\].
pub const AUREOLE: f64 = 1.5 * std::f64::consts::PI / 180.0;

/// How smooth a sky is.
#[derive(Debug, Clone)]
pub struct Smooth {
    /// Relative error allowed.
    pub tolerance: f64,
    /// Cosine to the vertical of the horizon, where there is a step.
    pub horizon: f64,
    /// Directions and cosines of angles around them, within which every pixel counts.
    pub cones: Vec<(DVec3, f64)>,
}

/// Which directions.
#[derive(Debug, Clone, Copy)]
pub enum ViewRays<'a> {
    /// The pixels of a camera.
    Camera(&'a Pinhole),
    /// The pixels of a fisheye; black outside its circle.
    Fisheye(&'a Fisheye),
    /// Equirectangular: row 0 at the zenith, column 0 at north, azimuth to the right.
    Panorama {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Listed, of any length but zero: `x, y, z` in turn.
    List(&'a [f64]),
}

impl ViewRays<'_> {
    /// How many directions.
    pub fn count(&self) -> usize {
        match self {
            Self::Camera(camera) => camera.width * camera.height,
            Self::Fisheye(camera) => camera.width * camera.height,
            Self::Panorama { width, height } => width * height,
            Self::List(list) => list.len() / 3,
        }
    }

    pub(super) fn validate(&self) -> Result<()> {
        match self {
            Self::Camera(camera) => camera.validate(),
            Self::Fisheye(camera) => camera.validate(),
            Self::Panorama { width, height } if width * height == 0 => Err(Error::Empty { name: "panorama" }),
            Self::Panorama { .. } => Ok(()),
            Self::List(list) => {
                let whole = list.len().is_multiple_of(3);
                let unit = |v: &[f64]| v.iter().all(|x| x.is_finite()) && v.iter().any(|&x| x != 0.0);
                if whole && list.chunks_exact(3).all(unit) {
                    return Ok(());
                }
                Err(Error::Data {
                    name: "directions",
                    reason: "must be finite vectors of three, none of them zero".into(),
                })
            }
        }
    }

    /// The direction at an index; zero where a fisheye has none.
    pub fn at(&self, index: usize) -> DVec3 {
        match self {
            Self::Camera(camera) => camera.direction(index % camera.width, index / camera.width),
            Self::Fisheye(camera) => {
                let (x, y) = ((index % camera.width) as f64 + 0.5, (index / camera.width) as f64 + 0.5);
                camera.through(x, y).unwrap_or(DVec3::ZERO)
            }
            Self::Panorama { width, height } => {
                let azimuth = (0.5 + (index % width) as f64) / *width as f64 * std::f64::consts::TAU;
                let polar = (0.5 + (index / width) as f64) / *height as f64 * std::f64::consts::PI;
                let (sin, cos) = polar.sin_cos();
                DVec3::new(azimuth.sin() * sin, azimuth.cos() * sin, cos)
            }
            Self::List(list) => {
                let v = DVec3::from_slice(&list[3 * index..]);
                // Scaled first: squares of huge and tiny vectors leave the range of numbers.
                (v / v.abs().max_element()).normalize()
            }
        }
    }

    /// All directions, `x, y, z` in turn.
    pub fn directions(&self, job: &Job, out: &mut [f64]) -> Result<()> {
        const CHUNK: usize = 1 << 10;
        job.chunks(out, 3 * CHUNK, |chunk, out| {
            for (i, to) in out.chunks_exact_mut(3).enumerate() {
                to.copy_from_slice(&self.at(chunk * CHUNK + i).to_array());
            }
            Ok(())
        })
    }

    /// The directions from `first` on; a block that is not full repeats the last.
    #[inline(always)]
    pub(super) fn fill(&self, columns: &[(f32, f32)], first: usize, count: usize, block: &mut Block) {
        match self {
            Self::Camera(camera) => {
                let scale = (camera.half_tan / camera.height as f64) as f32;
                let [u, v] = offsets([camera.width, camera.height], first, count);
                let [f, r, up] = [camera.forward, camera.right, camera.up].map(DVec3::as_vec3);
                for i in 0..BLOCK {
                    let (u, v) = (u[i] * scale, v[i] * scale);
                    let x = f.x + r.x * u + up.x * v;
                    let y = f.y + r.y * u + up.y * v;
                    let z = f.z + r.z * u + up.z * v;
                    let s = 1.0 / (x * x + y * y + z * z).sqrt();
                    (block.to[0][i], block.to[1][i], block.to[2][i]) = (x * s, y * s, z * s);
                }
            }
            Self::Fisheye(camera) => fill_fisheye(camera, first, count, block),
            Self::Panorama { width, height } => {
                let (mut x, mut y) = (first % width, first / width);
                let polar = |y: usize| ((0.5 + y as f64) / *height as f64 * std::f64::consts::PI).sin_cos();
                let (mut sin, mut cos) = polar(y);
                for i in 0..count {
                    let (east, north) = columns[x];
                    block.to[0][i] = east * sin as f32;
                    block.to[1][i] = north * sin as f32;
                    block.to[2][i] = cos as f32;
                    x += 1;
                    if x == *width {
                        (x, y) = (0, y + 1);
                        (sin, cos) = polar(y);
                    }
                }
            }
            Self::List(_) => {
                for i in 0..count {
                    let to = self.at(first + i);
                    (block.to[0][i], block.to[1][i], block.to[2][i]) = (to.x as f32, to.y as f32, to.z as f32);
                }
            }
        }
    }
}

/// Columns and rows of `count` pixels from `first` on, as offsets from twice the middle: exact.
#[inline(always)]
pub(super) fn offsets([width, height]: [usize; 2], first: usize, count: usize) -> [[f32; BLOCK]; 2] {
    let (mut x, mut y) = (first % width, first / width);
    let mut all = [[0.0_f32; BLOCK]; 2];
    let mut i = 0;
    while i < count {
        // The rest of a row at a time.
        let run = (width - x).min(count - i);
        let down = (height as i32 - 1 - 2 * y as i32) as f32;
        let right = 2 * x as i32 + 1 - width as i32;
        for k in 0..run {
            all[0][i + k] = (right + 2 * k as i32) as f32;
            all[1][i + k] = down;
        }
        (i, x, y) = (i + run, 0, y + 1);
    }
    all
}

/// The directions of a fisheye's pixels from `first` on: those of its rim outside the circle.
#[inline(always)]
fn fill_fisheye(camera: &Fisheye, first: usize, count: usize, block: &mut Block) {
    let scale = (0.5 / camera.radius()) as f32;
    let [f, r, up] = [camera.forward, camera.right, camera.up].map(DVec3::as_vec3);
    let (quarter, rim) = ((0.5 * camera.half) as f32, (0.5 * camera.half).sin() as f32);
    let [xs, ys] = offsets([camera.width, camera.height], first, count);
    for i in 0..BLOCK {
        let (u, v) = (xs[i] * scale, ys[i] * scale);
        let away = (u * u + v * v).sqrt();
        let inwards = if away > 1.0 { 1.0 / away } else { 1.0 };
        let (u, v, away) = (u * inwards, v * inwards, away * inwards);
        // Sine of half the angle, over the distance.
        let over = if camera.equal_area { rim } else { half_sine(away, quarter) };
        let q = over * away;
        let rest = 1.0 - q * q;
        let aside = 2.0 * over * (if rest > 0.0 { rest } else { 0.0 }).sqrt();
        let along = 1.0 - 2.0 * q * q;
        block.to[0][i] = f.x * along + (r.x * u + up.x * v) * aside;
        block.to[1][i] = f.y * along + (r.y * u + up.y * v) * aside;
        block.to[2][i] = f.z * along + (r.z * u + up.z * v) * aside;
    }
}
