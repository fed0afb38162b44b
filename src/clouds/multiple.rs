//! Multiple scattering in a cloud by volumetric path tracing, order by order, for many `(g, sigma)` at once (eqs 6-8 of
//! inverse_clouds): multiple importance sampling, next-event estimation, Russian roulette.
//!
//! Camera subpaths: with the volume given, the light a path carries to the Sun is known for every parameter. Order `k`
//! has `sigma^k exp(-sigma S)` times a product of `k` phase functions times `albedo^k`, where `S` is the
//! density-weighted length of all its segments. One path therefore serves all asymmetries and extinctions of a basis.
//! It is made with one pair of them, each pair in its turn, and weighted by the balance heuristic over all (Veach
//! 1995): its numerator and its denominator are products of a factor of `g` and a factor of `sigma`, so a vertex adds
//! an outer product to the images of its pixel.
//!
//! The first free flight is made to end in the volume. Every vertex is connected to the Sun (next-event estimation),
//! and the phase function of a cloud is so sharp that a path which happens to head for the Sun would count for all
//! others. Therefore vertices also send out short light-connected side paths whose directions are drawn around the Sun,
//! from lobes as wide as the phase function convolved with itself (Henyey-Greenstein: `g`, `g^2`, `g^4`). A side path
//! of any length and the camera subpath itself are strategies for the same light and divide it by the balance
//! heuristic, so no weight exceeds that of the analog estimator ([`EstimatorSettings::reference`]). (Drawing every
//! direction from a mixture fails in silence on long paths: its weights grow like a power of their length.) With an
//! albedo below 1, Russian roulette ends paths from order `ROULETTE_START` on. The depth towards the Sun is looked up
//! (sun.rs), in opaque voxels beyond an exact first segment. Order 1 is not sampled: march.rs integrates it.
//!
//! Units: metres, 1/m. Held by `tests/papers/test_multiple_laws.py` (laws) and `test_multiple_mitsuba.py` (Mitsuba).

use glam::{DVec3, Vec3};

use super::density::Grid;
use super::phase::{Lanes, Phases, angle, scatter};
use super::sun::SunOpticalDepth;
use super::tracking::{End, Tracker};
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::geometry::{Pinhole, clip_to_box};
use crate::math::random::Stream;
use crate::math::{elementary, lanes};

/// Most asymmetries and most extinctions of one run.
pub const NODES: usize = 16;
/// Most scatterings of a side path.
const SIDE_PATH_LENGTH: usize = 4;
/// Continuation probability of a side path after a scattering.
const CONTINUATION: f32 = 0.8;
/// Largest optical depth of a voxel at which the depth towards the Sun is looked up. Interpolating it darkens a cloud
/// by about the square of that: 0.1 % at 0.25, 0.5 % at 0.5, 2 % at 0.8, 46 % at 20.
const LOOKED_UP: f64 = 0.5;
/// Beyond it, two optical depths more than those of a voxel, but at most so many, are integrated and the rest looked
/// up, where little light is left to be wrong.
const NEAR: f64 = 8.0;
/// Order up to which a path is never ended by Russian roulette.
const ROULETTE_START: usize = 4;

/// Probability that a vertex of the camera subpath sends out a side path. Early ones serve the orders with the sharpest
/// light.
const SIDE_PATH_PROBABILITY: [f32; 3] = [1.0, 0.5, 0.3];

/// To which groups of images an order is added, and with which weights.
pub type OrderWeights = [(u16, f32); 4];

/// What to compute.
#[derive(Debug, Clone)]
pub struct EstimatorSettings {
    /// Asymmetries.
    pub g: Vec<f64>,
    /// Extinctions \[1/m\], ascending.
    pub sigma: Vec<f64>,
    /// Groups of orders.
    pub groups: usize,
    /// For order 2, 3, ...: up to four groups it is added to and with which weights. Orders beyond the last entry are
    /// not followed, unless `unbounded_orders`: then they are weighted as the last.
    pub order_weights: Vec<OrderWeights>,
    /// Whether paths go on until they leave the volume.
    pub unbounded_orders: bool,
    /// Albedo: 1 in a basis, where the weights keep the orders apart.
    pub albedo: f64,
    /// The analog estimator with exact depths towards the Sun and no side paths: slow, the oracle of the tests.
    pub reference: bool,
    /// Paths of a pixel.
    pub samples: usize,
    /// Key of the random numbers.
    pub key: u64,
}

