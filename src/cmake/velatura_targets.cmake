# SPDX-License-Identifier: Apache-2.0
# add_tier, add_tier_test: one folder = one tier = one target = one namespace.

add_library(velatura_warnings INTERFACE)
target_compile_options(velatura_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wold-style-cast -Wnon-virtual-dtor -Woverloaded-virtual
  -Wdouble-promotion -Wfloat-conversion -Wmissing-declarations
  # GCC 12 warns about its own std::string (bug 105329)
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)

# Numbers must not depend on how the compiler fuses operations (docs/engineering/numerics.md: watertight edge functions, bit-equality).
add_library(velatura_numerics INTERFACE)
# Nobody reads errno or the flags of floating-point exceptions, and no function of ours is replaced when a plugin is loaded:
# roots become single instructions and calls within a file can be inlined. No result depends on it.
target_compile_options(velatura_numerics INTERFACE -ffp-contract=off -fno-math-errno -fno-trapping-math
  -fno-semantic-interposition)

# compile_quickly(TARGET): what runs once takes less time to compile in release builds. Half of the time that -O2 takes for
# tests, a fifth less for commands; the functions of Imath must still be inlined.
function(compile_quickly target)
  target_compile_options(${target} PRIVATE
    $<$<CONFIG:Release>:-O1> $<$<AND:$<CONFIG:Release>,$<CXX_COMPILER_ID:GNU>>:-finline-small-functions>)
endfunction()

# compile_files_quickly(FILES...): the same for files of a tier that works on pixels otherwise.
function(compile_files_quickly)
  set_property(SOURCE ${ARGN} APPEND PROPERTY COMPILE_OPTIONS
    $<$<CONFIG:Release>:-O1> $<$<AND:$<CONFIG:Release>,$<CXX_COMPILER_ID:GNU>>:-finline-small-functions>)
endfunction()

