"""`make bench`: how fast, how good and how honest a bake is, on six scenes, beside Cycles and the original scheme."""
