# SPDX-License-Identifier: Apache-2.0
"""The error of substitutions that cannot be expanded."""


class SubstitutionFailure(RuntimeError):
    """Raised when a substitution cannot be expanded."""
