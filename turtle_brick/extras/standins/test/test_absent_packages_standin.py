# SPDX-License-Identifier: Apache-2.0
"""Test what the stand-ins for absent packages say about them."""

from importlib import import_module
import os
from pathlib import Path
import re
import subprocess

from ament_index_python import PackageNotFoundError
from launch_ros.substitutions import FindPackageShare
import pytest
from ros2pkg.api import get_executable_paths


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
