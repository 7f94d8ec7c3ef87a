"""What things cost on the driver at hand, by the clock on the wall: the models, and whole pictures beside other programs.

works (what is measured) -> stage (its scene on disk) -> entrants (each program in a process: worker, own, peers/) -> contest
(in turn, ratios, targets); growth and jobs are of glshade alone; report has all of them.
"""
