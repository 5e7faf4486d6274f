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
"""The referee and graphs: ours, some with faults, and some that are hardly any."""

from collections import deque
from itertools import count
from math import dist
import sys
from time import monotonic

from geometry_msgs.msg import Quaternion, TransformStamped
from nav_msgs.srv import GetPlan
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_srvs.srv import Empty, Trigger
from turtle_brick.core.parameters import load
from turtle_brick.tools.graph import Graph
from turtle_referee import referee
from turtle_referee.graph_client.client import GraphClient
from turtle_referee.graph_client.constants import CENTER
from turtle_referee.graph_client.observer import fill, Observer
from turtle_referee.graph_client.profile import Profile
from turtle_referee.rules.rule import BROKEN, KEPT, OPEN
from turtle_referee.trial import FAR_OUT, IN_REACH, MEETING, Program, Trial

HASTE = {'program': Program(0.2, 2, (0.5,), (FAR_OUT,)), 'meeting': 0.5, 'patience': 0.3}
"""How a graph is judged that is hardly any."""


def add_nodes(graph):
    """Add the whole exercise to a graph."""
    return {name: getattr(graph, f'add_{name}')() for name in (
        'turtlesim', 'robot_state_publisher', 'robot', 'arena', 'catcher')}


def watch(graph, say=lambda text: None, **options):
    """Have a referee ask a graph for something; return what it heard."""
    observer = graph.add(Observer, parameters=False,
                         profile=Profile.from_parameters(load()))
    Trial(graph, observer, say, **options).run()
    return observer.record


def marks(record, mark):
    """Return the requirements with a mark, and what was measured."""
    return {one.name: one.measured for one in referee.RULES.judge(record) if one.mark == mark}


def test_ours_keeps_every_requirement(domain_id):
    """Have a look at a part of the program that shows something of each."""
    with Graph(domain_id, namespace='judged', quiet=True) as graph:
        add_nodes(graph)
        record = watch(graph, meeting=60.0, program=PROGRAM)
    assert marks(record, BROKEN) == {}
    # Where the machine stood still, what needs time may be open: a brick may have been missed.
    due = {rule.name for rule in referee.RULES
           if not record.stall_summary() or rule.name.startswith('URDF')}
    assert due <= marks(record, KEPT).keys()


# ----------------------------------------------------------------------------- faults of a graph

# Each changes what is published on a topic, whoever publishes it, and so knows no node from
# inside. They do not get in each other's way, and share a graph.

def alter(path, new):
    """Return what gives a field of a message another value."""
    *parts, last = path.split('.')

    def change(message):
        for part in parts:
            message = getattr(message, part)
        setattr(message, last, new(getattr(message, last)))
    return change


def late_stem():
    """Return what turns the stem 0.1 s late: with the motion that is seen."""
    angles = deque(maxlen=10)

    def turn(message):
        angles.append(message.position[0])
        message.position[0] = angles[0]
    return turn


def level_on_the_ground(message):
    """Let the brick lie flat on the ground."""
    for transform in message.transforms:
        if transform.child_frame_id == 'brick' and transform.transform.translation.z < 0.2:
            transform.transform.rotation = Quaternion()


def stay_at_center(message):
    """Send the robot to the center, wherever the brick falls: farther than any other goal."""
    place = message.pose.position
    if dist((place.x, place.y), CENTER) > 1.6:
        place.x, place.y = CENTER


FAULTS = (
    ('frames: world', 'tf_static', alter(
        'transforms', lambda known: [*known, TransformStamped(child_frame_id='lost')])),
    ('rate: joint_states', 'joint_states', lambda _, numbers=count(): next(numbers) % 20 < 19),
    ('cmd_vel: at rest', 'cmd_vel', alter('angular.z', lambda _: 5e-7)),
    ('odom: pose', 'odom', alter('pose.pose.position.x', lambda x: x + 0.06)),
    ('joint_states: velocity', 'joint_states', alter(
        'velocity', lambda of: [of[0], of[1] / 2.0, of[2]])),
    ('drive: stem first', 'joint_states', late_stem()),
    ('walls: size', 'walls', alter('markers', lambda walls: walls[:2])),
    ('tilt', 'tilt', alter('angle', lambda angle: angle / 2.0)),
    ('brick marker: place', 'brick_marker', alter('pose.position.x', lambda x: x + 0.1)),
    ('brick: angle', 'tf', level_on_the_ground),
    ('text: time', 'catcher_marker', alter('lifetime.sec', lambda _: 5)),
    ('verdict: in reach', 'goal_pose', stay_at_center))
