"""Startup: shortens the start of a process of glshade. Only programs call it that belong to glshade alone.

A program of somebody else that imports glshade may need what is switched off here.
"""

from __future__ import annotations

import gc
import os

# The number of new objects after which Python looks for cycles of forgotten ones. With its default, 700, it does so 125 times
# while modules are loaded, which takes 10 to 20 ms and frees nothing.
COLLECTED_AFTER = 20_000


def shorten() -> None:
    """Lets Python collect garbage less often, and pydantic look for no plug-ins.

    It must be called before pydantic is first used.
    """
    gc.set_threshold(COLLECTED_AFTER)
    # Without this, pydantic reads the metadata of every installed package to look for plug-ins, which takes 20 to 50 ms.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
