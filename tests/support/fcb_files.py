"""FlatCityBuf files made by hand: buildings of polygons, with an index of one level."""

import struct

import flatbuffers
import numpy as np
from flatcitybuf.generated import feature_generated as f
from flatcitybuf.generated import geometry_generated as g
from flatcitybuf.generated import header_generated as h

SCALE = 0.001
MAGIC = b"fcb\x01fcb\x00"


def _numbers(builder, start, values):
    start(builder, len(values))
    for value in reversed(values):
        builder.PrependUint32(value)
    return builder.EndVector()


def _offsets(builder, start, values):
    start(builder, len(values))
    for value in reversed(values):
        builder.PrependUOffsetTRelative(value)
    return builder.EndVector()


def _feature(name, faces):
    """A building of polygons (lists of corners) as loose surfaces."""
    points = [tuple(corner) for face in faces for corner in face]
    b = flatbuffers.Builder()
    strings = _numbers(b, g.GeometryStartStringsVector, [len(face) for face in faces])
    surfaces = _numbers(b, g.GeometryStartSurfacesVector, [1] * len(faces))
    shells = _numbers(b, g.GeometryStartShellsVector, [len(faces)])  # as fcb_core writes them
    corners = _numbers(b, g.GeometryStartBoundariesVector, list(range(len(points))))
    lod = b.CreateString("2")
    g.GeometryStart(b)
    g.GeometryAddType(b, g.GeometryType.MultiSurface)
    g.GeometryAddLod(b, lod)
    g.GeometryAddShells(b, shells)
    g.GeometryAddSurfaces(b, surfaces)
    g.GeometryAddStrings(b, strings)
    g.GeometryAddBoundaries(b, corners)
    shapes = _offsets(b, f.CityObjectStartGeometryVector, [g.GeometryEnd(b)])
    own = b.CreateString(name)
    f.CityObjectStart(b)
    f.CityObjectAddType(b, f.CityObjectType.Building)
    f.CityObjectAddId(b, own)
    f.CityObjectAddGeometry(b, shapes)
    objects = _offsets(b, f.CityFeatureStartObjectsVector, [f.CityObjectEnd(b)])
    f.CityFeatureStartVerticesVector(b, len(points))
    for point in reversed(points):
        f.CreateVertex(b, *(round(value / SCALE) for value in point))
    vertices = b.EndVector()
    own = b.CreateString(name)
    f.CityFeatureStart(b)
    f.CityFeatureAddId(b, own)
    f.CityFeatureAddObjects(b, objects)
    f.CityFeatureAddVertices(b, vertices)
    b.FinishSizePrefixed(f.CityFeatureEnd(b))
    return bytes(b.Output())


def make_fcb(houses, code=28992, is_indexed=True):
    """Bytes of a file of houses: name to polygons."""
    blobs = [_feature(name, faces) for name, faces in houses.items()]
    b = flatbuffers.Builder()
    version, authority = b.CreateString("2.0"), b.CreateString("EPSG")
    h.ReferenceSystemStart(b)
    h.ReferenceSystemAddAuthority(b, authority)
    h.ReferenceSystemAddCode(b, code)
    system = h.ReferenceSystemEnd(b)
    h.HeaderStart(b)
    h.HeaderAddTransform(b, h.CreateTransform(b, *[SCALE] * 3, 0, 0, 0))
    h.HeaderAddReferenceSystem(b, system)
    h.HeaderAddFeaturesCount(b, len(blobs))
    h.HeaderAddIndexNodeSize(b, 16 if is_indexed else 0)
    h.HeaderAddVersion(b, version)
    b.FinishSizePrefixed(h.HeaderEnd(b))
    plans = [np.concatenate(faces)[:, :2] for faces in houses.values()]
    boxes = np.array([[*plan.min(0), *plan.max(0)] for plan in plans])
    starts = np.cumsum([0, *map(len, blobs)])
    nodes = [(*boxes[:, :2].min(0), *boxes[:, 2:].max(0), 1)]
    nodes += [(*box, start) for box, start in zip(boxes, starts.tolist(), strict=False)]
    tree = b"".join(struct.pack("<4dQ", *node) for node in nodes) if is_indexed else b""
    return MAGIC + bytes(b.Output()) + tree + b"".join(blobs)
