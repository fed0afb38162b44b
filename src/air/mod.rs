//! Floor 2: what happens to light in air, a participating medium of molecules, aerosol and ozone: phase functions,
//! transmittance, single scattering by quadrature and all further orders by moments.

pub mod multiple;
pub mod optics;
pub mod phase;
pub mod shell;
pub mod single;
