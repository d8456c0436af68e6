# SPDX-License-Identifier: Apache-2.0
# find_package(velatura): static libraries velatura::compositor, velatura::layers, velatura::statistics, velatura::accumulate,
# velatura::image, velatura::canvas, velatura::plugin, velatura::base, velatura::base_process.
include(CMakeFindDependencyMacro)
find_dependency(Threads)
find_dependency(Imath 3.1 CONFIG)
find_dependency(OpenEXR 3.1 CONFIG)
find_dependency(TBB)
find_dependency(fmt)
find_dependency(nlohmann_json)
find_dependency(CLI11)
# Debian puts OpenColorIO's CMake files directly into share/cmake, where CMake does not look by itself
find_dependency(OpenColorIO 2.1 CONFIG PATHS /usr/share/cmake)
find_dependency(OpenSSL COMPONENTS Crypto)
find_dependency(ZLIB)
include(${CMAKE_CURRENT_LIST_DIR}/velatura-targets.cmake)
