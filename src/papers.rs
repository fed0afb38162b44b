//! The papers, page by page: each equation and claim, the function that implements it, the test that holds it, and
//! where we deviate and why. A renamed function breaks these links and with them `make docs`.

#[doc = include_str!("../docs/papers/aoas.md")]
pub mod aoas {}

#[doc = include_str!("../docs/papers/realistic_sky.md")]
pub mod realistic_sky {}

#[doc = include_str!("../docs/papers/corot.md")]
pub mod corot {}

#[doc = include_str!("../docs/papers/inverse_clouds.md")]
pub mod inverse_clouds {}
