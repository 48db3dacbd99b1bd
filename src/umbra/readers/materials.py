"""Wavefront material libraries: the diffuse colours."""

from pathlib import Path

__all__ = ["read_materials"]

Color = tuple[float, float, float]


def read_materials(libraries: list[str], path: Path) -> tuple[dict[str, Color], tuple[str, ...]]:
    """
    Read the diffuse colours of the libraries that an OBJ file names.

    Parameters
    ----------
    libraries : list of str
        As after ``mtllib``; a name may hold spaces.
    path : Path
        The OBJ file: libraries are looked for beside it.

    Returns
    -------
    colors : dict of str to (3,) float
        By material; values clipped to 0 to 1.
    notes : tuple of str
        Libraries that are not there.
    """
    colors: dict[str, Color] = {}
    notes: list[str] = []
    for name in dict.fromkeys(libraries):
        try:
            text = (path.parent / name.replace("\\", "/")).read_bytes()
        except (OSError, ValueError):
            notes.append(f"material library '{name}' cannot be read; default colours are used")
            continue
        _read_colors(text.decode("utf-8", "replace"), colors)
    return colors, tuple(notes)


def _read_colors(text: str, colors: dict[str, Color]) -> None:
    material = None
    for line in text.splitlines():
        key, _, rest = line.strip().partition(" ")
        if key == "newmtl":
            material = rest.strip()
        elif key == "Kd" and material is not None:
            try:
                values = [min(max(float(word), 0.0), 1.0) for word in rest.split()[:3]]
            except ValueError:
                continue  # a texture or a spectrum
            if len(values) in {1, 3}:
                red, green, blue = values * 3 if len(values) == 1 else values
                colors[material] = (red, green, blue)
