"""
Shadows of pieces of the casters on planar patches, each piece as if it stood alone.

One search finds the rims of all pieces on a patch. One ray from a sample lists the casting faces
between it and the sun, and so each piece's count there; crossings of the piece's own rims give its
count at all other samples. Where ``patch_count`` casts rays, rays list the faces here, too.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_near import find_errors, find_near_edges, pick_near
from umbra.cpu.patch_rays import get_sun
from umbra.cpu.patch_rims import add_rim, clear, find_rim_runs
from umbra.cpu.patch_search import find_rims
from umbra.cpu.patch_work import (
    BLOCK,
    count_blocks,
    find_doubts,
    find_run,
    is_marked,
    make_patch_work,
)
from umbra.cpu.patches import Patches
from umbra.cpu.shares import Membership, add_group_shares, make_share_work
from umbra.kernels import borrowing, inlined, inner, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import get, list_hiding
from umbra.volume.adjacency import Caster, make_caster

__all__ = ["PieceCounter", "PieceEdges"]


class PieceEdges:
    """
    Edges of pieces of a caster, each piece as if it stood alone.

    Parameters
    ----------
    caster : Caster
    piece : (n_faces,) int
        Piece of each of the caster's faces.
    room : int
        As in ``EdgeBinner``.
    """

    def __init__(self, caster: Caster, piece: NDArray[np.integer], room: int = 0) -> None:
        count = int(piece.max(initial=0)) + 1
        # Pieces share no vertices. Vertices keep their order, by which rays choose an edge's side.
        key = caster.faces.astype(np.int64) * count + piece[:, None]
        used, faces = np.unique(key, return_inverse=True)
        split = make_caster(
            caster.vertices[used // count], faces.reshape(-1, 3).astype(np.int32), is_welded=True
        )
        self.binner = EdgeBinner(split, room)
        shell = np.zeros(len(piece), np.int32)
        shell[split.source] = self.binner.edges.face_shell
        self.edges = self.binner.edges._replace(face_shell=shell)
        self.piece = piece.astype(np.int32)
        self.of_shell = np.zeros(int(shell.max(initial=0)) + 1, np.int32)
        self.of_shell[shell] = self.piece


class PieceCounter:
    """
    Adds up the hours of groups of pieces on samples of surfaces.

    Parameters
    ----------
    patches : Patches
        The samples.
    pieces : PieceEdges
        Edges of the pieces; counters of other samples may share them.
    tree : FaceTree
        Hierarchy over the faces of their caster.
    threads : int
    """

    def __init__(
        self, patches: Patches, pieces: PieceEdges, tree: FaceTree, threads: int = 1
    ) -> None:
        self._patches, self._pieces, self._tree, self._threads = patches, pieces, tree, threads

    def add_shares(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.float64],
        membership: Membership,
        cast: NDArray[np.float32],
        sole: NDArray[np.float32],
    ) -> None:
        """
        Add at most eight suns.

        Parameters
        ----------
        suns : (n, 3) float64
            Unit directions toward the sun.
        weights, membership, cast, sole
            As in ``umbra.cpu.shares.add_group_shares``.
        """
        use_threads(self._threads)
        suns = np.ascontiguousarray(suns)
        pieces, tree = self._pieces, self._tree
        faces = _Faces(pieces.of_shell, pieces.piece[tree.source])
        run_shared(
            count_blocks(self._patches), _add,
            self._patches, pieces.binner.bin(suns), pieces.edges, tree, faces, suns,
            weights, membership, cast, sole,
        )  # fmt: skip


class _Faces(NamedTuple):
    """Piece of each shell, (n_shells,) int32, and of each face of the tree, (n_faces,) int32."""

    of_shell: np.ndarray
    of_face: np.ndarray


class _PieceRows(NamedTuple):
    """
    Pieces that hide samples of a patch, a row each.

    Parameters
    ----------
    row : (n_pieces,) int32
        Row of each piece; -1 for none.
    piece : (n_pieces,) int32
        Piece of each row.
    level : (n_pieces,) int64
        Number of faces between one sample and the sun.
    head : (n_pieces,) int32
        First rim of each row; -1 for none.
    after : (n_rims,) int32
        Next rim of the same row.
    bits : (n_pieces, n_samples) uint8
        Suns that each row hides.
    found : (n_faces,) int32
        Faces that a ray meets.
    """

    row: np.ndarray
    piece: np.ndarray
    level: np.ndarray
    head: np.ndarray
    after: np.ndarray
    bits: np.ndarray
    found: np.ndarray


@kernel
def _add(patches, bins, edges, tree, faces, suns, weights, membership, cast, sole, taken):
    """Add blocks of patches until all are taken."""
    n = patches.size.shape[0]
    while True:
        p0 = BLOCK * take_next(taken)
        if p0 >= n:
            return
        p1 = min(n, p0 + BLOCK)
        _add_block(patches, bins, edges, tree, faces, suns, weights, membership, cast, sole, p0, p1)


@inner
def _add_block(
    patches, bins, edges, tree, faces, suns, weights, membership, cast, sole, p0, p1
):  # fmt: skip
    work = make_patch_work(patches, bins, p0, p1)
    n_pieces = membership.member.shape[1]
    most = 0
    for i in range(p0, p1):
        most = max(most, patches.first[i + 1] - patches.first[i])
    rows = _PieceRows(
        np.full(n_pieces, -1, np.int32),
        np.zeros(n_pieces, np.int32),
        np.zeros(n_pieces, np.int64),
        np.full(n_pieces, -1, np.int32),
        np.zeros(work.rims.shape[0], np.int32),
        np.empty((n_pieces, most), np.uint8),  # rows are cleared when they are used
        np.empty(tree.ids.shape[0], np.int32),
    )
    sums = make_share_work(membership)
    look = 0
    for i in range(p0, p1):
        first, end = patches.first[i], patches.first[i + 1]
        n_rows = 0
        for g in range(bins.first.size - 1):
            look += 1
            n_near = 0
            if patches.graze[i] < np.inf:
                n_near = find_near_edges(patches, bins, edges, work.near, g, i, look, 0.0)
            for s in range(bins.first[g], bins.first[g + 1]):
                n_rows = _find_pieces(
                    patches, bins, edges, tree, faces, work, rows, n_near, s, i, n_rows
                )
        if n_rows == 0:
            continue
        add_group_shares(
            rows.bits, rows.piece[:n_rows], 0, end - first, patches.where[first:end],
            patches.normals[first:end], suns, weights, membership, sums, cast, sole,
        )  # fmt: skip
        for r in range(n_rows):
            rows.row[rows.piece[r]] = -1


@borrowing
def _find_pieces(patches, bins, edges, tree, faces, work, rows, n_near, s, i, n_rows):
    """
    Find the samples of a patch that each piece hides from one sun; return the rows in use.

    ``n_near`` edges are near the patch under the sun's group.
    """
    d = get_sun(bins, s)
    f, graze = patches.frame, patches.graze[i]
    sine = f[i, 8] * d[0] + f[i, 9] * d[1] + f[i, 10] * d[2]
    n = patches.first[i + 1] - patches.first[i]
    if sine <= -graze:
        return n_rows
    if sine < graze:
        return _ask_all(patches, tree, faces, work, rows, s, i, d, n_rows)
    way, error = find_errors(patches, i, d, sine)
    known = _find_unmarked(patches, i, n, error[2])
    n_rims = -1
    if known >= 0:
        n_picks = pick_near(patches, bins, work.near, n_near, s, i, way, error)
        n_rims = find_rims(patches, bins, edges, tree, work, n_picks, s, i, way, error)
    if n_rims < 0:
        return _ask_all(patches, tree, faces, work, rows, s, i, d, n_rows)
    for r in range(n_rows):
        rows.level[r] = 0
        rows.head[r] = -1
    n_rows = _add_levels(patches, tree, faces, work, rows, i, known, d, n_rows)
    for q in range(n_rims):
        r, n_rows = _take(rows, faces.of_shell[np.int64(work.rims[q, 5])], n, n_rows)
        rows.after[q] = rows.head[r]
        rows.head[r] = q
    bit = np.uint8(1 << s)
    n_doubts = 0
    for r in range(n_rows):
        if rows.head[r] >= 0:
            n_doubts = _count_piece(
                patches, tree, faces, work, rows, i, known, d, r, error, n_doubts, bit
            )
            if n_doubts < 0:
                return _ask_all(patches, tree, faces, work, rows, s, i, d, n_rows)
        elif rows.level[r] > 0:
            _fill(rows.bits, r, 0, n, bit)
    n_asked = find_doubts(patches, work, i, n_doubts, error[2])
    if n_asked < 0:
        return _ask_all(patches, tree, faces, work, rows, s, i, d, n_rows)
    for q in range(n_asked):
        k = work.asked[q]
        work.is_doubt[k] = False
        n_rows = _ask(patches, tree, faces, work, rows, i, k, d, n_rows, bit)
    return n_rows


@inlined
def _find_unmarked(patches, i, n, reach):
    """Find a sample, from the middle on, that no face close to the plane is near; -1 for none."""
    for q in range(n):
        k = (n // 2 + q) % n
        if not is_marked(patches, i, k, reach):
            return k
    return -1


@inlined
def _take(rows, piece, n, n_rows):
    """Return the row of a piece, and the number of rows in use."""
    r = rows.row[piece]
    if r < 0:
        r = n_rows
        rows.row[piece] = r
        rows.piece[r] = piece
        rows.level[r] = 0
        rows.head[r] = -1
        for c in range(n):
            rows.bits[r, c] = 0
        n_rows += 1
    return r, n_rows


@inlined
def _fill(bits, r, a, b, bit):
    """Set a bit of some samples."""
    for c in range(a, b):
        bits[r, c] |= bit


@inlined
def _list(patches, tree, work, rows, i, k, d):
    """List the faces between a sample of a patch and the sun; return their number."""
    at = patches.first[i] + k
    return list_hiding(
        get(patches.points, at), get(patches.normals, at), d, tree, work.stack, rows.found
    )


@inlined
def _add_levels(patches, tree, faces, work, rows, i, k, d, n_rows):
    """Count each piece's faces between a sample and the sun; return the number of rows."""
    n = patches.first[i + 1] - patches.first[i]
    for q in range(_list(patches, tree, work, rows, i, k, d)):
        r, n_rows = _take(rows, faces.of_face[rows.found[q]], n, n_rows)
        rows.level[r] += 1
    return n_rows


