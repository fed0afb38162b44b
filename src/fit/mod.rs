//! Which parameters explain a photograph (floor 5).
