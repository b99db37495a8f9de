"""Every word of the interface has its German, and no German is left over from words that are gone."""

import ast
import string

import pytest

from radiosity_baker.addon import checklist, presets, properties
from radiosity_baker.addon.translations import GERMAN

FILES = ("panels", "properties", "operators", "presets", "viewport", "light_materials", "checklist", "wording")
SPOKEN = {"name", "description", "text", "heading"}


def spoken(tree):
    """The constant texts that Blender is handed to show."""
    for node in ast.walk(tree):
        named = node.arg if isinstance(node, ast.keyword) else None
        assigned = getattr(node.targets[0], "id", None) if isinstance(node, ast.Assign) else None
        if named in SPOKEN or assigned in {"bl_label", "bl_description"}:
            yield node.value
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "tr":
            yield node.args[0]
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "_figure":
            yield node.args[1]


@pytest.fixture
def words(root):
    found = set()
    for file in FILES:
        texts = spoken(ast.parse((root / "addon" / f"{file}.py").read_text(encoding="utf-8")))
        found |= {text.value for text in texts if isinstance(text, ast.Constant) and isinstance(text.value, str)}
    for items in (properties.LAYER_ITEMS, properties.GOAL_ITEMS, properties.RESULT_ITEMS, properties.DENSITY_ITEMS):
        found |= {text for _, *texts in items for text in texts}
    for items in (properties.ESTIMATOR_ITEMS, properties.DOMAIN_ITEMS, properties.DATA_TYPE_ITEMS):
        found |= {text for _, *texts in items for text in texts}
    found |= {name.capitalize() for name in presets.PRESETS} | {said for said, _ in presets.PRESETS.values()}
    found |= {button for button, _ in checklist.FIXES.values()} | set(checklist.SAID.values())
    # Words that are put together: nouns with their number, stages and causes of errors.
    found |= {noun + s for noun in ("object", "triangle") for s in ("", "s")}
    found |= {"Starting", "Plan", "Tessellate", "Transport", "Gather", "Fit", "Layers", "Sampling", "Resolution"}
    return found - {""}


def test_german_is_complete(words):
    same_in_german = {"Fit", "Radiosity Baker"}
    assert sorted(words - set(GERMAN) - same_in_german) == []


def test_no_german_is_left_over(words):
    assert sorted(set(GERMAN) - words) == []


def test_what_is_filled_in_is_the_same_in_both():
    for english, german in GERMAN.items():
        fields = [{name for _, name, _, _ in string.Formatter().parse(text) if name} for text in (english, german)]
        assert fields[0] == fields[1], english
