"""`make colours`: how near vertex colours come to the light, beside Cycles' own and beside the best there can be."""