/// Longest path that is followed.
pub const LONGEST: usize = 100_000;

impl EstimatorSettings {
    /// Refuse what has no meaning.
    pub fn validate(&self) -> Result<()> {
        for (name, nodes) in [("g", &self.g), ("sigma_t", &self.sigma)] {
            if nodes.is_empty() {
                return Err(Error::Empty { name });
            }
            if nodes.len() > NODES {
                return Err(Error::Data { name, reason: format!("at most {NODES} nodes, got {}", nodes.len()) });
            }
        }
        for &g in &self.g {
            in_range("g", g, -0.999, 0.999, "1")?;
        }
        for &sigma in &self.sigma {
            in_range("sigma_t", sigma, 0.0, super::march::MAX_EXTINCTION, "1/m")?;
        }
        in_range("albedo", self.albedo, 0.0, 1.0, "1")?;
        if self.samples == 0 || self.groups == 0 || self.order_weights.is_empty() {
            return Err(Error::Empty { name: "samples" });
        }
        if self.order_weights.iter().flatten().any(|&(group, _)| usize::from(group) >= self.groups) {
            return Err(Error::Data { name: "orders", reason: "a weight names a group that is not there".into() });
        }
        Ok(())
    }

    fn images(&self) -> usize {
        self.groups * self.g.len() * self.sigma.len()
    }

    fn last(&self) -> usize {
        if self.unbounded_orders { LONGEST } else { self.order_weights.len() + 1 }
    }
}

/// Images of the pixels whose rays meet density.
#[derive(Debug, Clone, Default)]
pub struct MultipleImages {
    /// Those pixels, ascending.
    pub pixels: Vec<u32>,
    /// Image `(group, g, sigma)` after image, each of the pixels above.
    pub images: Vec<f32>,
}

/// Random numbers of one path.
struct Sampler {
    stream: Stream,
    next: u64,
}

impl Sampler {
    #[inline(always)]
    fn two(&mut self) -> [f32; 2] {
        let bits = self.stream.bits(self.next);
        self.next += 1;
        [unit(bits), unit(bits << 32)]
    }
}

/// The upper 24 of 64 bits as a number in `[0, 1)`.
#[inline(always)]
fn unit(bits: u64) -> f32 {
    (bits >> 40) as f32 * (1.0 / 16_777_216.0)
}

/// Everything that all pixels share.
struct Estimator<'a, const N: usize> {
    settings: &'a EstimatorSettings,
    grid: &'a Grid,
    tracker: &'a Tracker,
    sun: &'a SunOpticalDepth,
    to_sun: Vec3,
    /// Whether voxels are so opaque that the depth towards the Sun must not be interpolated.
    exact: bool,
    /// Depth up to which it is then integrated \[m\].
    near: f32,
    /// Voxels per metre.
    scale: Vec3,
    phases: Phases<N>,
    /// Lobes around the Sun.
    lobes: [Phases<N>; 3],
    sigma: Lanes<N>,
    log_sigma: Lanes<N>,
}

/// Powers of the asymmetry of the lobes around the Sun.
const POWERS: [i32; 3] = [1, 2, 4];

/// One path so far.
#[derive(Clone, Copy)]
struct Path<const N: usize> {
    at: Vec3,
    direction: Vec3,
    /// Order of the vertex.
    order: usize,
    /// Density-weighted length \[m\].
    walked: f32,
    /// Phase functions of every asymmetry over those of the path's own.
    value: Lanes<N>,
    /// For the last 1, 2, ... directions: densities of a side path over phase functions.
    turned: [Lanes<N>; SIDE_PATH_LENGTH],
    /// Albedo of its scatterings over the probability of having survived them.
    light: f32,
}

/// Cells of the ray through a pixel: where they begin and what lies before.
#[derive(Default)]
struct RayCells {
    enter: Vec<f64>,
    before: Vec<f64>,
    depth: f64,
}

struct Pixel<'a, const N: usize> {
    ray: &'a RayCells,
    origin: DVec3,
    direction: DVec3,
    /// Probability of each extinction as strategy over that of ending inside.
    q: Lanes<N>,
    sums: &'a mut [f32],
}

