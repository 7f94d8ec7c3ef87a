"""VTK: a window with the camera, the light and the material of all works, for the programs of VTK."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Selects offscreen windows by EGL, so that VTK uses the same driver as the other programs.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import vtk as vtk
from vtk.util import numpy_support

from glshade.bench.peers.vtk import coat
from glshade.bench.stage import EYE, FAR, FOV, NEAR, TO_LIGHT


class Body:
    """A mesh without normals, which VTK computes.

    actor: VTK's actor, which shows the mesh
    """

    def __init__(self, positions: NDArray[Any], triangles: NDArray[Any]) -> None:
        # VTK refers to the memory of NumPy's arrays without holding a reference, so the arrays must be kept here.
        self._indices = triangles.astype(np.int64)
        cells = vtk.vtkCellArray()
        cells.SetData(3, numpy_support.numpy_to_vtkIdTypeArray(self._indices.ravel()))
        self._data, normals, mapper = vtk.vtkPolyData(), vtk.vtkPolyDataNormals(), vtk.vtkPolyDataMapper()
        self._data.SetPolys(cells)
        self.move(positions)
        normals.SetInputData(self._data)
        normals.SplittingOff()
        normals.ConsistencyOff()
        mapper.SetInputConnection(normals.GetOutputPort())
        self.actor = vtk.vtkActor()
        self.actor.SetMapper(mapper)
        coat(self.actor.GetProperty())

    def move(self, positions: NDArray[Any]) -> None:
        """Gives the vertices new positions (V, 3)."""
        points = vtk.vtkPoints()
        self._positions = positions
        points.SetData(numpy_support.numpy_to_vtk(positions))
        self._data.SetPoints(points)


class Window:
    """An offscreen window. driver: name of its driver; None before the first picture."""

    driver: str | None = None

    def __init__(self, size: tuple[int, int], samples: int = 0) -> None:
        self._size = size
        self._window, self._renderer = vtk.vtkRenderWindow(), vtk.vtkRenderer()
        self._renderer.SetBackground(0, 0, 0)
        self._renderer.SetAmbient(1, 1, 1)
        self._renderer.AutomaticLightCreationOff()
        sun = vtk.vtkLight()
        sun.SetLightTypeToSceneLight()
        sun.SetPosition(*TO_LIGHT)
        sun.SetFocalPoint(0, 0, 0)
        self._renderer.AddLight(sun)
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(samples)
        self._window.SetSize(*size)
        self._window.AddRenderer(self._renderer)
        camera = self._renderer.GetActiveCamera()
        camera.SetViewAngle(FOV)
        camera.SetFocalPoint(0, 0, 0)
        camera.SetViewUp(0, 1, 0)
        camera.SetPosition(*EYE)
        camera.SetClippingRange(NEAR, FAR)
        self._pixels = vtk.vtkUnsignedCharArray()

    def mesh(self, positions: NDArray[Any], triangles: NDArray[Any]) -> Body:
        """Adds a mesh and returns it."""
        body = Body(positions, triangles)
        self.add(body.actor)
        return body

    def add(self, actor: Any) -> None:
        """Adds an actor."""
        self._renderer.AddActor(actor)

    def draw(self) -> NDArray[Any]:
        """Returns the picture (H, W, 3)."""
        self._window.Render()
        if self.driver is None:
            lines = self._window.ReportCapabilities().splitlines()
            capabilities = dict(line.split(" string:") for line in lines if " string:" in line)
            self.driver = "; ".join(capabilities[f"OpenGL {key}"].strip() for key in ("renderer", "version"))
        width, height = self._size
        self._window.GetPixelData(0, 0, width - 1, height - 1, 0, self._pixels, 0)
        pixels: NDArray[Any] = numpy_support.vtk_to_numpy(self._pixels).reshape(height, width, 3)[::-1]
        return pixels
