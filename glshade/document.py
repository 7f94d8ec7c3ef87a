"""Document: the base class of every table of a scene file, a frozen pydantic model that reports all its faults at once.

pydantic's own messages are written for programmers. The messages here are written for the author of a scene: they say which
values are allowed, and name the key or value with the most similar spelling.
"""

import difflib
from collections.abc import Iterable, Mapping
from functools import partial
from itertools import islice
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

from glshade.files import check_regular
from glshade.limits import MOST_FAULTS

# pydantic puts these names of union branches in the path of an error. They are removed, since the author never wrote them.
BRANCHES = frozenset({"<value>", "<texture-table>", "<spectrum-table>", "<shorthand>", "<table>"})

# pydantic's error type -> the message, in the words of a scene file. pydantic itself would ask for "a valid dictionary".
KINDS = {
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "dict_type": "must be a table",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "string_type": "must be a string",
    "path_type": "must be the path of a file",
    "int_from_float": "must be a whole number",
}


# The length of a name that is compared with others, and the number of names that it is compared with. A comparison takes time
# that grows with the product of the two lengths.
LONGEST_NAME, COMPARED = 100, 1000
# The number of names that a message lists.
MOST_NAMES = 100


def nearest(name: object, names: Iterable[str]) -> str:
    """Returns the end of a message: `; did you mean "x"?` where a name is spelled similarly, else the list of names."""
    names = sorted(names)
    short = [known for known in names[:COMPARED] if len(known) <= LONGEST_NAME]
    close = difflib.get_close_matches(name, short, n=1) if isinstance(name, str) and len(name) <= LONGEST_NAME else []
    if close:
        return f'; did you mean "{close[0]}"?'
    listed = short[:MOST_NAMES]
    return "; allowed: " + (", ".join(listed) or "none") + (", ..." if len(listed) < len(names) else "")


def fault(message: str) -> PydanticCustomError:
    """Returns a pydantic error with exactly this message."""
    # pydantic formats a message that has a context. Without one it leaves the braces in the message alone.
    return PydanticCustomError("scene", message)


def received(value: object) -> str:
    """Returns the end of a message, such as `, not 3`; empty if the value is too long to be worth reading."""
    text = written(value)
    return "" if len(text) > 40 else f", not {text}"


def shortened(value: object) -> str:
    """Returns the value as Python writes it, cut to 40 characters so that the message stays readable."""
    text = written(value)
    return text if len(text) <= 40 else f"{text[:36]} ..."


def written(value: object) -> str:
    """Returns the value as Python writes it, for a message."""
    try:
        return repr(value)
    except ValueError:  # Python refuses to write a whole number of more than 4300 digits
        return "a number of thousands of digits"


def _message(error: Any, fields: Iterable[str]) -> str:
    """Returns our message for one of pydantic's error details. fields: the keys that the table may have."""
    kind, context = error["type"], error.get("ctx", {})
    given = error["input"]
    if kind == "extra_forbidden":
        return "unknown key" + nearest(error["loc"][-1], fields)
    if kind == "missing":
        return "is missing: the list is too short" if isinstance(error["loc"][-1], int) else "is required"
    if kind == "too_long":
        return f"must be a list of {context['max_length']}, not of {context['actual_length']}"
    if kind == "literal_error":
        return f"{shortened(given)} is not one of {context['expected']}"
    if kind == "finite_number":
        return f"{shortened(given)} is not a finite number"
    if kind in {"value_error", "assertion_error"}:
        return str(context.get("error", error["msg"]))
    if kind == "scene":
        return str(error["msg"])
    message = KINDS.get(kind) or str(error["msg"]).replace("Input should be", "must be")
    return message + received(given)


