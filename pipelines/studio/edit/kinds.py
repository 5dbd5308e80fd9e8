"""Names and explanations of the kinds of edits; the layers of the same names have their colours."""

from racecar.maps.grid.edits import EditKind

NAMES: dict[EditKind, str] = {
    "erase": "Erase",
    "wall": "Wall",
    "free": "Free",
    "unknown": "Unknown",
    "keepout": "Keep out",
    "speed": "Speed limit",
}
KIND_OF_NAME = {name: kind for kind, name in NAMES.items()}

HELP: dict[EditKind, str] = {
    "erase": "What was seen inside becomes free: a chair, a person.",
    "wall": "A wall from corner to corner.",
    "free": "All inside becomes free, even what nobody saw.",
    "unknown": "All inside becomes unknown.",
    "keepout": "No robot shall go there; the map stays as it is.",
    "speed": "Robots shall be slow there; the map stays as it is.",
}
