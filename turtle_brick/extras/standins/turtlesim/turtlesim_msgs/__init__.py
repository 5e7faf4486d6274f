# SPDX-License-Identifier: Apache-2.0
"""The interfaces of turtlesim under the name that they have in later releases of ROS."""

import warnings

warnings.warn('turtlesim_msgs came after ROS 2 Jazzy, where turtlesim has these interfaces. This '
              'stand-in provides them, but on Jazzy only "from turtlesim.msg import ..." works',
              stacklevel=2)
