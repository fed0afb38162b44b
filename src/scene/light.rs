//! Light at a point of a scene: irradiance by Sun and Moon, by the whole sky (spherical harmonics), and bounced by the
//! ground; radiance of painted surfaces (diffuse reflectance) (floor 4).
//!
//! The sky is sampled in rings around its lamp and projected on the real spherical harmonics of degree 0, 1, 2 and 4; a
//! cosine lobe has no others up to 5 (Ramamoorthi and Hanrahan 2001, eq 19). The half below the horizon is not the sky's
//! but a level ground of one reflectance, whose light is exact. Irradiance is that of planes in the open: what stands
//! before the sky takes none of it away.
//!
//! A painter's palette has its own shading: dark colours for what is in the shade. As reflectance a colour `c` of it is
//! `c (Y / Y(c))^k`, with the luminance `Y` of its middle: `k = 0` keeps the palette's shading over that of the light,
//! `k = 1` leaves the light alone. A palette of one colour is that reflectance for any `k`.
//!
//! Units: radiance in the sky's unit, irradiance in that times sr. Error: 0.7 % of a uniform sky's irradiance for any
//! plane (`a_white_furnace_is_white`). Cost: 40 ns a stroke.

use glam::DVec3;

use crate::color::spaces::luminance_of;
use crate::error::{Error, Result};
use crate::job::Job;

/// Rings around the lamp and samples of a ring.
const RINGS: usize = 320;
const ROUND: usize = 128;
/// Harmonics of the degrees 0, 1, 2 and 4.
pub const HARMONICS: usize = 18;
/// Of a cosine lobe in each degree, over pi.
const LOBE: [f64; 4] = [1.0, 2.0 / 3.0, 0.25, -1.0 / 24.0];
/// Elements of a chunk.
const CHUNK: usize = 2048;

fn check(name: &'static str, got: usize, want: usize) -> Result<()> {
    if got == want {
        return Ok(());
    }
    Err(Error::Shape { name, expected: format!("({want},)"), got: format!("({got},)") })
}

/// Directions of the upper half of the sphere, densely around `axis`, and the solid angle of each \[sr\].
pub fn dome(axis: DVec3) -> (Vec<f64>, Vec<f64>) {
    let aside = axis.any_orthonormal_vector();
    let other = axis.cross(aside);
    let edge = |i: usize| std::f64::consts::PI * (i as f64 / RINGS as f64).powi(2);
    let (mut to, mut solid) = (Vec::new(), Vec::new());
    for i in 0..RINGS {
        let (low, high) = (edge(i), edge(i + 1));
        let band = 2.0 * (0.5 * (high - low)).sin() * (0.5 * (high + low)).sin();
        let (sin, cos) = (0.5 * (low + high)).sin_cos();
        for j in 0..ROUND {
            let turn = (j as f64 + 0.5 * (i % 2) as f64) / ROUND as f64 * std::f64::consts::TAU;
            let (s, c) = turn.sin_cos();
            let d = axis * cos + (aside * c + other * s) * sin;
            if d.z > 0.0 {
                to.extend(d.to_array());
                solid.push(band * std::f64::consts::TAU / ROUND as f64);
            }
        }
    }
    // Samples on the horizon are whole or not there: together they are half a sphere.
    let by = std::f64::consts::TAU / solid.iter().sum::<f64>();
    for s in &mut solid {
        *s *= by;
    }
    (to, solid)
}

/// Real orthonormal harmonics of a direction, of the degrees 0, 1, 2 and 4, z up.
fn harmonics([x, y, z]: [f64; 3]) -> [f64; HARMONICS] {
    let pi = std::f64::consts::PI;
    let root = |v: f64| (v / pi).sqrt();
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        root(0.25),
        root(0.75) * y,
        root(0.75) * z,
        root(0.75) * x,
        root(3.75) * x * y,
        root(3.75) * y * z,
        0.25 * root(5.0) * (3.0 * zz - 1.0),
        root(3.75) * x * z,
        0.5 * root(3.75) * (xx - yy),
        0.75 * root(35.0) * x * y * (xx - yy),
        0.75 * root(17.5) * y * z * (3.0 * xx - yy),
        0.75 * root(5.0) * x * y * (7.0 * zz - 1.0),
        0.75 * root(2.5) * y * z * (7.0 * zz - 3.0),
        0.1875 * root(1.0) * (35.0 * zz * zz - 30.0 * zz + 3.0),
        0.75 * root(2.5) * x * z * (7.0 * zz - 3.0),
        0.375 * root(5.0) * (xx - yy) * (7.0 * zz - 1.0),
        0.75 * root(17.5) * x * z * (xx - 3.0 * yy),
        0.1875 * root(35.0) * (xx * xx - 6.0 * xx * yy + yy * yy),
    ]
}

