"""Message types without a ROS package, declared from the definitions in the type store for bags.

The descriptions are those that the middleware requires. Messages of a declared type are sent and received
serialized, so nothing here ever converts one. The structures are those of ROS 2 Jazzy, the only distribution
on PyPI.
"""

import ctypes
from collections.abc import Iterator
from ctypes import CFUNCTYPE, POINTER, Structure, addressof, c_bool, c_char_p, c_size_t, c_void_p, cast
from typing import Any, NamedTuple

from rosbags.interfaces import Nodetype

from racecar.pipelines.bags.messages import ros2_types

_NESTED, _NESTED_SEQUENCE = 1, 145
_KINDS = {"int32": 6, "uint32": 7, "float32": 10, "float64": 11, "bool": 15, "string": 17}
"""Field types as numbered in type_description_interfaces/FieldType."""
_INTROSPECTED = {
    _KINDS["float32"]: 1,
    _KINDS["float64"]: 2,
    _KINDS["bool"]: 6,
    _KINDS["string"]: 16,
    _NESTED: 18,
    _NESTED_SEQUENCE: 18,
}
"""The field types that are described to the middleware, and its own numbers for them."""
_NAMES = "rosidl_typesupport_introspection_c"
_MESSAGE_BYTES = 256
"""An upper bound: no message of a declared type is ever held in memory."""

_forever: list[Any] = []
"""Objects that C code keeps pointing to."""

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


class _Field(NamedTuple):
    name: str
    kind: int
    nested: str
    """Name of its type, if it is nested."""


def declare_type(name: str) -> Any:
    """The class of a type in the type store for bags, for publishers and subscriptions of serialized messages
    only.

    Raises OSError, AttributeError or ImportError if the structures are not those of this ROS.
    """
    kind, support = name.rpartition("/")[2], _type_support(name)
    new_capsule = ctypes.pythonapi.PyCapsule_New
    new_capsule.restype, new_capsule.argtypes = ctypes.py_object, [c_void_p, c_char_p, c_void_p]
    capsule = new_capsule(addressof(support), None, None)
    kept = {"_TYPE_SUPPORT": capsule, "_kept_alive": support}
    unused = dict.fromkeys(
        ("_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE"), capsule
    )
    metaclass = type(f"Metaclass_{kind}", (type,), {**kept, **unused})
    return metaclass(kind, (), {})


def _fields(name: str) -> Iterator[_Field]:
    for field, (shape, what) in ros2_types().fielddefs[name][1]:
        is_sequence = shape == Nodetype.SEQUENCE
        inner: Any = what[0] if is_sequence else (shape, what)
        if inner[0] == Nodetype.NAME:
            yield _Field(field, _NESTED_SEQUENCE if is_sequence else _NESTED, inner[1])
        else:
            yield _Field(field, _KINDS[inner[1][0]], "")


def _nested_in(name: str) -> set[str]:
    """All types that a type consists of."""
    nested = {field.nested for field in _fields(name) if field.nested}
    return nested.union(*map(_nested_in, nested))


def _type_support(name: str) -> _TypeSupport:
    digest = bytes.fromhex(ros2_types().hash_rihs01(name).removeprefix("RIHS01_"))
    hash_ = _Hash(1, (ctypes.c_uint8 * 32)(*digest))
    description, no_sources = _description_message(name), _Sequence()
    answers = (
        _Answer(lambda _: addressof(hash_)),
        _Answer(lambda _: description),
        _Answer(lambda _: addressof(no_sources)),
    )
    own = {
        b"rosidl_typesupport_fastrtps_c": _serialization(name),
        _NAMES.encode(): _members(name),
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
    """Refuses to convert a message, which raw publishers and subscriptions never request."""

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


def _members(name: str) -> _Members:
    package, _, kind = name.split("/")
    fields = [_member(field) for field in _fields(name)]
    members = (_Member * len(fields))(*fields)
    structure = _Members(
        package.encode() + b"__msg", kind.encode(), len(members), _MESSAGE_BYTES, False, members, None, None
    )
    structure.kept_alive = members
    return structure


def _member(field: _Field) -> _Member:
    return _Member(
        name=field.name.encode(),
        type_id=_INTROSPECTED[field.kind],
        members=_introspection(field.nested) if field.nested else None,
        is_array=field.kind == _NESTED_SEQUENCE,
    )


def _introspection(name: str) -> int:
    """Address of a nested type's own description: its package's, if ROS has it."""
    package, _, kind = name.split("/")
    try:
        library = ctypes.CDLL(f"lib{package}__{_NAMES}.so")
    except OSError:
        return _declared_introspection(name)
    handle = library[f"{_NAMES}__get_message_type_support_handle__{package}__msg__{kind}"]
    handle.restype = c_void_p
    address: int = handle()
    return address


def _declared_introspection(name: str) -> int:
    """The same for a declared type; it lives as long as the process, like those of packages."""
    members = _members(name)
    itself: list[int] = []
    dispatch = _Dispatch(lambda _, identifier: itself[0] if identifier == _NAMES.encode() else None)
    support = _TypeSupport(_NAMES.encode(), cast(ctypes.pointer(members), c_void_p), dispatch)
    itself.append(addressof(support))
    _forever.append((members, dispatch, support))
    return addressof(support)


def _description_message(name: str) -> int:
    """Address of the description in ROS's format; it lives as long as the process."""
    from type_description_interfaces.msg import Field, FieldType, IndividualTypeDescription, TypeDescription

    def described(name: str) -> Any:
        fields = [
            Field(name=field.name, type=FieldType(type_id=field.kind, nested_type_name=field.nested))
            for field in _fields(name)
        ]
        return IndividualTypeDescription(type_name=name, fields=fields)

    message = TypeDescription(
        type_description=described(name),
        referenced_type_descriptions=[described(nested) for nested in sorted(_nested_in(name))],
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
