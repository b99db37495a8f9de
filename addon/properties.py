"""What a person may set in the panel, kept in the scene, and how it becomes `core.settings.Settings`."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..core import settings as core
from . import light_materials, viewport
from .checklist import Problem
from .colour_storage import Storage
from .planning import settings_changed
from .translations import CONTEXT

LAYER_ITEMS = [
    ("combined", "Combined", "Emitted plus reflected light: what the surface looks like"),
    ("light", "Light", "The light that arrives, without the surface's own colour"),
    ("direct", "Direct", "Reflected light that came straight from lamps, emitting surfaces and the sky"),
    ("indirect", "Indirect", "Reflected light that bounced at least once"),
    ("emission", "Emission", "The light the surface gives off by itself"),
    ("sky", "Sky", "Reflected light that came straight from the sky"),
    ("error", "Error", "How far the combined light may be off, as the bake itself estimates it"),
    ("unreached", "Unreached", "Loud colours where nothing is seen of the surface and light was filled in"),
    ("escaped", "Escaped", "The share of what surrounds the surface that is open to the void: holes are bright"),
    ("triangles", "Triangles", "A colour of its own for every triangle, to see how finely the surface is split"),
]

GOAL_ITEMS = [
    ("ERROR", "Accuracy", "Bake until the estimated error is as small as asked"),
    ("SECONDS", "Time", "Make the best of a given time"),
]

RESULT_ITEMS = [
    ("NEW", "New Object", "Leave the objects alone, and add a tessellated copy of each that carries the light"),
    ("REPLACE", "Replace", "Tessellate the objects' own meshes, and write the light to them"),
    ("KEEP", "Keep Topology", "Write the light to the corners the meshes have, without adding any"),
]

DENSITY_ITEMS = [
    ("TRIANGLES", "Triangles", "Choose the size of the triangles so that about this many result"),
    ("SIZE", "Longest Edge", "Split triangles until no edge is longer than this"),
]

ESTIMATOR_ITEMS = [
    ("auto", "Automatic", "Choose by the number of patches"),
    ("hemisphere", "Hemisphere", "Cast rays over each patch's hemisphere: cost grows in line with the patches"),
    ("analytic", "Analytic", "Lambert's exact formula for every pair of patches: smooth, for small scenes"),
    ("centroid", "Centroid", "The classic formula between centres: wrong where surfaces meet, for comparison only"),
]

DOMAIN_ITEMS = [
    ("CORNER", "Face Corner", "A colour for each corner of each face: edges stay sharp"),
    ("POINT", "Vertex", "A colour for each vertex, the mean of the corners that meet there"),
]

DATA_TYPE_ITEMS = [
    ("FLOAT_COLOR", "Color", "Floats: any brightness"),
    ("BYTE_COLOR", "Byte Color", "8 bits for each channel: a quarter of the memory, and light above 1 is cut off"),
]


def _show_layer(settings: "RadiosityBakerSettings", _context: bpy.types.Context) -> None:
    report = settings.last_report()
    if report:
        viewport.show_layer(settings.id_data, report, settings.layer)
        light_materials.follow_layer(light_materials.last_baked(settings.id_data))


class RadiosityBakerSettings(bpy.types.PropertyGroup):
    """`scene.radiosity_baker`: the settings of the next bake and the report of the last."""

    goal: EnumProperty(
        name="Bake for",
        description="What ends the bake: an accuracy that is reached, or a time that is up",
        items=GOAL_ITEMS,
        translation_context=CONTEXT,
        default="ERROR",
        update=settings_changed,
    )
    error: FloatProperty(
        name="Error",
        description="How far the baked light may be off on average, compared with the mean light of the surfaces",
        subtype="PERCENTAGE",
        default=2.0,
        min=0.1,
        soft_min=0.5,
        max=100.0,
        soft_max=20.0,
        precision=1,
        update=settings_changed,
    )
    seconds: FloatProperty(
        name="Time",
        description="How long the bake may take",
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
        default=10.0,
        min=0.1,
        soft_min=1.0,
        soft_max=600.0,
        step=100,
        precision=1,
        update=settings_changed,
    )
    result: EnumProperty(
        name="Result",
        description="Where the baked light goes",
        items=RESULT_ITEMS,
        default="NEW",
        update=settings_changed,
    )
    density: EnumProperty(
        name="Tessellation",
        description="How finely the objects are split, so that their vertices can hold shadows",
        items=DENSITY_ITEMS,
        translation_context=CONTEXT,
        default="TRIANGLES",
        update=settings_changed,
    )
    triangles: IntProperty(
        name="Count",
        description="About how many triangles all baked objects have together after the split",
        default=core.Settings.triangles,
        min=100,
        soft_max=500_000,
        max=20_000_000,
        step=1000,
        update=settings_changed,
    )
    size: FloatProperty(
        name="Length",
        description="The longest edge a triangle may have after the split",
        subtype="DISTANCE",
        unit="LENGTH",
        default=0.1,
        min=0.0001,
        soft_min=0.005,
        soft_max=10.0,
        update=settings_changed,
    )
    estimator: EnumProperty(
        name="Form Factors",
        description="How the exchange of light between the patches is computed",
        items=ESTIMATOR_ITEMS,
        default="auto",
        update=settings_changed,
    )
    seed: IntProperty(
        name="Seed",
        description="Start of the random numbers: the same seed gives the same bake, to the last bit",
        default=core.Settings.seed,
        min=0,
    )
    threads: IntProperty(
        name="Threads",
        description="Number of processor cores to use; 0 uses all of them",
        default=core.Settings.threads,
        min=0,
        soft_max=64,
        max=1024,
    )
    layers: EnumProperty(
        name="Layers",
        description="Kinds of light to store in colour attributes of their own (hold Shift to choose several). "
        "Combined is always among them",
        items=LAYER_ITEMS,
        translation_context=CONTEXT,
        options={"ENUM_FLAG"},
        default={"combined"},
    )
    attribute: StringProperty(
        name="Attribute",
        description="Name of the colour attribute that holds the combined light; the other layers add theirs to it",
        default="Radiosity",
        maxlen=50,
    )
    domain: EnumProperty(
        name="Domain",
        description="What has a colour of its own",
        items=DOMAIN_ITEMS,
        default="CORNER",
    )
    data_type: EnumProperty(
        name="Data Type",
        description="How the colours are stored",
        items=DATA_TYPE_ITEMS,
        default="FLOAT_COLOR",
    )
    exposure: FloatProperty(
        name="Exposure",
        description="Stops by which the light is made brighter before it is stored; the mesh keeps the factor, to "
        "divide by",
        default=0.0,
        soft_min=-10.0,
        soft_max=10.0,
        min=-32.0,
        max=32.0,
        precision=1,
    )
    show_while_baking: BoolProperty(
        name="Show While Baking",
        description="Show the light in the viewport as far as it has come, pass by pass",
        default=True,
    )
    show_when_done: BoolProperty(
        name="Show When Done",
        description="Show the baked light in the viewport as soon as it is there",
        default=True,
    )
    layer: EnumProperty(
        name="Layer",
        description="The layer that the viewport shows on the baked objects",
        items=LAYER_ITEMS,
        translation_context=CONTEXT,
        default="combined",
        update=_show_layer,
    )
    report: StringProperty(
        name="Report",
        description="What the last bake did, as the report.json of the command line",
        options={"HIDDEN"},
    )

    overrides: StringProperty(
        name="Effects",
        description="Effects that are simulated, or not, whatever the scene calls for",
        options={"HIDDEN"},
    )
    plan: StringProperty(
        name="Plan",
        description="What the next bake would simulate, and what it would cost",
        options={"HIDDEN"},
    )

    def to_core(self) -> core.Settings:
        """The settings as `core.bake` takes them: lengths in metres, errors as a share of one."""
        return core.Settings(
            tessellate=self.result != "KEEP",
            size=self.size if self.density == "SIZE" else None,
            triangles=self.triangles,
            error=self.error / 100.0 if self.goal == "ERROR" else None,
            seconds=self.seconds if self.goal == "SECONDS" else None,
            estimator=self.estimator,
            seed=self.seed,
            threads=self.threads,
            layers=tuple(layer for layer in core.LAYERS if layer == "combined" or layer in self.layers),
            effects=self.effects(),
        )

    def storage(self) -> Storage:
        """How the colour attributes hold the light."""
        return Storage(self.domain, self.data_type, self.exposure)

    def effects(self) -> dict[str, bool]:
        """The effects that a person has switched on or off, by name."""
        return _parsed(self.overrides) if self.overrides else {}

    def switch_effect(self, name: str, active: bool) -> None:
        """Switch an effect over from what it is; what was switched before is left to the scene again."""
        effects = dict(self.effects())
        if effects.pop(name, None) is None:
            effects[name] = not active
        self.overrides = json.dumps(effects)

    def result_mode(self) -> str:
        """The result as the attribute writer names it."""
        return self.result.lower()

    def remember(self, report: dict[str, Any]) -> None:
        """Keep a bake's report with the scene, where undo and saving take it along."""
        self.report = json.dumps(report)
        self.plan = ""
        self.layer = "combined"

    def last_report(self) -> dict[str, Any] | None:
        """The report of the last bake, or None before the first."""
        return _parsed(self.report) if self.report else None

    def problems(self) -> list[Problem]:
        """What the last check found."""
        found = _parsed(self.plan).get("problems", []) if self.plan else []
        return [Problem(entry["kind"], entry["text"], tuple(entry["objects"])) for entry in found]

    def last_plan(self) -> dict[str, Any]:
        """The plan made since the last bake, or else what that bake simulated; empty before either."""
        if self.plan:
            return _parsed(self.plan)
        report = self.last_report()
        return {} if report is None else {"effects": report["effects"]}


