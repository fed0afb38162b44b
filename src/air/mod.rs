//! Floor 2: what happens to light in air, a participating medium of molecules, aerosol and ozone: phase functions,
//! transmittance, single scattering by quadrature and all further orders by moments.

pub mod column;
pub mod legendre;
pub mod monte_carlo;
pub mod multiple;
pub mod optics;
pub mod phase;
pub mod profile;
pub mod ray_samples;
pub mod scattering;
pub mod shell;
pub mod single;
pub mod slab;
pub mod stored;
