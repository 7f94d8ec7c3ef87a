"""Standard error: leaves out lines that C libraries print there, where the same message is part of the output anyway."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress


@contextmanager
def without_libpng() -> Iterator[None]:
    """Leaves out libpng's errors from everything that the block writes to standard error, which appears when the block ends.

    libpng prints each error there, although OpenImageIO has taken the message: libpng's own handler runs whenever that of the
    program returns. Where standard error is closed, or no temporary file can be made, nothing is left out.
    """
    with ExitStack() as stack:
        try:
            file = stack.enter_context(tempfile.TemporaryFile())
            saved = os.dup(2)
        except OSError:
            yield
            return
        os.dup2(file.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            with suppress(OSError), open(2, "wb", closefd=False) as stream:
                stream.writelines(line for line in file if not line.startswith(b"libpng error: "))
