"""The message type of ``/tf``, also where ROS came from PyPI, which has no package of it.

A car's ROS brings ``tf2_msgs``; then that is used. Otherwise the type is declared here from its one-line
definition, ``geometry_msgs/TransformStamped[] transforms``, with the descriptions that the middleware asks
for. Messages of the declared type are sent and received serialized, so nothing here ever converts one.
The structures are those of ROS 2 Jazzy, the only distribution on PyPI.
"""

import ctypes
from ctypes import CFUNCTYPE, POINTER, Structure, addressof, c_bool, c_char_p, c_size_t, c_void_p, cast
from functools import cache
from hashlib import sha256
from json import dumps
from typing import Any

from racecar.maps.errors import UserError

NAME = "tf2_msgs/msg/TFMessage"
_NESTED, _INT32, _UINT32, _FLOAT64, _STRING, _NESTED_SEQUENCE = 1, 6, 7, 11, 17, 145
_QUATERNION, _VECTOR = "geometry_msgs/msg/Quaternion", "geometry_msgs/msg/Vector3"
_FIELDS: dict[str, list[tuple[str, int, str]]] = {
    "builtin_interfaces/msg/Time": [("sec", _INT32, ""), ("nanosec", _UINT32, "")],
    _QUATERNION: [(axis, _FLOAT64, "") for axis in "xyzw"],
    "geometry_msgs/msg/Transform": [
        ("translation", _NESTED, _VECTOR),
        ("rotation", _NESTED, _QUATERNION),
    ],
    "geometry_msgs/msg/TransformStamped": [
        ("header", _NESTED, "std_msgs/msg/Header"),
        ("child_frame_id", _STRING, ""),
        ("transform", _NESTED, "geometry_msgs/msg/Transform"),
    ],
    _VECTOR: [(axis, _FLOAT64, "") for axis in "xyz"],
    "std_msgs/msg/Header": [("stamp", _NESTED, "builtin_interfaces/msg/Time"), ("frame_id", _STRING, "")],
    NAME: [("transforms", _NESTED_SEQUENCE, "geometry_msgs/msg/TransformStamped")],
}
_ROS_TYPE_MESSAGE = 18
_SEQUENCE_BYTES = 24

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


@cache
def transform_message_type() -> Any:
    """The class to name when publishing or subscribing; hand it serialized messages only.

    Raises UserError where there is neither ``tf2_msgs`` nor the ROS from which it can be declared.
    """
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return _declare()
    return TFMessage


def _declare() -> Any:
    try:
        support = _type_support()
    except (OSError, AttributeError, ImportError) as error:
        raise UserError(
            "This ROS has no package tf2_msgs, so transforms cannot be published; install it (with apt: "
            "ros-<distribution>-tf2-msgs), or set the parameter tf to none."
        ) from error
    new_capsule = ctypes.pythonapi.PyCapsule_New
    new_capsule.restype, new_capsule.argtypes = ctypes.py_object, [c_void_p, c_char_p, c_void_p]
    capsule = new_capsule(addressof(support), None, None)
    kept = {"_TYPE_SUPPORT": capsule, "_kept_alive": support}
    unused = dict.fromkeys(
        ("_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE"), capsule
    )
    metaclass = type("Metaclass_TFMessage", (type,), {**kept, **unused})
    return metaclass("TFMessage", (), {})


def type_hash() -> str:
    """By which ROS distinguishes types of the same name."""
    return sha256(dumps(_description()).encode()).hexdigest()


def _description() -> dict[str, Any]:
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
                for field, type_id, nested in fields
            ],
        }
        for name, fields in _FIELDS.items()
    ]
    return {"type_description": structures[-1], "referenced_type_descriptions": structures[:-1]}


def _type_support() -> _TypeSupport:
    hash_ = _Hash(1, (ctypes.c_uint8 * 32)(*bytes.fromhex(type_hash())))
    description, no_sources = _description_message(), _Sequence()
    answers = (
        _Answer(lambda _: addressof(hash_)),
        _Answer(lambda _: description),
        _Answer(lambda _: addressof(no_sources)),
    )
    own = {
        b"rosidl_typesupport_fastrtps_c": _serialization(),
        b"rosidl_typesupport_introspection_c": _members(),
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


def _serialization() -> _Serialization:
    """Refuses to convert a message, which raw publishers and subscriptions never ask for."""

    def is_unbounded(bounds: Any) -> int:
        bounds[0] = 0
        return 0

    refuse = _Refuse(lambda _message, _stream: False)
    return _Serialization(
        b"tf2_msgs::msg", b"TFMessage", refuse, refuse, _Size(lambda _: 0), _LargestSize(is_unbounded), None
    )


def _members() -> _Members:
    library = ctypes.CDLL("libgeometry_msgs__rosidl_typesupport_introspection_c.so")
    handle_of = "rosidl_typesupport_introspection_c__get_message_type_support_handle__"
    stamped = library[f"{handle_of}geometry_msgs__msg__TransformStamped"]
    stamped.restype = c_void_p
    member = _Member(name=b"transforms", type_id=_ROS_TYPE_MESSAGE, members=stamped(), is_array=True)
    return _Members(
        b"tf2_msgs__msg", b"TFMessage", 1, _SEQUENCE_BYTES, False, ctypes.pointer(member), None, None
    )


def _description_message() -> int:
    """Address of the description as ROS keeps it; it lives as long as the process."""
    from type_description_interfaces.msg import Field, FieldType, IndividualTypeDescription, TypeDescription

    def structure(described: dict[str, Any]) -> Any:
        fields = [Field(name=field["name"], type=FieldType(**field["type"])) for field in described["fields"]]
        return IndividualTypeDescription(type_name=described["type_name"], fields=fields)

    described = _description()
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
