# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 param dump`."""

from __future__ import annotations

import argparse
from typing import Any

from rclpy.parameter import parameter_value_to_python
from ros2cli.verb import VerbExtension
from ros2param.api import add_node_arguments, parameter_services
import yaml


class DumpVerb(VerbExtension):
    """Prints all parameters of a node in the format of a parameter file."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        add_node_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> None:
        tree: dict[str, Any] = {}
        with parameter_services(args) as call:
            names = sorted(call('list_parameters').result.names)
            for name, value in zip(names, call('get_parameters', names=names).values):
                *groups, own_name = name.split('.')
                inner = tree
                for group in groups:
                    inner = inner.setdefault(group, {})
                inner[own_name] = parameter_value_to_python(value)
        print(yaml.dump({f'/{args.node_name.lstrip("/")}': {'ros__parameters': tree}}))
