"""Golden: compares pictures with approved ones, and reports the result to people and to continuous integration (CI).

A `rule` says how much two pictures may differ. `judge` applies it to files and folders, and `report` writes the results.
"""
