# SPDX-License-Identifier: Apache-2.0

"""Test that the graph recovers when a node is killed and started again."""

from contextlib import AbstractContextManager
from time import monotonic

from live_graph import LATCHED, LiveGraph, NodeProcess, process, TIMEOUT
from live_nodes import Recording
from std_msgs.msg import String
from std_srvs.srv import Trigger
from turtle_brick_interfaces.srv import Place
from turtle_brick_tools.graph import executable

BRICK = (3.0, 5.0, 20.0)
"""Position (m) from which a brick is easy to catch, even on a busy machine."""

READY = {'arena': 'To place and drop the brick', 'catcher': 'Found the robot'}
"""Output of a node that is ready for a drop."""


def start(name: str, live: LiveGraph) -> AbstractContextManager[NodeProcess]:
    command = [executable('turtle_brick', name), '--ros-args', '--params-file',
               str(live.params_file)]
    return process(command, live.domain_id, stop=None)


def test_the_next_brick_is_caught_after_a_node_was_killed(live):
    """Kill the catcher while the robot carries a brick, and the arena while a brick falls."""
    brick_state = live.record('brick_state', String, LATCHED)
    catcher_state = live.record('catcher_state', String, LATCHED)

    def wait_for(states: Recording, expected: str) -> None:
        live.wait_for(lambda: states.last and states.last.data == expected, TIMEOUT, expected)

    def drop() -> None:
        request = Place.Request()
        location = request.location
        location.x, location.y, location.z = BRICK
        live.wait_for(lambda: live.call('place', Place, request).success, TIMEOUT, 'place')
        wait_for(brick_state, 'hovering')
        wait_for(catcher_state, 'waiting')
        earlier = len(brick_state.messages)

        def has_fallen() -> bool:
            return String(data='falling') in brick_state.messages[earlier:]

        # A request that is repeated because the response is lost has no success.
        live.wait_for(lambda: live.call('drop', Trigger).success or has_fallen(), TIMEOUT, 'drop')
        live.wait_for(has_fallen, TIMEOUT, 'falling')

    def catch() -> None:
        deadline = monotonic() + TIMEOUT
        while brick_state.last.data != 'riding':
            assert monotonic() < deadline, 'no brick is caught'
            live.wait_for(lambda: brick_state.last.data in ('riding', 'grounded'), TIMEOUT,
                          'the brick lands')
            if brick_state.last.data == 'grounded':  # A busy machine may be late.
                drop()

    def wait_until_ready(name: str, node: NodeProcess) -> None:
        live.wait_for(lambda: READY[name] in node.output, TIMEOUT, READY[name])

    live.add_turtlesim()
    live.add_robot_state_publisher()
    live.add_robot()
    with start('arena', live) as arena:
        with start('catcher', live) as catcher:
            wait_until_ready('arena', arena)
            wait_until_ready('catcher', catcher)
            drop()
            catch()
            catcher.kill()
        with start('catcher', live) as catcher:
            wait_until_ready('catcher', catcher)
            drop()
            arena.kill()
            with start('arena', live) as arena:
                wait_until_ready('arena', arena)
                drop()
                catch()
                wait_for(brick_state, 'floating')
