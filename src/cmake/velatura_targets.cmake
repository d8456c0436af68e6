# SPDX-License-Identifier: Apache-2.0
# add_tier, add_tier_test: one folder = one tier = one target = one namespace.

add_library(velatura_warnings INTERFACE)
target_compile_options(velatura_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wold-style-cast -Wnon-virtual-dtor -Woverloaded-virtual
  -Wdouble-promotion -Wfloat-conversion -Wmissing-declarations
  # GCC 12 warns about its own std::string (bug 105329)
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)

# Numbers must not depend on how the compiler fuses operations (RIGOR: watertight edge functions, bit-equality).
add_library(velatura_numerics INTERFACE)
target_compile_options(velatura_numerics INTERFACE -ffp-contract=off)

# add_tier(NAME SOURCES ... HEADERS ... DEPENDS ...): static library velatura_NAME; slashes become underscores.
function(add_tier name)
  cmake_parse_arguments(TIER "" "" "SOURCES;HEADERS;DEPENDS" ${ARGN})
  string(REPLACE "/" "_" target velatura_${name})
  if(TIER_SOURCES)
    add_library(${target} STATIC ${TIER_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE velatura_warnings)
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  # Includes read "base/math.h" for the tiers of src and "compositor/mix.h" for the folders of the root
  set(include_root ${CMAKE_SOURCE_DIR})
  if(CMAKE_CURRENT_SOURCE_DIR MATCHES "^${CMAKE_SOURCE_DIR}/src/")
    set(include_root ${CMAKE_SOURCE_DIR}/src)
  endif()
  target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS ${include_root} FILES ${TIER_HEADERS})
  target_link_libraries(${target} ${scope} velatura_numerics ${TIER_DEPENDS})
endfunction()

# add_tier_test(NAME SOURCES ... DEPENDS ... LABELS ...): GoogleTest program velatura_test_NAME, discovered by ctest.
function(add_tier_test name)
  cmake_parse_arguments(T "" "TIMEOUT" "SOURCES;DEPENDS;LABELS" ${ARGN})
  string(REPLACE "/" "_" target velatura_test_${name})
  if(NOT T_TIMEOUT)
    set(T_TIMEOUT 300)
  endif()
  if(NOT T_LABELS)
    set(T_LABELS unit)
  endif()
  add_executable(${target} ${T_SOURCES})
  target_link_libraries(${target} PRIVATE velatura_warnings velatura_numerics ${T_DEPENDS} GTest::gtest GTest::gtest_main)
  target_compile_definitions(${target} PRIVATE VELATURA_SOURCE_DIR="${CMAKE_SOURCE_DIR}" VELATURA_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  gtest_discover_tests(${target} DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT ${T_TIMEOUT} LABELS "${T_LABELS}")
endfunction()
