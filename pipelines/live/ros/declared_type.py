"""Message types that ROS has no package of, declared from their definitions.

The descriptions are those that the middleware asks for. Messages of a declared type are sent and received
serialized, so nothing here ever converts one. The structures are those of ROS 2 Jazzy, the only distribution
on PyPI.
"""

import ctypes
from ctypes import CFUNCTYPE, POINTER, Structure, addressof, c_bool, c_char_p, c_size_t, c_void_p, cast
from hashlib import sha256
from json import dumps
from typing import Any

from racecar.maps.errors import UserError

INT32, UINT32, FLOAT32, FLOAT64, STRING = 6, 7, 10, 11, 17
NESTED, NESTED_SEQUENCE = 1, 145
"""Kinds of fields, as type_description_interfaces/FieldType has them."""
Fields = dict[str, list[tuple[str, int, str]]]
"""By the name of a type, each field's name, kind and, where it is nested, type: first those that the declared
type is made of, by the alphabet, and at last itself."""

_INTROSPECTED = {FLOAT32: 1, NESTED: 18, NESTED_SEQUENCE: 18}
"""The kinds of fields that are described to the middleware, by its own numbers."""
_NAMES = "rosidl_typesupport_introspection_c"
_MESSAGE_BYTES = 256
"""No message of a declared type is ever held in memory; as much as any would take."""

_forever: list[Any] = []
"""What C code goes on pointing to."""

_Dispatch = CFUNCTYPE(c_void_p, c_void_p, c_char_p)
_Answer = CFUNCTYPE(c_void_p, c_void_p)
_Refuse = CFUNCTYPE(c_bool, c_void_p, c_void_p)
_Size = CFUNCTYPE(ctypes.c_uint32, c_void_p)
_LargestSize = CFUNCTYPE(c_size_t, POINTER(ctypes.c_uint8))


class _Hash(Structure):
    _fields_ = [("version", ctypes.c_uint8), ("value", ctypes.c_uint8 * 32)]


class _Sequence(Structure):
    _fields_ = [("data", c_void_p), ("size", c_size_t), ("capacity", c_size_t)]


class _TypeSupport(Structure):
    _fields_ = [
        ("identifier", c_char_p),
        ("data", c_void_p),
        ("dispatch", _Dispatch),
        ("hash", _Answer),
        ("description", _Answer),
        ("sources", _Answer),
    ]


class _Serialization(Structure):
    _fields_ = [
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("serialize", _Refuse),
        ("deserialize", _Refuse),
        ("size", _Size),
        ("largest_size", _LargestSize),
        ("key", c_void_p),
    ]


class _Member(Structure):
    _fields_ = [
        ("name", c_char_p),
        ("type_id", ctypes.c_uint8),
        ("string_upper_bound", c_size_t),
        ("members", c_void_p),
        ("is_key", c_bool),
        ("is_array", c_bool),
        ("array_size", c_size_t),
        ("is_upper_bound", c_bool),
        ("offset", ctypes.c_uint32),
        ("default", c_void_p),
        ("functions", c_void_p * 6),
    ]


class _Members(Structure):
    _fields_ = [
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("count", ctypes.c_uint32),
        ("size_of", c_size_t),
        ("has_key", c_bool),
        ("members", POINTER(_Member)),
        ("initialize", c_void_p),
        ("finalize", c_void_p),
    ]


def declare_type(fields: Fields) -> Any:
    """The class to name when publishing or subscribing; hand it serialized messages only.

    Raises UserError where ROS is not the one whose structures these are.
    """
    kind = _name(fields).rpartition("/")[2]
    try:
        support = _type_support(fields)
    except (OSError, AttributeError, ImportError) as error:
        raise UserError(f"This ROS has no {_name(fields)}, and it cannot be declared.") from error
    new_capsule = ctypes.pythonapi.PyCapsule_New
    new_capsule.restype, new_capsule.argtypes = ctypes.py_object, [c_void_p, c_char_p, c_void_p]
    capsule = new_capsule(addressof(support), None, None)
    kept = {"_TYPE_SUPPORT": capsule, "_kept_alive": support}
    unused = dict.fromkeys(
        ("_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE"), capsule
    )
    metaclass = type(f"Metaclass_{kind}", (type,), {**kept, **unused})
    return metaclass(kind, (), {})


def type_hash(fields: Fields) -> str:
    """By which ROS distinguishes types of the same name."""
    return sha256(dumps(_description(fields)).encode()).hexdigest()


def _name(fields: Fields) -> str:
    return list(fields)[-1]


def _description(fields: Fields) -> dict[str, Any]:
    structures = [
        {
            "type_name": name,
            "fields": [
                {
                    "name": field,
                    "type": {
                        "type_id": type_id,
                        "capacity": 0,
                        "string_capacity": 0,
                        "nested_type_name": nested,
                    },
                }
                for field, type_id, nested in members
            ],
        }
        for name, members in fields.items()
    ]
    return {"type_description": structures[-1], "referenced_type_descriptions": structures[:-1]}