fn degree(k: usize) -> usize {
    match k {
        0 => 0,
        1..=3 => 1,
        4..=8 => 2,
        _ => 3,
    }
}

/// Coefficients of a sky's irradiance, from its radiance in directions of [`dome`]: the sum of coefficient times harmonic
/// of a normal is the irradiance of that plane.
pub fn project(to: &[f64], solid: &[f64], light: &[f32]) -> Result<[[f64; 3]; HARMONICS]> {
    check("solid", solid.len(), to.len() / 3)?;
    check("light", light.len(), to.len())?;
    let mut out = [[0.0; 3]; HARMONICS];
    for ((d, rgb), s) in to.as_chunks::<3>().0.iter().zip(light.as_chunks::<3>().0).zip(solid) {
        for (k, y) in harmonics(*d).into_iter().enumerate() {
            let w = y * s * std::f64::consts::PI * LOBE[degree(k)];
            for c in 0..3 {
                out[k][c] += w * f64::from(rgb[c]);
            }
        }
    }
    Ok(out)
}

/// A lamp far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lamp {
    /// Unit vector to it.
    pub to: [f64; 3],
    /// Of a plane that faces it.
    pub irradiance: [f64; 3],
}

/// What lights a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// Sun and Moon.
    pub lamps: Vec<Lamp>,
    /// Of the sky ([`project`]).
    pub sky: [[f64; 3]; HARMONICS],
    /// Radiance of the ground.
    pub ground: [f64; 3],
}

impl Environment {
    /// Irradiance of planes with these unit normals (`x, y, z` in turn); `visible` has the fraction of each lamp's light
    /// that reaches each of them, lamp after lamp.
    pub fn irradiance(&self, job: &Job, normals: &[f32], visible: &[f32], out: &mut [f32]) -> Result<()> {
        let n = normals.len() / 3;
        check("out", out.len(), 3 * n)?;
        check("visible", visible.len(), self.lamps.len() * n)?;
        job.chunks(out, 3 * CHUNK, |chunk, out| {
            for (k, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                let normal = [0, 1, 2].map(|c: usize| f64::from(normals[3 * i + c]));
                let below = std::f64::consts::PI * 0.5 * (1.0 - normal[2]);
                let mut sum = [0.0; 3];
                for (coefficient, y) in self.sky.iter().zip(harmonics(normal)) {
                    for c in 0..3 {
                        sum[c] += coefficient[c] * y;
                    }
                }
                for c in 0..3 {
                    sum[c] = sum[c].max(0.0) + below * self.ground[c];
                }
                for (l, lamp) in self.lamps.iter().enumerate() {
                    let facing = (0..3).map(|c| lamp.to[c] * normal[c]).sum::<f64>().max(0.0);
                    let share = facing * f64::from(visible[l * n + i]);
                    for c in 0..3 {
                        sum[c] += share * lamp.irradiance[c];
                    }
                }
                *out = sum.map(|x| x.max(0.0) as f32);
            }
            Ok(())
        })
    }
}

