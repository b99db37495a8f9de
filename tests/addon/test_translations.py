"""Every word of the interface has its German, and no German is left over from words that are gone."""

import ast
import itertools
import string

import pytest

from radiosity_baker.addon import checklist, presets, properties, translations
from radiosity_baker.addon.german import SENTENCES, WORDS
from radiosity_baker.core.effects import EFFECTS

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
    found |= {
        "Starting",
        "Plan",
        "Tessellate",
        "Transport",
        "Gather",
        "Fit",
        "Layers",
        "Relight",
        "Sampling",
        "Resolution",
    }
    found |= {"sampling", "transport", "resolution"} | set(EFFECTS)
    return found - {""}


def test_german_is_complete(words):
    same_in_german = {"Fit", "Radiosity Baker"}
    assert sorted(words - set(WORDS) - same_in_german) == []


def test_no_german_is_left_over(words):
    assert sorted(set(WORDS) - words) == []


def test_what_is_filled_in_is_the_same_in_both():
    for english, german in (WORDS | SENTENCES).items():
        fields = [{name for _, name, _, _ in string.Formatter().parse(text) if name} for text in (english, german)]
        assert fields[0] == fields[1], english


# What the core and the readers say, in whole sentences: their modules, but for those that only the command line calls.
SILENT = {"accuracy", "closed_forms", "comparison", "ladder", "self_test", "settings", "oracle"}
SILENT |= {"accuracy_plot", "accuracy_report", "command_line", "headless", "preview", "german", "compat"}
# Of what is found there: names, and parts of sentences, which are tested as a whole below.
PARTS = {
    " and 7 more",
    "patch refinement 7",
    "7 sun 7",
    "gather behind 7",
    "direct behind 7",
    "light on sides ",
    "look for sky",
    "Is Diffuse Ray",
    "Is Reflection Ray",
    "Specular IOR Level",
    "a bright spot is",
    "7 bright spots are",
    "7 sampled as a sun",
    "7 sampled as suns",
    "an opening that was found",
    "7 openings that were found",
    "Bytes hold values up to 1, and those from there to 7 were cut off",
    "7: bake with an exposure of 7 stops, or to float colours.",
}
NODE = "the plain value behind the link is used. Set that value to the average, or unlink it."
CUT_OFF = "Bytes hold values up to 1, and those from there to 2 were cut off"
WHOLE = {
    "a bright spot is sampled as a sun",
    "3 bright spots are sampled as suns",
    "the sky is coloured",
    "the sky shines through Window, Door, Hatch and 2 more and 3 openings that were found",
    "the sky shines through Window and an opening that was found",
    "the sky shines through an opening that was found",
    "the sky shines through 4 openings that were found",
    "all at once, for fewer take no less time: surfaces reflect 80%, and bounce 28 adds 0.19% in a closed room",
    f"{CUT_OFF}: bake with an exposure of -1 stops, or to float colours.",
    "Curtain let light through; Lamp shade, Pane cast no shadow",
    "switched off by hand; none in the scene",
    "12 triangles emit; sampled as lamps",
    "World 'World' could not be evaluated by Cycles (busy): switch the add-on Cycles on. A plain colour is used.",
    "World 'World' combines images of different sizes: their means are used.",
    "Lamp 'Sun' combines images of different sizes: their means are used.",
    "Material 'Sky' mixes shaders, which adds something to an image that is clipped.",
    f"Material 'Sky' takes its Base Color from the node Noise, which is not read yet: {NODE}",
    f"Material 'Sky' takes its Alpha from the node Image, which has an image, 'A', of the kind movie: {NODE}",
    f"Material 'Sky' takes its Alpha from the node Image, which calculates Sine: {NODE}",
    "There is no object 'A' in view layer 'B' of scene 'C': check the spelling.",
}


def texts(node):
    """All that an expression can say, with 7 for what is filled in."""
    match node:
        case ast.Constant(value=str(text)):
            return [text]
        case ast.IfExp():
            return texts(node.body) + texts(node.orelse)
        case ast.JoinedStr():
            return ["".join(parts) for parts in itertools.product(*map(texts, node.values))]
        case ast.FormattedValue(value=ast.IfExp()):
            return texts(node.value)
    return ["7"]


def inner_nodes(tree):
    """Docstrings, and what lies within texts that are put together."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield node.value
        if isinstance(node, ast.JoinedStr):
            yield from itertools.islice(ast.walk(node), 1, None)


@pytest.fixture(scope="module")
def sentences(root):
    """Whatever has three words or more."""
    found = set()
    for path in [*(root / "core").rglob("*.py"), *(root / "addon").glob("*.py")]:
        if path.stem in SILENT | set(FILES) - {"operators"}:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        within = set(inner_nodes(tree))
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr | ast.Constant) and node not in within:
                found |= {text for text in texts(node) if len(text.split()) > 2}
    return found - PARTS - set(WORDS) | WHOLE


@pytest.fixture
def in_german(monkeypatch):
    german = WORDS | SENTENCES
    monkeypatch.setattr(translations, "tr", lambda text: german.get(text, text))


@pytest.mark.usefixtures("in_german")
def test_every_sentence_can_be_told_in_german(sentences):
    untold = sorted(sentence for sentence in sentences if translations.told(sentence) == sentence)
    assert untold == [], "put them into SENTENCES of addon/german.py"


@pytest.mark.usefixtures("in_german")
def test_names_and_numbers_in_a_sentence_stay_what_they_are():
    told = translations.told("switched on by hand; Light, Sun, Lamp and 2 more have a size")
    assert told == "von Hand eingeschaltet; Light, Sun, Lamp und 2 weitere haben eine Größe"
    told = translations.told(
        "Material 'Light' shows pink, as in a render, because its node Sky has no image: find the "
        "file, or choose another image."
    )
    assert told.startswith("Material 'Light' zeigt Rosa, wie beim Rendern, denn sein Knoten Sky hat kein Bild: ")


def test_in_english_a_sentence_is_told_as_it_is(sentences):
    assert all(translations.told(sentence) == sentence for sentence in sentences)


@pytest.mark.usefixtures("in_german")
def test_no_sentence_is_left_over(sentences):
    said = set()

    def note(text):
        if text in SENTENCES:
            said.add(text)
        return text

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(translations, "tr", note)
        for sentence in sentences | PARTS:
            translations.told(sentence)
    assert sorted(set(SENTENCES) - said) == []
