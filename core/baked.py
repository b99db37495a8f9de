"""What a bake has worked out before it is written down: all that its result and its report are made of."""

from __future__ import annotations

from dataclasses import dataclass

from .clock import Clock
from .layers import baked_objects
from .patches import Patches
from .plan import Plan
from .refinement import Light
from .report import make_report
from .result import BakeResult
from .settings import Settings
from .survey import Survey
from .transport import Transport


@dataclass(frozen=True, eq=False)
class Baked:
    """The plan, the patches, what they exchange, and the samples on the receivers."""

    plan: Plan
    patches: Patches
    halves: tuple[Transport, ...]
    survey: Survey

    def result(self, light: Light, settings: Settings, clock: Clock) -> BakeResult:
        """The light as layers on the receivers, and the report. Raises SceneError for a layer that does not exist."""
        objects = tuple(baked_objects(self.plan.scene, self.survey.receivers, light, settings.layers))
        return BakeResult(
            objects, make_report(settings, self.plan, clock, self.patches, self.halves, self.survey, light, objects)
        )
