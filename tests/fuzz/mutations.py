"""Ways to damage an input: bytes at random, and values that its format allows but nobody expects."""

import dataclasses
import io
import json
import random
import struct
import warnings
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

ODD_FLOATS = (
    0.0, -0.0, 1.0, -1.0, 1e-300, 1e-40, 0.1, 3.2, 60.0, 1e3, 1e6, 1e9, 1e38, 3.4e38, 1e300, -1e300, 1.7e308,
    float("inf"), float("-inf"), float("nan"),
)  # fmt: skip
ODD_INTEGERS = (
    0, 1, 2, 3, 7, 12, 100, 127, 128, 255, 256, 1000, 32767, 65535, 10**6, 10**9, 2**31 - 1, 2**31, 2**32 - 1,
    2**40, 2**53, 2**62, 2**63 - 1, 2**64 - 1, -1, -2, -(2**31), -(2**63),
)  # fmt: skip
ODD_STRINGS = (
    "",
    "/",
    "//",
    "a/b",
    "base_link",
    "laser",
    "odom",
    "\0",
    "ü" * 40,
    "x" * 70000,
    "%s{}",
    "\ud7ff\n",
)
ODD_TOKENS = (
    "", "0", "-1", "1e999", "-1e999", "1e999999999", "nan", ".nan", ".inf", "inf", "null", "~", "true",
    "[]", "{}", "[1, 2]", "{a: b}", "&a [*a]", "*a", "!!python/object:os.system x", "!!binary aaaa",
    "!!timestamp 2000-13-40", "2001-12-14", "1:30:00", "0x7fffffffffffffff", "9" * 30, "1_000", "'", '"',
    "\0", "\x80", "é", "[" * 3000, "{" * 3000, "- " * 2000, "? ", ": ", "<<: *a", "%YAML 9.9", "---", "...",
    "a: &a [x, x]\nb: &b [*a, *a, *a, *a]\nc: [*b, *b, *b, *b]", "\t", "#", "../../../etc/passwd",
    "/dev/zero", "/dev/stdin", ".", "x" * 5000,
)  # fmt: skip

ODD_JSON = (
    "null", "true", "0", "-1", "1e999", "NaN", "-Infinity", "1e308", "9" * 30, "9" * 5000, '""', '"x"', "[]",
    "[[]]", "[null]", "[1, 2]", "{}", '{"a": 1}', '"\\ud800"', '"\\u0000"', '"' + "x" * 5000 + '"', "3.5",
    "[" * 60 + "]" * 60, "[" * 3000 + "]" * 3000, '{"a": ' * 400 + "1" + "}" * 400, "\"/dev/zero\"",
)  # fmt: skip


