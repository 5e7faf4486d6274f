# Add up the output of `colcon test-result --all`, which has one line per result file:
#   .../pytest.xml: 5 tests, 0 errors, 1 failures, 2 skipped
# The results of ctest (Test.xml) are not counted because its tests write their own result files.
# The status is 0 if there were tests and none failed.

/\.xml: [0-9]+ tests?, / && !/\/Test\.xml: / {
  tests += $(NF - 7)
  failed += $(NF - 5) + $(NF - 3)
  skipped += $(NF - 1)
}

END {
  passed = tests - failed - skipped
  printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped
  exit !(passed > 0 && failed == 0)
}
