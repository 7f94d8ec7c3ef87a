"""Generator: writes the GLSL of the program that a plan describes."""

from __future__ import annotations

from collections.abc import Callable
from weakref import WeakKeyDictionary

from glshade.brdfs import BRDFS, EMISSION, Brdf, Parameter, Slot
from glshade.glsl.definitions import unreached
from glshade.glsl.plan import PAGE, LightGroup, ProgramPlan, channel
from glshade.glsl.shaders import Shaders, current, expand
from glshade.glsl.source import Code, Source, Stage
from glshade.lights import FALLOFFS, LIGHTS
from glshade.lru import Lru

# The size of the cache of sources for one set of shader files [bytes]: about two thousand programs.
KEPT_SOURCES = 32 << 20

_sources: WeakKeyDictionary[Shaders, Lru[ProgramPlan | str, Source]] = WeakKeyDictionary()


def generate(plan: ProgramPlan, shaders: Shaders | None = None) -> Source:
    """Returns the text of the program that a plan describes. The same plan and the same files give the same text.

    plan: the features of the program.
    shaders: optional; the shader files. Default: those that ship with glshade.
    Errors: ShaderError.
    """
    return _kept(plan, shaders or current(), lambda shaders: _generated(plan, shaders))


def encoder(encoding: str, shaders: Shaders) -> Source:
    """Returns the program that copies a picture in linear light to an encoded one.

    encoding: the name of a file in shaders/output.
    shaders: the shader files.
    Errors: ShaderError.
    """
    output = {"output": Code().include(f"output/{encoding}.glsl")}

    def make(shaders: Shaders) -> Source:
        return Source(expand("pass/picture.vert", {}, shaders), expand("pass/picture.frag", output, shaders))

    return _kept(encoding, shaders, make)


def _kept(key: ProgramPlan | str, shaders: Shaders, make: Callable[[Shaders], Source]) -> Source:
    """Returns the source of a key, from the cache of these shaders; `make` is called if it is not there."""
    kept = _sources.setdefault(shaders, Lru(KEPT_SOURCES))
    return kept.find(key, lambda: make(shaders), _size)


def _size(source: Source) -> int:
    """Returns the approximate size of a source in memory [bytes]: its text, and a tuple of 120 bytes for each line."""
    return sum(len(stage.text) + 120 * len(stage.lines) for stage in source.stages)


def _generated(plan: ProgramPlan, shaders: Shaders) -> Source:
    name = f"{plan.rate}_both" if plan.both_sides else plan.rate
    filled = slot_code(dict(plan.slots))
    if plan.rate == "phong":
        vertex = {"surface": _interpolated(plan)}
        fragment = {**filled, "surface": _shading(plan, _Interpolated(plan)).join(_alpha(plan))}
        vertex_pass, fragment_pass = "phong.vert", f"{name}.frag"
    else:
        vertex = {**filled, "surface": _shading(plan, _AtVertex(plan)).join(_alpha_inputs(plan, "out"))}
        fragment = {"surface": _alpha_inputs(plan, "in").join(_alpha(plan))}
        vertex_pass = f"{name}.vert"
        fragment_pass = f"{name}.frag" if plan.rate == "gouraud" else "flat.frag"
    fragment["output"] = Code().include(f"output/{plan.encoding}.glsl")
    fast = plan.arithmetic == "fast"
    stages = (
        expand(f"pass/{vertex_pass}", vertex, shaders, fast),
        expand(f"pass/{fragment_pass}", fragment, shaders, fast),
    )
    return Source(*map(without_unreached, stages))


def slot_code(slots: dict[str, Slot]) -> dict[str, Code]:
    """Place -> code, for the lines `#include <place>` of a model's file. The material decides the code of each place."""
    return {place: Code().include(*slot.includes).add(slot.text) for place, slot in slots.items()}


def model_code(brdf: Brdf, function: str, frame: str) -> dict[str, Code]:
    """Place -> code, for a program that evaluates one model.

    The place `model` holds the model's file, its parameters as uniforms and one function; the other places are its slots.
    brdf: the model with its parameters, which must not be textures.
    function: the head of the function, for example `vec3 value(vec3 l, vec3 v)`.
    frame: the GLSL expression of the shading frame in that function.
    """
    names = list(brdf.parameters())
    code = Code().include(f"brdf/{brdf.brdf}.glsl")
    for name in names:
        code.uniform("vec3" if brdf.is_colour(name) else "float", f"u_{name}")
    struct = f"{BRDFS.class_name(brdf.brdf)}({', '.join(f'u_{name}' for name in names)})"
    code.add(f"\n{function} {{\n    return brdf_cos({struct}, {frame}, l, v);\n}}\n")
    return {**slot_code(brdf.slots()), "model": code}


