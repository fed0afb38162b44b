//! Pixels without physics (floor 1): histograms, thresholds, segmentation, filling.

pub mod resize;
