//! Triangulated surfaces: normals, sampling by area, and barycentric places that a deformed surface carries along
//! (corot paper, IV.7).

use glam::DVec3;

use crate::error::{Error, Result};
use crate::job::Job;

/// Places of a chunk of work.
const CHUNK: usize = 8192;

/// A triangulated surface.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Corners \[m\].
    pub vertices: &'a [[f64; 3]],
    /// Indices, counter-clockwise seen from outside.
    pub faces: &'a [[u32; 3]],
}

/// A place on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Triangle.
    pub face: u32,
    /// Weights of its corners, of sum 1.
    pub barycentric: [f64; 3],
}

impl Surface<'_> {
    /// Refuse indices that point nowhere and vertices that are not finite.
    pub fn validate(&self) -> Result<()> {
        if self.vertices.iter().flatten().any(|x| !x.is_finite()) {
            return Err(Error::Data { name: "vertices", reason: "must be finite".into() });
        }
        let n = self.vertices.len();
        match self.faces.iter().flatten().find(|&&i| i as usize >= n) {
            Some(i) => Err(Error::Data { name: "faces", reason: format!("vertex {i} is not among {n}") }),
            None => Ok(()),
        }
    }

    fn corners(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|i| DVec3::from(self.vertices[i as usize]))
    }

    /// Twice the area of a triangle, along its normal.
    fn area(&self, face: usize) -> DVec3 {
        let [a, b, c] = self.corners(face);
        (b - a).cross(c - a)
    }

    /// Areas of the triangles added up, from 0: one more element than faces.
    pub fn sums(&self) -> Vec<f64> {
        let mut sums = vec![0.0];
        let mut sum = 0.0;
        for face in 0..self.faces.len() {
            sum += 0.5 * self.area(face).length();
            sums.push(sum);
        }
        sums
    }

    /// Unit normals of the vertices, weighted by area; a vertex of no area gets the zenith.
    pub fn normals(&self) -> Vec<[f64; 3]> {
        let mut sums = vec![DVec3::ZERO; self.vertices.len()];
        for (face, corners) in self.faces.iter().enumerate() {
            let area = self.area(face);
            for &i in corners {
                sums[i as usize] += area;
            }
        }
        sums.into_iter().map(|n| n.try_normalize().unwrap_or(DVec3::Z).to_array()).collect()
    }

    /// Points and unit normals at places; normals are interpolated between those of the vertices.
    pub fn carry(&self, normals: &[[f64; 3]], places: &[SurfacePoint], job: &Job) -> Result<Vec<(DVec3, DVec3)>> {
        let faces = self.faces.len();
        if let Some(place) = places.iter().find(|p| p.face as usize >= faces) {
            return Err(Error::Data { name: "face", reason: format!("{} is not among {faces}", place.face) });
        }
        let mut out = vec![(DVec3::ZERO, DVec3::ZERO); places.len()];
        job.chunks(&mut out, CHUNK, |chunk, out| {
            for (place, out) in places[CHUNK * chunk..].iter().zip(out) {
                let face = place.face as usize;
                let [u, v, w] = place.barycentric;
                let mix = |p: [DVec3; 3]| p[0] * u + p[1] * v + p[2] * w;
                let corners = self.corners(face);
                let normal = mix(self.faces[face].map(|i| DVec3::from(normals[i as usize])));
                // Normals of opposite corners can cancel: then the triangle's own.
                let own = || self.area(face).try_normalize().unwrap_or(DVec3::Z);
                *out = (mix(corners), if normal.length() > 1e-9 { normal.normalize() } else { own() });
            }
            Ok(())
        })?;
        Ok(out)
    }
}

/// Points moved by `(2 height - 1) displacement` along their normals.
pub fn lift(at: &[(DVec3, DVec3)], height: &[f64], displacement: f64) -> Vec<DVec3> {
    at.iter().zip(height).map(|(&(p, n), h)| p + n * ((2.0 * h - 1.0) * displacement)).collect()
}
