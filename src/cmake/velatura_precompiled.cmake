# SPDX-License-Identifier: Apache-2.0
# Precompiled headers: half of the compile time of a small file is the standard library, Imath and fmt. One set for each
# group of tiers, which holds headers of the lowest tier of the group only, so that a tier cannot use a header of a tier
# that it does not include. What they could hide is tested without them (docs/adr/0046-quick-builds-and-tests.md).
# GCC takes one precompiled header for -O1, -O2 and -O3 and any further macros, but not for code with and without -fPIC or
# -Wpedantic. Clang wants the same macros as well: it has none, and so proves that each file includes what it uses.

set(velatura_standard_headers
  <algorithm> <array> <atomic> <bit> <charconv> <chrono> <cmath> <cstdint> <cstring> <functional> <limits> <map> <memory>
  <mutex> <numeric> <optional> <set> <span> <string> <string_view> <unordered_map> <unordered_set> <utility> <variant>
  <vector>)

if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()

# ccache reads precompiled headers by their content only where the preprocessor says which they are
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)
endif()

# add_precompiled(NAME HEADERS ... LIBRARIES ...): target velatura_precompiled_NAME, whose headers tiers share.
function(add_precompiled name)
  cmake_parse_arguments(SET "" "" "HEADERS;LIBRARIES" ${ARGN})
  set(target velatura_precompiled_${name})
  set(source ${CMAKE_BINARY_DIR}/precompiled/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Carries the precompiled headers\n")
  add_library(${target} OBJECT ${source})
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR})
  target_link_libraries(${target} PRIVATE velatura_warnings velatura_numerics ${SET_LIBRARIES})
  list(TRANSFORM SET_HEADERS PREPEND ${CMAKE_SOURCE_DIR}/ REGEX "^[^<]")
  target_precompile_headers(${target} PRIVATE ${SET_HEADERS})
endfunction()

# use_precompiled(TARGET NAME): compiles TARGET with the headers of add_precompiled(NAME).
function(use_precompiled target name)
  target_precompile_headers(${target} REUSE_FROM velatura_precompiled_${name})
  # GCC forgets that precompiled headers are the system's, and then shows what it otherwise keeps to itself: that it takes its
  # own std::string for a fault (GCC bug 105329). Our own code is checked for these by clang (preset tidy) and the sanitizers
  target_compile_options(${target} PRIVATE
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds$<SEMICOLON>-Wno-stringop-overflow$<SEMICOLON>-Wno-stringop-overread>)
endfunction()

# Below base: no header of ours
add_precompiled(standard HEADERS ${velatura_standard_headers})
add_precompiled(base HEADERS ${velatura_standard_headers} <fmt/format.h> src/base/math.h src/base/result.h src/base/diagnostics.h
  LIBRARIES Imath::Imath fmt::fmt)
add_precompiled(json HEADERS ${velatura_standard_headers} <fmt/format.h> <nlohmann/json.hpp> src/base/math.h src/base/result.h
  LIBRARIES Imath::Imath fmt::fmt nlohmann_json::nlohmann_json)
add_precompiled(usd HEADERS ${velatura_standard_headers} <fmt/format.h> src/base/math.h src/base/diagnostics.h
    src/usd/layer/fields.h src/usd/layer/layer.h src/usd/layer/path.h src/usd/layer/value.h
  LIBRARIES Imath::Imath fmt::fmt)
add_precompiled(scene HEADERS ${velatura_standard_headers} <fmt/format.h> src/base/math.h src/base/tasks.h src/base/diagnostics.h
    src/scene/scene.h
  LIBRARIES Imath::Imath fmt::fmt)

# The set of each tier
set(velatura_set_of_base_process standard)
foreach(tier base canvas sampling guiding plugin image accumulate statistics view display
        compositor_io compositor_mix compositor_denoise compositor_bake compositor_inspect compositor_window)
  set(velatura_set_of_${tier} base)
endforeach()
# Where most files read or write JSON: GCC instantiates what headers leave pending in each file anew, 3 s with JSON, 1 s without
foreach(tier layers import study farm app python compositor_look compositor_noise compositor_exports)
  set(velatura_set_of_${tier} json)
endforeach()
foreach(tier usd_layer usd_text usd_crate usd_package usd_materialx usd_compose usd_stage translate translate_context translate_color
        translate_motion translate_materials translate_lights translate_geometry translate_linking translate_volumes
        translate_instancing)
  set(velatura_set_of_${tier} usd)
endforeach()
foreach(tier scene geometry accel camera shading media lights film integrator integrator_classic render selftest)
  set(velatura_set_of_${tier} scene)
endforeach()
