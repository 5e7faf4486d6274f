# SPDX-License-Identifier: Apache-2.0
"""Compare the stand-ins for absent modules with recordings of the real tf2_geometry_msgs."""

from importlib import import_module
import json
import os
from pathlib import Path
import re
import subprocess

from ament_index_python import PackageNotFoundError
from geometry_msgs.msg import (Point32, PointStamped, PolygonStamped, Pose, PoseStamped,
                               PoseWithCovarianceStamped, TransformStamped, TwistStamped,
                               Vector3Stamped)
from launch_ros.substitutions import FindPackageShare
import pytest
from ros2pkg.api import get_executable_paths
import tf2_geometry_msgs
from tf2_ros import Buffer, LookupException, TypeException

CALLS = json.loads((Path(__file__).parent / 'data/tf2/tf2_geometry_msgs.json').read_text())
MESSAGES = {'point': PointStamped, 'vector3': Vector3Stamped, 'pose': Pose,
            'pose_stamped': PoseStamped, 'polygon_stamped': PolygonStamped,
            'pose_with_covariance_stamped': PoseWithCovarianceStamped}


def fields(message):
    return [name for name in message.get_fields_and_field_types() if name != 'header']


def fill(message, numbers):
    """Set all numbers in a message to those of an iterator, and return the message."""
    if isinstance(message, PolygonStamped):
        message.polygon.points = [Point32(), Point32()]
    for name in fields(message):
        value = getattr(message, name)
        if isinstance(value, float):
            setattr(message, name, next(numbers))
        elif name == 'covariance':
            setattr(message, name, [next(numbers) for _ in value])
        else:
            for each in value if isinstance(value, list) else [value]:
                fill(each, numbers)
    return message


def flat(value):
    """Return all numbers in a message."""
    if isinstance(value, float):
        return [value]
    parts = [getattr(value, name) for name in fields(value)] if hasattr(value, 'SLOT_TYPES') else (
        value)
    return [number for part in parts for number in flat(part)]


def transform(numbers):
    message = TransformStamped(child_frame_id='source')
    message.header.frame_id, message.header.stamp.sec = 'target', 5
    fill(message.transform, iter(numbers))
    return message


@pytest.mark.parametrize('call', CALLS, ids=lambda call: call['function'])
def test_messages_are_transformed_as_by_the_real_package(call):
    function = getattr(tf2_geometry_msgs, call['function'])
    message = fill(MESSAGES[call['function'].removeprefix('do_transform_')](),
                   iter(call['message']))
    result = function(message, transform(call['transform']))
    assert flat(result) == pytest.approx(call['result'], abs=1e-6)
    assert isinstance(result, Pose) or result.header.frame_id == 'target'


def test_buffer_transforms_messages():
    buffer = Buffer()
    buffer.set_transform_static(transform([1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.0]), '')
    point = PointStamped()
    point.header.frame_id, point.point.x, point.header.stamp.sec = 'source', 4.0, 7
    result = buffer.transform(point, 'target')
    assert flat(result) == pytest.approx([-3.0, 2.0, 3.0])
    assert result.header.stamp.sec == 7 and result.header.frame_id == 'target'
    with pytest.raises(LookupException, match='"nowhere"'):
        buffer.transform(point, 'nowhere')
    with pytest.raises(TypeException, match='TwistStamped.* is not loaded or supported'):
        buffer.transform(TwistStamped(), 'target')


def test_a_package_that_the_environment_lacks_is_explained():
    for module in ('action_tutorials_interfaces', 'PyKDL', 'rqt_gui'):
        with pytest.raises(ImportError, match=f'^{module} is not available in this .* fault'):
            import_module(module)
    with pytest.raises(ModuleNotFoundError, match="^No module named 'rospy'"):
        import_module('rospy')
    for find, error in (
            (FindPackageShare('joy').find, PackageNotFoundError),
            (get_executable_paths, RuntimeError)):
        with pytest.raises(error, match='joy is not available in this environment.* fault'):
            find('joy')
        with pytest.raises(error, match="ackage 'joi' not found"):
            find('joi')


def find_package(package, folder):
    """Look for a package twice with CMake, and return the finished process."""
    (folder / 'CMakeLists.txt').write_text(
        f'cmake_minimum_required(VERSION 3.8)\nproject(p NONE)\nfind_package({package} QUIET)\n'
        f'message("found: ${{{package}_FOUND}}")\nfind_package({package} REQUIRED)\n')
    return subprocess.run(['cmake', '-S', folder, '-B', folder / 'build'], text=True,
                          capture_output=True)


@pytest.mark.parametrize('package, sentence', [
    ('rclcpp', 'Only Python nodes run here.'), ('catkin', 'belongs to ROS 1'),
    ('map_msgs', 'your workspace is not at fault.'), ('turtlesim_msgs', 'came after ROS 2 Jazzy'),
    ('ament_cmake_auto', 'your workspace is not at fault.')])
def test_a_cmake_package_that_the_environment_lacks_is_explained(package, sentence, tmp_path):
    done = find_package(package, tmp_path)
    assert done.returncode == 1
    assert 'found: 0' in done.stderr or 'found: FALSE' in done.stderr
    assert sentence in re.sub(r'\s+', ' ', done.stderr)
    assert done.stderr.count('CMake Error') == 1


@pytest.mark.parametrize('package', ['urdf', 'rviz_common', 'tf2'])
def test_a_cmake_package_that_only_nodes_in_cpp_use_is_empty(package, tmp_path):
    done = find_package(package, tmp_path)
    assert (done.returncode, done.stderr) == (0, 'found: 0\n')
    assert f'-- {package} is an empty package in this environment' in done.stdout


def test_every_cmake_package_of_the_desktop_variant_is_found_or_explained():
    packages = (Path(__file__).parent / 'data/desktop_packages.txt').read_text().split()
    prefixes = os.environ['CMAKE_PREFIX_PATH'].split(os.pathsep)
    found = {path.parents[1].name for prefix in prefixes
             for path in Path(prefix).glob('share/*/cmake/*onfig.cmake')}
    # only ros.bash builds example_interfaces
    assert 'urdf' in packages and set(packages) - {'example_interfaces'} <= found
