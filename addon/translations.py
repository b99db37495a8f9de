"""The interface in other languages. Blender looks words up by their English; sentences are told here."""

from __future__ import annotations

import re
import string

import bpy
from bpy.app.translations import pgettext_iface as tr

from .german import SENTENCES, WORDS

#: For words that Blender itself has translated, and as something else.
CONTEXT = "Radiosity"
#: Blender looks the names of operators up in a context of their own.
_CONTEXTS = ("*", "Operator", CONTEXT)
#: Fields that are filled with words to be translated as well; others with names and numbers.
_TOLD = {"what", "remedy"}
_NUMBER = r"[\d.,]+"


def told(sentence: str) -> str:
    """A sentence with its names and numbers in it, in the language of the interface; as it is where nobody knows it.

    The core and the readers speak English, and know of no other language.
    """
    whole = tr(sentence)
    return _told_by_pattern(sentence) if whole == sentence else whole


def _told_by_pattern(sentence: str) -> str:
    for template, pattern in _PATTERNS:
        found = pattern.fullmatch(sentence)
        if found is not None:
            filled = {name: _filled(name, value) for name, value in found.groupdict().items()}
            return tr(template).format(**filled)
    return sentence


def _filled(field: str, value: str) -> str:
    # A lamp may be called "Light": only what is no name is looked up as a word.
    return told(value) if field in _TOLD else _told_by_pattern(value)


def _pattern(template: str) -> re.Pattern[str]:
    parts = []
    for text, field, _, _ in string.Formatter().parse(template):
        parts += [re.escape(text), f"(?P<{field}>{_NUMBER if field == 'number' else '.+?'})" if field else ""]
    return re.compile("".join(parts), re.DOTALL)


def _literal(template: str) -> int:
    return sum(len(text) for text, *_ in string.Formatter().parse(template))


#: The sentences with something to fill in; those that say most by themselves first.
_PATTERNS = [
    (template, _pattern(template)) for template in sorted(SENTENCES, key=_literal, reverse=True) if "{" in template
]


def register() -> None:
    german = WORDS | SENTENCES
    words = {(context, english): said for context in _CONTEXTS for english, said in german.items()}
    bpy.app.translations.register(__package__ or "radiosity_baker", {"de_DE": words})


def unregister() -> None:
    bpy.app.translations.unregister(__package__ or "radiosity_baker")