#[inline(always)]
fn total<const N: usize>(x: &Lanes<N>) -> f32 {
    // A fixed tree: the same bits at every SIMD level.
    let mut a = [0.0_f32; 8];
    for (i, &x) in x.iter().enumerate() {
        a[i % 8] += x;
    }
    ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]))
}

impl<const N: usize> Estimator<'_, N> {
    #[inline(always)]
    fn side_path_probability(&self, order: usize) -> f32 {
        if self.settings.reference { 0.0 } else { SIDE_PATH_PROBABILITY[(order - 1).min(2)] }
    }

    /// Add what the vertex at the end of `path` sends from the Sun.
    #[inline(always)]
    fn add(&self, path: &Path<N>, pixel: &mut Pixel<'_, N>) {
        let k = path.order;
        let to_sun = self.phases.at(angle(path.direction, self.to_sun));
        let sun = if self.settings.reference {
            let toward = (self.to_sun * self.scale).as_dvec3();
            self.grid.integral(path.at.as_dvec3(), toward, f64::INFINITY) as f32
        } else if self.exact {
            match self.tracker.fly(path.at, self.to_sun * self.scale, self.near) {
                End::Inside(at) => self.near + self.sun.quick(at),
                End::Left(depth) => depth,
            }
        } else {
            self.sun.quick(path.at)
        };
        let (mut x, mut most) = ([0.0_f32; N], f32::NEG_INFINITY);
        for i in 0..N {
            x[i] = k as f32 * self.log_sigma[i] - self.sigma[i] * path.walked;
            most = most.max(x[i]);
        }
        let (mut chance, mut shade) = ([0.0_f32; N], [0.0_f32; N]);
        for i in 0..N {
            chance[i] = pixel.q[i] * elementary::exp(x[i] - most);
            shade[i] = elementary::exp(x[i] - most - self.sigma[i] * sun);
        }
        let mut turns = [1.0_f32; N];
        let mut continued = 1.0;
        for l in 0..SIDE_PATH_LENGTH.min(k - 1) {
            let f = continued * self.side_path_probability(k - 1 - l);
            for i in 0..N {
                turns[i] += f * path.turned[l][i];
            }
            continued *= CONTINUATION;
        }
        for i in 0..N {
            turns[i] *= path.value[i];
        }
        // Every asymmetry and every extinction is as often a strategy as any other (the latter are in `q`).
        let factor = path.light * self.settings.g.len() as f32 / (total(&chance) * total(&turns));
        let weights = &self.settings.order_weights[(k - 2).min(self.settings.order_weights.len() - 1)];
        let (ng, ns) = (self.settings.g.len(), self.settings.sigma.len().next_multiple_of(8));
        for &(group, weight) in weights {
            if weight == 0.0 {
                continue;
            }
            let sums = &mut pixel.sums[usize::from(group) * ng * ns..][..ng * ns];
            for (i, row) in sums.chunks_exact_mut(ns).enumerate() {
                let f = weight * factor * path.value[i] * to_sun[i];
                for (sum, &s) in row.iter_mut().zip(&shade) {
                    *sum += f * s;
                }
            }
        }
    }

    /// Scatter `path`, around the Sun if it is a `side_path`, and fly on. False when it has left the volume.
    #[inline(always)]
    fn extend(&self, path: &mut Path<N>, [j, m]: [usize; 2], side_path: bool, u: [f32; 4]) -> bool {
        let g = self.settings.g[j] as f32;
        let direction = if side_path {
            scatter(self.to_sun, g.powi(POWERS[((u[0] * 3.0) as usize).min(2)]), u[1], u[2])
        } else {
            scatter(path.direction, g, u[1], u[2])
        };
        let value = self.phases.at(angle(path.direction, direction));
        let sunward = angle(self.to_sun, direction);
        let (a, b, c) = (self.lobes[0].at(sunward), self.lobes[1].at(sunward), self.lobes[2].at(sunward));
        let own = 1.0 / value[j];
        let mut ratio = [0.0; N];
        for i in 0..N {
            path.value[i] *= value[i] * own;
            // Lanes without an asymmetry have no density.
            ratio[i] = (a[i] + b[i] + c[i]) * (1.0 / 3.0) / value[i].max(1e-30);
        }
        for l in (1..SIDE_PATH_LENGTH).rev() {
            for i in 0..N {
                path.turned[l][i] = path.turned[l - 1][i] * ratio[i];
            }
        }
        path.turned[0] = ratio;
        path.direction = direction;
        let wanted = -(1.0 - u[3]).ln() / self.sigma[m];
        match self.tracker.fly(path.at, direction * self.scale, wanted) {
            End::Inside(at) => {
                path.at = at;
                path.walked += wanted;
                path.order += 1;
                true
            }
            End::Left(_) => false,
        }
    }

    /// One camera subpath of a pixel and its side paths.
    #[inline(always)]
    fn follow(&self, pixel: &mut Pixel<'_, N>, choice: [usize; 2], first: [f32; 4], mut sampler: Sampler) {
        let last = self.settings.last();
        let sigma = self.settings.sigma[choice[1]];
        // The first flight, made to end inside.
        let wanted = -(f64::from(first[0]) * (-sigma * pixel.ray.depth).exp_m1()).ln_1p() / sigma;
        let cell = pixel.ray.before.partition_point(|&d| d <= wanted).max(1) - 1;
        let start = self.tracker.point(pixel.origin + pixel.direction * pixel.ray.enter[cell]);
        let toward = pixel.direction.as_vec3();
        let rest = (wanted - pixel.ray.before[cell]).max(0.0) as f32;
        let End::Inside(at) = self.tracker.fly(start, toward, rest) else { return };
        let mut path = Path {
            at,
            direction: (toward / self.scale).normalize(),
            order: 1,
            walked: wanted as f32,
            value: [1.0; N],
            turned: [[0.0; N]; SIDE_PATH_LENGTH],
            light: self.settings.albedo as f32,
        };
        let albedo = self.settings.albedo as f32;
        while path.order < last {
            let ([a, b], [c, d]) = (sampler.two(), sampler.two());
            if a < self.side_path_probability(path.order) {
                let mut side_path = path;
                for _ in 0..SIDE_PATH_LENGTH {
                    let ([e, f], [g, h], [i, _]) = (sampler.two(), sampler.two(), sampler.two());
                    if side_path.order >= last || !self.extend(&mut side_path, choice, true, [e, f, g, h]) {
                        break;
                    }
                    side_path.light *= albedo;
                    self.add(&side_path, pixel);
                    if i >= CONTINUATION {
                        break;
                    }
                }
            }
            if path.order <= ROULETTE_START {
                path.light *= albedo;
            } else if albedo < 1.0 && sampler.two()[0] >= albedo {
                return;
            }
            let u = if path.order == 1 { [0.0, first[1], first[2], first[3]] } else { [0.0, b, c, d] };
            if !self.extend(&mut path, choice, false, u) {
                return;
            }
            self.add(&path, pixel);
        }
    }

    /// All paths of a pixel.
    fn pixel(&self, pixel: &mut Pixel<'_, N>, index: u64, job: &Job) -> Result<()> {
        // Additive recurrences on the generalised golden ratio (Roberts 2018): strategies, the first flight and the
        // first direction are spread evenly over the paths of a pixel, from a random start.
        const RATIO: f64 = 1.112_775_684_278_705_5;
        let stream = Stream::new(self.settings.key, index);
        let steps: [u64; 6] = std::array::from_fn(|d| (RATIO.powi(-(d as i32) - 1) * 2.0_f64.powi(64)) as u64);
        let starts: [u64; 6] = std::array::from_fn(|d| stream.bits(d as u64));
        for i in 0..self.settings.samples as u64 {
            let at = |d: usize| starts[d].wrapping_add(steps[d].wrapping_mul(i));
            let choose = |d: usize, n: usize| ((u128::from(at(d)) * n as u128) >> 64) as usize;
            let choice = [choose(4, self.settings.g.len()), choose(5, self.settings.sigma.len())];
            let first = [0, 1, 2, 3].map(|d| unit(at(d)));
            let sampler = Sampler { stream, next: (i + 1) << 24 };
            lanes::run(
                #[inline(always)]
                || self.follow(pixel, choice, first, sampler),
            );
            job.check()?;
        }
        Ok(())
    }
}

