# SPDX-License-Identifier: Apache-2.0
# Every third-party package that the core uses, all from Debian 12. Who may use which is decided by the tiers' DEPENDS.
find_package(Imath 3.1 CONFIG REQUIRED)
find_package(OpenEXR 3.1 CONFIG REQUIRED)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
# Debian puts OpenColorIO's CMake files directly into share/cmake, where CMake does not look by itself
find_package(OpenColorIO 2.1 CONFIG REQUIRED PATHS /usr/share/cmake)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(ZLIB REQUIRED)
find_package(Threads REQUIRED)
# LZ4 has no CMake files of its own
find_package(PkgConfig REQUIRED)
pkg_check_modules(LZ4 REQUIRED IMPORTED_TARGET liblz4)
find_package(assimp 5.2 CONFIG REQUIRED)
find_package(expat 2.5 CONFIG REQUIRED)
