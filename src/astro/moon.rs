//! The Moon: where it is, its phase and its light (floor 1).
//!
//! Sources: ELP-2000/82 (Chapront-Touzé and Chapront) as truncated by Meeus, Astronomical Algorithms, ch. 47 (120
//! terms; the mean longitude holds the light-time), and 543 sines of what that leaves of JPL's DE421, fitted from 1900 to 2053; phase and limb by vectors, as seen from the place and not from the
//! Earth's centre (they differ by up to 1 degree). The paper realistic_sky names VSOP87 for the Moon, which has none.
//!
//! Light: by default the phase law of Allen and of Krisciunas and Schaefer (PASP 103, 1033, 1991),
//! `-12.73 + 0.026 |a| + 4e-9 a^4`. [`Law::Wang`] is equation 9 of that paper, corrected: printed, it gives the Moon no
//! phase at all (the phase term stands at the earthshine and the logarithm has cos for cot). With the printed albedo C
//! = 0.072 it is 0.43 times the light of the full Moon (magnitude -12.73 by its own equation 10); C = 0.168 is used. At
//! half moon its law, Lommel-Seeliger's, is 4 times brighter than measured. Neither law knows the opposition surge
//! below 7 degrees; the Earth's shadow is that of `pleinair.astro.Moon`.
//!
//! Units: radians, kilometres, W/m², lx, magnitudes. Error: 0.13" rms, 0.4" at most against DE421 from 1900 to 2053
//! (`test_the_moon_is_that_of_de421`), the sines alone being up to 18" from it; 32 km in distance. Cost: 12 µs.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use crate::astro::frames::{AU, FrameOfDate, Seen, Site, polynomial};
use crate::astro::refraction::Refraction;
use crate::astro::tables::lunar::{LATITUDE, LONGITUDE_DISTANCE};
use crate::astro::tables::lunar_fit;
use crate::astro::{light, selenography, sun};
use crate::math::geometry::ARCSECOND;

/// Radius of the Moon \[km\].
pub const RADIUS: f64 = 1737.4;
/// Mean distance for which magnitudes are given \[km\].
pub const MEAN_DISTANCE: f64 = 384_400.0;
/// Irradiance of the Sun at one astronomical unit \[W/m²\].
const SOLAR: f64 = 1361.0;
/// Irradiance of the full Earth at the Moon \[W/m²\].
const FULL_EARTH: f64 = 0.095;
/// Albedo of equation 9 with which its full Moon has magnitude -12.73 by equation 10; 0.072 is printed.
const ALBEDO: f64 = 0.168;

/// How the light of the Moon falls with its phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// Allen; Krisciunas and Schaefer 1991: measured.
    Krisciunas,
    /// Equation 9 of Wang, corrected: a sphere by Lommel and Seeliger.
    Wang,
}

/// The Moon as seen from a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moon {
    /// Where.
    pub seen: Seen,
    /// Angle at the Moon between the Sun and the observer, 0 when full \[rad\].
    pub phase: f64,
    /// Position angle of the middle of the bright limb, from celestial north through east, in `[0, 2 pi)` \[rad\].
    pub limb: f64,
    /// The same from the direction of the zenith, in the same sense (towards the left of who faces the Moon).
    pub limb_from_zenith: f64,
    /// Distance of the Sun from the Moon \[au\].
    pub sun_distance: f64,
    /// Selenographic longitude and latitude of the middle of the disc: optical libration.
    pub libration: [f64; 2],
    /// Position angle of the Moon's north pole, as `limb`.
    pub axis: f64,
    /// The same from the direction of the zenith.
    pub axis_from_zenith: f64,
}

/// Light, square to its direction and outside the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moonlight {
    /// Apparent magnitude.
    pub magnitude: f64,
    /// Of all wavelengths \[W/m²\].
    pub irradiance: f64,
    /// Of the eye's \[lx\].
    pub illuminance: f64,
}

