# SPDX-License-Identifier: Apache-2.0
"""Install the package turtle_brick_tools."""

from glob import glob

from setuptools import find_packages, setup

package_name = 'turtle_brick_tools'


setup(
    name=package_name,
    version='1.0.0',
    packages=find_packages(include=[f'{package_name}*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/launch', glob('launch/*.*')),
    ],
    install_requires=['setuptools'],
    extras_require={
        'test': ['pytest'],
        'dask': ['distributed==2026.8.0'],  # for sweep --dask
    },
    zip_safe=True,
    maintainer='the turtle_brick developers',
    maintainer_email='maintainers@turtle-brick.example',
    description='Programs that use the package turtle_brick: demo, sweep, benchmark and lesson',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'benchmark = turtle_brick_tools.programs:benchmark',
            'demo = turtle_brick_tools.programs:demo',
            'lesson = turtle_brick_tools.lesson.__main__:main',
            'sweep = turtle_brick_tools.programs:sweep',
        ],
    },
)
