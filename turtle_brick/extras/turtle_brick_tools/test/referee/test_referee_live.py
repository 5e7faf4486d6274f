# SPDX-License-Identifier: Apache-2.0
"""Test the referee on incomplete and unusual live graphs."""

from pathlib import Path
import sys
from time import monotonic, time_ns

from geometry_msgs.msg import Point, Twist
from live_graph import add_nodes, LiveGraph, observe, results, TIMEOUT
from nav_msgs.srv import GetPlan
import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Empty
from std_srvs.srv import Trigger
from turtle_brick.core.parameters import default_path
from turtle_brick_tools.graph import Graph
from turtle_graph.client.client import GraphClient
from turtle_graph.client.domains import DomainError, is_empty, reserved_domain
from turtle_graph.client.load import Window
from turtle_graph.client.messages import NS_PER_SECOND
from turtle_graph.client.observer import Observer
from turtle_graph.client.profiles import NUMBERS, Profile, TURTLE_COMMANDS
from turtle_graph.client.record import LOADED
from turtle_graph.referee import referee
from turtle_graph.referee.rules.rule import FAILED, MET, OPEN
from turtle_graph.referee.trial import FAR_OUT, Program, Trial
from turtlesim.msg import Pose
from turtlesim.srv import TeleportRelative
from visualization_msgs.msg import Marker, MarkerArray

SHORT = {'program': Program(0.2, 2, (0.5,), (FAR_OUT,)), 'discovery_time': 0.5, 'timeout': 0.3}


def test_nodes_that_die_are_judged(domain_id):
    ends = {'driving 0': 'robot', 'far out of reach': 'arena'}
    with Graph(domain_id, quiet=True) as graph:
        nodes = add_nodes(graph)

        def end_node(text):
            for event in [event for event in ends if event in text]:
                graph.remove(nodes[ends.pop(event)])

        record = observe(graph, end_node, **{**SHORT, 'discovery_time': TIMEOUT})
    assert not ends
    found = results(record)
    # A request may be open although all trials are calm.
    expected = FAILED if all(window.calm for window in record.windows) else OPEN
    assert {'drive: goal', 'place'} <= found[FAILED].keys() | found[expected].keys()
    assert {'URDF: base_link', 'walls: size'} <= found[MET].keys()


class Unusual(Node):
    """A node whose topics and services have unusual names and types."""

    def __init__(self, **options):
        super().__init__('unusual', **options)
        self.received = []
        for name, kind in (('arena/place_brick', GetPlan), ('arena/drop', TeleportRelative),
                           ('let_go', Trigger)):
            self.create_service(kind, name, self.on_request)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for name, kind in (('goal', Point), ('tilt_it', Empty)):
            self.create_subscription(kind, name, self.received.append, latched)

    def on_request(self, request, response):
        self.received.append(request)
        return response


def test_unusual_names_and_types_are_recognized(domain_id):
    with Graph(domain_id, quiet=True) as graph:
        nodes = [graph.add(Unusual, '-r', f'__node:={name}', parameters=False)
                 for name in ('unusual', 'second')]
        # The middleware reports this name for an undiscovered node.
        graph.add(Node, parameters=False, node_name='_NODE_NAME_UNKNOWN_')
        observer = graph.add(Observer, parameters=False)
        client = GraphClient(graph, observer)
        graph.spin_until(lambda: all(observer.count_services(f'arena/{name}') == 2
                                     for name in ('drop', 'place_brick')), TIMEOUT, 'both nodes')
        observer.recognize_names()
        requests = [client.place((1.0, 2.0, 3.0), hovering=0.2), client.call('drop')]
        observer.record.profile.services['drop'] = 'let_go'
        requests.append(client.call('drop'))  # The response contains False, but no message.
        graph.spin_until(lambda: observer.send_goal(4.0, 5.0) and all(
            any(isinstance(one, Point) for one in node.received) for node in nodes),
            TIMEOUT, 'goals')
        publishers = observer.record.publishers
        graph.spin_until(lambda: len(publishers.get('/rosout', ())) > 1, TIMEOUT, 'publishers')
        assert not observer.send_tilt(0.5)
        observer.record_users()
    place, drop, _, goal = nodes[0].received[:4]
    position = place.start.pose.position
    assert (position.x, position.y, position.z) == (1.0, 2.0, 3.0)
    assert (drop.linear, goal.x, goal.y) == (pytest.approx(NUMBERS['gravity_accel']), 4.0, 5.0)
    assert all(request.accepted for request in requests)
    assert 'assumed: goal_pose is /goal (geometry_msgs/msg/Point)' in observer.record.notes
    assert publishers['/rosout'] == {'/unusual', '/second'}
    for name in ('/goal', '/arena/drop'):
        assert observer.record.users[name] == {'/unusual', '/second'}
    assert observer.record.unclear == {'tilt': 'the type of /tilt_it has no suitable field'}


def test_large_messages_are_skipped(domain_id):
    with LiveGraph(domain_id) as live:
        observer = live.add(Observer, parameters=False)
        publisher = live.publisher('flood', MarkerArray, 30)
        live.wait_for(lambda: publisher.get_subscription_count() == 1, TIMEOUT, 'the observer')
        message = MarkerArray(markers=[Marker(id=number) for number in range(2000)])
        for _ in range(30):
            publisher.publish(message)
        live.wait_for(lambda: observer.poller.skipped, TIMEOUT, 'a flood')
    assert len(observer.record.markers) < 30 * 2000


