# SPDX-License-Identifier: BSD-3-Clause
# Tests of the Python module: every file of test/python, with the built package on the path.
if(NOT CONTACT_FLOW_WITH_PYTHON)
  return()
endif()
# Models of one's own in C++, in a library that Python loads.
add_library(python_test_models MODULE ${PROJECT_SOURCE_DIR}/test/python/friction_models.cc)
target_include_directories(python_test_models PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(python_test_models contact_flow)
if(CONTACT_FLOW_ROS)
  set_target_properties(python_test_models PROPERTIES EXCLUDE_FROM_ALL ON)
  add_dependencies(tests python_test_models)
endif()
file(GLOB tests CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/python/*_test.py)
foreach(test ${tests})
  get_filename_component(name ${test} NAME_WE)
  add_test(NAME python-${name} COMMAND ${Python3_EXECUTABLE} ${test}
    --junit ${CONTACT_FLOW_TEST_RESULTS}/python-${name}.xml)
  set_tests_properties(python-${name} PROPERTIES ENVIRONMENT
    "PYTHONPATH=${CONTACT_FLOW_PYTHON_PATH};CONTACT_FLOW_TEST_MODELS=$<TARGET_FILE:python_test_models>")
endforeach()
