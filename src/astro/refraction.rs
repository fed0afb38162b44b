//! Astronomical refraction: rays traced through the air of the U.S. Standard Atmosphere 1976 from any height, also below
//! the horizontal (floor 1).
//!
//! A ray from the observer bends by `-(dn/dh) cos(e) / n` for each metre, `e` being its slope against the local
//! horizontal, in spherical layers; Runge and Kutta's method to the fourth order with steps of half a kilometre over the slope.
//! Refractivity 2.771e-4 at 15 degrees Celsius and 1013.25 hPa (visual light), with the standard's density; pressure and
//! temperature of the observer scale it. [`Refraction`] keeps the bending over the apparent elevation, from the ray that
//! grazes the ground upwards. What stands lower cannot be seen: from there refraction fades to nothing within four degrees
//! with a continuous slope, so that the apparent elevation always rises with the true one.
//!
//! Error: 4" of the trace (`the_table_is_the_trace`); against the formulas of Saemundsson and Bennett, which are fits to
//! other air, 14" above 10 degrees and 0.6' at the horizon. Cost: 40 us a ray, 5 ms a table, of which the last are kept.

use std::sync::{Arc, Mutex};

use super::standard_atmosphere::density;
use crate::math::geometry::ARCSECOND;

/// Radius of the Earth \[m\].
const RADIUS: f64 = 6.371e6;
/// `n - 1` on the ground.
const REFRACTIVITY: f64 = 2.771e-4;
/// No air to speak of is above \[m\].
const TOP: f64 = 80e3;
/// Nodes of the table.
const NODES: usize = 128;
/// From the lowest ray refraction fades over this true elevation \[rad\].
const FADE: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// Tables that are kept.
const KEPT: usize = 8;

/// What bends light at an observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefractingAir {
    /// Of the observer above sea level \[m\].
    pub altitude: f64,
    /// Refractivity over that of the standard atmosphere.
    pub scale: f64,
}

impl RefractingAir {
    fn index(&self, h: f64) -> f64 {
        1.0 + self.scale * REFRACTIVITY * density(h.max(-1000.0))
    }

    /// The lowest apparent elevation of a ray that does not meet the ground at sea level \[rad\].
    fn lowest(&self) -> f64 {
        let h = self.altitude;
        if h <= 0.0 {
            return 0.0;
        }
        let cos = self.index(0.0) * RADIUS / (self.index(h) * (RADIUS + h));
        -cos.min(1.0).acos()
    }

    /// By how much a ray seen at an apparent elevation is bent in all \[rad\].
    pub fn trace(&self, apparent: f64) -> f64 {
        // Height, slope, bending.
        let slope = |[h, e, _]: [f64; 3]| {
            let (sin, cos) = e.sin_cos();
            let gradient = (self.index(h + 5.0) - self.index(h - 5.0)) / 10.0;
            let bend = -gradient * cos / self.index(h);
            [sin, cos / (RADIUS + h) - bend, bend]
        };
        let mut state = [self.altitude, apparent, 0.0];
        for _ in 0..8000 {
            let step = 500.0 / (state[1].sin().abs() + 0.02);
            let at = |k: [f64; 3], s: f64| std::array::from_fn(|i| state[i] + s * k[i]);
            let a = slope(state);
            let b = slope(at(a, 0.5 * step));
            let c = slope(at(b, 0.5 * step));
            let d = slope(at(c, step));
            for i in 0..3 {
                state[i] += step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
            if state[0] > TOP || state[0] < -2000.0 {
                break;
            }
        }
        state[2]
    }
}

/// Refraction over the apparent elevation, for one observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Refraction {
    lowest: f64,
    /// Bending at the nodes.
    bending: Vec<f64>,
}

static TABLES: Mutex<Vec<(RefractingAir, Arc<Refraction>)>> = Mutex::new(Vec::new());

impl Refraction {
    fn new(air: RefractingAir) -> Self {
        let lowest = air.lowest();
        let bending = (0..NODES).map(|i| air.trace(Self::elevation(lowest, i as f64))).collect();
        Self { lowest, bending }
    }

    /// Elevation of a node.
    fn elevation(lowest: f64, i: f64) -> f64 {
        let t = i / (NODES - 1) as f64;
        lowest + (std::f64::consts::FRAC_PI_2 - lowest) * t * t * (0.5 + 0.5 * t)
    }

    /// For an observer; the last ones are kept.
    pub fn of(air: RefractingAir) -> Arc<Self> {
        let found = TABLES.lock().ok().and_then(|all| all.iter().find(|t| t.0 == air).map(|t| t.1.clone()));
        found.unwrap_or_else(|| {
            let made = Arc::new(Self::new(air));
            if let Ok(mut all) = TABLES.lock() {
                if all.len() >= KEPT {
                    all.remove(0);
                }
                all.push((air, made.clone()));
            }
            made
        })
    }

