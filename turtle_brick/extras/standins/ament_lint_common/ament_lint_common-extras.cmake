# SPDX-License-Identifier: Apache-2.0

ament_register_extension(ament_lint_auto ament_lint_common missing_linters.cmake)
