//! What happens to light in a cloud (floor 3).
