"""Launcher: runs one command, and writes its wall-clock time, its peak memory and its exit code to a file.

    python -I -S launcher.py RESULT COMMAND [ARGUMENT ...]

The system counts the memory that a process had before it became the command, too. So the command is started by this script,
which needs 10 MB, and not by a benchmark that has loaded much. It imports only small parts of the standard library.
"""

import json
import os
import sys
import time


def main(result: str, *command: str) -> None:
    """Runs the command, and writes `seconds` [s], `peak` [bytes] and `code` to the file `result` as JSON.

    The peak is that of the largest process: the command or one of its children. A negative code is the number of a signal.
    Errors: OSError if the command cannot be started.
    """
    start = time.perf_counter()
    process = os.posix_spawnp(command[0], command, os.environ)
    _, status, usage = os.wait4(process, 0)
    seconds = time.perf_counter() - start
    # Linux counts the peak in kilobytes, macOS in bytes.
    peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    with open(result, "w", encoding="utf-8") as file:
        json.dump({"seconds": seconds, "peak": peak, "code": os.waitstatus_to_exitcode(status)}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
