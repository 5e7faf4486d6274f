# SPDX-License-Identifier: Apache-2.0
"""The action LifecycleNode."""

from typing import Any

from launch import SomeSubstitutionsType
from launch_ros.actions.node import Node


class LifecycleNode(Node):
    """
    Starts a node with a lifecycle, without the events that change and report its state.

    In Python: LifecycleNode(package='lifecycle_py', executable='lifecycle_talker',
                             name='talker', namespace='')
    """

    def __init__(self, *, name: SomeSubstitutionsType, namespace: SomeSubstitutionsType,
                 **kwargs: Any) -> None:
        super().__init__(name=name, namespace=namespace, **kwargs)
