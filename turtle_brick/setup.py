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
"""Install the package turtle_brick."""

from glob import glob

from setuptools import find_packages, setup

package_name = 'turtle_brick'


setup(
    name=package_name,
    version='1.0.0',
    packages=find_packages(include=[f'{package_name}*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*.*')),
        (f'share/{package_name}/launch', glob('launch/*.*')),
        (f'share/{package_name}/urdf', glob('urdf/*.*')),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer='the turtle_brick developers',
    maintainer_email='maintainers@turtle-brick.example',
    description='A turtlesim robot, modeled as a self-balancing unicycle with a platform, '
    'catches a brick dropped from the sky, carries it to the center of the arena and tips it off',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'arena = turtle_brick.programs:arena',
            'catcher = turtle_brick.programs:catcher',
            'turtle_robot = turtle_brick.programs:turtle_robot',
        ],
    },
)
