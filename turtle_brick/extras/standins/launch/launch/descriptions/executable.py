# SPDX-License-Identifier: Apache-2.0
"""The description of a program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import os
import re
import shlex

from launch.launch_context import LaunchContext
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from turtle_graph.client.children import with_this_python

Environment = Mapping[SomeSubstitutionsType, SomeSubstitutionsType]


class Executable:
    """
    A program with its arguments, working directory and environment variables.

    prepare() expands the substitutions and sets the attributes that begin with `final`, and
    `started_cmd`.
    """

    def __init__(self, *, cmd: Iterable[SomeSubstitutionsType],
                 prefix: SomeSubstitutionsType | None = None,
                 name: SomeSubstitutionsType | None = None,
                 cwd: SomeSubstitutionsType | None = None, env: Environment | None = None,
                 additional_env: Environment | None = None) -> None:
        self.cmd = [normalize_to_list_of_substitutions(word) for word in cmd]
        self.prefix = _normalize(prefix)
        self.name = _normalize(name)
        self.cwd = _normalize(cwd)
        self.env = _normalize_environment(env)
        self.additional_env = _normalize_environment(additional_env) or []
        self.final_cmd: list[str] = []
        self.started_cmd: list[str] = []
        """The final command, in which a Python script runs with the current Python."""
        self.final_name = ''
        self.final_cwd: str | None = None
        self.final_env: dict[str, str] = {}

    def prepare(self, context: LaunchContext) -> None:
        """Expand all substitutions."""
        settings = context.launch_configurations
        command = [perform_substitutions(context, word) for word in self.cmd]
        program = os.path.basename(command[0])
        prefix = _perform(context, self.prefix)
        if prefix is None and re.match(settings.get('launch-prefix-filter', ''), program):
            prefix = settings.get('launch-prefix')
        words = shlex.split(prefix or '')
        self.final_cmd = [*words, *command]
        self.started_cmd = [*words, *with_this_python(command[0]), *command[1:]]
        context.process_count += 1
        name = _perform(context, self.name) or os.path.basename(self.final_cmd[0])
        self.final_name = f'{name}-{context.process_count}'
        self.final_cwd = _perform(context, self.cwd)
        self.final_env = (dict(context.environment) if self.env is None
                          else _perform_environment(context, self.env))
        self.final_env.update(_perform_environment(context, self.additional_env))


def _normalize(value: SomeSubstitutionsType | None) -> list[Substitution] | None:
    return None if value is None else normalize_to_list_of_substitutions(value)


def _perform(context: LaunchContext, value: list[Substitution] | None) -> str | None:
    return None if value is None else perform_substitutions(context, value)


def _normalize_environment(
        env: Environment | None) -> list[tuple[list[Substitution], list[Substitution]]] | None:
    if env is None:
        return None
    return [(normalize_to_list_of_substitutions(name), normalize_to_list_of_substitutions(value))
            for name, value in env.items()]


def _perform_environment(
        context: LaunchContext,
        env: list[tuple[list[Substitution], list[Substitution]]]) -> dict[str, str]:
    return {perform_substitutions(context, name): perform_substitutions(context, value)
            for name, value in env}
