# SPDX-License-Identifier: Apache-2.0
# find_package(velatura): static libraries velatura::render, velatura::compositor, velatura::plugin, and those that they are made of
# (docs/reference/library.md).
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
find_dependency(hwy CONFIG)
find_dependency(expat 2.5 CONFIG)
# LZ4 has no CMake files of its own
find_dependency(PkgConfig)
if(NOT TARGET PkgConfig::LZ4)
  pkg_check_modules(LZ4 REQUIRED IMPORTED_TARGET liblz4)
endif()
include(${CMAKE_CURRENT_LIST_DIR}/velatura-targets.cmake)
