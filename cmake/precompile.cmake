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
