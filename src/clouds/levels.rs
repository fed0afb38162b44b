//! Fields on uneven or terrain-following levels (WRF, CM1, SHDOM) resampled to even ones, conserving each column.
//!
//! A value is the mean of its layer. A new layer takes from each old one what it overlaps, divided by its own thickness
//! (first-order conservative remapping), so the sum of value times thickness of a column stays to rounding where the new
//! levels span the old ones: liquid water path of water, optical depth of extinction. Heights in metres. Test:
//! `a_column_keeps_its_sum`, and columns of three models in `tests/oracles/test_les_fields.py`.

use crate::error::{Error, Result};
use crate::job::Job;

/// New layers: the lowest height \[m\], thickness \[m\] and number.
#[derive(Debug, Clone, Copy)]
pub struct Levels {
    /// Lower face of the lowest layer \[m\].
    pub low: f64,
    /// Thickness of each \[m\].
    pub step: f64,
    /// How many.
    pub count: usize,
}

/// A field (nz, ny, nx) between `faces` \[m\], (nz + 1) for all columns or (nz + 1, ny, nx), on even levels.
pub fn even_levels(field: &[f64], shape: [usize; 3], faces: &[f64], to: Levels, job: &Job) -> Result<Vec<f32>> {
    let [nz, ny, nx] = shape;
    let columns = ny * nx;
    let each = faces.len() == (nz + 1) * columns && columns != 1;
    if field.len() != nz * columns || !(each || faces.len() == nz + 1) {
        let got = format!("{} values and {} faces", field.len(), faces.len());
        return Err(Error::Shape { name: "field", expected: format!("({nz}, {ny}, {nx})"), got });
    }
    let face = |k: usize, c: usize| if each { faces[k * columns + c] } else { faces[k] };
    let sound = (0..if each { columns } else { 1 }).all(|c| (0..nz).all(|k| face(k, c) < face(k + 1, c)));
    if !(sound && to.step > 0.0 && to.step.is_finite() && to.low.is_finite()) {
        return Err(Error::Data { name: "levels", reason: "heights do not rise from level to level".into() });
    }
    let mut out = vec![0.0; to.count * columns];
    job.chunks(&mut out, columns.max(1), |layer, row| {
        let low = to.low + layer as f64 * to.step;
        for (c, value) in row.iter_mut().enumerate() {
            // The last layer whose lower face is not above: faces rise.
            let (mut first, mut beyond) = (0, nz);
            while first < beyond {
                let middle = usize::midpoint(first, beyond);
                if face(middle + 1, c) <= low { first = middle + 1 } else { beyond = middle }
            }
            let mut sum = 0.0;
            for k in first..nz {
                let overlap = face(k + 1, c).min(low + to.step) - face(k, c).max(low);
                if overlap <= 0.0 {
                    break;
                }
                sum += overlap * field[k * columns + c];
            }
            *value = (sum / to.step) as f32;
        }
        Ok(())
    })?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_keeps_its_sum() {
        let faces = [0.0, 10.0, 35.0, 40.0, 100.0, 5.0, 9.0, 30.0, 77.0, 90.0];
        // Two columns, faces (5, 1, 2): transpose.
        let faces: Vec<f64> = (0..5).flat_map(|k| [faces[k], faces[5 + k]]).collect();
        let field = [1.0, 2.0, 0.0, 5.0, 3.0, 0.5, 7.0, 1.0];
        for step in [1.0, 7.0, 33.0, 150.0] {
            let to = Levels { low: -3.0, step, count: (104.0_f64 / step).ceil() as usize };
            let out = even_levels(&field, [4, 1, 2], &faces, to, &Job::serial()).expect("levels rise");
            for c in 0..2 {
                let before: f64 = (0..4).map(|k| field[2 * k + c] * (faces[2 * k + 2 + c] - faces[2 * k + c])).sum();
                let after: f64 = out.iter().skip(c).step_by(2).map(|&v| f64::from(v) * step).sum();
                assert!((after / before - 1.0).abs() < 1e-6, "step {step}, column {c}: {before} became {after}");
            }
        }
    }

    #[test]
    fn levels_that_fall_are_refused() {
        let to = Levels { low: 0.0, step: 1.0, count: 2 };
        assert!(even_levels(&[1.0, 1.0], [2, 1, 1], &[0.0, 2.0, 1.0], to, &Job::serial()).is_err(), "falling");
    }
}
