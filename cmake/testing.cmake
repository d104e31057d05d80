# SPDX-License-Identifier: BSD-3-Clause
# CONTACT_FLOW_TESTS: whether tests are built. With ROS they are catkin's, part of its target `tests`;
# without they are CTest's, part of `all`, where GTest and nlohmann_json are found.
if(CONTACT_FLOW_ROS)
  set(CONTACT_FLOW_TESTS ${CATKIN_ENABLE_TESTING})
  set(CONTACT_FLOW_TEST_RESULTS ${CATKIN_TEST_RESULTS_DIR}/${PROJECT_NAME})
else()
  include(CTest)
  set(CONTACT_FLOW_TESTS ${BUILD_TESTING})
  set(CONTACT_FLOW_TEST_RESULTS ${PROJECT_BINARY_DIR}/test_results/${PROJECT_NAME})
  if(BUILD_TESTING)
    find_package(GTest CONFIG QUIET)
    find_package(nlohmann_json QUIET)
    if(NOT GTest_FOUND OR NOT nlohmann_json_FOUND)
      message(STATUS "contact_flow: no tests, for want of GTest or nlohmann_json "
        "(libgtest-dev, nlohmann-json3-dev)")
      set(CONTACT_FLOW_TESTS OFF)
    endif()
  endif()
endif()
find_package(Python3 COMPONENTS Interpreter QUIET)
if(CONTACT_FLOW_TESTS AND NOT Python3_Interpreter_FOUND)
  message(STATUS "contact_flow: Python 3 not found: layout and pages are not tested")
endif()

# contact_flow_gtest(NAME source …): an executable that CTest runs; its cases go to a JUnit file.
function(contact_flow_gtest name)
  if(CONTACT_FLOW_ROS)
    catkin_add_gtest(${name} ${ARGN})
    target_link_libraries(${name} gtest_main)
  else()
    add_executable(${name} ${ARGN})
    target_link_libraries(${name} GTest::gtest_main)
    add_test(NAME ${name}
      COMMAND ${name} --gtest_output=xml:${CONTACT_FLOW_TEST_RESULTS}/gtest-${name}.xml)
  endif()
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)   # a quarter less to compile; the library keeps -O3
  if(CONTACT_FLOW_FLAGS MATCHES -fsanitize)   # tests are not instrumented, and leave out what is in its way
    target_compile_definitions(${name} PRIVATE CONTACT_FLOW_SANITIZED)
  endif()
  if(ARGC GREATER 6)
    contact_flow_precompile_test(${name})
    contact_flow_units(${name} 12)   # a sixth less to compile than by 7; two cores share most folders
  endif()
endfunction()

# contact_flow_script_test(GROUP NAME FILE.py): a Python file that takes `--junit RESULTS`.
function(contact_flow_script_test group name file)
  set(script ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  if(CONTACT_FLOW_ROS)
    catkin_run_tests_target(${group} ${name} ${group}-${name}.xml COMMAND
      "${PYTHON_EXECUTABLE} ${script} --junit ${CONTACT_FLOW_TEST_RESULTS}/${group}-${name}.xml")
  else()
    add_test(NAME ${group}-${name} COMMAND ${Python3_EXECUTABLE} ${script}
      --junit ${CONTACT_FLOW_TEST_RESULTS}/${group}-${name}.xml)
  endif()
endfunction()
