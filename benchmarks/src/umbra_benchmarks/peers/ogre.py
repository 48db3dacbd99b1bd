"""OGRE's GL3Plus renderer with additive stencil shadows, through ogre-python."""

import ctypes
import os
import sys
from pathlib import Path
from typing import Any

import Ogre
import Ogre.RTShader
from serve import Place, serve

AMBIENT, DIFFUSE = 0.2, 0.8
_GROUP = "OgreInternal"


class OgreScene:
    """
    The spheres in an OGRE window.

    Parameters
    ----------
    scene : dict
        As ``Spheres.to_dict`` gives it.
    size : int
        Pixels a side.
    """

    def __init__(self, scene: dict[str, Any], size: int) -> None:
        if not os.environ.get("DISPLAY"):
            msg = "OGRE needs a display; run the benchmark under xvfb-run -a"
            raise RuntimeError(msg)
        self._root = _start()
        self._window = self._root.createRenderWindow("peer", size, size, False)
        self._finish = ctypes.CDLL("libGL.so.1").glFinish
        self.name = f"OGRE {Ogre.__version__}"
        driver = self._root.getRenderSystem().getCapabilities()
        self.driver = driver.getDeviceName()
        _find_shaders()

        manager = self._root.createSceneManager()
        # Before any mesh: it tells them to keep room for the extruded copies.
        manager.setShadowTechnique(Ogre.SHADOWTYPE_STENCIL_ADDITIVE)
        manager.setAmbientLight(Ogre.ColourValue(AMBIENT, AMBIENT, AMBIENT))
        generator = Ogre.RTShader.ShaderGenerator.getSingleton()
        generator.addSceneManager(manager)
        self._techniques = _Techniques(generator)
        Ogre.MaterialManager.getSingleton().addListener(self._techniques)

        root = manager.getRootSceneNode()
        radius = scene["radius"]
        normals = [[value / radius for value in vertex] for vertex in scene["vertices"]]
        sphere = _make_mesh(manager, "sphere", scene["vertices"], normals, scene["faces"])
        for centre in scene["centres"]:
            node = root.createChildSceneNode(Ogre.Vector3(*centre))
            node.attachObject(manager.createEntity(sphere))
        half = scene["half"]
        corners = [[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]
        up = [[0, 0, 1]] * 4
        ground = _make_mesh(manager, "ground", corners, up, [[0, 1, 2], [0, 2, 3]])
        plane = manager.createEntity(ground)
        plane.setCastShadows(False)
        root.attachObject(plane)

        camera = manager.createCamera("eye")
        camera.setAspectRatio(1.0)
        camera.setFOVy(Ogre.Radian(Ogre.Degree(scene["fov"])))
        camera.setNearClipDistance(1.0)
        camera.setFarClipDistance(0.0)  # infinite, as z-fail wants it
        eye = root.createChildSceneNode(Ogre.Vector3(*scene["eye"]))
        eye.setFixedYawAxis(True, Ogre.Vector3(0, 0, 1))
        eye.attachObject(camera)
        eye.lookAt(Ogre.Vector3(*scene["target"]), Ogre.Node.TS_WORLD)
        view = self._window.addViewport(camera)
        view.setBackgroundColour(Ogre.ColourValue(0, 0, 0))
        view.setMaterialScheme(Ogre.MSN_SHADERGEN)

        light = manager.createLight("lamp")
        light.setType(Ogre.Light.LT_POINT)
        light.setDiffuseColour(Ogre.ColourValue(DIFFUSE, DIFFUSE, DIFFUSE))
        light.setSpecularColour(Ogre.ColourValue(0, 0, 0))
        light.setAttenuation(1e4, 1, 0, 0)
        self._lamp = root.createChildSceneNode()
        self._lamp.attachObject(light)

    def render(self, light: Place) -> None:
        """Draw a frame; it stays in the back buffer."""
        self._lamp.setPosition(Ogre.Vector3(*light))
        self._root._fireFrameStarted()
        self._window.update(False)
        self._root._fireFrameEnded()
        self._finish()

    def save(self, light: Place, path: str) -> None:
        """Draw a frame into a PNG file."""
        self.render(light)
        self._window.swapBuffers()
        self._window.writeContentsToFile(path)


class _Techniques(Ogre.MaterialManager_Listener):
    """Gives materials generated shaders, for the passes of additive lighting too."""

    def __init__(self, generator: Any) -> None:
        Ogre.MaterialManager_Listener.__init__(self)
        self._generator = generator

    def handleSchemeNotFound(  # noqa: N802
        self, _index: int, scheme: str, material: Any, _lod: int, _renderable: Any
    ) -> Any:
        """Make the technique that a viewport's scheme asks for."""
        if not self._generator.hasRenderState(scheme):
            return None
        fixed = material.getTechnique(0).getSchemeName()
        if not self._generator.createShaderBasedTechnique(material, fixed, scheme):
            return None
        name, group = material.getName(), material.getGroup()
        self._generator.validateMaterial(scheme, name, group)
        for technique in material.getTechniques():
            if technique.getSchemeName() == scheme:
                return technique
        return None

    def afterIlluminationPassesCreated(self, technique: Any) -> bool:  # noqa: N802
        """Return shaders to the passes that OGRE split a technique into."""
        scheme = technique.getSchemeName()
        if not self._generator.hasRenderState(scheme):
            return False
        material = technique.getParent()
        name, group = material.getName(), material.getGroup()
        self._generator.validateMaterialIlluminationPasses(scheme, name, group)
        return True

    def beforeIlluminationPassesCleared(self, technique: Any) -> bool:  # noqa: N802
        """Take them back before OGRE drops the passes."""
        scheme = technique.getSchemeName()
        if not self._generator.hasRenderState(scheme):
            return False
        material = technique.getParent()
        name, group = material.getName(), material.getGroup()
        self._generator.invalidateMaterialIlluminationPasses(scheme, name, group)
        return True


def _start() -> Any:
    os.environ.setdefault("OGRE_MIN_LOGLEVEL", "4")
    root = Ogre.Root("", "", "")
    plugins = Path(Ogre.__file__).parent / "OGRE"
    for plugin in ("RenderSystem_GL3Plus", "Codec_STBI"):
        root.loadPlugin(str(plugins / f"{plugin}.so"))
    root.setRenderSystem(root.getAvailableRenderers()[0])
    root.initialise(False)
    return root


def _find_shaders() -> None:
    """Load what the wheel brings: OGRE's extrusion programs and the parts of shaders."""
    shared = sorted(Path(sys.prefix, "share").glob("OGRE-*"))
    resources = Ogre.ResourceGroupManager.getSingleton()
    for folder in ("Main", "RTShaderLib"):
        path = str(shared[-1] / "Media" / folder)
        resources.addResourceLocation(path, "FileSystem", _GROUP)
    Ogre.RTShader.ShaderGenerator.initialize()
    resources.initialiseAllResourceGroups()


def _make_mesh(manager: Any, name: str, vertices: Any, normals: Any, faces: Any) -> Any:
    Ogre.MeshManager.getSingleton().setPrepareAllMeshesForShadowVolumes(True)
    shape = manager.createManualObject(name)
    shape.begin("BaseWhite", Ogre.RenderOperation.OT_TRIANGLE_LIST, _GROUP)
    for vertex, normal in zip(vertices, normals):
        shape.position(Ogre.Vector3(*vertex))
        shape.normal(Ogre.Vector3(*normal))
    for face in faces:
        shape.triangle(*face)
    shape.end()
    mesh = shape.convertToMesh(name)
    mesh.buildEdgeList()
    return mesh


if __name__ == "__main__":
    serve(OgreScene)