# compile_together(TARGET): several files are one unit for the compiler, which reads the headers that they share
# once. Not with clang: clang-tidy proves that each file includes what it uses (docs/adr/0046-quick-builds-and-tests.md).
function(compile_together target)
  if(VELATURA_COMPILE_TOGETHER AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()

# compile_alone(FILES...): files of a tier whose local names others of it have as well.
function(compile_alone)
  set_property(SOURCE ${ARGN} PROPERTY SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# add_tier(NAME [HOT|COLD] SOURCES ... HEADERS ... DEPENDS ...): static library velatura_NAME; slashes become underscores.
# HOT: what every path goes through, optimized further in release builds. COLD: see compile_quickly.
function(add_tier name)
  cmake_parse_arguments(TIER "HOT;COLD" "" "SOURCES;HEADERS;DEPENDS" ${ARGN})
  string(REPLACE "/" "_" target velatura_${name})
  set_property(GLOBAL APPEND PROPERTY velatura_tiers ${name})
  if(TIER_SOURCES)
    add_library(${target} STATIC ${TIER_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE velatura_warnings)
    string(REPLACE "/" "_" underscored ${name})
    use_precompiled(${target} ${velatura_set_of_${underscored}})
    if(TIER_HOT)
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O3>)
    else()
      compile_together(${target})
    endif()
    if(TIER_COLD)
      compile_quickly(${target})
    endif()
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  # Includes read "base/math.h" for the tiers of src and "compositor/mix/mix.h" for the folders of the root
  set(include_root ${CMAKE_SOURCE_DIR})
  if(CMAKE_CURRENT_SOURCE_DIR MATCHES "^${CMAKE_SOURCE_DIR}/src/")
    set(include_root ${CMAKE_SOURCE_DIR}/src)
  endif()
  target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS ${include_root} FILES ${TIER_HEADERS})
  target_link_libraries(${target} ${scope} velatura_numerics ${TIER_DEPENDS})
  # What programs outside the tree call it (install_libraries)
  string(REPLACE "/" "_" exported ${name})
  add_library(velatura::${exported} ALIAS ${target})
endfunction()

# add_plugin(NAME SOURCES ... DEPENDS ... NEEDS VARIABLE PACKAGE): shared object of the plugin in this folder, beside its
# plugin.txt in plugins/NAME of the build. Where the variable of NEEDS is false (find_package failed), the plugin is left out;
# VELATURA_PLUGIN_<NAME>=ON insists on it, OFF leaves it out anyway.
function(add_plugin name)
  cmake_parse_arguments(PLUGIN "" "" "SOURCES;DEPENDS;NEEDS" ${ARGN})
  string(TOUPPER ${name} upper)
  set(option VELATURA_PLUGIN_${upper})
  set(${option} AUTO CACHE STRING "Build the plugin ${name}: AUTO, ON or OFF")
  set_property(CACHE ${option} PROPERTY STRINGS AUTO ON OFF)
  if(NOT ${option} STREQUAL "AUTO" AND NOT ${option})
    return()
  endif()
  list(POP_FRONT PLUGIN_NEEDS found package)
  if(found AND NOT ${found})
    if(${option} STREQUAL "AUTO")
      message(STATUS "plugin ${name} is left out: ${package} was not found")
      return()
    endif()
    message(FATAL_ERROR "${option} is ON and ${package} was not found")
  endif()
  set(folder ${CMAKE_BINARY_DIR}/plugins/${name})
  add_plugin_library(velatura_plugin_${name} ${folder} ${name} SOURCES ${PLUGIN_SOURCES} DEPENDS ${PLUGIN_DEPENDS})
  configure_file(plugin.txt ${folder}/plugin.txt COPYONLY)
  install_plugin(${name})
  # Whoever builds the program gets the plugins that it can open
  add_dependencies(velatura velatura_plugin_${name})
endfunction()

# add_program_objects(TARGET SET SOURCES...): the sources of a program as an object library TARGET: objects with -fPIC, as
# tiers have, take the precompiled headers SET of these. Commands and windows, compiled quickly.
function(add_program_objects target set)
  add_library(${target} OBJECT ${ARGN})
  compile_quickly(${target})
  compile_together(${target})
  use_precompiled(${target} ${set})
  target_link_libraries(${target} PRIVATE velatura_warnings velatura_numerics)
endfunction()

# add_plugin_library(TARGET FOLDER NAME SOURCES ... DEPENDS ...): FOLDER/velatura_NAME.so, which shows its entry point only.
function(add_plugin_library target folder name)
  cmake_parse_arguments(LIBRARY "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${target} MODULE ${LIBRARY_SOURCES})
  compile_together(${target})
  use_precompiled(${target} base)
  target_link_libraries(${target} PRIVATE velatura_warnings velatura_numerics velatura_plugin ${LIBRARY_DEPENDS})
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR})
  # Templates of std are visible whatever the compiler is told: a library would take those of the plugin for its own
  target_link_options(${target} PRIVATE -Wl,--exclude-libs,ALL -Wl,--version-script=${CMAKE_SOURCE_DIR}/src/cmake/plugin_symbols.map)
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME velatura_${name} LIBRARY_OUTPUT_DIRECTORY ${folder}
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
endfunction()

