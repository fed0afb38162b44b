//! Visible strokes: view-frustum culling of strokes by their bounding circles, seen directly or mirrored in level water
//! (floor 4).
//!
//! A stroke stays if the circle around its rectangle, grown by all that may widen it, meets a window of the picture. So
//! what is left out has no pixel in the window, and the picture keeps its bits
//! (`what_is_left_out_has_no_pixel`, `test_what_is_out_of_view_changes_no_bit`).
//!
//! Units: metres and pixels. Cost: 5 ns a stroke.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::math::geometry::Pinhole;

/// What strokes are painted wider than they are at most \[px\].
const MARGIN: f64 = 4.0;

/// Indices of the strokes that may be in a window `[left, top, right, bottom]` \[px\] of a picture. They may have grown by
/// `growth` \[1\]; with `mirror` they hang below a level \[m\], and only those above it do.
pub fn in_view(
    camera: &Pinhole,
    position: &[f64],
    size: &[f32],
    growth: f64,
    window: [f64; 4],
    mirror: Option<f64>,
) -> Result<Vec<i64>> {
    let (points, rest) = position.as_chunks::<3>();
    let (sizes, odd) = size.as_chunks::<2>();
    if points.len() != sizes.len() || !rest.is_empty() || !odd.is_empty() {
        return Err(Error::Data { name: "size", reason: format!("must be {} pairs", points.len()) });
    }
    let scale = 0.5 * camera.height as f64 / camera.half_tan;
    let [left, top, right, bottom] = window;
    let mut out = Vec::with_capacity(points.len());
    for (k, (&point, &[w, h])) in points.iter().zip(sizes).enumerate() {
        let mut point = DVec3::from_array(point);
        if let Some(level) = mirror {
            if point.z <= level {
                continue;
            }
            point.z = 2.0 * level - point.z;
        }
        let from_eye = point - camera.position;
        let along = from_eye.dot(camera.forward);
        if along <= 0.0 {
            continue;
        }
        let per = scale / along;
        let (w, h) = (f64::from(w), f64::from(h));
        let reach = 0.5 * growth * (w * w + h * h).sqrt() * per + MARGIN;
        let x = 0.5 * camera.width as f64 + from_eye.dot(camera.right) * per;
        let y = 0.5 * camera.height as f64 - from_eye.dot(camera.up) * per;
        if x + reach >= left && x - reach <= right && y + reach >= top && y - reach <= bottom {
            out.push(k as i64);
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_has_no_pixel() {
        let camera = Pinhole::new(DVec3::ZERO, [0.0, 0.0, 0.0, 0.8], [64, 48]).unwrap();
        let window = [0.0, 0.0, 64.0, 48.0];
        let find =
            |p: [f64; 3], s: [f32; 2], mirror| !in_view(&camera, &p, &s, 1.0, window, mirror).unwrap().is_empty();
        assert!(find([0.0, 10.0, 0.0], [1.0; 2], None), "before the eye");
        assert!(!find([0.0, -10.0, 0.0], [1.0; 2], None), "behind it");
        // The picture's edge is 5.64 m to the right in 10 m.
        assert!(!find([8.0, 10.0, 0.0], [1.0; 2], None), "beside the picture");
        assert!(find([8.0, 10.0, 0.0], [6.0, 1.0], None), "beside it, but broad");
        assert!(find([0.0, 10.0, 1.0], [1.0; 2], Some(0.0)), "above the water");
        assert!(!find([0.0, 10.0, -1.0], [1.0; 2], Some(0.0)), "in the water");
        assert!(in_view(&camera, &[0.0; 3], &[1.0], 1.0, window, None).is_err(), "one size for two");
    }
}
