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

# Report each missing linter that checks Python and CMake packages as a skipped test.
message(STATUS "The PyPI environment contains the linters flake8 and pep257. It does not contain "
  "copyright, lint_cmake and xmllint, nor the linters for C and C++.")
foreach(_linter copyright lint_cmake xmllint)
  if(NOT ament_cmake_${_linter}_FOUND AND
      NOT "ament_cmake_${_linter}" IN_LIST AMENT_LINT_AUTO_EXCLUDE)
    ament_add_test(${_linter} SKIP_TEST COMMAND ament_${_linter})
  endif()
endforeach()
