//! Which parameters explain a photograph (floor 5), after Dobashi et al. 2012.

pub mod clouds;
pub mod cma;
pub mod differential;
pub mod genetic;
pub mod grain;
pub mod intervals;
pub mod noise_floor;
pub mod objective;
pub mod photo;
pub mod search;
