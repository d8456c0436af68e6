# SPDX-License-Identifier: Apache-2.0
# Every third-party package that the core uses, all from Debian 12. Who may use which is decided by the tiers' DEPENDS.
find_package(Imath 3.1 CONFIG REQUIRED)
find_package(OpenEXR 3.1 CONFIG REQUIRED)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(OpenImageIO 2.4 CONFIG REQUIRED)
# Debian's target names the headers of an OpenCV that its package does not depend on and that we do not use
get_target_property(oiio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
list(REMOVE_ITEM oiio_includes /usr/include/opencv4)
set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${oiio_includes}")
# Debian puts OpenColorIO's CMake files directly into share/cmake, where CMake does not look by itself
find_package(OpenColorIO 2.1 CONFIG REQUIRED PATHS /usr/share/cmake)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(Threads REQUIRED)
# LZ4 has no CMake files of its own
find_package(PkgConfig REQUIRED)
pkg_check_modules(LZ4 REQUIRED IMPORTED_TARGET liblz4)
find_package(assimp 5.2 CONFIG REQUIRED)
