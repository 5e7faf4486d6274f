# SPDX-License-Identifier: Apache-2.0
"""Find out which packages are installed."""

import contextlib
from pathlib import Path


def is_standin(package: str) -> bool:
    """Return whether an installed package is a stand-in."""
    with contextlib.suppress(ModuleNotFoundError, LookupError):
        from ament_index_python.packages import get_package_share_directory
        manifest = Path(get_package_share_directory(package), 'package.xml')
        return '<description>Stands in for' in manifest.read_text()
    return False
