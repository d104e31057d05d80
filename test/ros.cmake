# SPDX-License-Identifier: BSD-3-Clause
# The tests of the ROS side.

# catkin freezes the environment of the tests when it is first found, and leaves out directories
# that do not exist yet: take that snapshot again, with the directories the build is going to fill.
file(MAKE_DIRECTORY
  ${CATKIN_DEVEL_PREFIX}/lib ${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_PYTHON_DESTINATION})
set(snapshot ${CMAKE_BINARY_DIR}/catkin_generated/generate_cached_setup.py)
if(EXISTS ${snapshot})
  execute_process(COMMAND ${PYTHON_EXECUTABLE} ${snapshot})
endif()

find_package(rostest REQUIRED)
find_package(roslaunch REQUIRED)

## ros_test: the ROS side without a master, ros/X_test.cc that have no ros/X.test

file(GLOB sources CONFIGURE_DEPENDS ros/*_test.cc)
foreach(source ${sources})
  string(REGEX REPLACE "_test.cc$" ".test" rostest ${source})
  if(EXISTS ${rostest})
    list(REMOVE_ITEM sources ${source})
  endif()
endforeach()
contact_flow_gtest(ros_test ${sources})
target_include_directories(ros_test PRIVATE ${PROJECT_SOURCE_DIR})
target_compile_definitions(ros_test PRIVATE
  CONTACT_FLOW_TEST_DATA="${CMAKE_CURRENT_SOURCE_DIR}/data")
target_link_libraries(ros_test contact_flow_ros nlohmann_json::nlohmann_json)

## ros/X.test, with its client ros/X_test.cc if there is one (else an executable ros/X_test.py)

# Every test has a master of its own, at a port of its own. Those that ask when something happens, as schedule.cmake
# takes them: alone, or two at a time.
set(ALONE attacks budgets clients hostile prompt service_stress)
set(TWO_AT_A_TIME simulator_recording policy_tracker bad_requests simulator faults sweep trajectory actions commands
  simulator_stress simulator_end node)
file(GLOB rostests RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} CONFIGURE_DEPENDS ros/*.test)
foreach(rostest ${rostests})
  get_filename_component(name ${rostest} NAME_WE)
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/ros/${name}_test.cc)
    add_rostest_gtest(${name}_test ${rostest} ros/${name}_test.cc)
    target_include_directories(${name}_test PRIVATE ${PROJECT_SOURCE_DIR})
    target_compile_definitions(${name}_test PRIVATE
      CONTACT_FLOW_TEST_DATA="${CMAKE_CURRENT_SOURCE_DIR}/data")
    target_link_libraries(${name}_test contact_flow_ros nlohmann_json::nlohmann_json)
    if(EXECUTABLES)
      add_dependencies(${name}_test ${EXECUTABLES})
    endif()
  else()
    add_rostest(${rostest} DEPENDENCIES ${EXECUTABLES})
  endif()
endforeach()

## Files of bags, without a master; and the tool that forges them, for ros/forged_bags.test

file(GLOB bag_tests CONFIGURE_DEPENDS ros/bags/*_test.cc)
contact_flow_gtest(bags_test ${bag_tests})
target_include_directories(bags_test PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(bags_test contact_flow_ros)
add_executable(forge_bag EXCLUDE_FROM_ALL ros/bags/forge_bag.cc)
target_include_directories(forge_bag PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(forge_bag contact_flow_ros)
add_dependencies(tests forge_bag)

file(GLOB launch_files RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} CONFIGURE_DEPENDS
  ${PROJECT_SOURCE_DIR}/launch/*.launch)
find_program(RVIZ rviz)   # optional: launch files start it on request, which the check cannot know
foreach(launch_file ${launch_files})
  file(STRINGS ${launch_file} starts_rviz REGEX "pkg=\"rviz\"")
  if(starts_rviz AND NOT RVIZ)
    message(STATUS "contact_flow: rviz not found: ${launch_file} is not checked by roslaunch")
  else()
    roslaunch_add_file_check(${launch_file} DEPENDENCIES ${EXECUTABLES})
  endif()
endforeach()
