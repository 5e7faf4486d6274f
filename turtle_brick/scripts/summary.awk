# Counts what `colcon test-result --all` prints, a line for each result file:
#   .../pytest.xml: 5 tests, 0 errors, 1 failures, 2 skipped
# Those of ctest are left out: what it runs writes a file of its own. The status is 0 if there were
# tests and none failed.

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
