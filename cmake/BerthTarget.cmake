# SPDX-License-Identifier: BSD-3-Clause
# How Berth's own targets are compiled.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

# One instruction set for every build, so that two machines agree to the bit.
set(BERTH_ARCHITECTURE x86-64-v3 CACHE STRING "Value of -march; 'native' is faster and not reproducible elsewhere")
set(BERTH_SANITIZE "" CACHE STRING "Value of -fsanitize, for instance address,undefined")
# Chosen once: a later configuration without CI in the environment changes no flag, which would compile everything again.
if(DEFINED ENV{CI})
  set(in_ci ON)
else()
  set(in_ci OFF)
endif()
option(BERTH_WERROR "Warnings are errors; default: in CI" ${in_ci})

add_library(berth_options INTERFACE)
target_include_directories(berth_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(berth_options INTERFACE
  -march=${BERTH_ARCHITECTURE} -ffp-contract=off -fno-math-errno -fno-trapping-math
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-align
  -Wunused -Wnull-dereference -Wdouble-promotion -Wformat=2 $<$<BOOL:${BERTH_WERROR}>:-Werror>
  # gcc 12 sees faults in Eigen's vectorised assignments that are none
  $<$<CXX_COMPILER_ID:GNU>:-Wno-null-dereference -Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overread -Wno-restrict>)
if(BERTH_SANITIZE)
  add_compile_options(-fsanitize=${BERTH_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${BERTH_SANITIZE})
endif()

# A target whose flags differ from the precompiled headers' compiles without them.
set(CMAKE_PCH_WARN_INVALID OFF)
# gcc 12 forgets what a system header is when it comes precompiled, and warns about std::string.
if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  target_compile_options(berth_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>)
endif()

# In joined sources gcc takes a source for a header that others include, and minds hidden types in it.
if(CMAKE_UNITY_BUILD)
  target_compile_options(berth_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()

# berth_library(NAME SOURCES... [LINK...]): a static library of the house.
function(berth_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_precompile_headers(${name} REUSE_FROM berth_precompiled)
  target_link_libraries(${name} PUBLIC berth_options ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
endfunction()

# berth_program(NAME [PRECOMPILED TARGET] SOURCES... [LINK...]): an installed program.
function(berth_program name)
  cmake_parse_arguments(ARG "" "PRECOMPILED" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  if(NOT ARG_PRECOMPILED)
    set(ARG_PRECOMPILED berth_precompiled)
  endif()
  target_precompile_headers(${name} REUSE_FROM ${ARG_PRECOMPILED})
  target_link_libraries(${name} PRIVATE berth_options berth_version ${ARG_LINK})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endfunction()

# A test on real sockets in real time: one after another, from the start on, while the others, which give way (nice),
# use what it leaves of the machine.
function(berth_test_in_real_time name)
  set_tests_properties(${name} PROPERTIES RESOURCE_LOCK real_time COST 1000)
endfunction()

# berth_test(NAME [IN_REAL_TIME] SOURCES... [LINK...]): a Catch2 program, one ctest entry. Who calls ctest says how long
# it may take.
function(berth_test name)
  cmake_parse_arguments(ARG "IN_REAL_TIME" "" "SOURCES;LINK" ${ARGN})
  if(NOT BUILD_TESTING)
    return()
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_precompile_headers(${name} REUSE_FROM berth_test_precompiled)
  target_link_libraries(${name} PRIVATE berth_options berth_test_main ${ARG_LINK})
  if(ARG_IN_REAL_TIME)
    add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    berth_test_in_real_time(${name})
  else()
    add_test(NAME ${name} COMMAND nice $<TARGET_FILE:${name}> WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  endif()
  set_property(TEST ${name} APPEND PROPERTY LABELS unit)
endfunction()
