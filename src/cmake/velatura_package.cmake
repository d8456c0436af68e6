# SPDX-License-Identifier: Apache-2.0
# The Debian package that cpack makes: component runtime; each library that programs and plugins link is a dependency.
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
set(CPACK_INSTALL_CMAKE_PROJECTS "${CMAKE_BINARY_DIR};velatura;runtime;/")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS fonts-dejavu-core)  # of the window
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "path tracer for USD scenes that writes light layers
velatura renders a USD scene into an OpenEXR file that holds every bounce and
every light as a layer of its own; the layers sum to the beauty.
velatura-comp regrades, denoises, compares and merges such files without
another render; velatura-comp-ui is a light mixer with a window.")
include(CPack)
