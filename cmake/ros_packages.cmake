# SPDX-License-Identifier: BSD-3-Clause
# catkin, the messages, and what catkin tells packages that use this one.
set(ROS_DEPENDS
  actionlib actionlib_msgs diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs
  nav_msgs pluginlib rosbag roscpp rosgraph_msgs sensor_msgs std_msgs std_srvs tf2_msgs tf2_ros
  trajectory_msgs visualization_msgs)

# catkin installs its setup files to the prefix of configure time, whatever `cmake --install --prefix`
# says. Of a build of its own (not in a workspace) install_setup.cmake does that instead.
if(PROJECT_SOURCE_DIR STREQUAL CMAKE_SOURCE_DIR AND NOT DEFINED CATKIN_INSTALL_INTO_PREFIX_ROOT)
  set(CATKIN_INSTALL_INTO_PREFIX_ROOT FALSE)
  set(CONTACT_FLOW_INSTALLS_SETUP TRUE)
endif()
find_package(catkin REQUIRED COMPONENTS message_generation ${ROS_DEPENDS})
pkg_check_modules(CRYPTO REQUIRED IMPORTED_TARGET libcrypto)   # SHA-256 and Ed25519 of recordings

# Every file of a folder is taken: adding a message, a service, a node or a test edits no list.
file(GLOB MESSAGES RELATIVE ${PROJECT_SOURCE_DIR}/msg CONFIGURE_DEPENDS msg/*.msg)
file(GLOB SERVICES RELATIVE ${PROJECT_SOURCE_DIR}/srv CONFIGURE_DEPENDS srv/*.srv)
file(GLOB ACTIONS RELATIVE ${PROJECT_SOURCE_DIR}/action CONFIGURE_DEPENDS action/*.action)
add_message_files(FILES ${MESSAGES})
add_service_files(FILES ${SERVICES})
add_action_files(FILES ${ACTIONS})
generate_messages(DEPENDENCIES
  actionlib_msgs diagnostic_msgs geometry_msgs sensor_msgs std_msgs visualization_msgs)

file(GLOB CONFIGS RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS cfg/*.cfg)
generate_dynamic_reconfigure_options(${CONFIGS})

catkin_package(
  INCLUDE_DIRS include
  LIBRARIES contact_flow contact_flow_ros
  CATKIN_DEPENDS message_runtime ${ROS_DEPENDS}
  DEPENDS EIGEN3 Boost)
