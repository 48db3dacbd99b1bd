"""Small city models in CityGML, made by hand."""

GML = {"1.0": "http://www.opengis.net/gml", "2.0": "http://www.opengis.net/gml"}
SQUARE = [(0, 0), (4, 0), (4, 6), (0, 6)]


def city(*members, version="2.0", crs="urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::5783", head=""):
    """Return a whole file; objects of all modules share one namespace, which nobody reads."""
    gml = GML.get(version, "http://www.opengis.net/gml/3.2")
    named = f' srsName="{crs}"' if crs else ""
    envelope = (
        f"<gml:boundedBy><gml:Envelope{named} srsDimension='3'>"
        "<gml:lowerCorner>0 0 0</gml:lowerCorner><gml:upperCorner>9 9 9</gml:upperCorner>"
        "</gml:Envelope></gml:boundedBy>"
    )
    body = "".join(f"<c:cityObjectMember>{one}</c:cityObjectMember>" for one in members)
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n{head}<c:CityModel '
        f'xmlns:c="http://www.opengis.net/citygml/{version}" xmlns:gml="{gml}" '
        f'xmlns:xlink="http://www.w3.org/1999/xlink">{envelope}{body}</c:CityModel>'
    )


def ring(corners):
    """Return a closed ring."""
    numbers = " ".join(f"{v:.9g}" for corner in [*corners, corners[0]] for v in corner)
    return f"<gml:LinearRing><gml:posList>{numbers}</gml:posList></gml:LinearRing>"


def polygon(corners, name="", holes=()):
    """Return a polygon with an id and holes, if any."""
    named = f' gml:id="{name}"' if name else ""
    inner = "".join(f"<gml:interior>{ring(hole)}</gml:interior>" for hole in holes)
    return f"<gml:Polygon{named}><gml:exterior>{ring(corners)}</gml:exterior>{inner}</gml:Polygon>"


def surfaces(*members, kind="MultiSurface", name=""):
    """Return an aggregate of surfaces; a name alone is a link to that id."""
    named = f' gml:id="{name}"' if name else ""
    inner = "".join(
        f"<gml:surfaceMember>{one}</gml:surfaceMember>"
        if one.startswith("<")
        else f'<gml:surfaceMember xlink:href="#{one}"/>'
        for one in members
    )
    return f"<gml:{kind}{named}>{inner}</gml:{kind}>"


def solid(*members):
    """Return a solid of one shell."""
    shell = surfaces(*members, kind="CompositeSurface")
    return f"<gml:Solid><gml:exterior>{shell}</gml:exterior></gml:Solid>"


def prism(x=0.0, y=0.0, height=3.0):
    """Return the faces of a prism: kind and corners, wound outward."""
    base = [(x + a, y + b, 0.0) for a, b in SQUARE]
    top = [(a, b, height) for a, b, _ in base]
    walls = [[base[i], base[(i + 1) % 4], top[(i + 1) % 4], top[i]] for i in range(4)]
    return [
        ("GroundSurface", base[::-1]), ("RoofSurface", top), *(("WallSurface", w) for w in walls),
    ]  # fmt: skip


def building(name="house", faces=None, more="", level=2):
    """Return a building whose solid links to the polygons of its surfaces, as most cities do."""
    faces = prism() if faces is None else faces
    bounds = "".join(
        f"<c:boundedBy><c:{kind}><c:lod{level}MultiSurface>"
        + surfaces(polygon(corners, f"{name}-{k}"))
        + f"</c:lod{level}MultiSurface></c:{kind}></c:boundedBy>"
        for k, (kind, corners) in enumerate(faces)
    )
    body = solid(*(f"{name}-{k}" for k in range(len(faces))))
    return (
        f'<c:Building gml:id="{name}"><c:lod{level}Solid>{body}</c:lod{level}Solid>'
        f"{bounds}{more}</c:Building>"
    )
