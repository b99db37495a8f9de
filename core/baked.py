"""What a bake has worked out before it is written down: all that its result and its report are made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from .clock import Clock
from .layers import Layers, baked_objects
from .openness import escaped_share
from .parallel import Workers
from .patches import Patches
from .plan import Plan
from .refinement import Light
from .report import make_report
from .result import BakeResult
from .scene import Float64
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
        layers = Layers(self.plan.scene, self.survey.receivers, light, lambda: self._escaped)
        objects = tuple(baked_objects(self.survey.receivers, layers, settings.layers))
        return BakeResult(
            objects, make_report(settings, self.plan, clock, self.patches, self.halves, self.survey, light, objects)
        )

    @cached_property
    def _escaped(self) -> Float64:
        """Once for all looks at the same bake, and only if someone asks. The rays join those of the survey."""
        survey, workers = self.survey, self.survey.workers
        with Workers(workers.threads, workers.progress) as own:
            share, rays = escaped_share(
                survey.receivers, self.patches, survey.visibility, self.plan.effort.gather_rays, survey.seed, own
            )
        survey.rays["escaped"] += rays
        return share
