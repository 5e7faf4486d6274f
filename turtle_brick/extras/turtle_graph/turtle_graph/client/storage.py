# SPDX-License-Identifier: Apache-2.0
"""Save a record of a graph, and load it without the graph and without its interfaces."""

import gzip
from pathlib import Path
import pickle
from types import SimpleNamespace
from typing import Any

from turtle_graph.client.record import Record

NAMES = {
    'turtle_graph.client.drops': {'DropWatch'}, 'turtle_graph.client.geometry': {'Pose'},
    'turtle_graph.client.load': {'Window'}, 'turtle_graph.client.profiles': {'Profile'},
    'turtle_graph.client.record': {
        'Drive', 'Frame', 'Received', 'ReceivedMarker', 'Record', 'Request', 'Sample'},
    'types': {'SimpleNamespace'}, 'collections': {'deque'},
    'array': {'array', '_array_reconstructor'},
    'numpy': {'ndarray', 'dtype'}, 'numpy.core.multiarray': {'_reconstruct', 'scalar'},
    'numpy._core.multiarray': {'_reconstruct', 'scalar'},
    'numpy._core.numeric': {'_frombuffer'}, 'numpy.core.numeric': {'_frombuffer'}}
"""Names of all classes and functions that a file may use, by module."""


class Loader(pickle.Unpickler):
    """An unpickler that calls no function except those in NAMES, whoever wrote the file."""

    def find_class(self, module: str, name: str) -> Any:
        """Return a class or function, or raise UnpicklingError if it is not in NAMES."""
        if name not in NAMES.get(module, ()):
            raise pickle.UnpicklingError(f'{module}.{name} does not belong in a record')
        return super().find_class(module, name)


class Saver(pickle.Pickler):
    """A pickler that replaces each message by a SimpleNamespace with the same fields."""

    def reducer_override(self, value: Any) -> Any:
        """Return how to restore a message, or NotImplemented for any other value."""
        if not hasattr(type(value), 'get_fields_and_field_types'):
            return NotImplemented
        fields = {name: getattr(value, name) for name in value.get_fields_and_field_types()}
        return SimpleNamespace, (), fields


def save(record: Record, path: Path) -> None:
    """Save a record in a compressed file."""
    with gzip.open(path, 'wb', 3) as file:
        Saver(file, protocol=4).dump(record)


def load(path: Path) -> Record:
    """Load a record, or raise ValueError if the file does not contain one."""
    try:
        with gzip.open(path) as file:
            record = Loader(file).load()
    except (OSError, EOFError, pickle.UnpicklingError, ImportError, AttributeError) as error:
        raise ValueError(f'{path} is not a record from the referee: {error}') from None
    if not isinstance(record, Record):
        raise ValueError(f'{path} is not a record from the referee')
    return record
