# SPDX-License-Identifier: BSD-3-Clause
# Tests of the Python module: every file of test/python, with the built package on the path.
if(NOT CONTACT_FLOW_WITH_PYTHON)
  return()
endif()
file(GLOB tests CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/python/*_test.py)
foreach(test ${tests})
  get_filename_component(name ${test} NAME_WE)
  add_test(NAME python-${name} COMMAND ${Python3_EXECUTABLE} ${test}
    --junit ${CONTACT_FLOW_TEST_RESULTS}/python-${name}.xml)
  set_tests_properties(python-${name} PROPERTIES
    ENVIRONMENT "PYTHONPATH=${CONTACT_FLOW_PYTHON_PATH}")
endforeach()
