"""The command line, run inside the extension module."""

import signal
import sys


def main() -> int:
    """Runs ``kmcfit`` on the arguments of the process; the exit code of the program."""
    from . import _kmcfit

    # The command has its own handlers, which end a run in order.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _kmcfit.main(sys.argv[1:])
