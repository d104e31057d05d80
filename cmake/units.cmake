# SPDX-License-Identifier: BSD-3-Clause
# Most of a file's compile goes to templates of others' headers: files of one folder are compiled several at a time,
# which halves it. What a file defines for itself has a name that no other of its folder has (test/layout/units_test.py).
option(CONTACT_FLOW_UNITS "Compile several files of a folder as one; OFF for work on one of them" ON)

# contact_flow_units(TARGET SIZE): its files by units of at most so many, none of two folders. Files that have options of
# their own stay alone.
function(contact_flow_units target size)
  if(NOT CONTACT_FLOW_UNITS OR CMAKE_VERSION VERSION_LESS 3.18)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  list(SORT sources)
  set(folder "")
  foreach(source ${sources})
    get_filename_component(next ${source} ABSOLUTE)
    get_filename_component(next ${next} DIRECTORY)
    if(NOT next STREQUAL folder)
      set(folder ${next})
      set(count 0)
      file(RELATIVE_PATH name ${PROJECT_SOURCE_DIR} ${folder})
      string(MAKE_C_IDENTIFIER "${name}" name)
    endif()
    math(EXPR unit "${count} / ${size}")
    math(EXPR count "${count} + 1")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${name}_${unit})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
