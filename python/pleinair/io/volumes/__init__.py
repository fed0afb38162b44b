"""Files of volumes, one module for each format."""
