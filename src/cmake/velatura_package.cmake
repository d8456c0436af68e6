# SPDX-License-Identifier: Apache-2.0
# The Debian packages that cpack makes: velatura of component runtime, libvelatura-dev of component development, and
# python3-velatura of component python where the module is built. Each library that programs, plugins and module link is a dependency.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME velatura)
set(CPACK_PACKAGE_VENDOR Velatura)
# The maintainer of a package is who builds it: the names are those that Debian's own tools read
set(VELATURA_PACKAGE_CONTACT "" CACHE STRING "Maintainer of the Debian package, \"NAME <ADDRESS>\"; empty: \$DEBFULLNAME <\$DEBEMAIL>")
set(CPACK_PACKAGE_CONTACT "${VELATURA_PACKAGE_CONTACT}")
if(NOT CPACK_PACKAGE_CONTACT AND DEFINED ENV{DEBEMAIL})
  set(CPACK_PACKAGE_CONTACT "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
elseif(NOT CPACK_PACKAGE_CONTACT)
  # Policy wants an address, and the project has none: of a domain that never exists (RFC 2606)
  set(CPACK_PACKAGE_CONTACT "Velatura maintainers <maintainers@velatura.invalid>")
endif()
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_CMAKE_PROJECTS "${CMAKE_BINARY_DIR};velatura;ALL;/")
set(CPACK_COMPONENTS_ALL runtime development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME velatura)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libvelatura-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
# What find_package(velatura) looks for; the plugins are those of the same build
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "velatura (= ${PROJECT_VERSION}), g++, cmake, pkg-config, libimath-dev, libopenexr-dev, libopencolorio-dev, libtbb-dev, libhwy-dev, libfmt-dev, nlohmann-json3-dev, libcli11-dev, liblz4-dev, libssl-dev, zlib1g-dev, libexpat1-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "headers and static libraries of the path tracer velatura
The renderer as an object, the USD reader, light layers and their mixes, and
the interface of plugins, for find_package(velatura) of CMake.")
if(TARGET velatura_module)
  list(APPEND CPACK_COMPONENTS_ALL python)
  # A module is for one version of the interpreter, and opens the plugins of its own build alone
  get_property(python GLOBAL PROPERTY velatura_python_version)
  string(REPLACE "." ";" numbers ${python})
  list(GET numbers 1 minor)
  math(EXPR next "${minor} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-velatura)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "velatura (= ${PROJECT_VERSION}), python3 (>= ${python}), python3 (<< 3.${next}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "")
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "Python module of the path tracer velatura
Opens USD stages, renders them with every option of velatura render, hands
light layers over as NumPy arrays without a copy, and mixes them.")
endif()
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS fonts-dejavu-core)  # of the window
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION "path tracer for USD scenes that writes light layers
velatura renders a USD scene into an OpenEXR file that holds every bounce and
every light as a layer of its own; the layers sum to the beauty.
velatura-comp regrades, denoises, compares and merges such files without
another render; velatura-comp-ui is a light mixer with a window.")
include(CPack)
