# SPDX-License-Identifier: BSD-3-Clause
# The Python module, package contact_flow: an extension over the core, and Python files beside it.
# With ROS it lies in the devel space in one folder with the generated contact_flow.msg and
# contact_flow.srv, whose __init__.py (empty, made by genpy where there is none) it replaces.
find_package(Python3 COMPONENTS Interpreter Development QUIET)
if(Python_FOUND)   # catkin of Debian 13 looks for Python's interpreter under this name, which pybind11 takes then
  find_package(Python COMPONENTS Interpreter Development QUIET)
endif()
set(has_pybind11 OFF)
if(Python3_Development_FOUND AND NOT CONTACT_FLOW_PYTHON STREQUAL OFF)
  find_package(pybind11 2.6 CONFIG QUIET)   # an error of its own where there are no headers
  set(has_pybind11 ${pybind11_FOUND})
endif()
set(CONTACT_FLOW_PYTHON AUTO CACHE STRING
  "Build the Python module: ON, OFF, or AUTO: where pybind11 and Python's headers are found")
set(CONTACT_FLOW_WITH_PYTHON ${CONTACT_FLOW_PYTHON})
if(CONTACT_FLOW_PYTHON STREQUAL AUTO)
  set(CONTACT_FLOW_WITH_PYTHON ${has_pybind11})
endif()
if(CONTACT_FLOW_ROS)
  set(python_folder ${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_PYTHON_DESTINATION}/contact_flow)
  set(python_destination ${CATKIN_GLOBAL_PYTHON_DESTINATION}/contact_flow)
  set(python_library_destination ${CATKIN_PACKAGE_LIB_DESTINATION})
else()
  include(GNUInstallDirs)
  set(python_folder ${PROJECT_BINARY_DIR}/python/contact_flow)
  set(python_destination lib/python3/dist-packages/contact_flow)
  set(python_library_destination ${CMAKE_INSTALL_LIBDIR})
endif()
set(CONTACT_FLOW_PYTHON_DESTINATION ${python_destination} CACHE STRING
  "Where the package is installed, below the prefix")
get_filename_component(CONTACT_FLOW_PYTHON_PATH ${python_folder} DIRECTORY)
if(NOT CONTACT_FLOW_WITH_PYTHON)
  message(STATUS
    "contact_flow: no Python module, for want of pybind11-dev (2.6) or python3-dev, or by choice")
  if(CONTACT_FLOW_ROS)   # messages join a package of this name that lies elsewhere on the path
    file(WRITE ${python_folder}/__init__.py
      "from pkgutil import extend_path\n__path__ = extend_path(__path__, __name__)\n")
  endif()
  return()
endif()
if(NOT has_pybind11)
  message(FATAL_ERROR
    "CONTACT_FLOW_PYTHON is ON, but pybind11 or Python's headers are missing "
    "(pybind11-dev, python3-dev)")
endif()

file(GLOB PYTHON_SOURCES CONFIGURE_DEPENDS python/src/*.cc)
pybind11_add_module(contact_flow_core_python NO_EXTRAS ${PYTHON_SOURCES})
target_link_libraries(contact_flow_core_python PRIVATE contact_flow)
target_compile_options(contact_flow_core_python PRIVATE -O2)
contact_flow_precompile(contact_flow_core_python <pybind11/pybind11.h> <pybind11/eigen.h> <pybind11/stl.h>)
contact_flow_units(contact_flow_core_python 8)
target_compile_definitions(contact_flow_core_python PRIVATE
  CONTACT_FLOW_VERSION="${PROJECT_VERSION}")
file(RELATIVE_PATH to_library /${CONTACT_FLOW_PYTHON_DESTINATION} /${python_library_destination})
set_target_properties(contact_flow_core_python PROPERTIES
  OUTPUT_NAME _core CXX_VISIBILITY_PRESET hidden LIBRARY_OUTPUT_DIRECTORY ${python_folder}
  INSTALL_RPATH "$ORIGIN/${to_library};$ORIGIN")   # the latter in a wheel

file(GLOB PYTHON_FILES RELATIVE ${PROJECT_SOURCE_DIR}/python/contact_flow CONFIGURE_DEPENDS
  python/contact_flow/*.py python/contact_flow/*.pyi python/contact_flow/*.html
  python/contact_flow/*.js
  python/contact_flow/py.typed)
set(copies)
foreach(file ${PYTHON_FILES})
  # By stamps: genpy's __init__.py may be newer than ours.
  set(stamp ${PROJECT_BINARY_DIR}/python_stamps/${file})
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${CMAKE_COMMAND} -E copy
      ${PROJECT_SOURCE_DIR}/python/contact_flow/${file} ${python_folder}/${file}
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS python/contact_flow/${file})
  list(APPEND copies ${stamp})
endforeach()
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/python_stamps)
add_custom_target(contact_flow_python ALL DEPENDS ${copies})
add_dependencies(contact_flow_python contact_flow_core_python)
message(STATUS
  "contact_flow: Python module in ${CONTACT_FLOW_PYTHON_PATH}, by pybind11 ${pybind11_VERSION}")

install(TARGETS contact_flow_core_python LIBRARY DESTINATION ${CONTACT_FLOW_PYTHON_DESTINATION})
list(TRANSFORM PYTHON_FILES PREPEND python/contact_flow/)
install(FILES ${PYTHON_FILES} DESTINATION ${CONTACT_FLOW_PYTHON_DESTINATION})
install(PROGRAMS python/bin/contact_flow DESTINATION bin)
install(FILES python/bin/contact_flow.completion RENAME contact_flow
  DESTINATION share/bash-completion/completions)
if(CONTACT_FLOW_ROS)
  file(COPY python/bin/contact_flow DESTINATION ${CATKIN_DEVEL_PREFIX}/bin)
endif()
