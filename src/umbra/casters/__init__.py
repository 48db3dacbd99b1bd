"""Casters: which parts of a scene cast shadows, and which of them let light through."""
