# SPDX-License-Identifier: Apache-2.0

# Report each missing linter that checks Python and CMake packages as a skipped test.
message(STATUS "The PyPI environment contains the linters flake8 and pep257. It does not contain "
  "copyright, lint_cmake and xmllint, nor the linters for C and C++.")
foreach(_linter copyright lint_cmake xmllint)
  if(NOT ament_cmake_${_linter}_FOUND AND
      NOT "ament_cmake_${_linter}" IN_LIST AMENT_LINT_AUTO_EXCLUDE)
    ament_add_test(${_linter} SKIP_TEST COMMAND ament_${_linter})
  endif()
endforeach()
