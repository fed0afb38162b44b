//! `_core`: what `pleinair.astro` calls. A place is latitude and longitude \[rad\] and altitude \[m\]; an instant is
//! seconds since 1970 UTC.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use glam::DVec3;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::run::{quick, sized, to_py};
use crate::astro::light::Temperature;
use crate::astro::selenography::EarthShadow;
use crate::astro::{
    FrameOfDate, Instant, Law, Observer, light, milky_way, moon, planets, standard_atmosphere, stars, sun, zodiacal,
};

fn observer(unix: f64, place: [f64; 3], refractivity: Option<f64>) -> PyResult<Observer> {
    Observer::new(unix, place, refractivity).map_err(|e| to_py(&e))
}

/// Elevation, azimuth \[rad\] and distance \[km\] of the Sun.
#[pyfunction]
fn astro_sun(unix: f64, place: [f64; 3], refractivity: Option<f64>) -> PyResult<(f64, f64, f64)> {
    let seen = observer(unix, place, refractivity)?.sun();
    Ok((seen.elevation, seen.azimuth, seen.distance))
}

/// Elevation, azimuth \[rad\], distance \[km\], phase angle, limb, limb from the zenith \[rad\], the Sun's distance \[au\],
/// libration in longitude and latitude, position angle of the axis, the same from the zenith \[rad\] of the Moon.
#[pyfunction]
fn astro_moon(unix: f64, place: [f64; 3], refractivity: Option<f64>) -> PyResult<[f64; 11]> {
    let found = observer(unix, place, refractivity)?.moon();
    let seen = found.seen;
    let shape = [found.phase, found.limb, found.limb_from_zenith, found.sun_distance];
    let [longitude, latitude] = found.libration;
    let face = [longitude, latitude, found.axis, found.axis_from_zenith];
    let where_ = [seen.elevation, seen.azimuth, seen.distance];
    let mut all = [0.0; 11];
    all.iter_mut().zip(where_.into_iter().chain(shape).chain(face)).for_each(|(to, from)| *to = from);
    Ok(all)
}

/// The Earth's shadow on the Moon's disc: the share of its light that is taken; from the disc's middle to the shadow's, on
/// the axes of the place, and the radii of the Earth and the Sun, in the Moon's radii.
#[pyfunction]
fn astro_earth_shadow(unix: f64, place: [f64; 3]) -> PyResult<(f64, [f64; 3], f64, f64)> {
    let found = observer(unix, place, None)?;
    let (sun, to) = (sun::geocentric(&found.frame), moon::geocentric(&found.frame));
    let shadow = EarthShadow::new([sun, to], moon::angular_radius(to.length()), &found.site);
    Ok((shadow.share(), shadow.middle.to_array(), shadow.earth, shadow.sun))
}

/// Magnitude, irradiance \[W/m²\] and illuminance \[lx\] of the Moon; the fraction that is lit, the angle of its radius
/// \[rad\], the illuminance of earthshine \[lx\].
#[pyfunction]
fn astro_moonlight(phase: f64, distance: f64, sun_distance: f64, wang: bool) -> [f64; 6] {
    let law = if wang { Law::Wang } else { Law::Krisciunas };
    let shines = moon::moonlight(law, phase, distance, sun_distance);
    let (lit, radius) = (moon::illuminated(phase), moon::angular_radius(distance));
    let earth = moon::earthshine(phase, distance, sun_distance);
    [shines.magnitude, shines.irradiance, shines.illuminance, lit, radius, earth]
}

/// Apparent vectors from the centre of the Earth to the Sun and the Moon, on the true equator and equinox \[km\].
#[pyfunction]
fn astro_geocentric(unix: f64) -> PyResult<[[f64; 3]; 2]> {
    let frame = FrameOfDate::new(Instant::from_unix(unix).map_err(|e| to_py(&e))?);
    Ok([sun::geocentric(&frame).to_array(), moon::geocentric(&frame).to_array()])
}

/// Of the five planets: elevation, azimuth \[rad\], distance \[km\], phase angle \[rad\], magnitude, colour, distance from
/// the Sun \[km\].
#[pyfunction]
fn astro_planets(unix: f64, place: [f64; 3], refractivity: Option<f64>) -> PyResult<[[f64; 7]; 5]> {
    let observer = observer(unix, place, refractivity)?;
    Ok(planets::ALL.map(|planet| {
        let found = planet.seen(&observer);
        let seen = found.seen;
        [seen.elevation, seen.azimuth, seen.distance, found.phase, found.magnitude, found.color, found.sun_distance]
    }))
}

/// Pressure \[hPa\] and temperature \[K\] of the standard atmosphere at a height \[m\].
#[pyfunction]
fn astro_standard_air(altitude: f64) -> (f64, f64) {
    let (pressure, temperature) = standard_atmosphere::pressure_and_temperature(altitude);
    (1013.25 * pressure, temperature)
}

/// Local apparent sidereal time \[rad\].
#[pyfunction]
fn astro_sidereal(unix: f64, place: [f64; 3]) -> PyResult<f64> {
    Ok(observer(unix, place, None)?.sidereal_time())
}

type Numbers<'py> = Bound<'py, PyArray1<f64>>;

