# SPDX-License-Identifier: BSD-3-Clause
# The ROS side: a library, and one executable per file of src/nodes and src/tools.
file(GLOB_RECURSE ROS_SOURCES CONFIGURE_DEPENDS src/ros/*.cc)
add_library(contact_flow_ros ${ROS_SOURCES})
target_include_directories(contact_flow_ros SYSTEM PUBLIC
  ${CATKIN_DEVEL_PREFIX}/include ${catkin_INCLUDE_DIRS})
target_include_directories(contact_flow_ros SYSTEM PRIVATE ${URDFDOM_INCLUDE_DIRS})
target_include_directories(contact_flow_ros PUBLIC ${PROJECT_SOURCE_DIR})   # its headers lie beside its sources
target_link_libraries(contact_flow_ros contact_flow ${catkin_LIBRARIES} PkgConfig::CRYPTO)
target_compile_definitions(contact_flow_ros PRIVATE CONTACT_FLOW_VERSION="${PROJECT_VERSION}")
add_dependencies(contact_flow_ros ${${PROJECT_NAME}_EXPORTED_TARGETS})
set_target_properties(contact_flow_ros PROPERTIES INSTALL_RPATH $ORIGIN)

contact_flow_precompile(contact_flow_ros <ros/ros.h>)
contact_flow_units(contact_flow_ros 7)

# Sanitizers and counters for this side alone, where the core takes too long to build with them too.
set(CONTACT_FLOW_ROS_FLAGS "" CACHE STRING "Compiler and linker flags of the ROS side alone")
mark_as_advanced(CONTACT_FLOW_ROS_FLAGS)
separate_arguments(ros_flags UNIX_COMMAND "${CONTACT_FLOW_FLAGS} ${CONTACT_FLOW_ROS_FLAGS}")
target_compile_options(contact_flow_ros PRIVATE ${ros_flags})
target_link_libraries(contact_flow_ros ${ros_flags})

file(GLOB MAINS CONFIGURE_DEPENDS src/nodes/*.cc src/tools/*.cc)
set(EXECUTABLES)
foreach(main ${MAINS})
  get_filename_component(name ${main} NAME_WE)
  add_executable(${name} ${main})
  target_link_libraries(${name} contact_flow_ros)
  target_compile_options(${name} PRIVATE ${ros_flags})
  set_target_properties(${name} PROPERTIES INSTALL_RPATH $ORIGIN/..)
  list(APPEND EXECUTABLES ${name})
endforeach()
