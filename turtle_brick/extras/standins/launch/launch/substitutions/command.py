# SPDX-License-Identifier: Apache-2.0
"""The substitution Command."""

from __future__ import annotations

from collections.abc import Sequence
import shlex
import subprocess

from launch.frontend.expose import expose_substitution
from launch.launch_context import LaunchContext
from launch.logging import get_logger
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import describe, Parsed, Substitution
from launch.substitutions.substitution_failure import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

ON_STDERR = ('fail', 'ignore', 'warn', 'capture')
"""Reactions to output on stderr."""


@expose_substitution('command', least=1, most=2)
class Command(Substitution):
    """The output of a command."""

    def __init__(self, command: SomeSubstitutionsType, *,
                 on_stderr: SomeSubstitutionsType = 'fail') -> None:
        self.command = normalize_to_list_of_substitutions(command)
        self.on_stderr = normalize_to_list_of_substitutions(on_stderr)

    @classmethod
    def parse(cls, data: Sequence[list[Substitution]]) -> Parsed:
        command, *on_stderr = data
        return cls, {'command': command, **({'on_stderr': on_stderr[0]} if on_stderr else {})}

    def describe(self) -> str:
        return f'Command({describe(self.command)})'

    def perform(self, context: LaunchContext) -> str:
        command = perform_substitutions(context, self.command)
        on_stderr = perform_substitutions(context, self.on_stderr)
        if on_stderr not in ON_STDERR:
            raise SubstitutionFailure(
                f"on_stderr of Command is '{on_stderr}', but must be {', '.join(ON_STDERR)}")
        stderr = subprocess.STDOUT if on_stderr == 'capture' else subprocess.PIPE
        try:
            done = subprocess.run(
                shlex.split(command), stdout=subprocess.PIPE, stderr=stderr, text=True)
        except FileNotFoundError as error:
            raise SubstitutionFailure(
                f"The program of the command '{command}' does not exist: {error}") from None
        if done.returncode:
            raise SubstitutionFailure(
                f"The command '{command}' failed with status {done.returncode}\n"
                f'{done.stderr or done.stdout}')
        if done.stderr and on_stderr != 'ignore':
            message = (f'executed command showed stderr output. Command: {command}\n'
                       f'Captured stderr output:\n{done.stderr}')
            if on_stderr == 'fail':
                raise SubstitutionFailure(message)
            get_logger().warning(message)
        return done.stdout
