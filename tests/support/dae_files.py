"""A COLLADA file made by hand: a plate in inches or metres, shown by two nodes."""

FILE = """<?xml version="1.0" encoding="utf-8"?>
{head}<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="{unit}"/><up_axis>{up}</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert><diffuse>
<color>0.5 0.25 0.125 1</color></diffuse></lambert></technique></profile_COMMON></effect>
</library_effects>
<library_materials><material id="m" name="brick"><instance_effect url="#e"/></material>
</library_materials>
<library_geometries><geometry id="g" name="plate"><mesh>
<source id="p"><float_array id="a" count="15">0 0 0 4 0 0 4 3 0 0 3 0 1 1 0</float_array>
<technique_common><accessor source="#a" count="5" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1" material="sym"><input semantic="VERTEX" source="#v" offset="0"/>
<vcount>5</vcount><p>0 1 2 3 {last}</p></polylist>
<lines count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1</p></lines>
</mesh></geometry></library_geometries>
<library_nodes><node id="shared" name="shared">{shared}</node></library_nodes>
<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
PLATE = """<instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="sym" target="#m"/></technique_common></bind_material>
</instance_geometry>"""
NODES = f"""<node id="one" name="one">{PLATE}</node>
<node id="two" name="two"><translate>0 0 7</translate><scale>2 2 2</scale>
<instance_node url="#shared"/></node>"""


def document(unit="1", up="Z_UP", head="", last="4", shared=PLATE, nodes=NODES):
    return FILE.format(unit=unit, up=up, head=head, last=last, shared=shared, nodes=nodes)
