# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The base class of verbs."""

from __future__ import annotations

import argparse

from ros2cli.command import Status


class VerbExtension:
    """A verb of a command, such as `list`. Its description is the one in the command."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the arguments of the verb to a parser."""

    def main(self, *, args: argparse.Namespace) -> Status:
        """Run the verb."""
        raise NotImplementedError