/// Longitude and latitude at the mean ecliptic and equinox of date \[rad\], and distance \[km\].
pub fn mean_of_date(t: f64) -> [f64; 3] {
    let degrees = |c: &[f64]| polynomial(t, c).rem_euclid(360.0).to_radians();
    let mean = degrees(&[218.316_447_7, 481_267.881_234_21, -0.001_578_6, 1.0 / 538_841.0, -1.0 / 65_194_000.0]);
    let d = degrees(&[297.850_192_1, 445_267.111_403_4, -0.001_881_9, 1.0 / 545_868.0, -1.0 / 113_065_000.0]);
    let sun = degrees(&[357.529_109_2, 35_999.050_290_9, -0.000_153_6, 1.0 / 24_490_000.0]);
    let moon = degrees(&[134.963_396_4, 477_198.867_505_5, 0.008_741_4, 1.0 / 69_699.0, -1.0 / 14_712_000.0]);
    let f = degrees(&[93.272_095_0, 483_202.017_523_3, -0.003_653_9, -1.0 / 3_526_000.0, 1.0 / 863_310_000.0]);
    let venus = degrees(&[119.75, 131.849]);
    let jupiter = degrees(&[53.09, 479_264.290]);
    let third = degrees(&[313.45, 481_266.484]);
    let e = 1.0 - t * (0.002_516 + 0.000_007_4 * t);
    let powers = [1.0, e, e * e];
    let term = |k: &[i8; 4]| {
        let [a, b, c, n] = k.map(f64::from);
        (a * d + b * sun + c * moon + n * f, powers[usize::from(k[1].unsigned_abs())])
    };
    let (mut longitude, mut distance) = (0.0, 0.0);
    for (multiples, [along, away]) in &LONGITUDE_DISTANCE {
        let (angle, eccentric) = term(multiples);
        let (sin, cos) = angle.sin_cos();
        longitude += along * eccentric * sin;
        distance += away * eccentric * cos;
    }
    let mut latitude: f64 = 0.0;
    for (multiples, up) in &LATITUDE {
        let (angle, eccentric) = term(multiples);
        latitude += up * eccentric * angle.sin();
    }
    longitude += 3958.0 * venus.sin() + 1962.0 * (mean - f).sin() + 318.0 * jupiter.sin();
    latitude += -2235.0 * mean.sin() + 382.0 * third.sin() + 175.0 * (venus - f).sin() + 175.0 * (venus + f).sin();
    latitude += 127.0 * (mean - moon).sin() - 115.0 * (mean + moon).sin();
    [mean + (1e-6 * longitude).to_radians(), (1e-6 * latitude).to_radians(), 385_000.56 + 1e-3 * distance]
}

/// What the truncated theory leaves of JPL's DE421 in longitude and latitude \[rad\].
fn left_out(t: f64) -> [f64; 2] {
    use lunar_fit::{LATITUDE, LATITUDE_GROWING, LATITUDE_TREND};
    use lunar_fit::{LONGITUDE, LONGITUDE_GROWING, LONGITUDE_TREND};
    let days = 36_525.0 * t;
    // What grows, grows as long as it was fitted.
    let grown = t.clamp(-1.0, 0.535);
    let sum = |terms: &[[f64; 3]]| -> f64 {
        let term = |[rate, sine, cosine]: &[f64; 3]| {
            let (sin, cos) = (rate * days).sin_cos();
            sine * sin + cosine * cos
        };
        terms.iter().map(term).sum()
    };
    let along = polynomial(grown, &LONGITUDE_TREND) + sum(&LONGITUDE) + grown * sum(&LONGITUDE_GROWING);
    let up = polynomial(grown, &LATITUDE_TREND) + sum(&LATITUDE) + grown * sum(&LATITUDE_GROWING);
    [along * ARCSECOND, up * ARCSECOND]
}

/// Apparent vector from the centre of the Earth to the Moon on the true equator and equinox \[km\].
pub fn geocentric(frame: &FrameOfDate) -> DVec3 {
    let t = frame.instant.centuries;
    let [longitude, latitude, distance] = mean_of_date(t);
    let [along, up] = left_out(t);
    frame.from_ecliptic(longitude + along + frame.nutation, latitude + up) * distance
}

/// The Moon as seen from a place, through air or not.
pub(crate) fn seen(frame: &FrameOfDate, site: &Site, air: Option<&Refraction>) -> Moon {
    let (moon, sun) = (geocentric(frame), sun::geocentric(frame));
    let seen = site.see(moon, air);
    let (to_moon, to_sun) = (moon - site.position, sun - moon);
    let towards = to_moon.normalize();
    let phase = (-towards).cross(to_sun).length().atan2((-towards).dot(to_sun));
    // The bright limb lies where the Sun does on the sky around the Moon. Below a pole of its own it has no direction
    // and the arc tangent of two zeros is zero.
    let angle = |pole: DVec3, what: DVec3| {
        let east = pole.cross(towards);
        let north = towards.cross(east);
        what.dot(east).atan2(what.dot(north)).rem_euclid(TAU) % TAU
    };
    let (axes, zenith) = (selenography::axes(frame), site.to_local.row(2));
    Moon {
        seen,
        phase,
        limb: angle(DVec3::Z, to_sun),
        limb_from_zenith: angle(zenith, to_sun),
        sun_distance: to_sun.length() / AU,
        libration: selenography::libration(&axes, towards),
        axis: angle(DVec3::Z, axes.z_axis),
        axis_from_zenith: angle(zenith, axes.z_axis),
    }
}

