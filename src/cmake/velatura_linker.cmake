# SPDX-License-Identifier: Apache-2.0
# A fast linker where there is one: most of what a small edit waits for is linking test programs.
include(CheckLinkerFlag)
foreach(linker mold lld)
  check_linker_flag(CXX -fuse-ld=${linker} VELATURA_HAS_${linker})
  if(VELATURA_HAS_${linker})
    add_link_options(-fuse-ld=${linker})
    break()
  endif()
endforeach()
