//! Procedural clouds of four kinds as density volumes, pure functions of (key, shape), whatever the number of threads.
//!
//! Cumulus and cumulonimbus are heaps of spheres (cumulus.rs), stratocumulus and cirrus are shaped by noise
//! (stratocumulus.rs, cirrus.rs). A kind fills whatever box it is given: its features are set
//! by the box's edges, and only the margins are counted in voxels.

mod cirrus;
mod cumulus;
mod shape;
mod stratocumulus;

use self::cirrus::Cirrus;
use self::cumulus::Cumulus;
use self::shape::CloudShape;
use self::stratocumulus::Stratocumulus;
use super::density::MAX_VOXELS;
use crate::error::{Error, Result, in_range};
use crate::job::Job;

/// Kinds of procedural cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A fair-weather heap with a flat base.
    Cumulus,
    /// A tower with an anvil.
    Cumulonimbus,
    /// A layer of cells and rolls, from side to side of its box.
    Stratocumulus,
    /// Thin streaks of falling ice.
    Cirrus,
}

/// Rows of a chunk of work.
const ROWS: usize = 4;

impl Kind {
    /// The kind of this name.
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "cumulus" => Ok(Self::Cumulus),
            "cumulonimbus" => Ok(Self::Cumulonimbus),
            "stratocumulus" => Ok(Self::Stratocumulus),
            "cirrus" => Ok(Self::Cirrus),
            other => Err(Error::Data { name: "kind", reason: format!("is unknown: {other:?}") }),
        }
    }

    /// Largest density. With the extinction that suits a cumulus, cirrus is as thin as ice at its height is.
    fn peak(self) -> f32 {
        if self == Self::Cirrus { 0.1 } else { 1.0 }
    }
}

/// Density of a procedural cloud, `(nz, ny, nx)`; the largest is 1, of a cirrus 0.1.
pub fn density(kind: Kind, size: [usize; 3], key: u64, job: &Job) -> Result<Vec<f32>> {
    let [nx, ny, nz] = size;
    for (name, n) in [("shape[2]", nx), ("shape[1]", ny), ("shape[0]", nz)] {
        in_range(name, n as f64, 8.0, 4096.0, "1")?;
    }
    if nx * ny * nz > MAX_VOXELS {
        return Err(Error::Data { name: "shape", reason: format!("{nz} x {ny} x {nx} voxels are too many") });
    }
    let cloud: Box<dyn CloudShape> = match kind {
        Kind::Cumulus => Box::new(Cumulus::fair_weather(size, key)),
        Kind::Cumulonimbus => Box::new(Cumulus::cumulonimbus(size, key)),
        Kind::Stratocumulus => Box::new(Stratocumulus::new(size, key)),
        Kind::Cirrus => Box::new(Cirrus::new(size, key)),
    };
    let mut out = vec![0.0_f32; nx * ny * nz];
    // A chunk is a few rows of voxels: short enough to be stopped at once in the largest volumes.
    job.expect((ny * nz) as u64);
    job.chunks(&mut out, ROWS * nx, |chunk, rows| {
        for (r, row) in rows.chunks_exact_mut(nx).enumerate() {
            let (k, j) = ((chunk * ROWS + r) / ny, (chunk * ROWS + r) % ny);
            cloud.fill_row(j, k, row);
        }
        job.advance((rows.len() / nx) as u64)
    })?;
    let peak = out.iter().copied().fold(0.0_f32, f32::max);
    if peak > 0.0 {
        job.chunks(&mut out, 1 << 20, |_, part| {
            for x in part {
                *x = *x / peak * kind.peak();
            }
            Ok(())
        })?;
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cumulus_fills_its_box_without_touching_it() {
        let size = [40, 44, 28];
        let a = density(Kind::Cumulus, size, 3, &Job::serial()).expect("grows");
        let b = density(Kind::Cumulus, size, 4, &Job::serial()).expect("grows");
        assert_ne!(a, b, "another key, another cloud");
        assert!(a.iter().all(|&x| (0.0..=1.0).contains(&x)), "density in [0, 1]");
        let filled = a.iter().filter(|&&x| x > 0.0).count() as f64 / a.len() as f64;
        assert!((0.08..0.5).contains(&filled), "fills {filled} of the box");
        for (at, &x) in a.iter().enumerate() {
            let (i, j, k) = (at % 40, at / 40 % 44, at / 1760);
            let face = i == 0 || j == 0 || k == 0 || i == 39 || j == 43 || k == 27;
            assert!(!face || x == 0.0, "clear at the faces, {x} at {i} {j} {k}");
        }
    }
}