def test_the_commands_for_a_remapped_turtlesim_are_found(domain_id):
    with LiveGraph(domain_id) as live:
        observer = live.add(Observer, parameters=False)
        topics = observer.record.profile.topics
        live.listener.create_publisher(Twist, 'cmd_vel', 10)
        pose = live.publisher('turtle1/pose', Pose)
        turtlesim = live.listener.create_subscription(Twist, TURTLE_COMMANDS, print, 10)
        live.wait_for(lambda: pose.publish(Pose()) or observer.record.topics['pose'], TIMEOUT,
                      'a pose')
        observer.subscribe_to_new_topics()
        assert topics['cmd_vel'] == TURTLE_COMMANDS
        live.listener.destroy_subscription(turtlesim)
        live.wait_for(lambda: topics['cmd_vel'] == 'cmd_vel', TIMEOUT, 'the other topic')


def test_several_publishers_of_a_pose_are_named(domain_id):
    with Graph(domain_id, quiet=True) as graph:
        for _ in range(2):
            graph.add_turtlesim()
        observer = graph.add(Observer, parameters=False)
        graph.spin_until(lambda: observer.find_duplicates() or 'pose' in observer.record.unclear,
                         TIMEOUT, 'the names of both publishers')
    assert observer.record.unclear['pose'].startswith('2 nodes publish turtle1/pose: /')


def test_a_graph_in_another_namespace_is_not_used(domain_id):
    logged = []
    with Graph(domain_id, namespace='elsewhere', quiet=True) as graph:
        graph.add_turtlesim()
        graph.add_robot()
        graph.namespace = ''
        observer = graph.add(Observer, parameters=False)
        graph.spin_until(lambda: observer.record.frames and observer.other_namespaces(), TIMEOUT,
                         'the frames of the other namespace')
        Trial(graph, observer, logged.append, **SHORT).run()
    assert {line.partition(' ')[0] for line in logged} == {'looking', 'waiting'}
    assert 'pass the namespace of the graph with --namespace' in observer.record.notes[0]


def test_a_trial_is_repeated_until_it_is_calm(domain_id):
    logged = []

    def log(text):
        logged.append(text)
        loaded = logged.count('at rest') < 3
        observer.record.windows[:] = [Window(0, time_ns() + 3600 * NS_PER_SECOND, 0.3)] * loaded

    with Graph(domain_id, quiet=True) as graph:
        graph.add_turtlesim()
        graph.add_robot()
        observer = graph.add(Observer, parameters=False)
        program = Program(idle=0.3, legs=0, tilts=(), drops=(), repetitions=3)
        Trial(graph, observer, log, **{**SHORT, 'program': program}).run()
    rests, calm = len(observer.record.idle), bool(observer.record.calm().idle)
    assert (rests, calm) == (3, True) or rests == 4  # On a busy machine, no trial may be calm.
    assert logged.count(f'repeating trials because {LOADED}') == rests - 1


def test_a_graph_that_its_command_starts_in_a_namespace_is_judged(domain_id, monkeypatch):
    namespaces = []

    def run(trial):
        namespaces.append(trial.observer.get_namespace())
        trial.wait_until(lambda: len(namespaces) == 2 or trial.observer.other_namespaces(),
                         TIMEOUT)

    monkeypatch.setattr(referee.Trial, 'run', run)
    arena = [sys.executable, '-c', 'from turtle_brick.arena import main; main()', '--ros-args',
             '-r', '__ns:=/elsewhere', '--params-file', str(default_path())]
    options, command = referee.parse(['--', *arena])
    referee.observe(Profile(), options, command, print, Program(), '')
    assert namespaces == ['/', '/elsewhere']


def test_a_command_that_ends_at_once_is_reported(domain_id, monkeypatch, capfd):
    monkeypatch.setattr('turtle_graph.referee.referee.START_TIME', TIMEOUT)
    monkeypatch.setattr('turtle_graph.client.client.MAX_TIMEOUT', TIMEOUT)
    begin = monotonic()
    assert referee.main(['--', sys.executable, '-c', 'print("no graph")']) == 2
    assert monotonic() < begin + TIMEOUT
    printed, errors = capfd.readouterr()
    assert printed == ''
    assert f'{Path(sys.executable).name} exited with status 0: no graph\n' in errors


def test_a_reserved_domain_has_no_other_reservation_and_no_node():
    with reserved_domain() as first, reserved_domain() as second:
        assert first != second and {first, second} <= set(range(1, 101))
        with pytest.raises(DomainError, match='in use'), reserved_domain([first, second]):
            pass
    with reserved_domain([first, second]) as reserved:
        assert reserved == first
    lower, upper = LiveGraph(first), LiveGraph(first)
    with upper:
        with lower:  # Closing `lower` releases the first DDS port of the domain.
            pass
        with pytest.raises(DomainError, match='in use'), reserved_domain([first]):
            pass
    assert is_empty(first)
