//! Projection of directions to pixels (the inverse of the view rays), and the solid angle of a pixel (floor 3).
//!
//! What a picture of directions cannot tell: a star or a disc has to find its pixels. Eq 22 of the paper realistic_sky
//! read both ways.

use glam::DVec3;

use super::model::ViewRays;
use crate::math::fisheye::Fisheye;
use crate::math::geometry::Pinhole;

/// A picture that directions fall on.
#[derive(Debug, Clone, Copy)]
pub enum Screen<'a> {
    /// A camera's.
    Camera(&'a Pinhole),
    /// A fisheye's.
    Fisheye(&'a Fisheye),
    /// Equirectangular.
    Panorama {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl<'a> ViewRays<'a> {
    /// The screen of a picture; none of a list.
    pub fn screen(&self) -> Option<Screen<'a>> {
        match *self {
            Self::Camera(camera) => Some(Screen::Camera(camera)),
            Self::Fisheye(camera) => Some(Screen::Fisheye(camera)),
            Self::Panorama { width, height } => Some(Screen::Panorama { width, height }),
            Self::List(_) => None,
        }
    }
}

impl Screen<'_> {
    fn size(&self) -> [usize; 2] {
        match self {
            Self::Camera(camera) => [camera.width, camera.height],
            Self::Fisheye(camera) => [camera.width, camera.height],
            Self::Panorama { width, height } => [*width, *height],
        }
    }

    /// Direction of a place, pixel edges at integers; a fisheye's rim outside its circle.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        match self {
            Self::Camera(camera) => camera.through(x, y),
            Self::Fisheye(camera) => {
                let (u, v) = (x - 0.5 * camera.width as f64, y - 0.5 * camera.height as f64);
                let inwards = (camera.radius() * (1.0 - 1e-9) / u.hypot(v)).min(1.0);
                let (x, y) = (0.5 * camera.width as f64 + u * inwards, 0.5 * camera.height as f64 + v * inwards);
                camera.through(x, y).unwrap_or(camera.forward)
            }
            Self::Panorama { width, height } => {
                let (sin, cos) = (y / *height as f64 * std::f64::consts::PI).sin_cos();
                let (east, north) = (x / *width as f64 * std::f64::consts::TAU).sin_cos();
                DVec3::new(east * sin, north * sin, cos)
            }
        }
    }

    /// Where a direction meets the screen or a strip of two pixels around it.
    pub fn project(&self, to: DVec3) -> Option<[f64; 2]> {
        let [x, y] = self.place(to)?;
        let [width, height] = self.size().map(|n| n as f64);
        (x > -2.0 && x < width + 2.0 && y > -2.0 && y < height + 2.0).then_some([x, y])
    }

    /// Where a direction meets the plane of the screen.
    fn place(&self, to: DVec3) -> Option<[f64; 2]> {
        match self {
            Self::Camera(camera) => camera.project(to),
            Self::Fisheye(camera) => Some(camera.project(to)),
            Self::Panorama { width, height } => {
                let turn = to.x.atan2(to.y).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
                let down = to.x.hypot(to.y).atan2(to.z) / std::f64::consts::PI;
                Some([turn * *width as f64, down * *height as f64])
            }
        }
    }

    /// Solid angle of the pixel around a place \[sr\].
    pub fn solid_angle(&self, x: f64, y: f64) -> f64 {
        if let Self::Panorama { width, height } = self {
            // Of the row it lies in: towards a pole rows shrink within one.
            let row = y.floor().clamp(0.0, *height as f64 - 1.0);
            let step = std::f64::consts::PI / *height as f64;
            let band = 2.0 * (0.5 * step).sin() * ((row + 0.5) * step).sin();
            return band * std::f64::consts::TAU / *width as f64;
        }
        let across = self.direction(x + 0.5, y) - self.direction(x - 0.5, y);
        let down = self.direction(x, y + 0.5) - self.direction(x, y - 0.5);
        across.cross(down).length().max(1e-30)
    }

    /// The longer side of the pixel around a place \[rad\]; on a panorama a row's height.
    pub fn extent(&self, x: f64, y: f64) -> f64 {
        if let Self::Panorama { height, .. } = self {
            return std::f64::consts::PI / *height as f64;
        }
        let across = self.direction(x + 0.5, y).distance(self.direction(x - 0.5, y));
        across.max(self.direction(x, y + 0.5).distance(self.direction(x, y - 0.5)))
    }

    /// How much solid angle lies at a height within a pixel, against its other heights: a row of a panorama at a pole
    /// is a wedge. Pixels of lenses are even enough.
    pub fn weight(&self, y: f64) -> f64 {
        match self {
            Self::Panorama { height, .. } => (y / *height as f64 * std::f64::consts::PI).sin(),
            _ => 1.0,
        }
    }

    /// Index of a pixel; a panorama goes round.
    pub fn index(&self, x: i64, y: i64) -> Option<usize> {
        let [width, height] = self.size().map(|n| n as i64);
        let x = if matches!(self, Self::Panorama { .. }) { x.rem_euclid(width) } else { x };
        let lens = match self {
            Self::Fisheye(camera) => camera.inside(x as f64 + 0.5, y as f64 + 0.5),
            _ => true,
        };
        (lens && x >= 0 && x < width && y >= 0 && y < height).then_some((y * width + x) as usize)
    }

    /// Columns and rows, first and last excluded, of pixels that a disc may meet.
    pub fn around(&self, to: DVec3, radius: f64) -> Option<[i64; 4]> {
        let [width, height] = self.size().map(|n| n as f64);
        if let Self::Panorama { .. } = self {
            let polar = to.x.hypot(to.y).atan2(to.z);
            let rows = |angle: f64| angle / std::f64::consts::PI * height;
            let (top, bottom) = (rows(polar - radius).max(0.0).floor(), rows(polar + radius).min(height).ceil());
            let half_width_ratio = radius.sin() / polar.sin();
            let pole = polar <= radius || polar + radius >= std::f64::consts::PI || half_width_ratio >= 1.0;
            let half = if pole { 0.5 * width } else { half_width_ratio.asin() / std::f64::consts::TAU * width + 1.0 };
            let x = self.place(to)?[0];
            let (left, right) =
                if half >= 0.5 * width { (0.0, width) } else { ((x - half).floor(), (x + half).ceil()) };
            return Some([left as i64, right as i64, top as i64, bottom as i64]);
        }
        let aside = to.any_orthonormal_vector();
        let other = aside.cross(to);
        let (sin, cos) = radius.sin_cos();
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        let mut lost = 0;
        let round = 48;
        for k in 0..round {
            let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(round)).sin_cos();
            let Some([x, y]) = self.place(to * cos + (aside * c + other * s) * sin) else {
                lost += 1;
                continue;
            };
            ends = [ends[0].min(x), ends[1].max(x), ends[2].min(y), ends[3].max(y)];
        }
        if lost == round {
            return None;
        }
        if lost > 0 {
            ends = [0.0, width, 0.0, height];
        }
        let [left, right, top, bottom] = ends;
        // Points of a circle are a polygon: its edge bulges by a little.
        let slack = 1.0 + 0.01 * (right - left).max(bottom - top);
        let first = |x: f64| (x - slack).floor().max(0.0) as i64;
        let last = |x: f64, size: f64| (x + slack).ceil().min(size) as i64;
        let found = [first(left), last(right, width), first(top), last(bottom, height)];
        (found[0] < found[1] && found[2] < found[3]).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geometry::direction;

    #[test]
    fn directions_and_places_are_inverse() {
        let camera = Pinhole::new(DVec3::ZERO, [0.7, 0.4, 0.2, 1.0], [64, 48]).expect("valid");
        let eye = Fisheye {
            right: DVec3::X,
            up: DVec3::Y,
            forward: DVec3::NEG_Z,
            half: 1.4,
            equal_area: true,
            width: 64,
            height: 64,
        };
        for (x, y) in [(10.0, 20.0), (40.5, 33.0)] {
            let lens = Screen::Fisheye(&eye);
            let [a, b] = lens.project(lens.direction(x, y)).expect("inside");
            assert!((a - x).abs() < 1e-9 && (b - y).abs() < 1e-9, "{a} {b}");
            let cap = std::f64::consts::TAU * (1.0 - 1.4_f64.cos());
            let pixels = std::f64::consts::PI * 32.0 * 32.0;
            assert!((lens.solid_angle(x, y) / (cap / pixels) - 1.0).abs() < 1e-3, "equal areas");
        }
        for screen in [Screen::Camera(&camera), Screen::Panorama { width: 64, height: 32 }] {
            let mut whole = 0.0;
            for (x, y) in [(0.3, 0.4), (20.0, 17.5), (63.9, 31.2)] {
                let [a, b] = screen.project(screen.direction(x, y)).expect("on the screen");
                assert!((a - x).abs() < 1e-9 && (b - y).abs() < 1e-9, "{a} {b}");
            }
            for y in 0..screen.size()[1] {
                for x in 0..screen.size()[0] {
                    whole += screen.solid_angle(x as f64 + 0.5, y as f64 + 0.5);
                }
            }
            let want = match screen {
                // A pyramid: 4 asin(sin(a / 2) sin(b / 2)) of its half angles.
                Screen::Camera(c) => {
                    let (b, a) = (c.half_tan.atan(), (c.half_tan * 64.0 / 48.0).atan());
                    4.0 * (a.sin() * b.sin()).asin()
                }
                _ => 4.0 * std::f64::consts::PI,
            };
            assert!((whole / want - 1.0).abs() < 1e-4, "{whole} of {want}");
        }
        assert!(Screen::Camera(&camera).project(direction(0.7 + 3.0, 0.0)).is_none(), "behind");
    }
}
