# SPDX-License-Identifier: Apache-2.0

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