def value_code(brdf: Brdf) -> dict[str, Code]:
    """Place -> code, for a program that evaluates a model. In the local frame, `vec3 value(vec3 l, vec3 v)` returns f cos."""
    frame = "Frame(vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0))"
    return model_code(brdf, "vec3 value(vec3 l, vec3 v)", frame)


def without_unreached(stage: Stage) -> Stage:
    """Returns the stage without the functions, structs and constants that main() does not reach."""
    lines = stage.text.splitlines()
    removed = {i for definition in unreached(lines) for i in range(definition.first, definition.end)}
    return stage.only([i for i in range(len(lines)) if i not in removed])


class _Interpolated:
    """The expressions of a surface's quantities in the fragment stage, and their declarations."""

    def __init__(self, plan: ProgramPlan) -> None:
        self.position, self.normal, self.tangent = (_read(plan, f"v_{name}") for name in ("position", "normal", "tangent"))
        self.uv, self.colour = "v_uv", _read(plan, "v_colour")
        self.declarations = _varyings(plan, _handed_on(plan), "in")


class _AtVertex:
    """The expressions of a surface's quantities in the vertex stage, and their declarations.

    With flat shading the position, uv and colour are those of the triangle's centroid.
    """

    def __init__(self, plan: ProgramPlan) -> None:
        at = "a_centroid_" if plan.rate == "flat" else "a_"
        self.position = "world(a_centroid)" if plan.rate == "flat" else "world(a_position)"
        self.normal, self.tangent = "world_normal(a_normal)", "world_tangent(a_tangent)"
        self.uv, self.colour = f"{at}uv", f"{at}colour"
        self.declarations = Code()
        for name in _wanted(plan):
            if name != "position":
                self.declarations.input(TYPES[name], f"{at if name in ('uv', 'colour') else 'a_'}{name}")
        if plan.rate == "flat" and plan.positions:
            self.declarations.input("vec3", "a_centroid")
        self.declarations.join(_transforms(plan))


TYPES = {"position": "vec3", "normal": "vec3", "tangent": "vec4", "uv": "vec2", "colour": "vec4"}


def _wanted(plan: ProgramPlan) -> list[str]:
    """Returns the names of the surface quantities that the shading uses, in the order of TYPES."""
    asked = {
        "position": plan.positions,
        "normal": plan.oriented,
        "tangent": plan.tangents,
        "uv": plan.mapped,
        "colour": plan.coloured,
    }
    return [name for name, is_asked in asked.items() if is_asked]


def _wanted_by_alpha(plan: ProgramPlan) -> list[str]:
    """Returns the names of the surface quantities that the opacity depends on."""
    asked = {"uv": plan.alpha_from is not None, "colour": plan.vertex_colours and plan.alpha != "opaque"}
    return [name for name, is_asked in asked.items() if is_asked]


def _handed_on(plan: ProgramPlan) -> list[str]:
    """Returns the names of the quantities that per-pixel shading passes from the vertex to the fragment stage."""
    names = _wanted(plan)
    return names + [name for name in _wanted_by_alpha(plan) if name not in names]


def _read(plan: ProgramPlan, name: str) -> str:
    """Returns the expression of a quantity that is interpolated at the centroid, in the fragment stage."""
    return f"({name} / v_one)" if plan.scaled else name


def _scale(plan: ProgramPlan) -> Code:
    """`float centroid_scale()`, the factor of all values that the fragment stage gets interpolated at the centroid."""
    return Code().add(f"\nfloat centroid_scale() {{\n    return {'v_one' if plan.scaled else '1.0'};\n}}\n")


def _varyings(plan: ProgramPlan, names: list[str], direction: str) -> Code:
    """Returns the declarations of quantities that pass from the vertex to the fragment stage; direction is "in" or "out".

    They are interpolated at the centroid of the covered samples. With several samples per pixel, the centre of a pixel at a
    silhouette may lie outside the triangle, and attributes extrapolated to it give negative light or stray highlights.
    Texture coordinates are interpolated at the pixel's centre: extrapolation does them no harm, but a shifted position would
    change the level of detail, which the driver takes from their differences between pixels.

    In perspective, Mesa's llvmpipe interpolates a quantity divided by w at the centroid, and multiplies the result by w at the
    pixel's centre. `v_one` is 1 at all vertices, and so becomes the wrong factor that all quantities have in common.
    """
    code = Code()
    if plan.scaled:
        (code.input if direction == "in" else code.output)("float", "v_one", "centroid")
    for name in names:
        declare = code.input if direction == "in" else code.output
        declare(TYPES[name], f"v_{name}", "" if name == "uv" else "centroid")
    return code


