"""Shadow volumes as arrays, for engines on any graphics API."""

from collections.abc import Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from umbra.errors import InputError
from umbra.gl.matrices import read_projection
from umbra.gl.plan_arrays import ArrayPlanner, PlannedVolumes
from umbra.gl.selection import VolumeOptions
from umbra.rays.transmission import find_opaque
from umbra.realtime.light_reach import check_light, find_reach
from umbra.scene import Light, Scene

__all__ = ["VolumePlanner"]


class VolumePlanner:
    """
    Plan the shadow volumes of a scene, without a graphics API.

    Parameters
    ----------
    scene : Scene
        The casters; those with transparency or holes in their texture cast nothing here.
    ground : float, optional
        z below which nothing but the scene receives shadows, in its coordinates [m]: volumes end
        there. Without it they are endless.

    Examples
    --------
    >>> planner = VolumePlanner(scene, ground=0.0)  # doctest: +SKIP
    >>> plan = planner.plan(view, projection, (960, 720), sun)  # doctest: +SKIP
    >>> for each in plan.passes:  # doctest: +SKIP
    ...     draw(plan.indices[each.first : each.first + each.count], each.front, each.back)
    """

    def __init__(self, scene: Scene, ground: float | None = None) -> None:
        if not isinstance(scene, Scene):
            msg = f"scene= is a Scene; got a {type(scene).__name__} (see umbra.make_scene)"
            raise InputError(msg, option="scene")
        local = None if ground is None else float(ground - scene.origin[2])
        self._arrays = ArrayPlanner(scene, find_opaque(scene, None), local)
        self._choices = VolumeOptions(narrow=False, cut=ground is not None)

    def plan(
        self,
        view: ArrayLike,
        projection: ArrayLike,
        size: Sequence[int],
        light: Light,
        *,
        depth: str = "zero-to-one",
        method: str = "auto",
    ) -> PlannedVolumes:
        """
        Plan one light's volumes in a view.

        Parameters
        ----------
        view, projection : (4, 4) float
            For column vectors; world coordinates are the scene's.
        size : (int, int)
            Columns and rows of the viewport.
        light : Light
        depth : {'minus-one-to-one', 'zero-to-one', 'reversed'}
            How the projection's depth runs from the near to the far plane.
        method : {'auto', 'mcguire', 'lengyel', 'z-fail', 'z-pass'}

        Returns
        -------
        plan : PlannedVolumes
            Triangles are wound outward, as `matrix` draws them with y up.

        Raises
        ------
        InputError
            If the matrices are no view, or the light has a size.
        """
        check_light(light)
        cols, rows = (int(n) for n in size)
        origin = self._arrays.planner.scene.origin
        seen = read_projection(self._arrays.device, view, projection, (cols, rows), origin, depth)
        volumes = self._arrays.plan(seen, light, method, self._choices)[1]
        scissor, bounds = find_reach(seen, self._arrays.planner.scene, light, (0, 0, cols, rows))
        return replace(volumes, scissor=scissor, depth_bounds=bounds)