/// Fraction of the disc that is lit.
pub fn illuminated(phase: f64) -> f64 {
    let half = (0.5 * phase).cos();
    half * half
}

/// Angle of the radius at a distance of at least [`RADIUS`] \[km\].
pub fn angular_radius(distance: f64) -> f64 {
    (RADIUS / distance).asin()
}

/// Light of the Moon by phase angle \[rad\], distance \[km\] and distance of the Sun from it \[au\].
pub fn moonlight(law: Law, phase: f64, distance: f64, sun_distance: f64) -> Moonlight {
    let (magnitude, irradiance) = match law {
        Law::Krisciunas => {
            let magnitude = krisciunas(phase) + 5.0 * (distance / MEAN_DISTANCE * sun_distance).log10();
            (magnitude, light::irradiance(magnitude))
        }
        Law::Wang => {
            let irradiance = wang(phase, distance, sun_distance);
            (light::magnitude(irradiance), irradiance)
        }
    };
    Moonlight { magnitude, irradiance, illuminance: light::illuminance(magnitude) }
}

/// Magnitude of the Moon at its mean distance by phase angle \[rad\].
pub fn krisciunas(phase: f64) -> f64 {
    let degrees = phase.abs().to_degrees();
    -12.73 + 0.026 * degrees + 4e-9 * degrees.powi(4)
}

/// Equation 9, corrected: irradiance of the Moon by phase angle \[rad\], distance \[km\] and distance of the Sun
/// \[au\].
pub fn wang(phase: f64, distance: f64, sun_distance: f64) -> f64 {
    let sun = SOLAR / (sun_distance * sun_distance);
    let earth = FULL_EARTH / (sun_distance * sun_distance);
    let ratio = RADIUS / distance;
    // Seen from the Moon the Earth has the opposite phase; earthshine itself is seen at phase zero.
    2.0 * ALBEDO / 3.0 * ratio * ratio * (earth * lommel_seeliger(PI - phase) + sun * lommel_seeliger(phase))
}

/// Illuminance of the earth-lit Moon by phase angle \[rad\], distance \[km\] and distance of the Sun \[au\]: that part
/// of equation 9 alone \[lx\].
pub fn earthshine(phase: f64, distance: f64, sun_distance: f64) -> f64 {
    let ratio = RADIUS / distance / sun_distance;
    let irradiance = 2.0 * ALBEDO / 3.0 * ratio * ratio * FULL_EARTH * lommel_seeliger(PI - phase);
    if irradiance > 0.0 { light::illuminance(light::magnitude(irradiance)) } else { 0.0 }
}

