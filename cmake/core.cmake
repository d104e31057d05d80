# SPDX-License-Identifier: BSD-3-Clause
# The core library, contact_flow::contact_flow: no ROS.
set(CORE_FOLDERS piecewise_linear model dynamics flow derivative analysis trajectory_optimization ensemble io session)
file(GLOB CORE_SOURCES CONFIGURE_DEPENDS src/*.cc)
foreach(folder ${CORE_FOLDERS})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS src/${folder}/*.cc)
  list(APPEND CORE_SOURCES ${sources})
endforeach()
add_library(contact_flow ${CORE_SOURCES})
add_library(contact_flow::contact_flow ALIAS contact_flow)
target_compile_features(contact_flow PUBLIC cxx_std_17)
target_include_directories(contact_flow PUBLIC
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
target_include_directories(contact_flow PRIVATE ${PROJECT_SOURCE_DIR})   # headers of other rooms that are not installed
target_link_libraries(contact_flow PUBLIC Eigen3::Eigen Boost::headers ${YAML_CPP_TARGET})
# By paths, not targets: no header of ours includes theirs, so users need not find them.
target_include_directories(contact_flow SYSTEM PRIVATE ${URDFDOM_INCLUDE_DIRS})
target_link_libraries(contact_flow PRIVATE ${URDFDOM_LINK_LIBRARIES})
target_link_libraries(contact_flow PRIVATE ${CMAKE_THREAD_LIBS_INIT})
# Sanitizers and counters for libraries and programs alone: the tests take longer to compile than they do.
set(CONTACT_FLOW_FLAGS "" CACHE STRING "Compiler and linker flags of libraries and programs, not of tests")
mark_as_advanced(CONTACT_FLOW_FLAGS)
separate_arguments(CONTACT_FLOW_FLAG_LIST UNIX_COMMAND "${CONTACT_FLOW_FLAGS}")
target_compile_options(contact_flow PRIVATE ${CONTACT_FLOW_FLAG_LIST})
target_link_libraries(contact_flow PUBLIC ${CONTACT_FLOW_FLAG_LIST})
# Random numbers have the same bits on machines that could contract a * b + c.
set_source_files_properties(src/ensemble/normal_quantile.cc src/ensemble/draws.cc
  PROPERTIES COMPILE_OPTIONS -ffp-contract=off)
# Batches step several runs at once where the machine can; all else is for any x86-64. Optimized
# always: no function that others share is to be left to the linker's choice.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(LANE_OPTIONS -O3 -ffp-contract=off -fno-math-errno -fno-trapping-math)
  # Copies as wide as what is loaded next, where the compiler can say so (GCC 12).
  include(CheckCXXCompilerFlag)
  check_cxx_compiler_flag("-mmove-max=256 -mstore-max=256" HAVE_WIDE_MOVES)
  if(HAVE_WIDE_MOVES)
    set(LANE_MOVES -mmove-max=256 -mstore-max=256)
  endif()
  set_source_files_properties(src/flow/lanes_avx2.cc
    PROPERTIES COMPILE_OPTIONS "${LANE_OPTIONS};-mavx2;${LANE_MOVES}")
  set_source_files_properties(src/flow/lanes_avx512.cc
    PROPERTIES COMPILE_OPTIONS "${LANE_OPTIONS};-mavx512f;-mfma")
  set_source_files_properties(src/derivative/dense_solve_avx2.cc PROPERTIES COMPILE_OPTIONS "-O3;-mavx2;-mfma")
  set_source_files_properties(src/derivative/dense_solve.cc src/derivative/dense_solve_avx2.cc
    PROPERTIES COMPILE_DEFINITIONS CONTACT_FLOW_HAVE_AVX2=1 SKIP_UNITY_BUILD_INCLUSION ON)
endif()
target_compile_definitions(contact_flow PUBLIC CONTACT_FLOW_HAVE_CLP=${CLP_FOUND})
if(CLP_FOUND)
  target_include_directories(contact_flow SYSTEM PRIVATE ${CLP_INCLUDE_DIRS})
  target_link_libraries(contact_flow PRIVATE ${CLP_LINK_LIBRARIES})
endif()
# GCC makes calloc of a small vector that is allocated and set to zero; glibc's takes five times the instructions of malloc.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(contact_flow PRIVATE -fno-optimize-strlen)
endif()
# Calls within the library are bound to it, not looked up: 5 % of a trot.
if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
  target_link_options(contact_flow PRIVATE -Wl,-Bsymbolic-functions)
endif()
contact_flow_precompile(contact_flow)
# Example models alone: GCC inlines less in a large unit, and a trot takes 6 % more instructions (test/instructions); robots take 1 % more.
contact_flow_units(contact_flow 8 src/model/example)
set_source_files_properties(src/flow/lanes_avx2.cc src/flow/lanes_avx512.cc src/derivative/dense_solve_avx2.cc
  PROPERTIES SKIP_PRECOMPILE_HEADERS ON)   # other instructions
# Known to one file alone.
set_source_files_properties(src/trajectory_optimization/ipopt_adapter.cc
  PROPERTIES COMPILE_DEFINITIONS CONTACT_FLOW_HAVE_IPOPT=${IPOPT_FOUND})
if(IPOPT_FOUND)
  set_source_files_properties(src/trajectory_optimization/ipopt_adapter.cc
    PROPERTIES INCLUDE_DIRECTORIES ${IPOPT_INCLUDE_DIR})
  target_link_libraries(contact_flow PRIVATE ${IPOPT_LIBRARY})
endif()
target_compile_definitions(contact_flow PRIVATE CONTACT_FLOW_HAVE_ASSIMP=${ASSIMP_FOUND})
if(ASSIMP_FOUND)
  target_include_directories(contact_flow SYSTEM PRIVATE ${ASSIMP_INCLUDE_DIRS})
  target_link_libraries(contact_flow PRIVATE ${ASSIMP_LINK_LIBRARIES})
endif()
# 0.1.x understand one another; a library of models that wants another 0.y is not loaded.
set_target_properties(contact_flow PROPERTIES
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
  INSTALL_RPATH $ORIGIN)
