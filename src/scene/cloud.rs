//! Clouds seen through a cached picture: an impostor (billboard with depth) that a camera nearby looks at (floor 4).
//!
//! A cloud is traced once from a place near the eye, in a perspective picture that holds its box, with the distance of each
//! pixel. From the eye itself a direction meets the cloud where the picture, moved by that distance, has it: two steps of a
//! fixed point. What is traced depends on volume and Sun alone, so the next frame costs a look-up.
//!
//! Units: metres, radiance in the sky's unit. Error: that of the tracing, and of bilinear interpolation
//! (`from_its_own_place_it_is_its_picture`). Cost: 60 ns a direction that meets the picture, 10 ns another.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::geometry::Pinhole;

const CHUNK: usize = 4096;

/// A traced picture.
#[derive(Debug, Clone, Copy)]
pub struct Impostor<'a> {
    /// From where.
    pub camera: &'a Pinhole,
    /// Light, three numbers a pixel.
    pub rgb: &'a [f32],
    /// What the cloud lets through.
    pub transmittance: &'a [f32],
    /// To the cloud \[m\]; finite everywhere.
    pub distance: &'a [f32],
}

impl Impostor<'_> {
    fn corners(&self, to: DVec3) -> Option<([usize; 4], [f32; 4])> {
        let [x, y] = self.camera.project(to)?;
        let (w, h) = (self.camera.width, self.camera.height);
        let (x, y) = (x - 0.5, y - 0.5);
        if !(x > -0.5 && y > -0.5 && x < w as f64 - 0.5 && y < h as f64 - 0.5) {
            return None;
        }
        let (x, y) = (x.clamp(0.0, (w - 1) as f64), y.clamp(0.0, (h - 1) as f64));
        let (i, j) = ((x as usize).min(w.saturating_sub(2)), (y as usize).min(h.saturating_sub(2)));
        let (u, v) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let (right, below) = ((i + 1).min(w - 1), (j + 1).min(h - 1));
        let at = [j * w + i, j * w + right, below * w + i, below * w + right];
        Some((at, [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v]))
    }

    /// Light, transmittance and distance along a direction from `eye`; `None` where there is no cloud.
    fn look(&self, eye: DVec3, to: DVec3) -> Option<[f32; 5]> {
        let mix = |plane: &[f32], stride: usize, c: usize, (at, weight): &([usize; 4], [f32; 4])| {
            (0..4).map(|k| plane[at[k] * stride + c] * weight[k]).sum::<f32>()
        };
        let mut found = self.corners(to);
        let away = eye - self.camera.position;
        if away != DVec3::ZERO {
            // Without a pixel in that direction the cloud is taken to be as far as in the middle of the picture.
            let middle = self.camera.height / 2 * self.camera.width + self.camera.width / 2;
            for _ in 0..2 {
                let far = found.as_ref().map_or(self.distance[middle], |f| mix(self.distance, 1, 0, f));
                found = self.corners(away + to * f64::from(far));
            }
        }
        let found = found?;
        let through = mix(self.transmittance, 1, 0, &found);
        let [r, g, b] = [0, 1, 2].map(|c: usize| mix(self.rgb, 3, c, &found));
        Some([r, g, b, through, mix(self.distance, 1, 0, &found)])
    }

    /// Fill in rows of light, transmittance and distance for unit directions (`x, y, z` in turn) from `eye`.
    pub fn seen(&self, job: &Job, eye: DVec3, directions: &[f64], out: &mut [f32]) -> Result<()> {
        let pixels = self.camera.width * self.camera.height;
        for (name, got, want) in [
            ("rgb", self.rgb.len(), 3 * pixels),
            ("transmittance", self.transmittance.len(), pixels),
            ("distance", self.distance.len(), pixels),
            ("out", 3 * out.len(), 5 * directions.len()),
        ] {
            if got != want {
                return Err(Error::Shape { name, expected: format!("({want},)"), got: format!("({got},)") });
            }
        }
        job.chunks(out, 5 * CHUNK, |chunk, out| {
            for (k, row) in out.as_chunks_mut::<5>().0.iter_mut().enumerate() {
                let to = DVec3::from_slice(&directions[3 * (chunk * CHUNK + k)..]);
                *row = self.look(eye, to).unwrap_or([0.0, 0.0, 0.0, 1.0, f32::INFINITY]);
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(position: DVec3) -> Pinhole {
        Pinhole::new(position, [0.0, 0.0, 0.0, 40.0_f64.to_radians()], [40, 30]).expect("in range")
    }

    fn wall(camera: &Pinhole, from: DVec3) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
        // A wall 1000 m north with a pattern, and a hole.
        let (mut rgb, mut through, mut far) = (Vec::new(), Vec::new(), Vec::new());
        for j in 0..camera.height {
            for i in 0..camera.width {
                let d = camera.direction(i, j);
                let s = (1000.0 - from.y) / d.y;
                let at = from + d * s;
                rgb.extend([(at.x * 0.01) as f32, (at.z * 0.01) as f32, 1.0]);
                through.push(if at.x > 100.0 { 0.5 } else { 0.0 });
                far.push(s as f32);
            }
        }
        (rgb, through, far)
    }

    #[test]
    fn from_its_own_place_it_is_its_picture() {
        let own = camera(DVec3::ZERO);
        let (rgb, transmittance, distance) = wall(&own, DVec3::ZERO);
        let map = Impostor { camera: &own, rgb: &rgb, transmittance: &transmittance, distance: &distance };
        let to: Vec<f64> = (0..30 * 40).flat_map(|k| own.direction(k % 40, k / 40).to_array()).collect();
        let mut out = vec![0.0; 5 * 1200];
        map.seen(&Job::serial(), DVec3::ZERO, &to, &mut out).expect("as many");
        for (k, row) in out.as_chunks::<5>().0.iter().enumerate() {
            assert!((row[0] - rgb[3 * k]).abs() < 1e-4 && (row[3] - transmittance[k]).abs() < 1e-4, "{k}: {row:?}");
        }
        map.seen(&Job::serial(), DVec3::ZERO, &[0.0, -1.0, 0.0], &mut out[..5]).expect("as many");
        assert_eq!(out[..5], [0.0, 0.0, 0.0, 1.0, f32::INFINITY], "behind it there is none");
    }

    #[test]
    fn a_step_aside_moves_what_is_near_more() {
        let own = camera(DVec3::ZERO);
        let (rgb, transmittance, distance) = wall(&own, DVec3::ZERO);
        let map = Impostor { camera: &own, rgb: &rgb, transmittance: &transmittance, distance: &distance };
        let eye = DVec3::new(60.0, 30.0, -20.0);
        for at in [DVec3::new(50.0, 1000.0, 40.0), DVec3::new(-120.0, 1000.0, -90.0)] {
            let to = (at - eye).normalize();
            let mut out = [0.0; 5];
            map.seen(&Job::serial(), eye, &to.to_array(), &mut out).expect("as many");
            // Two steps of the fixed point: within 3 m, of a step of 70 m.
            assert!((f64::from(out[0]) - 0.01 * at.x).abs() < 0.03, "{at}: {out:?}");
            assert!((f64::from(out[1]) - 0.01 * at.z).abs() < 0.03, "{at}: {out:?}");
        }
    }
}
