# SPDX-License-Identifier: Apache-2.0
"""Test which programs are started with this Python."""

import sys

import pytest
from turtle_graph.client.children import with_this_python


@pytest.mark.parametrize('first_line, options', [
    ('#!/usr/bin/python3', []), ('#! /opt/a/bin/python3.12 -u', ['-u']),
    ('#!/usr/bin/env python3', []), ('#!/bin/sh', None), ('#!/usr/bin/env -S python3 -u', None),
    ('\x7fELF\xff', None)])
def test_python_scripts_are_started_with_this_python(first_line, options, tmp_path):
    program = tmp_path / 'program'
    program.write_text(f'{first_line}\npass\n', encoding='latin-1')
    assert with_this_python(str(program)) == [str(program)]  # It is not executable.
    program.chmod(0o755)
    assert with_this_python(str(program)) == (
        [str(program)] if options is None else [sys.executable, *options, str(program)])


def test_a_program_on_the_path_is_started_as_it_is():
    assert with_this_python('python3') == ['python3']
