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

find_package(ament_cmake_test QUIET REQUIRED)

# Add a test for each linter that is a test dependency of the calling package. When CMake finds a
# package that contains a linter, the package registers an extension that adds the test.
macro(ament_lint_auto_find_test_dependencies)
  if(NOT _AMENT_PACKAGE_NAME)
    ament_package_xml()
  endif()
  foreach(_dependency ${${PROJECT_NAME}_TEST_DEPENDS})
    find_package(${_dependency} QUIET)
  endforeach()
  ament_execute_extensions(ament_lint_auto EXCLUDE ${AMENT_LINT_AUTO_EXCLUDE})
endmacro()
