"""Generator: scenes made at random, as plain dicts, each with several features of the scene file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from support.third.models import MODELS

SIZE = (48, 36)
SHAPES: dict[str, dict[str, tuple[int, int]]] = {
    "cube": {},
    "plane": {"segments": (1, 4)},
    "sphere": {"segments": (5, 14), "rings": (3, 9)},
    "icosphere": {"subdivisions": (0, 2)},
    "cylinder": {"segments": (4, 14)},
    "cone": {"segments": (4, 14)},
    "torus": {"segments": (5, 14), "sides": (4, 9)},
}
# The ranges from which a parameter of a model is drawn, where they are not 0.05 to 0.95.
RANGES: dict[str, tuple[float, float]] = {
    "exponent": (1, 200),
    "exponent_1": (1, 60),
    "exponent_2": (1, 60),
    "exponent_3": (1, 60),
    "pu": (1, 200),
    "pv": (1, 200),
    "eta": (0.3, 3),
    "k": (0.3, 3),
    "roughness": (0.2, 1),
    "sigma": (0, 1.2),
    "cx_1": (-1, 1),
    "cy_1": (-1, 1),
    "alpha_x": (0.1, 0.6),
    "alpha_y": (0.1, 0.6),
}


class Generator:
    """Makes scenes at random.

    folder: the folder to which pictures and meshes are written.
    seed: numbers from which the scene follows.
    """

    def __init__(self, folder: Path, *seed: int) -> None:
        self.folder = folder
        self.rng = np.random.default_rng(seed)
        # The keys of `shown` have numbers of their own, so that scenes without them stay as they are.
        self.further = np.random.default_rng((*seed, 1))
        self.name = "-".join(map(str, seed))
        self.files = 0

    def scene(self) -> dict[str, Any]:
        """Returns a scene with one to four objects and one to five lights."""
        film: dict[str, Any] = {"size": list(SIZE), "background": self.colour()}
        if self.chance(0.3):
            film["exposure"] = self.between(-2, 2)
        if self.chance(0.2):
            film["crop"] = [5, 3, 36, 30]
        materials = {f"material{i}": self.material(textured=False) for i in range(2)}
        objects = [self.object(i) for i in range(self.rng.integers(1, 5))]
        if self.chance(0.3):
            names = [item["name"] for item in objects]
            for child, parent in zip(objects[1:], names, strict=False):
                child["parent"] = parent
        lights = [self.light(len(objects)) for _ in range(self.rng.integers(1, 6))]
        return {"film": film, "camera": self.camera(), "materials": materials, "objects": objects, "lights": lights}

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def between(self, low: float, high: float) -> float:
        return round(float(self.rng.uniform(low, high)), 3)

    def vector(self, size: float) -> list[float]:
        return [self.between(-size, size) for _ in range(3)]

    def colour(self) -> list[float]:
        return [self.between(0.05, 0.95) for _ in range(3)]

    def choice(self, *values: Any) -> Any:
        return values[self.rng.integers(len(values))]

    def camera(self) -> dict[str, Any]:
        eye = self.rng.normal(size=3)
        eye = np.round(eye / np.linalg.norm(eye) * self.rng.uniform(3.5, 5.5), 3)
        if self.chance(0.2):
            forward = -eye / np.linalg.norm(eye)
            right = np.cross(forward, self.rng.normal(size=3))
            right /= np.linalg.norm(right)
            columns = np.stack([right, np.cross(right, forward), -forward, eye], axis=1)
            return {"fov": self.between(25, 60), "matrix": [*columns.tolist(), [0, 0, 0, 1]]}
        camera = {"eye": eye.tolist(), "target": self.vector(0.3)}
        if self.chance(0.5):
            camera["up"] = self.vector(1)
        if self.chance(0.3):
            camera["turn"] = self.between(-180, 180)
        if self.chance(0.2):
            camera |= {"near": 0.05, "far": round(float(np.linalg.norm(eye)) + 0.4, 3)}
        if self.chance(0.35):
            return camera | {"type": "orthographic", "height": self.between(2.5, 5)}
        return camera | {"fov": self.between(25, 60)}

    def transform(self) -> dict[str, Any]:
        if self.chance(0.2):
            rows = np.round(np.column_stack([np.eye(3) + self.rng.uniform(-0.4, 0.4, (3, 3)), self.vector(1)]), 3)
            return {"matrix": [*rows.tolist(), [0, 0, 0, 1]]}
        scale = [self.between(0.6, 1.5) * (-1 if self.chance(0.15) else 1) for _ in range(3)]
        return {"translate": self.vector(0.9), "rotate": self.vector(180), "scale": scale}

    def object(self, index: int) -> dict[str, Any]:
        item: dict[str, Any] = {"name": f"object{index}", "transform": self.transform()}
        textured = True
        if self.chance(0.25):
            item["mesh"], textured = self.mesh()
            if self.chance(0.3):
                item["vertex_colours"] = False
        else:
            shape = self.choice(*SHAPES)
            counts = {key: int(self.rng.integers(*limits)) for key, limits in SHAPES[shape].items()}
            if shape == "torus":
                counts["minor"] = self.between(0.2, 0.6)
            item["shape"] = {"type": shape} | counts
            textured = shape != "icosphere"
        item["shading"] = self.choice("phong", "phong", "gouraud", "flat")
        item["normals"] = self.choice("auto", "auto", "smooth", "face")
        if self.chance(0.5):
            item["threshold"] = self.between(5, 100)
        if self.chance(0.3):
            item["sides"] = self.choice("front", "both")
        if self.chance(0.8):
            item["material"] = self.material(textured)
        elif self.chance(0.8):
            item["material"] = self.choice("material0", "material1")
        return item

    def material(self, textured: bool) -> dict[str, Any]:
        """Returns a material. textured: whether its object has texture coordinates."""
        brdf = self.choice(*MODELS)
        model = MODELS[brdf]
        material: dict[str, Any] = {"brdf": brdf}
        for name, (default, _, _) in (model.colours | model.numbers).items():
            if not self.chance(0.2 if isinstance(default, str) or name[-2:] in ("_2", "_3") else 0.7):
                continue
            low, high = RANGES.get(name, (0.05, 0.95))
            if textured and self.chance(0.25):
                factor = high if name in model.numbers else [high] * 3
                material[name] = self.texture() | {"factor": factor} | self.reading(name in model.numbers)
            elif name in model.colours and self.chance(0.7):
                material[name] = [self.between(low, high) for _ in range(3)]
            else:
                material[name] = self.between(low, high)
        if model.anisotropic and self.chance(0.4):
            material["tangent_direction"] = self.between(-90, 90)
        if textured and self.chance(0.25):
            material["normal_map"] = self.texture(base=(128, 128, 230), spread=25) | {"scale": self.between(0.5, 1.5)}
        elif textured and self.chance(0.3):
            material["bump_map"] = self.texture() | {"height": self.between(-0.08, 0.08)}
        if self.chance(0.1):
            material["sides"] = self.choice("front", "both")
        return material | self.shown(textured)

    def shown(self, textured: bool) -> dict[str, Any]:
        """Returns the keys of a material for emission, occlusion and unlit surfaces; often none."""
        keys: dict[str, Any] = {}
        kind = int(self.further.integers(6))
        # The textures take their numbers from there, too.
        self.rng, self.further = self.further, self.rng
        if kind in (0, 1):
            keys["emission"] = self.texture() | {"factor": self.colour()} if textured and kind else self.colour()
        if kind in (1, 2) and textured:
            keys["occlusion"] = self.texture() | {"strength": self.between(0, 1), "channel": self.choice("r", "g", "b")}
        if kind == 3 and self.chance(0.5):
            keys["unlit"] = True
        self.rng, self.further = self.further, self.rng
        return keys

    def reading(self, number: bool) -> dict[str, Any]:
        """Returns the keys of a texture that say how it is read. number: whether it is for a number."""
        keys: dict[str, Any] = {}
        if self.chance(0.3):
            keys["encoding"] = self.choice("srgb", "linear")
        if number and self.chance(0.5):
            keys["channel"] = self.choice("r", "g", "b")
        return keys

    def texture(self, base: tuple[int, int, int] = (140, 140, 140), spread: int = 110) -> dict[str, Any]:
        """Writes a picture of a few texels near a colour of 8 bits, and returns the keys that name it."""
        width, height = self.rng.integers(2, 7, size=2)
        noise = self.rng.integers(-spread, spread + 1, size=(height, width, 3))
        path = self.path("png")
        Image.fromarray((np.array(base) + noise).clip(0, 255).astype(np.uint8)).save(path)
        modes = ("repeat", "clamp", "mirror")
        return {"texture": str(path), "wrap": [self.choice(*modes), self.choice(*modes)]}

    def path(self, suffix: str) -> Path:
        self.files += 1
        return self.folder / f"{self.name}-{self.files}.{suffix}"

    def mesh(self) -> tuple[str, bool]:
        """Writes an OBJ file, and returns its path and whether it has texture coordinates."""
        side = int(self.rng.integers(2, 5))
        u, v = (a.reshape(-1) for a in np.meshgrid(*[np.linspace(0, 1, side + 1)] * 2))
        height = self.rng.uniform(-0.3, 0.3, len(u))
        positions = np.stack([2 * u - 1, height, 1 - 2 * v], axis=1)
        coloured, mapped, given = self.chance(0.5), self.chance(0.6), self.chance(0.4)
        values = np.concatenate([positions, self.rng.uniform(0.1, 1, positions.shape)], axis=1)[:, : 6 if coloured else 3]
        lines = ["v " + " ".join(f"{x:.6f}" for x in row) for row in values]
        if mapped:
            lines += [f"vt {x:.6f} {y:.6f}" for x, y in np.stack([1.7 * u - 0.2, 1.4 * v], axis=1)]
        if given:
            lines += [f"vn {x:.6f} 1 {z:.6f}" for x, z in self.rng.uniform(-0.5, 0.5, (len(u), 2))]
        for row in range(side):
            for column in range(side):
                a = row * (side + 1) + column + 1
                for face in ((a, a + 1, a + side + 2), (a, a + side + 2, a + side + 1)):
                    corners = [f"{i}/{i if mapped else ''}/{i if given else ''}".rstrip("/") for i in face]
                    lines.append("f " + " ".join(corners))
        path = self.path("obj")
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return str(path), mapped

    def light(self, objects: int) -> dict[str, Any]:
        kind = self.choice("ambient", "directional", "point", "point", "spot", "gltf_spot")
        light: dict[str, Any] = {"type": kind, "intensity": self.between(0.3, 1.5)}
        if self.chance(0.1):
            light["intensity"] *= -0.5
        if self.chance(0.7):
            light["colour"] = self.colour()
        if self.chance(0.2):
            light["only"] = [f"object{i}" for i in range(objects) if self.chance(0.5)]
        if kind == "directional":
            light["direction"] = self.vector(1)
        elif kind != "ambient":
            position = self.rng.normal(size=3)
            position = np.round(position / np.linalg.norm(position) * self.rng.uniform(2.5, 5), 3)
            light |= {"position": position.tolist(), "falloff": self.choice("none", "1/r", "1/r^2")}
            light["intensity"] *= {"none": 1, "1/r": 3, "1/r^2": 9}[light["falloff"]]
            if self.chance(0.2):
                light["r_min"] = self.between(1, 4)
            if kind != "point":
                light["direction"] = (self.rng.uniform(-0.5, 0.5, 3) - position).round(3).tolist()
                light["outer"] = self.between(10, 50)
                if self.chance(0.6):
                    light["inner"] = round(light["outer"] * self.between(0.1, 0.9), 3)
        return light


# The keys whose values are names of features.
_NAMED = {"brdf", "type", "shading", "normals", "sides", "falloff", "wrap", "encoding", "channel"}
_PARTS = {"objects": "object", "lights": "light", "materials": "material"}


def features(scene: Mapping[str, Any]) -> set[str]:
    """Returns the names of the features that a scene has, such as "object.parent", "light.type spot" or "texture.wrap mirror".

    They are the paths of its keys. The textures of all parameters share the path "texture".
    """
    found: set[str] = set()

    def walk(path: str, key: str, value: Any) -> None:
        if isinstance(value, Mapping):
            own = key.endswith("_map") or key in ("material", "occlusion")
            inside = key if own else "texture" if "texture" in value else path
            for name, item in value.items():
                walk(f"{inside}.{name}", name, item)
        elif key in _NAMED and not isinstance(value, int):
            found.update(f"{path} {name}" for name in ([value] if isinstance(value, str) else value))
        else:
            found.add(path)

    for part, value in scene.items():
        name = _PARTS.get(part, part)
        for item in value.values() if part == "materials" else value if isinstance(value, list) else [value]:
            walk(name, name, item)
    return found