@lru_cache(maxsize=4)
def _parsed(report: str) -> dict[str, Any]:
    # The panel asks on every redraw.
    return json.loads(report)


class RadiosityBakerObjectSettings(bpy.types.PropertyGroup):
    """`object.radiosity_baker`: what is different for one object."""

    receives: BoolProperty(
        name="Receives",
        description="Bake light onto this object, when it is among those to bake",
        default=True,
        update=settings_changed,
    )
    casts: BoolProperty(
        name="Casts",
        description="Let this object stand in the way of light, and cast shadows",
        default=True,
        update=settings_changed,
    )
    bounces: BoolProperty(
        name="Bounces",
        description="Let this object reflect light onto others, and give off its own",
        default=True,
        update=settings_changed,
    )
    use_size: BoolProperty(
        name="Own Tessellation",
        description="Split this object to a size of its own",
        default=False,
        update=settings_changed,
    )
    size: FloatProperty(
        name="Longest Edge",
        description="The longest edge a triangle of this object may have after the split",
        subtype="DISTANCE",
        unit="LENGTH",
        default=0.1,
        min=0.0001,
        soft_min=0.005,
        soft_max=10.0,
        update=settings_changed,
    )


def register() -> None:
    bpy.utils.register_class(RadiosityBakerSettings)
    bpy.utils.register_class(RadiosityBakerObjectSettings)
    bpy.types.Scene.radiosity_baker = PointerProperty(type=RadiosityBakerSettings)
    bpy.types.Object.radiosity_baker = PointerProperty(type=RadiosityBakerObjectSettings)


def unregister() -> None:
    del bpy.types.Object.radiosity_baker
    del bpy.types.Scene.radiosity_baker
    bpy.utils.unregister_class(RadiosityBakerObjectSettings)
    bpy.utils.unregister_class(RadiosityBakerSettings)


@contextmanager
def known() -> Iterator[None]:
    """Within, settings of scenes and objects can be read, whether or not the add-on is enabled."""
    if hasattr(bpy.types.Object, "radiosity_baker"):
        yield
        return
    register()
    try:
        yield
    finally:
        unregister()
