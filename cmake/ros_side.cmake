# SPDX-License-Identifier: BSD-3-Clause
# The ROS side: a library, and one executable per file of src/nodes and src/tools.
file(GLOB_RECURSE ROS_SOURCES CONFIGURE_DEPENDS src/ros/*.cc)
add_library(contact_flow_ros ${ROS_SOURCES})
target_include_directories(contact_flow_ros SYSTEM PUBLIC
  ${CATKIN_DEVEL_PREFIX}/include ${catkin_INCLUDE_DIRS})
target_link_libraries(contact_flow_ros contact_flow ${catkin_LIBRARIES} PkgConfig::CRYPTO)
target_compile_definitions(contact_flow_ros PRIVATE CONTACT_FLOW_VERSION="${PROJECT_VERSION}")
add_dependencies(contact_flow_ros ${${PROJECT_NAME}_EXPORTED_TARGETS})
set_target_properties(contact_flow_ros PROPERTIES INSTALL_RPATH $ORIGIN)

file(GLOB MAINS CONFIGURE_DEPENDS src/nodes/*.cc src/tools/*.cc)
set(EXECUTABLES)
foreach(main ${MAINS})
  get_filename_component(name ${main} NAME_WE)
  add_executable(${name} ${main})
  target_link_libraries(${name} contact_flow_ros)
  set_target_properties(${name} PROPERTIES INSTALL_RPATH $ORIGIN/..)
  list(APPEND EXECUTABLES ${name})
endforeach()
