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

"""The referee and graphs: ours, some with a fault, and some that are hardly any."""

from array import array
from math import nan
import subprocess
import sys
from time import monotonic

from geometry_msgs.msg import PoseStamped, TransformStamped, Twist
import mutants
from nav_msgs.msg import Odometry
from nav_msgs.srv import GetPlan
import pytest
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.tools.graph import Graph
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtle_referee import hands, referee, trial
from turtle_referee.hands import Hands
from turtle_referee.names import Profile
from turtle_referee.observer import fill, Observer
from turtle_referee.rules import BROKEN, KEPT
from turtle_referee.trial import Trial
from turtlesim.msg import Pose
from visualization_msgs.msg import Marker, MarkerArray

END_TIME = 25.0
"""How long (s) an impatient referee may take at most, on a busy machine too."""


# ------------------------------------------------------------------------------- whole graphs

def test_every_requirement_has_a_mutant():
    assert {rule.name for rule in referee.RULES} == {one.row for one in mutants.MUTANTS} - {''}
    for one in mutants.MUTANTS:
        assert set(one.follows) < {rule.name for rule in referee.RULES}
        assert bool(one.follows) is bool(one.why), f'{one.name}: why do others follow?'


def test_every_mutant_changes_something():
    """Change everything, one after another, in a process of its own."""
    pytest.importorskip('robot_state_publisher.node', reason='it is no stand-in here')
    subprocess.run([sys.executable, '-c', (
        'import mutants\n'
        'class Graph:\n'
        '    add = lambda self, kind, **options: None\n'
        'for one in mutants.MUTANTS:\n'
        '    one.change(Graph())')], check=True, cwd=mutants.__file__.rpartition('/')[0])


@pytest.mark.parametrize('name, needs', (
    ('none', (*mutants.REST, mutants.ABOVE, mutants.FAR_OUT)), ('weak-gravity', ())))
def test_faults_are_found(name, needs):
    """Have a look at two; mutants.py has a look at all."""
    one = next(one for one in mutants.MUTANTS if one.name == name)
    assert not mutants.try_out(one, needs=needs or one.needs).fault


# ------------------------------------------------------------------------------- hardly a graph

class Nonsense(Node):
    """Offer everything, and say nothing but a number that makes no sense."""

    def __init__(self, number=nan, **options):
        """Begin to talk."""
        super().__init__('nonsense', **options)
        self.number = number
        self.topics = {kind: self.create_publisher(kind, name, 10) for kind, name in (
            (Twist, 'turtle1/cmd_vel'), (Odometry, 'odom'), (JointState, 'joint_states'),
            (Pose, 'turtle1/pose'), (String, 'robot_description'), (TFMessage, '/tf'),
            (MarkerArray, 'walls'), (Marker, 'brick_marker'), (PoseStamped, 'goal_pose'))}
        self.create_subscription(PoseStamped, 'goal_pose', lambda message: None, 10)
        self.create_subscription(Tilt, 'tilt', lambda message: None, 10)
        self.create_service(Place, 'place', self.agree)
        self.create_service(Trigger, 'drop', self.agree)
        self.create_timer(0.02, self.talk)

    def agree(self, request, response):
        """Say yes."""
        response.success = True
        return response

    def talk(self):
        """Say it."""
        self.number = -self.number
        number, now = self.number, self.get_clock().now().to_msg()
        place = Odometry(child_frame_id='base_link').pose.pose
        place.position.x = place.position.y = place.position.z = number
        place.orientation.w = number
        odometry = Odometry(child_frame_id='base_link')
        odometry.header.frame_id, odometry.header.stamp = 'odom', now
        odometry.pose.pose = place
        twist = Twist()
        twist.linear.x = odometry.twist.twist.linear.x = number
        joints = JointState(name=['wheel_joint'], position=array('d', [number]))
        joints.header.stamp = now
        transforms = []
        for parent, child in (('world', 'odom'), ('odom', 'base_link'), ('base_link', 'platform'),
                              ('world', 'brick')):
            transform = TransformStamped(child_frame_id=child)
            transform.header.frame_id, transform.header.stamp = parent, now
            transform.transform.translation.x = transform.transform.rotation.w = number
            transform.transform.translation.z = number
            transforms.append(transform)
        marker = Marker(type=Marker.CUBE, text='Unreachable', pose=place)
        marker.header.frame_id = 'brick'
        marker.scale.x = marker.scale.z = number
        for message in (twist, odometry, joints, TFMessage(transforms=transforms), marker,
                        Pose(x=number, y=number, theta=number), MarkerArray(markers=[marker] * 4),
                        String(data=f'<robot name="{number}"><link name="base_link"/></robot>'),
                        PoseStamped(pose=place)):
            self.topics[type(message)].publish(message)


@pytest.fixture
def impatient(monkeypatch):
    """Have the referee wait for nothing for long."""
    monkeypatch.setattr(hands, 'PATIENCE', 0.3)
    monkeypatch.setattr(trial, 'PATIENCE', 0.3)
    monkeypatch.setattr(trial, 'IDLE', 0.5)
    monkeypatch.setattr(trial, 'TILTS', trial.TILTS[:1])
    monkeypatch.setattr(trial, 'DROPS', trial.DROPS[:1])


