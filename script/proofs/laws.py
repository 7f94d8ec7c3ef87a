"""Random scenes obey all laws of pictures, on the GPU and in the reference (docs/laws.md)."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

from hypothesis import Phase, given, seed, settings
from hypothesis import strategies as st
from support.strategies import scenes

from glshade import Renderer, Scene
from glshade.verification.laws import check_laws

COUNT = 300


@st.composite
def scenes_with_parents(draw: st.DrawFn) -> Scene:
    """Draws a scene in which each object may be the parent of the next one."""
    scene = draw(scenes())
    if not draw(st.booleans()):
        return scene
    objects = [item.model_copy(update={"name": f"object {number}"}) for number, item in enumerate(scene.objects)]
    children = (item.model_copy(update={"parent": parent.name}) for parent, item in pairwise(objects))
    return scene.model_copy(update={"objects": (objects[0], *children)})


def prove(count: int, from_seed: int) -> int:
    """Checks all laws on `count` random scenes, and returns the number of scenes that break at least one."""
    outcomes: Counter[tuple[str, str]] = Counter()
    broken = 0
    with Renderer() as renderer:

        @seed(from_seed)
        @settings(max_examples=count, database=None, deadline=None, phases=[Phase.generate])
        @given(scenes_with_parents())
        def check(scene: Scene) -> None:
            nonlocal broken
            found = list(check_laws(scene, renderer=renderer))
            outcomes.update((finding.law, finding.outcome) for finding in found)
            for finding in found:
                if finding.broken:
                    print(f"broken: {finding}\n{scene.model_dump_json(exclude_unset=True)}", flush=True)
            broken += any(finding.broken for finding in found)

        check()
    for (law, outcome), number in sorted(outcomes.items()):
        print(f"{law:<20} {outcome:<15} {number:>6} pictures")
    return broken
