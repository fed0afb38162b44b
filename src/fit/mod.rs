//! Which parameters explain a photograph (floor 5), after Dobashi et al. 2012.

pub mod clouds;
pub mod genetic;
pub mod objective;
pub mod photo;
