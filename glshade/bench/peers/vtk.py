"""VTK: a peer that uses VTK directly, without PyVista; its Phong shading draws the same picture."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Selects offscreen windows by EGL, so that VTK uses the same driver as the other programs.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import vtk
from vtk.util import numpy_support

from glshade.bench.stage import AMBIENT, COLOURS, EXPONENT, EYE, FAR, FOV, KD, KS, NEAR, POSITIONS, TO_LIGHT, WorkFiles


def coat(look: Any) -> None:
    """Gives an actor's property the material of all works."""
    look.SetInterpolationToPhong()
    look.BackfaceCullingOn()
    look.SetColor(*KD)
    look.SetAmbient(AMBIENT)
    look.SetDiffuse(1.0)
    look.SetSpecular(KS)
    look.SetSpecularColor(1, 1, 1)
    look.SetSpecularPower(EXPONENT)


class Peer:
    """Draws with a vtkRenderWindow, with back faces culled and without multisampling."""

    def __init__(self, stage: WorkFiles) -> None:
        window, renderer = vtk.vtkRenderWindow(), vtk.vtkRenderer()
        renderer.AddActor(self._sphere(stage))
        renderer.SetBackground(0, 0, 0)
        renderer.SetAmbient(1, 1, 1)
        renderer.AutomaticLightCreationOff()
        for light in _lights(stage.lights):
            renderer.AddLight(light)
        window.SetOffScreenRendering(1)
        window.SetMultiSamples(0)
        window.SetSize(stage.side, stage.side)
        window.AddRenderer(renderer)
        self._camera = renderer.GetActiveCamera()
        self._camera.SetViewAngle(FOV)
        self._camera.SetFocalPoint(0, 0, 0)
        self._camera.SetViewUp(0, 1, 0)
        self._camera.SetPosition(*EYE)
        self._camera.SetClippingRange(NEAR, FAR)
        self._window, self._renderer, self._side = window, renderer, stage.side
        self._pixels = vtk.vtkUnsignedCharArray()
        window.Render()
        capabilities = dict(line.split(" string:") for line in window.ReportCapabilities().splitlines() if " string:" in line)
        self.driver = "; ".join(capabilities[f"OpenGL {key}"].strip() for key in ("renderer", "version"))

    def _sphere(self, stage: WorkFiles) -> Any:
        # VTK refers to the memory of NumPy's arrays without holding a reference, so the arrays must be kept here.
        positions, triangles = stage.arrays()
        indices = triangles.astype(np.int64)
        self._kept = positions, indices
        points, cells, data = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
        points.SetData(numpy_support.numpy_to_vtk(positions))
        cells.SetData(3, numpy_support.numpy_to_vtkIdTypeArray(indices.ravel()))
        normals = numpy_support.numpy_to_vtk(positions)
        data.SetPoints(points)
        data.SetPolys(cells)
        data.GetPointData().SetNormals(normals)
        mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
        mapper.SetInputData(data)
        actor.SetMapper(mapper)
        coat(actor.GetProperty())
        return actor

    def _render(self, eye: tuple[float, float, float]) -> None:
        self._camera.SetPosition(*eye)
        self._window.Render()

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        self._render(eye)
        last = self._side - 1
        self._window.GetPixelData(0, 0, last, last, 0, self._pixels, 0)
        pixels: NDArray[Any] = numpy_support.vtk_to_numpy(self._pixels).reshape(self._side, self._side, 3)[::-1]
        return pixels

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        self._render(eye)
        picture, writer = vtk.vtkWindowToImageFilter(), vtk.vtkPNGWriter()
        picture.SetInput(self._window)
        picture.ReadFrontBufferOff()
        picture.ShouldRerenderOff()
        writer.SetInputConnection(picture.GetOutputPort())
        writer.SetFileName(path)
        writer.Write()


def _lights(kind: str) -> list[Any]:
    sun = vtk.vtkLight()
    sun.SetLightTypeToSceneLight()
    if kind == "directional":
        sun.SetPosition(*TO_LIGHT)
        sun.SetFocalPoint(0, 0, 0)
        return [sun]
    lamps = []
    for position, colour in zip(POSITIONS, COLOURS, strict=True):
        lamp = vtk.vtkLight()
        lamp.SetLightTypeToSceneLight()
        lamp.PositionalOn()
        lamp.SetConeAngle(180)
        lamp.SetPosition(*position)
        lamp.SetColor(*colour)
        lamps.append(lamp)
    return lamps
