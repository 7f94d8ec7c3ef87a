"""Surfaces: normals, tangents and closedness of meshes, as docs/scene-file.md describes them."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import replace

import numpy as np
from support.third.shapes import Mesh
from support.third.vectors import Array, across, dot, single, unit

# Angles count as equal if they differ by less than this [degrees].
SAME_ANGLE = 0.01
# The tangents on both sides of a seam of the uvs are averaged if their sum is longer than this share of their lengths' sum.
AGREEING = 0.95


def _numbered(*columns: Array) -> Array:
    """Returns a number (N,) for each row of the arrays (N, .), which is the same for equal rows."""
    rows = np.concatenate(columns, axis=1) + 0.0
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)


def face_normals(mesh: Mesh) -> Array:
    """Returns the unit normals (T, 3) of the triangles, on the side from which their corners are counter-clockwise."""
    a, b, c = mesh.positions.transpose(1, 0, 2)
    return unit(np.cross(b - a, c - a))


def _angles(mesh: Mesh) -> Array:
    """Returns the angles (T, 3) at the corners of the triangles [rad]."""
    p = mesh.positions
    along, back = unit(np.roll(p, -1, axis=1) - p), unit(np.roll(p, 1, axis=1) - p)
    return np.arctan2(np.linalg.norm(np.cross(along, back), axis=2), dot(along, back)[..., 0])


def with_normals(mesh: Mesh, kind: str, threshold: float) -> Mesh:
    """Returns the mesh with normals. kind, threshold [degrees]: the keys of an object."""
    if kind == "auto" and mesh.normals is not None:
        return mesh
    faces = face_normals(mesh)
    if kind == "face":
        return replace(mesh, normals=single(np.repeat(faces[:, None], 3, axis=1)))
    place = _numbered(mesh.positions.reshape(-1, 3)).reshape(-1, 3)
    fan = _fans(place, faces, threshold)
    sums = np.zeros((fan.max() + 1, 3))
    np.add.at(sums, fan, faces[:, None] * _angles(mesh)[..., None])
    return replace(mesh, normals=single(unit(sums)[fan]))


def _fans(place: Array, faces: Array, threshold: float) -> Array:
    """Returns a number (T, 3) for each corner; corners with the same number share a normal.

    Two corners at one place share it if a chain of triangles round the place leads from one to the other, over edges that bend
    by less than the threshold.
    place: number of the place of each corner (T, 3).
    faces: unit normals (T, 3) of the triangles.
    """
    group = np.arange(place.size).reshape(-1, 3)
    edges = defaultdict(list)
    for triangle, places in enumerate(place):
        for corner in range(3):
            edges[frozenset((places[corner], places[corner - 1]))].append(triangle)
    for ends, triangles in edges.items():
        for i, one in enumerate(triangles):
            for other in triangles[i + 1 :]:
                chord = np.linalg.norm(faces[one] - faces[other])
                bend = 2 * math.degrees(math.asin(min(chord / 2, 1)))
                if bend >= max(threshold - SAME_ANGLE, SAME_ANGLE) and threshold < 180:
                    continue
                for end in ends:
                    first, second = (group[t][place[t] == end][0] for t in (one, other))
                    group[group == second] = first
    return np.unique(group, return_inverse=True)[1].reshape(-1, 3)


def brushed(n: Array) -> Array:
    """Returns the unit tangents (..., 3) at normals n (..., 3) of surfaces without texture coordinates: round the y axis."""
    pole = np.hypot(n[..., :1], n[..., 2:]) < 1e-6
    return unit(np.where(pole, across(np.array([1.0, 0.0, 0.0]), n), np.cross(np.array([0.0, 1.0, 0.0]), n)))


def with_tangents(mesh: Mesh) -> Mesh:
    """Returns a mesh that has normals with tangents."""
    n = mesh.normals
    assert n is not None
    if mesh.uvs is None:
        return replace(mesh, tangents=single(np.concatenate([brushed(n), np.ones_like(n[..., :1])], axis=-1)))
    p, uv = mesh.positions, mesh.uvs
    (du1, dv1), (du2, dv2) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    area = du1 * dv2 - du2 * dv1
    step = dv2[:, None] * (p[:, 1] - p[:, 0]) - dv1[:, None] * (p[:, 2] - p[:, 0])
    along = (unit(np.sign(area)[:, None] * step)[:, None] * _angles(mesh)[..., None]).reshape(-1, 3)
    hand = np.repeat(np.where(area < 0, -1.0, 1.0), 3)[:, None]
    rows = [p.reshape(-1, 3), n.reshape(-1, 3), hand]

    def summed(number: Array, values: Array) -> Array:
        sums = np.zeros((number.max() + 1, values.shape[1]))
        np.add.at(sums, number, values)
        return sums[number]

    total = summed(_numbered(*rows, uv.reshape(-1, 2)), along)
    seam = _numbered(*rows)
    joined, lengths = summed(seam, along), summed(seam, np.sqrt(dot(along, along)))
    total = np.where(np.sqrt(dot(joined, joined)) > AGREEING * lengths, joined, total)
    flat = across(unit(total), rows[1])
    lost = np.sqrt(dot(flat, flat)) < 1e-6
    tangents = np.concatenate([np.where(lost, brushed(rows[1]), unit(flat)), np.where(lost, 1.0, hand)], axis=1)
    return replace(mesh, tangents=single(tangents.reshape(-1, 3, 4)))


def is_closed(mesh: Mesh) -> bool:
    """Returns whether every edge of the mesh has one triangle on either side, and the triangles face outward."""
    place = _numbered(mesh.positions.reshape(-1, 3)).reshape(-1, 3)
    edges = [(a, b) for t in place if len(set(t)) == 3 for a, b in zip(t, np.roll(t, -1), strict=True)]
    there = set(edges)
    paired = len(there) == len(edges) and all((b, a) in there for a, b in edges)
    return paired and bool(np.linalg.det(mesh.positions - mesh.positions.mean(axis=(0, 1))).sum() > 1e-9)
