# SPDX-License-Identifier: BSD-3-Clause
# Headers of others that most sources include are parsed once for a target: half of the time of a
# compiler is theirs. A source still includes what it uses; OFF shows whether it does.
option(CONTACT_FLOW_PRECOMPILE "Parse headers of other libraries once for each large target" ON)

# contact_flow_precompile(TARGET [<header> …]): Eigen, what is common of the standard library, and these.
function(contact_flow_precompile target)
  if(CONTACT_FLOW_PRECOMPILE)
    target_precompile_headers(${target} PRIVATE
      <algorithm> <array> <cmath> <cstdint> <functional> <limits> <map> <memory> <optional> <sstream>
      <stdexcept> <string> <utility> <vector> <Eigen/Dense> ${ARGN})
  endif()
endfunction()

# contact_flow_precompile_test(TARGET): the same for a test. Those of one folder have theirs from the first of it.
function(contact_flow_precompile_test target)
  get_property(first DIRECTORY PROPERTY CONTACT_FLOW_PRECOMPILED)
  if(CONTACT_FLOW_PRECOMPILE AND first)
    target_precompile_headers(${target} REUSE_FROM ${first})
  else()
    contact_flow_precompile(${target} <gtest/gtest.h>)
    set_property(DIRECTORY PROPERTY CONTACT_FLOW_PRECOMPILED ${target})
  endif()
endfunction()
