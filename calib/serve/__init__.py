"""A folder on this machine in, a local page on which a lab works on it out; knows no physics and no statistics.

All state is in the folder; the page shows of every step (files, experiment, check, runs, padding) the command that does the
same. It needs the extra `serve`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from calib.lazy import on_demand

if TYPE_CHECKING:
    from calib.serve.app import app_of
    from calib.serve.keys import Keys
    from calib.serve.security import Door
    from calib.serve.server import serve
    from calib.serve.workspace import Workspace, open_workspace

__all__ = ["Door", "Keys", "Workspace", "app_of", "open_workspace", "serve"]

__getattr__ = on_demand(
    __name__,
    {
        ".app": ("app_of",),
        ".keys": ("Keys",),
        ".security": ("Door",),
        ".server": ("serve",),
        ".workspace": ("Workspace", "open_workspace"),
    },
)


def __dir__() -> list[str]:
    return __all__
