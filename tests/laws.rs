//! Laws of the core that hold for every input, tried on random ones.

use glam::DVec3;
use pleinair::clouds::bases::{Interpolation, weights};
use pleinair::clouds::density::Grid;
use pleinair::clouds::march::{MarchMethod, march};
use pleinair::clouds::phase::henyey_greenstein;
use pleinair::fit::objective::{LevelBins, histogram};
use pleinair::image::resize::resize;
use pleinair::job::Job;
use pleinair::math::elementary::exp;
use pleinair::math::geometry::{Pinhole, clip_to_box};
use pleinair::math::noise::Perlin;
use pleinair::math::random::Stream;
use proptest::prelude::*;

fn grid(key: u64, size: [usize; 3]) -> Grid {
    let random = Stream::new(key, 0);
    let data: Vec<f32> = (0..size.iter().product::<usize>() as u64).map(|i| random.uniform(i) as f32).collect();
    Grid::new(&data, size, DVec3::new(1.0, 2.0, 0.5), DVec3::ZERO).expect("valid")
}

fn unit(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z).try_normalize().unwrap_or(DVec3::X)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// The path through a and then b is the path through both.
    #[test]
    fn paths_compose(
        key in any::<u64>(), nx in 1_usize..6, ny in 1_usize..6, nz in 1_usize..6,
        at in prop::array::uniform3(0.0..1.0_f64), to in prop::array::uniform3(-1.0..1.0_f64), cut in 0.0..1.0_f64,
    ) {
        let grid = grid(key, [nx, ny, nz]);
        let p = grid.extent() * DVec3::from(at);
        let d = unit(to[0], to[1], to[2]) / grid.voxel;
        let whole = grid.integral(p, d, f64::INFINITY);
        let length = clip_to_box(p, d, DVec3::ZERO, grid.extent()).map_or(0.0, |(_, leave)| leave);
        let first = grid.integral(p, d, cut * length);
        let rest = grid.integral(p + d * (cut * length), d, f64::INFINITY);
        prop_assert!((first + rest - whole).abs() < 1e-9 * (1.0 + whole), "{first} + {rest} = {whole}");
        // And the way back is as long.
        let back = grid.integral(p + d * length, -d, length);
        prop_assert!((back - whole).abs() < 1e-9 * (1.0 + whole), "{back} back, {whole} there");
    }

    /// No more light comes out than goes in: J is at most 1 - exp(-sigma S), and never negative.
    #[test]
    fn scattered_light_is_bounded(key in any::<u64>(), azimuth in 0.0..6.3_f64, sun in 0.0..6.3_f64, sigma in 0.001..30.0_f64) {
        let grid = grid(key, [5, 4, 6]);
        let middle = grid.high() * 0.5;
        let eye = middle - DVec3::new(azimuth.sin(), azimuth.cos(), 0.2) * 20.0;
        let elevation = 0.2_f64.atan();
        let camera = Pinhole::new(eye, [azimuth, elevation, 0.3, 0.5], [9, 7]).expect("valid");
        let light = unit(sun.cos(), sun.sin(), 0.4);
        let images = march(&grid, &camera, light, &[sigma], MarchMethod::Fast, &Job::serial()).expect("runs");
        for (j, s) in images.single_scattering.iter().zip(&images.column_density) {
            let most = 1.0 - (-sigma * f64::from(*s)).exp();
            prop_assert!(*j >= 0.0 && f64::from(*j) <= most * (1.0 + 1e-4) + 1e-6, "{j} of at most {most}");
        }
    }

    /// Forward and backward scattering mirror each other, and the function is positive.
    #[test]
    fn the_phase_function_is_symmetric_in_sign(g in -0.99..0.99_f32, mu in -1.0..1.0_f32) {
        let (a, b) = (henyey_greenstein(g, mu, f32::sqrt), henyey_greenstein(-g, -mu, f32::sqrt));
        prop_assert!(a > 0.0 && (a / b - 1.0).abs() < 1e-3, "{a} and {b}");
    }

    /// Interpolation weights sum to one: a constant is reproduced.
    #[test]
    fn weights_sum_to_one(count in 1_usize..20, at in 0.0..1.0_f64, linear in any::<bool>()) {
        let nodes: Vec<f64> = (0..count).map(|i| 1e-3 * 1.5_f64.powi(i as i32)).collect();
        let sigma = nodes[0] + at * (nodes[count - 1] - nodes[0]);
        let how = if linear { Interpolation::Linear } else { Interpolation::Cubic };
        let (first, w) = weights(&nodes, sigma, how).expect("inside");
        prop_assert!((w.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{w:?}");
        prop_assert!(first + w.iter().filter(|&&x| x != 0.0).count() <= count.max(1) + 3, "within the nodes");
    }

    /// A histogram has every value in exactly one bin, and brighter values never in a lower one.
    #[test]
    fn bins_are_a_partition_in_order(count in 2_usize..=256, mut values in prop::collection::vec(-0.5..1.5_f32, 1..200)) {
        let bins = LevelBins::new(count).expect("valid");
        let h = histogram(&bins, values.iter().copied());
        prop_assert!((h.iter().sum::<f64>() - 1.0).abs() < 1e-9, "sum");
        values.sort_by(f32::total_cmp);
        prop_assert!(values.windows(2).all(|w| bins.of(w[0]) <= bins.of(w[1])), "order");
    }

    /// exp(a + b) = exp(a) exp(b) within rounding, and it rises.
    #[test]
    fn the_exponential_is_one(a in -40.0..40.0_f32, b in -40.0..40.0_f32) {
        let (x, y) = (f64::from(exp(a)) * f64::from(exp(b)), f64::from(exp(a + b)));
        // a + b itself is rounded by up to 4e-6.
        prop_assert!((x / y - 1.0).abs() < 1e-5, "{x} against {y}");
        prop_assert!(exp(a) <= exp(a + 1e-3 * (1.0 + a.abs())), "rises");
    }

    /// Resizing keeps the mean light and stays within the range of the picture.
    #[test]
    fn resizing_keeps_the_light(h in 1_usize..12, w in 1_usize..12, nh in 1_usize..12, nw in 1_usize..12, key in any::<u64>()) {
        let random = Stream::new(key, 1);
        let picture: Vec<f32> = (0..(h * w) as u64).map(|i| random.uniform(i) as f32).collect();
        let mut out = vec![0.0; nh * nw];
        resize(&picture, [h, w, 1], [nh, nw], &mut out, &Job::serial()).expect("valid");
        let mean = |x: &[f32]| x.iter().map(|&v| f64::from(v)).sum::<f64>() / x.len() as f64;
        prop_assert!((mean(&out) - mean(&picture)).abs() < 1e-5, "{} against {}", mean(&out), mean(&picture));
        let range = |x: &[f32]| x.iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        let ((a, b), (c, d)) = (range(&picture), range(&out));
        prop_assert!(c >= a - 1e-6 && d <= b + 1e-6, "in range");
    }

    /// Perlin 2002: at a lattice point noise is 0, its slope there is one of the twelve edges of a cube, and no face of a
    /// cell is a step.
    #[test]
    fn noise_is_perlins(key in any::<u64>(), x in -1e3..1e3_f64, y in -1e3..1e3_f64, z in -1e3..1e3_f64) {
        let noise = Perlin::new(key, 1);
        let (i, j, k) = (x.floor(), y.floor(), z.floor());
        prop_assert!(noise.at(i, j, k) == 0.0, "0 at {i}, {j}, {k}");
        // A power of two, so that nothing is rounded away.
        let h = 2.0_f64.powi(-20);
        let slope = [(h, 0.0, 0.0), (0.0, h, 0.0), (0.0, 0.0, h)]
            .map(|(a, b, c)| (noise.at(i + a, j + b, k + c) - noise.at(i - a, j - b, k - c)) / (2.0 * h));
        let mut sizes = slope.map(f64::abs);
        sizes.sort_by(f64::total_cmp);
        let edge = sizes.iter().zip([0.0, 1.0, 1.0]).all(|(size, wanted)| (size - wanted).abs() < 1e-9);
        prop_assert!(edge, "{slope:?} is no edge of a cube");
        let step = (noise.at(i - h, y, z) - noise.at(i + h, y, z)).abs();
        prop_assert!(step < 8.0 * h, "a step of {step} at the face x = {i}");
        prop_assert!(noise.at(x, y, z).abs() <= 1.05, "within its range");
    }
}