def _type_support(fields: Fields) -> _TypeSupport:
    hash_ = _Hash(1, (ctypes.c_uint8 * 32)(*bytes.fromhex(type_hash(fields))))
    description, no_sources = _description_message(fields), _Sequence()
    answers = (
        _Answer(lambda _: addressof(hash_)),
        _Answer(lambda _: description),
        _Answer(lambda _: addressof(no_sources)),
    )
    own = {
        b"rosidl_typesupport_fastrtps_c": _serialization(_name(fields)),
        _NAMES.encode(): _members(fields, _name(fields)),
    }
    supports: dict[bytes, _TypeSupport] = {}
    dispatch = _Dispatch(
        lambda _, identifier: addressof(supports[identifier]) if identifier in supports else None
    )
    for identifier, structure in own.items():
        supports[identifier] = _TypeSupport(
            identifier, cast(ctypes.pointer(structure), c_void_p), dispatch, *answers
        )
    support = _TypeSupport(b"rosidl_typesupport_c", None, dispatch, *answers)
    support.kept_alive = (hash_, no_sources, answers, own, supports, dispatch)
    return support


def _serialization(name: str) -> _Serialization:
    """Refuses to convert a message, which raw publishers and subscriptions never ask for."""

    def is_unbounded(bounds: Any) -> int:
        bounds[0] = 0
        return 0

    package, _, kind = name.split("/")
    refuse = _Refuse(lambda _message, _stream: False)
    return _Serialization(
        package.encode() + b"::msg",
        kind.encode(),
        refuse,
        refuse,
        _Size(lambda _: 0),
        _LargestSize(is_unbounded),
        None,
    )


def _members(fields: Fields, name: str) -> _Members:
    package, _, kind = name.split("/")
    members = (_Member * len(fields[name]))(*(_member(fields, *field) for field in fields[name]))
    structure = _Members(
        package.encode() + b"__msg", kind.encode(), len(members), _MESSAGE_BYTES, False, members, None, None
    )
    structure.kept_alive = members
    return structure


def _member(fields: Fields, name: str, kind: int, nested: str) -> _Member:
    support = _introspection(fields, nested) if nested else None
    return _Member(
        name=name.encode(), type_id=_INTROSPECTED[kind], members=support, is_array=kind == NESTED_SEQUENCE
    )


def _introspection(fields: Fields, name: str) -> int:
    """The address of a nested type's own description: that of its package, where ROS has it."""
    package, _, kind = name.split("/")
    try:
        library = ctypes.CDLL(f"lib{package}__{_NAMES}.so")
    except OSError:
        return _declared_introspection(fields, name)
    handle = library[f"{_NAMES}__get_message_type_support_handle__{package}__msg__{kind}"]
    handle.restype = c_void_p
    address: int = handle()
    return address


def _declared_introspection(fields: Fields, name: str) -> int:
    """It lives as long as the process, like those of packages."""
    members = _members(fields, name)
    itself: list[int] = []
    dispatch = _Dispatch(lambda _, identifier: itself[0] if identifier == _NAMES.encode() else None)
    support = _TypeSupport(_NAMES.encode(), cast(ctypes.pointer(members), c_void_p), dispatch)
    itself.append(addressof(support))
    _forever.append((members, dispatch, support))
    return addressof(support)


def _description_message(fields: Fields) -> int:
    """Address of the description as ROS keeps it; it lives as long as the process."""
    from type_description_interfaces.msg import Field, FieldType, IndividualTypeDescription, TypeDescription

    def structure(described: dict[str, Any]) -> Any:
        fields = [Field(name=field["name"], type=FieldType(**field["type"])) for field in described["fields"]]
        return IndividualTypeDescription(type_name=described["type_name"], fields=fields)

    described = _description(fields)
    message = TypeDescription(
        type_description=structure(described["type_description"]),
        referenced_type_descriptions=[structure(each) for each in described["referenced_type_descriptions"]],
    )
    kind = type(TypeDescription)
    kind.__import_type_support__()
    new = _function(kind._CREATE_ROS_MESSAGE, ctypes.PYFUNCTYPE(c_void_p))
    convert = _function(kind._CONVERT_FROM_PY, ctypes.PYFUNCTYPE(c_bool, ctypes.py_object, c_void_p))
    address: int = new()
    convert(message, address)
    return address


def _function(capsule: Any, prototype: Any) -> Any:
    pointer_in = ctypes.pythonapi.PyCapsule_GetPointer
    pointer_in.restype, pointer_in.argtypes = c_void_p, [ctypes.py_object, c_char_p]
    return prototype(pointer_in(capsule, None))
