# SPDX-License-Identifier: BSD-3-Clause
# When each test runs beside others. Tests wait for half of their time, for processes to start and for clocks: scripts/test
# starts three on two cores.

get_property(tests DIRECTORY PROPERTY TESTS)

# The longest first, so that none is alone at the end; CTest knows by itself only what they took the time before [s].
set(COSTS pages.test 210 forged_bags.test 130 piecewise_linear_test 80 flow_test 70 derivative_test 70 friction_test 70
  python-report_browser_test 70 python-package_test 60 site 60 trajectory_optimization_test 50 oracle_test 50)
while(COSTS)
  list(POP_FRONT COSTS name seconds)
  foreach(test ${tests})
    if(test MATCHES "(^|_)${name}$")
      set_tests_properties(${test} PROPERTIES COST ${seconds})
    endif()
  endforeach()
endwhile()

# What asks when something happens has nothing beside it, or one other that waits more than it works, behind all others.
if(NOT CONTACT_FLOW_ROS)
  return()
endif()
foreach(list ALONE TWO_AT_A_TIME)
  list(TRANSFORM ${list} PREPEND _ctest_${PROJECT_NAME}_rostest_test_ros_)
  list(TRANSFORM ${list} APPEND .test)
endforeach()
set_tests_properties(${ALONE} PROPERTIES RUN_SERIAL ON)
set_tests_properties(_ctest_${PROJECT_NAME}_rostest_test_ros_pages.test PROPERTIES TIMEOUT 900)   # every printed command
set(others ${tests})
foreach(folder adversary fuzz)
  get_property(more DIRECTORY ${folder} PROPERTY TESTS)
  list(APPEND others ${more})
endforeach()
list(REMOVE_ITEM others ${ALONE} ${TWO_AT_A_TIME})
set(lane 0)
foreach(test ${TWO_AT_A_TIME})
  set_tests_properties(${test} PROPERTIES DEPENDS "${others}" RESOURCE_LOCK keeps_time_${lane})
  math(EXPR lane "1 - ${lane}")
endforeach()