def _transforms(plan: ProgramPlan) -> Code:
    code = Code()
    if plan.oriented:
        code.include("surface/normal_transform.glsl")
    if plan.tangents:
        code.include("surface/tangent_transform.glsl")
    return code


def _interpolated(plan: ProgramPlan) -> Code:
    """`void interpolate()` of the vertex stage for per-pixel shading, which sets the outputs that the fragment stage reads."""
    names = _handed_on(plan)
    values = {
        "position": "world(a_position)",
        "normal": "world_normal(a_normal)",
        "tangent": "world_tangent(a_tangent)",
        "uv": "a_uv",
        "colour": "a_colour",
    }
    code = Code()
    for name in names:
        if name != "position":
            code.input(TYPES[name], f"a_{name}")
    code.join(_transforms(plan)).join(_varyings(plan, names, "out")).join(_vertex_scale(plan))
    body = "".join(f"    v_{name} = {values[name]};\n" for name in names)
    return code.add(f"\nvoid interpolate() {{\n{body}{_one(plan)}}}\n")


def _one(plan: ProgramPlan) -> str:
    """Returns the statement that sets `v_one`, in the vertex stage."""
    return "    v_one = vertex_scale();\n" if plan.scaled else ""


def _vertex_scale(plan: ProgramPlan) -> Code:
    """`float vertex_scale()`, which is 1, and by which the vertex stage multiplies what is interpolated at the centroid.

    Drivers replace an output that is a constant or a uniform, and then it does not come with the wrong factor. So the 1 depends
    on the vertex in a way that they cannot see through: a uniform that is never set is 0.
    """
    code = Code().uniform("float", "u_zero") if plan.scaled else Code()
    value = "1.0 + u_zero * a_position.x" if plan.scaled else "1.0"
    return code.add(f"\nfloat vertex_scale() {{\n    return {value};\n}}\n")


