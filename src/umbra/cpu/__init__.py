"""Counting on the CPU, in numba: planes, height fields, and what any camera sees."""
