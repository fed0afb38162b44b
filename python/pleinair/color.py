"""Coordinates of colour."""