def _material(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> Code:
    """`STRUCT material()`, which returns the model's parameters at the surface."""
    model, struct = BRDFS[plan.brdf], BRDFS.class_name(plan.brdf)
    code, body = Code().include(f"brdf/{plan.brdf}.glsl"), []
    bound: set[str] = set()
    for name, use in plan.parameters:
        kind = "vec3" if model.is_colour(name) else "float"
        if use == "unused":
            body.append(f"    m.{name} = {kind}(0.0);")
        elif use in model.parameters():
            body.append(f"    m.{name} = m.{use};")
        else:
            body.append(f"    m.{name} = {_parameter(plan, name, use, at, bound, code)};")
    lines = "\n".join(body)
    return code.add(f"\n{struct} material() {{\n    {struct} m;\n{lines}\n    return m;\n}}\n")


def _parameter(plan: ProgramPlan, name: str, use: str, at: _Interpolated | _AtVertex, bound: set[str], code: Code) -> str:
    """Returns the expression of a parameter that has a uniform or a texture.

    plan: the plan of the program.
    name: the parameter.
    use: how the plan uses it.
    at: the expressions of the surface's quantities.
    bound: the parameters whose samplers are declared so far; this function adds to them.
    code: the code that this function adds uniforms to.
    """
    model = BRDFS[plan.brdf]
    declared, colour = model.parameters()[name], model.is_colour(name)
    code.uniform("float" if use == "grey" or not colour else "vec3", f"u_{name}")
    value = f"vec3(u_{name})" if use == "grey" else f"u_{name}"
    texture_channel = channel(use)
    if texture_channel is not None:
        picture = plan.picture_of(name)
        if picture not in bound:
            bound.add(picture)
            _declare_texture(plan, f"u_{picture}_texture", code)
        channels = texture_channel or ("rgb" if colour else "r")
        value = _bounded(f"{value} * {_texel(plan, name, at)}.{channels}{_added(plan, name, code, colour)}", declared)
    if declared.base and plan.vertex_colours:
        value += f" * {at.colour}.rgb"
    return value


def _texel(plan: ProgramPlan, name: str, at: _Interpolated | _AtVertex) -> str:
    """Returns the expression of the texel of a parameter, of emission or of occlusion."""
    return _lookup(plan, f"u_{plan.picture_of(name)}_texture", at.uv)


def _emission_and_occlusion(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> Code:
    """`vec3 emission()`, which returns the light that the surface emits, and `float occlusion()`, which returns the factor of
    ambient light. Each is left out where the plan does not use it. The code must follow that of `_material`.
    """
    code = Code()
    bound = {plan.picture_of(name) for name, use in plan.parameters if channel(use) is not None}
    for name in ("emission", "occlusion"):
        picture = plan.picture_of(name)
        if name in plan.textured and picture not in bound:
            bound.add(picture)
            _declare_texture(plan, f"u_{picture}_texture", code)
    if plan.emission != "unused":
        grey = plan.emission == "grey"
        code.uniform("float" if grey else "vec3", "u_emission")
        value = "vec3(u_emission)" if grey else "u_emission"
        if plan.emission == "texture":
            value = _bounded(f"{value} * {_texel(plan, 'emission', at)}.rgb{_added(plan, 'emission', code)}", EMISSION)
        code.add(f"\nvec3 emission() {{\n    return {value};\n}}\n")
    if plan.occlusion != "unused":
        code.uniform("float", "u_occlusion")
        texel = f"{_texel(plan, 'occlusion', at)}.{channel(plan.occlusion)}"
        value = f"1.0 + u_occlusion * (clamp({texel}, 0.0, 1.0) - 1.0)"
        code.add(f"\nfloat occlusion() {{\n    return {value};\n}}\n")
    return code


def _added(plan: ProgramPlan, name: str, code: Code, colour: bool = True) -> str:
    """Returns the end of a sum that adds a number to a parameter's texels, which the code declares; empty without one."""
    if name not in plan.added:
        return ""
    code.uniform("vec3" if colour else "float", f"u_{name}_add")
    return f" + u_{name}_add"


def _declare_texture(plan: ProgramPlan, sampler: str, code: Code) -> None:
    """Adds the declarations of a texture to the code: its sampler, and the matrix of a texture that is placed by one."""
    code.uniform("sampler2D", sampler)
    if sampler in plan.placed:
        code.include("surface/placed_uv.glsl").uniform("vec3", f"{sampler}_across").uniform("vec3", f"{sampler}_up")


def _lookup(plan: ProgramPlan, sampler: str, uv: str, span: tuple[int, int] = (1, 1)) -> str:
    """Returns the expression of a texture's value (vec4).

    sampler: the name of the texture, which `_declare_texture` declares.
    uv: the expression of the mesh's texture coordinates.
    span: how many units of texture coordinates the texels span.
    """
    at = f"placed_uv({uv}, {sampler}_across, {sampler}_up)" if sampler in plan.placed else uv
    # The span is 1 or 2, and division by 2 is exact, so the texture coordinates keep all their digits.
    u, v = span
    return f"texture({sampler}, {at if span == (1, 1) else f'{at} / vec2({u}.0, {v}.0)'})"


def _bounded(value: str, declared: Parameter) -> str:
    """Returns an expression clamped to a parameter's bounds, which a texture may exceed."""
    low = repr(float(declared.low))
    return f"max({value}, {low})" if declared.high is None else f"clamp({value}, {low}, {float(declared.high)!r})"


def bound_for_shading(plan: ProgramPlan, name: str) -> bool:
    """Returns whether the shading already declares the sampler named after this parameter."""
    return name in {plan.picture_of(textured) for textured in plan.textured}


def _frame(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> Code:
    """`Frame frame(float side)`, which returns the shading frame; side -1 reverses the normal."""
    code = Code().include("surface/frame.glsl", "math/unit.glsl")
    if plan.normal_map:
        _declare_texture(plan, "u_normal_map", code.include("surface/normal_map.glsl"))
        code.uniform("float", "u_normal_scale")
    elif plan.tangents:
        code.include("surface/tangent_frame.glsl")
    if plan.turned or plan.direction_map:
        code.include("surface/turned_frame.glsl")
    if plan.direction_map:
        _declare_texture(plan, "u_direction_map", code.include("surface/direction_map.glsl"))
    if plan.turned:
        code.uniform("vec2", "u_turn")
    if plan.normal_map:
        mapped = _lookup(plan, "u_normal_map", at.uv, plan.normal_span)
        frame = f"mapped_frame({at.normal}, {at.tangent}, side, {mapped}.xyz, u_normal_scale)"
    elif plan.tangents:
        frame = f"tangent_frame({at.normal}, {at.tangent}, side)"
    else:
        normal = f"unit({at.normal})" if plan.normalise else at.normal
        frame = f"Frame(side * {normal}, vec3(0.0), vec3(0.0))"
    if plan.direction_map:
        frame = f"turned_frame({frame}, mapped_direction({_lookup(plan, 'u_direction_map', at.uv)}.rg))"
    if plan.turned:
        frame = f"turned_frame({frame}, u_turn)"
    return code.add(f"\n// A side of -1 reverses the normal.\nFrame frame(float side) {{\n    return {frame};\n}}\n")


def _lights(group: LightGroup) -> Code:
    """Returns the file of a group's type, and the group's uniforms.

    A group with an exact count has one uniform for each field of the lights' struct. A field that no code reads is left out.
    """
    struct = LIGHTS.class_name(group.type)
    code = Code().include(f"light/{group.type}.glsl")
    if group.falloff != "none":
        code.include(f"falloff/{FALLOFFS[group.falloff].name}.glsl")
    if not group.count:
        return code.block(f"{group.key}_page", f"    {struct} u_{group.key}[{PAGE}];\n").uniform("int", f"u_{group.key}_count")
    for name, kind in LIGHTS[group.type].fields().items():
        if name != "r_min" or group.falloff != "none":
            is_one_number = name == "intensity" and group.white
            code.uniform("float" if is_one_number else kind, f"u_{group.key}_{name}", group.count if group.count > 1 else 0)
    return code


def _light(group: LightGroup) -> str:
    """Returns the expression of the struct of the light at index i of a group."""
    if not group.count:
        return f"u_{group.key}[i]"
    index = "" if group.count == 1 else "[i]"
    values = []
    for name in LIGHTS[group.type].fields():
        value = f"u_{group.key}_{name}{index}"
        if name == "r_min" and group.falloff == "none":
            value = "0.0"
        values.append(f"vec3({value})" if name == "intensity" and group.white else value)
    return f"{LIGHTS.class_name(group.type)}({', '.join(values)})"


def _loop(group: LightGroup, occluded: bool) -> str:
    """Returns the lines that add the light of a group to the colour `c`. occluded: whether `o` multiplies ambient light."""
    inner = [f"{LIGHTS.class_name(group.type)} light = {_light(group)};"]
    if group.omnidirectional:
        inner.append(f"c += {'o * ' if occluded else ''}illuminate(light, f.n) * ambient_reflectance(m);")
    else:
        inner += ["vec3 l;", "vec3 e = illuminate(light, p, l);"]
        if group.falloff != "none":
            inner.append(f"e *= falloff_{FALLOFFS[group.falloff].name}(light.position - p, light.r_min);")
        inner.append("c += e * brdf_cos(m, f, l, v);")
    body = "".join(f"        {line}\n" for line in inner)
    head = "" if group.count == 1 else f"for (int i = 0; i < {group.count or f'u_{group.key}_count'}; ++i) "
    return f"    {head}{{\n{body}    }}\n"


def _shading(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> Code:
    """`vec3 radiance(float side)` and everything that it calls: the linear light from the surface toward the viewer."""
    code = at.declarations
    if plan.shows != "light":
        return code.join(_shown(plan, at))
    occluded = plan.occlusion != "unused"
    body = "    float o = occlusion();\n" if occluded else ""
    ambient = "vec3(0.0)"
    if plan.ambient == "constant":
        code.uniform("vec3", "u_ambient_radiance")
        ambient = "u_ambient_radiance"
    elif plan.ambient == "varying":
        code.include("light/ambient.glsl").uniform("vec3", "u_ambient_intensity")
        # This light is the same for every normal.
        ambient = "illuminate(AmbientLight(u_ambient_intensity), vec3(0.0)) * ambient_reflectance(m)"
    if occluded and plan.ambient != "none":
        ambient = f"o * {ambient}"
    if plan.emission != "unused":
        ambient = "emission()" if plan.ambient == "none" else f"emission() + {ambient}"
    if plan.lights or plan.ambient == "varying":
        code.join(_material(plan, at))
        body += f"    {BRDFS.class_name(plan.brdf)} m = material();\n"
    code.join(_emission_and_occlusion(plan, at))
    if not plan.lights:
        # Without any light the surface is drawn black, or shows its emission: it still covers what lies behind it.
        return code.add(f"\nvec3 radiance(float side) {{\n{body}    return {_weighted(plan, ambient, code)};\n}}\n")
    code.join(_frame(plan, at))
    body += "    Frame f = frame(side);\n"
    if plan.directed:
        position = at.position if plan.positions else "vec3(0.0)"
        code.include(f"viewer/{plan.viewer}.glsl", "surface/horizon.glsl")
        body += f"    vec3 p = {position};\n    vec3 v = above_horizon(viewer(p), f.n);\n"
    for group in plan.lights:
        code.join(_lights(group))
    body += f"    vec3 c = {ambient};\n" + "".join(_loop(group, occluded) for group in plan.lights)
    result = _weighted(plan, "c", code)
    return code.add(f"\nvec3 radiance(float side) {{\n{body}    return {result};\n}}\n").join(_faces_viewer(plan, at))


def _weighted(plan: ProgramPlan, light: str, code: Code) -> str:
    """Returns the expression of the light in RGB, and adds the uniform that it reads to the code.

    light: the expression of the light, whose channels are bands of wavelengths if the plan says so.
    """
    if not plan.weighted:
        return light
    code.uniform("mat3", "u_rgb_from_bands")
    return f"u_rgb_from_bands * ({light})"


def _faces_viewer(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> Code:
    """`bool faces_viewer()`, which a flat face that is drawn from both sides needs; no code for other programs."""
    if not plan.sided:
        return Code()
    position = at.position if plan.positions else "vec3(0.0)"
    code = Code().include(f"viewer/{plan.viewer}.glsl")
    return code.add(f"\nbool faces_viewer() {{\n    return dot({at.normal}, viewer({position})) >= 0.0;\n}}\n")


def _shown(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> Code:
    """`vec3 radiance(float side)` for a program that shows a normal, uv or depth in place of light."""
    code = Code()
    if plan.shows == "normal":
        code, value = _frame(plan, at), "frame(side).n"
    elif plan.shows == "uv":
        value = f"vec3({at.uv}, 0.0)"
    else:
        code.uniform("vec3", "u_viewer").uniform("float", "u_number")
        value = f"vec3(-dot(u_viewer, {at.position}), u_number, 0.0)"
    return code.add(f"\nvec3 radiance(float side) {{\n    return {value};\n}}\n").join(_faces_viewer(plan, at))


def _alpha_inputs(plan: ProgramPlan, direction: str) -> Code:
    """Returns the quantities that alpha needs in a per-vertex or per-face program.

    direction: "in" for the inputs of the fragment stage, "out" for the outputs of the vertex stage and `void interpolate()`,
    which sets them.
    """
    names = _wanted_by_alpha(plan)
    if direction == "in":
        return _varyings(plan, names, "in").join(_scale(plan))
    code = Code()
    declared = () if plan.rate == "flat" else _wanted(plan)
    for name in names:
        if name not in declared:
            code.input(TYPES[name], f"a_{name}")
    code.join(_varyings(plan, names, "out")).join(_vertex_scale(plan))
    body = "".join(f"    v_{name} = a_{name};\n" for name in names)
    return code.add(f"\nvoid interpolate() {{\n{body}{_one(plan)}}}\n")


def _alpha(plan: ProgramPlan) -> Code:
    """`float alpha()`, which returns the opacity. With alpha mode "mask" it discards fragments below the cutoff."""
    if plan.alpha == "opaque":
        return Code().add("\nfloat alpha() {\n    return 1.0;\n}\n")
    code, value = Code().uniform("float", "u_alpha"), "u_alpha"
    if plan.alpha_from:
        if plan.rate != "phong" or not bound_for_shading(plan, plan.alpha_from):
            _declare_texture(plan, f"u_{plan.alpha_from}_texture", code)
        value += f" * {_lookup(plan, f'u_{plan.alpha_from}_texture', 'v_uv')}.a"
    if plan.vertex_colours:
        value += f" * {_read(plan, 'v_colour')}.a"
    if plan.alpha == "blend":
        return code.add(f"\nfloat alpha() {{\n    return {value};\n}}\n")
    code.uniform("float", "u_alpha_cutoff")
    return code.add(f"\nfloat alpha() {{\n    if ({value} < u_alpha_cutoff)\n        discard;\n    return 1.0;\n}}\n")
