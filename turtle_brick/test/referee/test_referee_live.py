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

import sys
from time import monotonic

from mutants import MUTANTS, mutate, PROGRAM
from nav_msgs.srv import GetPlan
from rclpy.node import Node
from std_srvs.srv import Empty, Trigger
from turtle_brick.core.parameters import load
from turtle_brick.tools.graph import Graph
from turtle_referee import referee
from turtle_referee.hands import Hands
from turtle_referee.names import Profile
from turtle_referee.observer import fill, Observer
from turtle_referee.record import Frame
from turtle_referee.rules import BROKEN, KEPT, OPEN
from turtle_referee.trial import FAR_OUT, MEETING, Program, Trial
from turtlesim.msg import Pose

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
    Trial(graph, observer, referee.REACTION, say, **options).run()
    return observer.record


def marks(record, mark):
    """Return the requirements with a mark, and what was measured."""
    return {one.name: one.measured for one in referee.RULES.judge(record) if one.mark == mark}


# ---------------------------------------------------------------------------- ours, and mutants

def test_ours_keeps_every_requirement(domain_id):
    """Have a look at a part of the program that shows something of each."""
    with Graph(domain_id, namespace='judged', quiet=True) as graph:
        add_nodes(graph)
        record = watch(graph, meeting=60.0, program=PROGRAM)
    assert marks(record, BROKEN) == {}
    # Where the machine stood still, what needs time may be open: a brick may have been missed.
    due = {rule.name for rule in referee.RULES
           if not record.held_up() or rule.name.startswith('URDF')}
    assert due <= marks(record, KEPT).keys()


def test_faults_are_found(domain_id, monkeypatch):
    """Each breaks its requirements, and nothing else is; only what follows says so."""
    mutate(monkeypatch)
    with Graph(domain_id, quiet=True) as graph:
        add_nodes(graph)
        record = watch(graph, meeting=60.0, patience=1.5, program=PROGRAM)
    expected = {row: [cause] * (row != cause)
                for cause, *others in (mutant.rows for mutant in MUTANTS)
                for row in (cause, *others)}
    broken = {one.name: one.follows for one in referee.RULES.judge(record) if one.mark == BROKEN}
    if record.held_up():
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
    due = OPEN if record.held_up() else BROKEN
    assert {'drive: goal', 'place'} <= {*marks(record, BROKEN), *marks(record, due)}
    assert {'URDF: base_link', 'walls: size'} <= set(marks(record, KEPT))


# ---------------------------------------------------------------------- where one finds one's way

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


def test_services_may_have_other_names_and_types_and_be_answered_twice(domain_id):
    with Graph(domain_id, quiet=True) as graph:
        odd = graph.add(Odd, parameters=False)
        graph.add(Odd, '-r', '__node:=second', parameters=False)
        observer = graph.add(Observer, parameters=False, profile=Profile(
            services={'place': 'put', 'drop': 'let_go'}))
        user = Hands(graph, observer)
        graph.spin_until(lambda: observer.doubts() == [
            'several nodes serve /put, /let_go: end all but one'], 10.0, 'both are there')
        user.place((4.0, 5.0, 6.0), hovering=0.2)
        place = user.place((1.0, 2.0, 3.0), hovering=0.0)
        drop = user.ask('drop')
        graph.spin_until(lambda: odd.place == (1.0, 2.0, 3.0) and odd.dropped, 10.0, 'both heard')
    assert (place.answered, place.accepted) == (drop.answered, drop.accepted) == (True, True)
    assert not fill(Trigger.Request(), (1.0, 2.0, 3.0))


def test_what_is_wrong_with_where_one_listens_is_said(domain_id):
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
        # Nothing else is asked of this one, whose frames all namespaces hear.
        observer.record.frames['odom'] = Frame(False)
        said = []
        Trial(graph, observer, referee.REACTION, said.append, **HASTE).run()
        assert observer.record.is_empty() and said == ['looking for the graph']


def test_a_command_that_ends_at_once_is_told(domain_id, capfd):
    begin = monotonic()
    assert referee.main(['--', sys.executable, '-c', 'print("no graph")']) == 2
    said, errors = capfd.readouterr()
    assert said == ''
    assert f'{sys.executable} has ended with status 0: no graph\n' in errors
    assert monotonic() - begin < referee.STARTING / 2.0