def judge(graph, say=lambda text: None):
    """Return what an impatient referee finds."""
    begin = monotonic()
    observer = graph.add(Observer, parameters=False)
    Trial(graph, observer, 0.3, say, patience=1.0).run()
    found = referee.judge(observer.record)
    assert monotonic() - begin < END_TIME
    assert len(found) == len(referee.RULES)
    return {one.name: one for one in found}


def kept(found):
    """Return the requirements that are kept."""
    return {name for name, one in found.items() if one.mark == KEPT}


def test_nothing_is_judged(domain_id, impatient):
    with Graph(domain_id, quiet=True) as graph:
        found = judge(graph)
    assert kept(found) == set()
    assert found['rate: odom'].mark == found['frames: brick'].mark == BROKEN


def test_turtlesim_alone_is_judged(domain_id, impatient):
    with Graph(domain_id, quiet=True) as graph:
        graph.add_turtlesim()
        found = judge(graph)
    assert kept(found) == set()
    assert found['rate: odom'].measured == 'nothing was heard on odom'


@pytest.mark.parametrize('number', (nan, 1e300))
def test_nonsense_is_judged(domain_id, impatient, number):
    with Graph(domain_id, quiet=True) as graph:
        graph.add(Nonsense, parameters=False, number=number)
        found = judge(graph)
    # The frames have names and parents, whatever their numbers.
    assert kept(found) <= {'frames: world', 'frames: brick', 'frames: broadcasters',
                           'frames: robot', 'text: kind',
                           'walls: to be seen', 'brick marker: to be seen', 'odom: twist',
                           'drop'}


@pytest.mark.parametrize('victim, when, broken', (
    ('robot', 'driving 90', 'drive: goal'),
    ('arena', 'out of reach by far', 'place'),
))
def test_a_node_that_dies_is_judged(domain_id, impatient, victim, when, broken):
    with Graph(domain_id, quiet=True) as graph:
        nodes = {name: getattr(graph, f'add_{name}')() for name in (
            'turtlesim', 'robot_state_publisher', 'robot', 'arena', 'catcher')}
        if nodes[victim] is None:
            pytest.skip(f'{victim} is a process of its own here')

        def say(text):
            if when in text and nodes[victim] is not None:
                graph.remove(nodes[victim])
                nodes[victim] = None

        found = judge(graph, say)
    assert nodes[victim] is None
    assert found[broken].mark != KEPT
    assert 'URDF: base_link' in kept(found)


# --------------------------------------------------------------------------------- other names

class Odd(Node):
    """Place and drop with other names and types."""

    def __init__(self, **options):
        """Wait for requests."""
        super().__init__('odd', **options)
        self.place = None
        self.dropped = False
        self.create_service(GetPlan, 'put', self.on_put)
        self.create_service(Empty, 'let_go', self.on_let_go)

    def on_put(self, request, response):
        """Keep where the brick is put: its start is a PoseStamped."""
        position = request.start.pose.position
        self.place = (position.x, position.y, position.z)
        return response

    def on_let_go(self, request, response):
        """Say nothing."""
        self.dropped = True
        return response


def test_services_may_have_other_names_and_types(domain_id):
    with Graph(domain_id, quiet=True) as graph:
        odd = graph.add(Odd, parameters=False)
        observer = graph.add(Observer, parameters=False, profile=Profile(
            services={'place': 'put', 'drop': 'let_go'}))
        user = Hands(graph, observer)
        place = user.place((1.0, 2.0, 3.0), hovering=0.0)
        drop = user.ask('drop', observer.request_drop, 'drop')
    assert (place.answered, place.accepted, odd.place) == (True, True, (1.0, 2.0, 3.0))
    assert (drop.answered, drop.accepted, odd.dropped) == (True, True, True)


class Flat:
    """A request with x, y and z."""

    x = y = z = 0.0

    def get_fields_and_field_types(self):
        """Name them, as a message does."""
        return {'x': 'double', 'y': 'double', 'z': 'double'}


def test_a_place_is_filled_in_wherever_it_fits():
    flat, request = Flat(), Place.Request()
    assert fill(flat, (1.0, 2.0, 3.0)) and (flat.x, flat.y, flat.z) == (1.0, 2.0, 3.0)
    assert fill(request, (1.0, 2.0, 3.0)) and request.location.z == 3.0
    assert not fill(Trigger.Request(), (1.0, 2.0, 3.0))


def test_a_command_that_ends_at_once_is_told(domain_id, monkeypatch, capfd):
    monkeypatch.setattr(referee.INTERRUPTS, 'take_over', lambda: None)
    begin = monotonic()
    assert referee.main(['--', sys.executable, '-c', 'print("no graph")']) == 2
    said, errors = capfd.readouterr()
    assert said == ''
    assert f'{sys.executable} has ended with status 0: no graph\n' in errors
    assert monotonic() - begin < referee.STARTING / 2.0


def test_what_is_wrong_with_where_one_listens_is_said(domain_id, impatient):
    with Graph(domain_id, quiet=True) as graph:
        observer = graph.add(Observer, parameters=False)
        assert observer.doubts() == []
        for _ in range(2):
            node = graph.add(Node, parameters=False, node_name='twin')
        node.create_publisher(Pose, '/judged/turtle1/pose', 10)
        graph.spin_until(lambda: len(observer.doubts()) == 2, 10.0, 'both doubts')
        assert observer.doubts() == [
            'several nodes are called /twin: do two graphs run here?',
            'a turtle is in the namespace /judged: say --namespace judged']