class Document(BaseModel):
    """A table of the scene file. Unknown keys are faults, values cannot be changed, and numbers have to be finite.

    Errors: ValidationError with every fault, when it is made.
    """

    # defer_build: a model's validator is built when it is first used. A scene uses few models, so this saves start-up time.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True, defer_build=True)

    @field_validator("*", mode="before")
    @classmethod
    def _as_written(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuses values that pydantic would convert: a string or a truth value for a number, a number for a truth value."""
        wanted = cls.model_fields[info.field_name].annotation if info.field_name in cls.model_fields else None
        if wanted is bool and not isinstance(value, bool):
            raise fault("must be true or false" + received(value))
        return number(value) if wanted in (int, float) else value

    @model_validator(mode="wrap")
    @classmethod
    def _every_fault(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        """Returns the validated document. Errors: ValidationError with the faults of single keys and those between keys."""
        faults: list[InitErrorDetails] = []
        mistyped: set[str | int] = set()
        document = None
        try:
            document = handler(data)
        except ValidationError as error:
            names = [field.alias or name for name, field in cls.model_fields.items()]
            for detail in error.errors(include_url=False):
                place = tuple(part for part in detail["loc"] if part not in BRANCHES)
                faults.append(InitErrorDetails(type=fault(_message(detail, names)), loc=place, input=detail["input"]))
                if len(place) == 1 and detail["type"].endswith("_type"):
                    mistyped.add(place[0])
        if mistyped:
            data = {key: value for key, value in data.items() if key not in mistyped}
        for loc, message in islice(cls.cross_faults(data), MOST_FAULTS):
            faults.append(InitErrorDetails(type=fault(message), loc=loc, input=data))
        if faults:
            raise ValidationError.from_exception_data(cls.__name__, faults)
        return document

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        """Returns the faults that concern several keys together, as pairs (key path, message).

        They are looked for even where single keys have faults, so the values in `data` are not validated yet. A key whose value
        has the wrong type is left out; a list or table of the right type may have faults inside.
        """
        return ()


class AsIs:
    """Annotates a type whose values are taken as they are, like pydantic's SkipValidation.

    pydantic's own first reads the fields of a type that is a dataclass, which takes 5 ms for a mesh at the start of a command.
    """

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.any_schema()


class Chosen:
    """Annotates a field whose class is chosen by one key of its table: `brdf = "phong"`, `type = "spot"`.

    models: a table from names to classes, which may import a class when it is asked for.
    key: the key that holds the name.
    default: the name where the key is left out; None: the key is required.
    shorthand: a bare string may stand for the class of that name with all its defaults.
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
            raise fault(f"must be a table with the key {self.key!r}" + received(data))
        name = data.get(self.key, self.default)
        if name is None:
            raise fault(f"lacks the key {self.key!r}" + nearest("", self.models))
        if not isinstance(name, str) or name not in self.models:
            unknown = fault(f"unknown {self.key} {shortened(name)}" + nearest(name, self.models))
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
                # The key tells the choices apart, so it has to be given. All uses of a model share this definition.
                table = handler.resolve_ref_schema(choice)
                table["required"] = sorted({*table.get("required", ()), self.key})
        if self.shorthand:
            choices.append({"enum": list(self.models)})
        return {"anyOf": choices}


class Shorthand:
    """Annotates a table in whose place the file may have a string or a path: the value of one of its keys.

    key: the key.
    """

    def __init__(self, key: str) -> None:
        self.key = key

    def _table(self, data: Any) -> Any:
        return {self.key: data} if isinstance(data, str | Path) else data

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(self._table, handler(source))

    def __get_pydantic_json_schema__(self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, handler(schema)]}


def number(value: Any) -> Any:
    """Returns the value; refuses strings and truth values, which pydantic would convert into numbers."""
    if isinstance(value, str | bool):
        raise fault("must be a number" + received(value))
    return value


def _triple(value: Any) -> Any:
    """Returns three values; a single number is repeated."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value,) * 3
    if isinstance(value, str | bool | Mapping) or not hasattr(value, "__len__") or len(value) != 3:
        raise fault("must be three numbers, or one that stands for three" + received(value))
    return tuple(value)


def resolved(path: Path, info: ValidationInfo, folders: bool = False) -> Path:
    """Returns the path of a file, taken relative to the folder of the scene file; refuses a path where there is no file.

    folders: whether the path may also be that of a folder.
    """
    folder = (info.context or {}).get("folder")
    try:
        path = path.expanduser()
        path = path if path.is_absolute() or folder is None else Path(folder) / path
        if not (folders and path.is_dir()):
            check_regular(path)
    except (FileNotFoundError, NotADirectoryError):
        raise fault(f"{path} does not exist") from None
    except IsADirectoryError:
        raise fault(f"{path} is a folder, not a file") from None
    except OSError as error:
        raise fault(f"{path} cannot be read: {error.strerror}") from None
    except (RuntimeError, ValueError) as error:  # an unknown home folder, or a name that no file can have
        raise fault(f"{path} is no name of a file: {error}") from None
    return path


Finite = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(number)]
Vector3 = tuple[Finite, Finite, Finite]
_NUMBER = {"type": "number"}
# Three numbers; the scene file may give one number in place of three equal ones.
Triple = Annotated[
    Vector3,
    BeforeValidator(_triple),
    WithJsonSchema({"anyOf": [_NUMBER, {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}]}),
]
# The path of a file that exists; a relative path starts at the folder of the scene file.
File = Annotated[Path, AfterValidator(resolved)]
FileOrFolder = Annotated[Path, AfterValidator(partial(resolved, folders=True))]


def non_zero(value: Vector3) -> Vector3:
    """Returns the vector; refuses the zero vector, which has no direction."""
    if not any(value):
        raise fault("must not be the zero vector: it has no direction")
    return value


Direction = Annotated[Vector3, AfterValidator(non_zero)]


def value_of(item: Any, key: str) -> Any:
    """Returns the value that a table or a Document has for a key; None if it has no such key."""
    return item.get(key) if isinstance(item, Mapping) else getattr(item, key, None)