/// Directions (`x, y, z` in turn), magnitudes and colours of the stars of a magnitude and brighter.
#[pyfunction]
fn astro_stars(
    py: Python<'_>,
    unix: f64,
    place: [f64; 3],
    refractivity: Option<f64>,
    limit: f64,
) -> PyResult<(Numbers<'_>, Numbers<'_>, Numbers<'_>)> {
    let observer = observer(unix, place, refractivity)?;
    let (directions, magnitudes, colors) = quick(py, 0, |_| {
        let list = stars::brighter(limit)?;
        let directions: Vec<f64> = stars::directions(&observer, list).flat_map(|d| d.to_array()).collect();
        let magnitudes: Vec<f64> = list.iter().map(|star| star.magnitude).collect();
        let colors: Vec<f64> = list.iter().map(|star| star.color).collect();
        Ok((directions, magnitudes, colors))
    })?;
    Ok((directions.into_pyarray(py), magnitudes.into_pyarray(py), colors.into_pyarray(py)))
}

/// Directions of the whole catalogue in the ICRS, `x, y, z` in turn.
#[pyfunction]
fn astro_catalogue(py: Python<'_>) -> Numbers<'_> {
    stars::catalogue().iter().flat_map(|star| star.direction.to_array()).collect::<Vec<f64>>().into_pyarray(py)
}

/// Where directions of the ICRS (`x, y, z` in turn) are seen.
#[pyfunction]
fn astro_seen(
    py: Python<'_>,
    unix: f64,
    place: [f64; 3],
    refractivity: Option<f64>,
    directions: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let observer = observer(unix, place, refractivity)?;
    let (from, out) = (slice(&directions, "directions")?, slice_mut(&mut out, "out")?);
    sized(py, 200 * from.len(), |job| {
        let look = stars::seen(&observer);
        job.chunks(out, 3 << 10, |chunk, out| {
            for (from, to) in from[chunk * (3 << 10)..].chunks_exact(3).zip(out.chunks_exact_mut(3)) {
                to.copy_from_slice(&look(DVec3::from_slice(from)).to_array());
            }
            Ok(())
        })
    })
}

/// Irradiance of magnitudes.
#[pyfunction]
fn astro_irradiance(
    py: Python<'_>,
    magnitude: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (from, out) = (slice(&magnitude, "magnitude")?, slice_mut(&mut out, "out")?);
    quick(py, from.len(), |job| light::each(job, from, out, |x| Ok(light::irradiance(x))))
}

/// Magnitudes of irradiance.
#[pyfunction]
fn astro_magnitude(
    py: Python<'_>,
    irradiance: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (from, out) = (slice(&irradiance, "irradiance")?, slice_mut(&mut out, "out")?);
    quick(py, from.len(), |job| light::each(job, from, out, |x| Ok(light::magnitude(x))))
}

/// Temperatures of colour indices.
#[pyfunction]
fn astro_temperature(
    py: Python<'_>,
    b_v: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
    wang: bool,
) -> PyResult<()> {
    let (from, out) = (slice(&b_v, "b_v")?, slice_mut(&mut out, "out")?);
    let law = if wang { Temperature::Wang } else { Temperature::Ballesteros };
    quick(py, from.len(), |job| light::each(job, from, out, |x| law.of(x)))
}

/// Linear Rec. 709 colours of temperatures.
#[pyfunction]
fn astro_star_colors(
    py: Python<'_>,
    temperature: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (from, out) = (slice(&temperature, "temperature")?, slice_mut(&mut out, "out")?);
    quick(py, from.len(), |job| light::each(job, from, out.as_chunks_mut::<3>().0, |t| Ok(light::rgb(t))))
}

/// Luminance of the Milky Way \[cd/m²\] in unit vectors of the ICRS.
#[pyfunction]
fn astro_milky_way(
    py: Python<'_>,
    directions: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (from, out) = (slice(&directions, "directions")?.as_chunks::<3>().0, slice_mut(&mut out, "out")?);
    quick(py, from.len(), |job| light::each(job, from, out, |to| Ok(milky_way::luminance(DVec3::from(to)))))
}

/// Luminance of the zodiacal light \[cd/m²\] at longitudes from the Sun and latitudes \[rad\].
#[pyfunction]
fn astro_zodiacal(
    py: Python<'_>,
    longitude: PyReadonlyArrayDyn<'_, f64>,
    latitude: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (longitude, latitude) = (slice(&longitude, "longitude")?, slice(&latitude, "latitude")?);
    let out = slice_mut(&mut out, "out")?;
    quick(py, out.len(), |job| zodiacal::luminances(job, longitude, latitude, out))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(astro_sun, module)?)?;
    module.add_function(wrap_pyfunction!(astro_moon, module)?)?;
    module.add_function(wrap_pyfunction!(astro_moonlight, module)?)?;
    module.add_function(wrap_pyfunction!(astro_geocentric, module)?)?;
    module.add_function(wrap_pyfunction!(astro_earth_shadow, module)?)?;
    module.add_function(wrap_pyfunction!(astro_planets, module)?)?;
    module.add_function(wrap_pyfunction!(astro_catalogue, module)?)?;
    module.add_function(wrap_pyfunction!(astro_seen, module)?)?;
    module.add_function(wrap_pyfunction!(astro_standard_air, module)?)?;
    module.add_function(wrap_pyfunction!(astro_sidereal, module)?)?;
    module.add_function(wrap_pyfunction!(astro_stars, module)?)?;
    module.add_function(wrap_pyfunction!(astro_irradiance, module)?)?;
    module.add_function(wrap_pyfunction!(astro_magnitude, module)?)?;
    module.add_function(wrap_pyfunction!(astro_temperature, module)?)?;
    module.add_function(wrap_pyfunction!(astro_star_colors, module)?)?;
    module.add_function(wrap_pyfunction!(astro_milky_way, module)?)?;
    module.add_function(wrap_pyfunction!(astro_zodiacal, module)?)?;
    Ok(())
}