/// Sample the light of orders 2 and higher that reaches `camera` from the Sun, whose depths `sun` holds.
pub fn sample_multiple(
    grid: &Grid,
    camera: &Pinhole,
    sun: &SunOpticalDepth,
    settings: &EstimatorSettings,
    job: &Job,
) -> Result<MultipleImages> {
    camera.validate()?;
    settings.validate()?;
    if settings.g.len().max(settings.sigma.len()) <= 8 {
        sample_nodes::<8>(grid, camera, sun, settings, job)
    } else {
        sample_nodes::<NODES>(grid, camera, sun, settings, job)
    }
}

fn sample_nodes<const N: usize>(
    grid: &Grid,
    camera: &Pinhole,
    sun: &SunOpticalDepth,
    settings: &EstimatorSettings,
    job: &Job,
) -> Result<MultipleImages> {
    let tracker = Tracker::new(grid, job)?;
    let (mut sigma, mut log_sigma) = ([0.0; N], [-1e30; N]);
    for (i, &s) in settings.sigma.iter().enumerate() {
        sigma[i] = s as f32;
        log_sigma[i] = s.ln() as f32;
    }
    let densest = (0..grid.size.iter().product()).map(|i| {
        let [nx, ny, _] = grid.size;
        grid.corner([i % nx + 1, i / nx % ny + 1, i / (nx * ny) + 1])
    });
    let densest = f64::from(densest.fold(0.0_f32, f32::max));
    let most = settings.sigma.iter().copied().fold(0.0, f64::max);
    let opacity = most * densest * sun.layer();
    let estimator = Estimator::<N> {
        exact: opacity > LOOKED_UP,
        near: ((2.0 + opacity).min(NEAR) / most).min(1e30) as f32,
        settings,
        grid,
        tracker: &tracker,
        sun,
        to_sun: sun.direction(),
        scale: (1.0 / grid.voxel).as_vec3(),
        phases: Phases::new(&settings.g, 1),
        lobes: POWERS.map(|n| Phases::new(&settings.g, n)),
        sigma,
        log_sigma,
    };
    let origin = grid.to_voxels(camera.position);
    let rows = job.map(camera.height, |y| {
        let depth = |x: usize| ray(grid, origin, camera.direction(x, y) / grid.voxel).depth;
        Ok((0..camera.width).filter(|&x| depth(x) > 0.0).map(|x| (y * camera.width + x) as u32).collect::<Vec<_>>())
    })?;
    let pixels = rows.concat();
    job.expect(pixels.len() as u64);
    let (ng, ns) = (settings.g.len(), settings.sigma.len());
    let padded = ns.next_multiple_of(8);
    let scale = 1.0 / settings.samples as f32;
    let mut images = vec![0.0; settings.images() * pixels.len()];
    // Pixel by pixel, then image by image: in portions, so that both never stand in memory whole.
    for start in (0..pixels.len()).step_by(PORTION) {
        let portion = &pixels[start..(start + PORTION).min(pixels.len())];
        let parts = job.map(portion.len(), |n| {
            let (x, y) = (portion[n] as usize % camera.width, portion[n] as usize / camera.width);
            let direction = camera.direction(x, y) / grid.voxel;
            let ray = ray(grid, origin, direction);
            let mut sums = vec![0.0; settings.groups * ng * padded];
            let mut q = [0.0; N];
            for (q, &s) in q.iter_mut().zip(&settings.sigma) {
                *q = (-1.0 / (-s * ray.depth).exp_m1() / ns as f64) as f32;
            }
            let mut pixel = Pixel { ray: &ray, origin, direction, q, sums: &mut sums };
            estimator.pixel(&mut pixel, u64::from(portion[n]), job)?;
            job.advance(1)?;
            Ok(sums)
        })?;
        for (n, sums) in parts.iter().enumerate() {
            for (row, sums) in sums.chunks_exact(padded).enumerate() {
                for (m, sum) in sums[..ns].iter().enumerate() {
                    images[(row * ns + m) * pixels.len() + start + n] = sum * scale;
                }
            }
        }
    }
    Ok(MultipleImages { pixels, images })
}

/// Pixels that are sampled before their sums are turned into images.
const PORTION: usize = 1024;

fn ray(grid: &Grid, origin: DVec3, direction: DVec3) -> RayCells {
    let mut ray = RayCells::default();
    if let Some((enter, leave)) = clip_to_box(origin, direction, DVec3::ZERO, grid.extent()) {
        grid.walk(origin, direction, enter, leave, |cell| {
            if cell.depth > 0.0 {
                ray.enter.push(cell.enter);
                ray.before.push(ray.depth);
                ray.depth += cell.depth;
            }
            true
        });
    }
    ray
}
