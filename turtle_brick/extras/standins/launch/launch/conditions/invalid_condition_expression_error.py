# SPDX-License-Identifier: Apache-2.0
"""The error of conditions that are neither true nor false."""


class InvalidConditionExpressionError(ValueError):
    """Raised when the expression of a condition is neither true nor false."""
