"""What the routes of the gestures take, for OpenAPI: they read their bodies themselves."""

from typing import Any

from app.gateway.viser_rehearsal import VIEW_ID
from app.gestures.hand.poses import POSES
from app.memory import PersonSettings

_GALLERY = {"type": "string", "default": "shared", "description": "id of a gallery"}
_BURST = {"type": "boolean", "default": False, "description": "frames of a few seconds"}
_SIGN = {
    "type": "string",
    "enum": list(POSES),
    "description": "the starter sign that the images have to show",
}
_IMAGES = {"type": "array", "items": {"type": "string", "format": "binary"}}
ENROL_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["name", "action", "images"],
                "properties": {
                    "name": {"type": "string"},
                    "action": {"type": "string", "description": "an action as JSON"},
                    "active": {"type": "boolean", "default": True},
                    "gallery": _GALLERY,
                    "burst": _BURST,
                    "sign": _SIGN,
                    "images": _IMAGES,
                },
            }
        }
    },
}
SAMPLES_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["images"],
                "properties": {"burst": _BURST, "sign": _SIGN, "images": _IMAGES},
            }
        }
    },
}
CHECK_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["images"],
                "properties": {
                    "name": {"type": "string"},
                    "action": {"type": "string", "description": "an action as JSON"},
                    "active": {"type": "boolean", "default": True},
                    "gesture": {"type": "string", "description": "id, to check more samples of it"},
                    "gallery": _GALLERY,
                    "burst": _BURST,
                    "sign": _SIGN,
                    "images": _IMAGES,
                },
            }
        }
    },
}
IMAGE_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["image"],
                "properties": {
                    "image": {"type": "string", "format": "binary"},
                    "gallery": _GALLERY,
                },
            }
        },
        "image/*": {"schema": {"type": "string", "format": "binary"}},
    },
}
PATCH_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "application/json": {
            "schema": {
                "type": "object",
                "properties": {
                    "name": {"type": "string"},
                    "action": {"type": "object"},
                    "active": {"type": "boolean"},
                    "version": {"type": "integer", "description": "the newest one known"},
                },
                "additionalProperties": False,
            }
        }
    },
}
GALLERY_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "application/json": {
            "schema": {
                "type": "object",
                "required": ["name"],
                "properties": {"name": {"type": "string"}},
                "additionalProperties": False,
            }
        }
    },
}
MOVE_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "application/json": {
            "schema": {
                "type": "object",
                "required": ["to"],
                "properties": {"to": {"type": "string", "description": "id of a gesture"}},
                "additionalProperties": False,
            }
        }
    },
}
ZIP_BODY: dict[str, Any] = {
    "required": True,
    "content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}},
}
SETTINGS_BODY: dict[str, Any] = {
    "required": True,
    "content": {"application/json": {"schema": PersonSettings.model_json_schema()}},
}
DRY_RUN_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "application/json": {
            "schema": {
                "type": "object",
                "required": ["action"],
                "properties": {
                    "action": {"type": "object"},
                    "from": {
                        "type": "string",
                        "default": "current",
                        "description": "'current', 'home' or the name of a pose",
                    },
                    "view": {
                        "type": "string",
                        "pattern": f"^{VIEW_ID.pattern}$",
                        "description": "id of the 3D view in which to show the path",
                    },
                    "still": {
                        "type": "boolean",
                        "default": False,
                        "description": "there, the robot stands at the end of the path",
                    },
                },
                "additionalProperties": False,
            }
        }
    },
}
