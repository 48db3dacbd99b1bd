"""Small IFC files: boxes with a place on earth, in any unit."""

import pytest

ifcopenshell = pytest.importorskip("ifcopenshell", reason="ifcopenshell is not installed")
guid = pytest.importorskip("ifcopenshell.guid")


class IfcFile:
    """An IFC file with a project, a building of two storeys, and what a test adds."""

    def __init__(self, schema="IFC4", prefix="MILLI", true_north=None):
        self.file = file = ifcopenshell.file(schema=schema)
        self.scale = {"MILLI": 1000.0, None: 1.0}[prefix]  # project units in a metre
        self.history = None
        if schema == "IFC2X3":
            person = file.createIfcPersonAndOrganization(
                file.createIfcPerson(FamilyName="x"), file.createIfcOrganization(Name="x")
            )
            application = file.createIfcApplication(
                file.createIfcOrganization(Name="x"), "1", "x", "x"
            )
            self.history = file.createIfcOwnerHistory(
                person, application, None, "ADDED", None, None, None, 0
            )
        metre = file.createIfcSIUnit(None, "LENGTHUNIT", prefix, "METRE")
        angle = file.createIfcSIUnit(None, "PLANEANGLEUNIT", None, "RADIAN")
        north = None if true_north is None else file.createIfcDirection(true_north)
        self.context = file.createIfcGeometricRepresentationContext(
            "Body", "Model", 3, 1e-5, self.axes(), north
        )
        self.project = self.root("IfcProject", "project")
        self.project.RepresentationContexts = [self.context]
        self.project.UnitsInContext = file.createIfcUnitAssignment([metre, angle])
        self.building = self.root("IfcBuilding", "building", CompositionType="ELEMENT")
        self.storeys = [
            self.root("IfcBuildingStorey", name, CompositionType="ELEMENT")
            for name in ("ground floor", "attic")
        ]
        self.aggregate(self.building, self.storeys)

    def root(self, kind, name, **more):
        return self.file.create_entity(
            kind, GlobalId=guid.new(), OwnerHistory=self.history, Name=name, **more
        )

    def axes(self, x=0.0, y=0.0, z=0.0):
        place = self.file.createIfcCartesianPoint([float(x), float(y), float(z)])
        return self.file.createIfcAxis2Placement3D(place, None, None)

    def aggregate(self, whole, pieces):
        self.root("IfcRelAggregates", None, RelatingObject=whole, RelatedObjects=pieces)

    def site(self, name="site", latitude=None, longitude=None, elevation=None, size=None):
        site = self.root("IfcSite", name, CompositionType="ELEMENT")
        site.RefLatitude, site.RefLongitude = latitude, longitude
        site.RefElevation = elevation
        if size:
            self.shape(site, size)
        self.aggregate(self.project, [site])
        return site

    def shape(self, product, size, at=(0, 0, 0), color=None, style=""):
        """Give a product the body of a box, in metres."""
        file, scale = self.file, self.scale
        x, y, z = (float(v) * scale for v in size)
        profile = file.createIfcRectangleProfileDef(
            "AREA",
            None,
            file.createIfcAxis2Placement2D(file.createIfcCartesianPoint([x / 2, y / 2]), None),
            x,
            y,
        )
        up = file.createIfcDirection([0.0, 0.0, 1.0])
        solid = file.createIfcExtrudedAreaSolid(profile, self.axes(*(v * scale for v in at)), up, z)
        if color:
            self.style(solid, color, style)
        body = file.createIfcShapeRepresentation(self.context, "Body", "SweptSolid", [solid])
        product.Representation = file.createIfcProductDefinitionShape(None, None, [body])
        product.ObjectPlacement = file.createIfcLocalPlacement(None, self.axes())

    def style(self, solid, color, name):
        file = self.file
        rgb = file.createIfcColourRgb(None, *color)
        shading = file.create_entity("IfcSurfaceStyleRendering", SurfaceColour=rgb)
        shading.Transparency, shading.ReflectanceMethod = 0.5, "NOTDEFINED"
        look = file.createIfcSurfaceStyle(name, "BOTH", [shading])
        if file.schema == "IFC2X3":
            look = file.createIfcPresentationStyleAssignment([look])
        file.createIfcStyledItem(solid, [look], None)

    def box(self, kind, name, size, at=(0, 0, 0), storey=0, color=None, style="", **more):
        product = self.root(kind, name, **more)
        self.shape(product, size, at, color, style)
        if storey is not None:
            self.root(
                "IfcRelContainedInSpatialStructure",
                None,
                RelatingStructure=self.storeys[storey],
                RelatedElements=[product],
            )
        return product

    def opening(self, wall, size, at):
        hole = self.root("IfcOpeningElement", "hole")
        self.shape(hole, size, at)
        self.root(
            "IfcRelVoidsElement", None, RelatingBuildingElement=wall, RelatedOpeningElement=hole
        )

    def material(self, product, name):
        material = self.file.create_entity("IfcMaterial", Name=name)
        self.root(
            "IfcRelAssociatesMaterial", None, RelatedObjects=[product], RelatingMaterial=material
        )

    def map_conversion(self, crs, east, north, height=0.0, along=None, across=None, scale=None):
        file = self.file
        metre = file.createIfcSIUnit(None, "LENGTHUNIT", None, "METRE")
        target = file.create_entity("IfcProjectedCRS", Name=crs, MapUnit=metre)
        file.createIfcMapConversion(
            self.context, target, float(east), float(north), float(height), along, across, scale
        )

    def property_set(self, owner, name, **values):
        kinds = {float: "IfcReal", str: "IfcLabel"}
        properties = [
            self.file.createIfcPropertySingleValue(
                key, None, self.file.create_entity(kinds[type(value)], value), None
            )
            for key, value in values.items()
        ]
        made = self.root("IfcPropertySet", name, HasProperties=properties)
        self.root(
            "IfcRelDefinesByProperties",
            None,
            RelatedObjects=[owner],
            RelatingPropertyDefinition=made,
        )

    def write(self, path):
        self.file.write(str(path))
        return path
