"""Pixels without physics: histograms, thresholds, segmentation, filling."""
