# Print the failed tests from `colcon test-result --all --verbose`, and then the sum of the counts in
# the lines about result files:
#   .../pytest.xml: 5 tests, 0 errors, 1 failures, 2 skipped
# The ctest results (Test.xml) are not counted because each ctest test writes its own result file.
# The exit status is 0 if at least one test passed and none failed.

/\.xml: [0-9]+ tests?, / {
  if (!/\/Test\.xml: /) {
    tests += $(NF - 7)
    failed += $(NF - 5) + $(NF - 3)
    skipped += $(NF - 1)
  }
  next
}

!/^Summary: / && NF

END {
  passed = tests - failed - skipped
  printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped
  exit !(passed > 0 && failed == 0)
}