@inlined
def _ask(patches, tree, faces, work, rows, i, k, d, n_rows, bit):
    """Find the pieces that hide one sample by a ray; return the number of rows."""
    n = patches.first[i + 1] - patches.first[i]
    for r in range(n_rows):
        rows.bits[r, k] &= ~bit
    for q in range(_list(patches, tree, work, rows, i, k, d)):
        r, n_rows = _take(rows, faces.of_face[rows.found[q]], n, n_rows)
        rows.bits[r, k] |= bit
    return n_rows


@borrowing
def _ask_all(patches, tree, faces, work, rows, s, i, d, n_rows):
    """Find the pieces that hide each sample of a patch by rays; return the number of rows."""
    bit = np.uint8(1 << s)
    first = patches.first[i]
    for k in range(patches.first[i + 1] - first):
        m = get(patches.normals, first + k)
        if m[0] * d[0] + m[1] * d[1] + m[2] * d[2] > 0.0:
            n_rows = _ask(patches, tree, faces, work, rows, i, k, d, n_rows, bit)
    return n_rows


@borrowing
def _count_piece(patches, tree, faces, work, rows, i, known, d, r, error, n_doubts, bit):
    """
    Find the samples that a piece with rims hides, from its count at the sample ``known``.

    Returns the number of doubtful squares so far, or -1 if rays must be cast.
    """
    c, rims, before = work.crossings, work.rims, n_doubts
    cols, rows_ = patches.size[i, 0], patches.size[i, 1]
    changes = 0
    q = rows.head[r]
    while q >= 0:
        t, n_doubts = add_rim(
            rims[q, 0], rims[q, 1], rims[q, 2], rims[q, 3], np.int64(rims[q, 4]), error[0],
            error[1], cols, rows_, c, n_doubts,
        )  # fmt: skip
        if t < 0 or n_doubts > c.doubts.size:
            clear(cols, c)
            return -1
        changes += t
        q = rows.after[q]
    n = patches.first[i + 1] - patches.first[i]
    level = rows.level[r]
    if changes == 0 and not _is_doubtful(patches, work, i, known, before, n_doubts):
        if level > 0:
            _fill(rows.bits, r, 0, n, bit)
        return n_doubts
    n_runs = find_rim_runs(cols, rows_, patches.before, patches.cell[i], c)
    run = find_run(c.runs, n_runs, known)
    if _is_doubtful(patches, work, i, known, before, n_doubts):
        known = -1
        for run in range(n_runs):
            k = (c.runs[run, 0] + c.runs[run, 1]) // 2
            if not (
                _is_doubtful(patches, work, i, k, before, n_doubts)
                or is_marked(patches, i, k, error[2])
            ):
                known = k
                break
        if known < 0:
            return -1
        level = 0
        for q in range(_list(patches, tree, work, rows, i, known, d)):
            level += faces.of_face[rows.found[q]] == rows.piece[r]
    base = level - c.runs[run, 2]
    for q in range(n_runs):
        if c.runs[q, 2] + base < 0:  # rounding: such a run has doubtful samples alone
            return -1
        if c.runs[q, 2] + base > 0:
            _fill(rows.bits, r, c.runs[q, 0], c.runs[q, 1], bit)
    return n_doubts


@inlined
def _is_doubtful(patches, work, i, k, a, b):
    """Return whether a sample is within rounding of a rim, one of the doubtful squares a to b."""
    cell = patches.cell[i]
    for q in range(a, b):
        at = cell + work.crossings.doubts[q]
        if patches.before[at] == k and patches.before[at + 1] > k:
            return True
    return False
