# SPDX-License-Identifier: Apache-2.0
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
