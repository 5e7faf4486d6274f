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
"""Each of the six launch files is started with launch, used and ended."""

import signal
import sys

from geometry_msgs.msg import Point, Twist
from live_graph import graph, PATIENCE, process
import pytest
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from turtle_brick.core.parameters import default_path
from turtle_brick_interfaces.srv import Place

# The real launch reads its signals from a file, and leaves Python's own handler in place: when its
# KeyboardInterrupt hits a callback of asyncio, that is lost, and launch may say "user interrupted"
# and wait for ever. It did so 6 times of 120 while processes printed, and never without.
LAUNCH = """
import signal
import sys

from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
signal.signal(signal.SIGINT, lambda *_: None)
service = LaunchService(noninteractive=True)  # not only the terminal interrupts
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    AnyLaunchDescriptionSource(sys.argv[1]),
    launch_arguments=[argument.split(':=') for argument in sys.argv[2:]])]))
sys.exit(service.run())
"""


def launched(name, language, domain_id, *arguments):
    """Launch a file in a process, which Ctrl-C ends."""
    path = default_path().parents[1] / 'launch' / f'{name}.launch.{language}'
    return process([sys.executable, '-c', LAUNCH, str(path), *arguments], domain_id, timeout=20.0)


def ended(launching):
    """Interrupt launch, and see that every process has ended by itself; return their number."""
    status = launching.stop(signal.SIGINT)
    assert 'Traceback' not in launching.output
    assert 'escalating' not in launching.output
    clean = launching.output.count('process has finished cleanly')
    # what the middleware has kept from ending: see END_TIME in node_main
    alarmed = launching.output.count(f'exit code {-signal.SIGALRM}')
    assert clean + alarmed == launching.output.count('process started with pid'), launching.output
    assert alarmed or status == 0, launching.output
    return clean + alarmed


def test_show_turtle(domain_id):
    with launched('show_turtle', 'xml', domain_id, 'use_jsp:=jsp', 'view:=none',
                  'namespace:=alice') as launching:
        with graph(domain_id, namespace='alice') as live:
            states = live.record('joint_states', JointState)
            assert live.rates([states], 10) == [pytest.approx(10.0, rel=0.1)]
            live.wait_for(lambda: states.last.name, PATIENCE, 'joints')
            assert states.last.name == ['stem_joint', 'wheel_joint', 'platform_joint']
            assert list(states.last.position) == [0.0] * 3
            live.wait_for(lambda: live.listener.count_publishers('tf'), PATIENCE, 'TF in it')
            assert not live.listener.count_publishers('/tf')
        assert ended(launching) == 2


def test_turtle_arena(domain_id):
    """The robot is commanded at 100 Hz, and catches a brick beside it: all in a namespace."""
    with launched('turtle_arena', 'py', domain_id, 'view:=none', 'namespace:=bob') as launching:
        launching.wait_for_output('waiting for a fall', 30.0)
        with graph(domain_id, namespace='bob') as live:
            commands = live.record('turtle1/cmd_vel', Twist)
            assert live.rates([commands], 100) == [pytest.approx(100.0, rel=0.02)]
            # Beside the robot, and so high that a busy machine has the time to see it fall.
            beside = Place.Request(location=Point(x=6.5, y=6.0, z=20.0))
            assert live.call('place', Place, beside).success
            assert live.call('drop', Trigger).success
            names = {name for name, _ in (*live.listener.get_topic_names_and_types(),
                                          *live.listener.get_service_names_and_types())}
            assert {name for name in names if not name.startswith('/bob/')} == {
                '/parameter_events', '/rosout'}
        launching.wait_for_output('can be caught', PATIENCE)
        launching.wait_for_output(r'arena-\d\].*on the platform', PATIENCE)
        assert ended(launching) == 5