# add_tier_test(SUITE PROGRAM NAME SOURCES ... DEPENDS ... USES ... FULL ...): the tests of one folder, as objects of the test
# program velatura_test_NAME (tests/CMakeLists.txt). USES: programs and plugins that the tests start or open. FULL: patterns
# of GoogleTest for the tests that only `./dev test --full` runs; all others are quick.
function(add_tier_test suite)
  cmake_parse_arguments(T "" "PROGRAM" "SOURCES;DEPENDS;USES;FULL" ${ARGN})
  string(REPLACE "/" "_" target velatura_suite_${suite})
  add_library(${target} OBJECT ${T_SOURCES})
  use_precompiled(${target} ${velatura_set_of_program_${T_PROGRAM}})
  compile_quickly(${target})
  target_link_libraries(${target} PRIVATE velatura_warnings PUBLIC velatura_numerics ${T_DEPENDS} velatura_hard_case GTest::gtest)
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests ${CMAKE_SOURCE_DIR}/tests/base)
  target_compile_definitions(${target} PRIVATE VELATURA_SOURCE_DIR="${CMAKE_SOURCE_DIR}" VELATURA_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  string(REPLACE "/" "_" suite_name ${suite})
  set_property(GLOBAL APPEND PROPERTY velatura_suites_${T_PROGRAM} ${suite_name})
  set_property(GLOBAL APPEND PROPERTY velatura_uses_${T_PROGRAM} ${T_USES})
  set_property(GLOBAL APPEND PROPERTY velatura_full_${T_PROGRAM} ${T_FULL})
endfunction()

# add_test_program(NAME [TIMEOUT S]): velatura_test_NAME of all suites that name it. ctest discovers its tests when it starts,
# once for each label: NAME and quick, NAME and full.
function(add_test_program name)
  cmake_parse_arguments(P "" "TIMEOUT" "" ${ARGN})
  if(NOT P_TIMEOUT)
    set(P_TIMEOUT 300)
  endif()
  set(target velatura_test_${name})
  get_property(suites GLOBAL PROPERTY velatura_suites_${name})
  get_property(uses GLOBAL PROPERTY velatura_uses_${name})
  get_property(full GLOBAL PROPERTY velatura_full_${name})
  if(NOT suites)
    return()
  endif()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// The tests are objects of their suites\n")
  add_executable(${target} ${source})
  list(TRANSFORM suites PREPEND velatura_suite_ OUTPUT_VARIABLE objects)
  target_link_libraries(${target} PRIVATE ${objects} GTest::gtest_main)
  target_link_options(${target} PRIVATE ${velatura_fast_linker})
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  foreach(used IN LISTS uses)
    if(TARGET ${used})
      add_dependencies(${target} ${used})
    endif()
  endforeach()
  list(JOIN full ":" full)
  set(options DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${P_TIMEOUT})
  if(full)
    gtest_discover_tests(${target} TEST_FILTER "-${full}" TEST_LIST ${target}_quick ${options})
    gtest_discover_tests(${target} TEST_FILTER "${full}" TEST_LIST ${target}_full ${options})
  else()
    gtest_discover_tests(${target} TEST_LIST ${target}_quick ${options})
  endif()
  # gtest_discover_tests takes one label only
  set(labels ${CMAKE_CURRENT_BINARY_DIR}/${target}_labels.cmake)
  file(CONFIGURE OUTPUT ${labels} CONTENT [=[
foreach(label quick full)
  if(@target@_${label})
    set_tests_properties(${@target@_${label}} PROPERTIES LABELS "${label};@name@")
  endif()
endforeach()
]=] @ONLY)
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${labels})
  # For tests/mutants/run.py: which program holds which suite
  foreach(suite IN LISTS suites)
    set_property(GLOBAL APPEND PROPERTY velatura_suite_lines "${suite} ${name}")
  endforeach()
endfunction()

# add_test_helper(NAME SOURCES ... DEPENDS ...): static library velatura_helper_NAME of what several suites share.
function(add_test_helper name)
  cmake_parse_arguments(H "" "" "SOURCES;DEPENDS" ${ARGN})
  set(target velatura_helper_${name})
  add_library(${target} STATIC ${H_SOURCES})
  use_precompiled(${target} tests)
  target_include_directories(${target} PUBLIC ${CMAKE_CURRENT_SOURCE_DIR} PRIVATE ${CMAKE_SOURCE_DIR}/tests ${CMAKE_SOURCE_DIR}/tests/base)
  target_compile_definitions(${target} PRIVATE VELATURA_SOURCE_DIR="${CMAKE_SOURCE_DIR}" VELATURA_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  target_link_libraries(${target} PRIVATE velatura_warnings PUBLIC velatura_numerics GTest::gtest ${H_DEPENDS})
endfunction()
