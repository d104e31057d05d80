# SPDX-License-Identifier: BSD-3-Clause
# Everything below the prefix of install time. find_package(contact_flow) then gives
# contact_flow::contact_flow, and to catkin packages what they are used to, too.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
if(CONTACT_FLOW_ROS)
  set(lib ${CATKIN_PACKAGE_LIB_DESTINATION})
else()
  set(lib ${CMAKE_INSTALL_LIBDIR})
endif()
set(config ${lib}/cmake/${PROJECT_NAME})

install(TARGETS contact_flow EXPORT contact_flow
  ARCHIVE DESTINATION ${lib} LIBRARY DESTINATION ${lib})
install(EXPORT contact_flow NAMESPACE contact_flow:: FILE contact_flowTargets.cmake
  DESTINATION ${config})
set(files ${PROJECT_BINARY_DIR}/cmake_config)
configure_file(cmake/contact_flow-dependencies.cmake.in ${files}/contact_flow-dependencies.cmake @ONLY)
configure_file(cmake/contact_flowConfig.cmake.in ${files}/contact_flowConfig.cmake @ONLY)
write_basic_package_version_file(${files}/contact_flowConfigVersion.cmake
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
install(DIRECTORY ${files}/ DESTINATION ${config})
install(DIRECTORY config DESTINATION share/${PROJECT_NAME})

if(NOT CONTACT_FLOW_ROS)
  install(DIRECTORY include/${PROJECT_NAME} DESTINATION include PATTERN ros EXCLUDE)
  return()
endif()

# The devel space offers the same.
set(devel ${CATKIN_DEVEL_PREFIX}/lib/cmake/${PROJECT_NAME})
file(COPY ${files}/ DESTINATION ${devel})
export(EXPORT contact_flow NAMESPACE contact_flow:: FILE ${devel}/contact_flowTargets.cmake)

install(TARGETS contact_flow_ros ${EXECUTABLES}
  ARCHIVE DESTINATION ${lib}
  LIBRARY DESTINATION ${lib}
  RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
file(GLOB PYTHON_TOOLS CONFIGURE_DEPENDS scripts/*.py src/tools/*.py)
list(FILTER PYTHON_TOOLS EXCLUDE REGEX "/count_(tests|lines)\\.py$")
catkin_install_python(PROGRAMS ${PYTHON_TOOLS} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

if(CONTACT_FLOW_INSTALLS_SETUP AND NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  configure_file(cmake/install_setup.cmake.in install_setup.cmake @ONLY)
  install(SCRIPT ${PROJECT_BINARY_DIR}/install_setup.cmake)
endif()
