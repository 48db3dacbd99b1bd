"""Pieces of verdicts that a folder keeps: what is not as it was written is counted again."""

import numpy as np
import pytest

from umbra.tiles.verdict_pieces import PIECES, VerdictPieces

POINTS = np.arange(18.0).reshape(3, 6)
COUNTED = {"sky_component": np.array([1.0, 2.0, 3.0]), "bits of masks": np.zeros((2, 3), np.uint8)}


def find(folder, decides="after", points=POINTS, fingerprint="city"):
    """Return a piece, and how often it was counted."""
    times = []
    piece = VerdictPieces(folder, fingerprint).find(
        decides, points, lambda: times.append(1) or COUNTED
    )
    return piece, len(times)


def test_a_piece_is_kept_for_what_decides_it_alone(tmp_path):
    assert find(tmp_path)[1] == 1
    piece, times = find(tmp_path)
    assert times == 0
    assert {name: values.tolist() for name, values in piece.items()} == {
        name: values.tolist() for name, values in COUNTED.items()
    }
    assert find(tmp_path, decides="before")[1] == 1
    assert find(tmp_path, points=POINTS + 1)[1] == 1
    assert find(tmp_path, fingerprint="another")[1] == 1


@pytest.mark.parametrize("how", ["cut", "flip", "array", "packed", "others"])
def test_a_file_that_is_another_is_counted_again(tmp_path, how):
    find(tmp_path)
    (path,) = (tmp_path / PIECES).glob("*.npz")
    data = bytearray(path.read_bytes())
    if how == "cut":
        path.write_bytes(data[: len(data) // 2])
    elif how == "flip":
        data[data.index(np.float64(2.0).tobytes())] ^= 1
        path.write_bytes(data)
    elif how == "array":
        with path.open("wb") as file:
            np.save(file, np.arange(3.0))
    elif how == "packed":  # 80 MB in 80 kB
        np.savez_compressed(path, sky_component=np.zeros((3_000_000, 3)))
    else:
        np.savez(path, sky_component=np.zeros(4))
    piece, times = find(tmp_path)
    assert times == 1
    assert piece["sky_component"].tolist() == [1.0, 2.0, 3.0]