/// Make radiance of palette colours, and of what noise adds to them, under an irradiance: `middle` is the palette's
/// luminance, `own` how much of its shading is left to the light \[1\].
pub fn radiance(
    job: &Job,
    colors: &mut [f32],
    variation: &mut [f32],
    irradiance: &[f32],
    middle: f64,
    own: f64,
) -> Result<()> {
    check("irradiance", irradiance.len(), colors.len())?;
    if !variation.is_empty() {
        check("variation", variation.len(), colors.len())?;
    }
    let factor = |color: &[f32]| {
        let y = luminance_of([0, 1, 2].map(|c: usize| f64::from(color[c])));
        let lift = if y > 1e-6 { (middle / y).powf(own) } else { 1.0 };
        lift / std::f64::consts::PI
    };
    let factors: Vec<f32> = colors.as_chunks::<3>().0.iter().map(|c| factor(c) as f32).collect();
    for part in [colors, variation] {
        job.chunks(part, 3 * CHUNK, |chunk, part| {
            for (k, rgb) in part.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                for c in 0..3 {
                    rgb[c] *= factors[i] * irradiance[3 * i + c];
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NORMALS: [[f32; 3]; 6] =
        [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, 0.0, 0.8], [0.0, -0.8, -0.6], [0.48, 0.64, 0.6]];

    fn sky_of(axis: DVec3, light: impl Fn(DVec3) -> f64) -> [[f64; 3]; HARMONICS] {
        let (to, solid) = dome(axis);
        let rgb: Vec<f32> =
            to.as_chunks::<3>().0.iter().flat_map(|d| [light(DVec3::from_array(*d)) as f32; 3]).collect();
        project(&to, &solid, &rgb).expect("as many")
    }

    #[test]
    fn a_white_furnace_is_white() {
        for axis in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::Y] {
            let world = Environment { lamps: Vec::new(), sky: sky_of(axis, |_| 1.0), ground: [1.0; 3] };
            let mut out = vec![0.0; 18];
            world.irradiance(&Job::serial(), NORMALS.as_flattened(), &[], &mut out).expect("as many");
            for (n, e) in NORMALS.iter().zip(out.as_chunks::<3>().0) {
                assert!((f64::from(e[0]) / std::f64::consts::PI - 1.0).abs() < 7e-3, "{n:?}: {}", e[0]);
            }
            // White paper: radiance 1, whatever is left to the light.
            let mut paper = vec![1.0; 18];
            radiance(&Job::serial(), &mut paper, &mut [], &out, 1.0, 0.6).expect("as many");
            assert!(paper.iter().all(|x| (x - 1.0).abs() < 7e-3), "{paper:?}");
        }
    }

    #[test]
    fn a_gradient_is_its_closed_form() {
        // L = 1 + 2 z over the upper half: on a level plane pi + 4 pi / 3.
        let world = Environment { lamps: Vec::new(), sky: sky_of(DVec3::Z, |d| 1.0 + 2.0 * d.z), ground: [0.0; 3] };
        let mut out = [0.0; 3];
        world.irradiance(&Job::serial(), &[0.0, 0.0, 1.0], &[], &mut out).expect("as many");
        let want = std::f64::consts::PI * (1.0 + 4.0 / 3.0);
        assert!((f64::from(out[0]) / want - 1.0).abs() < 7e-3, "{} for {want}", out[0]);
    }

    #[test]
    fn lamps_add_what_reaches_a_plane() {
        let lamp = Lamp { to: [0.0, 0.6, 0.8], irradiance: [3.0, 2.0, 1.0] };
        let world = Environment { lamps: vec![lamp, lamp], sky: [[0.0; 3]; HARMONICS], ground: [0.0; 3] };
        let mut out = [0.0; 6];
        let normals = [0.0, 0.0, 1.0, 0.0, -1.0, 0.0];
        world.irradiance(&Job::serial(), &normals, &[0.5, 1.0, 0.25, 1.0], &mut out).expect("as many");
        for (got, want) in out.iter().zip([1.8, 1.2, 0.6, 0.0, 0.0, 0.0]) {
            assert!((got - want).abs() < 1e-6, "{out:?}");
        }
    }

    #[test]
    fn dark_colours_of_a_palette_are_lifted_by_what_is_left_to_the_light() {
        let mut colors = [0.2, 0.2, 0.2, 0.05, 0.05, 0.05];
        let mut vary = [0.02; 6];
        let pi = std::f32::consts::PI;
        radiance(&Job::serial(), &mut colors, &mut vary, &[pi; 6], 0.2, 0.5).expect("as many");
        assert!((colors[0] - 0.2).abs() < 1e-6 && (colors[3] - 0.1).abs() < 1e-6, "{colors:?}");
        assert!((vary[3] - 0.04).abs() < 1e-6, "{vary:?}");
    }
}
