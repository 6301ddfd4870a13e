"""A folder of results in, an archive of it to take along out, without what only going on with it needs."""

from __future__ import annotations

import secrets
import zipfile
from pathlib import Path

from calib.serve.workspace import Workspace


def packed(space: Workspace, folder: Path) -> Path:
    """Pack a folder that lies in that of a page; what is behind a link, hidden, or a checkpoint stays out.

    Parameters
    ----------
    space : the folder of the page.
    folder : that is packed.

    Returns
    -------
    The archive, in a place of the page's own, to be removed by who has sent it.
    """
    inside = [path for path in sorted(folder.rglob("*")) if _is_result(path.relative_to(folder)) and path.is_file()]
    into = space.page_folder / "downloads"
    into.mkdir(exist_ok=True)
    target = into / f"{secrets.token_hex(8)}.zip"
    try:
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False) as archive:
            for path in inside:
                if not path.is_symlink():
                    archive.write(path, Path(folder.name, path.relative_to(folder)).as_posix())
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    return target


def _is_result(name: Path) -> bool:
    return name.parts[0] != "checkpoint" and not any(part.startswith(".") for part in name.parts)
