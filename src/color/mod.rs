//! Coordinates of colour (floor 1).
