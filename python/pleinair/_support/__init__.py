"""What every room leans on: arguments, JSON, key frames, threads. No face: import its files."""
