"""Document: what every part of a scene file is. Frozen pydantic models that report all their faults at once.

pydantic's own messages speak to programmers; these speak to the author of a scene: what is allowed, and the nearest name.
"""

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

# Internal union branches that pydantic puts in the path of an error; the author of a scene never wrote them.
BRANCHES = frozenset({"<value>", "<texture-table>", "<shorthand>", "<table>"})


# What pydantic calls "a valid dictionary or instance of Film", in the words of a scene file.
KINDS = {
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "dict_type": "must be a table",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "string_type": "must be a string",
    "int_from_float": "must be a whole number",
}


def nearest(name: object, names: Iterable[str]) -> str:
    """`; did you mean "x"?` for a slip of the pen, else the names that are allowed."""
    names = sorted(names)
    close = difflib.get_close_matches(str(name), names, n=1)
    return f'; did you mean "{close[0]}"?' if close else "; allowed: " + (", ".join(names) or "none")


def fault(message: str) -> PydanticCustomError:
    """An error with exactly this message: without a context, pydantic leaves braces alone."""
    return PydanticCustomError("scene", message)


def shown(value: object) -> str:
    """`, not 3`, unless it would drown the message."""
    text = repr(value)
    return "" if len(text) > 40 else f", not {text}"


def _speak(error: Any, fields: Iterable[str]) -> str:
    kind, context = error["type"], error.get("ctx", {})
    given = error["input"]
    if kind == "extra_forbidden":
        return "unknown key" + nearest(error["loc"][-1], fields)
    if kind == "missing":
        return "is missing: the list is too short" if isinstance(error["loc"][-1], int) else "is required"
    if kind == "too_long":
        return f"must be a list of {context['max_length']}, not of {context['actual_length']}"
    if kind == "literal_error":
        return f"{given!r} is not one of {context['expected']}"
    if kind == "finite_number":
        return f"{given!r} is not a finite number"
    if kind in {"value_error", "assertion_error"}:
        return str(context.get("error", error["msg"]))
    if kind == "scene":
        return str(error["msg"])
    message = KINDS.get(kind) or str(error["msg"]).replace("Input should be", "must be")
    return message + shown(given)


class Document(BaseModel):
    """A table of the scene file: unknown keys are faults, values are frozen, numbers are finite."""

    # A validator is built when its model is first met: a scene meets few of them, and start-up time is a feature.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True, defer_build=True)

    @field_validator("*", mode="before")
    @classmethod
    def _as_written(cls, value: Any, info: ValidationInfo) -> Any:
        """A number is written as a number, and a truth value as true or false."""
        wanted = cls.model_fields[info.field_name].annotation if info.field_name in cls.model_fields else None
        if wanted is bool and not isinstance(value, bool):
            raise fault("must be true or false" + shown(value))
        return number(value) if wanted in (int, float) else value

    @model_validator(mode="wrap")
    @classmethod
    def _every_fault(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        faults: list[InitErrorDetails] = []
        document = None
        try:
            document = handler(data)
        except ValidationError as error:
            names = [field.alias or name for name, field in cls.model_fields.items()]
            for detail in error.errors(include_url=False):
                place = tuple(part for part in detail["loc"] if part not in BRANCHES)
                faults.append(InitErrorDetails(type=fault(_speak(detail, names)), loc=place, input=detail["input"]))
        for loc, message in cls.cross_faults(data):
            faults.append(InitErrorDetails(type=fault(message), loc=loc, input=data))
        if faults:
            raise ValidationError.from_exception_data(cls.__name__, faults)
        return document

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        """Faults between keys, as (place, message); looked for even where single keys are at fault."""
        return ()


class Chosen:
    """Annotates a field whose model is chosen by one key: `brdf = "phong"`, `type = "spot"`.

    `models` maps names to classes and may load them on demand. A bare string stands for the model with its defaults
    where `shorthand` is set.
    """

    def __init__(
        self, models: Mapping[str, type[Document]], key: str, default: str | None = None, shorthand: bool = False
    ) -> None:
        self.models, self.key, self.default, self.shorthand = models, key, default, shorthand

    def _choose(self, data: Any, info: core_schema.ValidationInfo) -> Document:
        if isinstance(data, Document):
            return data
        if self.shorthand and isinstance(data, str):
            data = {self.key: data}
        if not isinstance(data, Mapping):
            raise fault(f"must be a table with the key {self.key!r}" + shown(data))
        name = data.get(self.key, self.default)
        if name is None:
            raise fault(f"lacks the key {self.key!r}" + nearest("", self.models))
        if not isinstance(name, str) or name not in self.models:
            unknown = fault(f"unknown {self.key} {name!r}" + nearest(name, self.models))
            place = InitErrorDetails(type=unknown, loc=(self.key,), input=name)
            raise ValidationError.from_exception_data(self.key, [place])
        return self.models[name].model_validate({**data, self.key: name}, context=info.context)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.with_info_plain_validator_function(
            self._choose,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda document: document.model_dump(mode="json"), when_used="json"
            ),
        )

    def __get_pydantic_json_schema__(self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        choices = [handler(model.__pydantic_core_schema__) for model in self.models.values()]
        for name, choice in zip(self.models, choices, strict=True):
            if name != self.default:
                # A definition is shared, and takes the requirement with it; the key is what tells the choices apart.
                table = handler.resolve_ref_schema(choice)
                table["required"] = sorted({*table.get("required", ()), self.key})
        if self.shorthand:
            choices.append({"enum": list(self.models)})
        return {"anyOf": choices}


def number(value: Any) -> Any:
    """Refuses what pydantic would turn into a number: "3", true."""
    if isinstance(value, str | bool):
        raise fault("must be a number" + shown(value))
    return value


def _triple(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value,) * 3
    if isinstance(value, str | bool | Mapping) or not hasattr(value, "__len__") or len(value) != 3:
        raise fault("must be three numbers, or one that stands for three" + shown(value))
    return tuple(value)


def resolved(path: Path, info: ValidationInfo) -> Path:
    """The path, from the folder of the scene file; refuses what is no file."""
    folder = (info.context or {}).get("folder")
    path = path.expanduser()
    path = path if path.is_absolute() or folder is None else Path(folder) / path
    if not path.exists():
        raise fault(f"{path} does not exist")
    if path.is_dir():
        raise fault(f"{path} is a folder, not a file")
    return path


Finite = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(number)]
Vector3 = tuple[Finite, Finite, Finite]
_NUMBER = {"type": "number"}
# One number stands for three equal ones.
Triple = Annotated[
    Vector3,
    BeforeValidator(_triple),
    WithJsonSchema({"anyOf": [_NUMBER, {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}]}),
]
# A file that exists; relative paths start at the folder of the scene file.
File = Annotated[Path, AfterValidator(resolved)]


def non_zero(value: Vector3) -> Vector3:
    """Refuses the zero vector, which has no direction."""
    if not any(value):
        raise fault("must not be the zero vector: it has no direction")
    return value


Direction = Annotated[Vector3, AfterValidator(non_zero)]
