# SPDX-License-Identifier: BSD-3-Clause
# CONTACT_FLOW_ROS: by default ON where there is a catkin.
string(REPLACE ":" ";" prefixes "$ENV{CMAKE_PREFIX_PATH}")
find_file(CONTACT_FLOW_CATKIN catkinConfig.cmake
  PATHS ${catkin_DIR} ${CMAKE_PREFIX_PATH} ${prefixes} ${CMAKE_SYSTEM_PREFIX_PATH}
  PATH_SUFFIXES share/catkin/cmake NO_DEFAULT_PATH)
mark_as_advanced(CONTACT_FLOW_CATKIN)
if(CONTACT_FLOW_CATKIN)
  set(has_catkin ON)
else()
  set(has_catkin OFF)
endif()
option(CONTACT_FLOW_ROS "Build nodes, messages and tools for ROS 1; OFF: the core library alone"
  ${has_catkin})
if(CONTACT_FLOW_ROS AND NOT has_catkin)
  message(FATAL_ERROR
    "CONTACT_FLOW_ROS is ON, but there is no catkin. Either install ROS 1 (scripts/demo does that on "
    "Debian; in a workspace, source its setup.bash first), or build the core library alone, which "
    "needs no ROS: -DCONTACT_FLOW_ROS=OFF")
elseif(CONTACT_FLOW_ROS)
  message(STATUS "contact_flow: with ROS, by ${CONTACT_FLOW_CATKIN}")
else()
  message(STATUS "contact_flow: the core library alone, without ROS")
endif()
