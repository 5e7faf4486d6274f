# SPDX-License-Identifier: Apache-2.0
"""Programs that run, simulate and measure the ROS graph, and plot the results."""

from argparse import ArgumentTypeError


def positive_int(text: str) -> int:
    """Convert a command-line value to a positive integer."""
    if not text.isdecimal() or int(text) < 1:
        raise ArgumentTypeError(f'{text!r} is not a whole number of at least 1')
    return int(text)
