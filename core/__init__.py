"""The physics of Radiosity Baker: arrays in, arrays out. Needs numpy and embreex, never Blender."""
