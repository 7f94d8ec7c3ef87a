"""Mesa cache: keeps Mesa's own shader cache from ending the process when the disk is full.

Mesa maps the index of its cache into memory. The file is sparse at first, and if the disk has no room for a page when the page
is first written, the kernel ends the process with SIGBUS. A batch fills disks, so a look at the free space beforehand is not
enough. Without Mesa's cache a command takes 0.3 s longer, so the cache is switched off only where it has no room.
"""

from __future__ import annotations

import os
from pathlib import Path

# Mesa's environment variable that switches its cache off.
DISABLE = "MESA_SHADER_CACHE_DISABLE"
# The size of the index in Mesa's src/util/disk_cache_os.c: a counter of 8 bytes and 65,536 keys of 20 bytes [bytes].
INDEX_SIZE = 8 + 65_536 * 20


def reserve_index() -> None:
    """Reserves room on the disk for the index of Mesa's cache; where there is none, switches the cache off for this process.

    It must be called before the driver is loaded. It does nothing on systems other than POSIX, or if the cache is off already.
    """
    if DISABLE in os.environ or not hasattr(os, "posix_fallocate"):
        return
    try:
        folder = _folder()
        folder.mkdir(parents=True, exist_ok=True)
        index = os.open(folder / "index", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            os.posix_fallocate(index, 0, INDEX_SIZE)
        finally:
            os.close(index)
    except (OSError, KeyError):
        os.environ[DISABLE] = "true"


def _folder() -> Path:
    """Returns the folder of Mesa's cache. Errors: KeyError if no variable names it and the user is unknown to the system."""
    import pwd

    named = os.environ.get("MESA_SHADER_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    return Path(named or Path(pwd.getpwuid(os.getuid()).pw_dir, ".cache")) / "mesa_shader_cache"
