//! Numbers that others measured or derived; `SOURCES.md` beside this file says who and under which licence.

pub(crate) mod earth;
pub(crate) mod jupiter;
pub(crate) mod lunar;
pub(crate) mod lunar_fit;
pub(crate) mod mars;
pub(crate) mod mercury;
pub(crate) mod nutation;
pub(crate) mod planck;
pub(crate) mod rotation;
pub(crate) mod saturn;
pub(crate) mod venus;

/// 8 bytes a star; the layout is described in `scripts/make_astro_tables.py` and read by `stars.rs`.
pub(crate) const STARS: &[u8] = include_bytes!("stars.bin");

/// Control points of the Milky Way; the layout is described in `scripts/make_astro_tables.py` and read by
/// `milky_way.rs`.
pub(crate) const MILKY_WAY: &[u8] = include_bytes!("milky_way.bin");

/// Albedo of the Moon's near side; the layout is described in `scripts/make_astro_tables.py` and read by
/// `selenography.rs`.
pub(crate) const MARIA: &[u8] = include_bytes!("maria.bin");