/// Light of a sphere by Lommel and Seeliger at a phase angle in `[0, pi]` against that when full:
/// `1 - sin(p/2) tan(p/2) ln cot(p/4)`, with its limits 1 and 0.
pub fn lommel_seeliger(phase: f64) -> f64 {
    let left = PI - phase;
    if phase <= 0.0 {
        1.0
    } else if left < 1e-4 {
        left.max(0.0).powi(2) / 6.0
    } else if phase < FRAC_PI_2 {
        let half = 0.5 * phase;
        1.0 + half.sin() * half.tan() * (0.25 * phase).tan().ln()
    } else {
        let half = 0.5 * left;
        1.0 - 2.0 * half.cos().powi(2) / half.sin() * (0.5 * half).tan().atanh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::time::Instant;

    #[test]
    fn the_moon_of_meeus() {
        // Example 47.a: 1992 April 12, 0h TD.
        let instant = Instant { centuries: -0.077_221_081_451, rotation_days: -2820.5 };
        let [longitude, latitude, distance] = mean_of_date(instant.centuries);
        assert!((longitude.to_degrees().rem_euclid(360.0) - 133.162_655).abs() < 2e-6, "{}", longitude.to_degrees());
        assert!((latitude.to_degrees() + 3.229_126).abs() < 2e-6, "{}", latitude.to_degrees());
        assert!((distance - 368_409.7).abs() < 0.1, "{distance}");
        // By the series alone: what it leaves of DE421 is the oracles' to judge.
        let frame = FrameOfDate::new(instant);
        let to = frame.from_ecliptic(longitude + frame.nutation, latitude) * distance;
        let right = to.y.atan2(to.x).to_degrees().rem_euclid(360.0);
        let north = to.z.atan2(to.x.hypot(to.y)).to_degrees();
        assert!((right - 134.688_470).abs() * 3600.0 < 0.5, "{right}");
        assert!((north - 13.768_368).abs() * 3600.0 < 0.5, "{north}");
        // Example 48.a, the same instant from the Earth's centre: phase angle 69.0756, lit 0.6786, limb 285.0.
        let sun = sun::geocentric(&FrameOfDate::new(instant));
        let phase = (-to).angle_between(sun - to);
        assert!((phase.to_degrees() - 69.0756).abs() < 0.01, "{}", phase.to_degrees());
        assert!((illuminated(phase) - 0.6786).abs() < 1e-4, "{phase}");
        let east = DVec3::Z.cross(to);
        let limb = sun.dot(east / to.length()).atan2(sun.dot(to.cross(east) / to.length_squared()));
        assert!((limb.to_degrees().rem_euclid(360.0) - 285.0).abs() < 0.1, "{}", limb.to_degrees());
    }

    #[test]
    fn libration_of_meeus() {
        // Example 53.a: 1992 April 12, 0h TD, from the Earth's centre: optical l' = -1.206, b' = 4.194; P = 15.08.
        let frame = FrameOfDate::new(Instant { centuries: -0.077_221_081_451, rotation_days: -2820.5 });
        let (axes, towards) = (selenography::axes(&frame), geocentric(&frame).normalize());
        let [longitude, latitude] = selenography::libration(&axes, towards).map(f64::to_degrees);
        assert!((longitude + 1.206).abs() < 0.001, "{longitude}");
        assert!((latitude - 4.194).abs() < 0.001, "{latitude}");
        let east = DVec3::Z.cross(towards).normalize();
        let turn = axes.z_axis.dot(east).atan2(axes.z_axis.dot(towards.cross(east))).to_degrees();
        // Meeus' has the physical libration.
        assert!((turn - 15.08).abs() < 0.03, "{turn}");
        // The way back from the three angles.
        let back = selenography::seen_axes(
            towards,
            towards.cross(east),
            [longitude, latitude].map(f64::to_radians),
            turn.to_radians(),
        );
        assert!(back.abs_diff_eq(axes, 1e-9), "{back} of {axes}");
    }

    #[test]
    fn the_phase_term_of_equation_9() {
        for (degrees, want) in
            [(0.0, 1.0), (30.0, 0.85939), (90.0, 0.37677), (150.0, 0.04527), (170.0, 0.005_072), (179.0, 5.08e-5)]
        {
            let got = lommel_seeliger(f64::to_radians(degrees));
            assert!((got - want).abs() < 5e-6_f64.max(1e-3 * want * f64::from(want < 0.01)), "{degrees}: {got}");
        }
        let mut before = 1.0 + 1e-15;
        for i in 0..=180_000 {
            let now = lommel_seeliger((f64::from(i) * 0.001).to_radians());
            assert!(now >= 0.0 && now <= before, "falls, without a step, at {}: {before} {now}", f64::from(i) * 0.001);
            before = now + 1e-15;
        }
        for tiny in [1e-300, 1e-12, 1e-5] {
            assert!((lommel_seeliger(tiny) - 1.0).abs() < 1e-8, "full, {tiny}");
            assert!(lommel_seeliger(PI - tiny) < 1e-8, "new, {tiny}");
        }
    }

    #[test]
    fn light_of_the_full_moon() {
        assert!((light::magnitude(wang(0.0, MEAN_DISTANCE, 1.0)) + 12.73).abs() < 0.02, "albedo of equation 9");
        assert!((0.072 / ALBEDO - 0.43).abs() < 0.01, "what the printed albedo gives");
        let half = light::irradiance(krisciunas(FRAC_PI_2)) / light::irradiance(krisciunas(0.0));
        assert!((half - 0.091).abs() < 0.001, "{half}");
        // New: what is left is earthshine alone.
        let new = wang(PI, MEAN_DISTANCE, 1.0) / wang(0.0, MEAN_DISTANCE, 1.0);
        assert!((new * 1361.0 / 0.095 - 1.0).abs() < 1e-3, "{new}");
        let same = light::illuminance(light::magnitude(wang(PI, MEAN_DISTANCE, 1.0)));
        assert!((earthshine(PI, MEAN_DISTANCE, 1.0) / same - 1.0).abs() < 1e-12, "{same}");
        assert_eq!(earthshine(0.0, MEAN_DISTANCE, 1.0), 0.0, "a full Moon sees a new Earth");
    }
}
