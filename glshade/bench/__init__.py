"""Benchmarks: measure glshade's speed on the driver at hand, the cost of its models, and how it compares with other programs.

`works` lists the pictures that are drawn; each entry is called a work. `stage` writes the scene of a work to disk. `entrants`
runs each program in processes of its own, whose code is in `worker`. `own` holds glshade as such a program, and `peers/` holds
the others. `contest` runs the programs in turn and computes ratios. `growth`, `jobs` and `brdfs` measure glshade alone.
`report` holds the results of all but `brdfs`.
"""
