"""Entry point of `python -m glshade`."""

from glshade.cli import main

main()
