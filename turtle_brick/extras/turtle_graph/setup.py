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
"""Install the package turtle_graph."""

from setuptools import find_packages, setup

package_name = 'turtle_graph'


setup(
    name=package_name,
    version='1.0.0',
    packages=find_packages(include=[f'{package_name}*']),
    package_data={package_name: ['referee/*.launch.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    zip_safe=True,
    maintainer='the turtle_brick developers',
    maintainer_email='maintainers@turtle-brick.example',
    description='A client, a page in the browser and a referee for any graph with a turtle_brick',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'referee = turtle_graph.programs:referee',
            'viewer = turtle_graph.programs:viewer',
        ],
    },
)
