"""The command `calib`, also as `python -m calib`: until its own handling of Ctrl-C is in place, Ctrl-C ends it silently."""

from __future__ import annotations

import signal


def main() -> None:
    """Run the command line."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from calib.cli import app

    app()


if __name__ == "__main__":
    main()
