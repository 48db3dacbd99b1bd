"""Shadow counts on the CPU, in numba: planes, height fields, patches and camera frames."""
