//! Snow that lies: the share of the sky that a height field sees, and how much lies by slope (floor 3).
//!
//! Sky view of a level place is the mean of the squared cosine of its horizon's elevation over all azimuths (Dozier and Frew
//! 1990). At the bottom of a valley of two planes that rise by an angle `a` it is `cos a`
//! (`the_bottom_of_a_wedge_sees_its_cosine`). Units: metres; heights in rows from south to north, columns from west to east.

use std::f64::consts::TAU;

use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::interpolation::smoothstep;

/// Azimuths in which the horizon is looked for.
const AZIMUTHS: usize = 64;

/// Sky view of every cell of a height field with a spacing \[m\].
pub fn sky_view(job: &Job, heights: &[f64], width: usize, spacing: f64) -> Result<Vec<f64>> {
    if width == 0 || !heights.len().is_multiple_of(width) {
        return Err(Error::Shape {
            name: "heights",
            expected: format!("(.., {width})"),
            got: format!("({},)", heights.len()),
        });
    }
    let rows = heights.len() / width;
    let mut out = vec![0.0; heights.len()];
    job.chunks(&mut out, width, |y, row| {
        for (x, share) in row.iter_mut().enumerate() {
            let here = heights[y * width + x];
            let sum: f64 = (0..AZIMUTHS)
                .map(|k| {
                    let turn = TAU * (k as f64 + 0.5) / AZIMUTHS as f64;
                    let (dx, dy) = (turn.sin(), turn.cos());
                    let (mut tangent, mut step) = (0.0_f64, 1.0);
                    loop {
                        let (px, py) = (x as f64 + dx * step, y as f64 + dy * step);
                        if px < 0.0 || py < 0.0 || px > (width - 1) as f64 || py > (rows - 1) as f64 {
                            break;
                        }
                        let (i, j) =
                            ((px as usize).min(width.saturating_sub(2)), (py as usize).min(rows.saturating_sub(2)));
                        let (s, t) = (px - i as f64, py - j as f64);
                        let at = |i: usize, j: usize| heights[j.min(rows - 1) * width + i.min(width - 1)];
                        let low = at(i, j) + (at(i + 1, j) - at(i, j)) * s;
                        let high = at(i, j + 1) + (at(i + 1, j + 1) - at(i, j + 1)) * s;
                        tangent = tangent.max((low + (high - low) * t - here) / (step * spacing));
                        step += 1.0_f64.max(0.05 * step);
                    }
                    1.0 / (1.0 + tangent * tangent)
                })
                .sum();
            *share = sum / AZIMUTHS as f64;
        }
        Ok(())
    })?;
    Ok(out)
}

/// Share of a surface that is covered, for the vertical part of its normal and its sky view, and snow's amount in \[0, 1\].
///
/// Dry snow slides off above 60 degrees and all of it lies below 30; the amount moves how much sky is needed.
pub fn cover(up: f64, sky_view: f64, amount: f64) -> f64 {
    let ramp = |x: f64| smoothstep(0.0, 1.0, x);
    // cos 60 and cos 30 degrees.
    ramp((up - 0.5) / 0.366_025_403_784) * ramp(2.0 * amount * sky_view)
}

/// Lay snow on colours in place: `snow` is the radiance of snow at each, three channels as the colours.
pub fn lay(
    up: &[f64],
    sky_view: &[f32],
    amount: f64,
    snow: &[f32],
    colors: &mut [f32],
    variation: &mut [f32],
) -> Result<()> {
    if up.len() != sky_view.len() || 3 * up.len() != colors.len() || snow.len() != colors.len() {
        let expected = format!("({},)", 3 * up.len());
        return Err(Error::Shape { name: "snow", expected, got: format!("({},)", colors.len()) });
    }
    for (k, (up, view)) in up.iter().zip(sky_view).enumerate() {
        let share = cover(*up, f64::from(*view), amount) as f32;
        for c in 3 * k..3 * k + 3 {
            colors[c] += share * (snow[c] - colors[c]);
            if let Some(v) = variation.get_mut(c) {
                *v *= 1.0 - 0.5 * share;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bottom_of_a_wedge_sees_its_cosine() {
        let n = 121_usize;
        for degrees in [10.0_f64, 30.0, 50.0] {
            let slope = degrees.to_radians().tan();
            let across: Vec<f64> = (0..n).map(|k| slope * (k as f64 - 60.0).abs()).collect();
            // The same all along the valley.
            let valley = across.repeat(61);
            let view = sky_view(&Job::serial(), &valley, n, 1.0).map(|v| v[30 * n + 60]).expect("rows");
            assert!((view - degrees.to_radians().cos()).abs() < 0.01, "{degrees}: {view}");
        }
        assert_eq!(cover(0.0, 1.0, 1.0), 0.0, "a wall");
        assert_eq!(cover(1.0, 0.0, 1.0), 0.0, "under a roof");
        assert_eq!(cover(1.0, 1.0, 1.0), 1.0, "a meadow");
    }
}