    /// By how much what is seen at an apparent elevation is lifted \[rad\].
    pub fn of_apparent(&self, apparent: f64) -> f64 {
        if apparent < self.lowest {
            // Where nothing is seen: the inverse of the fading.
            let (mut low, mut high) = (apparent - 0.04, apparent);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if middle + self.of_true(middle) < apparent { low = middle } else { high = middle }
            }
            return apparent - 0.5 * (low + high);
        }
        let span = std::f64::consts::FRAC_PI_2 - self.lowest;
        let want = ((apparent - self.lowest) / span).clamp(0.0, 1.0);
        // Of t^2 (1 + t) / 2, by Newton's method.
        let mut t = want.sqrt();
        for _ in 0..8 {
            let (value, slope) = (t * t * (0.5 + 0.5 * t) - want, t * (1.0 + 1.5 * t));
            t -= if slope > 1e-12 { value / slope } else { 0.0 };
        }
        let x = (t * (NODES - 1) as f64).clamp(0.0, (NODES - 1) as f64);
        let i = (x as usize).clamp(1, NODES - 3) - 1;
        let u = x - i as f64;
        let b = &self.bending[i..i + 4];
        let (p, q) = (u * (u - 1.0), (u - 2.0) * (u - 3.0));
        -b[0] * (u - 1.0) * q / 6.0 + b[1] * u * q / 2.0 - b[2] * p * (u - 3.0) / 2.0 + b[3] * p * (u - 2.0) / 6.0
    }

    /// By how much what stands at a true elevation is lifted \[rad\].
    pub fn of_true(&self, elevation: f64) -> f64 {
        let at_edge = self.bending[0];
        let edge = self.lowest - at_edge;
        if elevation >= edge {
            // True elevations of the nodes rise; between two, Newton's method with their slope.
            let (mut low, mut high) = (0, NODES - 1);
            let node = |i: usize| (Self::elevation(self.lowest, i as f64), self.bending[i]);
            while high - low > 1 {
                let middle = usize::midpoint(low, high);
                let (apparent, lift) = node(middle);
                if apparent - lift <= elevation { low = middle } else { high = middle }
            }
            let ((a, lift_a), (b, lift_b)) = (node(low), node(high));
            let slope = (b - lift_b - a + lift_a) / (b - a);
            let mut apparent = a + (elevation - a + lift_a) / slope;
            for _ in 0..6 {
                apparent -= (apparent - self.of_apparent(apparent.max(self.lowest)) - elevation) / slope;
            }
            return apparent.clamp(self.lowest, std::f64::consts::FRAC_PI_2) - elevation;
        }
        let u = (elevation - edge + FADE) / FADE;
        if u <= 0.0 {
            return 0.0;
        }
        // The cubic with the value and the slope of the edge, and neither at the end.
        let small = 20.0 * ARCSECOND;
        let above = self.of_apparent(self.lowest + small);
        let slope = (above - at_edge) / (small - above + at_edge) * FADE;
        at_edge * u * u * (3.0 - 2.0 * u) + slope * u * u * (u - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn air(altitude: f64) -> RefractingAir {
        RefractingAir { altitude, scale: 1.0 }
    }

    #[test]
    fn seen_from_a_height_a_low_sun_is_where_a_ray_trace_puts_it() {
        // Ray traces of others through the same atmosphere: altitude [m], apparent and true elevation [degrees].
        for (altitude, apparent, truly) in [(3000.0, -1.5_f64, -2.302), (1270.0, -1.0, -1.739)] {
            let lift = air(altitude).trace(apparent.to_radians()).to_degrees();
            assert!((apparent - lift - truly).abs() < 0.02, "{altitude}: {}", apparent - lift);
            let back = Refraction::of(air(altitude)).of_true(f64::to_radians(truly)).to_degrees();
            assert!((truly + back - apparent).abs() < 0.03, "{altitude}: {}", truly + back);
        }
        // At the ground's horizon 33' in this air, which is 5 degrees warmer than the almanac's of 34'.
        let horizon = air(0.0).trace(0.0).to_degrees() * 60.0;
        assert!((32.0..34.0).contains(&horizon), "{horizon}");
        // 58.1" tan z for small zenith distances (n - 1 over one arcsecond).
        let high = air(0.0).trace(45_f64.to_radians()) / ARCSECOND;
        assert!((high - REFRACTIVITY / ARCSECOND).abs() < 0.2, "{high}");
    }

    #[test]
    fn the_table_is_the_trace() {
        for altitude in [0.0, 1500.0, 9000.0] {
            let (air, table) = (air(altitude), Refraction::of(air(altitude)));
            for i in 0..60 {
                let t = (f64::from(i) + 0.5) / 60.0;
                let apparent = air.lowest() + (1.5 - air.lowest()) * t * t;
                let (got, want) = (table.of_apparent(apparent), air.trace(apparent));
                assert!((got - want).abs() < 4.0 * ARCSECOND, "{altitude} {apparent}: {got} against {want}");
                let back = table.of_true(apparent - got);
                assert!((back - got).abs() < 0.1 * ARCSECOND, "{altitude} {apparent}: back {back} for {got}");
            }
        }
    }

    #[test]
    fn the_apparent_elevation_rises_with_the_true_one() {
        for altitude in [0.0, 3000.0, 15_000.0] {
            let table = Refraction::of(air(altitude));
            let mut before = f64::NEG_INFINITY;
            for i in 0..=18_000 {
                let truly = (f64::from(i) * 0.01 - 90.0).to_radians();
                let lift = table.of_true(truly);
                assert!((0.0..0.025).contains(&lift), "{altitude}, {}: {lift}", truly.to_degrees());
                assert!(truly + lift > before, "{altitude}, at {}", truly.to_degrees());
                before = truly + lift;
                let back = table.of_apparent(before);
                assert!((back - lift).abs() < 0.2 * ARCSECOND, "{altitude}, {}: {back} for {lift}", truly.to_degrees());
            }
        }
    }
}