def damage(name: str, content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """A damaged copy of a file, and in a word what was done to it."""
    ways: list[Callable[[bytes, random.Random], tuple[bytes, str]]] = [damage_bytes]
    if name.endswith((".yaml", ".tum", ".relations", ".txt")):
        ways += 3 * [damage_text]
    if name.endswith(".json"):
        ways += 9 * [damage_json]
    if name.endswith(".npz"):
        ways += 3 * [damage_arrays]
    if name.endswith(".said"):
        ways += 20 * [damage_said]
    return rng.choice(ways)(content, rng)


def damage_bytes(content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """One to four changes at random places, of which the beginning and the end are likelier than others."""
    data, done = bytearray(content), []
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        way = rng.choice(_BYTE_WAYS)
        at = _place(len(data), rng)
        way(data, at, rng)
        done.append(f"{way.__name__.strip('_')} at {at}")
    return bytes(data), ", ".join(done)


def _place(size: int, rng: random.Random) -> int:
    near = min(int(rng.expovariate(1 / 200)), max(size - 1, 0))
    return rng.choice((near, max(size - 1 - near, 0), rng.randrange(size) if size else 0))


def _flip(data: bytearray, at: int, rng: random.Random) -> None:
    for position in range(at, min(at + rng.choice((1, 1, 8)), len(data))):
        data[position] ^= 1 << rng.randrange(8)


def _number(data: bytearray, at: int, rng: random.Random) -> None:
    size = rng.choice((1, 2, 4, 8))
    value = rng.choice((*ODD_INTEGERS, len(data), at)) % (1 << 8 * size)
    data[at : at + size] = value.to_bytes(size, rng.choice(("little", "big")))


def _float(data: bytearray, at: int, rng: random.Random) -> None:
    wide = struct.pack("<d", rng.choice(ODD_FLOATS))
    with np.errstate(over="ignore"):
        narrow = np.float32(rng.choice(ODD_FLOATS)).tobytes()
    value = rng.choice(
        (wide, narrow, b"\1\0\xa0\x7f", b"\1\0\0\0\0\0\xf4\x7f")
    )  # the last two are signalling
    data[at : at + len(value)] = value


def _cut(data: bytearray, at: int, rng: random.Random) -> None:
    del data[at:]


def _remove(data: bytearray, at: int, rng: random.Random) -> None:
    del data[at : at + rng.choice((1, 4, 8, 100, 4096))]


def _insert(data: bytearray, at: int, rng: random.Random) -> None:
    size = rng.choice((1, 4, 8, 100, 4096))
    data[at:at] = rng.choice((bytes(size), rng.randbytes(size), data[at : at + size]))


def _overwrite(data: bytearray, at: int, rng: random.Random) -> None:
    size = min(rng.choice((4, 16, 100, 2000)), len(data) - at)
    other = _place(len(data), rng)
    data[at : at + size] = rng.choice(
        (bytes(size), b"\xff" * size, rng.randbytes(size), data[other : other + size])
    )


_BYTE_WAYS = (_flip, _flip, _number, _number, _float, _cut, _remove, _insert, _overwrite)


def damage_text(content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """Words or lines replaced, removed, or said twice."""
    lines, done = content.decode(errors="replace").split("\n"), []
    for _ in range(rng.choice((1, 1, 2))):
        at, token = rng.randrange(len(lines)), rng.choice(ODD_TOKENS)
        words = lines[at].split(" ")
        match rng.choice(("word", "word", "word", "value", "line", "remove", "twice", "add")):
            case "word":
                words[rng.randrange(len(words))] = token
                lines[at] = " ".join(words)
            case "value":
                lines[at] = f"{lines[at].partition(':')[0]}: {token}"
            case "line":
                lines[at] = token
            case "remove":
                del lines[at]
            case "twice":
                lines.insert(at, lines[at])
            case "add":
                lines.insert(at, f"{rng.choice(('image', 'mapping', 'x', ''))}: {token}")
        done.append(f"{token[:30]!r} in line {at}")
        lines = lines or [""]
    return "\n".join(lines).encode("utf-8", "surrogatepass"), ", ".join(done)


def damage_json(content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """Values of another kind, left out, or nested too deep, anywhere in the text."""
    value, done = json.loads(content), []
    for _ in range(rng.choice((1, 1, 2, 5))):
        parent, key = _place_in(value, rng)
        odd = rng.choice(ODD_JSON)
        if rng.random() < 0.15 and isinstance(parent, dict):
            del parent[key]
            done.append(f"{key} left out")
        else:
            parent[key] = f"<{odd}>"
            done.append(f"{odd[:30]} at {key}")
        if not value:
            break
    text = json.dumps(value)
    for odd in ODD_JSON:
        text = text.replace(json.dumps(f"<{odd}>"), odd)
    return text.encode(), ", ".join(done)


def _place_in(value: Any, rng: random.Random) -> tuple[Any, Any]:
    """A container and a key of it."""
    while True:
        keys = list(value) if isinstance(value, dict) else list(range(len(value)))
        key = rng.choice(keys)
        if not isinstance(value[key], dict | list) or not value[key] or rng.random() < 0.3:
            return value, key
        value = value[key]


def damage_arrays(content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """Arrays of another shape, type or content in an ``.npz`` file."""
    with np.load(io.BytesIO(content)) as file:
        arrays = {name: file[name] for name in file.files}
    done = []
    for _ in range(rng.choice((1, 1, 2))):
        name = rng.choice(list(arrays))
        way = rng.choice(list(_ARRAY_WAYS))
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            changed = _ARRAY_WAYS[way](arrays.pop(name), rng)
        if changed is not None:
            arrays[name] = changed
        done.append(f"{name}: {way}")
        if not arrays:
            break
    stored = io.BytesIO()
    np.savez(stored, **arrays)
    return stored.getvalue(), ", ".join(done)


def _odd_values(values: np.ndarray, rng: random.Random) -> np.ndarray:
    if values.dtype.kind not in "fiu" or not values.size:
        return np.asarray(rng.choice(ODD_STRINGS[:8]))
    changed, value = values.copy(), rng.choice(ODD_FLOATS if values.dtype.kind == "f" else ODD_INTEGERS)
    places = slice(None) if rng.random() < 0.3 else rng.randrange(values.size)
    changed.reshape(-1)[places] = np.asarray(value).astype(values.dtype)
    return changed


def _odd_type(values: np.ndarray, rng: random.Random) -> np.ndarray:
    kind = rng.choice(("f2", "f4", "f8", "i1", "i8", "u8", "c16", "?", "U3", "S2", "M8[ns]", ">f8"))
    try:
        return values.astype(kind)
    except (ValueError, TypeError):
        return np.zeros(values.shape, kind)


_ARRAY_WAYS: dict[str, Callable[[np.ndarray, random.Random], np.ndarray | None]] = {
    "left out": lambda values, rng: None,
    "empty": lambda values, rng: values.reshape(-1)[:0],
    "flat": lambda values, rng: values.reshape(-1),
    "deeper": lambda values, rng: values[None],
    "shorter": lambda values, rng: values[:-1] if values.ndim else values,
    "longer": lambda values, rng: np.concatenate([values, values]) if values.ndim else values,
    "turned": lambda values, rng: values.T,
    "a number": lambda values, rng: np.asarray(rng.choice(ODD_FLOATS)),
    "odd values": _odd_values,
    "other values": _odd_values,
    "another type": _odd_type,
}


def odd_message(message: Any, rng: random.Random) -> Any:
    """A copy of a ROS message with one to three odd values somewhere in it."""
    changed = message
    for _ in range(rng.choice((1, 1, 2, 3))):
        changed = _odd(changed, rng)
    return changed


def _odd(value: Any, rng: random.Random) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [field.name for field in dataclasses.fields(value) if field.init]
        name = rng.choice(fields)
        return dataclasses.replace(value, **{name: _odd(getattr(value, name), rng)})
    if isinstance(value, bool):
        return not value
    if isinstance(value, np.ndarray):
        return _odd_array(value, rng)
    if isinstance(value, list):
        return rng.choice(([], value * 2, value[:-1], [_odd(item, rng) for item in value]))
    if isinstance(value, str):
        return rng.choice(ODD_STRINGS)
    if isinstance(value, int):
        return rng.choice((*ODD_INTEGERS, value + 1, value - 1, value * 2))
    return rng.choice((*ODD_FLOATS, -value, value * 57.3))


def _odd_array(values: np.ndarray, rng: random.Random) -> np.ndarray:
    with np.errstate(all="ignore"):
        odd = np.asarray(rng.choice(ODD_FLOATS if values.dtype.kind == "f" else ODD_INTEGERS)).astype(
            values.dtype
        )
    some = values.copy()
    if len(some):
        some[rng.randrange(len(some)) :: rng.choice((1, 2, 7))] = odd
    return rng.choice(
        (values[:0], values[: len(values) // 2], np.full_like(values, odd), some, np.tile(values, 3))
    )


_KINDS_SAID = (
    "ShareUrlRequest", "RunJavascriptMessage", "GuiFormDirtyMessage", "FileTransferStartUpload", "Message",
    "TransformControlsUpdateMessage", "SceneNodeUpdateMessage", "GetRenderResponseMessage", "ResetGuiMessage",
    "CommandTriggerMessage", "ViewerCameraMessage", "ScenePointerMessage", "GuiUpdateMessage",
)  # fmt: skip
"""Of messages that a browser and the server of a page know."""


def damage_said(content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """Messages of a page in any order, some of them odd or longer than is heard."""
    messages = msgspec.msgpack.decode(content)
    count, share = rng.choice((5, 20, 60)), rng.choice((0.0, 0.1, 0.5))
    said: list[Any] = [rng.choice(messages) for _ in range(count)]
    for index, message in enumerate(said):
        if rng.random() < share:
            said[index] = rng.choice((*3 * (_odd_said(message, rng),), *_odd_frames(message, rng)))
    return msgspec.msgpack.encode([messages[0], *said]), f"{count} messages, {share:.0%} odd"


def _odd_frames(message: Any, rng: random.Random) -> tuple[Any, ...]:
    damaged, _ = damage_bytes(msgspec.msgpack.encode(message), rng)
    return damaged, rng.choice(ODD_TOKENS), bytes(rng.choice((0, 1000, 1 << 16, 1 << 20)))


def _odd_said(value: Any, rng: random.Random) -> Any:
    """A copy of what is said with something odd in it."""
    if isinstance(value, dict) and value:
        name = rng.choice(list(value))
        if rng.random() < 0.1:
            return {key: each for key, each in value.items() if key != name}
        if name == "type" and rng.random() < 0.7:
            return {**value, name: rng.choice(_KINDS_SAID)}
        return {**value, rng.choice((*9 * (name,), *ODD_STRINGS)): _odd_said(value[name], rng)}
    if isinstance(value, list) and value and rng.random() < 0.9:
        index = rng.randrange(len(value))
        return [*value[:index], _odd_said(value[index], rng), *value[index + rng.choice((0, 1, 1, 1)) :]]
    return rng.choice(
        (*ODD_FLOATS, *ODD_INTEGERS, *ODD_STRINGS, None, True, [], {}, [value], {"value": value}, b"x")
    )
