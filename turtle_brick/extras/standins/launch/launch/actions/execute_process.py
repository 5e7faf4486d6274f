# SPDX-License-Identifier: Apache-2.0
"""The action ExecuteProcess."""

from __future__ import annotations

from collections.abc import Iterable
import shlex
from typing import Any

from launch.action import Action
from launch.actions.execute_local import ExecuteLocal
from launch.actions.shutdown_action import Shutdown
from launch.descriptions.executable import Environment, Executable
from launch.frontend import Entity, expose_action, Parser
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import Substitution
from launch.substitutions.text_substitution import TextSubstitution


@expose_action('executable')
class ExecuteProcess(ExecuteLocal):
    """
    Starts a process.

    In Python: ExecuteProcess(cmd=['ls', '-l'], output='screen')
    In XML: <executable cmd="ls -l" output="screen"><env name="A" value="1"/></executable>
    """

    def __init__(self, *, cmd: Iterable[SomeSubstitutionsType],
                 prefix: SomeSubstitutionsType | None = None,
                 name: SomeSubstitutionsType | None = None,
                 cwd: SomeSubstitutionsType | None = None, env: Environment | None = None,
                 additional_env: Environment | None = None, **kwargs: Any) -> None:
        super().__init__(process_description=Executable(
            cmd=cmd, prefix=prefix, name=name, cwd=cwd, env=env,
            additional_env=additional_env), **kwargs)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, arguments = super().parse(entity, parser)
        arguments['cmd'] = cls.parse_cmdline(entity.get_attr('cmd'), parser)
        arguments['name'] = parser.parse_optional(entity.get_attr('name', optional=True))
        arguments.update(cls.parse_options(entity, parser))
        return cls, arguments

    @classmethod
    def parse_options(cls, entity: Entity, parser: Parser) -> dict[str, Any]:
        """Return the arguments that processes and nodes have in common."""
        options = {
            'prefix': entity.get_attr('launch-prefix', optional=True),
            'cwd': entity.get_attr('cwd', optional=True),
            'output': entity.get_attr('output', optional=True),
            'respawn': entity.get_attr('respawn', data_type=bool, optional=True, can_be_str=True),
            'respawn_delay': entity.get_attr('respawn_delay', data_type=float, optional=True),
            'respawn_max_retries': entity.get_attr(
                'respawn_max_retries', data_type=int, optional=True),
            'sigterm_timeout': entity.get_attr('sigterm_timeout', data_type=float, optional=True),
            'sigkill_timeout': entity.get_attr('sigkill_timeout', data_type=float, optional=True),
            'shell': entity.get_attr('shell', data_type=bool, optional=True),
            'emulate_tty': entity.get_attr('emulate_tty', data_type=bool, optional=True)}
        arguments = {name: parser.parse_optional(value) for name, value in options.items()
                     if value is not None}
        on_exit = entity.get_attr('on_exit', optional=True)
        if on_exit is not None:
            if on_exit != 'shutdown':
                raise ValueError(f"Attribute 'on_exit' of '{entity.type_name}' is '{on_exit}', "
                                 'but must be shutdown')
            arguments['on_exit'] = [Shutdown()]
        arguments['additional_env'] = dict(parser.parse_pairs(entity, 'env'))
        return arguments

    @classmethod
    def parse_cmdline(cls, cmd: str, parser: Parser) -> list[list[Substitution]]:
        """Split a command into words like a shell, but without splitting substitutions."""
        words: list[list[Substitution]] = []
        word: list[Substitution] = []
        for part in parser.parse_substitution(cmd):
            if not isinstance(part, TextSubstitution):
                word.append(part)
                continue
            if part.text[:1].isspace() and word:
                words.append(word)
                word = []
            tokens = shlex.split(part.text)
            for index, token in enumerate(tokens):
                if index > 0:
                    words.append(word)
                    word = []
                word.append(TextSubstitution(text=token))
            if part.text[-1:].isspace() and word:
                words.append(word)
                word = []
        return [*words, word] if word else words
