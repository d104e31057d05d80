# SPDX-License-Identifier: BSD-3-Clause
# Installs this build to prefixes that are not those of configure time, and builds packages of users
# against them, which is what the scripts say.
set(here ${CMAKE_CURRENT_LIST_DIR})
add_test(NAME consumer_plain COMMAND bash ${here}/test_plain ${PROJECT_BINARY_DIR})
set_tests_properties(consumer_plain PROPERTIES TIMEOUT 600)
if(CONTACT_FLOW_ROS)
  add_test(NAME consumer_overlay COMMAND bash ${here}/test_overlay ${PROJECT_BINARY_DIR})
  set_tests_properties(consumer_overlay PROPERTIES TIMEOUT 600)
endif()
