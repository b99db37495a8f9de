"""One small scene for each effect of light, compared with Cycles: `make effects` writes docs/effects.md.

Every module here but `catalogue`, `measure` and `__main__` holds the scenes of one kind: functions that build a scene
with bpy, marked with `@effect_scene`.
"""