"""The requirement that each breaks, its topic, and what changes a message; False leaves it out."""

FOLLOWS = {'tilt': ['rate: joint_states'], 'verdict: kept': ['verdict: in reach']}
"""What may follow from others, and from which."""

PROGRAM = Program(1.0, 3, (0.5, 0.0), (FAR_OUT, IN_REACH))
"""What shows them all."""


def test_faults_are_found(domain_id, monkeypatch):
    """Each breaks its requirement, and nothing else is; only what follows says so."""
    publish = Publisher.publish

    def spoil(publisher, message):
        name = publisher.topic_name.rpartition('/')[2]
        if all(change(message) is not False for _, topic, change in FAULTS if topic == name):
            publish(publisher, message)

    monkeypatch.setattr(Publisher, 'publish', spoil)
    with Graph(domain_id, quiet=True) as graph:
        add_nodes(graph)
        record = watch(graph, meeting=60.0, patience=1.5, program=PROGRAM)
    expected = {**{rule: [] for rule, *_ in FAULTS}, **FOLLOWS}
    broken = {one.name: one.follows for one in referee.RULES.judge(record) if one.mark == BROKEN}
    if record.stall_summary():
        assert {'frames: world', 'odom: pose', 'walls: size'} <= broken.keys() <= expected.keys()
    else:
        assert broken == expected


# ------------------------------------------------------------------------- what is hardly a graph

def test_nodes_that_die_are_judged(domain_id):
    """The robot as it is sent on its way, and the arena before it is asked for anything."""
    dying = {'driving 0': 'robot', 'out of reach by far': 'arena'}
    with Graph(domain_id, quiet=True) as graph:
        nodes = add_nodes(graph)

        def say(text):
            for when in [when for when in dying if when in text]:
                graph.remove(nodes[dying.pop(when)])

        record = watch(graph, say, **{**HASTE, 'meeting': MEETING})
    assert not dying
    due = OPEN if record.stall_summary() else BROKEN
    assert {'drive: goal', 'place'} <= {*marks(record, BROKEN), *marks(record, due)}
    assert {'URDF: base_link', 'walls: size'} <= set(marks(record, KEPT))


# ---------------------------------------------------------------------- where one finds one's way

class Odd(Node):
    """Place and drop with other names and types; a place is the PoseStamped of a plan's start."""

    def __init__(self, **options):
        """Wait for requests."""
        super().__init__('odd', **options)
        self.heard = []
        for name, kind in (('put', GetPlan), ('let_go', Empty)):
            self.create_service(kind, name, self.on_request)

    def on_request(self, request, response):
        """Keep what is asked for."""
        self.heard.append(request)
        return response


def test_services_may_have_other_names_and_types_and_be_answered_twice(domain_id):
    with Graph(domain_id, quiet=True) as graph:
        odds = [graph.add(Odd, '-r', f'__node:={name}', parameters=False)
                for name in ('odd', 'second')]
        observer = graph.add(Observer, parameters=False, profile=Profile(
            services={'place': 'put', 'drop': 'let_go'}))
        user = GraphClient(graph, observer)
        graph.spin_until(lambda: all(
            observer.count_services(name) == 2 for name in ('put', 'let_go')), 10.0, 'both')
        asks = [user.place((1.0, 2.0, 3.0), hovering=0.2), user.ask('drop')]
        graph.spin_until(lambda: all(len(odd.heard) == 2 for odd in odds), 10.0, 'all heard')
    position = odds[0].heard[0].start.pose.position
    assert (position.x, position.y, position.z) == (1.0, 2.0, 3.0)
    assert all(ask.accepted for ask in asks)
    assert not fill(Trigger.Request(), (1.0, 2.0, 3.0))


def test_nothing_is_asked_of_a_graph_in_another_namespace(domain_id):
    """Its frames are heard, since all namespaces may share TF."""
    said = []
    with Graph(domain_id, namespace='elsewhere', quiet=True) as graph:
        graph.add_turtlesim()
        graph.add_robot()
        graph.namespace = ''
        record = watch(graph, said.append, **{**HASTE, 'meeting': 4.0})
    assert record.frames and record.is_empty() and said == ['looking for the graph']
    assert 'name its namespace with --namespace' in record.notes[0]


def test_a_command_that_ends_at_once_is_told(domain_id, capfd):
    begin = monotonic()
    assert referee.main(['--', sys.executable, '-c', 'print("no graph")']) == 2
    said, errors = capfd.readouterr()
    assert said == ''
    assert f'{sys.executable} has ended with status 0: no graph\n' in errors
    assert monotonic() - begin < referee.STARTING / 2.0
