"""Orphans: GL objects that moderngl leaves behind when a stage of a program does not compile.

moderngl deletes the stage that failed, but not the program that it was made for, nor the stage that it compiled before. An
editor of shaders makes many such programs.
"""

from __future__ import annotations

import ctypes

from glshade.gl.context import Context

GL_VERTEX_SHADER, GL_LINK_STATUS = 0x8B31, 0x8B82
# The number of names that are looked through from the first, and of those that are near a new name.
FEW, NEAR = 1024, 64
# The most stages that a program of glshade has.
STAGES = 2


def delete_orphans(context: Context) -> None:
    """Deletes the programs of a context that were never linked, with their stages. The context must be current.

    No other program is without a link, because moderngl links every program as soon as it has made it.
    """
    uint, name = ctypes.c_uint, ctypes.c_uint
    create = context.procedure("glCreateShader", name, uint)
    is_program = context.procedure("glIsProgram", ctypes.c_ubyte, name)
    ask = context.procedure("glGetProgramiv", None, name, uint, ctypes.POINTER(ctypes.c_int))
    attached = context.procedure(
        "glGetAttachedShaders", None, name, ctypes.c_int, ctypes.POINTER(ctypes.c_int), ctypes.POINTER(name)
    )
    delete_shader = context.procedure("glDeleteShader", None, name)
    delete_program = context.procedure("glDeleteProgram", None, name)
    if not (create and is_program and ask and attached and delete_shader and delete_program):
        return
    # Programs and shaders share their names. Some drivers give out the smallest free name, so names stay few; others the next
    # one, so that the names of the orphans lie directly below it.
    new = create(GL_VERTEX_SHADER)
    delete_shader(new)
    first = 1 if new <= FEW else new - NEAR
    for program in filter(is_program, range(first, new)):
        linked, count, stages = ctypes.c_int(), ctypes.c_int(), (name * STAGES)()
        ask(program, GL_LINK_STATUS, ctypes.byref(linked))
        if not linked:
            attached(program, STAGES, ctypes.byref(count), stages)
            delete_program(program)
            for stage in stages[: count.value]:
                delete_shader(stage)
